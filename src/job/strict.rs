//! Other TOML files, read as strictly as jobs: unknown keys refused, every mistake reported at once, each with its place.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::{
    check::Checker,
    decode::{self, DecodedAs, did_you_mean},
    document::{Document, Path, Step},
    errors::{JobError, JobErrors, Problem},
    pattern, schema,
};

/// A TOML file of the form `T`, with the mistakes found so far.
pub struct StrictFile<T> {
    /// Its keys; what was wrong is left out.
    pub spec: T,
    document: Document,
    errors: Vec<JobError>,
    wrong: Vec<Path>,
}

impl<T: JsonSchema + DeserializeOwned> StrictFile<T> {
    /// Reads `text`; `label` names the file in messages.
    ///
    /// # Errors
    /// When a key that it cannot do without is missing or wrong: nothing further can be said.
    pub fn read(label: &str, text: &str) -> Result<Self, JobErrors> {
        let schema = schema::of_form::<T>("a file of graspmill");
        let DecodedAs { spec, document, errors, wrong } = decode::decode_as(label, text, &schema)?;
        Ok(Self { spec, document, errors, wrong })
    }
}

impl<T> StrictFile<T> {
    /// Reports what the form alone cannot see, at the key that `steps` lead to; a key is reported once.
    pub fn fail(&mut self, steps: &[Step], problem: Problem, help: Option<String>) {
        let (errors, wrong) = (std::mem::take(&mut self.errors), std::mem::take(&mut self.wrong));
        let mut checker = Checker { document: &self.document, errors, wrong };
        checker.fail(&Path(steps.to_vec()), problem, help);
        (self.errors, self.wrong) = (checker.errors, checker.wrong);
    }

    /// The keys, once everything has been looked at.
    ///
    /// # Errors
    /// Every mistake.
    pub fn finish(self) -> Result<T, JobErrors> {
        JobErrors::check(self.errors)?;
        Ok(self.spec)
    }
}

/// Whether a pattern of a job (`*` any part of a name, `?` one letter) fits all of a name.
pub fn fits(pattern: &str, name: &str) -> bool {
    pattern::name(pattern, name)
}

/// `did you mean ...?` for the name that is nearest, when one is near.
pub fn meant<'a>(found: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    did_you_mean(found, known)
}
