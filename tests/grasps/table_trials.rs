//! Trials of objects that rest on a table: lifted, left, and what the table does to fingers.

use std::{f64::consts::PI, sync::Arc};

use graspmill::{
    contact::ContactSurface,
    geom::{MassProperties, RestingPose, RestingPoses, TriMesh},
    hand::Hand,
    sim::{
        Gravity, Grip, HandModel, Outcome, Phase, TableSupport, TrialConditions, TrialSim, TrialWorker, Verdict,
        mass_of_volume,
    },
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Vector3};

use crate::support::{
    measures::{median, thread_seconds},
    meshes::{centred_block, prepare_scan, scan_file},
    robots::{BARRETT, PANDA_HAND, open_hand},
};

/// Distance from the palm's frame of the Panda's hand to the ends of its fingers [m].
const PANDA_TIPS: f64 = 0.1124;

/// An object and the hand that tries it.
struct Tried {
    surface: Arc<ContactSurface>,
    mass: MassProperties,
    resting: RestingPoses,
    mesh: TriMesh,
}

impl Tried {
    fn new(mesh: TriMesh) -> Self {
        let surface = Arc::new(ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface"));
        let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
        let resting = RestingPoses::from_mesh(&mesh, &mass.centre);
        Self { surface, mass, resting, mesh }
    }

    fn on_table(&self, model: &HandModel) -> TrialWorker {
        TrialWorker::new(&TrialSim::on_table(model, &self.surface, &self.mass).expect("a simulation"))
    }

    fn floating(&self, model: &HandModel) -> TrialWorker {
        TrialWorker::new(&TrialSim::new(model, &self.surface, &self.mass).expect("a simulation"))
    }

    /// The pose in which the object rests with this direction of it up.
    fn upright(&self, up: &Vector3<f64>) -> &RestingPose {
        let is_up = |pose: &&RestingPose| TableSupport::under(pose).up.dot(up) > 0.99;
        self.resting.poses.iter().find(is_up).expect("a resting pose")
    }

    /// The mesh's vertices as the object rests, z up, the table at 0 [m].
    fn standing<'a>(&'a self, pose: &'a RestingPose) -> impl Iterator<Item = Point3<f64>> + 'a {
        let points = self.mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from)));
        points.map(|point| pose.world_from_object.isometry() * point)
    }
}

fn conditions(mass: f64, pose: &RestingPose) -> TrialConditions {
    TrialConditions { table: Some(TableSupport::under(pose)), ..TrialConditions::new(mass) }
}

/// The object in a hand that comes from above: the hand's z down, the origin of its base over a point of the table, its y
/// along a direction of the table.
fn from_above(pose: &RestingPose, over: Point3<f64>, along: &Vector3<f64>) -> IsometryMatrix3<f64> {
    let (y, z) = (along.normalize(), -Vector3::z());
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[y.cross(&z), y, z]));
    let world_from_base = IsometryMatrix3::from_parts(Translation3::from(over.coords), rotation);
    world_from_base.inverse() * pose.world_from_object.isometry()
}

fn told(name: &str, outcome: &Outcome) -> String {
    let force = |grip: &Option<Grip>| grip.as_ref().map_or([0.0; 2], |grip| [grip.force(), grip.largest_force()]);
    format!(
        "{name}: {:?}, closed in {:.2} s, {:.0?} N closed, {:.0?} N at the end (sum, largest), farthest {:.2} mm, depths {:.2} \
         and {:.2} mm, below the table {:.2} mm, {} steps",
        outcome.verdict,
        outcome.closing_time,
        force(&outcome.closed),
        force(&outcome.end),
        1e3 * outcome.farthest,
        1e3 * outcome.start.penetration,
        1e3 * outcome.shaken_penetration,
        1e3 * outcome.start.table_penetration,
        outcome.steps
    )
}

/// Distance by which the closing hand has pushed the centre of mass [m].
fn pushed(tried: &Tried, outcome: &Outcome) -> f64 {
    let closed = outcome.closed.as_ref().expect("it closed");
    (closed.base_from_object * tried.mass.centre - outcome.start.base_from_object * tried.mass.centre).norm()
}

/// A brick between the pads is lifted off the table and shaken; if the hand closes next to it, it stays; with too
/// little friction or too much weight it stays behind.
#[test]
fn a_brick_is_lifted_or_left() {
    let model = open_hand(PANDA_HAND);
    let tried = Tried::new(centred_block([0.03, 0.02, 0.025]));
    let mut worker = tried.on_table(&model);
    let pose = tried.upright(&Vector3::z());
    let at = |aside: f64| from_above(pose, Point3::new(aside, 0.0, PANDA_TIPS + 0.005), &Vector3::y());
    let plain = conditions(0.2, pose);
    let held = worker.run(&[0.03], &at(0.0), &plain).expect("a pose");
    println!("{}", told("brick", &held));
    assert!(held.verdict.is_held() && held.closed_at_rest && held.warnings == 0, "{held:?}");
    assert!(held.farthest < 1e-3 && held.slips.len() == 2, "{held:?}");
    assert_eq!((held.start.penetration, held.start.table_penetration), (0.0, 0.0));
    let force = held.closed.as_ref().expect("closed").force();
    assert!((force - 140.0).abs() < 14.0, "two pads press with 70 N each: {force}");
    let missed = worker.run(&[0.03], &at(0.1), &plain).expect("a pose");
    println!("{}", told("beside it", &missed));
    assert_eq!(missed.verdict, Verdict::NotTouching);
    assert!(pushed(&tried, &missed) < 5e-4, "it stays");
    for (name, changed) in
        [("slippery", TrialConditions { friction: 0.005, ..plain }), ("heavy", TrialConditions { mass: 20.0, ..plain })]
    {
        let outcome = worker.run(&[0.03], &at(0.0), &changed).expect("a pose");
        println!("{}", told(name, &outcome));
        assert!(matches!(outcome.verdict, Verdict::Lost { phase: Phase::Lift, .. }), "{outcome:?}");
    }
}

/// Off its middle the brick is pushed to the middle by one pad, against the table's friction alone: what floats is braked.
#[test]
fn the_object_is_free_while_the_hand_closes() {
    let model = open_hand(PANDA_HAND);
    let tried = Tried::new(centred_block([0.03, 0.02, 0.025]));
    let mut worker = tried.on_table(&model);
    let pose = tried.upright(&Vector3::z());
    let aside = from_above(pose, Point3::new(0.0, 0.01, PANDA_TIPS + 0.005), &Vector3::y());
    for friction in [0.0, 0.5, 1.0] {
        let table = Some(TableSupport { friction, ..TableSupport::under(pose) });
        let outcome =
            worker.run(&[0.035], &aside, &TrialConditions { table, ..conditions(0.2, pose) }).expect("a pose");
        println!("{}", told("pushed to the middle", &outcome));
        assert!(outcome.verdict.is_held(), "{outcome:?}");
        assert!((pushed(&tried, &outcome) - 0.01).abs() < 1e-3, "{outcome:?}");
        let closed = outcome.closed.expect("closed").base_from_object;
        assert!((closed.rotation.angle_to(&outcome.start.base_from_object.rotation)) < 0.02, "it stays upright");
    }
}

/// Scans as they rest on the table are lifted by pinches from above.
#[test]
fn scans_are_lifted_off_the_table() {
    let model = open_hand(PANDA_HAND);
    let mut times = [vec![], vec![]];
    for (name, low) in [("011_banana", 0.004), ("061_foam", 0.01), ("043_phillips", 0.004), ("040_large", 0.004)] {
        let tried = Tried::new(prepare_scan(&scan_file(name)));
        let pose = &tried.resting.poses[0];
        // The narrow side of what lies on the table, at its centre of mass.
        let middle = pose.world_from_object.isometry() * tried.mass.centre;
        let mut spread = nalgebra::Matrix2::zeros();
        for point in tried.standing(pose) {
            let aside = (point - middle).xy();
            spread += aside * aside.transpose();
        }
        let narrow = spread.symmetric_eigen();
        let narrow = narrow.eigenvectors.column(narrow.eigenvalues.imin()).into_owned();
        let tips = Point3::new(middle.x, middle.y, PANDA_TIPS + low);
        let base_from_object = from_above(pose, tips, &Vector3::new(narrow.x, narrow.y, 0.0));
        let conditions = conditions(mass_of_volume(tried.mass.volume), pose);
        let floating = TrialConditions { table: None, ..conditions };
        let tries = [(tried.on_table(&model), conditions), (tried.floating(&model), floating)];
        for (times, (mut worker, conditions)) in times.iter_mut().zip(tries) {
            let began = thread_seconds();
            let outcome = worker.run(&[0.04], &base_from_object, &conditions).expect("a pose");
            times.push(1e3 * (thread_seconds() - began));
            println!("{}", told(name, &outcome));
            assert!(outcome.verdict.is_held() || conditions.table.is_none(), "{name}: {outcome:?}");
        }
    }
    let [on_table, floating] = times;
    println!("{on_table:.0?} ms on a table (median {:.0}), {floating:.0?} ms in the air", median(&on_table));
}

/// A mug is lifted by its rim, one finger inside.
#[test]
fn a_mug_is_lifted_by_its_rim() {
    let model = open_hand(PANDA_HAND);
    let tried = Tried::new(prepare_scan(&scan_file("025_mug")));
    let mut worker = tried.on_table(&model);
    let pose = tried.upright(&Vector3::z());
    let top = tried.standing(pose).map(|point| point.z).fold(0.0, f64::max);
    let rim: Vec<Point3<f64>> = tried.standing(pose).filter(|point| point.z > top - 0.005).collect();
    let middle = rim.iter().map(|point| point.coords).sum::<Vector3<f64>>() / rim.len() as f64;
    let mut held = 0;
    for step in 0..6 {
        let (sine, cosine) = (f64::from(step) * PI / 3.0).sin_cos();
        let out = Vector3::new(cosine, sine, 0.0);
        let radii = rim.iter().map(|point| point.coords - middle).filter(|aside| aside.normalize().dot(&out) > 0.99);
        let radii: Vec<f64> = radii.map(|aside| aside.norm()).collect();
        let wall = middle + out * median(&radii);
        let over = Point3::new(wall.x, wall.y, top - 0.03 + PANDA_TIPS);
        let outcome = worker.run(&[0.02], &from_above(pose, over, &out), &conditions(0.118, pose)).expect("a pose");
        println!("{}", told(&format!("rim at {} degrees", 60 * step), &outcome));
        held += u32::from(outcome.verdict.is_held());
    }
    assert!(held >= 4, "{held} of 6");
}

/// The lowest point of a hand over a table [m].
fn lowest(model: &HandModel, joints: &[f64], table_from_base: &IsometryMatrix3<f64>) -> f64 {
    let hand: &Hand = model.hand();
    let frames = hand.link_frames(joints);
    let (bodies, _) = model.bodies().expect("its bodies");
    let height = |link: usize, geometry: &graspmill::collision::Geometry| {
        let base_from_link = link.checked_sub(1).map_or_else(IsometryMatrix3::identity, |link| frames[link]);
        let table_from_shape = table_from_base * base_from_link * geometry.link_from_shape;
        let down = table_from_shape.rotation.inverse() * -Vector3::z();
        table_from_shape.translation.z - geometry.shape.reach_along(&down)
    };
    let heights = bodies.bodies.iter().flat_map(|body| body.geometries.iter().map(|part| height(body.link, part)));
    heights.fold(f64::INFINITY, f64::min)
}

/// Fingers that would close through the table are stopped by it; a hand that would start in it is refused, or draws back.
#[test]
fn fingers_are_stopped_by_the_table() {
    let model = open_hand(BARRETT);
    let tried = Tried::new(centred_block([0.02; 3]));
    let mut worker = tried.on_table(&model);
    let pose = tried.upright(&Vector3::z());
    let opened = model.hand().opened();
    let plain = conditions(0.2, pose);
    let over = |height: f64| from_above(pose, Point3::new(0.3, 0.0, height), &Vector3::y());
    let table_from_base =
        |base_from_object: &IsometryMatrix3<f64>| pose.world_from_object.isometry() * base_from_object.inverse();
    for height in [0.12, 0.13, 0.14] {
        let at = over(height);
        let mut run = |conditions: &TrialConditions| {
            let outcome = worker.run(&opened, &at, conditions).expect("a pose");
            assert_eq!((outcome.verdict, outcome.warnings), (Verdict::NotTouching, 0), "{outcome:?}");
            lowest(&model, &outcome.closed.expect("closed").joints, &table_from_base(&at))
        };
        let [stopped, free] = [run(&plain), run(&TrialConditions { table: None, ..plain })].map(|height| 1e3 * height);
        println!("base {height} m over the table: closed {stopped:.2} mm over it, {free:.2} mm without it");
        assert!(free < -5.0, "it would go through");
        assert!(stopped > -1.0, "{stopped} mm");
    }
    // So low that the opened fingers are in the table by 3 mm, and by more than a hand draws back.
    let reach = 0.2 - lowest(&model, &model.hand().posture_values(&opened), &table_from_base(&over(0.2)));
    for (depth, starts) in [(0.0005, true), (0.003, false), (0.02, false)] {
        let at = over(reach - depth);
        let outcome = worker.run(&opened, &at, &plain).expect("a pose");
        assert!((outcome.start.table_penetration - depth).abs() < 1e-6, "{:?}", outcome.start);
        assert_eq!(!matches!(outcome.verdict, Verdict::Refused { .. }), starts, "{:?}", outcome.verdict);
        let backing = TrialConditions { backs_off: true, ..plain };
        let outcome = worker.run(&opened, &at, &backing).expect("a pose");
        assert_eq!(matches!(outcome.verdict, Verdict::Refused { .. }), depth > 0.01, "{:?}", outcome.verdict);
        assert_eq!(outcome.start.drawn_back > 0.0, !starts, "{:?}", outcome.start);
    }
    // An error of the pose moves object and table together.
    let clear = over(reach + 0.001);
    for shift in [-0.004, 0.004] {
        let shifted = TrialConditions { shift: Vector3::new(0.0, 0.0, shift), ..plain };
        let start = worker.run(&opened, &clear, &shifted).expect("a pose").start;
        assert!((start.table_penetration - (-shift - 0.001).max(0.0)).abs() < 1e-6, "{start:?}");
        assert!((start.base_from_object.translation.z - clear.translation.z - shift).abs() < 1e-12);
    }
}

/// A simulation with a table tries floating objects exactly like one without a table, to the last bit; trials on the
/// table leave no trace; tables without a height, or beneath six gravities, are refused.
#[test]
fn a_table_changes_no_other_trial() {
    let model = open_hand(BARRETT);
    let tried = Tried::new(prepare_scan(&scan_file("025_mug")));
    let (mut with, mut without) = (tried.on_table(&model), tried.floating(&model));
    let pose = tried.upright(&Vector3::z());
    let on_table = conditions(0.118, pose);
    let opened = model.hand().opened();
    let at = |step: u32| {
        let (sine, cosine) = f64::from(step).sin_cos();
        from_above(pose, Point3::new(0.02 * cosine, 0.02 * sine, 0.21), &Vector3::new(cosine, sine, 0.0))
    };
    let mut first = Vec::new();
    for step in 0..6 {
        let gravity = if step == 5 { Gravity::Six } else { Gravity::Lifted };
        let floating = TrialConditions { table: None, gravity, ..on_table };
        first.push(with.run(&opened, &at(step), &on_table).expect("a pose"));
        println!("{}", told("mug from above", &first[first.len() - 1]));
        let one = with.run(&opened, &at(step), &floating).expect("a pose");
        let other = without.run(&opened, &at(step), &floating).expect("a pose");
        assert_eq!(one, other);
    }
    let mut other = tried.on_table(&model);
    for (step, outcome) in (0..6).zip(&first).rev() {
        assert_eq!(&other.run(&opened, &at(step), &on_table).expect("a pose"), outcome);
    }
    let error = without.run(&opened, &at(0), &on_table).expect_err("there is none");
    assert!(error.to_string().contains("TrialSim::on_table"), "{error}");
    let six = TrialConditions { gravity: Gravity::Six, ..on_table };
    assert!(with.run(&opened, &at(0), &six).is_err());
}
