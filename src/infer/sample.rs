//! One sample: a network's inputs and its answer.

use std::fmt;

use surface::CubeField;

/// A network's input, in the order in which networks take them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InputName {
    /// Cells that hold a seen point: 1, all others 0.
    Partial,
    /// Cells that the camera sees through: 1, all others 0.
    Free,
    /// Cells that were touched: 1, all others 0.
    Touch,
}

/// Grids of one sample in the camera's frame, a number per cell; those that the model does not name are not read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// Cells that hold a seen point.
    pub partial: Option<&'a CubeField>,
    /// Cells that the camera sees through.
    pub free: Option<&'a CubeField>,
    /// Cells that were touched.
    pub touch: Option<&'a CubeField>,
}

/// A network's answer about one sample, of class `inferred`.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Probability that the object touches the cell.
    pub occupancy: CubeField,
    /// Expected share of the cell that is solid; `None` from a network without that output, as the thesis's.
    pub coverage: Option<CubeField>,
}

impl InputName {
    /// All inputs, in order.
    pub const ALL: [Self; 3] = [Self::Partial, Self::Free, Self::Touch];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Partial => "partial",
            Self::Free => "free",
            Self::Touch => "touch",
        }
    }

    /// The input of a name in files; `None` for any other text.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|input| input.name() == name)
    }
}

impl fmt::Display for InputName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl<'a> Inputs<'a> {
    /// One of the inputs.
    pub fn get(&self, name: InputName) -> Option<&'a CubeField> {
        match name {
            InputName::Partial => self.partial,
            InputName::Free => self.free,
            InputName::Touch => self.touch,
        }
    }
}
