//! Trials of grasps, and scenes, as folders that plain MuJoCo replays.

mod parts;
mod scenes;
mod trials;

use super::form::ExportFormat;

/// Models of plain MuJoCo, each with a `replay.py` that holds them against the dataset.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "mujoco",
    summary: "Trials of grasps or settled scenes as models of plain MuJoCo, and a script that replays them.",
    has_unpacked: false,
    forms: &[trials::FORM, scenes::FORM],
};
