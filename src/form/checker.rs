//! Collection of the mistakes in a document, each key once.

use std::{collections::BTreeSet, fmt::Display, ops::Bound};

use super::{
    document::{Document, Span},
    errors::{FormError, FormErrors, FormProblem, Mistakes},
    path::{Path, Step},
    requirement::Requirement,
};

/// A document and the mistakes found in it so far.
///
/// A key is reported once. Later mistakes at the same key, inside it or in a table that contains it are ignored, so each check
/// may report without knowing the results of others.
///
/// ```
/// use graspmill_form::{Checker, Document};
///
/// let (document, syntax) = Document::read("pump.toml", "flow = 3.0\nvalve = \"open\"\n", &[]);
/// let mut checker = Checker::new(document, syntax);
/// checker.invalid("flow", "at most 2 l/s", "3 l/s").help("two pumps in parallel give more");
/// checker.invalid("flow", "a flow that the pipe can carry", "3 l/s");
/// let errors = checker.finish().expect_err("one mistake");
/// assert_eq!(
///     errors.to_string(),
///     "pump.toml:1:8: flow: expected at most 2 l/s, found 3 l/s; two pumps in parallel give more"
/// );
/// ```
#[derive(Clone, Debug)]
pub struct Checker {
    pub(super) document: Document,
    errors: Mistakes,
    /// Paths of values with mistakes.
    wrong: BTreeSet<Vec<Step>>,
}

/// A mistake that was just reported, to which a remedy can be added.
pub struct Report<'a>(Option<&'a mut FormError>);

impl Report<'_> {
    /// Adds a remedy.
    pub fn help(self, help: impl Into<String>) {
        self.help_if(Some(help.into()));
    }

    /// Adds a remedy, if one is known.
    pub fn help_if(self, help: Option<String>) {
        if let Some(error) = self.0 {
            error.help = help;
        }
    }
}

impl Checker {
    /// Creates a checker of a document, with the mistakes that reading found.
    pub fn new(document: Document, errors: Mistakes) -> Self {
        Self { document, errors, wrong: BTreeSet::new() }
    }

    /// The document, without values that have mistakes.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Whether a value is written at a path and has no known mistake.
    pub fn has(&self, path: impl Into<Path>) -> bool {
        self.document.has(path)
    }

    /// Number of mistakes found so far.
    pub fn count(&self) -> usize {
        self.errors.count()
    }

    /// Whether a mistake was reported for the value at a path or for one inside it.
    pub fn is_wrong(&self, path: impl Into<Path>) -> bool {
        let steps = path.into().0;
        // In the order of paths, the values inside a value follow directly after it.
        let mut behind = self.wrong.range::<[Step], _>((Bound::Included(&steps[..]), Bound::Unbounded));
        behind.next().is_some_and(|wrong| wrong.starts_with(&steps))
    }

    /// Reports a mistake, unless one is already known for the key.
    pub fn fail(&mut self, path: impl Into<Path>, problem: FormProblem) -> Report<'_> {
        let path = path.into();
        let is_inside = (0..path.0.len()).any(|depth| self.wrong.contains(&path.0[..depth]));
        if is_inside || self.is_wrong(&path) {
            return Report(None);
        }
        let location = self.document.location_of(&path);
        self.report(FormError { location, key: path.to_string(), problem, help: None }, path)
    }

    /// Reports a value that cannot be used.
    pub fn invalid(
        &mut self,
        path: impl Into<Path>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Report<'_> {
        self.fail(path, FormProblem::Invalid { expected: expected.into(), found: found.into() })
    }

    /// Reports a range whose first number is above the second. Returns whether the numbers are in order; equal numbers are.
    pub fn check_range<T: PartialOrd + Display>(&mut self, path: impl Into<Path>, [low, high]: &[T; 2]) -> bool {
        if low > high {
            self.invalid(path, "the lower number first", format!("[{low}, {high}]"));
        }
        low <= high
    }

    /// Reports a setting that excludes another.
    pub fn contradiction(
        &mut self,
        path: impl Into<Path>,
        other: impl ToString,
        because: impl Into<String>,
    ) -> Report<'_> {
        self.fail(path, FormProblem::Contradiction { other: other.to_string(), because: because.into() })
    }

    /// Reports a missing required key.
    pub fn missing(&mut self, path: impl Into<Path>, expected: impl Into<Requirement>) -> Report<'_> {
        self.fail(path, FormProblem::Missing { expected: expected.into() })
    }

    /// Reports a name or a file that does not exist.
    pub fn not_found(
        &mut self,
        path: impl Into<Path>,
        what: impl Into<String>,
        detail: impl Into<String>,
    ) -> Report<'_> {
        self.fail(path, FormProblem::NotFound { what: what.into(), detail: detail.into() })
    }

    /// Adds mistakes of a file that the document names.
    pub fn add_errors(&mut self, errors: Mistakes) {
        self.errors.append(errors);
    }

    /// Adds a mistake of a file that the document names.
    pub fn add_error(&mut self, error: FormError) {
        self.errors.push(error);
    }

    /// Returns the document after all checks.
    ///
    /// # Errors
    /// All mistakes.
    pub fn finish(self) -> Result<Document, FormErrors> {
        if self.errors.is_empty() { Ok(self.document) } else { Err(self.into_errors()) }
    }

    pub(super) fn into_errors(self) -> FormErrors {
        FormErrors::new(self.document.name(), self.errors)
    }

    /// Reports a mistake whose location is known.
    pub(super) fn report(&mut self, error: FormError, path: Path) -> Report<'_> {
        self.wrong.insert(path.0);
        Report(self.errors.push(error))
    }

    /// Marks what is at a path as wrong without a mistake of its own.
    pub(super) fn set_wrong(&mut self, path: Path) {
        self.wrong.insert(path.0);
    }

    pub(super) fn report_at(&mut self, span: &Span, path: &Path, problem: FormProblem) -> Report<'_> {
        let location = self.document.location(span);
        self.report(FormError { location, key: path.to_string(), problem, help: None }, path.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(text: &str) -> Checker {
        let (document, errors) = Document::read("a.toml", text, &[]);
        Checker::new(document, errors)
    }

    #[test]
    fn a_key_is_reported_once() {
        let mut checker = checker("a = { b = [1, 2], bc = 3 }\n");
        let b = Path::from("a.b");
        checker.invalid(b.index(1), "1", "2");
        assert!(checker.is_wrong("a") && checker.is_wrong("a.b") && checker.is_wrong(b.index(1)));
        assert!(!checker.is_wrong(b.index(0)) && !checker.is_wrong("a.bc") && !checker.is_wrong(b.index(1).key("x")));
        // No further mistake is reported at the key, around it or inside it, but keys next to it are reported.
        for path in [Path::from("a"), b.clone(), b.index(1), b.index(1).key("x")] {
            checker.missing(path, "something else").help("nobody reads this");
        }
        assert_eq!(checker.count(), 1);
        checker.invalid(b.index(0), "2", "1");
        checker.contradiction("a.bc", &b, "both count");
        assert_eq!(checker.count(), 3);
        let keys: Vec<String> =
            checker.finish().expect_err("mistakes").list().iter().map(|error| error.key.clone()).collect();
        assert_eq!(keys, ["a.b[0]", "a.b[1]", "a.bc"]);
    }

    #[test]
    fn a_document_without_mistakes_comes_back() {
        let checker = checker("a = 1\n");
        let document = checker.document().clone();
        assert_eq!(checker.finish(), Ok(document));
    }
}
