//! Parts between concave edges.

use super::grid::{Cell, Grid, Surface};

/// Number of no part.
pub(super) const NONE: u32 = u32::MAX;
/// Cosine of a cell in no concave edge.
pub(super) const UNCUT: f32 = 2.0;
/// Cells whose distance exceeds this share of their depth and [`REACH`] are not compared.
const REACH_SHARE: f32 = 0.06;
/// See [`REACH_SHARE`] [m].
const REACH: f32 = 0.01;

/// Cells joined to those at their right and below them: columns to the right and rows down, 0 for none.
pub(super) struct Links {
    pub right: Vec<u8>,
    pub down: Vec<u8>,
    /// Columns to the left: links to the right, backwards.
    pub left: Vec<u8>,
    /// Rows up: links down, backwards.
    pub up: Vec<u8>,
}

impl Links {
    /// Joins each object's cell to the next one in its row and in its column, across cells without a return, if their points are
    /// at most `gap` apart [m].
    pub fn new(grid: &Grid, gap: f32) -> Self {
        let count = grid.kinds.len();
        let mut links = Self { right: vec![0; count], down: vec![0; count], left: vec![0; count], up: vec![0; count] };
        for cell in grid.objects.iter().map(|cell| *cell as usize) {
            if let Some(steps) = next(grid, cell, 1, gap) {
                links.right[cell] = steps;
                links.left[cell + usize::from(steps)] = steps;
            }
            if let Some(steps) = next(grid, cell, grid.stride, gap) {
                links.down[cell] = steps;
                links.up[cell + usize::from(steps) * grid.stride] = steps;
            }
        }
        links
    }

    /// Cells that a cell is joined to.
    pub fn around(&self, cell: usize, stride: usize) -> [Option<usize>; 4] {
        let at = |steps: u8, side: usize| (steps > 0).then_some(usize::from(steps) * side);
        [
            at(self.left[cell], 1).map(|far| cell - far),
            at(self.right[cell], 1).map(|far| cell + far),
            at(self.up[cell], stride).map(|far| cell - far),
            at(self.down[cell], stride).map(|far| cell + far),
        ]
    }
}

/// Steps to the cell that a cell is joined to in a direction; `None` if there is none.
fn next(grid: &Grid, cell: usize, beside: usize, gap: f32) -> Option<u8> {
    let steps = (1..=grid.hole + 1)
        .find(|steps| grid.kinds.get(cell + steps * beside).is_none_or(|kind| *kind != Cell::Empty))?;
    let other = cell + steps * beside;
    let joined = grid.kinds.get(other) == Some(&Cell::Object)
        && (grid.point(cell) - grid.point(other)).norm_squared() <= gap * gap;
    joined.then_some(steps as u8)
}

/// Cosine of the angle between the normals on both sides of each cell in a concave edge of an angle with a smaller cosine than
/// this; [`UNCUT`] elsewhere.
pub(super) fn concave_cells(grid: &Grid, surface: &Surface, cosine: f32) -> Vec<f32> {
    let mut found = vec![UNCUT; grid.kinds.len()];
    let step = grid.step;
    for apart in [step, step * grid.stride, step * grid.stride + step, step * grid.stride - step] {
        for run in &grid.runs {
            let [before, after] = [run.start - apart, run.start + apart].map(|start| start..start + run.len());
            let points = surface.points.each_ref().map(|values| [&values[before.clone()], &values[after.clone()]]);
            let normals = surface.normals.each_ref().map(|values| [&values[before.clone()], &values[after.clone()]]);
            for (index, cosine_here) in found[run.clone()].iter_mut().enumerate() {
                // The surface is concave where the normals face each other: (n1 - n2) . (p1 - p2) < 0 (Stein et al. 2014, eq. 2).
                let (mut facing, mut cosine_between, mut square) = (0.0, 0.0, 0.0);
                for ([p1, p2], [n1, n2]) in points.iter().zip(&normals) {
                    let (apart, [n1, n2]) = (p1[index] - p2[index], [n1[index], n2[index]]);
                    facing += (n1 - n2) * apart;
                    cosine_between += n1 * n2;
                    square += apart * apart;
                }
                let reach = REACH_SHARE * points[2][0][index] + REACH;
                let is_cut = (facing < 0.0)
                    & (cosine_between < cosine)
                    & (square < reach * reach)
                    & (cosine_between < *cosine_here);
                *cosine_here = if is_cut { cosine_between } else { *cosine_here };
            }
        }
    }
    found
}

/// The part of each cell, from 0 in order of the first cell, and the count of parts. Joined cells that are not cut are a seed if
/// they are at least `least`, seeds grow over the cuts, and joined cells that no seed reaches are a part of their own.
pub(super) fn divide(grid: &Grid, links: &Links, cuts: &[f32], least: usize) -> (Vec<u32>, u32) {
    let mut parts = vec![NONE; grid.kinds.len()];
    let mut count = 0;
    let mut front = Vec::new();
    let mut members = Vec::new();
    let mut tried = vec![false; grid.kinds.len()];
    // Seeds.
    for cell in grid.objects.iter().map(|cell| *cell as usize) {
        if tried[cell] || cuts[cell] != UNCUT {
            continue;
        }
        flood(grid, links, cell, &mut tried, &mut members, |other| cuts[other] == UNCUT);
        if members.len() >= least {
            members.iter().for_each(|member| parts[*member] = count);
            front.extend_from_slice(&members);
            count += 1;
        }
    }
    // Growth in rings: each cell goes to the nearest seed by count of steps, of equal ones to the first.
    front.sort_unstable();
    while !front.is_empty() {
        let mut ring = Vec::new();
        for cell in front {
            for other in links.around(cell, grid.stride).into_iter().flatten() {
                if parts[other] == NONE {
                    parts[other] = parts[cell];
                    ring.push(other);
                }
            }
        }
        front = ring;
    }
    // The rest.
    let mut tried: Vec<bool> = parts.iter().map(|part| *part != NONE).collect();
    for cell in grid.objects.iter().map(|cell| *cell as usize) {
        if !tried[cell] {
            flood(grid, links, cell, &mut tried, &mut members, |_| true);
            members.iter().for_each(|member| parts[*member] = count);
            count += 1;
        }
    }
    (parts, count)
}

/// Cells that hang together with the first, which becomes the first of the members.
fn flood(
    grid: &Grid,
    links: &Links,
    first: usize,
    tried: &mut [bool],
    members: &mut Vec<usize>,
    belongs: impl Fn(usize) -> bool,
) {
    members.clear();
    members.push(first);
    tried[first] = true;
    let mut at = 0;
    while at < members.len() {
        for other in links.around(members[at], grid.stride).into_iter().flatten() {
            if !tried[other] && belongs(other) {
                tried[other] = true;
                members.push(other);
            }
        }
        at += 1;
    }
}
