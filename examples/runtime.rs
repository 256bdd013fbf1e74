//! Queries a reachability map, and completes the objects of a depth image to closed meshes: what a robot links. No simulator
//! takes part in either.
//!
//! From the root of the repository:
//!
//! ```text
//! cargo run --release --example runtime                       # makes a small map first
//! cargo run --release --example runtime -- datasets/fetch-reachability
//! ```

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

mod support;

use std::{env, error::Error, path::Path};

use graspmill::{
    read::Folder,
    runtime::{
        Baseline, EndEffectorVolume, Obstacle, Pose, ReachabilityMap,
        completion::{CameraDescription, Completer, Detail, FrameRule, SceneRule, read_frame},
    },
};

/// Positions 0.3 m apart before a Fetch, each with 32 orientations.
const JOB: &str = r#"
product = "reachability"

[robot]
model = "scenes/fetch.xml"
joints = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "upperarm_roll_joint",
    "elbow_flex_joint",
    "forearm_roll_joint",
    "wrist_flex_joint",
    "wrist_roll_joint",
]
target = "wrist_roll_link"
fixed = { torso_lift_joint = 0.0 }

[poses]
x = { from = 0.3, to = 1.2, step = 0.3 }
y = { from = -0.3, to = 0.6, step = 0.3 }
z = { from = 0.6, to = 1.2, step = 0.3 }
roll = 2
pitch = 4
yaw = 4
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = match env::args_os().nth(1) {
        Some(folder) => Folder::at(folder),
        None => {
            let folder = support::fresh_folder("runtime")?;
            support::make_dataset(JOB, &folder)?;
            folder
        }
    };
    query_map(&folder)?;

    complete_image(Path::new("scenes/table.png"), Path::new("scenes/table.json"))
}

/// Ranks poses of the end effector, then puts an obstacle into the map and takes it out.
fn query_map(folder: &Folder) -> Result<(), Box<dyn Error>> {
    let mut map = ReachabilityMap::open(folder)?;

    // Poses are x, y, z [m], roll, pitch, yaw [rad]. Distances are negative inside the reachable set.
    let poses = [[0.6, 0.0, 0.9, 0.0, 0.0, 0.0], [0.9, 0.3, 0.6, 0.0, 0.0, 0.0], [0.3, -0.3, 0.6, 0.0, 0.0, 0.0]];
    for ranked in map.rank(&poses) {
        let pose = &poses[ranked.index];
        let (distance, gradient) = map.distance_and_gradient(pose);
        let label = map.nearest_cell(pose).ok_or("the pose is finite")?.label.name();
        println!("pose {}: distance {distance:.3}, slope along x {:.3}, {label}", ranked.index, gradient[0]);
    }

    // A table top of 1 m x 1.6 m x 4 cm, and a palm of 12 cm x 13 cm x 8 cm.
    let palm = Pose::from_xyz_rpy([-0.05, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let hand = EndEffectorVolume::default().with_box(&palm, [0.06, 0.065, 0.04], 0.05);
    let table = Obstacle::cuboid(&Pose::from_xyz_rpy([0.9, 0.0, 0.6, 0.0, 0.0, 0.0]), [0.5, 0.8, 0.02])?;
    let before = map.distance(&poses[1]);
    let id = map.add_obstacle(&table, &hand);
    println!("pose 1 with a table: distance {:.3}, before {before:.3}", map.distance(&poses[1]));
    map.remove(id);
    Ok(())
}

/// Finds the objects on the table of a depth image, and completes each by the convex hull of what was seen. A trained network
/// takes the baseline's part by `Completer::new(CompletionModel::open(folder)?, Detail::Joined)`.
fn complete_image(image: &Path, camera: &Path) -> Result<(), Box<dyn Error>> {
    let rule = FrameRule { camera: Some(CameraDescription::read(camera)?), ..FrameRule::default() };
    let frame = read_frame(image, &rule)?.frame;
    let completer = Completer::by_baseline(Baseline::Hull, Detail::Fast);
    let scene = completer.segment(frame, &SceneRule::default());
    println!("{} objects on the table", scene.clusters.len());
    for cluster in &scene.clusters {
        // An object that the border cuts, or of which too little was seen, is an error of its own.
        match completer.complete(&scene, cluster) {
            Ok(completed) => {
                let litres = 1000.0 * completed.mesh.signed_volume();
                println!("{} triangles, {litres:.3} l", completed.mesh.triangles.len());
            }
            Err(error) => println!("not completed: {error}"),
        }
    }
    Ok(())
}
