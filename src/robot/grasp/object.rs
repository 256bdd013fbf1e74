//! An object, prepared for the search of grasps.

use std::sync::{Arc, OnceLock};

use nalgebra::Point3;

use super::{field::DistanceField, points::SurfaceSample, wrench::MassFrame};
use assets::object::PreparedObject;
use kernel::{
    contact::ContactSurface,
    geom::{MassProperties, NoSurface, RestingPoses, SimdLevel, TriMesh},
    voxel::InsideTest,
};

/// An object, prepared for annealing: shared by threads.
pub struct ObjectSearch {
    /// Made on first use of an object that began as a field: annealing needs none.
    surface: OnceLock<Arc<ContactSurface>>,
    /// Closed mesh from which it is made; empty where the surface came first.
    mesh: TriMesh,
    /// Made on first use: pads on pairs of points need no field.
    field: OnceLock<DistanceField>,
    /// Made on first use, by pairs of points.
    sample: OnceLock<SurfaceSample>,
    /// The middle of its box.
    pub(super) middle: Point3<f64>,
    /// Distance from the middle to the farthest corner of the box [m].
    pub(super) radius: f64,
    /// Centre and radius that torques refer to.
    pub(super) mass: MassFrame,
    /// Poses in which the object rests on a table.
    pub(super) resting: RestingPoses,
}

impl ObjectSearch {
    /// Prepares an object; `None` where it has no solid inside.
    pub fn new(surface: &Arc<ContactSurface>, mesh: &TriMesh) -> Option<Self> {
        let centre = MassProperties::of_solid(&surface.solid())?.centre;
        Some(Self::of_parts(surface, mesh, &centre, RestingPoses::from_mesh(mesh, &centre)))
    }

    /// The search of a prepared object, from parts that it has already; `None` where no cell of it is solid.
    ///
    /// # Errors
    /// When its mesh has no extent.
    pub fn of_object(object: &PreparedObject) -> Result<Option<Self>, NoSurface> {
        let surface = object.contact_surface()?;
        let Some(mass) = object.mass() else { return Ok(None) };
        Ok(Some(Self::of_parts(surface, object.mesh(), &mass.centre, object.resting().clone())))
    }

    fn of_parts(surface: &Arc<ContactSurface>, mesh: &TriMesh, centre: &Point3<f64>, resting: RestingPoses) -> Self {
        let bounds = surface.bounds();
        Self {
            mass: mass_frame(mesh, centre),
            resting,
            surface: OnceLock::from(Arc::clone(surface)),
            mesh: TriMesh::default(),
            field: OnceLock::new(),
            sample: OnceLock::new(),
            middle: bounds.centre(),
            radius: (bounds.max - bounds.min).norm() / 2.0,
        }
    }

    /// The search of an object that began as a field of distances: a closed mesh of the same surface, wound outward, and its centre
    /// of mass, in `Object` [m]. Its surface is prepared on first use, by a rating or a sampler; it has no resting poses. `None` for
    /// a mesh without triangles or without extent.
    pub fn of_field(field: DistanceField, mesh: TriMesh, centre: &Point3<f64>) -> Option<Self> {
        let bounds = mesh.aabb().filter(|bounds| bounds.longest_side() > 0.0 && !mesh.triangles.is_empty())?;
        Some(Self {
            mass: mass_frame(&mesh, centre),
            resting: RestingPoses::default(),
            surface: OnceLock::new(),
            mesh,
            field: OnceLock::from(field),
            sample: OnceLock::new(),
            middle: bounds.centre(),
            radius: (bounds.max - bounds.min).norm() / 2.0,
        })
    }

    /// The search with a surface that was prepared before, of the same mesh.
    #[must_use]
    pub fn with_surface(self, surface: &Arc<ContactSurface>) -> Self {
        Self { surface: OnceLock::from(Arc::clone(surface)), ..self }
    }

    /// The object's surface with exact distances.
    pub fn surface(&self) -> &Arc<ContactSurface> {
        self.surface.get_or_init(|| {
            let surface = ContactSurface::new(&self.mesh, InsideTest::Crossings);
            Arc::new(surface.expect("a mesh with triangles and extent"))
        })
    }

    /// Middle of the object's box, in `Object` [m].
    pub fn middle(&self) -> Point3<f64> {
        self.middle
    }

    /// Half the diagonal of the object's box [m].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Distances to the object as annealing reads them.
    pub(super) fn field(&self) -> &DistanceField {
        self.field.get_or_init(|| DistanceField::new(self.surface()))
    }

    /// Points of the surface by the thickness there, the same at every level of vector instructions.
    pub(super) fn sample(&self, level: SimdLevel) -> &SurfaceSample {
        self.sample.get_or_init(|| SurfaceSample::new(self.surface(), b"", level))
    }

    /// Poses in which the object rests on a table.
    pub fn resting(&self) -> &RestingPoses {
        &self.resting
    }
}

/// Reference of torques about a centre of mass.
fn mass_frame(mesh: &TriMesh, centre: &Point3<f64>) -> MassFrame {
    let far = |vertex: &[f32; 3]| (Point3::from(vertex.map(f64::from)) - centre).norm();
    MassFrame { centre: *centre, radius: mesh.vertices.iter().map(far).fold(0.0, f64::max) }
}
