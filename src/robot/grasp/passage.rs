//! Tests whether a hand can grasp one of several objects without touching anything else while it approaches and closes:
//! the other objects, their container and the target itself.
//!
//! Distances are those of true meshes from the described solids of the hand, edges included; the links that hold the
//! object have their edges rounded by [`EDGE_RADIUS`](kernel::contact::EDGE_RADIUS), since contacts need a direction. A
//! path is followed by conservative advancement (Mirtich 1996): in steps short enough that nothing between them can be
//! nearer than the returned distance.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use super::{
    closing::Closing,
    motion::motor_at,
    probes::{self, SolidProbes},
    solids::Solid,
    state::HandSearch,
    table::{STAND_OFF, TableWatch},
};
use crate::hand::{Hand, Motor};
use kernel::{
    contact::ContactSurface,
    words::{BothWays, PathStage},
};

/// Clearances are computed up to this [m].
const FAR: f64 = Passage::FAR;

/// Distances are exact up to this far beyond the returned clearance [m]: with enough room, steps along a path are no
/// shorter.
const BEYOND: f64 = 0.002;

/// Error of a returned clearance [m].
const TOLERANCE: f64 = Passage::TOLERANCE;

/// Something in a scene that a hand can touch.
#[derive(Clone)]
pub struct SceneObstacle {
    /// The true mesh.
    pub surface: Arc<ContactSurface>,
    /// Pose in the scene.
    pub scene_from_obstacle: IsometryMatrix3<f64>,
}

/// Objects in a container, one of which is the target.
#[derive(Clone)]
pub struct Surroundings {
    /// The container, where it is more than a plane.
    pub container: Option<SceneObstacle>,
    /// Height of the plane below all objects, in the scene [m].
    pub ground: f64,
    /// The objects.
    pub objects: Vec<SceneObstacle>,
}

/// Obstacle of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PathObstacle {
    /// The plane below all.
    Ground,
    /// The container.
    Container,
    /// The object to grasp.
    Target,
    /// Another object, by its index.
    Neighbour(usize),
}

/// Result of following a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Obstacle on the path, and the part of the path: the first by stage, and within one by the order of [`PathObstacle`]. `None` where the
    /// hand is free.
    pub blocked: Option<(PathStage, PathObstacle)>,
    /// Distance of the hand from the obstacle [m], below 0 where they overlap, down to -[`Self::DEEP`]; for a free hand
    /// the smallest distance from anything but the target on its whole path, up to [`Self::FAR`].
    pub clearance: f64,
}

impl Passage {
    /// Clearances are computed up to this [m].
    pub const FAR: f64 = 0.01;
    /// Clearances are computed down to this far below 0 [m]: a solid's overlap is the length by which its surface must
    /// shrink all around until it does not touch. Deeper overlaps have this value.
    pub const DEEP: f64 = probes::DEEP;
    /// A returned clearance is at most this much above the true one [m], and a hand counts as free if it is nearer than
    /// its margin by less.
    pub const TOLERANCE: f64 = probes::TOLERANCE;
}

/// A grasp of an object, as its hand closes on that object alone.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosingGrasp {
    /// The hand's base where it closes.
    pub object_from_base: IsometryMatrix3<f64>,
    /// The posture in which it comes, one value per driven joint.
    pub posture: Vec<f64>,
    /// The motors when it has closed.
    closed: Vec<Motor>,
}

/// Follows a hand through scenes; the memory of one thread.
pub struct HandPassage {
    closing: Closing,
    table: TableWatch,
    solids: Vec<SolidProbes>,
    margin: f64,
}

/// Possible obstacle, and the distance that the hand must keep from it [m].
pub(super) struct Thing<'s> {
    pub(super) what: PathObstacle,
    pub(super) obstacle: &'s SceneObstacle,
    pub(super) margin: f64,
}

/// The hand at one moment.
struct Moment {
    scene_from_base: IsometryMatrix3<f64>,
    frames: Vec<IsometryMatrix3<f64>>,
}

/// A hand that approaches a grasp.
struct Coming<'s> {
    /// All possible obstacles except the plane.
    things: Vec<Thing<'s>>,
    /// Height of the plane [m].
    ground: f64,
    scene_from_base: IsometryMatrix3<f64>,
    /// From where it closes back to where it comes from.
    back: Vector3<f64>,
    opened: Vec<Motor>,
    shaped: Vec<Motor>,
}

/// The least distance of a hand from anything but the object on a part of its way, up to [`FAR`]; an error is what ends it.
pub(super) type Free = Result<f64, Passage>;

impl ClosingGrasp {
    /// The motors when the hand has closed on the object, one per driven joint.
    pub fn closed(&self) -> &[Motor] {
        &self.closed
    }
}

impl HandPassage {
    /// A hand that keeps at least a margin from everything but the object that it grasps [m].
    ///
    /// # Panics
    /// When the margin is not at least 0 and below [`Passage::FAR`].
    pub fn new(search: &HandSearch, margin: f64) -> Self {
        assert!((0.0..FAR).contains(&margin), "a margin of {margin} m");
        let probes = |solid: &Solid| SolidProbes::new(&solid.shape).expect("no mesh is a solid of a hand");
        Self {
            closing: Closing::new(&search.hand, &search.solids),
            table: TableWatch::new(&search.hand, &search.solids),
            solids: search.solids.solids.iter().map(probes).collect(),
            margin,
        }
    }

    /// A grasp of an object, with the hand closed on it.
    ///
    /// # Panics
    /// When the posture has not one value per driven joint.
    pub fn close(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
    ) -> ClosingGrasp {
        let closed = self.closing.close(surface, object_from_base, posture).motors;
        ClosingGrasp { object_from_base: *object_from_base, posture: posture.to_vec(), closed }
    }

    /// Follows the hand on both its ways to a grasp of object `target`, and until it has closed.
    ///
    /// # Panics
    /// When there is no such object.
    pub fn follow(&mut self, scene: &Surroundings, target: usize, grasp: &ClosingGrasp) -> BothWays<Passage> {
        self.follow_and_close(scene, target, &grasp.object_from_base, &grasp.posture, |_| grasp)
    }

    /// Follows the hand like [`Self::follow`], but calls `close` for the grasp only if one of its approaches is free
    /// before the hand closes: closing takes longer than all other steps.
    ///
    /// # Panics
    /// When there is no such object, or the posture has not one value per driven joint.
    pub fn follow_and_close<'g>(
        &mut self,
        scene: &Surroundings,
        target: usize,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
        close: impl FnOnce(&mut Self) -> &'g ClosingGrasp,
    ) -> BothWays<Passage> {
        let coming = self.coming(scene, target, object_from_base, posture);
        // Where it begins to close the hand is on either way.
        if let Err(blocked) = self.standing(&coming) {
            return BothWays { shaped: blocked, opened: blocked };
        }
        let ways = match self.both_ways(&coming) {
            BothWays { shaped: Err(shaped), opened: Err(opened) } => return BothWays { shaped, opened },
            ways => ways,
        };
        let grasp = close(self);
        let closed = self.closed(&coming, grasp);
        let whole = |way: Free| {
            let free = way.and_then(|least| Ok(least.min(closed?)));
            free.map_or_else(|blocked| blocked, |clearance| Passage { blocked: None, clearance })
        };
        BothWays { shaped: whole(ways.shaped), opened: whole(ways.opened) }
    }

    /// Whether the object itself blocks the hand before it closes, on each approach: without other objects and without
    /// a plane.
    ///
    /// # Panics
    /// When the posture has not one value per driven joint.
    pub fn past_object(
        &mut self,
        surface: &Arc<ContactSurface>,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
    ) -> BothWays<Option<PathStage>> {
        let object = SceneObstacle { surface: Arc::clone(surface), scene_from_obstacle: IsometryMatrix3::identity() };
        let alone = Surroundings { container: None, ground: f64::NEG_INFINITY, objects: vec![object] };
        let coming = self.coming(&alone, 0, object_from_base, posture);
        let stage = |way: Free| way.err().and_then(|passage| passage.blocked).map(|(stage, _)| stage);
        if let Err(blocked) = self.standing(&coming) {
            let stage = stage(Err(blocked));
            return BothWays { shaped: stage, opened: stage };
        }
        let BothWays { shaped, opened } = self.both_ways(&coming);
        BothWays { shaped: stage(shaped), opened: stage(opened) }
    }

    /// Indices of the objects that come within a distance of the hand on its path for sure or perhaps [m], but for the target.
    pub fn near(&mut self, scene: &Surroundings, target: usize, grasp: &ClosingGrasp, distance: f64) -> Vec<usize> {
        let scene_from_base = scene.objects[target].scene_from_obstacle * grasp.object_from_base;
        let hand = Arc::clone(&self.closing.hand);
        let posture: Vec<Motor> = grasp.posture.iter().copied().map(Motor::engaged).collect();
        let shaped = hand.link_frames(&hand.posture_values(&grasp.posture));
        let back = scene_from_base.rotation * hand.approach_direction(&shaped) * -STAND_OFF;
        let mut joints = vec![0.0; hand.tree().len()];
        let mut near = Vec::new();
        for motors in [&posture, &grasp.closed] {
            hand.joint_values(motors, &mut joints);
            let frames = hand.link_frames(&joints);
            // At most the requested distance apart.
            let steps = (STAND_OFF / distance).ceil().max(1.0) as u32;
            for step in 0..=steps {
                let moved = Translation3::from(back * (f64::from(step) / f64::from(steps))) * scene_from_base;
                for (index, object) in scene.objects.iter().enumerate() {
                    let obstacle_from_base = object.scene_from_obstacle.inverse() * moved;
                    let comes = |solid: usize| {
                        let placed = self.closing.object_from_solid(&obstacle_from_base, &frames, solid);
                        object.surface.clearance_at_least(&self.closing.probes[solid], &placed) < 1.5 * distance
                    };
                    if index != target && !near.contains(&index) && (0..self.closing.probes.len()).any(comes) {
                        near.push(index);
                    }
                }
            }
        }
        near.sort_unstable();
        near
    }

    /// The hand on its way to a grasp of object `target`.
    fn coming<'s>(
        &self,
        scene: &'s Surroundings,
        target: usize,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
    ) -> Coming<'s> {
        let hand = &self.closing.hand;
        let scene_from_base = scene.objects[target].scene_from_obstacle * object_from_base;
        let frames = hand.link_frames(&hand.posture_values(posture));
        let engaged = |values: &[f64]| values.iter().copied().map(Motor::engaged).collect();
        Coming {
            things: things(scene, target, self.margin),
            ground: scene.ground,
            scene_from_base,
            back: scene_from_base.rotation * hand.approach_direction(&frames) * -STAND_OFF,
            opened: engaged(&hand.opening(posture)),
            shaped: engaged(posture),
        }
    }

    /// The hand in its posture, where it begins to close.
    fn standing(&mut self, coming: &Coming<'_>) -> Result<(), Passage> {
        let lowest = self.lowest(coming, [&coming.shaped, &coming.shaped]);
        above_ground(PathStage::Pregrasp, lowest, self.margin)?;
        let moment = coming.moment(&self.closing.hand, &coming.shaped);
        for thing in &coming.things {
            if let Some(clearance) = self.nearer_than_margin(thing, &moment) {
                return Err(thing.blocks(PathStage::Pregrasp, clearance));
            }
        }
        Ok(())
    }

    /// The hand until it begins to close; its pose there is known to be free.
    fn both_ways(&mut self, coming: &Coming<'_>) -> BothWays<Free> {
        let shaped = self.approaching(coming, &coming.shaped);
        if coming.opened == coming.shaped {
            return BothWays { shaped, opened: shaped };
        }
        let opened = self.approaching(coming, &coming.opened);
        BothWays { shaped, opened: opened.and_then(|least| Ok(least.min(self.shaping(coming)?))) }
    }

    /// The hand along its approach, its motors still.
    fn approaching(&mut self, coming: &Coming<'_>, motors: &[Motor]) -> Free {
        // A straight path is lowest at one of its ends.
        let lowest = self.lowest(coming, [motors, motors]) + coming.back.z.min(0.0);
        above_ground(PathStage::Approach, lowest, self.margin)?;
        let moment = coming.moment(&self.closing.hand, motors);
        let mut least = FAR.min(lowest);
        for thing in &coming.things {
            let nearest = self.on_approach(thing, &moment, &coming.back);
            least = thing.least(least, nearest.map_err(|clearance| thing.blocks(PathStage::Approach, clearance))?);
        }
        Ok(least)
    }

    /// The hand that has come opened, until it has its posture.
    fn shaping(&mut self, coming: &Coming<'_>) -> Free {
        self.moving(coming, PathStage::Shaping, [&coming.opened, &coming.shaped])
    }

    /// The hand until it has closed.
    fn closed(&mut self, coming: &Coming<'_>, grasp: &ClosingGrasp) -> Free {
        self.moving(coming, PathStage::Closing, [&coming.shaped, &grasp.closed])
    }

    /// The hand where it closes, while its motors move.
    fn moving(&mut self, coming: &Coming<'_>, stage: PathStage, motors: [&[Motor]; 2]) -> Free {
        let lowest = self.lowest(coming, motors);
        above_ground(stage, lowest, self.margin)?;
        let mut least = FAR.min(lowest);
        for thing in &coming.things {
            // The hand closes on the target.
            if stage == PathStage::Closing && thing.what == PathObstacle::Target {
                continue;
            }
            let nearest = self.while_moving(thing, &coming.scene_from_base, motors);
            least = thing.least(least, nearest.map_err(|clearance| thing.blocks(stage, clearance))?);
        }
        Ok(least)
    }

    /// The lowest point of the hand over the plane while its motors move where it closes [m].
    fn lowest(&self, coming: &Coming<'_>, [start, end]: [&[Motor]; 2]) -> f64 {
        self.table.lowest(&coming.scene_from_base, start, end) - coming.ground
    }

    /// Distance of a solid of the hand from something [m], exact from -[`Passage::DEEP`] to a reach; farther away a lower bound.
    fn distance(
        &mut self,
        thing: &Thing<'_>,
        obstacle_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
        solid: usize,
        reach: f64,
    ) -> f64 {
        let placed = self.closing.object_from_solid(obstacle_from_base, frames, solid);
        let Self { closing: Closing { scratch, .. }, solids, .. } = self;
        let is_target = thing.what == PathObstacle::Target;
        solids[solid].distance(&thing.obstacle.surface, &placed, reach, is_target, scratch)
    }

    /// The distance of the hand from something if it is below the margin [m], down to -[`Passage::DEEP`]; `None`
    /// otherwise.
    fn nearer_than_margin(&mut self, thing: &Thing<'_>, moment: &Moment) -> Option<f64> {
        let obstacle_from_base = thing.obstacle.scene_from_obstacle.inverse() * moment.scene_from_base;
        let mut nearest = thing.margin;
        for solid in 0..self.solids.len() {
            nearest = nearest.min(self.distance(thing, &obstacle_from_base, &moment.frames, solid, nearest));
            if nearest == -Passage::DEEP {
                break;
            }
        }
        Some(nearest).filter(|distance| *distance < thing.margin)
    }

    /// Follows the hand backwards along its approach from where it begins to close. Returns the smallest distance from
    /// something up to [`FAR`], or as an error the distance below its margin; for the target, only whether it is
    /// nearer.
    fn on_approach(&mut self, thing: &Thing<'_>, moment: &Moment, back: &Vector3<f64>) -> Result<f64, f64> {
        let obstacle_from_scene = thing.obstacle.scene_from_obstacle.inverse();
        let mut least = thing.told();
        for solid in 0..self.solids.len() {
            thing.advance(&mut least, 1.0, STAND_OFF, |come, reach| {
                let moved = obstacle_from_scene * Translation3::from(back * come) * moment.scene_from_base;
                self.distance(thing, &moved, &moment.frames, solid, reach)
            })?;
        }
        Ok(least)
    }

    /// Follows the hand while its motors move at their speeds: as [`HandPassage::on_approach`].
    fn while_moving(
        &mut self,
        thing: &Thing<'_>,
        scene_from_base: &IsometryMatrix3<f64>,
        [start, end]: [&[Motor]; 2],
    ) -> Result<f64, f64> {
        let hand = Arc::clone(&self.closing.hand);
        let obstacle_from_base = thing.obstacle.scene_from_obstacle.inverse() * scene_from_base;
        let times = hand.driven().iter().zip(start.iter().zip(end));
        let duration =
            times.map(|(driven, (start, end))| (end.angle - start.angle).abs() / driven.speed).fold(0.0, f64::max);
        let mut least = thing.told();
        let mut joints = vec![0.0; hand.tree().len()];
        for solid in 0..self.solids.len() {
            let speed = self.closing.speed_bound(solid, start, end);
            // What does not move was looked at where the hand begins to close.
            if speed == 0.0 {
                continue;
            }
            thing.advance(&mut least, duration, speed, |time, reach| {
                let driven = hand.driven().iter().zip(start.iter().zip(end));
                let now: Vec<Motor> =
                    driven.map(|(driven, (start, end))| motor_at(*start, *end, driven, time * driven.speed)).collect();
                hand.joint_values(&now, &mut joints);
                let frames = hand.link_frames(&joints);
                self.distance(thing, &obstacle_from_base, &frames, solid, reach)
            })?;
        }
        Ok(least)
    }
}

impl Coming<'_> {
    /// The hand where it closes, its motors like this.
    fn moment(&self, hand: &Hand, motors: &[Motor]) -> Moment {
        let mut joints = vec![0.0; hand.tree().len()];
        hand.joint_values(motors, &mut joints);
        Moment { scene_from_base: self.scene_from_base, frames: hand.link_frames(&joints) }
    }
}

/// Whether a tool keeps its margin from the plane, by its lowest point over it [m].
pub(super) fn above_ground(stage: PathStage, lowest: f64, margin: f64) -> Result<(), Passage> {
    if lowest >= margin {
        return Ok(());
    }
    Err(Passage { blocked: Some((stage, PathObstacle::Ground)), clearance: lowest.max(-Passage::DEEP) })
}

/// All possible obstacles except the plane, in the order of [`PathObstacle`].
pub(super) fn things(scene: &Surroundings, target: usize, margin: f64) -> Vec<Thing<'_>> {
    let container = scene.container.iter().map(|obstacle| Thing { what: PathObstacle::Container, obstacle, margin });
    // The solids already include the allowed overlap with the target.
    let own = Thing { what: PathObstacle::Target, obstacle: &scene.objects[target], margin: 0.0 };
    let others = scene.objects.iter().enumerate().filter(|(index, _)| *index != target);
    let others = others.map(|(index, obstacle)| Thing { what: PathObstacle::Neighbour(index), obstacle, margin });
    container.chain([own]).chain(others).collect()
}

impl Thing<'_> {
    /// The passage that this ends, at a distance [m].
    pub(super) fn blocks(&self, stage: PathStage, clearance: f64) -> Passage {
        Passage { blocked: Some((stage, self.what)), clearance }
    }

    /// The least distance that is of interest before any is known [m].
    pub(super) fn told(&self) -> f64 {
        if self.what == PathObstacle::Target { 0.0 } else { FAR }
    }

    /// The least distance so far [m].
    pub(super) fn least(&self, least: f64, distance: f64) -> f64 {
        if self.what == PathObstacle::Target { least } else { least.min(distance) }
    }

    /// Advances from 0 to `end`, where no point of a solid moves by more than `speed` per unit [m]; `distance` returns
    /// its distance from the obstacle, exact up to a reach. An error is a distance below the margin.
    pub(super) fn advance(
        &self,
        least: &mut f64,
        end: f64,
        speed: f64,
        mut distance: impl FnMut(f64, f64) -> f64,
    ) -> Result<(), f64> {
        let mut at = 0.0;
        loop {
            let now = distance(at, *least + BEYOND);
            if now < self.margin {
                return Err(now);
            }
            *least = self.least(*least, now);
            if at == end {
                return Ok(());
            }
            at = f64::min(at + self.step(now, *least) / speed, end);
        }
    }

    /// Motion during which the previous distance remains valid [m]: nothing comes nearer than the margin, nor nearer
    /// than the smallest distance so far minus the tolerance.
    fn step(&self, distance: f64, least: f64) -> f64 {
        let to_margin = distance - self.margin;
        let to_least = distance - least + TOLERANCE;
        let step = if self.what == PathObstacle::Target { to_margin } else { to_margin.min(to_least) };
        step.max(TOLERANCE)
    }
}
