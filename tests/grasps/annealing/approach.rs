//! Hands with several fingers that come along surface normals: against the normals and the vertices of the mesh.

use std::collections::BTreeSet;

use graspmill::{
    geom::{SimdLevel, TriMesh},
    grasp::{ApproachDraws, GraspSampler, HandPassage, RatedGrasp, SearchRun},
    words::GraspVerdict,
};

use super::{
    QUICK, Searcher,
    antipodal::are_unlike,
    grippers::{WITH_TORSION, sampler},
    stream,
    table::object_from_base,
};
use crate::support::{meshes::centred_block, robots::BARRETT};

const DRAWS: ApproachDraws = ApproachDraws { draws: 2_000, cone: 0.5, friction: 0.4, best: 10 };

fn runs(searcher: &Searcher, settings: &ApproachDraws) -> Vec<SearchRun> {
    (0..3).map(|seed| sampler(searcher).approaches(&searcher.object, settings, &mut stream(seed))).collect()
}

/// Fingers of the Barrett hand that touch: the names of their links end with their numbers.
fn fingers(searcher: &Searcher, grasp: &RatedGrasp) -> BTreeSet<char> {
    let names = grasp.contacts.iter().map(|contact| &searcher.hand.links()[contact.link]);
    names.filter_map(|name| name.chars().last()).filter(char::is_ascii_digit).collect()
}

/// A plate of 6 mm.
fn plate() -> TriMesh {
    centred_block([0.06, 0.05, 0.003])
}

/// A can and a box: states press from both sides, are unlike each other, and some hold with all three fingers by force closure. The
/// hand comes in its posture past the object.
#[test]
fn cans_and_boxes_are_held_by_three_fingers_with_closure() {
    for shape in ["can-01", "box-01"] {
        let searcher = Searcher::with_hand(shape, BARRETT);
        let mut passage = HandPassage::new(&searcher.search, 0.0);
        let (mut states, mut closed) = (0, 0);
        for run in runs(&searcher, &DRAWS) {
            let losses = run.approach_losses.expect("approaches were drawn");
            println!("{shape}: {} states, {losses}", run.grasps.len());
            assert!(are_unlike(&searcher, &run.grasps) && run.grasps.len() <= 10 && run.steps == losses.draws);
            for grasp in &run.grasps {
                let contacts = &grasp.contacts;
                let opposes = contacts.iter().any(|one| {
                    contacts.iter().any(|other| one.link != other.link && one.normal.dot(&other.normal) < -0.5)
                });
                assert!(opposes && grasp.advance == 0.0 && grasp.penetration <= 1e-4 && grasp.point_scheme.is_some());
                let posture = searcher.hand.posture_of(&grasp.amplitudes);
                assert!(posture.iter().zip(&grasp.posture).all(|(one, other)| (one - other).abs() < 1e-12));
                let base = object_from_base(&searcher.hand, grasp);
                assert_eq!(passage.past_object(&searcher.surface, &base, &grasp.posture).shaped, None, "{shape}");
                states += 1;
                let holds = fingers(&searcher, grasp).len() == 3 && grasp.verdict == GraspVerdict::Kept;
                closed += u32::from(holds);
            }
        }
        println!("{shape}: {states} states, {closed} by three fingers with closure");
        assert!(states >= 20 && closed >= 5, "{shape}: {states} {closed}");
    }
}

/// A plate is pinched across its 6 mm, from its edges; the hand opens so wide that it also wraps its 100 and 120 mm.
#[test]
fn thin_plates_are_pinched() {
    let searcher = Searcher::with_mesh(plate(), BARRETT);
    let runs = runs(&searcher, &DRAWS);
    let grasps: Vec<&RatedGrasp> = runs.iter().flat_map(|run| &run.grasps).collect();
    let pinches = grasps.iter().filter(|grasp| {
        let along = |sign: f64| grasp.contacts.iter().any(|contact| contact.normal.z * sign > 0.99);
        // The hand comes from aside.
        along(1.0) && along(-1.0) && grasp.object_from_approach.rotation.matrix()[(2, 2)].abs() < 0.6
    });
    let pinches = pinches.count();
    println!("{pinches} pinches of {} states", grasps.len());
    assert!(grasps.len() >= 20 && pinches >= 8, "{pinches} of {}", grasps.len());
}

/// A run ends once it has its states, and draws do not depend on the budget.
#[test]
fn the_budget_of_draws_ends_a_run() {
    let searcher = Searcher::with_hand("can-01", BARRETT);
    let run = |draws: u32| {
        sampler(&searcher).approaches(&searcher.object, &ApproachDraws { draws, best: 4, ..DRAWS }, &mut stream(5))
    };
    let all = run(5_000);
    let losses = all.approach_losses.expect("approaches were drawn");
    assert!(all.grasps.len() == 4 && !losses.budget_spent && all.is_budget_spent() == Some(false));
    assert_eq!(format!("{:?}", run(losses.draws)), format!("{all:?}"));
    let short = run(losses.draws - 1);
    assert!(short.grasps.len() == 3 && short.is_budget_spent() == Some(true));
    // Too large for any posture of the hand: the counts name the cause.
    let block = Searcher::with_mesh(centred_block([0.4; 3]), BARRETT);
    let none = sampler(&block).approaches(&block.object, &ApproachDraws { draws: 50, ..DRAWS }, &mut stream(1));
    let losses = none.explained_losses().expect("approaches were drawn");
    assert!(none.grasps.is_empty() && none.failed == 50, "{losses}");
    assert!(losses.starts_with("of 50 approaches ") && losses.contains("wider than the hand opens"), "{losses}");
}

/// A run is the same by a used sampler, by a new one, by exact distances alone, and without vector instructions.
#[test]
fn a_run_of_approaches_is_the_same_every_time_and_at_every_level() {
    let searcher = Searcher::with_mesh(plate(), BARRETT);
    let settings = ApproachDraws { draws: 300, ..DRAWS };
    let run =
        |sampler: &mut GraspSampler| format!("{:?}", sampler.approaches(&searcher.object, &settings, &mut stream(3)));
    let mut used = sampler(&searcher);
    let first = run(&mut used);
    assert_eq!(run(&mut used), first, "nothing of the run before is left");
    assert_eq!(run(&mut sampler(&searcher)), first);
    assert_eq!(run(&mut sampler(&searcher).with_exact_overlaps()), first);
    let mut scalar = GraspSampler::new(&searcher.search, &QUICK, &WITH_TORSION, SimdLevel::Scalar);
    assert_eq!(run(&mut scalar), first);
}
