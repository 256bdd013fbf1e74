//! Which parts are one object.

use super::relation::{Border, Part, Relations};

/// A part with a smaller share of its neighbour's cells is given back to it.
const SMALL: f64 = 0.15;
/// Share below which a part is given back that does not rest on a level face, such as the neck of a bottle.
const SMALL_SLOPED: f64 = 0.2;
/// Links of the border of such a part, as a share of the side of a square with its cells.
const SMALL_BORDER: f64 = 0.7;
/// Length of a border, in the same measure, that is too long for two objects.
const LONG_BORDER: f64 = 1.6;
/// Length of a border, in the same measure, of a valley.
const VALLEY_BORDER: f64 = 0.6;
/// A part with a larger share of its neighbour's cells is not held by it.
const HELD: f64 = 0.5;
/// Length of a border, in the same measure, that holds a part in the air.
const HOLDING_BORDER: f64 = 0.25;
/// Cosine between the vertical and the normals beside a valley.
const VALLEY_UP: f64 = 0.5;
/// Share of a part in the convex hull of the other.
const INSIDE: f64 = 0.6;
/// Share of a part's lower end in the air, from which the neighbour must hold it.
const HANGING: f64 = 0.35;
/// Largest share of such a part's lower end on the plane, and on other parts.
const RESTING: f64 = 0.15;
/// Cosine between the vertical and the normal of a face that carries something.
const CARRYING: f64 = 0.75;
/// Cosine between the vertical and the normal of a face that rises from it.
const RISING: f64 = 0.25;
/// Largest cosine of the angle between both: 70 degrees.
const RIGHT_ANGLE: f64 = 0.342;

/// Joins parts of one object, the smallest first. Returns the part that each part belongs to.
pub(super) fn join_parts(relations: &mut Relations, least: usize) -> Vec<u32> {
    let mut owners: Vec<u32> = (0..relations.parts.len() as u32).collect();
    loop {
        let candidates = relations.borders.iter().filter_map(|((a, b), border)| {
            let pair = if relations.parts[*a as usize].cells < relations.parts[*b as usize].cells {
                [*b, *a]
            } else {
                [*a, *b]
            };
            let cells = relations.parts[pair[1] as usize].cells;
            is_one(relations, pair, border, least).then_some((cells, std::cmp::Reverse(border.links), pair))
        });
        let Some((_, _, pair)) = candidates.min() else { return owners };
        relations.join(pair);
        owners.iter_mut().filter(|owner| **owner == pair[1]).for_each(|owner| *owner = pair[0]);
    }
}

/// Whether a larger part and a smaller one, which share a border, are one object.
fn is_one(relations: &Relations, [large, small]: [u32; 2], border: &Border, least: usize) -> bool {
    let [whole, part] = [large, small].map(|part| &relations.parts[part as usize]);
    if part.cells < least {
        return true;
    }
    let length = border.links as f64 / (part.cells as f64).sqrt();
    let upward = border.upward.map(|sum| f64::from(sum) / border.links as f64);
    let (lowest, highest) = (upward[0].min(upward[1]), upward[0].max(upward[1]));
    let cosine = f64::from(border.cosines) / border.concave.max(1) as f64;
    // A wall on a level face: one object may rest on the other.
    let stands = highest > CARRYING && lowest < RISING && cosine < RIGHT_ANGLE;
    let share = part.cells as f64 / whole.cells as f64;
    share < if stands { SMALL } else { SMALL_SLOPED } && length > SMALL_BORDER
        || length > LONG_BORDER && !stands
        || length > VALLEY_BORDER && lowest > VALLEY_UP
        || share < HELD && length > HOLDING_BORDER && hangs(part) && !stands
        || relations.inside(small, large) > INSIDE
}

/// Whether a part ends in the air, so that its neighbour must hold it.
fn hangs(part: &Part) -> bool {
    let share = |cells: usize| cells as f64 / part.below.total().max(1) as f64;
    share(part.below.air) > HANGING
        && share(part.below.table) < RESTING
        && share(part.below.parts.values().sum()) < RESTING
}
