//! Trials of grasps, and scenes, as folders that plain MuJoCo replays.

mod parts;
mod scenes;
mod trials;

use super::form::ExportFormat;

/// Models for plain MuJoCo, each with a `replay.py` that compares them with the dataset.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "mujoco",
    summary: "Grasp trials or settled scenes as models for plain MuJoCo, with a script that replays them.",
    has_unpacked: false,
    forms: &[trials::FORM, scenes::FORM],
};
