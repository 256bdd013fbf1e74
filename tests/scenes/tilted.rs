//! A tilted bin: its content and all derived datasets, compared with programs that build the bin from their own boxes.

use graspmill::format::{Scene, SceneContainer};

use crate::scenes::{
    amodal::{SHELL, amodal_job, check_by_trimesh, views_job},
    assert_refused, picks, scenes,
    views::check_by_embree,
};
use crate::support::{
    files::{FULL_CHECK, assert_intact},
    jobs::NO_SPLIT,
    program::{Program, print_root},
    workspace::Workspace,
};

const TILT: f64 = 25.0;

fn bins(container: &str) -> String {
    format!(
        "product = \"scenes\"\nseed = 4\nmode = \"bin\"\ncount = 3\nscenes = {{ training = 4 }}\n\
         container = {{ inner_size = [0.3, 0.3, 0.2], wall = 0.02{container} }}\n[[objects]]\n\
         built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\"]\n{NO_SPLIT}"
    )
}

#[test]
#[ignore = "slow: make test-all"]
fn bodies_lie_at_the_lower_wall_and_everybody_sees_the_same_bin() {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("scenes", &bins(&format!(", tilt_deg = {TILT}")), &[]);
    let one = workspace.path("one");
    Program::run_job(data.join("job.toml"), &one).option("--threads", "1").succeed();
    assert_eq!(print_root(&data), print_root(&one));
    assert_intact(&data, FULL_CHECK);
    let kept: Vec<Scene> = scenes(&data).into_iter().flatten().collect();
    assert!(kept.len() >= 3, "{} kept", kept.len());
    let container = SceneContainer::Bin { inner: [0.3, 0.3, 0.2], wall: 0.02, tilt_deg: TILT };
    // Along the floor, up the tilt.
    let container_from_world = container.world_from_container().inverse();
    let along = |scene: &Scene| {
        let middles = scene.bodies.iter().map(|body| container_from_world * body.world_from_object.translation());
        middles.map(|middle| middle.y).sum::<f64>() / scene.bodies.len() as f64
    };
    for scene in &kept {
        assert_eq!((&scene.container, scene.bodies.len()), (&container, 3));
        assert!(scene.bodies.iter().all(|body| body.drift < 2e-3));
    }
    let mean = kept.iter().map(along).sum::<f64>() / kept.len() as f64;
    assert!(mean < -0.02, "the bodies lie at {mean} m along the floor");

    // By seed 3 one camera looks along a wall, at which a rounding of 2e-8 m is 2e-5 m of depth.
    let views = workspace.make_dataset("views", &views_job("scenes", SHELL, ""), &["views.depth_step=0", "seed=6"]);
    println!("{}", check_by_embree(&views, 4));

    let pairs = workspace.make_dataset("pairs", &amodal_job("views", "channels = { cloud = true }"), &[]);
    println!("{}", check_by_trimesh(&pairs, &views, "8"));

    workspace.make_dataset("grasps", &picks::grasps_job(&picks::GRASPED, ""), &[]);
    let picked = workspace.make_dataset("picks", &picks::picks_job("trials = 1"), &[]);
    assert_intact(&picked, FULL_CHECK);
    Program::on("verify", &picked).option("--regenerate", "6").succeed();
}

/// The walls of a deep bin hang over all of its floor: bodies come through its mouth.
#[test]
fn bodies_are_dropped_into_the_mouth_of_a_deep_bin() {
    let workspace = Workspace::new();
    let deep = ["count=1", "container={ inner_size = [0.2, 0.2, 0.3], tilt_deg = 40 }"];
    let found = scenes(&workspace.make_dataset("deep", &bins(""), &deep));
    let kept: Vec<&Scene> = found.iter().flatten().collect();
    assert!(kept.len() >= 3, "{found:?}");
    let room = kept[0].container.room().expect("a bin has room inside");
    for scene in kept {
        let middle = scene.bodies[0].world_from_object.translation();
        assert!((room.min.z..room.max.z).contains(&middle.z) && middle.y < 0.0, "{middle}");
    }
}

#[test]
fn a_bin_without_a_tilt_is_the_bin_of_before_and_a_wall_is_no_floor() {
    let workspace = Workspace::new();
    let upright = workspace.make_dataset("upright", &bins(""), &["scenes.training=2"]);
    let zero = workspace.make_dataset("zero", &bins(", tilt_deg = 0"), &["scenes.training=2"]);
    assert_eq!(print_root(&upright), print_root(&zero));
    let steep = "mode = \"bin\"\nscenes = { training = 2 }\ncontainer = { tilt_deg = 60 }";
    assert_refused(&workspace, steep, "container.tilt_deg");
}
