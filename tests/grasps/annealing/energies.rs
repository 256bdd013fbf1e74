//! Energies recomputed from poses and postures with parry's distances and formulas written down a second time.

use graspmill::{
    geom::MeshQuery,
    grasp::{Annealing, EnergyKind, RatedGrasp, WrenchSpace},
    runtime::planner::energy::{ContactEnergy, HandContact},
};
use nalgebra::{Point3, Vector3};

use super::{QUICK, Searcher, THESIS, annealed};

/// A virtual contact before closing: its normal, and the surface near it by parry: signed distance [m] and direction to the
/// closest point (inside: away from it).
struct VirtualContact {
    normal: Vector3<f64>,
    distance: f64,
    direction: Vector3<f64>,
}

/// The virtual contacts of a grasp.
fn contacts(searcher: &Searcher, query: &MeshQuery, grasp: &RatedGrasp) -> Vec<VirtualContact> {
    let hand = &searcher.hand;
    let frames = hand.link_frames(&hand.posture_values(&grasp.posture));
    let object_from_base = annealed(grasp) * hand.approach_pose(&frames).isometry().inverse();
    let contact = |contact: usize| {
        let (point, normal) = hand.contact_in_base(contact, &frames);
        let (point, normal) = (object_from_base * point, object_from_base.rotation * normal.into_inner());
        let closest = query.closest_point(&point);
        let distance = (point - closest).norm().copysign(searcher.surface.signed_distance(&point));
        VirtualContact { normal, distance, direction: (closest - point) / distance }
    };
    (0..hand.contacts().len()).map(contact).collect()
}

#[test]
fn contact_energies_are_what_the_formula_says() {
    let searcher = Searcher::new("mug-01@16k");
    let query = MeshQuery::new(&searcher.mesh).expect("a surface");
    let mut compared = 0;
    for run in searcher.runs(&QUICK, 6) {
        for grasp in &run.grasps {
            let contacts = contacts(&searcher, &query, grasp);
            if contacts.iter().any(|seen| seen.distance.abs() < 1e-5) {
                continue;
            }
            let sum: f64 = contacts
                .iter()
                .map(|seen| 1e3 * seen.distance.abs() + 50.0 * (1.0 - seen.normal.dot(&seen.direction)))
                .sum();
            let energy = sum / 16.0;
            // A point that two parts of the surface are equally near to has two directions.
            assert!((energy - grasp.energies.contact).abs() < 2e-3, "{energy} {:?}", grasp.energies);
            assert_eq!(grasp.energies.total, grasp.energies.contact);
            // The planner's energy without a camera is the same one.
            let hand = &searcher.hand;
            let joints = hand.posture_values(&grasp.posture);
            let base = annealed(grasp) * hand.approach_pose(&hand.link_frames(&joints)).isometry().inverse();
            let contacts = HandContact::all(hand, &searcher.surface, &base, &joints);
            let planned = ContactEnergy::STANDARD.of(&contacts, &Point3::origin());
            assert!((planned - grasp.energies.contact).abs() < 2e-3, "{planned} {:?}", grasp.energies);
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared} grasps");
}

/// The potential in the space of forces, its hull by brute force: the least support over directions is epsilon.
#[test]
fn potentials_are_below_every_support_of_their_forces() {
    let searcher = Searcher::new("can-01");
    let query = MeshQuery::new(&searcher.mesh).expect("a surface");
    let settings = Annealing { energy: EnergyKind::ContactAndPotential, space: WrenchSpace::Force, ..QUICK };
    let mut compared = 0;
    for grasp in searcher.runs(&settings, 4).iter().flat_map(|run| &run.grasps) {
        let counted: Vec<_> = contacts(&searcher, &query, grasp)
            .into_iter()
            .filter_map(|VirtualContact { normal, distance, direction }| {
                let millimetres = 1e3 * distance.abs();
                let near = normal.dot(&direction) >= 0.7 && millimetres <= 50.0;
                let weight = (std::f64::consts::PI * millimetres / 50.0).cos() + 1.0;
                (near && weight > 0.25).then_some((normal, weight))
            })
            .collect();
        if counted.len() < 3 {
            assert_eq!(grasp.energies.potential, 1.0);
            assert_eq!(grasp.energies.total, grasp.energies.contact);
            continue;
        }
        // A round cone holds the one of eight edges, and that one holds a round cone of cos(pi / 8) of the friction.
        let support = |direction: &Vector3<f64>, friction: f64| {
            let of = |(normal, weight): &(Vector3<f64>, f64)| {
                let along = normal.dot(direction);
                weight * (along + friction * (1.0 - along * along).max(0.0).sqrt())
            };
            counted.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
        };
        let directions = 4000;
        let min = |friction: f64| {
            let each = (0..directions).map(|index| {
                let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(directions);
                let (sin, cos) = (f64::from(index) * 2.399_963_229_728_653).sin_cos();
                let away = (1.0 - z * z).sqrt();
                support(&Vector3::new(away * cos, away * sin, z), friction)
            });
            each.fold(f64::INFINITY, f64::min).max(0.0)
        };
        let epsilon = -grasp.energies.potential;
        let (upper, lower) = (min(0.2), min(0.2 * (std::f64::consts::PI / 8.0).cos()));
        // Between directions the least support is lower by up to 1 % of the largest weight.
        assert!(epsilon <= upper + 1e-6 && epsilon >= lower - 0.08, "{epsilon} not in {lower}..{upper}");
        if epsilon > 0.0 {
            assert!((grasp.energies.total + 100.0 * epsilon).abs() < 1e-9);
        }
        compared += 1;
    }
    assert!(compared > 20, "{compared} grasps");
}

/// In the thesis' scale the potential counts as it is.
#[test]
fn the_thesis_does_not_scale_the_potential() {
    let searcher = Searcher::new("can-01");
    let runs = searcher.runs(&THESIS, 3);
    let potentials = runs.iter().flat_map(|run| &run.grasps).filter(|grasp| grasp.energies.potential < 0.0);
    let mut count = 0;
    for grasp in potentials {
        assert_eq!(grasp.energies.total, grasp.energies.potential);
        count += 1;
    }
    assert!(count > 10, "{count}");
}
