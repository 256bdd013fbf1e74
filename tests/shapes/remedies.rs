//! Remedies of the messages about depth pictures, each followed on the command line.

use std::path::{Path, PathBuf};

use super::table::{CAMERA, png_of, scene_depth};
use crate::support::{program::Program, workspace::Workspace};

const CAMERA_FILE: &str = "scenes/table.json";

fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n");
    [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes(), data].concat()
}

fn floats(values: impl Iterator<Item = f32>) -> Vec<u8> {
    npy("<f4", "(240, 320)", &values.flat_map(f32::to_le_bytes).collect::<Vec<_>>())
}

/// An organised PCD of the table's scene, its points times a number, mirrored or not.
fn pcd(scale: f64, signs: [f64; 2]) -> Vec<u8> {
    let mut text = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 320\nHEIGHT 240\n\
                    VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 76800\nDATA ascii\n"
        .to_owned();
    for (pixel, depth) in (0..).zip(scene_depth()) {
        let [u, v] = [f64::from(pixel % 320) + 0.5, f64::from(pixel / 320) + 0.5];
        let point = CAMERA.unproject(u, v, f64::from(depth));
        text += &format!("{} {} {}\n", scale * point.x, signs[0] * scale * point.y, signs[1] * scale * point.z);
    }
    text.into_bytes()
}

/// A wrong file, its message, and what the message advises.
struct Case {
    name: &'static str,
    content: Vec<u8>,
    words: &'static str,
    /// Options that the message names.
    options: &'static [&'static str],
    /// The file saved as the message has it, where it is the file that changes.
    saved: Option<(&'static str, Vec<u8>)>,
}

fn millimetres() -> Vec<u16> {
    scene_depth().iter().map(|depth| if depth.is_nan() { 0 } else { (1e3 * depth).round() as u16 }).collect()
}

fn whole(values: impl Iterator<Item = u16>) -> Vec<u8> {
    npy("<u2", "(240, 320)", &values.flat_map(u16::to_le_bytes).collect::<Vec<_>>())
}

/// Depths of the scene times a number; the upper 60 % of the picture is this value, as a sensor's that lost it.
fn lost(value: f32, scale: f32) -> Vec<u8> {
    let depth = scene_depth();
    let is_lost = |pixel: usize| pixel < 320 * 144;
    floats((0..).zip(depth).map(|(pixel, depth)| if is_lost(pixel) { value } else { scale * depth }))
}

/// Remedies that are options.
fn cases_of_options() -> Vec<Case> {
    let cases: [(&str, Vec<u8>, &str, &[&str]); 5] = [
        (
            "millimetres.npy",
            floats(scene_depth().into_iter().map(|depth| 1e3 * depth)),
            "give --depth-scale 0.001",
            &["--depth-scale", "0.001"],
        ),
        (
            "unit.npy",
            whole(millimetres().into_iter().map(|value| value / 10)),
            "give --depth-scale 0.01",
            &["--depth-scale", "0.01"],
        ),
        ("millimetres.pcd", pcd(1e3, [1.0, 1.0]), "give --depth-scale 0.001", &["--depth-scale", "0.001"]),
        ("opengl.pcd", pcd(1.0, [-1.0, -1.0]), "give --flip", &["--flip"]),
        ("opengl_mm.pcd", pcd(1e3, [-1.0, -1.0]), "give --flip", &["--flip", "--depth-scale", "0.001"]),
    ];
    cases.map(|(name, content, words, options)| Case { name, content, words, options, saved: None }).into()
}

/// Remedies that are another way to save the file.
fn cases_of_saving() -> Vec<Case> {
    let depth = scene_depth();
    let (metres, picture, cloud) = (floats(depth.iter().copied()), png_of(&depth, &CAMERA), pcd(1.0, [1.0, 1.0]));
    let changed = |from: &str, to: &str| String::from_utf8_lossy(&cloud).replace(from, to).into_bytes();
    let negative = floats(depth.iter().map(|depth| -depth));
    let integers = npy("<i4", "(240, 320)", &[0; 4 * 76800]);
    let channels = npy("<f4", "(240, 320, 1)", &[0; 4 * 76800]);
    let saved =
        |name, content, words, saved_as, by| Case { name, content, words, options: &[], saved: Some((saved_as, by)) };
    let in_millimetres = saved("mm.npy", lost(65535.0, 1e3), "fit: give --depth-scale 0.001", "mm.npy", lost(0.0, 1e3));
    vec![
        Case { options: &["--depth-scale", "0.001"], ..in_millimetres },
        saved("saturated.npy", lost(65.535, 1.0), "save 0 there", "saturated.npy", lost(0.0, 1.0)),
        saved("negative.npy", negative, "save the depths with the other sign", "negative.npy", metres.clone()),
        saved(
            "whole.npy",
            integers,
            "save it by numpy.save as float32 in metres or as uint16",
            "whole.npy",
            metres.clone(),
        ),
        saved("channels.npy", channels, "with shape (height, width)", "channels.npy", metres.clone()),
        saved(
            "short.npy",
            metres[..400].to_vec(),
            "save it by numpy.save",
            "short.npy",
            whole(millimetres().into_iter()),
        ),
        saved("depth.tiff", metres.clone(), "give a .png of 16 bits, a .npy, or an organised", "depth.npy", metres),
        saved("cut.png", picture[..400].to_vec(), "save the picture again", "cut.png", picture),
        saved(
            "row.pcd",
            changed("WIDTH 320\nHEIGHT 240", "WIDTH 76800\nHEIGHT 1"),
            "save the cloud organised",
            "row.pcd",
            cloud.clone(),
        ),
        saved(
            "points.pcd",
            changed("POINTS 76800", "POINTS 7"),
            "save the cloud organised",
            "points.pcd",
            cloud.clone(),
        ),
        saved("y_up.pcd", pcd(1.0, [-1.0, 1.0]), "give the cloud in the camera's own frame", "y_up.pcd", cloud),
    ]
}

#[test]
fn every_remedy_about_a_depth_picture_leads_to_its_objects() {
    let workspace = Workspace::new();
    let segment = |picture: PathBuf, options: &[&str], name: &str| {
        let is_cloud = picture.extension().is_some_and(|kind| kind == "pcd");
        let run = Program::on("segment", picture).args(options).option("--out", workspace.path(name));
        if is_cloud { run } else { run.option("--intrinsics", CAMERA_FILE) }
    };
    let cases = cases_of_options().into_iter().chain(cases_of_saving());
    for (number, Case { name, content, words, options, saved }) in cases.enumerate() {
        let file = workspace.write(Path::new("wrong").join(name), content);
        let said = segment(file.clone(), &[], "refused").expect_code(2).stderr;
        assert!(said.contains(words) && said.contains(name), "{name}, {words}: {said}");
        assert!(!workspace.path("refused").exists(), "{name}");
        let picture = match saved {
            Some((name, content)) => workspace.write(Path::new("saved").join(name), content),
            None => file,
        };
        let done = segment(picture, options, &format!("scene-{number}")).finish();
        assert!(
            [Some(0), Some(3)].contains(&done.code) && done.stdout.contains("object-1: "),
            "{name}: {}",
            done.text()
        );
    }
    // What does not belong together.
    let pairs = [
        ("scenes/table.png", &["--flip"][..], "leave --flip out", &[][..]),
        ("wrong/opengl.pcd", &["--flip", "--intrinsics", CAMERA_FILE], "leave intrinsics and ranges out", &["--flip"]),
        ("wrong/opengl.pcd", &["--flip", "--range"], "leave intrinsics and ranges out", &["--flip"]),
        ("saved/y_up.pcd", &["--flip"], "leave --flip out", &[]),
    ];
    for (number, (picture, options, words, mended)) in pairs.into_iter().enumerate() {
        let picture = if picture.starts_with("scenes") { picture.into() } else { workspace.path(picture) };
        let said = segment(picture.clone(), options, "refused").expect_code(2).stderr;
        assert!(said.contains(words), "{words}: {said}");
        assert!(segment(picture, mended, &format!("after-{number}")).finish().stdout.contains("object-1: "), "{words}");
    }
    for scale in ["0", "nan", "1e-9", "11"] {
        let said = segment("scenes/table.png".into(), &["--depth-scale", scale], "refused").expect_code(2).stderr;
        assert!(said.contains("give metres per unit, from 1e-7 to 10"), "{scale}: {said}");
    }
}

/// Whole numbers have no saturated depth: what a sensor could not measure is no return.
#[test]
fn saturated_whole_numbers_are_no_return() {
    let workspace = Workspace::new();
    let depth = scene_depth();
    let picture = |value: u16| {
        let data = depth.iter().enumerate().flat_map(|(pixel, depth)| {
            let is_lost = pixel < 320 * 144 && pixel % 2 == 0;
            if is_lost || depth.is_nan() { value } else { (1e3 * depth).round() as u16 }.to_le_bytes()
        });
        npy("<u2", "(240, 320)", &data.collect::<Vec<_>>())
    };
    let report = |name: &str, value: u16| {
        let file = workspace.write(name, picture(value));
        let run = Program::on("segment", file).option("--intrinsics", CAMERA_FILE);
        run.option("--out", workspace.path(format!("{name}.out"))).finish();
        let text = std::fs::read(workspace.path(format!("{name}.out")).join("labels.png")).expect("labels");
        let report = crate::support::files::read_json(workspace.path(format!("{name}.out")).join("scene.json"));
        (text, report["objects"].clone(), report["plane"].clone())
    };
    assert_eq!(report("zero.npy", 0), report("saturated.npy", u16::MAX));
}
