//! `graspmill meshes check`.

use super::{
    args::MeshesCheckArgs,
    exit::{Exit, Failure},
    printer::Printer,
};
use kernel::{
    assets::{ScaleRule, SizeRule, check_report},
    words::LengthUnit,
};

/// Says what each mesh is, what would be repaired, what is refused and how to mend it.
pub fn check(arguments: &MeshesCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let scale = match arguments.size {
        Some(size) if size > 0.0 && size.is_finite() => ScaleRule::LongestSide(size),
        Some(size) => {
            return Err(Failure::message(
                Exit::BadSpec,
                format!("--size {size}: give the longest side in metres, above 0"),
            ));
        }
        None => ScaleRule::MetresPerUnit(metres_per_unit(&arguments.unit)?),
    };
    let report = check_report(&arguments.paths, scale, SizeRule::default());
    if arguments.json {
        printer.json(&report)?
    } else {
        printer.result(&report.to_string())
    }
    Ok(if report.has_refusals() { Exit::Refused } else { Exit::Complete })
}

/// A unit by name, or as a number of metres.
fn metres_per_unit(text: &str) -> Result<f64, Failure> {
    let number = || text.parse().ok().filter(|metres: &f64| *metres > 0.0 && metres.is_finite());
    LengthUnit::named(text).map(|unit| unit.metres).or_else(number).ok_or_else(|| {
        let message = format!("--unit {text}: give {}, or the length of one unit in metres", LengthUnit::list());
        Failure::message(Exit::BadSpec, message)
    })
}
