//! The table of a suction cup: strict TOML with the keys of [`CupSettings`].

use std::sync::LazyLock;

use super::cup::{CupSettings, InvalidCup, SuctionCup};
use form::{FormErrors, Schema, decode, schema_of};

static SCHEMA: LazyLock<Schema> = LazyLock::new(|| schema_of::<CupSettings>("table of a graspmill suction cup"));

impl SuctionCup {
    /// Parses the table of a cup from text. A key that is left out has its default; `label` is the name of the text in messages.
    ///
    /// ```
    /// use graspmill_robot::suction::SuctionCup;
    ///
    /// let cup = SuctionCup::parse("cup.toml", "radius = 0.015\nmin_curvature_radius = 0.03\n")?;
    /// assert_eq!((cup.settings().radius, cup.settings().friction), (0.015, 0.5));
    /// let errors = SuctionCup::parse("cup.toml", "stroke = 0.05\n").expect_err("longer than the cup");
    /// assert!(errors.to_string().starts_with("cup.toml:1:10: stroke: expected at most the cup's height"));
    /// # Ok::<(), form::FormErrors>(())
    /// ```
    ///
    /// # Errors
    /// Every mistake of the table, with its location.
    pub fn parse(label: &str, text: &str) -> Result<Self, FormErrors> {
        let (settings, mut checker) = decode::<CupSettings>(label, text, &[], &SCHEMA, &())?;
        let cup = Self::new(settings);
        if let Err(InvalidCup { key, value, range }) = &cup {
            checker.invalid(*key, *range, value.to_string());
        }
        checker.finish()?;
        Ok(cup.expect("a cup without mistakes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_without_keys_is_the_default_cup() {
        assert_eq!(*SuctionCup::parse("cup.toml", "").expect("a cup").settings(), CupSettings::default());
        let cup = SuctionCup::parse("cup.toml", "max_moment = 0.49\n").expect("a cup");
        assert_eq!(cup.settings().max_moment, Some(0.49));
    }

    #[test]
    fn every_mistake_has_its_line() {
        let errors =
            SuctionCup::parse("cup.toml", "radius = -1.0\nstiffness = -2.0\nbellows = 3\n").expect_err("three");
        let text = errors.to_string();
        for part in ["cup.toml:1:10: radius", "cup.toml:2:13: stiffness", "bellows"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
