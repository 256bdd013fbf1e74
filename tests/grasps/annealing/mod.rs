//! Annealing: the grasps that it finds, their ratings, and how hands close, against what others compute.

mod antipodal;
mod approach;
mod closing;
mod energies;
mod grippers;
mod oppositions;
mod scans;
mod search;
mod table;

use std::{path::Path, sync::Arc};

use graspmill::{
    assets::{MeshSource, PreparedMesh, built_in_source, prepare},
    contact::ContactSurface,
    geom::{SimdLevel, TriMesh},
    grasp::{
        AmplitudeRange, Annealer, Annealing, EnergyKind, HandSearch, ObjectSearch, RatedGrasp, SearchFrame, SearchRun,
        WrenchSpace,
    },
    hand::Hand,
    object::inside_test,
    seed::Stream,
    sim::HandModel,
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use crate::support::{
    annealing::{ANNEALING, KEEPING},
    robots::{BARRETT, open_hand},
};

/// A hand that searches for grasps of an object.
struct Searcher {
    model: HandModel,
    hand: Arc<Hand>,
    search: Arc<HandSearch>,
    mesh: TriMesh,
    surface: Arc<ContactSurface>,
    object: ObjectSearch,
}

impl Searcher {
    /// The Barrett hand and a built-in shape.
    fn new(shape: &str) -> Self {
        Self::with_hand(shape, BARRETT)
    }

    fn with_hand(shape: &str, scene: &str) -> Self {
        Self::from_parts(prepare(&built_in_source(shape)).expect("a sound shape"), scene)
    }

    /// The Barrett hand and a scan.
    fn with_scan(file: &Path) -> Self {
        Self::from_parts(prepare(&MeshSource::of_file("scan", file)).expect("a sound scan"), BARRETT)
    }

    /// A hand and a closed mesh.
    fn with_mesh(mesh: TriMesh, scene: &str) -> Self {
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        Self::from_surface(mesh, surface, scene)
    }

    fn from_parts(prepared: PreparedMesh, scene: &str) -> Self {
        let surface = ContactSurface::new(&prepared.mesh, inside_test(&prepared.record)).expect("a surface");
        Self::from_surface(prepared.mesh, surface, scene)
    }

    fn from_surface(mesh: TriMesh, surface: ContactSurface, scene: &str) -> Self {
        let surface = Arc::new(surface);
        let model = open_hand(scene);
        let (bodies, _) = model.bodies().expect("its bodies");
        let hand = Arc::clone(model.hand());
        let search = Arc::new(HandSearch::new(&hand, &bodies).expect("eigengrasps"));
        let object = ObjectSearch::new(&surface, &mesh).expect("a solid");
        Self { model, hand, search, mesh, surface, object }
    }

    fn annealer(&self, settings: &Annealing, level: SimdLevel) -> Annealer {
        Annealer::new(&self.search, settings, &KEEPING, level)
    }

    /// Runs from seeds drawn by area, the first `count` of a stream.
    fn runs(&self, settings: &Annealing, count: u64) -> Vec<SearchRun> {
        let mut annealer = self.annealer(settings, SimdLevel::detect());
        (0..count).map(|seed| annealer.run(&self.object, &self.seed(seed), &mut stream(seed))).collect()
    }

    /// A seed's frame: origin on the surface, z along the inward normal, a random roll.
    fn seed(&self, seed: u64) -> IsometryMatrix3<f64> {
        let mut draw = Stream::of_job(seed, b"", "test seeds");
        let [share, u, v] = [(); 3].map(|()| draw.unit());
        let (point, normal) = self.surface.point_at(share, u, v).expect("a surface");
        let aside = if normal.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
        let x = normal.cross(&aside).normalize();
        let (sin, cos) = libm::sincos(draw.uniform(-3.1, 3.1));
        let x = x * cos + normal.cross(&x) * sin;
        let axes = Matrix3::from_columns(&[x, -normal.cross(&x), -normal]);
        IsometryMatrix3::from_parts(Translation3::from(point.coords), Rotation3::from_matrix_unchecked(axes))
    }
}

/// The approach frame in the state that was annealed.
fn annealed(grasp: &RatedGrasp) -> IsometryMatrix3<f64> {
    grasp.object_from_approach * Translation3::new(0.0, 0.0, -grasp.advance)
}

fn stream(seed: u64) -> Stream {
    Stream::of_job(seed, b"", "test annealing")
}

/// The contact energy, 2,500 steps.
const QUICK: Annealing =
    Annealing { steps: 2_500, energy: EnergyKind::Contact, space: WrenchSpace::Force, ..ANNEALING };

/// The thesis's annealing, in fewer steps.
const THESIS: Annealing = Annealing {
    energy: EnergyKind::ContactAndPotential,
    potential_scale: 1.0,
    whole_schedule: false,
    frame: SearchFrame::Object,
    amplitudes: AmplitudeRange::Clamped(4.0),
    ..QUICK
};
