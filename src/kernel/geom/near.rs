//! Points that are equal except for rounding.

use std::collections::HashMap;

use super::Sets;

/// Pairs of points that may be compared: some seconds.
const MAX_PAIRS: u64 = 200_000_000;

/// Cells of the search are this many reaches wide: most points are near no border of theirs.
const CELL: f64 = 4.0;

/// Bits of a cell's number along an axis.
const CELL_BITS: u32 = 21;

/// Per point, the lowest index of its group. Two points belong to one group if they are no farther apart than the reach
/// of either, `reaches`, or if both belong to a group with a third.
///
/// A group wider along an axis than twice the longest reach in it is split, because its points have no position in
/// common: each becomes a group by itself. Only positions and reaches determine the groups, not the order of the
/// points. `None` if too many points are too close together to compare them.
pub fn near_groups(points: &[[f64; 3]], reaches: &[f64]) -> Option<Vec<u32>> {
    let longest = reaches.iter().copied().fold(0.0, f64::max);
    if longest <= 0.0 {
        return Some((0..points.len() as u32).collect());
    }
    let cells = Cells::of(points, CELL * longest);
    let mut sets = Sets::new(points.len());
    let mut pairs = 0;
    for (place, &(_, point)) in cells.members.iter().enumerate() {
        let (at, reach) = (points[point as usize], reaches[point as usize]);
        for cell in cells.around(at, reach) {
            // Each pair once: only members further on in the order of the cells.
            let others = cells.range(cell);
            let others = others.start.max(place + 1)..others.end.max(place + 1);
            pairs += others.len() as u64;
            if pairs > MAX_PAIRS {
                return None;
            }
            for &(_, other) in &cells.members[others] {
                let reach = reach.min(reaches[other as usize]);
                if distance_squared(at, points[other as usize]) <= reach * reach {
                    sets.unite(point, other);
                }
            }
        }
    }
    let mut roots: Vec<u32> = (0..points.len() as u32).map(|point| sets.root(point)).collect();
    break_chains(points, reaches, &mut roots);
    Some(roots)
}

/// Lowest and highest coordinates of a group, and its longest reach.
struct Extent {
    low: [f64; 3],
    high: [f64; 3],
    reach: f64,
}

/// Takes the groups apart that are wider than twice their longest reach.
fn break_chains(points: &[[f64; 3]], reaches: &[f64], roots: &mut [u32]) {
    // Groups of several points, by their roots.
    let mut extents: HashMap<u32, Extent> = HashMap::new();
    for (point, &root) in roots.iter().enumerate().filter(|(point, root)| *point as u32 != **root) {
        let first = root as usize;
        let extent =
            extents.entry(root).or_insert(Extent { low: points[first], high: points[first], reach: reaches[first] });
        extent.reach = extent.reach.max(reaches[point]);
        for (axis, coordinate) in points[point].into_iter().enumerate() {
            extent.low[axis] = extent.low[axis].min(coordinate);
            extent.high[axis] = extent.high[axis].max(coordinate);
        }
    }
    let is_chain = |Extent { low, high, reach }: &Extent| (0..3).any(|axis| high[axis] - low[axis] > 2.0 * reach);
    for (point, root) in roots.iter_mut().enumerate() {
        if extents.get(root).is_some_and(is_chain) {
            *root = point as u32;
        }
    }
}

fn distance_squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| a[axis] - b[axis]).map(|apart| apart * apart).sum()
}

/// Points by the cubic cells that they are in.
struct Cells {
    lower: [f64; 3],
    side: f64,
    /// Cell and index of each point, by cell and then by index.
    members: Vec<(u64, u32)>,
    /// Where each occupied cell begins and ends among the members.
    ranges: HashMap<u64, (u32, u32)>,
}

impl Cells {
    fn of(points: &[[f64; 3]], side: f64) -> Self {
        let lower =
            points.iter().fold([f64::INFINITY; 3], |low, point| std::array::from_fn(|axis| low[axis].min(point[axis])));
        let mut cells = Self { lower, side, members: Vec::new(), ranges: HashMap::new() };
        cells.members = points.iter().zip(0..).map(|(point, index)| (cells.cell(*point), index)).collect();
        cells.members.sort_unstable();
        let mut start = 0;
        for cell in cells.members.chunk_by(|a, b| a.0 == b.0) {
            let end = start + cell.len() as u32;
            cells.ranges.insert(cell[0].0, (start, end));
            start = end;
        }
        cells
    }

    /// Number of a cell. Points beyond the last cell count to it.
    fn cell(&self, point: [f64; 3]) -> u64 {
        (0..3).fold(0, |number, axis| number << CELL_BITS | self.along(axis, point[axis]))
    }

    fn along(&self, axis: usize, coordinate: f64) -> u64 {
        // A cast cuts off at 0.
        (((coordinate - self.lower[axis]) / self.side) as u64).min((1 << CELL_BITS) - 1)
    }

    /// The cells within `reach` of a point.
    fn around(&self, point: [f64; 3], reach: f64) -> impl Iterator<Item = u64> + use<> {
        let [x, y, z] =
            [0, 1, 2].map(|axis| self.along(axis, point[axis] - reach)..=self.along(axis, point[axis] + reach));
        x.flat_map(move |x| {
            let z = z.clone();
            y.clone().flat_map(move |y| z.clone().map(move |z| (x << CELL_BITS | y) << CELL_BITS | z))
        })
    }

    fn range(&self, cell: u64) -> std::ops::Range<usize> {
        self.ranges.get(&cell).map_or(0..0, |&(start, end)| start as usize..end as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a lattice of steps of 1, each with three others within 0.4 of it.
    fn quartets(draw: &mut impl FnMut() -> f64) -> Vec<[f64; 3]> {
        let lattice = (0..1000_u32).map(|index| [index % 10, index / 10 % 10, index / 100].map(f64::from));
        let mut points = Vec::new();
        for place in lattice {
            points.extend((0..4).map(|_| place.map(|coordinate| coordinate + 0.4 * (draw() - 0.5))));
        }
        points
    }

    #[test]
    fn groups_are_those_that_comparing_all_pairs_finds_in_any_order() {
        let mut state = 1_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let points = quartets(&mut draw);
        let reach = 0.15;
        let groups = near_groups(&points, &vec![reach; points.len()]).expect("few pairs");
        // By comparing all pairs.
        let mut sets = Sets::new(points.len());
        for one in 0..points.len() {
            for other in one + 1..points.len() {
                if distance_squared(points[one], points[other]) <= reach * reach {
                    sets.unite(one as u32, other as u32);
                }
            }
        }
        let mut joined = 0;
        for point in 0..points.len() as u32 {
            let root = sets.root(point);
            let members: Vec<u32> = (0..points.len() as u32).filter(|other| sets.root(*other) == root).collect();
            let wide = (0..3).any(|axis| {
                let along = members.iter().map(|member| points[*member as usize][axis]);
                along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min) > 2.0 * reach
            });
            assert_eq!(groups[point as usize], if wide { point } else { root }, "point {point}");
            joined += usize::from(groups[point as usize] != point);
        }
        assert!(joined > 500, "{joined}");
        // The last first.
        let last = points.len() - 1;
        let reversed: Vec<[f64; 3]> = points.iter().rev().copied().collect();
        let back = near_groups(&reversed, &vec![reach; points.len()]).expect("few pairs");
        for one in 0..points.len() {
            for other in (one + 1..points.len()).take(8) {
                assert_eq!(groups[one] == groups[other], back[last - one] == back[last - other], "{one} {other}");
            }
        }
    }

    #[test]
    fn a_chain_of_points_is_no_group() {
        let chain: Vec<[f64; 3]> = (0..100).map(|step| [0.9 * f64::from(step), 0.0, 0.0]).collect();
        assert_eq!(near_groups(&chain, &[1.0; 100]), Some((0..100).collect()));
        assert_eq!(near_groups(&chain[..3], &[1.0; 3]), Some(vec![0, 0, 0]));
        // The first reaches less far than the second is away.
        assert_eq!(near_groups(&chain[..3], &[0.5, 1.0, 1.0]), Some(vec![0, 1, 1]));
    }

    #[test]
    fn a_crowd_within_the_reach_is_given_up() {
        let crowd: Vec<[f64; 3]> = (0..30_000).map(|index| [1e-6 * f64::from(index), 0.0, 0.0]).collect();
        assert_eq!(near_groups(&crowd, &[1.0; 30_000]), None);
    }
}
