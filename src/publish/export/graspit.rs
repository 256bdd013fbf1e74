//! Labels and field of a reachability dataset as raw files for the thesis's grasp planner.

use std::io::Write;

use serde_json::json;

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    target::Target,
};
use format::{Noun, Product, dataset::DatasetReader, extras::read_field};
use kernel::geom::{Axis, AxisGrid, PoseGrid, PoseLabel};

/// `reach_data.full`, `.sdf`, `.dims`, `.mins`, `.step` and `.csv` of a reachability dataset, after the thesis's code;
/// their field is positive where reachable.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "graspit",
    summary: "Labels and field of a reachability dataset as raw float64 files, for GraspIt.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::REACHABILITY,
        counted: Noun { one: "pose", many: "poses" },
        keys: &[],
        layout: |_| {
            "reach_data.full: 1 reachable, 0 not; reach_data.sdf: signed distance, POSITIVE where reachable (the \
             dataset's own field is negative there); both raw little-endian float64, C order over x, y, z, roll, \
             pitch, yaw. reach_data.dims, .mins, .step: cells, first centre and step of the six axes [m, rad]. \
             reach_data.csv: one line `i x y z roll pitch yaw 0|1` per pose, rotation Rz(yaw) Ry(pitch) Rx(roll)"
        },
        write,
    }],
};

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    if *selection != ExportSelection::default() {
        return Err(ExportError::WholeGrid);
    }
    let field = read_field(reader.folder())?;
    let PoseGrid::Axes(grid) = &field.header.grid else { return Err(ExportError::Directions) };
    let reachable = || field.labels.iter().map(|label| *label == PoseLabel::Reachable);
    doubles(target, "reach_data.full", reachable().map(|reachable| f64::from(u8::from(reachable))))?;
    // Positive where the dataset's own field is negative.
    doubles(target, "reach_data.sdf", field.distances.iter().map(|distance| -f64::from(*distance)))?;
    line(target, "reach_data.dims", grid, |axis| axis.count.to_string())?;
    line(target, "reach_data.mins", grid, |axis| axis.first.to_string())?;
    line(target, "reach_data.step", grid, |axis| axis.step.to_string())?;
    let (mut file, path) = target.open("reach_data.csv")?;
    let failed = |error| ExportError::io("writing", &path)(error);
    for (cell, reachable) in reachable().enumerate() {
        let [x, y, z, roll, pitch, yaw] = grid.pose(cell);
        writeln!(file, "{cell} {x} {y} {z} {roll} {pitch} {yaw} {}", u8::from(reachable)).map_err(failed)?;
    }
    file.flush().map_err(failed)?;
    let header = &field.header;
    let facts = json!({
        "poses": header.grid.cells(),
        "robot": header.robot,
        "joints": header.joints,
        "target": header.target,
        "frame": header.frame,
        "profile": header.profile(),
        "unit": header.unit(),
        "sign": "positive where reachable",
    });
    Ok(Written::new(header.grid.cells() as u64, facts))
}

/// Little-endian float64, in the order of the grid.
fn doubles(target: &mut Target, name: &str, values: impl Iterator<Item = f64>) -> Result<(), ExportError> {
    let (mut file, path) = target.open(name)?;
    let failed = |error| ExportError::io("writing", &path)(error);
    for value in values {
        file.write_all(&value.to_le_bytes()).map_err(failed)?;
    }
    file.flush().map_err(failed)
}

/// One number per axis.
fn line(target: &mut Target, name: &str, grid: &AxisGrid, number: impl Fn(&Axis) -> String) -> Result<(), ExportError> {
    target.write(name, (grid.axes().each_ref().map(number).join(",") + "\n").as_bytes())
}
