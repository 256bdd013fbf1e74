//! `graspmill meshes check`.

use super::{
    args::MeshesCheckArgs,
    exit::{Exit, Failure},
    printer::Printer,
};
use factory::job::spec::UnitSpec;
use kernel::assets::{ScaleRule, SizeRule, check_report};

/// Says what each mesh is, what would be repaired, what is refused and how to mend it.
pub fn check(arguments: &MeshesCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let metres = metres_per_unit(&arguments.unit)?;
    let report = check_report(&arguments.paths, ScaleRule::MetresPerUnit(metres), SizeRule::default());
    if arguments.json {
        printer.json(&report)?
    } else {
        printer.result(&report.to_string())
    }
    Ok(if report.has_refusals() { Exit::Refused } else { Exit::Complete })
}

/// A unit by name, or as a number of metres.
fn metres_per_unit(text: &str) -> Result<f64, Failure> {
    let metres = match text {
        "m" => Some(UnitSpec::Metre.metres()),
        "cm" => Some(UnitSpec::Centimetre.metres()),
        "mm" => Some(UnitSpec::Millimetre.metres()),
        "in" => Some(UnitSpec::Inch.metres()),
        number => number.parse().ok().filter(|metres: &f64| *metres > 0.0 && metres.is_finite()),
    };
    metres.ok_or_else(|| {
        Failure::message(
            Exit::BadSpec,
            format!("--unit {text}: give m, cm, mm, in, or the length of one unit in metres"),
        )
    })
}
