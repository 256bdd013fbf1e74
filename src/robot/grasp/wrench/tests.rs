use nalgebra::{Matrix3, Point3, Rotation3, Unit, Vector3};
use proptest::prelude::*;

use super::*;
use kernel::{geom::SimdLevel, seed::Stream};

const MASS: MassFrame = MassFrame { centre: Point3::new(0.002, -0.001, 0.003), radius: 0.06 };
const EXACT: EpsilonLimits = EpsilonLimits::EXACT;

fn solver() -> EpsilonSolver {
    EpsilonSolver::new(SimdLevel::detect())
}

/// Epsilon of forces and of wrenches, and how the search in six dimensions ended.
fn epsilons(set: &WrenchSet) -> (f64, f64, EpsilonEnd) {
    let (forces, wrenches) = (solver().of_forces(set, &EXACT), solver().of_wrenches(set, &EXACT));
    assert!(forces.end != EpsilonEnd::Capped && wrenches.end != EpsilonEnd::Capped);
    (forces.upper, wrenches.upper, wrenches.end)
}

/// Contacts on the unit sphere, scaled, that push towards its centre.
fn on_ball(directions: &[[f64; 3]]) -> Vec<Contact> {
    let contact = |direction: &[f64; 3]| {
        let outward = Unit::new_normalize(Vector3::from(*direction));
        Contact::new(MASS.centre + outward.into_inner() * MASS.radius, -outward)
    };
    directions.iter().map(contact).collect()
}

fn direction(stream: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.normal()).normalize()
}

/// Contacts all around an ellipsoid, leaning.
fn random_contacts(stream: &mut Stream, count: usize) -> Vec<Contact> {
    let contact = |_| {
        let outward = direction(stream);
        let inward = Unit::new_normalize(0.6 * direction(stream) - outward);
        let point = MASS.centre + outward.component_mul(&Vector3::new(0.04, 0.03, 0.06));
        Contact::new(point, inward).with_tangent(&direction(stream)).with_weight(stream.uniform(0.3, 2.0))
    };
    (0..count).map(contact).collect()
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-9
}

#[test]
fn a_tangent_is_across_its_normal() {
    let mut stream = Stream::of_job(1, b"", "tangents");
    for _ in 0..100 {
        let contact = Contact::new(Point3::origin(), Unit::new_normalize(direction(&mut stream)));
        let rotated = contact.with_tangent(&direction(&mut stream));
        for contact in [contact, rotated] {
            assert!(contact.tangent.dot(&contact.normal).abs() < 1e-12 && near(contact.tangent.norm(), 1.0));
        }
    }
}

#[test]
fn a_wrench_is_a_unit_normal_force_and_its_torque_over_the_radius() {
    let contact = Contact::new(MASS.centre + Vector3::new(0.0, 0.03, 0.0), -Vector3::y_axis())
        .with_tangent(&Vector3::z())
        .with_weight(2.0);
    let set = WrenchSet::new(&[contact], &FrictionCone::hard(0.5, 4), &MASS);
    let expected = [[0.0, -2.0, 1.0, 0.5, 0.0, 0.0], [-1.0, -2.0, 0.0, 0.0, 0.0, 0.5]];
    for (wrench, expected) in set.wrenches().zip(expected) {
        assert!(wrench.iter().zip(expected).all(|(value, expected)| near(*value, expected)), "{wrench:?}");
    }
    assert_eq!(set.len(), 4);
    let soft = WrenchSet::new(&[contact], &FrictionCone::soft(0.5, 0.006), &MASS);
    let poles: Vec<[f64; 6]> = soft.wrenches().skip(18).collect();
    assert!(near(poles[0][4], -0.2) && near(poles[1][4], 0.2), "{poles:?}");
}

#[test]
fn soft_edges_lie_on_the_ellipsoid() {
    let cone = FrictionCone::soft(0.7, 0.01);
    assert_eq!(cone.edges(), 20);
    for [along, across, torsion] in &cone.edges {
        let size = (along * along + across * across) / 0.49 + torsion * torsion / 1e-4;
        assert!((size - 1.0).abs() < 1e-12, "{size}");
    }
}

#[test]
fn two_opposed_hard_contacts_resist_no_torque_about_their_line() {
    for (friction, edges) in [(0.2, 8), (0.8, 16), (0.8, 20)] {
        let contacts = on_ball(&[[1.0, 2.0, 3.0], [-1.0, -2.0, -3.0]]);
        let set = WrenchSet::new(&contacts, &FrictionCone::hard(friction, edges), &MASS);
        let (forces, wrenches, end) = epsilons(&set);
        assert!(forces > 0.0 && wrenches == 0.0 && end == EpsilonEnd::Outside, "{forces} {wrenches} {end:?}");
        assert_eq!(HullSolver::default().of_wrenches(&set).volume, 0.0);
        let soft = WrenchSet::new(&contacts, &FrictionCone::soft(friction, 0.01), &MASS);
        assert!(epsilons(&soft).1 > 0.0);
    }
}

#[test]
fn three_contacts_around_hold_up_by_friction_alone() {
    let third = 2.0 * std::f64::consts::PI / 3.0;
    let around = [0.0, 1.0, 2.0].map(|k: f64| [libm::cos(k * third), libm::sin(k * third), 0.0]);
    for (friction, edges) in [(0.2, 8), (0.4, 16), (0.8, 6)] {
        let contacts = on_ball(&around).into_iter();
        // An edge upwards; then a side of the polygon.
        let upwards: Vec<Contact> = contacts.map(|contact| contact.with_tangent(&Vector3::z())).collect();
        let cone = FrictionCone::hard(friction, edges);
        let set = WrenchSet::new(&upwards, &cone, &MASS);
        assert!(near(epsilons(&set).0, friction), "{friction}: {:?}", epsilons(&set));
        let (sin, cos) = libm::sincos(std::f64::consts::PI / edges as f64);
        let rotated = upwards
            .iter()
            .map(|contact| contact.with_tangent(&(Vector3::z() * cos + contact.normal.cross(&Vector3::z()) * sin)));
        let set = WrenchSet::new(&rotated.collect::<Vec<_>>(), &cone, &MASS);
        assert!(near(epsilons(&set).0, friction * cos), "{friction}: {:?}", epsilons(&set));
    }
}

#[test]
fn six_contacts_of_an_octahedron() {
    let axes =
        [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let frictionless = WrenchSet::new(&on_ball(&axes), &FrictionCone::hard(0.0, 8), &MASS);
    assert_eq!(frictionless.len(), 6);
    let (forces, wrenches, end) = epsilons(&frictionless);
    assert!(near(forces, 1.0 / libm::sqrt(3.0)) && wrenches == 0.0 && end == EpsilonEnd::Outside);
    let volume = HullSolver::default().of_forces(&frictionless);
    assert!(near(volume.volume, 4.0 / 3.0) && volume.facets == 8, "{volume:?}");
    for friction in [0.1, 0.2, 0.4] {
        // Eight edges, the diagonals among them, meet over the middle of each octant.
        let set = WrenchSet::new(&on_ball(&axes), &FrictionCone::hard(friction, 8), &MASS);
        let expected = (1.0 + friction * libm::sqrt(2.0)) / libm::sqrt(3.0);
        assert!(near(epsilons(&set).0, expected), "{friction}: {:?}", epsilons(&set));
    }
}

#[test]
fn frictionless_contacts_of_a_tetrahedron() {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let set = WrenchSet::new(&on_ball(&corners), &FrictionCone::hard(0.0, 16), &MASS);
    let (forces, wrenches, _) = epsilons(&set);
    assert!(near(forces, 1.0 / 3.0) && wrenches == 0.0);
    // Three contacts, and none: nothing is enclosed.
    for contacts in [&on_ball(&corners)[..3], &[]] {
        let set = WrenchSet::new(contacts, &FrictionCone::hard(0.0, 16), &MASS);
        assert_eq!(epsilons(&set), (0.0, 0.0, EpsilonEnd::Outside));
        assert_eq!(HullSolver::default().of_forces(&set).volume, 0.0);
    }
}

#[test]
fn known_polytopes_of_six_dimensions() {
    let cross: Vec<[f64; 6]> = (0..12)
        .map(|corner| {
            std::array::from_fn(|axis| if axis != corner / 2 { 0.0 } else { 1.0 - 2.0 * (corner % 2) as f64 })
        })
        .collect();
    let set = WrenchSet::from_wrenches(&cross);
    assert!(near(epsilons(&set).1, 1.0 / libm::sqrt(6.0)));
    let volume = HullSolver::default().of_wrenches(&set);
    assert!(near(volume.volume, 64.0 / 720.0) && volume.facets == 64, "{volume:?}");
    let cube: Vec<[f64; 6]> =
        (0..64).map(|corner| std::array::from_fn(|axis| 1.0 - 2.0 * f64::from(corner >> axis & 1))).collect();
    let set = WrenchSet::from_wrenches(&cube);
    assert!(near(epsilons(&set).1, 1.0), "{:?}", epsilons(&set));
    let volume = HullSolver::default().of_wrenches(&set);
    assert!((volume.volume / 64.0 - 1.0).abs() < 1e-8, "{volume:?}");
    // Its middle half from a corner on has the origin on its border.
    let beside: Vec<[f64; 6]> = cube.iter().map(|corner| corner.map(|value| value + 1.0)).collect();
    assert_eq!(epsilons(&WrenchSet::from_wrenches(&beside)), (0.0, 0.0, EpsilonEnd::Outside));
}

#[test]
fn every_level_of_instructions_gives_the_same_bits() {
    let mut stream = Stream::of_job(1, b"", "levels");
    for count in [4, 9, 16] {
        let set = WrenchSet::new(&random_contacts(&mut stream, count), &FrictionCone::hard(0.5, 8), &MASS);
        let answers: Vec<_> = SimdLevel::available()
            .map(|level| {
                let mut solver = EpsilonSolver::new(level);
                (solver.of_forces(&set, &EXACT), solver.of_wrenches(&set, &EXACT))
            })
            .collect();
        assert!(answers.windows(2).all(|pair| pair[0] == pair[1]), "{answers:?}");
    }
}

#[test]
fn limits_end_a_search_early_and_never_wrongly() {
    let mut stream = Stream::of_job(1, b"", "limits");
    let (mut warm, mut saved, mut whole) = (solver(), 0, 0);
    for round in 0..300 {
        let set = WrenchSet::new(&random_contacts(&mut stream, 4 + round % 12), &FrictionCone::hard(0.5, 8), &MASS);
        let (forces, truth, _) = epsilons(&set);
        assert!(truth <= forces + 1e-9);
        assert_eq!(warm.wrenches_enclose(&set), truth > 0.0);
        let exact = warm.of_wrenches(&set, &EXACT);
        assert!(near(exact.upper, truth), "{exact:?} {truth}");
        let limit = stream.uniform(0.0, 0.3);
        let limits = EpsilonLimits { above: limit, below: limit, tolerance: 0.0 };
        for found in [warm.of_wrenches(&set, &limits), warm.of_wrenches_within(&set, &limits)] {
            assert!(found.lower <= truth + 1e-9 && found.upper >= truth - 1e-9, "{found:?} {truth}");
            match found.end {
                EpsilonEnd::Above => assert!(truth > limit),
                EpsilonEnd::Below => assert!(truth < limit),
                EpsilonEnd::Outside => assert!(truth == 0.0),
                EpsilonEnd::Closed => assert!(near(found.upper, truth)),
                EpsilonEnd::Capped => panic!("{found:?}"),
            }
            saved += found.facets;
        }
        let coarse = warm.of_wrenches(&set, &EpsilonLimits { tolerance: 0.02, ..EXACT });
        assert!(coarse.lower <= truth + 1e-9 && coarse.upper >= truth - 1e-9 && coarse.upper - coarse.lower < 0.021);
        whole += 2 * exact.facets;
    }
    println!("{saved} facets instead of {whole}");
    assert!(saved < whole / 3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn epsilon_does_not_know_frame_order_or_size(seed in 0u64..1 << 40, count in 2usize..14) {
        let mut stream = Stream::of_job(seed, b"", "laws");
        let contacts = random_contacts(&mut stream, count);
        let cone = if seed % 2 == 0 { FrictionCone::hard(0.5, 8) } else { FrictionCone::soft(0.5, 0.01) };
        let set = WrenchSet::new(&contacts, &cone, &MASS);
        let (forces, wrenches, _) = epsilons(&set);
        let volume = HullSolver::default().of_forces(&set).volume;
        let rotation = Rotation3::from_scaled_axis(direction(&mut stream) * stream.uniform(0.0, 3.0));
        let shift = direction(&mut stream);
        let rotated: Vec<Contact> = contacts.iter().map(|contact| Contact {
            point: rotation * contact.point + shift,
            normal: rotation * contact.normal,
            tangent: rotation * contact.tangent,
            weight: contact.weight,
        }).collect();
        let mass = MassFrame { centre: rotation * MASS.centre + shift, ..MASS };
        let other = WrenchSet::new(&rotated, &cone, &mass);
        let (forces_rotated, wrenches_rotated, _) = epsilons(&other);
        prop_assert!(near(forces, forces_rotated) && near(wrenches, wrenches_rotated), "{wrenches} {wrenches_rotated}");
        prop_assert!((volume - HullSolver::default().of_forces(&other).volume).abs() <= 1e-8 * volume.max(1.0));

        let mut shuffled = contacts.clone();
        stream.shuffle(&mut shuffled);
        let (forces_shuffled, wrenches_shuffled, _) = epsilons(&WrenchSet::new(&shuffled, &cone, &MASS));
        prop_assert!(near(forces, forces_shuffled) && near(wrenches, wrenches_shuffled));

        let heavy: Vec<Contact> = contacts.iter().map(|c| c.with_weight(3.0 * c.weight)).collect();
        let (forces_heavy, wrenches_heavy, _) = epsilons(&WrenchSet::new(&heavy, &cone, &MASS));
        prop_assert!(near(forces, forces_heavy / 3.0) && near(wrenches, wrenches_heavy / 3.0));
    }

    #[test]
    fn one_more_contact_never_weakens_a_grasp(seed in 0u64..1 << 40, count in 3usize..14) {
        let mut stream = Stream::of_job(seed, b"", "more");
        let contacts = random_contacts(&mut stream, count);
        let cone = FrictionCone::hard(0.4, 8);
        let of = |count: usize| {
            let set = WrenchSet::new(&contacts[..count], &cone, &MASS);
            (epsilons(&set), HullSolver::default().of_forces(&set).volume)
        };
        let (((forces, wrenches, _), volume), ((more_forces, more_wrenches, _), more_volume)) = (of(count - 1), of(count));
        prop_assert!(more_forces >= forces - 1e-9 && more_wrenches >= wrenches - 1e-9 && more_volume >= volume - 1e-9);
        prop_assert!(wrenches <= forces + 1e-9);
    }

    #[test]
    fn the_volume_of_a_sheared_cube_is_its_determinant(seed in 0u64..1 << 40) {
        let mut stream = Stream::of_job(seed, b"", "shear");
        let shear = Matrix3::from_fn(|_, _| stream.normal());
        let corner = |bits: i32| Vector3::from_fn(|axis, _| f64::from(bits >> axis & 1));
        let corners: Vec<[f64; 6]> = (0..8).map(|bits| {
            let point = shear * corner(bits);
            [point.x, point.y, point.z, 0.0, 0.0, 0.0]
        }).collect();
        let volume = HullSolver::default().of_forces(&WrenchSet::from_wrenches(&corners)).volume;
        prop_assert!((volume - shear.determinant().abs()).abs() < 1e-7);
    }
}
