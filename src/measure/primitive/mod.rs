//! The one ball, cylinder or box that explains best what was seen, by RANSAC (Fischler and Bolles 1981; minimal sets of
//! oriented points after Schnabel, Wahl and Klein 2007, "Efficient RANSAC for point-cloud shape detection").

mod draw;
mod evidence;
mod refine;
mod shape;

use kernel::geom::OccupancyGrid;
use kernel::seed::Stream;

pub use self::shape::Primitive;
use self::{draw::Kind, evidence::Evidence, refine::refined};
use crate::seen_cells::SeenCells;

/// Draws per kind of shape.
const DRAWS: usize = 300;
/// Times that the best shape of each kind is fitted anew to all points near it.
const REFINEMENTS: usize = 4;
/// Fewest points that a shape is searched for in.
const MIN_POINTS: usize = 20;
/// Share of the points that a shape must explain.
const MIN_SHARE: f64 = 0.3;

impl Primitive {
    /// The ball, cylinder or box with the best score: the count of seen points within 3 mm of its surface, less that of the cells
    /// more than a cell deep inside of it that the camera sees through, each of which counts as many points as a seen cell holds on
    /// average. `None`
    /// when fewer than 20 points have a normal, or no shape scores 30 % of the points. No shape is larger than the grid.
    pub fn fit(seen: &SeenCells<'_>) -> Option<Self> {
        if seen.points.len() < MIN_POINTS {
            return None;
        }
        let all = Evidence::new(seen);
        let some = all.thinned();
        let found = Kind::ALL.into_iter().filter_map(|kind| {
            let mut shape = best_drawn(kind, &some, seen)?;
            let mut score = all.score(&shape);
            for _ in 0..REFINEMENTS {
                let Some(better) = refined(&shape, seen.points) else { break };
                let better_score = all.score(&better);
                if !is_possible(&better, seen) || better_score < score {
                    break;
                }
                (shape, score) = (better, better_score);
            }
            Some((score, shape))
        });
        // The first of equal ones.
        let best = found.reduce(|best, other| if other.0 > best.0 { other } else { best });
        best.filter(|(score, _)| *score >= MIN_SHARE * seen.points.len() as f64).map(|(_, shape)| shape)
    }
}

/// The best of many shapes through points that were drawn.
fn best_drawn(kind: Kind, some: &Evidence<'_>, seen: &SeenCells<'_>) -> Option<Primitive> {
    let mut draw = Stream::of_job(0, b"", kind.stream());
    let mut best: Option<(f64, Primitive)> = None;
    for _ in 0..DRAWS {
        let mut pick = || &seen.points[draw.below(seen.points.len() as u64) as usize];
        let pair = [pick(), pick()];
        let shape = kind.through(pair, some.points(), seen.up().into());
        let Some(shape) = shape.filter(|shape| is_possible(shape, seen)) else { continue };
        let score = some.score(&shape);
        if best.is_none_or(|(most, _)| score > most) {
            best = Some((score, shape));
        }
    }
    best.map(|(_, shape)| shape)
}

/// Whether a shape is no larger than the grid.
fn is_possible(shape: &Primitive, seen: &SeenCells<'_>) -> bool {
    shape.extent() <= seen.placement.cell_size * f64::from(seen.placement.resolution)
}

/// Seen cells, and those whose centre lies in the shape that explains them best; none where no shape does.
pub(crate) fn filled_primitive(seen: &SeenCells<'_>) -> OccupancyGrid {
    let n = seen.placement.resolution;
    let Some(shape) = Primitive::fit(seen) else { return OccupancyGrid::new(n) };
    let mut complete = seen.partial.clone();
    for cell in (0..n.pow(3)).map(|at| [at / n / n, at / n % n, at % n]) {
        if shape.signed_distance(&evidence::centre_of(cell, seen.placement)) <= 0.0 {
            complete.set(cell);
        }
    }
    complete
}

#[cfg(test)]
mod tests;
