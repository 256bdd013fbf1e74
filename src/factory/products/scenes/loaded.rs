//! Objects of a job prepared for scenes, kept by all threads.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::settings::SceneSettings;
use crate::{
    ProduceError,
    objects::prepared,
    recent::Recent,
    sections::{JobObject, JobObjects},
};
use kernel::{
    contact::{ContactBody, Sampled},
    geom::{MassProperties, RenderMesh, RestingPoses},
};

/// Objects that are kept, at most: about 4 MB each.
const KEPT: usize = 128;

/// An object, ready for scenes.
pub(super) struct LoadedObject {
    /// The true mesh.
    pub body: Arc<ContactBody>,
    /// Mass properties of its solid.
    pub solid: MassProperties,
    /// [kg].
    pub mass: f64,
    /// Stable poses of the object on a plane.
    pub resting: RestingPoses,
    /// Mesh, laid out for pictures.
    pub render: RenderMesh,
}

/// Objects that were loaded last.
pub(super) struct LoadedObjects(Recent<LoadedObject>);

impl Default for LoadedObjects {
    fn default() -> Self {
        Self(Recent::new(KEPT))
    }
}

impl LoadedObjects {
    /// An object of the job, by its index.
    ///
    /// # Errors
    /// When it is gone or another one than when the job was resolved.
    pub fn get(&self, objects: &JobObjects, index: usize) -> Result<Arc<LoadedObject>, ProduceError> {
        self.0.get(index, || LoadedObject::prepare(&objects.list[index]))
    }
}

impl LoadedObject {
    fn prepare(object: &JobObject) -> Result<Self, ProduceError> {
        let prepared = prepared(object)?;
        let name = || object.source.name.clone();
        let surface = prepared.contact_surface().map_err(|error| ProduceError::unusable(name(), error))?;
        // A job refuses such an object when it is opened.
        let solid = prepared.mass().ok_or_else(|| ProduceError::unusable(name(), "it has no solid inside"))?;
        Ok(Self {
            body: Arc::new(ContactBody::new(prepared.mesh(), Arc::clone(surface), Sampled::Everywhere)),
            solid: *solid,
            mass: object.weight(&prepared).kilograms,
            resting: prepared.resting().clone(),
            render: RenderMesh::new(prepared.mesh(), false),
        })
    }

    /// The resting pose whose up is nearest to an up in `Object`, and the angle between the two [rad].
    pub fn nearest_resting(&self, up: &Vector3<f64>) -> Option<(u32, f64)> {
        let angles = self.resting.poses.iter().map(|pose| pose.up().angle(up));
        (0..).zip(angles).min_by(|(_, one), (_, other)| one.total_cmp(other))
    }

    /// Corners of the convex hull, in `Object` [m].
    pub fn corners(&self) -> &[Point3<f64>] {
        self.body.corners()
    }
}

/// Whether an object of these sides [m] fits into a floor of these sides [m] in some rotation along its axes.
pub(super) fn fits(extents: [f64; 3], mut floor: [f64; 2]) -> bool {
    let mut sides = extents;
    sides.sort_by(f64::total_cmp);
    floor.sort_by(f64::total_cmp);
    sides[0] <= floor[0] && sides[1] <= floor[1]
}

/// Notes about objects that fit into no scene.
pub(super) fn too_large_notes(objects: &JobObjects, settings: &SceneSettings) -> Vec<String> {
    let large = objects.list.iter().filter(|object| !fits(object.asset.extents, settings.floor()));
    let note = |object: &JobObject| {
        let [x, y, z] = object.asset.extents;
        format!(
            "{}: {x:.3} x {y:.3} x {z:.3} m do not fit into the container: scenes that draw it are rejected as \
             too_large; exclude it, set its unit of length (`units`) or enlarge the container",
            object.source.name
        )
    };
    large.map(note).collect()
}
