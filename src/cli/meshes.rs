//! `graspmill meshes check` and `graspmill meshes split`.

use super::{
    args::{MeshScaleArgs, MeshesCheckArgs, MeshesSplitArgs},
    exit::{Exit, Failure},
    printer::Printer,
    segment::write,
};
use assets::{MeshSource, ScaleRule, SizeRule, check_report};
use format::dataset::NewFolder;
use kernel::words::{LengthUnit, Show, counted};
use surface::write_ply;

/// Describes each mesh, the repairs that a job would make, and refusals with their remedies.
pub fn check(arguments: &MeshesCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let report = check_report(&arguments.paths, scale(&arguments.scale)?, SizeRule::default());
    if arguments.json {
        printer.json(&report)?
    } else {
        printer.result(&report.to_string())
    }
    Ok(if report.has_refusals() { Exit::Refused } else { Exit::Complete })
}

/// Writes the disconnected parts of a mesh as separate meshes.
pub fn split(arguments: &MeshesSplitArgs, printer: &Printer) -> Result<Exit, Failure> {
    let MeshesSplitArgs { file, out, scale: of_file } = arguments;
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let source = MeshSource { scale: scale(of_file)?, ..MeshSource::of_file(name.clone(), file) };
    let parts = assets::parts(&source).map_err(|refusal| Failure::message(Exit::Refused, refusal))?;
    if parts.is_empty() {
        let message = format!("{}: the mesh is connected, so there is nothing to split", file.shown());
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let folder = NewFolder::begin(out)?;
    for (number, part) in (1..).zip(&parts) {
        write(folder.folder(), &format!("{name}-{number}.ply"), &write_ply(part, &[]))?;
    }
    folder.publish()?;
    let parts = counted(parts.len() as u64, "mesh");
    printer.result(&format!("{parts} in {}, in metres: unit = \"m\" in a job", out.shown()));
    Ok(Exit::Complete)
}

/// Scale of a mesh from the arguments.
fn scale(arguments: &MeshScaleArgs) -> Result<ScaleRule, Failure> {
    match arguments.size {
        Some(size) => longest_side(size),
        None => Ok(ScaleRule::MetresPerUnit(metres_per_unit(&arguments.unit)?)),
    }
}

/// Scale by a longest side [m].
pub fn longest_side(size: f64) -> Result<ScaleRule, Failure> {
    if size > 0.0 && size.is_finite() {
        return Ok(ScaleRule::LongestSide(size));
    }
    let message = format!("--size {size}: give the longest side in metres, above 0");
    Err(Failure::message(Exit::BadSpec, message))
}

/// Length of a unit in metres, from its name or a number.
pub fn metres_per_unit(text: &str) -> Result<f64, Failure> {
    let number = || text.parse().ok().filter(|metres: &f64| *metres > 0.0 && metres.is_finite());
    LengthUnit::named(text).map(|unit| unit.metres).or_else(number).ok_or_else(|| {
        let message = format!("--unit {text}: give {}, or the length of one unit in metres", LengthUnit::list());
        Failure::message(Exit::BadSpec, message)
    })
}
