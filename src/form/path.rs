//! The path from the root of a document to one of its values.

use std::fmt;

/// One step from a value to a value inside it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Step {
    /// A key of a table.
    Key(String),
    /// An element of an array, counted from 0.
    Index(usize),
}

/// The path from the root of a document to a value; shown as `objects[1].meshes."a b".unit`.
///
/// A `&str` becomes the path of its dotted keys, so that checks can name a key as people write it:
///
/// ```
/// use graspmill_form::Path;
///
/// let path = Path::from("robot.joints").index(2);
/// assert_eq!(path.to_string(), "robot.joints[2]");
/// assert_eq!(Path::from("meshes").key("a b").to_string(), r#"meshes."a b""#);
/// ```
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Path(pub(super) Vec<Step>);

impl Path {
    /// Appends a key to the path.
    #[must_use]
    pub fn key(&self, key: &str) -> Self {
        self.step(Step::Key(key.to_owned()))
    }

    /// Appends an array index to the path.
    #[must_use]
    pub fn index(&self, index: usize) -> Self {
        self.step(Step::Index(index))
    }

    /// Whether the keys of the path are these dotted ones; indices count for nothing.
    ///
    /// ```
    /// use graspmill_form::Path;
    ///
    /// let path = Path::from("objects").index(1).key("unit");
    /// assert!(path.has_keys("objects.unit") && !path.has_keys("objects"));
    /// assert_eq!(path.with_keys("objects.scale").to_string(), "objects[1].scale");
    /// ```
    pub fn has_keys(&self, dotted: &str) -> bool {
        let keys = self.0.iter().filter_map(|step| match step {
            Step::Key(key) => Some(key.as_str()),
            Step::Index(_) => None,
        });
        keys.eq(dotted.split('.'))
    }

    /// The path with its keys replaced, in order, by dotted ones of the same count; indices stay.
    #[must_use]
    pub fn with_keys(&self, dotted: &str) -> Self {
        let mut keys = dotted.split('.');
        let steps = self.0.iter().map(|step| match step {
            Step::Key(key) => Step::Key(keys.next().unwrap_or(key).to_owned()),
            Step::Index(index) => Step::Index(*index),
        });
        Self(steps.collect())
    }

    fn step(&self, step: Step) -> Self {
        Self(self.0.iter().cloned().chain([step]).collect())
    }
}

/// Splits at dots, for keys that contain no dots.
impl From<&str> for Path {
    fn from(dotted: &str) -> Self {
        Self(dotted.split('.').filter(|key| !key.is_empty()).map(|key| Step::Key(key.to_owned())).collect())
    }
}

impl From<&String> for Path {
    fn from(dotted: &String) -> Self {
        Self::from(dotted.as_str())
    }
}

impl From<&Self> for Path {
    fn from(path: &Self) -> Self {
        path.clone()
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) => {
                    if depth > 0 {
                        f.write_str(".")?;
                    }
                    if is_bare(key) { f.write_str(key)? } else { write!(f, "\"{}\"", key.escape_debug())? }
                }
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// Whether a key needs no quotes in TOML.
fn is_bare(key: &str) -> bool {
    !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-')
}
