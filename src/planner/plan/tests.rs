//! Plans of true hands for a can among neighbours on a table.

use std::{
    path::Path,
    sync::{Arc, LazyLock},
};

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Vector3};

use super::*;
use crate::energy::{
    ContactEnergy, EnergyForm, HandShape, HeatmapEnergy, HeatmapSettings, Heatmaps, ReachModel, Visibility,
};
use kernel::{
    contact::ContactSurface,
    geom::{GridPlacement, Intrinsics, OccupancyGrid, TriMesh},
    voxel::InsideTest,
};
use robot::grasp::{DistinctGrasps, HandSearch, KindDigits, SceneObstacle};

const CELL: f64 = 0.004;

/// A can of 64 mm, 96 mm high, upright.
fn can() -> PlanObject {
    let mut cells = OccupancyGrid::new(40);
    for index in 0..40 * 40 * 24u32 {
        let [x, y, z] = [index / 24 % 40, index / 960, index % 24];
        let across = [x, y].map(|at| (f64::from(at) - 19.5).powi(2)).iter().sum::<f64>();
        if across < 64.0 {
            cells.set([x, y, z + 8]);
        }
    }
    let placement = GridPlacement { resolution: 40, centre: Point3::origin(), cell_size: CELL };
    let mut seen = OccupancyGrid::new(40);
    cells.cells().filter(|cell| cell[0] >= 20).for_each(|cell| seen.set(cell));
    PlanObject::from_grid(&cells, &placement).and_then(|can| can.with_seen_cells(seen, &placement)).expect("cells")
}

/// Height of the table below it [m].
const TABLE: f64 = (8.0 - 0.45 * 40.0) * CELL;

/// A hand, a can, and a box beside it.
struct Scene {
    hand: Arc<HandSearch>,
    can: PlanObject,
    neighbours: Vec<SceneObstacle>,
}

/// The Barrett hand and a parallel gripper, made once: which of their contacts face each other takes seconds.
static BARRETT: LazyLock<Scene> = LazyLock::new(|| Scene::new("barrett_bh8_280"));
static GRIPPER: LazyLock<Scene> = LazyLock::new(|| Scene::new("parallel_gripper"));

impl Scene {
    fn new(hand: &str) -> Self {
        let path = format!("{}/../../scenes/{hand}.xml", env!("CARGO_MANIFEST_DIR"));
        let model = sim::HandModel::open(Path::new(&path)).expect("a hand");
        let (bodies, _) = model.bodies().expect("its bodies");
        let hand = Arc::new(HandSearch::new(model.hand(), &bodies).expect("eigengrasps"));
        let block = TriMesh::walls([0.03, 0.1, 0.1], 0.014);
        let surface = ContactSurface::new(&block, InsideTest::WindingNumber).expect("a surface");
        let beside = IsometryMatrix3::from_parts(Translation3::new(-0.09, 0.0, TABLE), Rotation3::identity());
        let neighbours = vec![SceneObstacle { surface: Arc::new(surface), scene_from_obstacle: beside }];
        Self { hand, can: can(), neighbours }
    }

    fn inputs(&self) -> PlanInputs<'_> {
        PlanInputs {
            hand: &self.hand,
            target: &self.can,
            scene_from_target: IsometryMatrix3::identity(),
            neighbours: &self.neighbours,
            table: Some(TABLE),
            camera: None,
            heatmaps: None,
            reach: None,
            motion: None,
            settings: PlanSettings { best: 4, budget: 24_000, ..PlanSettings::STANDARD },
            seed: 7,
        }
    }

    fn plan(&self, inputs: &PlanInputs<'_>) -> GraspPlan {
        let plan = plan_grasps(inputs).expect("a plan");
        let ends: u64 = plan.funnel.counts().map(|(_, count)| count).sum();
        assert_eq!(ends, plan.funnel.proposed(), "{:?}", plan.funnel);
        assert_eq!(plan.funnel.count(FunnelEnd::Kept), plan.grasps.len() as u64);
        let kept: u64 = plan.rounds.iter().flat_map(|round| round.kept).sum();
        let work: u64 = plan.rounds.iter().flat_map(|round| round.work).sum();
        assert_eq!((kept, work), (plan.grasps.len() as u64, plan.work));
        let mut distinct = DistinctGrasps::new(self.can.search().radius());
        for grasp in &plan.grasps {
            assert!(distinct.is_apart(&grasp.object_from_approach));
            distinct.add(&grasp.object_from_approach);
            assert!(grasp.clearance >= inputs.settings.margin - 1e-3 && grasp.epsilon >= 0.01, "{grasp:?}");
            let back = (grasp.scene_from_pregrasp.translation.vector - grasp.scene_from_base.translation.vector).norm();
            assert!((back - 0.1).abs() < 1e-9);
        }
        plan
    }
}

#[test]
fn plans_have_the_same_bytes_on_one_and_two_threads() {
    for scene in [&BARRETT, &GRIPPER] {
        let hand = scene.hand.hand().name();
        let settings = PlanSettings { budget: 48_000, ..scene.inputs().settings };
        let inputs = PlanInputs { settings, ..scene.inputs() };
        let plan = scene.plan(&inputs);
        println!("{hand}: {} kept of {}, work {}", plan.grasps.len(), plan.funnel.proposed(), plan.work);
        for round in &plan.rounds {
            println!("  {round:?}");
        }
        plan.funnel.counts().for_each(|(end, count)| println!("  {}: {count}", end.name()));
        assert!(!plan.grasps.is_empty(), "{hand}: {} grasps", plan.grasps.len());
        let success = |grasp: &RankedGrasp| grasp.p_reach * grasp.p_held;
        assert!(plan.grasps.is_sorted_by(|one, other| success(one) >= success(other)));
        assert!(plan.grasps.iter().all(|grasp| grasp.seen_contacts.is_some() && grasp.p_reach == 1.0));
        for threads in [2, 1] {
            let settings = PlanSettings { threads, ..inputs.settings };
            let again = scene.plan(&PlanInputs { settings, ..inputs });
            assert_eq!(format!("{again:?}"), format!("{plan:?}"), "{hand}, {threads} threads");
        }
    }
}

#[test]
fn unreachable_states_are_lost_by_name_and_likely_ones_come_first() {
    let scene = &BARRETT;
    // Reachable is what has its base on the side x > 20 mm.
    let side = |pose: &[f64; 6]| (0.02 - pose[0]) / 0.05;
    let reach = |distance| PlanReach {
        distance,
        map_from_scene: IsometryMatrix3::identity(),
        base_from_site: IsometryMatrix3::identity(),
        model: ReachModel::FETCH,
    };
    let inputs = scene.inputs();
    let settings = PlanSettings { energy: SearchEnergy::Reachability(EnergyForm::Standard), ..inputs.settings };
    let plan = scene.plan(&PlanInputs { reach: Some(reach(&side)), settings, ..inputs });
    assert!(plan.funnel.count(FunnelEnd::UnreachableByField) > 0, "{:?}", plan.funnel);
    for grasp in &plan.grasps {
        let distance = (0.02 - grasp.scene_from_base.translation.x) / 0.05;
        assert!(grasp.energies.distance.is_some_and(|found| (found - distance).abs() < 1e-9));
        assert!(distance < 1.5 && (grasp.p_reach - ReachModel::FETCH.probability(distance)).abs() < 1e-12);
    }
    // By energy, as in the thesis.
    let thesis = PlanSettings { ranking: Ranking::Energy, ..settings };
    let by_energy = scene.plan(&PlanInputs { reach: Some(reach(&side)), settings: thesis, ..inputs });
    let key = |grasp: &RankedGrasp| {
        let RankedEnergies { contact, potential, distance, .. } = grasp.energies;
        crate::energy::grasp_energy(EnergyForm::Standard, potential, contact, distance.expect("a map"))
    };
    assert!(by_energy.grasps.is_sorted_by(|one, other| key(one) <= key(other)));
    // A map without numbers reaches nothing.
    let nowhere = |_: &[f64; 6]| f64::NAN;
    let plan = scene.plan(&PlanInputs { reach: Some(reach(&nowhere)), settings, ..inputs });
    assert!(plan.grasps.is_empty() && plan.funnel.count(FunnelEnd::UnreachableByField) > 0, "{:?}", plan.funnel);
}

#[test]
fn the_motion_stage_of_the_caller_decides() {
    let scene = &GRIPPER;
    let from_above = |base: &IsometryMatrix3<f64>, _: &[f64]| match base.translation.z {
        z if z > 0.0 => MotionVerdict::Reached(1),
        _ => MotionVerdict::Refused("no_ik"),
    };
    let plan = scene.plan(&PlanInputs { motion: Some(&from_above), ..scene.inputs() });
    assert!(plan.grasps.iter().all(|grasp| grasp.motion == MotionVerdict::Reached(1)));
    let never = |_: &IsometryMatrix3<f64>, _: &[f64]| MotionVerdict::Refused("not_found");
    let plan = scene.plan(&PlanInputs { motion: Some(&never), ..scene.inputs() });
    assert!(plan.grasps.is_empty() && plan.funnel.count(FunnelEnd::NoMotion) > 0, "{:?}", plan.funnel);
}

#[test]
fn cameras_and_heatmaps_guide_the_searches() {
    let scene = &BARRETT;
    let digits = KindDigits::new(scene.hand.hand()).expect("a Barrett hand");
    let hand = scene.hand.hand();
    let tip = |name: &str| hand.contacts().iter().position(|contact| contact.name == name).expect("a tip");
    let intrinsics = Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.05).expect("a camera");
    let energy = HeatmapEnergy {
        types: vec![HandShape { spread: 1.0, flexions: [0.8; 3], roll: 0.0 }],
        maps: Heatmaps::new(1, [52, 72], vec![-0.1; 4 * 52 * 72]).expect("values"),
        camera: intrinsics,
        settings: HeatmapSettings::STANDARD,
    };
    let tips = ["distal_1_outer", "distal_2_outer", "distal_3_outer"].map(tip);
    // 0.8 m in front of the can along x, z towards it and y down.
    let rotation = Matrix3::from_columns(&[Vector3::y(), -Vector3::z(), -Vector3::x()]);
    let camera = PlanCamera {
        scene_from_camera: IsometryMatrix3::from_parts(
            Translation3::new(0.8, 0.0, 0.0),
            Rotation3::from_matrix_unchecked(rotation),
        ),
        intrinsics,
    };
    let inputs = PlanInputs {
        camera: Some(camera),
        heatmaps: Some(HeatmapInput { energy: &energy, digits: &digits, tips }),
        ..scene.inputs()
    };
    let facing = ContactEnergy { visible: Visibility::Facing, ..ContactEnergy::STANDARD };
    for energy in [SearchEnergy::Contact(facing), SearchEnergy::Combined { rho: 0.1, contact: facing }] {
        let plan = scene.plan(&PlanInputs { settings: PlanSettings { energy, ..inputs.settings }, ..inputs });
        assert!(plan.funnel.proposed() > 20, "{:?}", plan.funnel);
    }
    for (energy, what) in [
        (SearchEnergy::Contact(facing), "a camera"),
        (SearchEnergy::Combined { rho: 0.1, contact: ContactEnergy::STANDARD }, "a camera"),
        (SearchEnergy::Reachability(EnergyForm::Corrected), "a reachability map"),
    ] {
        let settings = PlanSettings { energy, ..inputs.settings };
        let refused = plan_grasps(&PlanInputs { settings, ..scene.inputs() });
        assert_eq!(refused, Err(UnplannableHand::Missing(what)));
    }
}
