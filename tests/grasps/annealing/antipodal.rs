//! Pads on pairs of points anywhere along the fingers, in the air and on a table: against the vertices of the mesh and the
//! solids of the hand.

use graspmill::{
    geom::{RestingPose, SimdLevel},
    grasp::{Antipodal, GraspSampler, PairHold, RatedGrasp, RestingChoice, STAND_OFF, SearchRun, Support},
    hand::Hand,
};
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Vector3};

use super::{
    QUICK, Searcher,
    grippers::{FETCH_GRIPPER, WITH_TORSION, sampler},
    stream,
    table::{lowest, object_from_base},
};
use crate::support::{
    files::repository_path,
    meshes::centred_block,
    robots::{BARRETT, GRIPPER},
    workspace::Workspace,
};

const PANDA_HAND: &str = "scenes/panda_hand.xml";

/// Clearance required of the states on a table [m].
const MARGIN: f64 = 0.004;

/// A table under a pose that each run draws.
pub(super) fn on_table(margin: f64) -> Support {
    Support::Table { margin, resting: RestingChoice::Drawn }
}

fn antipodal(pairs: u32, support: Support) -> Antipodal {
    Antipodal { pairs, friction: 0.4, best: 12, hold: PairHold::Along(support) }
}

/// The table of a run, and its pose of the object.
pub(super) fn table_of<'s>(searcher: &'s Searcher, run: &SearchRun) -> &'s RestingPose {
    let is_it = |pose: &&RestingPose| {
        let apart = pose.world_from_object.isometry() * run.object_from_seed;
        apart.translation.vector.norm() < 1e-9 && apart.rotation.angle() < 1e-6
    };
    searcher.object.resting().poses.iter().find(is_it).expect("a run on a table is one of a resting pose")
}

/// Heights of the object above a table [m]: the lowest and the highest vertex of its mesh.
fn heights(searcher: &Searcher, pose: &RestingPose) -> [f64; 2] {
    let z = |vertex: &[f32; 3]| (pose.world_from_object.isometry() * Point3::from(vertex.map(f64::from))).z;
    let heights = || searcher.mesh.vertices.iter().map(z);
    [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)]
}

/// Fingers that slide go straight: a gripper is lowest at one of the ends of its way, which is evaluated solid by solid.
pub(super) fn height_of_hand(searcher: &Searcher, pose: &RestingPose, grasp: &RatedGrasp) -> f64 {
    let hand = &searcher.hand;
    let (bodies, _) = searcher.model.bodies().expect("its bodies");
    let here = object_from_base(hand, grasp);
    let back = Translation3::from(grasp.object_from_approach.rotation * Vector3::z() * -STAND_OFF) * here;
    let before = hand.posture_values(&grasp.posture);
    let ends = [(&before, &back), (&before, &here), (&grasp.joints, &here)];
    let height = |(joints, base): &(&Vec<f64>, &IsometryMatrix3<f64>)| {
        lowest(&bodies.bodies, pose, base, &hand.link_frames(joints))
    };
    ends.iter().map(height).fold(f64::INFINITY, f64::min)
}

/// Heights of the contacts in the approach frame of the closed hand [m]: how far from the palm it holds.
fn depth(grasp: &RatedGrasp) -> f64 {
    let from_palm = grasp.object_from_approach.inverse();
    grasp.contacts.iter().map(|contact| (from_palm * contact.point).z).sum::<f64>() / grasp.contacts.len() as f64
}

/// Whether no two grasps are alike by the middles of the pads of a gripper that is the same after half a turn, or by the
/// approach frames of any other hand.
pub(super) fn are_unlike(searcher: &Searcher, grasps: &[RatedGrasp]) -> bool {
    let middle = middle_of_pads(&searcher.hand);
    let frame = |grasp: &RatedGrasp| grasp.object_from_approach * middle.unwrap_or_else(Translation3::identity);
    let frames: Vec<_> = grasps.iter().map(frame).collect();
    let half_turn = Rotation3::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let alike = |one: &IsometryMatrix3<f64>, other: &IsometryMatrix3<f64>| {
        let rotated = one.rotation.angle_to(&other.rotation);
        let twin = if middle.is_some() { one.rotation.angle_to(&(other.rotation * half_turn)) } else { f64::INFINITY };
        (one.translation.vector - other.translation.vector).norm() < 0.01999
            && rotated.min(twin) < 14.99f64.to_radians()
    };
    !frames.iter().enumerate().any(|(index, one)| frames[..index].iter().any(|other| alike(one, other)))
}

/// From the approach frame of a gripper to the middle between its pads: the mean of their contacts.
fn middle_of_pads(hand: &Hand) -> Option<Translation3<f64>> {
    hand.closing_line()?;
    let frames = hand.link_frames(&hand.posture_values(&hand.opened()));
    let approach_from_base = hand.approach_pose(&frames).isometry().inverse();
    let of_pads = (0..hand.contacts().len()).filter(|contact| hand.closing_side(hand.contacts()[*contact].link) != 0.0);
    let points: Vec<_> =
        of_pads.map(|contact| (approach_from_base * hand.contact_in_base(contact, &frames).0).coords).collect();
    Some(Translation3::from(points.iter().sum::<Vector3<f64>>() / points.len() as f64))
}

/// Every state keeps its margin over the table that its run has drawn, both pads hold the object, and no two are alike.
#[test]
fn on_a_table_hands_stay_above_it() {
    let table = antipodal(150, on_table(MARGIN));
    let (mut states, mut tables, mut sideways) = (0, Vec::new(), 0);
    for (name, scene) in [("box-01", PANDA_HAND), ("mug-01", PANDA_HAND), ("can-01", FETCH_GRIPPER)] {
        let searcher = Searcher::with_hand(name, scene);
        let mut sampler = sampler(&searcher);
        for seed in 0..3 {
            let run = sampler.antipodal(&searcher.object, &table, &mut stream(seed));
            let pose = table_of(&searcher, &run);
            tables.push(format!("{name} {:?}", pose.world_from_object));
            let [low, high] = heights(&searcher, pose);
            assert!(low.abs() < 1e-5, "{name} lies {low} m off its table");
            assert!(are_unlike(&searcher, &run.grasps) && run.grasps.len() <= 12);
            for grasp in &run.grasps {
                let height = height_of_hand(&searcher, pose, grasp);
                assert!(height >= MARGIN - 1e-9, "{name}: {height} m above the table");
                assert!(height < high, "{name}: a hand {height} m above the table does not reach down to {high} m");
                assert!(grasp.advance == 0.0 && grasp.penetration <= 1e-4);
                let side =
                    |side: f64| grasp.contacts.iter().any(|contact| searcher.hand.closing_side(contact.link) == side);
                assert!(side(1.0) && side(-1.0), "{name}: both pads hold it");
                let down =
                    -(pose.world_from_object.rotation() * (grasp.object_from_approach.rotation * Vector3::z())).z;
                // A hand that gives way rotates by 20 degrees at most.
                assert!(down > -0.35, "{name}: it comes from below, {down}");
                sideways += u32::from(down < 0.5);
                states += 1;
            }
        }
    }
    tables.sort();
    tables.dedup();
    println!("{states} states on {} tables, {sideways} from aside", tables.len());
    assert!(states >= 40 && sideways > 0 && tables.len() > 3, "{states} {sideways} {tables:?}");
}

/// Every run uses the most probable pose if required; random draws rarely reach it.
#[test]
fn runs_lie_in_the_likeliest_pose_on_demand() {
    let searcher = Searcher::with_hand("box-01", PANDA_HAND);
    let likeliest = |resting: RestingChoice| {
        let table = antipodal(60, Support::Table { margin: MARGIN, resting });
        let poses = &searcher.object.resting().poses;
        let runs = (0..8).map(|seed| sampler(&searcher).antipodal(&searcher.object, &table, &mut stream(seed)));
        runs.filter(|run| std::ptr::eq(table_of(&searcher, run), &raw const poses[0])).count()
    };
    assert_eq!(likeliest(RestingChoice::Likeliest), 8);
    assert!((1..8).contains(&likeliest(RestingChoice::Drawn)));
}

/// In the air a can is held at any depth along the pads, from any side, with either pad on either side.
#[test]
fn pairs_are_taken_anywhere_along_the_pads_and_from_any_side() {
    let searcher = Searcher::with_hand("can-01", FETCH_GRIPPER);
    // One state in fifteen is held along the axis.
    let settings = Antipodal { best: 40, ..antipodal(600, Support::Air) };
    let runs: Vec<SearchRun> =
        (0..3).map(|seed| sampler(&searcher).antipodal(&searcher.object, &settings, &mut stream(seed))).collect();
    let grasps: Vec<&RatedGrasp> = runs.iter().flat_map(|run| &run.grasps).collect();
    assert!(grasps.len() >= 100 && runs.iter().all(|run| are_unlike(&searcher, &run.grasps)), "{}", grasps.len());
    let depths = grasps.iter().map(|grasp| depth(grasp));
    let [nearest, farthest] = depths.fold([f64::INFINITY, 0.0f64], |[low, high], at| [low.min(at), high.max(at)]);
    // Contacts of the pads lie 17.8 to 47.8 mm before the palm, the tips at 62.8 mm.
    assert!(nearest < 0.03 && farthest > 0.05, "held {nearest} to {farthest} m before the palm");
    for axis in 0..3 {
        let along =
            |local: Vector3<f64>| grasps.iter().map(move |grasp| (grasp.object_from_approach.rotation * local)[axis]);
        for local in [Vector3::y(), Vector3::z()] {
            let [low, high] = along(local).fold([0.0f64; 2], |[low, high], part| [low.min(part), high.max(part)]);
            // A can is held across its axis or along it.
            assert!(low < -0.4 && high > 0.4, "{local:?} leads from {low} to {high} along axis {axis}");
        }
    }
}

/// A plate that is flat on the table and wider than the opened gripper is out of reach, and the run reports why; a bar
/// is held by its sides.
#[test]
fn plates_on_a_table_are_held_by_their_sides_or_not_at_all() {
    let table = antipodal(300, on_table(0.002));
    let plate = Searcher::with_mesh(centred_block([0.1, 0.1, 0.003]), PANDA_HAND);
    let run = sampler(&plate).antipodal(&plate.object, &table, &mut stream(1));
    assert!(plate.object.resting().poses.iter().all(|pose| pose.height < 0.01), "it lies flat");
    let losses = run.losses.expect("pairs were drawn");
    assert!(run.grasps.is_empty() && losses.pairs == 300 && losses.below_table > 100, "{losses:?}");
    let told = losses.to_string();
    assert!(
        told.starts_with("of 300 pairs of points ") && told.contains("nearer to the table than its margin"),
        "{told}"
    );
    assert_eq!(losses.unopposed + losses.too_wide + losses.below_table + losses.in_object, 300);
    assert_eq!(run.failed, 300);

    let bar = Searcher::with_mesh(centred_block([0.1, 0.02, 0.012]), PANDA_HAND);
    let mut states = 0;
    for seed in 0..3 {
        let run = sampler(&bar).antipodal(&bar.object, &table, &mut stream(seed));
        let pose = table_of(&bar, &run);
        for grasp in &run.grasps {
            let line = pose.world_from_object.rotation() * (grasp.object_from_approach.rotation * Vector3::y());
            assert!(line.z.abs() < 0.1, "it is held by its sides, not {line:?}");
            assert!(height_of_hand(&bar, pose, grasp) >= 0.002 - 1e-9);
            states += 1;
        }
    }
    assert!(states > 10, "{states}");
}

#[test]
fn a_run_on_a_table_is_the_same_every_time_and_at_every_level() {
    assert_is_the_same(&Searcher::with_hand("can-01", PANDA_HAND), &antipodal(60, on_table(MARGIN)));
}

/// A run is the same by a used sampler, by a new one, and without vector instructions.
pub(super) fn assert_is_the_same(searcher: &Searcher, settings: &Antipodal) {
    let run =
        |sampler: &mut GraspSampler| format!("{:?}", sampler.antipodal(&searcher.object, settings, &mut stream(3)));
    let mut used = sampler(searcher);
    let first = run(&mut used);
    assert_eq!(run(&mut used), first, "nothing of the run before is left");
    assert_eq!(run(&mut sampler(searcher)), first);
    let mut scalar = GraspSampler::new(&searcher.search, &QUICK, &WITH_TORSION, SimdLevel::Scalar);
    assert_eq!(run(&mut scalar), first);
}

/// The mug's wall is 3 mm thick and its handle 12 mm: a few per cent of the pairs fit the Panda's hand on a table. The budget is
/// large enough for all states, and the run ends long before it.
#[test]
fn a_mug_on_a_table_has_grasps_of_the_pandas_hand() {
    let searcher = Searcher::with_hand("mug-01", PANDA_HAND);
    let table = Antipodal { best: 6, ..antipodal(20_000, on_table(0.002)) };
    let run = sampler(&searcher).antipodal(&searcher.object, &table, &mut stream(5));
    let losses = run.losses.expect("pairs were drawn");
    println!("{losses}");
    assert_eq!(run.grasps.len(), 6, "{losses}");
    assert!(!losses.budget_spent && losses.pairs < 20_000 && run.steps == losses.pairs);
    assert!(are_unlike(&searcher, &run.grasps));
    // Draws do not depend on the budget.
    let smaller = Antipodal { pairs: losses.pairs, ..table };
    let again = sampler(&searcher).antipodal(&searcher.object, &smaller, &mut stream(5));
    assert_eq!(format!("{again:?}"), format!("{run:?}"));
    let short = Antipodal { pairs: losses.pairs - 1, ..table };
    let short = sampler(&searcher).antipodal(&searcher.object, &short, &mut stream(5));
    assert!(short.losses.expect("pairs").budget_spent && short.grasps.len() == 5);
    let schemes: std::collections::BTreeSet<_> = run.grasps.iter().map(|grasp| grasp.point_scheme).collect();
    assert!(!schemes.contains(&None) && schemes.len() > 1, "{schemes:?}");
}

/// Triangles in a solid of the hand are found before distances are measured, and rule out no state that distances allow.
#[test]
fn states_are_those_of_exact_distances() {
    for (name, scene, support) in [
        ("mug-01", PANDA_HAND, on_table(0.002)),
        ("bottle-01", FETCH_GRIPPER, Support::Air),
        ("can-01", BARRETT, on_table(0.002)),
    ] {
        let searcher = Searcher::with_hand(name, scene);
        let settings = antipodal(60, support);
        let run = sampler(&searcher).antipodal(&searcher.object, &settings, &mut stream(2));
        let exact = sampler(&searcher).with_exact_overlaps().antipodal(&searcher.object, &settings, &mut stream(2));
        assert_eq!(format!("{run:?}"), format!("{exact:?}"), "{name}");
        assert!(!run.grasps.is_empty(), "{name}");
    }
}

/// Half a turn about the approach: the Panda's hand and the Fetch's gripper are the same after it, but not with a finger or a palm
/// moved, and no hand of several fingers is.
#[test]
fn grippers_are_symmetric_by_their_solids() {
    let is_symmetric =
        |scene: &str| Searcher::with_mesh(centred_block([0.04; 3]), scene).search.is_half_turn_symmetric();
    assert_eq!([PANDA_HAND, FETCH_GRIPPER, GRIPPER, BARRETT].map(is_symmetric), [true, true, true, false]);
    let workspace = Workspace::new();
    let read = |name: &str| std::fs::read_to_string(repository_path(name)).expect("a hand of the repository");
    let panda = read(PANDA_HAND);
    for (number, (from, to)) in [
        (r#"<geom name="palm" pos="0 0 0.029""#, r#"<geom name="palm" pos="0 0.01 0.029""#),
        (r#"quat="0 0 0 1">"#, r#"quat="0 0 0 1"><geom pos="0.012 0.01 0.03" size="0.002 0.002 0.002" mass="0.001"/>"#),
    ]
    .into_iter()
    .enumerate()
    {
        assert!(panda.contains(from));
        let file = workspace.write(format!("hand-{number}.xml"), panda.replace(from, to));
        workspace.write(format!("hand-{number}.toml"), read("scenes/panda_hand.toml"));
        assert!(!is_symmetric(file.to_str().expect("text")), "{to}");
    }
}
