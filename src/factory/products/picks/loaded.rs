//! Objects of scenes prepared for grasps, kept by all threads: mesh, mass, and the hand closed on them.

use std::sync::{Arc, OnceLock};

use crate::{
    ProduceError,
    objects::prepared,
    recent::Recent,
    sections::{JobObject, JobObjects},
};
use kernel::{
    contact::{ContactBody, Sampled},
    geom::{MassProperties, SimdLevel},
    ids::ObjectId,
};
use nalgebra::IsometryMatrix3;
use robot::{
    grasp::{ClosingGrasp, HandPassage, SurfacePoints},
    hand::Hand,
};

/// Objects that are kept, at most: about 7 MB each, and half a kilobyte for each grasp that was evaluated.
const KEPT: usize = 128;

/// An object, ready for grasps among others.
pub(super) struct LoadedObject {
    /// The true mesh.
    pub body: Arc<ContactBody>,
    /// Mass properties of its solid.
    pub solid: MassProperties,
    /// The hand closed on the object, for each stored grasp and direction; made when it is first needed.
    closed: Vec<OnceLock<ClosedGrasp>>,
    /// Points at which pads can touch; made when a grasp is first sampled.
    points: OnceLock<SurfacePoints>,
}

/// A hand that has closed on an object alone: a matter of the object and not of the scene.
pub(super) struct ClosedGrasp {
    /// The grasp.
    pub grasp: ClosingGrasp,
    /// All joints of the closed hand [rad or m].
    pub joints: Vec<f64>,
}

impl ClosedGrasp {
    /// Closes the hand on an object.
    pub fn new(
        passage: &mut HandPassage,
        hand: &Hand,
        object: &LoadedObject,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
    ) -> Self {
        Self::from_closed(hand, passage.close(object.body.surface(), object_from_base, posture))
    }

    /// A hand that has closed.
    pub fn from_closed(hand: &Hand, grasp: ClosingGrasp) -> Self {
        let mut joints = vec![0.0; hand.tree().len()];
        hand.joint_values(grasp.closed(), &mut joints);
        Self { grasp, joints }
    }
}

/// Objects that were loaded last.
pub(super) struct LoadedObjects(Recent<LoadedObject>);

impl Default for LoadedObjects {
    fn default() -> Self {
        Self(Recent::new(KEPT))
    }
}

impl LoadedObjects {
    /// An object of the job, by its index, with capacity for this number of grasps.
    ///
    /// # Errors
    /// When it is gone or another one than when the job was resolved.
    pub fn get(&self, objects: &JobObjects, index: usize, grasps: usize) -> Result<Arc<LoadedObject>, ProduceError> {
        self.0.get(index, || LoadedObject::prepare(&objects.list[index], grasps))
    }
}

impl LoadedObject {
    fn prepare(object: &JobObject, grasps: usize) -> Result<Self, ProduceError> {
        let prepared = prepared(object)?;
        let name = || object.source.name.clone();
        let surface = prepared.contact_surface().map_err(|error| ProduceError::unusable(name(), error))?;
        // The job of the scenes refused such an object.
        let solid = prepared.mass().ok_or_else(|| ProduceError::unusable(name(), "it has no solid inside"))?;
        Ok(Self {
            body: Arc::new(ContactBody::new(prepared.mesh(), Arc::clone(surface), Sampled::Everywhere)),
            solid: *solid,
            closed: (0..grasps).map(|_| OnceLock::new()).collect(),
            points: OnceLock::new(),
        })
    }

    /// Points of the object at which a pair is no wider than a hand opens [m].
    pub fn points(&self, object: ObjectId, widest: f64, level: SimdLevel) -> &SurfacePoints {
        self.points.get_or_init(|| SurfacePoints::new(self.body.surface(), &object.0.0, widest, level))
    }

    /// The hand closed in one of the grasps.
    pub fn closed(&self, grasp: usize, close: impl FnOnce() -> ClosedGrasp) -> &ClosedGrasp {
        self.closed[grasp].get_or_init(close)
    }
}
