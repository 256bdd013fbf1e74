//! The simulator room against numbers that it did not compute: the job's camera, MuJoCo's forward kinematics.

use std::{path::Path, sync::Arc};

use graspmill::{
    geom::{CameraCv, Intrinsics, Object, Pose, TriMesh, ViewSet, World, rotation_from_rpy},
    sim::{Inertia, SceneError, SimError, SimModel, SimWorker, gl_facts, scene_camera, sim_facts},
};
use nalgebra::{Point3, Rotation3, Vector3};

use crate::robot::write_scene;
use crate::support::{meshes::centred_block, pairs::default_camera};

#[test]
fn the_scene_holds_the_camera_of_the_default_job() {
    let (camera, world_from_camera) = scene_camera(Path::new("scenes/single_view.xml"), "depth").expect("the scene");
    let job = default_camera();
    assert_eq!((camera.width, camera.height), (job.width, job.height));
    for (name, scene, job) in [
        ("fx", camera.fx, job.fx),
        ("fy", camera.fy, job.fy),
        ("cx", camera.cx, job.cx),
        ("cy", camera.cy, job.cy),
        ("near", camera.near, job.near),
    ] {
        assert!((scene / job - 1.0).abs() < 1e-14, "{name}: scene {scene}, job {job}");
    }
    // The camera looks along +x and its picture's up is z.
    let world_from_cv = world_from_camera * Pose::cv_from_gl().inverse();
    let ahead = world_from_cv.point(&Point3::new(0.0, 0.0, 1.0));
    let down = world_from_cv.point(&Point3::new(0.0, 1.0, 0.0));
    assert!((ahead - Point3::new(1.0, 0.0, 0.0)).norm() < 1e-15, "{ahead}");
    assert!((down - Point3::new(0.0, 0.0, -1.0)).norm() < 1e-15, "{down}");
}

#[test]
fn a_camera_given_in_pixels_is_read_as_written() {
    let file = write_scene(
        r#"<mujoco><statistic extent="1"/><visual><map znear="0.25"/></visual><worldbody>
           <camera name="c" pos="1 2 3" resolution="320 200" sensorsize="0.0032 0.002" focalpixel="310.5 309.25"
                   principalpixel="3.5 -2.25"/></worldbody></mujoco>"#,
    );
    let (camera, world_from_camera) = scene_camera(file.path(), "c").expect("the scene");
    assert_eq!((camera.fx, camera.fy, camera.near), (310.5, 309.25, 0.25));
    assert_eq!(*world_from_camera.translation(), Vector3::new(1.0, 2.0, 3.0));
    assert_eq!((camera.cx, camera.cy), (156.5, 102.25));
}

#[test]
fn scenes_that_cannot_be_used_say_why() {
    let scene = Path::new("scenes/single_view.xml");
    let error = scene_camera(scene, "left").expect_err("no such camera");
    assert!(matches!(&error, SceneError::NoCamera { present, .. } if present == &["depth"]), "{error}");
    let error = scene_camera(Path::new("scenes/none.xml"), "depth").expect_err("no such file");
    assert!(matches!(error, SceneError::Unreadable(_)) && error.to_string().contains("none.xml"), "{error}");
    let broken = write_scene("<mujoco><worldbody><camera name='c' fovy='ten'/></worldbody></mujoco>");
    let error = scene_camera(broken.path(), "c").expect_err("broken").to_string();
    assert!(error.contains("fovy") || error.contains("line"), "{error}");
    let blind = write_scene("<mujoco><worldbody><camera name='c' fovy='45'/></worldbody></mujoco>");
    let error = scene_camera(blind.path(), "c").expect_err("no resolution");
    assert!(matches!(error, SceneError::NoResolution { .. }), "{error}");
}

/// Every view of both profiles: our composition of poses against MuJoCo's forward kinematics.
#[test]
fn poses_equal_mujocos_forward_kinematics() {
    let linspace = |from: f64, to: f64, count: usize| -> Vec<f64> {
        (0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect()
    };
    let pi = std::f64::consts::PI;
    let thesis = ViewSet::RollPitchYaw {
        roll: linspace(-pi, pi, 11),
        pitch: linspace(-pi / 2.0, pi / 2.0, 6),
        yaw: linspace(-pi, pi, 11),
    };
    let model = Arc::new(SimModel::new(&centred_block([0.1, 0.2, 0.3]), Inertia::Exact).expect("a box"));
    let mut worker = SimWorker::new(&model);
    let (_, world_from_camera) = scene_camera(Path::new("scenes/single_view.xml"), "depth").expect("the scene");
    let camera_from_world: Pose<CameraCv, World> = Pose::cv_from_gl() * world_from_camera.inverse();
    let pivot = Vector3::new(0.01, -0.02, 0.03);
    let mut worst = 0.0_f64;
    for view in 0..thesis.len() {
        let rotation = thesis.rotation(view);
        let world_from_object: Pose<World, Object> =
            Pose::new(rotation, Vector3::new(1.0, 0.0, 0.0) - rotation * pivot);
        let found = worker.object_in_world(&(camera_from_world * world_from_object)).expect("finite");
        for (ours, theirs) in world_from_object.to_rows().into_iter().zip(found.to_rows()) {
            worst = worst.max((ours - theirs).abs());
        }
    }
    println!("{} views: poses differ from MuJoCo's by at most {worst:.1e}", thesis.len());
    assert!(worst <= 1e-12);
}

#[test]
fn refusals_name_what_is_wrong() {
    let good = centred_block([0.1, 0.1, 0.1]);
    let refused = |mesh: &TriMesh| SimModel::new(mesh, Inertia::Shell).expect_err("refused");
    assert_eq!(refused(&TriMesh::default()), SimError::TooSmall { vertices: 0, triangles: 0 });
    let mut bad = good.clone();
    bad.vertices[3][1] = f32::NAN;
    assert_eq!(refused(&bad), SimError::NotFinite { vertex: 3 });
    let mut bad = good.clone();
    bad.triangles[2][0] = 8;
    assert_eq!(refused(&bad), SimError::NoSuchVertex { triangle: 2, vertex: 8, vertices: 8 });
    let mut inside_out = good.clone();
    inside_out.triangles.iter_mut().for_each(|corners| corners.swap(0, 1));
    let error = SimModel::new(&inside_out, Inertia::Exact).expect_err("inside out");
    assert!(
        matches!(&error, SimError::Refused(words) if words.contains("volume") || words.contains("orient")),
        "{error}"
    );
    assert!(SimModel::new(&inside_out, Inertia::Shell).is_ok());
    let model = Arc::new(SimModel::new(&good, Inertia::Shell).expect("a box"));
    let nowhere = Pose::new(Rotation3::identity(), Vector3::new(f64::NAN, 0.0, 1.0));
    let error = SimWorker::new(&model).ray_depth(&default_camera(), &nowhere).expect_err("not finite");
    assert!(matches!(error, SimError::Pose(_)));
}

/// A box turned by nothing, at 1 m: the front face is a plane of known depth and outline.
#[test]
fn rays_and_renderer_see_the_front_of_a_box() {
    let camera = Intrinsics { width: 320, height: 200, fx: 300.0, fy: 280.0, cx: 150.25, cy: 110.5, near: 0.1 };
    let model = Arc::new(SimModel::new(&centred_block([0.1, 0.15, 0.05]), Inertia::Shell).expect("a box"));
    let mut worker = SimWorker::new(&model);
    let ahead = Pose::new(Rotation3::identity(), Vector3::new(0.02, -0.01, 1.0));
    for method in ["rays", "renderer"] {
        let depth = match method {
            "rays" => worker.ray_depth(&camera, &ahead),
            _ => worker.gl_depth(&camera, &ahead),
        }
        .expect("depth")
        .clone();
        let mut seen = 0;
        for row in 0..camera.height {
            for column in 0..camera.width {
                let point = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 0.95);
                let inside = (point.x - 0.02).abs() < 0.1 && (point.y + 0.01).abs() < 0.15;
                let value = depth.at(column, row);
                if inside {
                    seen += 1;
                    assert!((value - 0.95).abs() < 2e-7, "{method} ({column}, {row}): {value}");
                } else {
                    assert!(value.is_nan(), "{method} ({column}, {row}): {value}");
                }
            }
        }
        assert_eq!(depth.returns(), seen);
        assert!(seen > 5000, "{seen}");
    }
    println!("drawn by {}", worker.gl_renderer().expect("used"));
}

#[test]
fn nothing_nearer_than_the_near_plane_is_seen() {
    let camera = Intrinsics { near: 0.5, ..default_camera() };
    let model = Arc::new(SimModel::new(&centred_block([0.2, 0.2, 0.2]), Inertia::Shell).expect("a box"));
    let mut worker = SimWorker::new(&model);
    // The front face lies at 0.4 m, the back face at 0.8 m.
    let near = Pose::new(Rotation3::identity(), Vector3::new(0.0, 0.0, 0.6));
    let (column, row) = (320, 240);
    let by_rays = worker.ray_depth(&camera, &near).expect("rays").at(column, row);
    let by_renderer = worker.gl_depth(&camera, &near).expect("renderer").at(column, row);
    assert!((by_rays - 0.8).abs() < 1e-6, "{by_rays}");
    assert!((by_renderer - 0.8).abs() < 1e-6, "{by_renderer}");
    // Behind the camera: nothing, and no crash.
    let behind = Pose::new(rotation_from_rpy(0.1, 0.2, 0.3), Vector3::new(0.0, 0.0, -2.0));
    assert_eq!(worker.ray_depth(&camera, &behind).expect("rays").returns(), 0);
    assert_eq!(worker.gl_depth(&camera, &behind).expect("renderer").returns(), 0);
}

#[test]
fn workers_move_on_and_threads_share_a_model() {
    let camera = default_camera();
    let ahead = Pose::new(rotation_from_rpy(0.4, 0.5, 0.6), Vector3::new(0.0, 0.0, 1.0));
    let models: Vec<_> = [0.1, 0.05]
        .map(|half| Arc::new(SimModel::new(&centred_block([half, half, half]), Inertia::Shell).expect("a box")))
        .into();
    let render = |worker: &mut SimWorker| {
        let rays = worker.ray_depth(&camera, &ahead).expect("rays").clone();
        let drawn = worker.gl_depth(&camera, &ahead).expect("renderer").clone();
        (format!("{rays:?}"), format!("{drawn:?}"))
    };
    let alone: Vec<_> = models.iter().map(|model| render(&mut SimWorker::new(model))).collect();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let mut worker = SimWorker::new(&models[0]);
                let mut second = SimWorker::new(&models[1]);
                assert_eq!(render(&mut worker), alone[0]);
                assert_eq!(render(&mut second), alone[1]);
                worker.use_model(&models[1]);
                assert_eq!(render(&mut worker), alone[1]);
                worker.use_model(&models[0]);
                assert_eq!(render(&mut worker), alone[0]);
            });
        }
    });
}

#[test]
fn the_machine_is_described() {
    let facts = sim_facts();
    let gl = gl_facts();
    println!("{facts:#?} {gl:#?}");
    assert_eq!(facts.version, "3.17.0");
    assert!(facts.pinned, "libmujoco is not the pinned one: run make setup");
    let gl = gl.unwrap_or_else(|error| panic!("{error}"));
    assert!(gl.largest >= 4096 && !gl.renderer.is_empty());
}
