//! Units of length: one list for job files, tables of meshes, the command line and remedies.

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    /// Symbol, as files are written: `mm`.
    pub symbol: &'static str,
    /// A second name that is accepted: `inch`.
    pub synonym: Option<&'static str>,
    /// Name in sentences, in the plural: `millimetres`.
    pub plural: &'static str,
    /// Length of one unit [m].
    pub metres: f64,
}

const fn unit(symbol: &'static str, synonym: Option<&'static str>, plural: &'static str, metres: f64) -> LengthUnit {
    LengthUnit { symbol, synonym, plural, metres }
}

impl LengthUnit {
    /// Every unit that graspmill knows.
    pub const ALL: [Self; 6] = [
        unit("m", None, "metres", 1.0),
        unit("dm", None, "decimetres", 0.1),
        unit("cm", None, "centimetres", 0.01),
        unit("mm", None, "millimetres", 0.001),
        unit("in", Some("inch"), "inches", 0.0254),
        unit("ft", Some("foot"), "feet", 0.3048),
    ];

    /// The unit of a symbol or synonym.
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|unit| unit.symbol == name || unit.synonym == Some(name))
    }

    /// Every such name, in a sentence: `m, dm, ...`.
    pub fn list() -> String {
        Self::names().collect::<Vec<_>>().join(", ")
    }

    /// Every name that [`Self::named`] takes.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::ALL.iter().flat_map(|unit| [Some(unit.symbol), unit.synonym]).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_one_unit() {
        let names: Vec<&str> = LengthUnit::names().collect();
        assert_eq!(names, ["m", "dm", "cm", "mm", "in", "inch", "ft", "foot"]);
        assert!(names.iter().all(|name| LengthUnit::named(name).is_some()));
        let metres = |name| LengthUnit::named(name).expect("a unit").metres;
        assert!((metres("foot") - 12.0 * metres("inch")).abs() < 1e-15);
        assert_eq!(LengthUnit::named("yard"), None);
    }
}
