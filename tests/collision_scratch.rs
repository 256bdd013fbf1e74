#![cfg(feature = "sim")]
use std::{collections::BTreeMap, path::Path, time::Instant};
use graspmill::{collision::{CollisionChecker, Verdict}, seed::Stream, sim::RobotModel};
use nalgebra::IsometryMatrix3;
const ARM: [&str; 7] = ["shoulder_pan_joint","shoulder_lift_joint","upperarm_roll_joint","elbow_flex_joint","forearm_roll_joint","wrist_flex_joint","wrist_roll_joint"];
#[test]
fn speed() {
    let robot = RobotModel::open(Path::new("scenes/fetch_meshes.xml")).unwrap();
    let fixed = BTreeMap::new();
    let group = robot.planning_group(&ARM, "wrist_roll_link", &fixed).unwrap();
    let bodies = robot.bodies(&ARM, &fixed).unwrap();
    println!("{} bodies {} pairs", bodies.bodies.len(), bodies.pairs.len());
    let t = Instant::now();
    let checker = CollisionChecker::new(&bodies);
    println!("built in {:?}", t.elapsed());
    let mut stream = Stream::of_job(1, b"x", "y");
    let n = 100_000;
    let qs: Vec<Vec<f64>> = (0..n).map(|_| group.joints().iter().map(|j| { let (l,h) = j.limits.map_or((-3.14159,3.14159), |l| (l.low,l.high)); l + (h-l)*stream.unit() }).collect()).collect();
    let mut links = vec![IsometryMatrix3::identity(); 8];
    let t = Instant::now();
    for q in &qs { group.link_frames(q, &mut links[1..]); std::hint::black_box(&links); }
    println!("frames {:?} each", t.elapsed() / n);
    let t = Instant::now();
    let (mut free, mut deep, mut surf) = (0, 0, 0);
    let mut first = 0;
    for q in &qs { group.link_frames(q, &mut links[1..]);
        match checker.check(&links, first) { Verdict::Free => free += 1, Verdict::Collides { pair, depth } => { first = pair; if depth > 0.0 { deep += 1 } else { surf += 1 } } } }
    println!("{:?} each; free {free} deep {deep} surface {surf}", t.elapsed() / n);
}
