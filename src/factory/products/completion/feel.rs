//! Touch by a hand (thesis ch. 6): it explores what the camera did not see, or takes hold once from the side.
//!
//! An exploration goes to points spread over the hidden surface that face away from the camera. The opened hand comes along
//! the point's inward normal, its palm ahead, at a random roll; it stops where it touches first, and each finger curls until
//! it has its own contact or its limit. The tactile grasp comes along the image plane to the
//! middle of the object's box, the fingers closing across the optical axis, and closes with all its force.

use std::{f64::consts::PI, sync::Arc};

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::{
    settings::TouchByHand,
    touch::{SeenSurface, cell_of, single},
};
use crate::{ProduceError, job::JobHand};
use format::{Approach, Channel, Felt, HandTouch, TactileContacts, TouchContact, VoxelPair};
use kernel::{
    contact::ContactSurface,
    geom::{CameraCv, Object, Pose, farthest_first, rotation_towards},
    object::PreparedObject,
    seed::Stream,
};
use sim::{ApproachEnd, Effort, HandApproach, HandModel, HandSim, HandWorker};

/// Points of the surface that are drawn to choose from.
const DRAWN: u32 = 256;

/// Cosine of the smallest angle between the direction from the camera and the normal of a point that is gone to, so that the
/// hand comes from behind.
const FACES_AWAY: f64 = 0.1;

/// Largest distance that the palm goes beyond the position that it was sent to [m].
const BEYOND: f64 = 0.02;

/// A job's hand, read once per thread.
pub(super) struct TouchingHand {
    model: HandModel,
    scene: String,
}

impl TouchingHand {
    /// Reads the hand.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn new(hand: &JobHand) -> Result<Self, ProduceError> {
        let scene = hand.scene.display().to_string();
        let model = HandModel::open(&hand.scene).map_err(|error| ProduceError::unusable(&scene, error))?;
        Ok(Self { model, scene })
    }

    /// With an object to touch.
    ///
    /// # Errors
    /// When the mesh has no surface, or the hand cannot touch true meshes.
    pub fn on_object(&self, object: &PreparedObject) -> Result<HandOnObject, ProduceError> {
        let surface = object.contact_surface().map_err(|error| ProduceError::unusable(&self.scene, error))?;
        let sim =
            HandSim::with_mesh(&self.model, surface).map_err(|error| ProduceError::unusable(&self.scene, error))?;
        let bounds = surface.bounds();
        Ok(HandOnObject {
            centre: bounds.centre(),
            far: (bounds.max - bounds.min).norm() + sim.reach(),
            worker: HandWorker::new(&Arc::new(sim)),
            surface: Arc::clone(surface),
            scene: self.scene.clone(),
        })
    }
}

/// One thread's hand and the object that it touches.
pub(super) struct HandOnObject {
    worker: HandWorker,
    surface: Arc<ContactSurface>,
    /// The middle of the object's box, in `Object`.
    centre: Point3<f64>,
    /// So far from any point of the object the opened hand is clear of it [m].
    far: f64,
    scene: String,
}

/// A movement of the hand towards a target, expressed in camera axes.
struct PlannedTouch {
    target: Point3<f64>,
    /// Columns are the axes of the approach frame; z is the direction of motion.
    rotation: Matrix3<f64>,
    effort: Effort,
}

impl HandOnObject {
    /// Touches the object of a pair as a channel says. `stream` gives the sample's own stream of a name; `drop_index_zero` is
    /// the quirk of the pair's grids: a contact in a cell with index 0 on any axis counts as outside.
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
            _ => self.exploration(by_hand.exploration.unwrap_or(0), pair, seen, &mut stream("exploration")),
        };
        let hand = Arc::clone(self.worker.hand());
        let joints = hand.tree().joints().iter().map(|joint| joint.joint.name.clone()).collect();
        let (name, links) = (hand.name().to_owned(), hand.links().to_vec());
        // Names of the hand's links and joints, to which the records below refer by index.
        let mut by_hand = HandTouch { hand: name, links, joints, ..HandTouch::default() };
        let mut out = TactileContacts::none(pair.sample);
        (out.resolution, out.probes) = (pair.grid.resolution, plan.len() as u32);
        for (probe, planned) in plan.iter().enumerate() {
            // Start pose: off the target against the direction of motion, clear of the object.
            let start = planned.target - planned.rotation.column(2) * self.far;
            let rotation = Rotation3::from_matrix_unchecked(planned.rotation);
            let camera_from_start = IsometryMatrix3::from_parts(Translation3::from(start), rotation);
            let camera_from_object = pair.camera_from_object.isometry();
            let object_from_start = camera_from_object.inv_mul(&camera_from_start);
            let approach = HandApproach { object_from_start, distance: self.far + BEYOND, effort: planned.effort };
            let felt = self.worker.feel(&approach).map_err(|error| ProduceError::unusable(&self.scene, error))?;
            // Approach without any touch: its start is recorded as a miss.
            if felt.touches.is_empty() {
                out.misses.push(single(&start));
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
                by_hand.felt.push(Felt { link: touch.link as u32, force, gap });
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

    /// Movements to points spread over the hidden surface, each as far from those before as can be.
    fn exploration(
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
                PlannedTouch { target, rotation: rotation_towards(&-out, roll), effort: Effort::FEEL }
            })
            .collect()
    }

    /// A movement along the image plane.
    fn grasp(&self, camera_from_object: &Pose<CameraCv, Object>, stream: &mut Stream) -> PlannedTouch {
        let (sin, cos) = libm::sincos(stream.uniform(-PI, PI));
        let (approach, across) = (Vector3::new(cos, sin, 0.0), Vector3::z());
        let rotation = Matrix3::from_columns(&[across.cross(&approach), across, approach]);
        PlannedTouch { target: camera_from_object.point(&self.centre), rotation, effort: Effort::GRASP }
    }
}

fn recorded(end: ApproachEnd) -> format::ApproachEnd {
    use format::ApproachEnd as Recorded;
    match end {
        ApproachEnd::AtRest => Recorded::AtRest,
        ApproachEnd::TimedOut => Recorded::TimedOut,
        ApproachEnd::Missed => Recorded::Missed,
        ApproachEnd::Unstable => Recorded::Unstable,
    }
}
