//! `golden.npz`: samples with the results of the framework that trained the network.

use std::collections::BTreeMap;

use surface::CubeField;

use crate::{
    error::ModelProblem,
    folder::{OUTPUTS, RESOLUTION, Thresholds},
    npz,
    sample::{InputName, Inputs, Prediction},
};

/// Largest difference of a probability between the framework and this program.
pub const GOLDEN_TOLERANCE: f32 = 1e-4;
/// Distance from the threshold below which a cell's probability may be on either side.
const NEAR_THRESHOLD: f32 = 1e-5;

/// Agreement with the stored results.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct GoldenCheck {
    /// Count of samples.
    pub samples: usize,
    /// Largest difference in the probability of occupancy.
    pub occupancy: f32,
    /// Largest difference in coverage; 0 without that output.
    pub coverage: f32,
    /// Cells on a different side of the occupancy threshold, except those within 1e-5 of it.
    pub other_cells: usize,
}

/// A sample with its result.
pub(crate) struct GoldenSample {
    inputs: BTreeMap<InputName, CubeField>,
    occupancy: CubeField,
    coverage: Option<CubeField>,
}

pub(crate) struct GoldenSamples {
    pub(crate) samples: Vec<GoldenSample>,
}

impl GoldenSample {
    pub(crate) fn inputs(&self) -> Inputs<'_> {
        let get = |name| self.inputs.get(&name);
        Inputs { partial: get(InputName::Partial), free: get(InputName::Free), touch: get(InputName::Touch) }
    }
}

impl GoldenCheck {
    /// Whether every difference is small enough.
    pub fn agrees(&self) -> bool {
        self.samples > 0
            && self.occupancy <= GOLDEN_TOLERANCE
            && self.coverage <= GOLDEN_TOLERANCE
            && self.other_cells == 0
    }

    pub(crate) fn add(&mut self, sample: &GoldenSample, found: &Prediction, thresholds: &Thresholds) {
        self.samples += 1;
        let pairs = |wanted: &'_ CubeField, found: &'_ CubeField| -> Vec<(f32, f32)> {
            wanted.values().iter().copied().zip(found.values().iter().copied()).collect()
        };
        let largest = |pairs: &[(f32, f32)]| pairs.iter().map(|(a, b)| (a - b).abs()).fold(0.0_f32, f32::max);
        let occupancy = pairs(&sample.occupancy, &found.occupancy);
        self.occupancy = self.occupancy.max(largest(&occupancy));
        if let (Some(wanted), Some(found)) = (&sample.coverage, &found.coverage) {
            self.coverage = self.coverage.max(largest(&pairs(wanted, found)));
        }
        let threshold = thresholds.occupancy;
        let differs = |(wanted, found): &&(f32, f32)| {
            (*wanted > threshold) != (*found > threshold) && (wanted - threshold).abs() > NEAR_THRESHOLD
        };
        self.other_cells += occupancy.iter().filter(differs).count();
    }
}

impl GoldenSamples {
    /// Reads the samples: each array has the shape (samples, 1, n, n, n).
    pub(crate) fn parse(bytes: &[u8], inputs: &[InputName], outputs: &[String]) -> Result<Self, ModelProblem> {
        let wrong = |found: String| ModelProblem::Golden { found };
        let mut arrays = npz::parse(bytes).map_err(|found| wrong(found.to_owned()))?;
        let n = RESOLUTION as usize;
        let names: Vec<&str> =
            inputs.iter().map(|input| input.name()).chain(outputs.iter().map(String::as_str)).collect();
        if let Some(other) = arrays.keys().find(|name| !names.contains(&name.as_str())) {
            return Err(wrong(format!("the array '{other}' is not one of {}", names.join(", "))));
        }
        let mut fields: BTreeMap<&str, Vec<CubeField>> = BTreeMap::new();
        for name in names {
            let array = arrays.remove(name).ok_or_else(|| wrong(format!("the array '{name}' is missing")))?;
            let [_, 1, a, b, c] = array.shape[..] else {
                return Err(wrong(format!("'{name}' has the shape {:?}", array.shape)));
            };
            if [a, b, c] != [n; 3] || !array.values.iter().all(|value| value.is_finite()) {
                return Err(wrong(format!("'{name}' has the shape {:?}, or values that are not finite", array.shape)));
            }
            let of_sample = |values: &[f32]| CubeField::from_values(n, values.to_vec()).expect("a number per cell");
            fields.insert(name, array.values.chunks(n.pow(3)).map(of_sample).collect());
        }
        let count = fields[OUTPUTS[0]].len();
        if count == 0 || fields.values().any(|fields| fields.len() != count) {
            return Err(wrong("the arrays have no samples, or different numbers of samples".to_owned()));
        }
        // Starts with the last sample of each array, so that each grid is in memory once.
        let mut samples = Vec::with_capacity(count);
        let mut last = |name: &str| fields.get_mut(name).and_then(Vec::pop);
        for _ in 0..count {
            let own = inputs.iter().filter_map(|input| last(input.name()).map(|field| (*input, field))).collect();
            let Some(occupancy) = last(OUTPUTS[0]) else { break };
            samples.push(GoldenSample { inputs: own, occupancy, coverage: last(OUTPUTS[1]) });
        }
        samples.reverse();
        Ok(Self { samples })
    }
}
