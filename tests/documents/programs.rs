//! Blocks of Rust: each is copied here word for word, so that it compiles, and runs in a folder like a clone.

use std::{env, error::Error, sync::Once};

use super::{
    blocks::{blocks_in, file_block},
    running::shelf,
};
use crate::support::files::{read_text, repository_path};

/// This file, which must contain the blocks.
const HERE: &str = "tests/documents/programs.rs";

/// Makes a folder like a clone the working folder of this process. No other test of this binary depends on it: their paths are
/// absolute.
fn enter_shelf() {
    static ENTERED: Once = Once::new();
    ENTERED.call_once(|| {
        for file in ["two_fingers.xml", "two_fingers.toml"] {
            shelf().write(file, file_block("docs/hands.md", file));
        }
        env::set_current_dir(shelf().folder()).expect("a folder");
    });
}

/// README.md, "Reading the data".
#[test]
fn samples_are_read() -> Result<(), Box<dyn Error>> {
    enter_shelf();
    use graspmill::read::{DatasetReader, Folder, Selection, Split, VoxelPair};

    let reader = DatasetReader::open(&Folder::at("datasets/quickstart"))?;
    for sample in reader.shuffled(Selection::from_split(Split::Training), 1) {
        let pair = sample?.read::<VoxelPair>()?;
        println!("{} of {} cells were seen", pair.partial_cells, pair.complete_cells);
    }

    assert!(reader.indices(Selection::from_split(Split::Training)).count() > 0, "the loop has samples");
    Ok(())
}

/// docs/completing.md, "Completion".
#[test]
fn a_picture_becomes_meshes() -> Result<(), Box<dyn Error>> {
    enter_shelf();
    use graspmill::runtime::completion::{
        CameraDescription, Completer, CompletionModel, Detail, FrameRule, SceneRule, read_frame,
    };

    let camera = CameraDescription::read("scenes/table.json".as_ref())?;
    let rule = FrameRule { camera: Some(camera), ..FrameRule::default() };
    let frame = read_frame("scenes/table.png".as_ref(), &rule)?.frame;

    let model = CompletionModel::bundled();
    let completer = Completer::new(model, Detail::Joined);
    let scene = completer.segment(frame, &SceneRule::default());
    for cluster in &scene.clusters {
        let completed = completer.complete(&scene, cluster)?;
        println!("{} triangles, {:?}", completed.mesh.triangles.len(), completed.timings.total());
    }

    assert_eq!(scene.clusters.len(), 5, "the loop has objects");
    Ok(())
}

/// docs/hands.md, "From Rust".
#[test]
fn a_hand_closes_and_a_grasp_is_tried() -> Result<(), Box<dyn Error>> {
    enter_shelf();
    use std::{path::Path, sync::Arc};

    use graspmill::make::{
        collision::Geometry,
        geom::Shape,
        sim::{HandModel, HandSim, HandWorker},
    };
    use nalgebra::IsometryMatrix3;

    let model = HandModel::open(Path::new("two_fingers.xml"))?;
    let ball = [Geometry { shape: Shape::Sphere { radius: 0.02 }, link_from_shape: IsometryMatrix3::identity() }];
    let mut worker = HandWorker::new(&Arc::new(HandSim::new(&model, &ball)?));
    worker.start(&model.hand().opened(), &IsometryMatrix3::translation(0.0, 0.0, 0.1))?;
    let run = worker.close(2000);

    assert!(!run.touches.is_empty(), "the fingers meet the ball");
    use graspmill::make::{
        MeshSource, PreparedObject,
        sim::{TrialConditions, TrialSim, TrialWorker, mass_of_volume},
    };

    let object = PreparedObject::prepare(&MeshSource::of_file("bottle", Path::new("meshes/bottle.stl")))?;
    let mass = object.mass().expect("the bottle is solid");
    let sim = TrialSim::new(&model, object.contact_surface()?, mass)?;
    let mut worker = TrialWorker::new(&sim);
    let (posture, base_from_object) = (model.hand().opened(), IsometryMatrix3::translation(0.0, 0.0, 0.077));
    let conditions = TrialConditions::new(mass_of_volume(mass.volume));
    let outcome = worker.run(&posture, &base_from_object, &conditions)?;
    println!("{:?}", outcome.verdict);

    assert!(outcome.verdict.is_held(), "the fingers close round the bottle's foot");
    Ok(())
}

/// docs/reachability.md, "Query a map".
#[test]
fn a_map_answers() -> Result<(), Box<dyn Error>> {
    enter_shelf();
    use graspmill::runtime::{EndEffectorVolume, Folder, Obstacle, Pose, ReachabilityMap};

    let mut map = ReachabilityMap::open(&Folder::at("datasets/fetch-reachability"))?;
    let poses = [[0.6, 0.1, 0.9, 0.0, 0.5, 0.2], [0.7, -0.2, 0.8, 0.0, 0.5, 0.0]];
    let (distance, gradient) = map.distance_and_gradient(&poses[0]);
    let nearest = map.nearest_cell(&poses[0]).expect("the pose is finite");
    let best = map.rank(&poses)[0]; // the pose deepest inside comes first
    println!("{distance} {gradient:?} {:?} {}", nearest.label, best.index);

    let palm = Pose::from_xyz_rpy([-0.05, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let hand = EndEffectorVolume::default().with_box(&palm, [0.06, 0.065, 0.04], 0.05);
    let table = Pose::from_xyz_rpy([0.9, 0.0, 0.7, 0.0, 0.0, 0.0]);
    let table = map.add_obstacle(&Obstacle::cuboid(&table, [0.5, 0.8, 0.02])?, &hand);
    map.remove(table); // or map.undo()

    assert!(distance.is_finite() && map.obstacles().count() == 0);
    Ok(())
}

/// docs/motion.md, "Motions of an arm".
#[test]
fn an_arm_gets_to_a_grasp() -> Result<(), Box<dyn Error>> {
    enter_shelf();
    use std::{collections::BTreeMap, path::Path};

    use graspmill::{
        make::sim::RobotModel,
        runtime::{
            collision::{CollisionChecker, Geometry, Obstacle, Shape},
            geom::Pose,
            planner::motion::{
                ArmScene, GraspPose, GraspScenes, InverseArm, MotionSettings, MotionVerdict, PathKey, plan_grasp,
            },
        },
    };
    use nalgebra::{IsometryMatrix3, Vector3};

    let joints = [
        "shoulder_pan_joint",
        "shoulder_lift_joint",
        "upperarm_roll_joint",
        "elbow_flex_joint",
        "forearm_roll_joint",
        "wrist_flex_joint",
        "wrist_roll_joint",
    ];
    let (model, fixed) = (RobotModel::open(Path::new("scenes/fetch.xml"))?, BTreeMap::new());
    let group = model.planning_group(&joints, "wrist_roll_link", &fixed)?;
    // Prepared once; obstacles come and go in microseconds.
    let robot = ArmScene::new(&group, CollisionChecker::for_obstacles(&model.bodies(&joints, &fixed)?)?);

    let board = Geometry { shape: Shape::Box { half: [0.4, 0.6, 0.02] }, link_from_shape: IsometryMatrix3::identity() };
    let table = Obstacle::new(&[board])?.at(IsometryMatrix3::translation(0.85, 0.0, 0.6));
    let scene = robot.among(&[table], |_| true);

    let pose = GraspPose {
        grasp: Pose::from_xyz_rpy([0.6, 0.1, 0.9, 0.0, 0.5, 0.2]), // of wrist_roll_link, in the world [m, rad]
        approach: Vector3::x_axis(),                               // in its own frame
    };
    let scenes = GraspScenes { way: &scene, approach: &scene, lift: &scene };
    let start = [1.32, 1.4, -0.2, 1.72, 0.0, 1.66, 0.0];
    let report = plan_grasp(
        &InverseArm::new(&group, 1),
        &scenes,
        &start,
        &pose,
        &PathKey::new(1, b"table"),
        &MotionSettings::default(),
    );
    if let MotionVerdict::Valid(motion) = &report.verdict {
        println!("{} configurations to the pregrasp", motion.path.waypoints.len());
    }
    println!("{:?} after {} checks", report.level, report.work.checks);

    assert_ne!(report.verdict, MotionVerdict::NoIk, "the pose is in reach");
    Ok(())
}

#[test]
fn every_block_of_rust_stands_here() {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let here = words(&read_text(repository_path(HERE)));
    let blocks = blocks_in("rust");
    for block in &blocks {
        assert!(here.contains(&words(&block.text)), "{}: copy this block into a test of {HERE}", block.place());
    }
    println!("{} blocks of Rust", blocks.len());
    assert!(blocks.len() >= 4, "{} blocks of Rust", blocks.len());
}
