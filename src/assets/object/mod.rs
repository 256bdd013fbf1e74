//! An object prepared once, with parts that are made on first use and shared by every user.
//!
//! ```text
//! MeshSource --assets::prepare--> PreparedMesh --> PreparedObject
//!                                                    |-- solid()            256^3 occupancy
//!                                                    |-- tree()             triangles by position, for rays
//!                                                    |-- surface()          signed distances and closest points
//!                                                    |-- contact_surface()  solid and surface with a distance grid
//!                                                    |-- mass()             of a homogeneous solid of 1 kg/m^3
//!                                                    |-- resting()          stable poses on a table
//!                                                    '-- symmetries()       what maps it onto itself
//! ```

mod weight;

pub use weight::{AREAL_DENSITY, MASSES, MadeOf};

use std::sync::{Arc, OnceLock};

use nalgebra::{Point3, Vector3};

use crate::{AssetRecord, MeshRefusal, MeshSource, PreparedMesh, prepare, refuse_without_solid};
use kernel::{
    cancel::{Cancel, Cancelled},
    contact::ContactSurface,
    geom::{Aabb, MassProperties, NoSurface, RestingPoses, SolidGrid, Symmetries, TriMesh, TriangleTree},
    ids::ObjectId,
    voxel::{InsideTest, channels::Surface, solid_occupancy},
};

/// A prepared mesh with its derived parts. Each part is made once, by the first thread that uses it, and is a function
/// of the mesh alone (class `exact`).
pub struct PreparedObject {
    mesh: TriMesh,
    record: AssetRecord,
    solid: OnceLock<Arc<SolidGrid>>,
    tree: OnceLock<Arc<TriangleTree>>,
    surface: OnceLock<Arc<Surface>>,
    contact_surface: OnceLock<Result<Arc<ContactSurface>, NoSurface>>,
    mass: OnceLock<Option<MassProperties>>,
    resting: OnceLock<RestingPoses>,
}

impl PreparedObject {
    /// Reads, checks and repairs a mesh; parts are made later, on first use.
    ///
    /// # Errors
    /// If the mesh cannot be used, with file, location and remedy.
    pub fn prepare(source: &MeshSource) -> Result<Self, MeshRefusal> {
        prepare(source).map(Self::from)
    }

    /// Content id of the object.
    pub fn id(&self) -> ObjectId {
        self.record.object
    }

    /// The prepared mesh [m], in `Object`.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Row of the object in the asset table.
    pub fn record(&self) -> &AssetRecord {
        &self.record
    }

    /// Axis-aligned bounding box [m], in `Object`.
    pub fn bounds(&self) -> Aabb {
        let lower = Point3::from(self.record.lower);
        Aabb { min: lower, max: lower + Vector3::from(self.record.extents) }
    }

    /// Test that distinguishes solid from empty for this mesh.
    pub fn inside_test(&self) -> InsideTest {
        inside_test(&self.record)
    }

    /// The solid: a cell is occupied when its centre lies inside the mesh.
    pub fn solid(&self) -> &Arc<SolidGrid> {
        self.solid.get_or_init(|| Arc::new(solid_occupancy(&self.mesh, self.inside_test(), false)))
    }

    /// Refuses an object whose solid has no cell inside, such as a sheet as thin as a hair: it has no mass. `source` is
    /// the mesh that it was prepared from.
    ///
    /// # Errors
    /// With the thickness and the remedy.
    pub fn check_solid(&self, source: &MeshSource) -> Result<(), MeshRefusal> {
        if self.mass().is_some() {
            return Ok(());
        }
        Err(refuse_without_solid(source, &self.mesh, self.record.volume, self.solid().pitch))
    }

    /// Tree over the triangles, for rays and closest triangles.
    pub fn tree(&self) -> &Arc<TriangleTree> {
        self.tree.get_or_init(|| Arc::new(TriangleTree::new(&self.mesh)))
    }

    /// The surface, prepared for closest points with signs.
    pub fn surface(&self) -> &Arc<Surface> {
        self.surface.get_or_init(|| Arc::new(Surface::of_tree(&self.mesh, Arc::clone(self.tree()))))
    }

    /// The surface with its distance grid, for contacts of solids with the true mesh.
    ///
    /// # Errors
    /// When the mesh has no extent.
    pub fn contact_surface(&self) -> Result<&Arc<ContactSurface>, NoSurface> {
        self.make_contact_surface(&Cancel::new()).expect("it is never cancelled");
        self.contact_surface.get().expect("it was made").as_ref().map_err(Clone::clone)
    }

    /// Makes [`Self::contact_surface`] and its parts, which takes seconds for a large mesh, unless it is cancelled.
    ///
    /// # Errors
    /// When it is cancelled; parts that were made until then stay.
    pub fn make_contact_surface(&self, cancel: &Cancel) -> Result<(), Cancelled> {
        if self.contact_surface.get().is_some() {
            return Ok(());
        }
        cancel.check()?;
        let solid = Arc::clone(self.solid());
        cancel.check()?;
        let surface = Arc::clone(self.surface());
        let made = ContactSurface::of_parts(&self.mesh, surface, &solid);
        self.contact_surface.get_or_init(|| made.map(Arc::new));
        Ok(())
    }

    /// Mass properties of the solid at 1 kg/m^3; `None` when no cell is solid.
    pub fn mass(&self) -> Option<&MassProperties> {
        self.mass.get_or_init(|| MassProperties::of_solid(self.solid())).as_ref()
    }

    /// Rotations and reflections that map the object onto itself; `None` when no cell is solid.
    pub fn symmetries(&self) -> Option<Symmetries> {
        self.mass().map(|mass| Symmetries::from_mesh(&self.mesh, self.tree(), mass))
    }

    /// Stable poses on a table; none when no cell is solid.
    pub fn resting(&self) -> &RestingPoses {
        self.resting.get_or_init(|| {
            self.mass().map_or_else(RestingPoses::default, |mass| RestingPoses::from_mesh(&self.mesh, &mass.centre))
        })
    }
}

impl From<PreparedMesh> for PreparedObject {
    fn from(PreparedMesh { mesh, record }: PreparedMesh) -> Self {
        Self {
            mesh,
            record,
            solid: OnceLock::new(),
            tree: OnceLock::new(),
            surface: OnceLock::new(),
            contact_surface: OnceLock::new(),
            mass: OnceLock::new(),
            resting: OnceLock::new(),
        }
    }
}

/// Test that distinguishes solid from empty for an asset.
pub fn inside_test(record: &AssetRecord) -> InsideTest {
    record.inside.test()
}

#[cfg(test)]
mod tests {
    use nalgebra::Unit;

    use super::*;
    use crate::built_in_source;

    fn symmetries(name: &str) -> Symmetries {
        let object = PreparedObject::prepare(&built_in_source(name)).expect("a built-in shape");
        object.symmetries().expect("a solid")
    }

    /// Every motion that is claimed must move all vertices onto the surface.
    fn check(name: &str, symmetries: &Symmetries) {
        let object = PreparedObject::prepare(&built_in_source(name)).expect("a built-in shape");
        let reach = 2.0 * symmetries.tolerance;
        let mirrors = symmetries
            .mirrors
            .iter()
            .map(|normal| nalgebra::Matrix3::identity() - normal.into_inner() * normal.transpose() * 2.0);
        for map in symmetries.rotations().into_iter().chain(mirrors) {
            for vertex in object.mesh().vertices.iter().step_by(7) {
                let point = Point3::from(vertex.map(f64::from));
                let moved = symmetries.centre + map * (point - symmetries.centre);
                assert!(object.surface().closest(&moved, reach).is_some(), "{name}: {map}");
            }
        }
    }

    #[test]
    fn bodies_of_revolution_and_what_breaks_them() {
        for (name, group, mirrors) in [
            ("can-01", "Dinf", 1),
            ("bottle-01", "Cinf", 0),
            ("bowl-01", "Cinf", 0),
            ("cup-01", "Cinf", 0),
            ("mug-01", "C1", 1),
        ] {
            let found = symmetries(name);
            assert_eq!((found.group().as_str(), found.mirrors.len()), (group, mirrors), "{name}");
            check(name, &found);
            if group != "C1" {
                let [axis] = found.continuous[..] else { panic!("{name}: {found:?}") };
                assert!(axis.dot(&Vector3::z()) > 0.9999, "{name}: {axis:?}");
            }
        }
    }

    #[test]
    fn boxes_and_cubes() {
        let found = symmetries("box-01");
        assert_eq!((found.group().as_str(), found.mirrors.len(), found.rotations().len()), ("D2", 3, 3));
        check("box-01", &found);
        for name in ["half-cube-cube", "half-sphere-sphere", "half-diamond-diamond", "half-cube-sphere"] {
            let found = symmetries(name);
            check(name, &found);
        }
        // A cube, however it is turned: 23 rotations but the identity, nine planes.
        let found = symmetries("half-cube-cube");
        assert_eq!((found.group().as_str(), found.mirrors.len(), found.rotations().len()), ("O", 9, 23));
        let main: Vec<Unit<Vector3<f64>>> = found.axes[..3].iter().map(|axis| axis.direction).collect();
        for axis in &main {
            let along = axis.iamax();
            assert!(axis[along] > 0.999, "{axis:?}");
        }
        assert_eq!(symmetries("half-sphere-sphere").group(), "K");
    }

    #[test]
    fn parts_are_made_once_and_equal_those_made_alone() {
        let object = PreparedObject::prepare(&built_in_source("mug-01")).expect("a built-in shape");
        let solid = solid_occupancy(object.mesh(), object.inside_test(), false);
        assert_eq!(**object.solid(), solid);
        assert!(Arc::ptr_eq(object.solid(), object.solid()) && Arc::ptr_eq(object.surface(), object.surface()));
        let mass = MassProperties::of_solid(&solid).expect("a solid");
        assert_eq!(object.mass(), Some(&mass));
        assert_eq!(*object.resting(), RestingPoses::from_mesh(object.mesh(), &mass.centre));
        let contact = object.contact_surface().expect("a surface");
        let alone = ContactSurface::new(object.mesh(), object.inside_test()).expect("a surface");
        let bounds = object.bounds();
        for share in [0.0, 0.3, 0.5, 1.1] {
            let point = bounds.min + (bounds.max - bounds.min) * share;
            assert_eq!(contact.signed_distance(&point).to_bits(), alone.signed_distance(&point).to_bits());
        }
    }
}
