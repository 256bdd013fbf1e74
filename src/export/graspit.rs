//! Labels and field of a reachability dataset as raw files, as the thesis's own grasp planner reads them.

use std::{io::Write, path::Path};

use super::{ExportError, ExportSelection, ExportSummary, Format, target::Target};
use crate::{
    dataset::{DatasetReader, read_field},
    geom::{Axis, AxisGrid, PoseGrid, PoseLabel},
    ids::Product,
};

/// Writes `reach_data.full`, `.sdf`, `.dims`, `.mins`, `.step` and `.csv`.
pub(super) fn export(
    reader: &DatasetReader,
    out: &Path,
    selection: &ExportSelection,
) -> Result<ExportSummary, ExportError> {
    let product = reader.manifest().product;
    let format = Format::Graspit;
    if product != Product::Reachability {
        return Err(ExportError::OtherProduct { product, format: format.name(), of: Product::Reachability });
    }
    if *selection != ExportSelection::default() {
        return Err(ExportError::WholeGrid);
    }
    let field = read_field(reader.folder())?;
    let PoseGrid::Axes(grid) = &field.header.grid else { return Err(ExportError::Directions) };
    let mut target = Target::create(out)?;
    let reachable = || field.labels.iter().map(|label| *label == PoseLabel::Reachable);
    doubles(&mut target, "reach_data.full", reachable().map(|reachable| f64::from(u8::from(reachable))))?;
    // Theirs is positive where ours is negative.
    doubles(&mut target, "reach_data.sdf", field.distances.iter().map(|distance| -f64::from(*distance)))?;
    line(&mut target, "reach_data.dims", grid, |axis| axis.count.to_string())?;
    line(&mut target, "reach_data.mins", grid, |axis| axis.first.to_string())?;
    line(&mut target, "reach_data.step", grid, |axis| axis.step.to_string())?;
    let (mut file, path) = target.open("reach_data.csv")?;
    let failed = |error| ExportError::io("writing", &path)(error);
    for (cell, reachable) in reachable().enumerate() {
        let [x, y, z, roll, pitch, yaw] = grid.pose(cell);
        writeln!(file, "{cell} {x} {y} {z} {roll} {pitch} {yaw} {}", u8::from(reachable)).map_err(failed)?;
    }
    file.flush().map_err(failed)?;
    let header = &field.header;
    let facts = serde_json::json!({
        "root": reader.manifest().root,
        "format": format.name(),
        "layout": format.layout(),
        "poses": header.grid.cells(),
        "robot": header.robot,
        "joints": header.joints,
        "target": header.target,
        "frame": header.frame,
        "profile": header.profile(),
        "unit": header.unit(),
        "sign": "positive where reachable",
    });
    let text = serde_json::to_string_pretty(&facts).expect("plain data with text keys") + "\n";
    target.write("export.json", text.as_bytes())?;
    let samples = header.grid.cells() as u64;
    Ok(ExportSummary { folder: out.to_owned(), samples, files: target.publish()? })
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

/// One number an axis.
fn line(target: &mut Target, name: &str, grid: &AxisGrid, number: impl Fn(&Axis) -> String) -> Result<(), ExportError> {
    target.write(name, (grid.axes().each_ref().map(number).join(",") + "\n").as_bytes())
}
