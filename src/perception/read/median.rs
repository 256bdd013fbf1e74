//! Whether depths are those of objects on a table, and what would make them so.

use super::raw::FrameProblem;

/// Nearest and farthest median depth of a picture of objects on a table [m].
const MEDIAN_RANGE: [f64; 2] = [0.1, 10.0];
/// Metres per unit that depth is commonly stored in.
const COMMON_SCALES: [f64; 6] = [1.0, 0.001, 0.0002, 0.00025, 0.0001, 0.01];
/// Share of all depths above which the largest value is hardly one that was measured.
const SATURATED_SHARE: f64 = 0.05;
/// Ratio to the median of the others from which it is far from them.
const SATURATED_RATIO: f64 = 3.0;

/// Refuses depths [m] whose median is no table's; `scale` is the unit that they were read in [m]. NaN is no return.
pub(super) fn check_median(depth: &[f32], scale: f64) -> Result<(), FrameProblem> {
    let mut returns: Vec<f32> = depth.iter().copied().filter(|depth| !depth.is_nan()).collect();
    match median_of(&mut returns) {
        Some(median) if !fits(median) => Err(FrameProblem::Median { median, remedy: remedy(&returns, median, scale) }),
        Some(_) => Ok(()),
        None => Err(FrameProblem::Empty),
    }
}

fn fits(median: f64) -> bool {
    (MEDIAN_RANGE[0]..=MEDIAN_RANGE[1]).contains(&median)
}

fn median_of(depths: &mut [f32]) -> Option<f64> {
    let middle = depths.len() / 2;
    if depths.is_empty() { None } else { Some(f64::from(*depths.select_nth_unstable_by(middle, f32::total_cmp).1)) }
}

/// A change that makes depths with this median plausible: another unit, or no return instead of the largest value, or both. Each
/// is tried here.
fn remedy(depths: &[f32], median: f64, scale: f64) -> String {
    let unit_that_fits = |median: f64| COMMON_SCALES.into_iter().find(|unit| fits(median / scale * unit));
    let saturated = saturated(depths);
    let (median, advice) = match &saturated {
        Some((median, words)) if fits(*median) => return words.clone(),
        Some((median, words)) => (*median, format!("{words}, and ")),
        None => (median, String::new()),
    };
    match unit_that_fits(median) {
        Some(unit) => format!("{advice}in units of {unit} m it would fit: give --depth-scale {unit}"),
        None => format!("{advice}no common unit would fit: give --depth-scale with the metres per unit of this file"),
    }
}

/// Where the largest value is that of a good part of the pixels and far from all others, hardly one that was measured: the median of
/// these others [m], and what to do.
fn saturated(depths: &[f32]) -> Option<(f64, String)> {
    let largest = depths.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mut others: Vec<f32> = depths.iter().copied().filter(|depth| *depth < largest).collect();
    let share = 1.0 - others.len() as f64 / depths.len().max(1) as f64;
    let median = median_of(&mut others)?;
    let is_far = f64::from(largest) > SATURATED_RATIO * median;
    let words = format!(
        "{:.0} % of the depths are {largest} m, the largest: if that is no return, save 0 there",
        100.0 * share
    );
    (share >= SATURATED_SHARE && is_far).then_some((median, words))
}
