//! One sample: a network's inputs and its prediction.

use std::fmt;

use surface::CubeField;

/// A network's input, in the order of networks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum InputName {
    /// Cells that contain an observed point: 1, all others 0.
    Partial,
    /// Cells that the camera sees through: 1, all others 0.
    Free,
    /// Cells that were touched: 1, all others 0.
    Touch,
}

/// Grids of one sample in the camera's frame, one number per cell; grids that the model does not use are not read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Inputs<'a> {
    /// Cells that contain an observed point.
    pub partial: Option<&'a CubeField>,
    /// Cells that the camera sees through.
    pub free: Option<&'a CubeField>,
    /// Cells that were touched.
    pub touch: Option<&'a CubeField>,
}

/// A network's prediction for one sample, of class `inferred`.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Probability that the object touches the cell.
    pub occupancy: CubeField,
    /// Expected solid share of the cell; `None` for a network without that output, such as the thesis's.
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

    /// Finds an input by its name in files; `None` for any other text.
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
    /// Returns one of the inputs.
    pub fn get(&self, name: InputName) -> Option<&'a CubeField> {
        match name {
            InputName::Partial => self.partial,
            InputName::Free => self.free,
            InputName::Touch => self.touch,
        }
    }
}
