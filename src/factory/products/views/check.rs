//! From the keys of a job for views to settings that make sense: every mistake that the schema cannot see.

use std::path::Path as FilePath;

use super::{
    settings::{Aim, ViewCamera, ViewPlacement, ViewSettings},
    spec::{AimSpec, ShellSpec, ViewCameraSpec, ViewsSpec},
};
use crate::{
    products::{
        listed_pose::check_pose,
        settled::{FoundScenes, SCENES, found_scenes},
    },
    sections::{check_sensor, named_camera},
};
use form::{Checker, Path};
use format::SceneImage;
use kernel::{
    files::{self, Bound},
    geom::{Intrinsics, InvalidIntrinsics},
    words::Show,
};

/// Default of the smallest visible distance [m].
const NEAR: f64 = 0.01;

/// First line of a file of poses.
const HEADING: &str = "x,y,z,qw,qx,qy,qz";

/// Settings of the images; mistakes are reported.
pub(super) fn settings(checker: &mut Checker, spec: &ViewsSpec, folder: &FilePath) -> ViewSettings {
    let cameras = (0..).zip(&spec.views.cameras).filter_map(|(index, entry)| camera(checker, index, entry, folder));
    ViewSettings {
        cameras: cameras.collect(),
        clearance: spec.views.clearance,
        min_pixels: spec.views.min_pixels,
        table: spec.views.table,
        depth_step: spec.views.depth_step,
        sensor: check_sensor(checker, &spec.sensor),
        colour: spec.render.check(checker),
    }
}

/// The scenes, compared with the root that the job pins; `None` when something is wrong, which is reported.
pub(super) fn scenes(checker: &mut Checker, spec: &ViewsSpec, dataset: &FilePath) -> Option<FoundScenes> {
    let found = found_scenes(checker, &spec.scenes, dataset)?;
    let crowded = found.list.iter().map(|scene| scene.bodies.len()).max().filter(|most| *most > SceneImage::MAX_BODIES);
    if let Some(most) = crowded {
        let expected = format!("scenes of at most {} bodies", SceneImage::MAX_BODIES);
        checker.invalid("scenes.dataset", expected, format!("one of {most}"));
        return None;
    }
    Some(found)
}

/// The folder of the dataset; `None` when the job names none, which is reported.
pub(super) fn dataset(checker: &mut Checker, spec: &ViewsSpec, folder: &FilePath) -> Option<std::path::PathBuf> {
    SCENES.folder(checker, spec.scenes.dataset.as_ref(), folder)
}

/// A camera; `None` when something is wrong, which is reported.
fn camera(checker: &mut Checker, index: usize, entry: &ViewCameraSpec, folder: &FilePath) -> Option<ViewCamera> {
    let path = Path::from("views.cameras").index(index);
    let given = [
        ("shell", entry.shell.is_some()),
        ("overhead", entry.overhead.is_some()),
        ("list", entry.list.is_some()),
        ("poses", entry.poses.is_some()),
    ];
    let given: Vec<&str> = given.into_iter().filter_map(|(key, is_given)| is_given.then_some(key)).collect();
    let [rule] = given[..] else {
        let found = if given.is_empty() { "none of them".to_owned() } else { given.join(" and ") };
        checker.invalid(path, "one of `shell`, `overhead`, `list` and `poses`", found);
        return None;
    };
    if entry.views.is_some() && rule != "shell" {
        checker.contradiction(path.key("views"), rule, "a fixed pose is one view");
    }
    let placement = match (entry.shell, entry.overhead, &entry.list, &entry.poses) {
        (Some(shell), ..) => self::shell(checker, &path.key("shell"), &shell),
        (_, Some(overhead), ..) => ViewPlacement::Overhead(overhead.height),
        (_, _, Some(list), _) => ViewPlacement::Poses(read_poses(checker, &path.key("list"), &folder.join(list))?),
        (.., poses) => {
            let poses = poses.clone().unwrap_or_default();
            for (row, pose) in poses.iter().enumerate() {
                if let Err(problem) = check_pose(pose) {
                    checker.invalid(path.key("poses").index(row), "a pose", problem);
                }
            }
            ViewPlacement::Poses(poses)
        }
    };
    let views = match &placement {
        ViewPlacement::Shell { .. } => entry.views.unwrap_or(1),
        ViewPlacement::Overhead(_) => 1,
        ViewPlacement::Poses(poses) => poses.len() as u32,
    };
    Some(ViewCamera { intrinsics: intrinsics(checker, &path, entry)?, placement, views })
}

fn shell(checker: &mut Checker, path: &Path, shell: &ShellSpec) -> ViewPlacement {
    let ShellSpec { radius, polar_deg, roll_deg, aim } = *shell;
    let roll_deg = roll_deg.unwrap_or([0.0; 2]);
    for (key, range) in [("radius", radius), ("polar_deg", polar_deg), ("roll_deg", roll_deg)] {
        checker.check_range(path.key(key), &range);
    }
    let aim = match aim {
        None | Some(AimSpec::Bodies) => Aim::Bodies,
        Some(AimSpec::Origin) => Aim::Origin,
    };
    ViewPlacement::Shell { radius, polar_deg, roll_deg, aim }
}

fn intrinsics(checker: &mut Checker, path: &Path, entry: &ViewCameraSpec) -> Option<Intrinsics> {
    let near = entry.near.unwrap_or(NEAR);
    if let Some(preset) = entry.preset.as_deref().and_then(named_camera) {
        for key in ["width", "height", "fx", "fy", "cx", "cy"] {
            if checker.has(path.key(key)) {
                checker.contradiction(path.key(key), "preset", "the preset defines its camera");
            }
        }
        return Some(preset.intrinsics(near));
    }
    let (Some(width), Some(height), Some(fx)) = (entry.width, entry.height, entry.fx) else {
        checker.missing(path.key("preset"), "the name of a camera, or `width`, `height` and `fx`");
        return None;
    };
    let camera = Intrinsics {
        width,
        height,
        fx,
        fy: entry.fy.unwrap_or(fx),
        cx: entry.cx.unwrap_or(f64::from(width) / 2.0),
        cy: entry.cy.unwrap_or(f64::from(height) / 2.0),
        near,
    };
    match camera.checked() {
        Ok(camera) => Some(camera),
        Err(error) => {
            let key = match &error {
                InvalidIntrinsics::OutOfRange { name: "fy", .. } if entry.fy.is_none() => "fx",
                InvalidIntrinsics::OutOfRange { name, .. } => name,
                InvalidIntrinsics::Near(_) => "near",
                InvalidIntrinsics::Size { .. } | InvalidIntrinsics::FieldOfView(_) => "width",
            };
            checker.invalid(path.key(key), "a camera", error.to_string());
            None
        }
    }
}

/// The poses of a file; `None` when something is wrong, which is reported.
fn read_poses(checker: &mut Checker, key: &Path, file: &FilePath) -> Option<Vec<[f64; 7]>> {
    let text = match files::read_text(file, Bound::CSV) {
        Ok(text) => text,
        Err(error) => {
            checker.not_found(key, "file of poses", format!("{}: {error}", file.shown()));
            return None;
        }
    };
    match poses_of(&text) {
        Ok(poses) => Some(poses),
        Err(problem) => {
            checker.invalid(key, format!("lines of `{HEADING}`"), format!("{}: {problem}", file.shown()));
            None
        }
    }
}

fn poses_of(text: &str) -> Result<Vec<[f64; 7]>, String> {
    let mut lines = (1..).zip(text.lines().map(str::trim)).filter(|(_, line)| !line.is_empty());
    let heading = lines.next().map(|(_, line)| line.split(',').map(str::trim).collect::<Vec<_>>().join(","));
    if heading.as_deref() != Some(HEADING) {
        return Err(format!(
            "its first line is {}",
            heading.map_or("missing".to_owned(), |found| format!("`{found}`"))
        ));
    }
    let mut poses = Vec::new();
    for (number, line) in lines {
        let numbers: Result<Vec<f64>, _> = line.split(',').map(|word| word.trim().parse::<f64>()).collect();
        let pose = numbers.map_err(|error| format!("line {number}: {error}"))?;
        let pose = <[f64; 7]>::try_from(pose).map_err(|pose| format!("line {number}: {} of 7 numbers", pose.len()))?;
        check_pose(&pose).map_err(|problem| format!("line {number}: {problem}"))?;
        poses.push(pose);
    }
    if poses.is_empty() { Err("it has no pose".to_owned()) } else { Ok(poses) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_poses_are_read_line_by_line() {
        let text = "x, y, z, qw, qx, qy, qz\n0.1, 0, 0.5, 0, 1, 0, 0\n\n0,0,1,0,0.6,0.8,0\n";
        assert_eq!(poses_of(text), Ok(vec![[0.1, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.6, 0.8, 0.0]]));
        for (text, expected) in [
            ("", "missing"),
            ("x,y,z\n", "first line"),
            ("x,y,z,qw,qx,qy,qz\n", "no pose"),
            ("x,y,z,qw,qx,qy,qz\n1,2,3\n", "3 of 7"),
            ("x,y,z,qw,qx,qy,qz\n1,2,3,0,0,0,a\n", "line 2"),
            ("x,y,z,qw,qx,qy,qz\n1,2,3,0,0,0,2\n", "length 2"),
            ("x,y,z,qw,qx,qy,qz\n1,2,inf,0,0,0,1\n", "not finite"),
        ] {
            let problem = poses_of(text).expect_err(text);
            assert!(problem.contains(expected), "{problem}");
        }
    }
}
