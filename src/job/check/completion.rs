//! Settings of a completion job.

use std::path::PathBuf;

use nalgebra::{Matrix3, Rotation3};

use super::{
    Checker,
    touch::{HandReader, touch},
};
use crate::{
    geom::{Intrinsics, ViewSet, closed_linspace, open_linspace, rotation_from_quaternion, rotation_from_rpy},
    job::{
        checked::{
            Channels, Completion, DepthFormat, Distance, Gate, ImplicitSamples, ModelChoice, Renderer, SceneCamera,
            SplitSettings, SubsetSize, Truth,
        },
        document::Path,
        errors::Problem,
        spec::completion::{
            AngleUnit, AnglesSpec, CameraSpec, ChannelsSpec, CompletionSpec, DepthSpec, DistanceSpec, Ends, ModelsSpec,
            NamedViews, RendererSpec, SplitSpec, SubsetSpec, TruthRule, ViewsSpec,
        },
    },
    render::SensorModel,
};

/// Reads a camera out of an MJCF scene; the error says why it cannot, in words.
///
/// Only the `sim` room reads MJCF, so whoever reads a job passes it in.
pub type SceneReader<'a> = dyn Fn(&SceneCamera) -> Result<Intrinsics, String> + 'a;

/// The reader of a program without the simulator: refuses every scene.
///
/// # Errors
/// Always.
pub fn no_scenes(_: &SceneCamera) -> Result<Intrinsics, String> {
    Err("this build has no simulator to read a scene with (feature `sim`)".to_owned())
}

/// Most views of one object.
const MOST_VIEWS: usize = 1_000_000;

/// The product's settings; placeholders stand in for what was reported as wrong.
pub(in crate::job) fn completion(
    checker: &mut Checker<'_>,
    spec: &CompletionSpec,
    folder: &std::path::Path,
    scenes: &SceneReader<'_>,
    hands: &HandReader<'_>,
) -> Completion {
    let (camera, scene) = camera(checker, &spec.camera, folder, scenes);
    let distance = distance(checker, spec.distance, camera.near);
    let gate = Gate { min_partial_cells: spec.gate.min_partial_cells, min_overlap: spec.gate.min_overlap };
    let cells = u64::from(spec.grid.resolution).pow(3);
    if u64::from(gate.min_partial_cells) > cells {
        let found = format!("{} of the grid's {cells}", gate.min_partial_cells);
        checker.senseless("gate.min_partial_cells", "at most as many cells as the grid has", found);
    }
    Completion {
        views: views(checker, &spec.views),
        pivot: spec.pivot,
        camera,
        scene,
        distance,
        renderer: match spec.renderer {
            RendererSpec::Raster => Renderer::Raster,
            RendererSpec::MujocoRay => Renderer::MujocoRay,
            RendererSpec::MujocoGl => Renderer::MujocoGl,
        },
        sensor: sensor(checker, spec),
        resolution: spec.grid.resolution,
        drop_index_zero: spec.grid.drop_index_zero,
        solid_with_surface: spec.truth.solid_with_surface,
        truth: truth(checker, spec),
        gate,
        channels: channels(checker, &spec.channels, &distance),
        touch: touch(checker, &spec.touch, folder, hands),
    }
}

fn views(checker: &mut Checker<'_>, spec: &ViewsSpec) -> ViewSet {
    let in_radians = |angle: f64, unit: Option<AngleUnit>| match unit {
        Some(AngleUnit::Degree) => angle / 180.0 * std::f64::consts::PI,
        _ => angle,
    };
    match spec {
        ViewsSpec::Named(NamedViews::Standard) => ViewSet::standard(),
        ViewsSpec::Named(NamedViews::Thesis) => ViewSet::thesis(),
        ViewsSpec::Named(NamedViews::HeadOn) => ViewSet::head_on(),
        ViewsSpec::Even(even) => ViewSet::Even { count: even.even },
        ViewsSpec::Grid(grid) => {
            let angles = |spec: &AnglesSpec| match spec {
                AnglesSpec::List(angles) => angles.clone(),
                AnglesSpec::Range(range) => match range.ends {
                    Some(Ends::Open) => open_linspace(range.from, range.to, range.count),
                    _ => closed_linspace(range.from, range.to, range.count),
                },
            };
            let [roll, pitch, yaw] = [&grid.roll, &grid.pitch, &grid.yaw]
                .map(|spec| angles(spec).into_iter().map(|angle| in_radians(angle, grid.unit)).collect::<Vec<_>>());
            let count = roll.len().saturating_mul(pitch.len()).saturating_mul(yaw.len());
            if count > MOST_VIEWS {
                checker.senseless("views", format!("at most {MOST_VIEWS} views"), format!("{count}"));
            }
            ViewSet::RollPitchYaw { roll, pitch, yaw }
        }
        ViewsSpec::RollPitchYaw(list) => {
            let angles = list.rpy.iter().map(|rpy| rpy.map(|angle| in_radians(angle, list.unit)));
            ViewSet::List(angles.map(|[roll, pitch, yaw]| rotation_from_rpy(roll, pitch, yaw)).collect())
        }
        ViewsSpec::Quaternions(list) => {
            for (index, quaternion) in list.quaternions_wxyz.iter().enumerate() {
                let length = quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
                if !(length > 1e-6 && length < 1e6) {
                    let problem = Problem::Senseless {
                        expected: "a quaternion of a length near 1".to_owned(),
                        found: format!("length {length}"),
                    };
                    checker.fail(&Path::of("views.quaternions_wxyz").index(index), problem, None);
                }
            }
            ViewSet::List(
                list.quaternions_wxyz.iter().map(|quaternion| rotation_from_quaternion(*quaternion)).collect(),
            )
        }
        ViewsSpec::Matrices(list) => {
            ViewSet::List(list.matrices.iter().enumerate().map(|(index, rows)| matrix(checker, index, rows)).collect())
        }
    }
}

fn matrix(checker: &mut Checker<'_>, index: usize, rows: &[[f64; 3]; 3]) -> Rotation3<f64> {
    let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    let off = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    let determinant = matrix.determinant();
    if !(off <= 1e-9 && determinant > 0.0) {
        let problem = Problem::Senseless {
            expected: "a rotation matrix (orthonormal within 1e-9, determinant 1)".to_owned(),
            found: format!("off by {off:.1e}, determinant {determinant:.6}"),
        };
        let help = Some("give quaternions or more digits".to_owned());
        checker.fail(&Path::of("views.matrices").index(index), problem, help);
    }
    Rotation3::from_matrix_unchecked(matrix)
}

fn camera(
    checker: &mut Checker<'_>,
    spec: &CameraSpec,
    folder: &std::path::Path,
    scenes: &SceneReader<'_>,
) -> (Intrinsics, Option<SceneCamera>) {
    const NUMBERS: [&str; 6] = ["horizontal_fov", "fx", "fy", "cx", "cy", "near"];
    const DEFAULT_FOV: f64 = 1.047;
    let written = |key: &str| checker.document.has(&format!("camera.{key}"));
    let (focal, given): (Vec<&str>, Vec<&str>) = (
        ["fx", "fy"].into_iter().filter(|key| written(key)).collect(),
        NUMBERS.into_iter().filter(|key| written(key)).collect(),
    );
    if let Some(scene) = &spec.scene {
        for key in given {
            let because = "the scene says what its camera is";
            checker.contradiction(&format!("camera.{key}"), "camera.scene", because);
        }
        return scene_camera(checker, spec, folder.join(scene), scenes);
    }
    if spec.camera.is_some() {
        let problem = Problem::Missing { expected: "`scene`, the file that holds this camera".to_owned() };
        checker.fail(&Path::of("camera.scene"), problem, None);
    }
    if spec.horizontal_fov.is_some() {
        for key in &focal {
            let because = "both say how wide the camera sees";
            checker.contradiction(&format!("camera.{key}"), "camera.horizontal_fov", because);
        }
    } else if focal == ["fy"] {
        let problem = Problem::Missing { expected: "`fx` beside `fy`".to_owned() };
        checker.fail(&Path::of("camera.fx"), problem, None);
    }
    let square =
        Intrinsics::from_horizontal_fov(spec.width, spec.height, spec.horizontal_fov.unwrap_or(DEFAULT_FOV), spec.near);
    let camera = square.and_then(|camera| {
        let fx = spec.fx.unwrap_or(camera.fx);
        let fy = spec.fy.unwrap_or(if spec.fx.is_some() { fx } else { camera.fy });
        let (cx, cy) = (spec.cx.unwrap_or(camera.cx), spec.cy.unwrap_or(camera.cy));
        Intrinsics { fx, fy, cx, cy, ..camera }.checked()
    });
    match camera {
        Ok(camera) => (camera, None),
        Err(error) => {
            checker.senseless("camera", "a camera", error.to_string());
            (placeholder_camera(), None)
        }
    }
}

fn placeholder_camera() -> Intrinsics {
    Intrinsics { width: 1, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, near: f64::MIN_POSITIVE }
}

fn scene_camera(
    checker: &mut Checker<'_>,
    spec: &CameraSpec,
    scene: PathBuf,
    scenes: &SceneReader<'_>,
) -> (Intrinsics, Option<SceneCamera>) {
    let Some(camera) = spec.camera.clone() else {
        let problem = Problem::Missing { expected: "the name of a camera in the scene".to_owned() };
        checker.fail(&Path::of("camera.camera"), problem, None);
        return (placeholder_camera(), None);
    };
    let scene = SceneCamera { scene, camera, width: spec.width, height: spec.height };
    let read = scenes(&scene).and_then(|camera| camera.checked().map_err(|error| error.to_string()));
    let camera = read.unwrap_or_else(|message| {
        let detail = format!("`{}` in {}: {message}", scene.camera, scene.scene.display());
        checker.fail(&Path::of("camera.scene"), Problem::NotFound { what: "camera".to_owned(), detail }, None);
        placeholder_camera()
    });
    (camera, Some(scene))
}

fn distance(checker: &mut Checker<'_>, spec: DistanceSpec, near: f64) -> Distance {
    let beyond_near = |checker: &mut Checker<'_>, key: &str, distance: f64| {
        if distance <= near {
            let expected = format!("a distance beyond camera.near = {near} m");
            checker.senseless(key, expected, format!("{distance} m"));
        }
    };
    match spec {
        DistanceSpec::Fixed(distance) => {
            beyond_near(checker, "distance", distance);
            Distance::Fixed(distance)
        }
        DistanceSpec::Range(range) => {
            beyond_near(checker, "distance.min", range.min);
            if range.max < range.min {
                checker.senseless(
                    "distance.max",
                    format!("at least min = {} m", range.min),
                    format!("{} m", range.max),
                );
            }
            Distance::Range { min: range.min, max: range.max }
        }
        DistanceSpec::Fit(fit) => Distance::Fit { share: fit.fit },
    }
}

fn sensor(checker: &mut Checker<'_>, spec: &CompletionSpec) -> Option<SensorModel> {
    let name = spec.sensor.profile.as_str();
    if name == "none" {
        if let Some(key) = spec.sensor.constants.keys().next() {
            let because = "a perfect sensor has no constants";
            checker.contradiction(&format!("sensor.constants.{key}"), "sensor.profile = \"none\"", because);
        }
        return None;
    }
    // The schema lists the profiles.
    let mut model = SensorModel::profile(name)?;
    for (key, value) in &spec.sensor.constants {
        if let Err(error) = model.set(key, *value) {
            let expected = "a constant that fits the sensor".to_owned();
            let problem = Problem::Senseless { expected, found: error.to_string() };
            checker.fail(&Path::of("sensor.constants").key(key), problem, None);
        }
    }
    Some(model)
}

fn truth(checker: &mut Checker<'_>, spec: &CompletionSpec) -> Truth {
    let rule = spec.truth.rule;
    if spec.truth.fraction.is_some() && rule != TruthRule::Fraction {
        checker.contradiction("truth.fraction", "truth.rule", "only the rule \"fraction\" asks for a fraction");
    }
    match (rule, spec.truth.fraction) {
        (TruthRule::AnyOverlap, _) => Truth::AnyOverlap,
        (TruthRule::Centre, _) => Truth::Centre,
        (TruthRule::LowerCorners, _) => Truth::LowerCorners,
        (TruthRule::Fraction, Some(fraction)) => Truth::Fraction(fraction),
        (TruthRule::Fraction, None) => {
            let expected = "the least share of a cell that is solid, above 0 to 1".to_owned();
            checker.fail(&Path::of("truth.fraction"), Problem::Missing { expected }, None);
            Truth::Fraction(0.5)
        }
    }
}

fn channels(checker: &mut Checker<'_>, spec: &ChannelsSpec, distance: &Distance) -> Channels {
    let depth = match spec.depth {
        DepthSpec::None => None,
        DepthSpec::F32 => Some(DepthFormat::F32),
        DepthSpec::U16 => Some(DepthFormat::U16 { step: spec.depth_step }),
    };
    let farthest = match distance {
        Distance::Fixed(distance) => *distance,
        Distance::Range { max, .. } => *max,
        Distance::Fit { .. } => 0.0,
    };
    let reach = spec.depth_step * f64::from(u16::MAX);
    if spec.depth == DepthSpec::U16 && reach <= farthest {
        let expected =
            format!("a step of at least {:.2e} m, so that 65,535 steps reach {farthest} m", farthest / 65535.0);
        checker.senseless("channels.depth_step", expected, format!("{} m", spec.depth_step));
    }
    let implicit = ImplicitSamples { surface: spec.implicit_surface, space: spec.implicit_space };
    if spec.implicit && implicit.surface == 0 && implicit.space == 0 {
        checker.contradiction("channels.implicit", "channels.implicit_surface = 0", "no point is asked for");
    }
    Channels {
        visibility: spec.visibility,
        depth,
        cloud: spec.cloud,
        tsdf: spec.tsdf.then_some(spec.tsdf_truncation),
        coverage: spec.coverage,
        implicit: spec.implicit.then_some(implicit),
    }
}

/// The split; names are still patterns.
pub(in crate::job) fn split(checker: &mut Checker<'_>, spec: &SplitSpec) -> SplitSettings {
    let choice = |models: &ModelsSpec| match models {
        ModelsSpec::Count(count) => ModelChoice::Count(*count),
        ModelsSpec::Share(share) => ModelChoice::Share(*share),
        ModelsSpec::Named(names) => ModelChoice::Named(names.clone()),
    };
    let (validation, test) = (choice(&spec.validation_models), choice(&spec.test_models));
    if let (ModelChoice::Share(validation), ModelChoice::Share(test)) = (&validation, &test)
        && validation + test >= 1.0
    {
        let found = format!("{validation} + {test} = {}", validation + test);
        checker.senseless("split.test_models", "shares of validation and test models that leave some to train", found);
    }
    let subsets: Vec<SubsetSize> = spec
        .training_subsets
        .iter()
        .map(|size| match size {
            SubsetSpec::Count(count) => SubsetSize::Models(*count),
            SubsetSpec::Share(share) => SubsetSize::Share(*share),
        })
        .collect();
    let grows = |pair: &[SubsetSize]| match pair {
        [SubsetSize::Models(a), SubsetSize::Models(b)] => a < b,
        [SubsetSize::Share(a), SubsetSize::Share(b)] => a < b,
        _ => true,
    };
    if !subsets.windows(2).all(grows) {
        checker.senseless(
            "split.training_subsets",
            "sizes in growing order",
            "one that is no larger than the one before",
        );
    }
    SplitSettings {
        holdout_views: spec.holdout_views,
        validation_models: validation,
        test_models: test,
        by_group: spec.by_group,
        keep_twins_together: spec.keep_twins_together,
        keep_equal_views_together: spec.keep_equal_views_together,
        training_subsets: subsets,
    }
}
