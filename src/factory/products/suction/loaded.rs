//! Objects and scenes prepared for a cup.

use std::sync::{Arc, OnceLock};

use nalgebra::IsometryMatrix3;

use crate::{
    ProduceError,
    objects::prepared,
    recent::Recent,
    sections::{JobObject, JobObjects},
};
use format::{Scene, SceneContainer};
use kernel::{contact::ContactSurface, geom::SimdLevel, ids::ObjectId, voxel::InsideTest};
use robot::grasp::{SceneObstacle, SurfacePoints, Surroundings};

/// Objects that are kept, at most: about 7 MB each.
const KEPT: usize = 128;

/// An object, ready for a cup.
pub(super) struct LoadedObject {
    /// The true mesh.
    pub surface: Arc<ContactSurface>,
    /// Points at which a cup is tried; made when they are first needed.
    points: OnceLock<SurfacePoints>,
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
        let surface = prepared.contact_surface();
        let surface = surface.map_err(|error| ProduceError::unusable(object.source.name.clone(), error))?;
        Ok(Self { surface: Arc::clone(surface), points: OnceLock::new() })
    }

    /// Points of the object, of any thickness.
    pub fn points(&self, object: ObjectId, level: SimdLevel) -> &SurfacePoints {
        self.points.get_or_init(|| SurfacePoints::new(&self.surface, &object.0.0, f64::INFINITY, level))
    }
}

/// The walls of a container; `None` for a plane.
///
/// # Errors
/// When its mesh has no surface.
pub(super) fn walls(container: &SceneContainer) -> Result<Option<SceneObstacle>, ProduceError> {
    let Some(mesh) = container.mesh() else { return Ok(None) };
    let surface = ContactSurface::new(&mesh, InsideTest::WindingNumber);
    let surface = Arc::new(surface.map_err(|error| ProduceError::unusable("container", error))?);
    Ok(Some(SceneObstacle { surface, scene_from_obstacle: IsometryMatrix3::identity() }))
}

/// A scene in which a cup is tried.
pub(super) struct LoadedScene {
    /// Index in the job.
    pub index: usize,
    /// The scene as its dataset has it.
    pub record: Scene,
    /// Objects of the bodies, in order.
    pub objects: Vec<Arc<LoadedObject>>,
    /// Things that cup and tube can touch.
    pub surroundings: Surroundings,
}

impl LoadedScene {
    /// A scene of these objects between these walls.
    pub fn new(index: usize, record: Scene, objects: Vec<Arc<LoadedObject>>, container: Option<SceneObstacle>) -> Self {
        let obstacles = objects.iter().zip(&record.bodies).map(|(object, body)| SceneObstacle {
            surface: Arc::clone(&object.surface),
            scene_from_obstacle: *body.world_from_object.isometry(),
        });
        let surroundings = Surroundings { container, ground: record.container.table_z(), objects: obstacles.collect() };
        Self { index, record, objects, surroundings }
    }
}
