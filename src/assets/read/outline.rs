//! The outline of a face in its plane, with the effects of rounding undone.

use std::collections::BTreeMap;

use super::delaunay::{Fault, Side};

/// The outline of a face.
pub(super) struct Outline {
    /// Vertex of each point.
    pub(super) vertices: Vec<u32>,
    /// Positions in the plane, in its unit.
    pub(super) points: Vec<[f64; 2]>,
    sides: Sides,
}

/// Cuts per point, on average: an outline that needs more is dust.
const MAX_CUTS: usize = 16;

impl Outline {
    /// The outline that runs through some points in turn.
    pub(super) fn through(path: &[u32], vertices: Vec<u32>, points: Vec<[f64; 2]>) -> Self {
        let mut sides = Sides { times: BTreeMap::new(), at_point: vec![0; points.len()] };
        path.iter().zip(path.iter().skip(1).chain(path.first())).for_each(|(from, to)| sides.add([*from, *to], 1));
        Self { vertices, points, sides }
    }

    /// Sides that the outline runs along more often one way than the other, in rising order of their ends.
    pub(super) fn sides(&self) -> Vec<Side> {
        self.sides.times.iter().map(|(ends, times)| Side { ends: *ends, times: *times }).collect()
    }

    /// Cuts sides that pass within `reach` of a point of the outline in two at that point, so that parts that touch
    /// except for rounding touch exactly. If the outline then runs along a side in both directions, the side is
    /// removed.
    ///
    /// Where another face shares a side, that face ends in the side uncut: between it and its parts are thin triangles, which
    /// are returned. `is_shared` tells so of two vertices.
    ///
    /// # Errors
    /// When most points are nearly on most sides.
    pub(super) fn settle(&mut self, reach: f64, is_shared: impl Fn(u32, u32) -> bool) -> Result<Vec<[u32; 3]>, Fault> {
        let tree = Tree::of(&self.points);
        let vertex = |point: u32| self.vertices[point as usize];
        // Sides to look at, each with whether another face shares it, or a thin triangle.
        let mut waiting: Vec<([u32; 2], bool)> =
            self.sides.times.keys().map(|&[from, to]| ([from, to], is_shared(vertex(from), vertex(to)))).collect();
        let (mut thin, mut cuts) = (Vec::new(), 0);
        while let Some((ends, shared)) = waiting.pop() {
            let Some(&times) = self.sides.times.get(&ends) else { continue };
            let mut between = tree.beside(ends, reach);
            between.retain(|(_, point)| self.sides.at_point[*point as usize] > 0);
            if between.is_empty() {
                continue;
            }
            cuts += between.len();
            if cuts > MAX_CUTS * self.points.len() {
                return Err(Fault::Dust);
            }
            // From the first end to the second, in the order along the side.
            between.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
            let [from, to] = ends;
            let way: Vec<u32> =
                [from].into_iter().chain(between.into_iter().map(|(_, point)| point)).chain([to]).collect();
            self.sides.add(ends, -times);
            for part in way.windows(2) {
                self.sides.add([part[0], part[1]], times);
                waiting.push(([part[0].min(part[1]), part[0].max(part[1])], shared));
            }
            if shared {
                let fan = way[1..].windows(2).map(|step| [from, step[1], step[0]]);
                let facing = fan.map(|[a, b, c]| if times > 0 { [a, b, c] } else { [a, c, b] });
                thin.extend(facing.collect::<Vec<_>>().repeat(times.unsigned_abs() as usize));
            }
        }
        Ok(thin)
    }
}

/// Sides of an outline, with how often it runs along each.
struct Sides {
    /// Ends, the lower first, and how often the outline runs from the lower to the higher, less how often it runs back; not 0.
    times: BTreeMap<[u32; 2], i32>,
    /// Sides that end in each point.
    at_point: Vec<u32>,
}

impl Sides {
    /// Adds runs from one point to another.
    fn add(&mut self, [from, to]: [u32; 2], times: i32) {
        let (ends, times) = if from < to { ([from, to], times) } else { ([to, from], -times) };
        let sum = self.times.get(&ends).map_or(0, |known| *known);
        match (sum, sum + times) {
            (0, 0) => {}
            (0, new) => {
                self.times.insert(ends, new);
                ends.iter().for_each(|end| self.at_point[*end as usize] += 1);
            }
            (_, 0) => {
                self.times.remove(&ends);
                ends.iter().for_each(|end| self.at_point[*end as usize] -= 1);
            }
            (_, new) => _ = self.times.insert(ends, new),
        }
    }
}

/// Points of a plane in a binary tree: the middle one of a range splits the others of it by one coordinate, those of the halves by
/// the other one, in turn (Bentley 1975, "Multidimensional binary search trees used for associative searching").
struct Tree<'a> {
    points: &'a [[f64; 2]],
    order: Vec<u32>,
}

/// A side for which points are searched.
struct Search {
    ends: [u32; 2],
    from: [f64; 2],
    way: [f64; 2],
    length: f64,
    reach: f64,
    /// Points within reach, each with how far along the side it is.
    found: Vec<(f64, u32)>,
}

impl<'a> Tree<'a> {
    fn of(points: &'a [[f64; 2]]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        split(points, &mut order, 0);
        Self { points, order }
    }

    /// Points within `reach` of a side, between its ends, each with how far along the side it is.
    fn beside(&self, ends: [u32; 2], reach: f64) -> Vec<(f64, u32)> {
        let [from, to] = ends.map(|end| self.points[end as usize]);
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = libm::sqrt(way[0] * way[0] + way[1] * way[1]);
        let mut search = Search { ends, from, way, length, reach, found: Vec::new() };
        self.visit(&self.order, 0, [from, to], &mut search);
        search.found
    }

    /// Searches a range for points near a part of the side, all that may be near it in this range.
    fn visit(&self, range: &[u32], axis: usize, part: [[f64; 2]; 2], search: &mut Search) {
        let (lower, rest) = range.split_at(range.len() / 2);
        let Some((&middle, upper)) = rest.split_first() else { return };
        search.judge(middle, self.points[middle as usize]);
        let border = self.points[middle as usize][axis];
        // Twice the reach, so that rounding loses nothing.
        if let Some(part) = clipped(part, axis, border + 2.0 * search.reach, 1.0) {
            self.visit(lower, 1 - axis, part, search);
        }
        if let Some(part) = clipped(part, axis, border - 2.0 * search.reach, -1.0) {
            self.visit(upper, 1 - axis, part, search);
        }
    }
}

impl Search {
    fn judge(&mut self, point: u32, at: [f64; 2]) {
        let apart = [0, 1].map(|axis| at[axis] - self.from[axis]);
        let along = (apart[0] * self.way[0] + apart[1] * self.way[1]) / self.length;
        let across = (apart[0] * self.way[1] - apart[1] * self.way[0]) / self.length;
        if libm::fabs(across) <= self.reach && along > 0.0 && along < self.length && !self.ends.contains(&point) {
            self.found.push((along, point));
        }
    }
}

/// Orders a range of points as in a [`Tree`].
fn split(points: &[[f64; 2]], order: &mut [u32], axis: usize) {
    if order.len() < 2 {
        return;
    }
    let middle = order.len() / 2;
    let key = |point: &u32| points[*point as usize][axis];
    order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    let (lower, upper) = order.split_at_mut(middle);
    split(points, lower, 1 - axis);
    split(points, &mut upper[1..], 1 - axis);
}

/// The part of a line from one point to another whose coordinate along an axis, times `sign`, is at most `limit` times `sign`.
fn clipped([a, b]: [[f64; 2]; 2], axis: usize, limit: f64, sign: f64) -> Option<[[f64; 2]; 2]> {
    let [beyond_a, beyond_b] = [a, b].map(|end| sign * (end[axis] - limit));
    let crossing = || {
        let share = beyond_a / (beyond_a - beyond_b);
        [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis]))
    };
    match (beyond_a > 0.0, beyond_b > 0.0) {
        (true, true) => None,
        (false, false) => Some([a, b]),
        (true, false) => Some([crossing(), b]),
        (false, true) => Some([a, crossing()]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An outline through points, each a separate point.
    fn outline(points: &[[f64; 2]]) -> Outline {
        let path: Vec<u32> = (0..points.len() as u32).collect();
        Outline::through(&path, path.clone(), points.to_vec())
    }

    #[test]
    fn the_tree_finds_the_points_that_comparing_all_finds() {
        let mut state = 5_u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX)
        };
        // Half of them in a corner, as of a part with fine detail.
        let points: Vec<[f64; 2]> = (0..300)
            .map(|index| [draw(), draw()].map(|part| if index % 2 == 0 { part } else { 0.01 * part }))
            .collect();
        let tree = Tree::of(&points);
        let mut found = 0;
        for (from, to) in (0..300).zip((0..300).rev()).filter(|(from, to)| from != to) {
            for reach in [1e-9, 1e-3, 0.05] {
                let mut near: Vec<u32> = tree.beside([from, to], reach).into_iter().map(|(_, point)| point).collect();
                near.sort_unstable();
                let ends = [from, to].map(|end| points[end as usize]);
                let way = [0, 1].map(|axis| ends[1][axis] - ends[0][axis]);
                let length = libm::hypot(way[0], way[1]);
                let is_near = |point: &u32| {
                    let apart = [0, 1].map(|axis| points[*point as usize][axis] - ends[0][axis]);
                    let along = (apart[0] * way[0] + apart[1] * way[1]) / length;
                    let across = (apart[0] * way[1] - apart[1] * way[0]) / length;
                    ![from, to].contains(point) && libm::fabs(across) <= reach && along > 0.0 && along < length
                };
                let all: Vec<u32> = (0..300).filter(is_near).collect();
                assert_eq!(near, all, "{from} {to} {reach}");
                found += all.len();
            }
        }
        assert!(found > 1000, "{found}");
    }

    #[test]
    fn an_outline_of_dust_is_refused() {
        let comb: Vec<[f64; 2]> = (0..400)
            .map(|step| [f64::from(step), if step % 4 < 2 { 0.0 } else { 10.0 }])
            .chain([[400.0, -10.0], [0.0, -10.0]])
            .collect();
        assert_eq!(outline(&comb).settle(0.1, |_, _| true), Ok(vec![]));
        // To and fro within reach of a line, past a third of the corners with each side.
        let dust: Vec<[f64; 2]> =
            (0..401).map(|step| [f64::from(149 * step % 401), 0.1 * f64::from(step % 2)]).collect();
        assert_eq!(outline(&dust).settle(1.0, |_, _| true), Err(Fault::Dust));
    }
}
