//! Robots and hands against MuJoCo, coal, parry and plane geometry: descriptions, kinematics, collisions, motions,
//! closing.

mod collision;
mod hands;
mod kinematics;
mod motion;
mod robots;
mod sim;
mod solids;
mod urdf;

use std::fs;

use tempfile::NamedTempFile;

/// A description in MJCF, in a separate file.
fn write_scene(text: &str) -> NamedTempFile {
    let file = NamedTempFile::with_suffix(".xml").expect("a file");
    fs::write(file.path(), text).expect("written");
    file
}
