//! Bodies packed around the middle of a table: each at the free position that is closest to the middle, by outlines.
//!
//! An outline is a convex polygon around the shadow of a body, with sides in fixed directions. Two outlines keep their
//! distance if a point is outside a polygon of the same directions: their Minkowski sum (Lozano-Pérez 1983, "Spatial
//! planning: a configuration space approach"). So the free positions of a body are the plane without one such polygon
//! per earlier body. The closest of them is on a side of one polygon, next to the middle, or where sides of two meet,
//! or where a side meets the limit of the table.

use std::{array, f64::consts::FRAC_PI_2};

use nalgebra::{Point3, Rotation3};

/// Sides of an outline, a multiple of four. More would move round bodies of 10 cm closer together by less than half a
/// millimetre.
const SIDES: usize = 32;

/// Room between two outlines, at least [m].
const APART: f64 = 0.005;

/// Depth by which a position on a side may be inside a polygon by rounding [m].
const ROUNDING: f64 = 1e-9;

/// A convex polygon around the shadow of a body on the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Middle of the box around the shadow, where the body's own origin is at 0 [m].
    middle: [f64; 2],
    /// Distance of each side from the middle, outward in the directions of [`directions`] [m].
    sides: [f64; SIDES],
}

/// A table on which bodies are packed.
#[derive(Clone, Debug)]
pub(super) struct PackedTable {
    size: [f64; 2],
    directions: [[f64; 2]; SIDES],
    /// Outlines with the positions of their middles.
    taken: Vec<([f64; 2], Outline)>,
}

/// A side of a polygon that contains no middle: the half-plane `normal . position < offset` [m] belongs to it.
#[derive(Clone, Copy)]
struct Side {
    normal: [f64; 2],
    offset: f64,
}

/// Outward directions of the sides: quarters are exact.
fn directions() -> [[f64; 2]; SIDES] {
    const QUARTER: usize = SIDES / 4;
    array::from_fn(|index| {
        let angle = FRAC_PI_2 * (index % QUARTER) as f64 / QUARTER as f64;
        let [x, y] = [libm::cos(angle), libm::sin(angle)];
        match index / QUARTER {
            0 => [x, y],
            1 => [-y, x],
            2 => [-x, -y],
            _ => [y, -x],
        }
    })
}

fn dot(one: [f64; 2], other: [f64; 2]) -> f64 {
    one[0] * other[0] + one[1] * other[1]
}

impl Outline {
    /// The outline of a body with these corners of its convex hull [m].
    pub fn new(corners: &[Point3<f64>], rotation: &Rotation3<f64>) -> Self {
        let corners: Vec<[f64; 2]> = corners
            .iter()
            .map(|corner| {
                let corner = rotation * corner.coords;
                [corner.x, corner.y]
            })
            .collect();
        let farthest = |direction: [f64; 2]| {
            corners.iter().map(|corner| dot(*corner, direction)).fold(f64::NEG_INFINITY, f64::max)
        };
        let directions = directions();
        let far = directions.map(farthest);
        let middle = [0, SIDES / 4].map(|right| f64::midpoint(far[right], -far[right + SIDES / 2]));
        Self { middle, sides: array::from_fn(|index| far[index] - dot(middle, directions[index])) }
    }

    /// Sum of the distances of all sides from the middle [m], which grows with the outline's circumference.
    pub fn size(&self) -> f64 {
        self.sides.iter().sum()
    }

    /// Distance of the opposite side from the middle [m].
    fn opposite(&self, index: usize) -> f64 {
        self.sides[(index + SIDES / 2) % SIDES]
    }
}

impl PackedTable {
    /// An empty table of these sides [m].
    pub fn new(size: [f64; 2]) -> Self {
        Self { size, directions: directions(), taken: Vec::new() }
    }

    /// Takes the free position of a body that is closest to the middle of the table: position of the body's origin along x and y
    /// [m], `None` where no position is free.
    pub fn take(&mut self, outline: &Outline) -> Option<[f64; 2]> {
        let position = self.closest(outline)?;
        self.taken.push((position, *outline));
        Some([0, 1].map(|axis| position[axis] - outline.middle[axis]))
    }

    /// Free position of an outline's middle that is closest to the table's.
    fn closest(&self, outline: &Outline) -> Option<[f64; 2]> {
        // The whole outline is on the table.
        let limits = [0, 1].map(|axis| self.size[axis] / 2.0 - outline.sides[axis * SIDES / 4]);
        if limits.iter().any(|limit| *limit < 0.0) {
            return None;
        }
        let polygons: Vec<[Side; SIDES]> = self.taken.iter().map(|other| self.polygon(outline, other)).collect();
        let is_free = |position: [f64; 2]| {
            let is_on_table = (0..2).all(|axis| position[axis].abs() <= limits[axis] + ROUNDING);
            let is_beyond = |side: &Side| dot(side.normal, position) >= side.offset - ROUNDING;
            is_on_table && polygons.iter().all(|polygon| polygon.iter().any(is_beyond))
        };
        let mut best: Option<(f64, [f64; 2])> = None;
        let mut consider = |position: [f64; 2]| {
            let squared = dot(position, position);
            if best.is_none_or(|(least, _)| squared < least) && is_free(position) {
                best = Some((squared, position));
            }
        };
        consider([0.0; 2]);
        // On one side, next to the middle.
        for side in polygons.iter().flatten() {
            consider(side.normal.map(|part| part * side.offset));
        }
        // Where two sides meet, or a side and the limit of the table.
        let limit = |normal: [f64; 2], axis: usize| Side { normal, offset: limits[axis] };
        let edges = [limit([1.0, 0.0], 0), limit([-1.0, 0.0], 0), limit([0.0, 1.0], 1), limit([0.0, -1.0], 1)];
        for (index, polygon) in polygons.iter().enumerate() {
            let others = polygons[..index].iter().flatten().chain(&edges);
            for other in others {
                polygon.iter().filter_map(|side| side.meets(other)).for_each(&mut consider);
            }
        }
        best.map(|(_, position)| position)
    }

    /// Polygon of the positions at which an outline would be too near to an earlier one.
    fn polygon(&self, outline: &Outline, (position, other): &([f64; 2], Outline)) -> [Side; SIDES] {
        array::from_fn(|index| {
            let normal = self.directions[index];
            let offset = dot(normal, *position) + other.sides[index] + outline.opposite(index) + APART;
            Side { normal, offset }
        })
    }
}

impl Side {
    /// The point on both lines; `None` where they are parallel.
    fn meets(&self, other: &Self) -> Option<[f64; 2]> {
        let ([a, b], [c, d]) = (self.normal, other.normal);
        let determinant = a * d - b * c;
        // Directions of two sides are equal, opposite, or apart by a fraction of a revolution.
        (determinant.abs() > ROUNDING).then(|| {
            let x = (self.offset * d - b * other.offset) / determinant;
            let y = (a * other.offset - self.offset * c) / determinant;
            [x, y]
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use kernel::seed::Stream;
    use nalgebra::Vector3;

    /// A box [m], rotated about the vertical.
    fn cuboid(sides: [f64; 2], yaw: f64) -> Outline {
        let corners: Vec<Point3<f64>> = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]
            .map(|[x, y]| Point3::new(x * sides[0] / 2.0 + 0.02, y * sides[1] / 2.0, 0.0))
            .to_vec();
        Outline::new(&corners, &Rotation3::from_axis_angle(&Vector3::z_axis(), yaw))
    }

    #[test]
    fn the_first_body_stands_in_the_middle_and_the_next_beside_it() {
        let mut table = PackedTable::new([0.6, 0.6]);
        // Corners are 2 cm off the origin of the body.
        let first = table.take(&cuboid([0.1, 0.1], 0.0)).expect("room");
        assert!((first[0] + 0.02).abs() < 1e-12 && first[1].abs() < 1e-12, "{first:?}");
        for _ in 0..4 {
            let [x, y] = table.take(&cuboid([0.1, 0.1], 0.0)).expect("room");
            let (x, y) = ((x + 0.02).abs(), y.abs());
            assert!((x.max(y) - 0.105).abs() < 1e-9 && x.min(y) < 1e-9, "{x} {y}");
        }
        // The corners are left.
        let [x, y] = table.take(&cuboid([0.1, 0.1], 0.0)).expect("room");
        assert!(((x + 0.02).abs() - 0.105).abs() < 1e-9 && (y.abs() - 0.105).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn a_full_table_has_no_room_and_a_body_larger_than_it_none_at_all() {
        let mut table = PackedTable::new([0.32, 0.32]);
        let taken = (0..20).map_while(|_| table.take(&cuboid([0.1, 0.1], 0.0))).count();
        assert_eq!(taken, 9);
        assert!(table.take(&cuboid([0.01, 0.01], 0.0)).is_none());
        assert!(PackedTable::new([0.32, 0.32]).take(&cuboid([0.33, 0.01], 0.0)).is_none());
        assert!(PackedTable::new([0.32, 0.32]).take(&cuboid([0.33, 0.01], 0.8)).is_some());
    }

    /// A search over a fine lattice finds no position that is closer by more than its cells.
    #[test]
    fn no_free_position_is_closer() {
        const CELL: f64 = 2e-3;
        let mut packed = 0;
        for seed in 0..4 {
            let mut stream = Stream::of_job(seed, b"", "packing");
            let size = [0.4, 0.3];
            let mut table = PackedTable::new(size);
            loop {
                let sides = [stream.uniform(0.03, 0.12), stream.uniform(0.03, 0.08)];
                let outline = cuboid(sides, stream.uniform(0.0, TAU));
                let found = table.closest(&outline);
                let gap = |position: [f64; 2]| {
                    let of = |(at, other): &([f64; 2], Outline)| {
                        let beyond = |index: usize| {
                            let apart = [0, 1].map(|axis| position[axis] - at[axis]);
                            dot(table.directions[index], apart) - other.sides[index] - outline.opposite(index)
                        };
                        (0..SIDES).map(beyond).fold(f64::NEG_INFINITY, f64::max)
                    };
                    table.taken.iter().map(of).fold(f64::INFINITY, f64::min)
                };
                let half = [0, 1].map(|axis| size[axis] / 2.0 - outline.sides[axis * SIDES / 4]);
                let cells = half.map(|half| (half / CELL).floor() as i32);
                let lattice = (-cells[0]..=cells[0])
                    .flat_map(|x| (-cells[1]..=cells[1]).map(move |y| [x, y].map(|index| f64::from(index) * CELL)));
                let free = lattice.filter(|position| gap(*position) >= APART);
                let best = free.map(|[x, y]| x.hypot(y)).fold(f64::INFINITY, f64::min);
                let Some(position) = found else {
                    assert_eq!(best, f64::INFINITY, "seed {seed}: room was left");
                    break;
                };
                assert!(gap(position) >= APART - 2.0 * ROUNDING, "seed {seed}: {}", gap(position));
                assert!(position[0].hypot(position[1]) <= best + ROUNDING, "seed {seed}: {position:?}, {best}");
                table.take(&outline).expect("room");
            }
            packed += table.taken.len();
        }
        assert!(packed >= 24, "{packed}");
    }

    #[test]
    fn an_outline_is_as_wide_as_its_body_and_hardly_wider_than_a_round_one() {
        let round: Vec<Point3<f64>> = (0..720)
            .map(|index| f64::from(index) * TAU / 720.0)
            .map(|angle| Point3::new(0.05 * angle.cos(), 0.05 * angle.sin(), 0.1))
            .collect();
        let outline = Outline::new(&round, &Rotation3::identity());
        // Corners of the polygon are farther from the middle than its sides by 1 / cos(half of a step of its directions).
        assert!(outline.sides.iter().all(|side| (side - 0.05).abs() < 1e-5), "{outline:?}");
        assert!(2.0 * 0.05 * (1.0 / (TAU / 2.0 / SIDES as f64).cos() - 1.0) < 0.5e-3);
    }
}
