//! Rows of the table of statements, and the uses of descriptions that they are about.

use kernel::description::Statement;

/// Use that a description is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usage {
    /// The map of a robot: joints, shapes that can collide, and which of them may meet.
    Robot,
    /// A hand that touches and grasps.
    Hand,
    /// A container of scenes: only its shapes.
    Container,
    /// A camera of a scene.
    Camera,
}

impl Usage {
    /// Every use, in the order of [`Row::decisions`].
    pub const ALL: [Self; 4] = [Self::Robot, Self::Hand, Self::Container, Self::Camera];
}

/// Treatment of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Honoured: it changes the result, as in MuJoCo.
    Honoured,
    /// Honoured, and refused under a condition.
    HonouredUnless {
        /// The condition, as a clause.
        when: &'static str,
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// Ignored: it does not affect the result.
    Ignored {
        /// Why that is safe.
        reason: &'static str,
    },
    /// Ignored, and refused under a condition.
    IgnoredUnless {
        /// Why that is safe.
        reason: &'static str,
        /// The condition, as a clause.
        when: &'static str,
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// Some values do not affect the result, all others are refused.
    Only {
        /// The accepted values; numbers are compared as numbers, one by one.
        values: &'static [&'static str],
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
    /// Refused.
    Refused {
        /// Remedy: the statement to write instead.
        remedy: &'static str,
    },
}

/// A row of the table: an element, or some of its attributes.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The element, as `section/element`; `body` includes every element that contains bodies.
    pub element: &'static str,
    /// Attributes of the element, each with a value that makes a difference, or none if it makes no difference alone;
    /// empty: the element with all attributes that no other row names.
    pub attributes: &'static str,
    /// Attributes without which these make no difference, or for a whole element an example of it.
    pub example: &'static str,
    /// For a robot, a hand, a container and a camera.
    pub decisions: [Decision; 4],
}

impl Row {
    /// Names of the attributes, with their values.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let mut rest = self.attributes;
        std::iter::from_fn(move || {
            let (name, after) = rest.trim_start().split_once("=\"")?;
            let (value, after) = after.split_once('"')?;
            rest = after;
            Some((name, value))
        })
    }

    /// Treatment of the statement by a use.
    pub fn decision(&self, usage: Usage) -> Decision {
        let index = Usage::ALL.iter().position(|known| *known == usage).expect("every use is listed");
        self.decisions[index]
    }

    /// Whether the row is for an element, or for one of its attributes.
    pub(super) fn is_about(&self, statement: &Statement, attribute: Option<&str>) -> bool {
        let names_it = match attribute {
            None => self.attributes.is_empty(),
            Some(attribute) => self.attributes.is_empty() || self.values().any(|(name, _)| name == attribute),
        };
        names_it && statement.is_or_defaults(self.element)
    }
}
