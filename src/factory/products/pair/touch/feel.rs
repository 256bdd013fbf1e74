//! Touch by a hand (thesis ch. 6): it explores what the camera did not see, or takes hold once from the side.
//!
//! An exploration goes to cells of the surface that the camera did not see and that its partial grid does not contain:
//! of many approaches those are made that are [predicted](Forecast) to touch the most of such cells and the fewest in
//! sight. The hand stops at its first contact; then each finger curls until it has a contact or reaches its limit. With
//! [`ExplorationTarget::FacingAway`], as in the thesis, the opened hand goes to points that face away from the camera,
//! along their inward normals. The tactile grasp moves along the image plane to the middle of the object's box, the
//! fingers closing across the optical axis. Fingers give way to a contact that presses with more than a fingertip can
//! hold.
//!
//! Among fixed obstacles, a hand that meets one of these on its path is blocked, and a finger that meets one stops
//! there.

use std::{collections::BTreeSet, f64::consts::PI, sync::Arc};

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::{
    forecast::Forecast,
    rays::{cell_of, single},
    seen::SeenSurface,
    settings::{Exploration, ExplorationTarget, TouchByHand},
    still::StillAround,
};
use crate::{ProduceError, sections::JobHand};
use assets::object::PreparedObject;
use format::{Approach, BlockedProbe, Channel, HandTouch, LinkContact, TactileContacts, TouchContact, VoxelPair};
use kernel::{
    contact::ContactSurface,
    geom::{CameraCv, Object, Pose, farthest_first, rotation_towards},
    seed::Stream,
};
use sim::{Effort, HandApproach, HandApproachEnd, HandModel, HandSim, HandWorker, ThingTouch};

/// Points of the surface that are drawn to choose from.
const DRAWN: u32 = 256;

/// Number of predicted movements to unseen cells, and how far closed the hand is in them, as shares of the path to the
/// posture in which its fingertips are foremost.
const CANDIDATES: usize = 240;
const POSTURES: [f64; 3] = [0.0, 0.5, 1.0];

/// Unseen cells that outweigh a contact in the camera's sight.
const IN_SIGHT: f64 = 1.0;

/// Cosine of the smallest angle between the direction from the camera and the normal of a point that is gone to, so that the
/// hand comes from behind.
const FACES_AWAY: f64 = 0.1;

/// Largest distance that the palm goes beyond the position that it was sent to [m].
const BEYOND: f64 = 0.02;

/// A job's hand, read once per thread.
pub struct TouchingHand {
    model: HandModel,
    scene: String,
}

impl TouchingHand {
    /// Reads the hand.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn new(hand: &JobHand) -> Result<Self, ProduceError> {
        let scene = hand.file.display().to_string();
        let model = HandModel::open(&hand.file).map_err(|error| ProduceError::unusable(&scene, error))?;
        Ok(Self { model, scene })
    }

    /// With an object to touch.
    ///
    /// # Errors
    /// When the mesh has no surface, or the hand cannot touch true meshes.
    pub fn on_object(&self, object: &PreparedObject) -> Result<HandOnObject, ProduceError> {
        let surface = object.contact_surface().map_err(|error| ProduceError::unusable(&self.scene, error))?;
        self.among(surface, StillAround::default())
    }

    /// With an object to touch among fixed obstacles.
    ///
    /// # Errors
    /// When the hand cannot touch true meshes, or a pose is not finite.
    pub fn among(&self, surface: &Arc<ContactSurface>, around: StillAround) -> Result<HandOnObject, ProduceError> {
        let sim = HandSim::with_mesh_among(&self.model, surface, &around.things);
        let sim = sim.map_err(|error| ProduceError::unusable(&self.scene, error))?;
        let bounds = surface.bounds();
        let hand = sim.hand();
        let foremost = hand.foremost_share();
        let reach = POSTURES.map(|share| sim.reach(&hand.partly_closed(share * foremost)));
        let reach = reach.into_iter().fold(0.0, f64::max);
        let max_force = hand.fingertip_force().unwrap_or(f64::INFINITY);
        Ok(HandOnObject {
            centre: bounds.centre(),
            far: (bounds.max - bounds.min).norm() + reach,
            foremost,
            forecast: Forecast::new(hand),
            max_force,
            worker: HandWorker::new(&Arc::new(sim)),
            surface: Arc::clone(surface),
            around,
            scene: self.scene.clone(),
        })
    }
}

/// One thread's hand and the object that it touches.
pub struct HandOnObject {
    worker: HandWorker,
    surface: Arc<ContactSurface>,
    around: StillAround,
    /// The middle of the object's box, in `Object`.
    centre: Point3<f64>,
    /// So far from any point of the object the hand is clear of it [m].
    far: f64,
    /// Share of their way at which the closing fingers are foremost.
    foremost: f64,
    forecast: Forecast,
    /// Force that the hand's fingertips bear [N].
    max_force: f64,
    scene: String,
}

/// A movement of the hand towards a target, expressed in camera axes.
#[derive(Clone, Copy)]
struct PlannedTouch {
    target: Point3<f64>,
    /// Columns are the axes of the approach frame; z is the direction of motion.
    rotation: Matrix3<f64>,
    /// Share of their way that the fingers have gone.
    closed: f64,
    effort: Effort,
}

impl HandOnObject {
    /// Touches the object of a pair as a channel requires. `stream` gives the sample's own stream of a name;
    /// `drop_index_zero` is the quirk of the pair's grids: a contact in a cell with index 0 on any axis counts as
    /// outside.
    ///
    /// # Errors
    /// When a point is not finite.
    pub fn touch(
        &mut self,
        channel: Channel,
        by_hand: &TouchByHand,
        pair: &VoxelPair,
        seen: &SeenSurface<'_>,
        drop_index_zero: bool,
        stream: impl FnOnce(&str) -> Stream,
    ) -> Result<TactileContacts, ProduceError> {
        // Channel's plan: one tactile grasp, or a number of exploratory approaches.
        let plan = match channel {
            Channel::TOUCH_GRASP => vec![self.grasp(&pair.camera_from_object, &mut stream("tactile grasp"))],
            _ => {
                let stream = &mut stream("exploration");
                match by_hand.exploration {
                    Some(Exploration { approaches, target: ExplorationTarget::UnseenCells }) => {
                        self.to_unseen_cells(approaches, pair, seen, drop_index_zero, stream)
                    }
                    Some(Exploration { approaches, .. }) => self.to_points_facing_away(approaches, pair, seen, stream),
                    None => Vec::new(),
                }
            }
        };
        let hand = Arc::clone(self.worker.hand());
        let joints = hand.tree().joints().iter().map(|joint| joint.joint.name.clone()).collect();
        let (name, links) = (hand.name().to_owned(), hand.links().to_vec());
        // Names of the hand's links and joints, to which the records below refer by index.
        let mut by_hand = HandTouch { hand: name, links, joints, ..HandTouch::default() };
        let mut out = TactileContacts::none(pair.sample);
        (out.resolution, out.probes) = (pair.grid.resolution, plan.len() as u32);
        for (probe, planned) in plan.iter().enumerate() {
            let (approach, start) = self.approach(planned, &pair.camera_from_object);
            let camera_from_object = pair.camera_from_object.isometry();
            let felt = self.worker.feel(&approach).map_err(|error| ProduceError::unusable(&self.scene, error))?;
            // Approach without any touch: its start is recorded as a miss, or what was in its way.
            if felt.touches.is_empty() && felt.stops.is_empty() {
                out.misses.push(single(&start));
            }
            for ThingTouch { thing, point, .. } in &felt.stops {
                let position = single(&(camera_from_object * point));
                out.blocked.push(BlockedProbe { probe: probe as u32, by: self.around.numbers[*thing], position });
            }
            // Contacts, transformed to camera axes: voxel cell, visibility from the camera, and force and gap of the touch.
            for touch in &felt.touches {
                let point = camera_from_object * touch.point;
                let normal = Unit::new_normalize(camera_from_object.rotation * touch.normal.into_inner());
                let position = single(&point);
                out.contacts.push(TouchContact {
                    probe: probe as u32,
                    position,
                    normal: normal.map(|part| part as f32).into(),
                    distance: felt.travelled.max(0.0) as f32,
                    visible: seen.sees(&point, &normal),
                    cell: cell_of(&pair.grid, position).filter(|cell| !(drop_index_zero && cell.contains(&0))),
                });
                let (force, gap) = (touch.force as f32, touch.distance as f32);
                by_hand.contacts.push(LinkContact { link: touch.link as u32, force, gap });
            }
            // End of the approach: pose of the hand in camera axes, and its joint values.
            by_hand.approaches.push(Approach {
                camera_from_hand: Pose::from_isometry(camera_from_object * felt.object_from_base),
                joints: felt.joints,
                end: recorded(felt.end),
            });
        }
        out.hand = Some(by_hand);
        Ok(out)
    }

    /// The approach of a movement, and where its palm starts in camera axes: off the target against the direction of motion, clear of
    /// the object.
    fn approach(
        &self,
        planned: &PlannedTouch,
        camera_from_object: &Pose<CameraCv, Object>,
    ) -> (HandApproach, Point3<f64>) {
        let start = planned.target - planned.rotation.column(2) * self.far;
        let rotation = Rotation3::from_matrix_unchecked(planned.rotation);
        let camera_from_start = IsometryMatrix3::from_parts(Translation3::from(start), rotation);
        let object_from_start = camera_from_object.isometry().inv_mul(&camera_from_start);
        let (distance, effort) = (self.far + BEYOND, planned.effort.giving_way_at(self.max_force));
        (HandApproach { object_from_start, distance, closed: planned.closed, effort }, start)
    }

    /// Movements by which the hand is to touch cells that are not known: the camera does not see them, and the partial grid does not
    /// hold them. Of many that go to such cells, those are taken one after another that are forecast to touch most more of them.
    fn to_unseen_cells(
        &self,
        count: u32,
        pair: &VoxelPair,
        seen: &SeenSurface<'_>,
        drop_index_zero: bool,
        stream: &mut Stream,
    ) -> Vec<PlannedTouch> {
        let camera_from_object = &pair.camera_from_object;
        let view = |(point, normal): (Point3<f64>, Vector3<f64>)| {
            (camera_from_object.point(&point), camera_from_object.rotation() * normal)
        };
        let cell_of = |point: &Point3<f64>| {
            cell_of(&pair.grid, single(point)).filter(|cell| !(drop_index_zero && cell.contains(&0)))
        };
        // The cell of a point that is not known; outside the grid nothing can be learned.
        let unknown = |(point, normal): &(Point3<f64>, Vector3<f64>)| {
            cell_of(point).filter(|cell| !pair.partial.get(*cell) && !seen.sees(point, normal))
        };
        // Points of the surface in unknown cells.
        let draw = |stream: &mut Stream| {
            let [share, u, v] = [(); 3].map(|()| stream.unit());
            self.surface.point_at(share, u, v).map(view).filter(|drawn| unknown(drawn).is_some())
        };
        let mut targets: Vec<_> = (0..DRAWN).filter_map(|_| draw(stream)).collect();
        if targets.is_empty() {
            // A sheet that is seen all over: straight from behind.
            targets.push((camera_from_object.point(&self.centre), Vector3::z()));
        }
        // Movements to them: from behind or along the inward normal, in a scene also from above; opened, half closed or with the
        // fingertips foremost.
        let down = self.around.down.map(|down| camera_from_object.rotation() * down);
        let ways = if down.is_some() { 3 } else { 2 };
        let candidates: Vec<PlannedTouch> = (0..CANDIDATES)
            .map(|index| {
                let (target, normal) = targets[index % targets.len()];
                let ahead = match (index % ways, down) {
                    (0, _) => -target.coords.normalize(),
                    (2, Some(down)) => down,
                    _ => -normal,
                };
                let closed = self.foremost * POSTURES[index / ways % POSTURES.len()];
                let rotation = rotation_towards(&ahead, stream.uniform(-PI, PI));
                PlannedTouch { target, rotation, closed, effort: Effort::FEEL }
            })
            .collect();
        let forecasts: Vec<(BTreeSet<[u32; 3]>, f64)> = candidates
            .iter()
            .map(|planned| {
                let (approach, _) = self.approach(planned, camera_from_object);
                let HandApproach { object_from_start, distance, closed, .. } = &approach;
                let touches = self.forecast.touches(&self.surface, &self.around, object_from_start, *distance, *closed);
                let touches: Vec<_> = touches.into_iter().map(view).collect();
                let in_sight = touches.iter().filter(|(point, normal)| seen.sees(point, normal)).count();
                (touches.iter().filter_map(unknown).collect(), in_sight as f64)
            })
            .collect();
        // The best one after another, by cells that are not adjacent to those that are predicted already.
        let mut found: BTreeSet<[u32; 3]> = BTreeSet::new();
        let mut left: Vec<usize> = (0..candidates.len()).collect();
        let mut taken = Vec::new();
        for _ in 0..count {
            let is_new =
                |cell: &&[u32; 3]| !found.iter().any(|other| cell.iter().zip(other).all(|(a, b)| a.abs_diff(*b) <= 1));
            let gain = |index: usize| {
                let (cells, in_sight) = &forecasts[index];
                cells.iter().filter(is_new).count() as f64 - IN_SIGHT * in_sight
            };
            let best = left.iter().copied().enumerate().map(|(at, index)| (at, gain(index)));
            let best = best.fold(None, |best: Option<(usize, f64)>, next| match best {
                Some(best) if best.1 >= next.1 => Some(best),
                _ => Some(next),
            });
            // More approaches than candidates: the first again.
            let index = best.map_or(0, |(at, _)| left.remove(at));
            found.extend(&forecasts[index].0);
            taken.push(candidates[index]);
        }
        taken
    }

    /// Movements to points of the hidden surface that face away from the camera, along their inward normals, each point as far
    /// from those before as can be.
    fn to_points_facing_away(
        &self,
        count: u32,
        pair: &VoxelPair,
        seen: &SeenSurface<'_>,
        stream: &mut Stream,
    ) -> Vec<PlannedTouch> {
        let camera_from_object = &pair.camera_from_object;
        let mut hidden: Vec<(Point3<f64>, Vector3<f64>)> = Vec::new();
        for _ in 0..DRAWN {
            let [share, u, v] = [(); 3].map(|()| stream.unit());
            let Some((point, normal)) = self.surface.point_at(share, u, v) else { continue };
            let (point, normal) = (camera_from_object.point(&point), camera_from_object.rotation() * normal);
            let away = point.coords.normalize();
            if normal.dot(&away) > FACES_AWAY && !seen.sees(&point, &Unit::new_unchecked(normal)) {
                hidden.push((point, normal));
            }
        }
        if hidden.is_empty() {
            // A sheet that is seen all over: straight from behind.
            let centre = camera_from_object.point(&self.centre);
            hidden.push((centre, centre.coords.normalize()));
        }
        let points: Vec<Point3<f64>> = hidden.iter().map(|(point, _)| *point).collect();
        farthest_first(&points, count)
            .into_iter()
            .map(|taken| {
                let (target, out) = hidden[taken];
                let roll = stream.uniform(-PI, PI);
                PlannedTouch { target, rotation: rotation_towards(&-out, roll), closed: 0.0, effort: Effort::FEEL }
            })
            .collect()
    }

    /// A movement along the image plane.
    fn grasp(&self, camera_from_object: &Pose<CameraCv, Object>, stream: &mut Stream) -> PlannedTouch {
        let (sin, cos) = libm::sincos(stream.uniform(-PI, PI));
        let (approach, across) = (Vector3::new(cos, sin, 0.0), Vector3::z());
        let rotation = Matrix3::from_columns(&[across.cross(&approach), across, approach]);
        PlannedTouch { target: camera_from_object.point(&self.centre), rotation, closed: 0.0, effort: Effort::GRASP }
    }
}

fn recorded(end: HandApproachEnd) -> format::ApproachEnd {
    use format::ApproachEnd as Recorded;
    match end {
        HandApproachEnd::AtRest => Recorded::AtRest,
        HandApproachEnd::TimedOut => Recorded::TimedOut,
        HandApproachEnd::Missed => Recorded::Missed,
        HandApproachEnd::Unstable => Recorded::Unstable,
        HandApproachEnd::Overloaded => Recorded::Overloaded,
        HandApproachEnd::Blocked => Recorded::Blocked,
    }
}
