//! Parts, the borders between them, and how each part rests.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::{
    cut::{Links, NONE, UNCUT},
    grid::{Cell, Grid, Surface, height},
};
use crate::{frame::DepthFrame, plane::Plane};

/// Lower ends of parts up to this height above the plane rest on it [m].
const AT_TABLE: f32 = 0.018;
/// Points of two parts up to this far apart touch [m].
const TOUCHING: f32 = 0.02;
/// Cells below the lower end of a part that are looked at.
const BELOW: i32 = 3;
/// A point up to this far outside the hull of a part counts as inside [m].
const HULL: f32 = 0.003;
/// Cells of a part per sample that is kept.
const SAMPLING: usize = 5;

/// A part of the picture: a piece with no concave edge, or several that were joined.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    /// Count of its cells.
    pub cells: usize,
    /// Cells at its lower end, by what is below them.
    pub below: Below,
    /// Some of its points [m].
    samples: Vec<Vector3<f32>>,
    /// Largest coordinate of its samples along each direction of [`directions`] [m].
    reach: Vec<f32>,
}

/// Count of cells at the lower end of a part, by what is below them.
#[derive(Clone, Debug, Default)]
pub(super) struct Below {
    /// The plane.
    pub table: usize,
    /// A farther surface: the part ends in the air.
    pub air: usize,
    /// Another part that touches it, by number.
    pub parts: BTreeMap<u32, usize>,
    /// A nearer surface or no return: the end of the part is not seen.
    pub hidden: usize,
}

/// The border between two parts: links whose ends lie in one each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Border {
    /// Count of the links.
    pub links: usize,
    /// Links at a concave edge.
    pub concave: usize,
    /// Sum of the cosines of the angle between the normals on both sides, over concave links.
    pub cosines: f32,
    /// Sum of the cosine between the normal and the vertical beside each link, in the first and in the second part.
    pub upward: [f32; 2],
}

/// All parts with their borders, by the numbers of the two parts, the smaller one first.
pub(super) struct Relations {
    pub parts: Vec<Part>,
    pub borders: BTreeMap<(u32, u32), Border>,
    directions: Vec<Vector3<f32>>,
}

impl Below {
    /// Count of all cells.
    pub fn total(&self) -> usize {
        self.table + self.air + self.hidden + self.parts.values().sum::<usize>()
    }
}

impl Relations {
    /// Parts and borders of a grid whose cells have a part each, or [`NONE`].
    pub fn new(seen: &Seen<'_>, cuts: &[f32], parts: &[u32], count: u32) -> Self {
        let directions = directions();
        let empty = Part { reach: vec![f32::NEG_INFINITY; directions.len()], ..Part::default() };
        let mut relations = Self { parts: vec![empty; count as usize], borders: BTreeMap::new(), directions };
        let Seen { grid, surface, links, .. } = seen;
        for cell in grid.objects.iter().map(|cell| *cell as usize).filter(|cell| parts[*cell] != NONE) {
            relations.add_cell(parts[cell], &surface.point(cell));
            for (steps, side) in [(links.right[cell], 1), (links.down[cell], grid.stride)] {
                let other = cell + usize::from(steps) * side;
                if parts[other] != parts[cell] && parts[other] != NONE {
                    relations.add_link(seen, cuts, parts, [cell, other], side * grid.step);
                }
            }
            if let Some(below) = seen.below(cell, parts) {
                let counts = &mut relations.parts[parts[cell] as usize].below;
                match below {
                    Neighbour::Table => counts.table += 1,
                    Neighbour::Air => counts.air += 1,
                    Neighbour::Part(part) => *counts.parts.entry(part).or_default() += 1,
                    Neighbour::Hidden => counts.hidden += 1,
                }
            }
        }
        relations
    }

    fn add_cell(&mut self, part: u32, point: &Vector3<f32>) {
        let part = &mut self.parts[part as usize];
        if part.cells.is_multiple_of(SAMPLING) {
            part.samples.push(*point);
            for (reach, direction) in part.reach.iter_mut().zip(&self.directions) {
                *reach = reach.max(direction.dot(point));
            }
        }
        part.cells += 1;
    }

    fn add_link(&mut self, seen: &Seen<'_>, cuts: &[f32], parts: &[u32], cells: [usize; 2], away: usize) {
        let [a, b] = cells.map(|cell| parts[cell]);
        let border = self.borders.entry((a.min(b), a.max(b))).or_default();
        border.links += 1;
        let cosine = cuts[cells[0]].min(cuts[cells[1]]);
        if cosine != UNCUT {
            border.concave += 1;
            border.cosines += cosine;
        }
        // Normals at some distance from the edge, where no window reaches over it.
        for (part, beside) in [(a, cells[0].checked_sub(away)), (b, Some(cells[1] + away))] {
            let upward = beside.filter(|cell| parts.get(*cell) == Some(&part)).map(|cell| {
                let normal = seen.surface.normal(cell);
                if normal.x.is_nan() { 0.0 } else { normal.dot(&seen.up) }
            });
            border.upward[usize::from(part == a.max(b))] += upward.unwrap_or(0.0);
        }
    }

    /// Share of a part's samples in the convex hull of another, whose outer bound is its reach along 98 directions.
    pub fn inside(&self, part: u32, other: u32) -> f64 {
        let (part, other) = (&self.parts[part as usize], &self.parts[other as usize]);
        let is_inside = |point: &&Vector3<f32>| {
            self.directions.iter().zip(&other.reach).all(|(direction, reach)| direction.dot(point) <= reach + HULL)
        };
        part.samples.iter().filter(is_inside).count() as f64 / part.samples.len().max(1) as f64
    }

    /// Joins the second part to the first; the second stays without cells and borders.
    pub fn join(&mut self, [kept, joined]: [u32; 2]) {
        let part = std::mem::take(&mut self.parts[joined as usize]);
        let into = &mut self.parts[kept as usize];
        into.cells += part.cells;
        into.samples.extend(part.samples);
        into.reach.iter_mut().zip(&part.reach).for_each(|(reach, other)| *reach = reach.max(*other));
        into.below.table += part.below.table;
        into.below.air += part.below.air;
        into.below.hidden += part.below.hidden;
        for (other, cells) in part.below.parts {
            *into.below.parts.entry(other).or_default() += cells;
        }
        into.below.parts.remove(&joined);
        into.below.parts.remove(&kept);
        for other in &mut self.parts {
            if let Some(cells) = other.below.parts.remove(&joined) {
                *other.below.parts.entry(kept).or_default() += cells;
            }
        }
        let touched: Vec<(u32, u32)> =
            self.borders.keys().copied().filter(|(a, b)| [*a, *b].contains(&joined)).collect();
        for (a, b) in touched {
            let border = self.borders.remove(&(a, b)).expect("a key of the map");
            let other = if a == joined { b } else { a };
            if other == kept {
                continue;
            }
            let upward_of = |part: u32| border.upward[usize::from(part == b)];
            let into = self.borders.entry((kept.min(other), kept.max(other))).or_default();
            into.links += border.links;
            into.concave += border.concave;
            into.cosines += border.cosines;
            into.upward[usize::from(kept > other)] += upward_of(joined);
            into.upward[usize::from(other > kept)] += upward_of(other);
        }
    }
}

/// The picture as parts see it.
pub(super) struct Seen<'a> {
    pub frame: &'a DepthFrame,
    pub plane: Option<&'a Plane>,
    pub grid: &'a Grid,
    pub surface: &'a Surface,
    pub links: &'a Links,
    /// Unit vector against gravity, in `CameraCv`.
    pub up: Vector3<f32>,
}

/// Surface below the lower end of a part.
enum Neighbour {
    Table,
    Air,
    Part(u32),
    Hidden,
}

impl Seen<'_> {
    /// The surface below a cell in the picture; `None` inside the cell's part.
    fn below(&self, cell: usize, parts: &[u32]) -> Option<Neighbour> {
        let point = self.grid.point(cell);
        // Direction of gravity in the picture, as steps of at most one pixel: the derivative of the projection.
        let camera = &self.frame.camera;
        let along = camera.fx as f32 * (self.up.z * point.x / point.z - self.up.x);
        let down = camera.fy as f32 * (self.up.z * point.y / point.z - self.up.y);
        let longest = along.abs().max(down.abs()).max(f32::MIN_POSITIVE);
        let at = |steps: i32| {
            let [columns, rows] = [along, down].map(|part| (part / longest * steps as f32).round() as isize);
            cell.checked_add_signed(rows * self.grid.stride as isize + columns).filter(|other| *other < parts.len())
        };
        let is_low = || self.plane.is_some_and(|plane| height(plane, &point) < AT_TABLE);
        for other in (1..=BELOW).map_while(at) {
            match self.grid.kinds[other] {
                Cell::Empty => {}
                Cell::Other => return Some(if is_low() { Neighbour::Table } else { Neighbour::Air }),
                Cell::Object if parts[other] == parts[cell] => return None,
                Cell::Object => {
                    let apart = self.grid.point(other) - point;
                    return Some(match parts[other] {
                        part if part != NONE && apart.norm_squared() < TOUCHING * TOUCHING => Neighbour::Part(part),
                        _ if apart.z < 0.0 => Neighbour::Hidden,
                        _ if is_low() => Neighbour::Table,
                        _ => Neighbour::Air,
                    });
                }
            }
        }
        Some(Neighbour::Hidden)
    }
}

/// Unit vectors to the points of a cube's surface with 5 x 5 points per face: 98 directions.
fn directions() -> Vec<Vector3<f32>> {
    let range = || -2_i8..=2;
    let all = range().flat_map(|x| range().flat_map(move |y| range().map(move |z| [x, y, z])));
    let outer = all.filter(|point| point.iter().any(|value| value.abs() == 2));
    outer.map(|point| Vector3::from(point.map(f32::from)).normalize()).collect()
}
