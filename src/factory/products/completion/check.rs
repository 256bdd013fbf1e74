//! From the keys of a completion job to settings that make sense: every mistake that the schema cannot see.

use std::path::{Path as FilePath, PathBuf};

use nalgebra::{Matrix3, Rotation3};

use super::{
    check_occlusion::occlusion,
    settings::{CompletionSettings, Distance, Gate, SceneCamera},
    spec::{AngleUnit, AnglesSpec, CameraSpec, CompletionSpec, DistanceSpec, Ends, NamedViews, RotationsSpec},
};
use crate::{
    products::pair::{Channels, touch::Touch},
    sections::{check_sensor, named_camera},
};
use form::{Checker, Path};
use format::Product;
use kernel::{
    geom::{
        Intrinsics, InvalidIntrinsics, ViewSet, closed_linspace, open_linspace, rotation_from_quaternion,
        rotation_from_rpy,
    },
    words::Show,
};
use sim::scene_camera as camera_of_scene;

/// Most views of one object.
const MAX_VIEWS: usize = 1_000_000;

/// The product's settings, with placeholders for values that were reported as wrong.
pub(super) fn settings(checker: &mut Checker, spec: &CompletionSpec, folder: &FilePath) -> CompletionSettings {
    let (camera, scene) = camera(checker, &spec.camera, folder);
    let largest = spec.objects.iter().map(|entry| entry.size_rule().max).fold(0.0, f64::max);
    let distance = distance(checker, spec.distance, &camera, largest);
    let gate = Gate { min_partial_cells: spec.gate.min_partial_cells, min_overlap: spec.gate.min_overlap };
    let settings = CompletionSettings {
        views: views(checker, &spec.views),
        views_per_object: matches!(&spec.views, RotationsSpec::Even(even) if even.per_object),
        pivot: spec.pivot,
        camera,
        scene,
        distance,
        renderer: spec.renderer,
        sensor: check_sensor(checker, &spec.sensor),
        occlusion: spec.occlusion.as_ref().map(|spec| occlusion(checker, spec)),
        resolution: spec.grid.resolution,
        drop_index_zero: spec.grid.drop_index_zero,
        solid_with_surface: spec.truth.solid_with_surface,
        truth: spec.truth.check(checker),
        gate,
        channels: Channels::read(checker, &spec.channels, Product::COMPLETION, distance.farthest()),
        touch: Touch::read(checker, &spec.touch, folder),
    };
    settings.rules().check(checker);
    settings
}

fn views(checker: &mut Checker, spec: &RotationsSpec) -> ViewSet {
    let in_radians = |angle: f64, unit: Option<AngleUnit>| match unit {
        Some(AngleUnit::Degree) => angle / 180.0 * std::f64::consts::PI,
        _ => angle,
    };
    match spec {
        RotationsSpec::Named(NamedViews::Standard) => ViewSet::standard(),
        RotationsSpec::Named(NamedViews::Thesis) => ViewSet::thesis(),
        RotationsSpec::Named(NamedViews::HeadOn) => ViewSet::head_on(),
        RotationsSpec::Even(even) => ViewSet::Even { count: even.even },
        RotationsSpec::Grid(grid) => {
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
            if count > MAX_VIEWS {
                checker.invalid("views", format!("at most {MAX_VIEWS} views"), format!("{count}"));
            }
            ViewSet::RollPitchYaw { roll, pitch, yaw }
        }
        RotationsSpec::RollPitchYaw(list) => {
            let angles = list.rpy.iter().map(|rpy| rpy.map(|angle| in_radians(angle, list.unit)));
            ViewSet::List(angles.map(|[roll, pitch, yaw]| rotation_from_rpy(roll, pitch, yaw)).collect())
        }
        RotationsSpec::Quaternions(list) => {
            for (index, quaternion) in list.quaternions_wxyz.iter().enumerate() {
                let length = quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
                if !(length > 1e-6 && length < 1e6) {
                    let path = Path::from("views.quaternions_wxyz").index(index);
                    checker.invalid(path, "a quaternion of a length near 1", format!("length {length}"));
                }
            }
            ViewSet::List(
                list.quaternions_wxyz.iter().map(|quaternion| rotation_from_quaternion(*quaternion)).collect(),
            )
        }
        RotationsSpec::Matrices(list) => {
            ViewSet::List(list.matrices.iter().enumerate().map(|(index, rows)| matrix(checker, index, rows)).collect())
        }
    }
}

fn matrix(checker: &mut Checker, index: usize, rows: &[[f64; 3]; 3]) -> Rotation3<f64> {
    let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    let off = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    let determinant = matrix.determinant();
    if !(off <= 1e-9 && determinant > 0.0) {
        let expected = "a rotation matrix (orthonormal within 1e-9, determinant 1)";
        let found = format!("off by {off:.1e}, determinant {determinant:.6}");
        let report = checker.invalid(Path::from("views.matrices").index(index), expected, found);
        report.help("give quaternions or more digits");
    }
    Rotation3::from_matrix_unchecked(matrix)
}

fn camera(checker: &mut Checker, spec: &CameraSpec, folder: &FilePath) -> (Intrinsics, Option<SceneCamera>) {
    const NUMBERS: [&str; 6] = ["horizontal_fov", "fx", "fy", "cx", "cy", "near"];
    const DEFAULT_FOV: f64 = 1.047;
    let written = |key: &str| checker.has(&format!("camera.{key}"));
    // The schema lists the names.
    if let Some(camera) = spec.preset.as_deref().and_then(named_camera) {
        let others = ["width", "height", "scene", "camera"].into_iter().chain(NUMBERS);
        let others: Vec<&str> = others.filter(|key| *key != "near" && written(key)).collect();
        for key in others {
            let because = "the preset defines its camera";
            checker.contradiction(&format!("camera.{key}"), "camera.preset", because);
        }
        return (camera.intrinsics(spec.near), None);
    }
    let (focal, given): (Vec<&str>, Vec<&str>) = (
        ["fx", "fy"].into_iter().filter(|key| written(key)).collect(),
        NUMBERS.into_iter().filter(|key| written(key)).collect(),
    );
    if let Some(scene) = &spec.scene {
        for key in given {
            let because = "the scene defines its camera";
            checker.contradiction(&format!("camera.{key}"), "camera.scene", because);
        }
        return scene_camera(checker, spec, folder.join(scene));
    }
    if spec.camera.is_some() {
        checker.missing("camera.scene", "`scene`, the file that holds this camera");
    }
    if spec.horizontal_fov.is_some() {
        for key in &focal {
            let because = "both set the camera's field of view";
            checker.contradiction(&format!("camera.{key}"), "camera.horizontal_fov", because);
        }
    } else if focal == ["fy"] {
        checker.missing("camera.fx", "`fx` beside `fy`");
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
            let key = match &error {
                InvalidIntrinsics::OutOfRange { name: "fx" | "fy", .. } if focal.is_empty() => "horizontal_fov",
                InvalidIntrinsics::OutOfRange { name: "fy", .. } if focal == ["fx"] => "fx",
                InvalidIntrinsics::OutOfRange { name, .. } => name,
                InvalidIntrinsics::Near(_) => "near",
                InvalidIntrinsics::FieldOfView(_) => "horizontal_fov",
                InvalidIntrinsics::Size { .. } => "width",
            };
            checker.invalid(format!("camera.{key}").as_str(), "a camera", error.to_string());
            (placeholder_camera(), None)
        }
    }
}

fn placeholder_camera() -> Intrinsics {
    Intrinsics { width: 1, height: 1, fx: 1.0, fy: 1.0, cx: 0.5, cy: 0.5, near: f64::MIN_POSITIVE }
}

fn scene_camera(checker: &mut Checker, spec: &CameraSpec, scene: PathBuf) -> (Intrinsics, Option<SceneCamera>) {
    let Some(camera) = spec.camera.clone() else {
        checker.missing("camera.camera", "the name of a camera in the scene");
        return (placeholder_camera(), None);
    };
    let scene = SceneCamera { scene, camera, width: spec.width, height: spec.height };
    let read = camera_of_scene(&scene.scene, &scene.camera).map_err(|error| error.to_string());
    let read = read.and_then(|(camera, _)| camera.checked().map_err(|error| error.to_string()));
    let camera = read.unwrap_or_else(|message| {
        let detail = format!("`{}` in {}: {message}", scene.camera, scene.scene.shown());
        checker.not_found("camera.scene", "camera", detail);
        placeholder_camera()
    });
    (camera, Some(scene))
}

/// Distance from the camera to the pivot. `largest`: longest side of an object that the job allows [m].
fn distance(checker: &mut Checker, spec: DistanceSpec, camera: &Intrinsics, largest: f64) -> Distance {
    let near = camera.near;
    let beyond_near = |checker: &mut Checker, key: &str, distance: f64| {
        if distance <= near {
            let expected = format!("a distance beyond camera.near = {near} m");
            checker.invalid(key, expected, format!("{distance} m"));
        }
    };
    // Farther away, hardly a view would see the object at all.
    let farthest = largest * camera.fx.max(camera.fy);
    let within_sight = |checker: &mut Checker, key: &str, distance: f64| {
        if distance > farthest && !checker.is_wrong("camera") {
            let expected = format!(
                "at most {farthest:.0} m, where an object of {largest} m, the largest that `objects.limits` allow, is \
                 one pixel wide"
            );
            checker.invalid(key, expected, format!("{distance:e} m"));
        }
    };
    match spec {
        DistanceSpec::Fixed(distance) => {
            beyond_near(checker, "distance", distance);
            within_sight(checker, "distance", distance);
            Distance::Fixed(distance)
        }
        DistanceSpec::Range(range) => {
            beyond_near(checker, "distance.min", range.min);
            within_sight(checker, "distance.max", range.max);
            if range.max < range.min {
                checker.invalid("distance.max", format!("at least min = {} m", range.min), format!("{} m", range.max));
            }
            Distance::Range { min: range.min, max: range.max }
        }
        DistanceSpec::Fit(fit) => Distance::Fit { share: fit.fit },
    }
}
