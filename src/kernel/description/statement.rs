//! Elements of a description, each with its place.

use std::{
    fmt,
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::words::Show;

/// A line of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: Arc<PathBuf>,
    /// The line, counted from 1.
    pub line: u32,
}

impl Place {
    /// The first line of a file.
    pub fn start_of(file: &Path) -> Self {
        Self { file: Arc::new(file.to_owned()), line: 1 }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file.shown(), self.line)
    }
}

/// An element of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Statement {
    /// Where it begins.
    pub place: Place,
    /// Index of the element around it; `None` for the root.
    pub parent: Option<usize>,
    /// Kind of the element around it: its name, or `body` for all that holds what a body holds (`worldbody`, `body`, `frame`,
    /// `replicate`). Empty for the root.
    pub within: String,
    /// Name of the element.
    pub element: String,
    /// Names and values of its attributes, in the order of the text.
    pub attributes: Vec<(String, String)>,
}

impl Statement {
    /// The value of an attribute.
    pub fn get(&self, attribute: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| name == attribute).map(|(_, value)| value.as_str())
    }

    /// Whether it is an element `within/element`, where `*` fits any name.
    pub fn is(&self, pattern: &str) -> bool {
        matches(pattern, &self.within, &self.element)
    }

    /// Whether it is such an element, or gives defaults to such elements.
    pub fn is_or_defaults(&self, pattern: &str) -> bool {
        self.is(pattern) || (self.within == "default" && matches(pattern, section_of(&self.element), &self.element))
    }
}

fn matches(pattern: &str, within: &str, element: &str) -> bool {
    let (section, wanted) = pattern.split_once('/').unwrap_or(("", pattern));
    (section == "*" || section == within) && (wanted == "*" || wanted == element)
}

/// The section whose elements an element of `default` is about.
pub fn section_of(element: &str) -> &'static str {
    match element {
        "joint" | "geom" | "site" | "camera" | "light" => "body",
        "mesh" | "texture" | "material" => "asset",
        "pair" => "contact",
        "equality" => "equality",
        "tendon" => "tendon",
        "default" => "default",
        _ => "actuator",
    }
}

impl fmt::Display for Statement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "<{}", self.element)?;
        self.attributes.iter().try_for_each(|(name, value)| write!(f, " {name}=\"{value}\""))?;
        write!(f, ">")
    }
}

/// Kind of an element as what holds others.
pub(super) fn kind_of(element: &str) -> &str {
    if matches!(element, "worldbody" | "frame" | "replicate") { "body" } else { element }
}
