//! Whether a hand can take hold of one of several objects without touching anything else: how it comes along its approach and
//! closes, among the other objects, in their container and beside the object itself.
//!
//! Distances are those of true meshes from the hand's solids, boxes and cylinders with their edges rounded by
//! [`EDGE_RADIUS`](kernel::contact::EDGE_RADIUS). A path is followed by conservative advancement (Mirtich 1996): in steps so
//! short that nothing can come nearer between them than is told.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use super::{
    closing::Closing,
    motion::motor_at,
    state::HandSearch,
    table::{STAND_OFF, TableWatch},
};
use crate::hand::Motor;
use kernel::contact::ContactSurface;

/// Clearances are told up to this [m].
const FAR: f64 = Passage::FAR;

/// So much farther than what is told are distances exact [m]: steps along a path are no shorter, where there is room.
const BEYOND: f64 = 0.002;

/// Error of a told clearance [m].
const TOLERANCE: f64 = Passage::TOLERANCE;

/// Something in a scene that a hand can touch.
#[derive(Clone)]
pub struct Obstacle {
    /// The true mesh.
    pub surface: Arc<ContactSurface>,
    /// Pose in the scene.
    pub scene_from_obstacle: IsometryMatrix3<f64>,
}

/// Objects in a container, one of which is to be grasped.
#[derive(Clone)]
pub struct Surroundings {
    /// The container, where it is more than a plane.
    pub container: Option<Obstacle>,
    /// Height of the plane below all that stands there, in the scene [m].
    pub ground: f64,
    /// The objects.
    pub objects: Vec<Obstacle>,
}

/// Something in the way of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InTheWay {
    /// The plane below all.
    Ground,
    /// The container.
    Container,
    /// The object that is to be grasped, where the hand comes.
    Target,
    /// Another object, by its index.
    Neighbour(usize),
}

/// Part of a hand's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PathStage {
    /// The hand in its posture, where it begins to close.
    Pregrasp,
    /// On the way there, from [`STAND_OFF`] before it.
    Approach,
    /// While it closes.
    Closing,
}

/// Result of following a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// Obstacle on the path, and the part of the path: the first by stage, and within one by the order of [`InTheWay`]. `None` where the
    /// hand is free.
    pub blocked: Option<(PathStage, InTheWay)>,
    /// Distance of the hand from what is in the way [m], below 0 where they overlap, by [`Self::DEEP`] at most; where it is free the
    /// least distance from anything but the target on its whole path, up to [`Self::FAR`].
    pub clearance: f64,
}

impl Passage {
    /// Clearances are told up to this [m].
    pub const FAR: f64 = 0.01;
    /// Clearances are told down to this far below 0 [m]. Whoever is deeper in something is not told how deep: a search for the
    /// deepest point of a hand in a wall takes longer than all the rest.
    pub const DEEP: f64 = 0.001;
    /// A told clearance is at most this much above the true one [m], and a hand is called free that comes nearer than its margin
    /// by less.
    pub const TOLERANCE: f64 = 1e-4;
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
    margin: f64,
}

/// Something that may be in the way, and how far the hand has to stay from it [m].
struct Thing<'s> {
    what: InTheWay,
    obstacle: &'s Obstacle,
    margin: f64,
}

/// The hand at one moment.
struct Moment<'m> {
    scene_from_base: IsometryMatrix3<f64>,
    frames: &'m [IsometryMatrix3<f64>],
}

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
        Self {
            closing: Closing::new(&search.hand, &search.solids),
            table: TableWatch::new(&search.hand, &search.solids),
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

    /// Follows the hand on its way to a grasp of object `target`, and until it has closed.
    ///
    /// # Panics
    /// When there is no such object.
    pub fn follow(&mut self, scene: &Surroundings, target: usize, grasp: &ClosingGrasp) -> Passage {
        self.follow_and_close(scene, target, &grasp.object_from_base, &grasp.posture, |_| grasp)
    }

    /// Follows the hand as [`Self::follow`] does, on its way to a grasp that is asked for where nothing is in the way before the hand
    /// closes: closing takes longer than all the rest.
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
    ) -> Passage {
        let object = &scene.objects[target];
        let scene_from_base = object.scene_from_obstacle * object_from_base;
        let joints = self.closing.hand.posture_values(posture);
        let posture: Vec<Motor> = posture.iter().copied().map(Motor::engaged).collect();
        let frames = self.closing.hand.link_frames(&joints);
        let back = scene_from_base.rotation * self.closing.hand.approach_direction(&frames) * -STAND_OFF;
        // The plane: a straight path is lowest at one of its ends.
        let shaped = self.table.lowest(&scene_from_base, &posture, &posture) - scene.ground;
        let on_approach = shaped + back.z.min(0.0);
        let margin = self.margin;
        let under = |stage: PathStage, clearance: f64| {
            let passage =
                Passage { blocked: Some((stage, InTheWay::Ground)), clearance: clearance.max(-Passage::DEEP) };
            Some(passage).filter(|_| clearance < margin)
        };
        if let Some(passage) = under(PathStage::Pregrasp, shaped) {
            return passage;
        }
        let mut least = FAR.min(on_approach);
        let things = self.things(scene, target);
        let moment = Moment { scene_from_base, frames: &frames };
        let blocked =
            |stage: PathStage, thing: &Thing, clearance: f64| Passage { blocked: Some((stage, thing.what)), clearance };
        for thing in &things {
            if let Some(clearance) = self.nearer_than_margin(thing, &moment) {
                return blocked(PathStage::Pregrasp, thing, clearance);
            }
        }
        if let Some(passage) = under(PathStage::Approach, on_approach) {
            return passage;
        }
        for thing in &things {
            match self.on_approach(thing, &moment, &back) {
                Err(clearance) => return blocked(PathStage::Approach, thing, clearance),
                Ok(_) if thing.what == InTheWay::Target => {}
                Ok(clearance) => least = least.min(clearance),
            }
        }
        let grasp = close(self);
        let closing = self.table.lowest(&scene_from_base, &posture, &grasp.closed) - scene.ground;
        if let Some(passage) = under(PathStage::Closing, closing) {
            return passage;
        }
        least = least.min(closing);
        // The target is what the hand closes on.
        for thing in things.iter().filter(|thing| thing.what != InTheWay::Target) {
            match self.while_closing(thing, &scene_from_base, [&posture, &grasp.closed]) {
                Err(clearance) => return blocked(PathStage::Closing, thing, clearance),
                Ok(clearance) => least = least.min(clearance),
            }
        }
        Passage { blocked: None, clearance: least }
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
            // As far apart as the distance that is asked for, at most.
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

    /// All that may be in the way beside the plane, in the order of [`InTheWay`].
    fn things<'s>(&self, scene: &'s Surroundings, target: usize) -> Vec<Thing<'s>> {
        let margin = self.margin;
        let container = scene.container.iter().map(|obstacle| Thing { what: InTheWay::Container, obstacle, margin });
        let obstacle = &scene.objects[target];
        let own = Thing { what: InTheWay::Target, obstacle, margin: -super::ALLOWED_OVERLAP };
        let others = scene.objects.iter().enumerate().filter(|(index, _)| *index != target);
        let others = others.map(|(index, obstacle)| Thing { what: InTheWay::Neighbour(index), obstacle, margin });
        container.chain([own]).chain(others).collect()
    }

    /// Distance of a solid of the hand from a mesh [m], exact from -[`Passage::DEEP`] to a reach; farther away a lower bound.
    fn distance(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
        solid: usize,
        reach: f64,
    ) -> f64 {
        let object_from_solid = self.closing.object_from_solid(object_from_base, frames, solid);
        let Closing { probes, scratch, .. } = &mut self.closing;
        surface.distance_within(&probes[solid], &object_from_solid, &(-Passage::DEEP..=reach), scratch)
    }

    /// The distance of the hand from something where it is below the margin [m], told down to [`Passage::DEEP`]; `None` where it
    /// is not.
    fn nearer_than_margin(&mut self, thing: &Thing, moment: &Moment) -> Option<f64> {
        let Thing { obstacle, margin, .. } = thing;
        let obstacle_from_base = obstacle.scene_from_obstacle.inverse() * moment.scene_from_base;
        let mut nearest = *margin;
        for solid in 0..self.closing.probes.len() {
            let distance = self.distance(&obstacle.surface, &obstacle_from_base, moment.frames, solid, nearest);
            nearest = nearest.min(distance);
            if nearest == -Passage::DEEP {
                break;
            }
        }
        Some(nearest).filter(|distance| distance < margin)
    }

    /// Follows the hand from where it begins to close backwards along its approach: its distance from something where that is
    /// below a margin, else the least distance, up to [`FAR`]; of the target no more is told than that it is not nearer.
    fn on_approach(&mut self, thing: &Thing, moment: &Moment, back: &Vector3<f64>) -> Result<f64, f64> {
        let obstacle_from_scene = thing.obstacle.scene_from_obstacle.inverse();
        let mut least = thing.told();
        for solid in 0..self.closing.probes.len() {
            thing.advance(&mut least, 1.0, STAND_OFF, |come, reach| {
                let moved = obstacle_from_scene * Translation3::from(back * come) * moment.scene_from_base;
                self.distance(&thing.obstacle.surface, &moved, moment.frames, solid, reach)
            })?;
        }
        Ok(least)
    }

    /// Follows the hand while it closes, all motors at their speeds: as [`HandPassage::on_approach`].
    fn while_closing(
        &mut self,
        thing: &Thing,
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
        for solid in 0..self.closing.probes.len() {
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
                self.distance(&thing.obstacle.surface, &obstacle_from_base, &frames, solid, reach)
            })?;
        }
        Ok(least)
    }
}

impl Thing<'_> {
    /// The least distance that is of interest before any is known [m].
    fn told(&self) -> f64 {
        if self.what == InTheWay::Target { 0.0 } else { FAR }
    }

    /// The least distance so far [m].
    fn least(&self, least: f64, distance: f64) -> f64 {
        if self.what == InTheWay::Target { least } else { least.min(distance) }
    }

    /// Advances from 0 to `end`, where no point of a solid moves by more than `speed` per unit [m]; `distance` says how far it is from
    /// the obstacle there, exactly up to a reach. An error is a distance below the margin.
    fn advance(
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

    /// Motion after which the distance may be told as it was [m]: it has come no nearer than the margin, and no nearer than the
    /// least so far, but for the tolerance.
    fn step(&self, distance: f64, least: f64) -> f64 {
        let to_margin = distance - self.margin;
        let to_least = distance - least + TOLERANCE;
        let step = if self.what == InTheWay::Target { to_margin } else { to_margin.min(to_least) };
        step.max(TOLERANCE)
    }
}
