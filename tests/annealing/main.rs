//! Grasps: what annealing finds, how it is rated, and how hands close, against what others compute.
#![cfg(feature = "sim")]

mod closing;
mod energies;
mod grippers;
mod scans;
mod search;
mod table;

use std::{path::Path, sync::Arc};

use graspmill::{
    assets::{PreparedMesh, built_in_source, prepare},
    contact::ContactSurface,
    geom::{SimdLevel, TriMesh},
    grasp::{
        AmplitudeRange, Annealer, Annealing, EnergyKind, Grasp, GraspRun, HandSearch, Keeping, ObjectSearch,
        SearchFrame, WrenchSpace,
    },
    hand::Hand,
    produce::inside_test,
    seed::Stream,
    sim::HandModel,
};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

/// A hand in front of an object.
struct Bench {
    model: HandModel,
    hand: Arc<Hand>,
    search: Arc<HandSearch>,
    mesh: TriMesh,
    surface: Arc<ContactSurface>,
    object: ObjectSearch,
}

impl Bench {
    fn new(name: &str) -> Self {
        Self::of(prepare(&built_in_source(name)).expect("a sound shape"))
    }

    fn with(name: &str, scene: &str) -> Self {
        Self::of_hand(prepare(&built_in_source(name)).expect("a sound shape"), scene)
    }

    fn of(prepared: PreparedMesh) -> Self {
        Self::of_hand(prepared, "scenes/barrett_bh8_280.xml")
    }

    fn of_hand(prepared: PreparedMesh, scene: &str) -> Self {
        let surface = ContactSurface::new(&prepared.mesh, inside_test(&prepared.record)).expect("a surface");
        let surface = Arc::new(surface);
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(scene);
        let model = HandModel::open(&scene).expect("the hand");
        let (bodies, _) = model.bodies().expect("its bodies");
        let hand = Arc::clone(model.hand());
        let search = Arc::new(HandSearch::new(&hand, &bodies).expect("eigengrasps"));
        let object = ObjectSearch::new(&surface, &prepared.mesh).expect("a solid");
        Self { model, hand, search, mesh: prepared.mesh, surface, object }
    }

    fn annealer(&self, settings: &Annealing, level: SimdLevel) -> Annealer {
        Annealer::new(&self.search, settings, &keeping(), level)
    }

    /// Runs from seeds drawn by area, the first `count` of a stream.
    fn runs(&self, settings: &Annealing, count: u64) -> Vec<GraspRun> {
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
fn annealed(grasp: &Grasp) -> IsometryMatrix3<f64> {
    grasp.object_from_approach * Translation3::new(0.0, 0.0, -grasp.advance)
}

fn stream(seed: u64) -> Stream {
    Stream::of_job(seed, b"", "test annealing")
}

/// The contact energy, 2,500 steps.
fn quick() -> Annealing {
    Annealing {
        steps: 2_500,
        energy: EnergyKind::Contact,
        space: WrenchSpace::Force,
        friction: 0.2,
        potential_scale: 100.0,
        whole_schedule: true,
        descent: false,
        frame: SearchFrame::Seed,
        amplitudes: AmplitudeRange::Joints,
        best: 20,
        most_failures: 100,
    }
}

fn keeping() -> Keeping {
    Keeping {
        friction: 0.5,
        edges: 16,
        torsion: None,
        space: WrenchSpace::Wrench,
        min_epsilon: 0.01,
        advance: 0.03,
        most_penetration: 5e-4,
        table: false,
    }
}

/// As the thesis anneals, in fewer steps.
fn thesis() -> Annealing {
    Annealing {
        energy: EnergyKind::ContactAndPotential,
        potential_scale: 1.0,
        whole_schedule: false,
        frame: SearchFrame::Object,
        amplitudes: AmplitudeRange::Clamped(4.0),
        ..quick()
    }
}
