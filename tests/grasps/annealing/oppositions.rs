//! Hands of many fingers on pairs of points, between contacts or tips that face each other: against the vertices of the mesh and
//! the solids of the hand.

use std::collections::BTreeSet;

use graspmill::{
    geom::TriMesh,
    grasp::{Antipodal, PairHold, RatedGrasp, SearchRun, Support},
};

use super::{
    Searcher,
    antipodal::{are_unlike, assert_is_the_same, height_of_hand, on_table, table_of},
    grippers::sampler,
    stream,
};
use crate::support::{meshes::centred_block, robots::BARRETT};

/// Clearance required of the states on a table [m].
const MARGIN: f64 = 0.003;

fn antipodal(pairs: u32, support: Support) -> Antipodal {
    Antipodal { pairs, friction: 0.5, best: 8, hold: PairHold::Along(support) }
}

fn runs(searcher: &Searcher, settings: &Antipodal) -> Vec<SearchRun> {
    (0..3).map(|seed| sampler(searcher).antipodal(&searcher.object, settings, &mut stream(seed))).collect()
}

/// Whether two links press on the object against each other.
fn is_held_from_both_sides(grasp: &RatedGrasp) -> bool {
    let contacts = &grasp.contacts;
    contacts
        .iter()
        .any(|one| contacts.iter().any(|other| one.link != other.link && one.normal.dot(&other.normal) < -0.5))
}

fn bar() -> TriMesh {
    centred_block([0.1, 0.02, 0.012])
}

/// A box, a mug and a bar that lies flat: states keep their margin over the table of their run, hold from both sides, and are
/// unlike each other.
#[test]
fn on_a_table_fingers_hold_from_both_sides_and_stay_above_it() {
    let table = antipodal(200, on_table(MARGIN));
    let objects = [Searcher::with_hand("box-01", BARRETT), Searcher::with_hand("mug-01", BARRETT)];
    let (mut states, mut fingers) = (Vec::new(), BTreeSet::new());
    for searcher in objects.into_iter().chain([Searcher::with_mesh(bar(), BARRETT)]) {
        let mut count = 0;
        for run in runs(&searcher, &table) {
            let pose = table_of(&searcher, &run);
            assert!(are_unlike(&searcher, &run.grasps) && run.grasps.len() <= 8);
            for grasp in &run.grasps {
                let height = height_of_hand(&searcher, pose, grasp);
                assert!(height >= MARGIN - 1e-9, "{height} m above the table");
                assert!(is_held_from_both_sides(grasp), "{:?}", grasp.contacts);
                assert!(grasp.advance == 0.0 && grasp.penetration <= 1e-4 && grasp.shift.is_none());
                // The posture is that of its amplitudes, before the fingers close.
                let posture = searcher.hand.posture_of(&grasp.amplitudes);
                assert!(posture.iter().zip(&grasp.posture).all(|(one, other)| (one - other).abs() < 1e-12));
                let links: BTreeSet<usize> = grasp.contacts.iter().map(|contact| contact.link).collect();
                fingers.insert(links.len());
                count += 1;
            }
        }
        states.push(count);
    }
    println!("{states:?} states on tables, held by {fingers:?} links");
    assert!(states.iter().all(|count| *count >= 8), "{states:?}");
    assert!(fingers.contains(&2) && fingers.iter().any(|count| *count >= 3), "pinches and more: {fingers:?}");
}

/// In the air the hand comes from all sides, and holds against the palm, too.
#[test]
fn in_the_air_hands_come_from_all_sides_and_hold_against_the_palm() {
    let searcher = Searcher::with_hand("can-01", BARRETT);
    let runs = runs(&searcher, &antipodal(300, Support::Air));
    let grasps: Vec<&RatedGrasp> = runs.iter().flat_map(|run| &run.grasps).collect();
    assert!(grasps.len() >= 20, "{}", grasps.len());
    assert!(grasps.iter().all(|grasp| is_held_from_both_sides(grasp)));
    // One state in sixty holds against the palm.
    let more = Antipodal { best: 60, ..antipodal(1000, Support::Air) };
    let mut states =
        (0..8).flat_map(|seed| sampler(&searcher).antipodal(&searcher.object, &more, &mut stream(100 + seed)).grasps);
    assert!(states.any(|grasp| grasp.contacts.iter().any(|contact| contact.link == 0)), "none on the palm");
    for axis in 0..3 {
        let towards = grasps.iter().map(|grasp| grasp.object_from_approach.rotation.matrix()[(axis, 2)]);
        let [low, high] = towards.fold([0.0f64; 2], |[low, high], part| [low.min(part), high.max(part)]);
        assert!(low < -0.3 && high > 0.3, "approaches along axis {axis} go from {low} to {high}");
    }
}

#[test]
fn a_run_between_contacts_is_the_same_every_time_and_at_every_level() {
    assert_is_the_same(&Searcher::with_mesh(bar(), BARRETT), &antipodal(60, on_table(MARGIN)));
}
