//! True meshes in MuJoCo, which itself collides the convex hull of one.
//!
//! The object's geom is a mesh of eight corners, so that MuJoCo tests its box; the contacts come from a
//! [`ContactSurface`]. MuJoCo's table of collision functions is one for the process: `ffi` sets ours once, and ours
//! uses the collider that the stepping thread has [lent](ColliderLoan) to it. A thread that lends none gets MuJoCo's
//! own contacts.

use std::{cell::RefCell, sync::Arc};

use mujoco_rs::wrappers::{
    mj_editing::{MjSpec, MjsBody, MjsGeom, SpecItem},
    mj_model::{MjModel, MjtGeomBase, MjtObjBase},
};
use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::{
    convert::{index, solid},
    objects::{
        added_geom::drop_defaults,
        table::{Table, TableContacts},
    },
};
use kernel::contact::{ContactScratch, ContactSurface, ContactTracker, Probe, SurfaceContact};

/// The geom and the mesh that represent a true mesh.
const NAME: &str = "graspmill true mesh";

/// A true mesh of a model, and the geoms that may touch it.
pub(crate) struct TrueMesh {
    /// MuJoCo's number of the geom that represents it.
    pub(crate) geom: usize,
    pub(crate) surface: Arc<ContactSurface>,
    /// Solid of each geom of the model that may touch the mesh.
    pub(crate) probes: Vec<Option<Probe>>,
    /// Corners of the mesh's convex hull, in `Object` [m], if it can rest on a table.
    pub(crate) corners: Vec<Point3<f64>>,
}

/// Working memory of one thread that finds the contacts of one true mesh.
pub(crate) struct TrueMeshCollider {
    surface: Arc<ContactSurface>,
    /// MuJoCo's number of the geom that represents it.
    pub(crate) geom: i32,
    /// Tracker of each geom of the model that may touch the mesh.
    trackers: Vec<Option<ContactTracker>>,
    /// Points that the table carries, where there is one.
    table: Option<TableContacts>,
    scratch: ContactScratch,
    found: Vec<SurfaceContact>,
    /// Whether trackers [remember](ContactTracker::new).
    remembers: bool,
    /// Whether the faces of boxes and cylinders reach to their edges.
    are_sharp: bool,
}

thread_local! {
    static LENT: RefCell<Vec<TrueMeshCollider>> = const { RefCell::new(Vec::new()) };
}

/// While it lives, MuJoCo calls the colliders on this thread.
pub(crate) struct ColliderLoan<'a> {
    owner: &'a mut Vec<TrueMeshCollider>,
}

impl<'a> ColliderLoan<'a> {
    pub(crate) fn new(owner: &'a mut Vec<TrueMeshCollider>) -> Self {
        LENT.set(std::mem::take(owner));
        Self { owner }
    }
}

impl Drop for ColliderLoan<'_> {
    fn drop(&mut self) {
        *self.owner = LENT.take();
    }
}

/// Calls `ask` with the collider that represents a geom on this thread, if there is one.
pub(crate) fn with_collider<T>(geom: i32, ask: impl FnOnce(&mut TrueMeshCollider) -> T) -> Option<T> {
    LENT.with_borrow_mut(|lent| lent.iter_mut().find(|collider| collider.geom == geom).map(ask))
}

/// Puts the geom of a model's only true mesh on a body, in whose frame the mesh is.
pub(crate) fn add_geom(spec: &mut MjSpec, surface: &ContactSurface, body: impl FnOnce(&mut MjSpec) -> &mut MjsBody) {
    add_named_geom(spec, NAME, surface, body);
}

/// Puts a geom of this name on a body, in whose frame its true mesh is.
pub(crate) fn add_named_geom<'s>(
    spec: &'s mut MjSpec,
    name: &str,
    surface: &ContactSurface,
    body: impl FnOnce(&'s mut MjSpec) -> &'s mut MjsBody,
) -> &'s mut MjsGeom {
    let bounds = surface.bounds();
    // The smallest accepted width of a mesh.
    let half = (bounds.max - bounds.min).map(|side| side.max(1e-3)) / 2.0;
    let centre = bounds.centre();
    let corner = |index: usize| {
        std::array::from_fn::<f32, 3, _>(|axis| {
            let side = if index >> axis & 1 == 1 { half[axis] } else { -half[axis] };
            (centre[axis] + side) as f32
        })
    };
    let corners: Vec<[f32; 3]> = (0..8).map(corner).collect();
    let mesh = spec.add_mesh();
    mesh.with_name(name);
    mesh.set_uservert(corners.as_flattened());
    let geom = body(spec).add_geom();
    drop_defaults(geom);
    geom.with_name(name);
    geom.set_type(MjtGeomBase::mjGEOM_MESH);
    geom.set_meshname(name);
    geom
}

impl TrueMesh {
    /// The model's only true mesh; `corners` are those of its convex hull, if it can rest on a table.
    pub(crate) fn of_model(model: &MjModel, surface: &Arc<ContactSurface>, corners: Vec<Point3<f64>>) -> Self {
        Self { corners, ..Self::named(model, NAME, surface) }
    }

    /// The true mesh whose geom has this name.
    pub(crate) fn named(model: &MjModel, name: &str, surface: &Arc<ContactSurface>) -> Self {
        let geom = model.name_to_id(MjtObjBase::mjOBJ_GEOM, name).expect("the true mesh has a geom");
        let probes = TrueMeshCollider::probes(model);
        Self { geom, surface: Arc::clone(surface), probes, corners: Vec::new() }
    }
}

impl TrueMeshCollider {
    /// Solid of each geom of a model; `None` where it is no box, ball, capsule or cylinder.
    fn probes(model: &MjModel) -> Vec<Option<Probe>> {
        let kinds = model.geom_type().iter().zip(model.geom_size());
        kinds.map(|(kind, size)| solid(*kind, size).as_ref().and_then(Probe::new)).collect()
    }

    /// Creates a collider that [remembers](ContactTracker::new), or not; with a table where the model has one.
    pub(crate) fn new(mesh: &TrueMesh, table: Option<&Table>, remembers: bool) -> Self {
        Self {
            surface: Arc::clone(&mesh.surface),
            geom: mesh.geom as i32,
            trackers: mesh
                .probes
                .iter()
                .map(|probe| probe.map(|probe| ContactTracker::new(probe, remembers)))
                .collect(),
            table: table.map(|table| TableContacts::new(table, &mesh.corners)),
            scratch: ContactScratch::default(),
            found: Vec::new(),
            remembers,
            are_sharp: false,
        }
    }

    /// Gives boxes and cylinders [faces that reach to their edges](Probe::with_wide_faces), or edges that are rounded.
    pub(crate) fn set_edges(&mut self, mesh: &TrueMesh, are_sharp: bool) {
        if std::mem::replace(&mut self.are_sharp, are_sharp) == are_sharp {
            return;
        }
        for (tracker, probe) in self.trackers.iter_mut().zip(&mesh.probes) {
            let shaped = probe.map(|probe| if are_sharp { probe.with_wide_faces() } else { probe });
            *tracker = shaped.map(|probe| ContactTracker::new(probe, self.remembers));
        }
    }

    /// Begins a new run.
    pub(crate) fn forget(&mut self) {
        self.trackers.iter_mut().flatten().for_each(ContactTracker::forget);
    }

    /// Contacts of a geom with the mesh, nearer than `margin` [m]; both placed in the world, the mesh by its body.
    pub(crate) fn contacts(
        &mut self,
        geom: i32,
        world_from_geom: &IsometryMatrix3<f64>,
        world_from_object: &IsometryMatrix3<f64>,
        margin: f64,
    ) -> impl Iterator<Item = WorldContact> + '_ {
        self.found.clear();
        let object_from_geom = world_from_object.inv_mul(world_from_geom);
        if let Some(tracker) = &mut self.trackers[index(geom)] {
            tracker.contacts(&self.surface, &object_from_geom, margin, &mut self.scratch, &mut self.found);
        } else if let Some(table) = &mut self.table
            && let Some(plane) = table.plane(geom)
        {
            table.contacts(plane, &object_from_geom, margin, &mut self.found);
        }
        let world_from_object = *world_from_object;
        self.found.iter().map(move |contact| {
            let normal = world_from_object * contact.normal.into_inner();
            let point = world_from_object * contact.point - normal * (contact.distance / 2.0);
            WorldContact { distance: contact.distance, point, normal }
        })
    }
}

/// A contact in MuJoCo's form.
pub(crate) struct WorldContact {
    /// [m], negative where the two overlap.
    pub(crate) distance: f64,
    /// Half way between the two surfaces.
    pub(crate) point: Point3<f64>,
    /// Out of the mesh.
    pub(crate) normal: Vector3<f64>,
}

#[cfg(test)]
mod tests {
    use std::{path::Path, time::Instant};

    use mujoco_rs::{
        mujoco_c::{mjtCone, mjtIntegrator},
        wrappers::mj_data::MjData,
    };

    use super::*;
    use assets::{MeshSource, PreparedMesh, list_folder, prepare};
    use kernel::voxel::InsideTest;

    fn scan(name: &str) -> PreparedMesh {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.deps/ycb");
        let files = list_folder(&folder).unwrap_or_else(|error| panic!("{error}; `make setup` fetches the scans"));
        let path = files.into_iter().find(|file| file.to_string_lossy().contains(name)).expect("a scan");
        prepare(&MeshSource::of_file(name, &path)).expect("a sound scan")
    }

    /// A free ball above a fixed mesh, z up.
    fn ball_over(
        surface: &Arc<ContactSurface>,
        radius: f64,
    ) -> (Arc<MjModel>, MjData<Arc<MjModel>>, Vec<TrueMeshCollider>) {
        crate::ffi::prepare_library();
        let mut spec = MjSpec::new();
        let body = spec.world_body_mut().add_body();
        body.with_name("object");
        add_geom(&mut spec, surface, |spec| spec.body_mut("object").expect("added"));
        let ball = spec.world_body_mut().add_body();
        ball.with_name("ball");
        ball.add_free_joint();
        let geom = ball.add_geom();
        geom.set_type(MjtGeomBase::mjGEOM_SPHERE);
        *geom.size_mut() = [radius, 0.0, 0.0];
        geom.set_mass(0.01);
        // A rolling ball would take for ever.
        geom.set_condim(6);
        let mut model = spec.compile().expect("a model");
        let option = model.opt_mut();
        option.timestep = 0.002;
        option.integrator = mjtIntegrator::mjINT_IMPLICITFAST as i32;
        option.cone = mjtCone::mjCONE_ELLIPTIC as i32;
        option.impratio = 10.0;
        model.geom_solref_mut().fill([0.004, 1.0]);
        model.geom_solimp_mut().fill([0.95, 0.995, 0.0005, 0.5, 2.0]);
        model.geom_friction_mut().fill([0.5, 0.005, 0.002]);
        let model = Arc::new(model);
        let mesh = TrueMesh::of_model(&model, surface, Vec::new());
        let collider = TrueMeshCollider::new(&mesh, None, true);
        (Arc::clone(&model), MjData::new(model), vec![collider])
    }

    /// Drops a ball at points over the middle of a hollow scan and lets it come to rest; the distance from its surface to the
    /// mesh's at the end, and where it lies.
    fn rests(prepared: &PreparedMesh, radius: f64, drop: Vector3<f64>) -> (f64, Vector3<f64>, f64) {
        let surface = Arc::new(ContactSurface::new(&prepared.mesh, InsideTest::WindingNumber).expect("a surface"));
        let (_, mut data, mut collider) = ball_over(&surface, radius);
        data.qpos_mut()[..3].copy_from_slice(drop.as_slice());
        let mut fastest = 0.0;
        for step in 0..4000 {
            let loan = ColliderLoan::new(&mut collider);
            data.step();
            std::mem::drop(loan);
            if step >= 3900 {
                fastest = f64::max(fastest, Vector3::from_column_slice(&data.qvel()[..3]).norm());
            }
        }
        let at = Vector3::from_column_slice(&data.qpos()[..3]);
        (surface.signed_distance(&Point3::from(at)) - radius, at, fastest)
    }

    /// Inside a bowl and a mug a small ball falls to the ground of it: their hulls would carry it on the brim.
    #[test]
    fn a_small_ball_rests_inside_bowl_and_mug() {
        for name in ["bowl", "mug"] {
            let prepared = scan(name);
            let bounds = prepared.mesh.aabb().expect("vertices");
            for (radius, aside) in [(0.003, 0.0), (0.006, 0.0), (0.006, 0.012)] {
                let began = Instant::now();
                let centre = bounds.centre();
                let drop = Vector3::new(centre.x + aside, centre.y, bounds.max.z - 0.01);
                let (gap, at, speed) = rests(&prepared, radius, drop);
                println!(
                    "{name}, ball of {:.0} mm: gap {:.4} mm at {at:?} (brim {:.3}, ground {:.3}), {speed:.1e} m/s, {:?}",
                    2e3 * radius,
                    1e3 * gap,
                    bounds.max.z,
                    bounds.min.z,
                    began.elapsed()
                );
                assert!(gap.abs() < 2e-4, "{name}: {gap} m from the surface");
                assert!(speed < 1e-2, "{name}: {speed} m/s");
                assert!(at.z < bounds.max.z - 0.02 && at.z > bounds.min.z, "{name}: {at:?}");
            }
        }
    }
}
