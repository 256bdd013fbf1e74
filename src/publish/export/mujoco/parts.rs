//! Parts of all exported models.

use kernel::geom::MassProperties;

/// Stiffness and damping of contacts with which trials and scenes were made, as attributes of a geom or a flex.
pub(super) const CONTACT: &str = "solref=\"0.004 1\" solimp=\"0.95 0.995 0.0005 0.5 2\"";

/// Mass [kg], centre and inertia of a body, as an element; `unit` is of a kilogram.
pub(super) fn inertial(mass: f64, unit: &MassProperties) -> String {
    let inertia = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|place| mass * unit.inertia[place]);
    format!(
        "<inertial mass=\"{mass}\" pos=\"{}\" fullinertia=\"{}\"/>",
        joined(unit.centre.coords.as_slice()),
        joined(&inertia)
    )
}

/// Numbers in the format of an attribute.
pub(super) fn joined(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
