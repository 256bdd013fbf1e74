//! The keys of grids and truth, which every product of pairs has.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use form::Checker;
use kernel::voxel::Truth;

/// The occupancy grids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Cells along each axis.
    #[schemars(range(min = 1, max = 128))]
    pub resolution: u32,
    /// Quirk of the thesis: cells with index 0 on any axis are dropped from both grids.
    pub drop_index_zero: bool,
}

/// Rule for the occupied cells of the complete grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TruthSpec {
    /// The rule.
    pub rule: TruthRule,
    /// With `rule = "fraction"`: smallest share of the cell that is solid.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [0.5]), range(max = 1))]
    pub fraction: Option<f64>,
    /// Quirk of the thesis: the 256^3 solid also contains every cell that the surface crosses, as in binvox.
    pub solid_with_surface: bool,
}

/// A rule of the complete grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TruthRule {
    /// The closed cell meets the solid: the surface passes through it or its centre is inside. Every partial grid is
    /// then contained in its complete grid.
    AnyOverlap,
    /// The cell's centre is inside the solid.
    Centre,
    /// At least the share `fraction` of the cell is solid.
    Fraction,
    /// Quirk of the thesis: the lower corner of an occupied cell of the 256^3 solid falls into the cell.
    LowerCorners,
}

impl TruthSpec {
    /// The rule; mistakes are reported.
    pub fn check(&self, checker: &mut Checker) -> Truth {
        let rule = self.rule;
        if self.fraction.is_some() && rule != TruthRule::Fraction {
            checker.contradiction("truth.fraction", "truth.rule", "only the rule \"fraction\" has a fraction");
        }
        match (rule, self.fraction) {
            (TruthRule::AnyOverlap, _) => Truth::AnyOverlap,
            (TruthRule::Centre, _) => Truth::Centre,
            (TruthRule::LowerCorners, _) => Truth::LowerCorners,
            (TruthRule::Fraction, Some(fraction)) => Truth::Fraction(fraction),
            (TruthRule::Fraction, None) => {
                checker.missing("truth.fraction", "the smallest share of a cell that is solid, above 0 to 1");
                Truth::Fraction(0.5)
            }
        }
    }

    /// Keys of a rule and of a solid.
    pub fn from_truth(truth: Truth, solid_with_surface: bool) -> Self {
        let (rule, fraction) = match truth {
            Truth::AnyOverlap => (TruthRule::AnyOverlap, None),
            Truth::Centre => (TruthRule::Centre, None),
            Truth::Fraction(fraction) => (TruthRule::Fraction, Some(fraction)),
            Truth::LowerCorners => (TruthRule::LowerCorners, None),
        };
        Self { rule, fraction, solid_with_surface }
    }
}
