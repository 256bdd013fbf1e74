//! Distances to a triangle mesh on a lattice, as bounds that hold between its points.

use nalgebra::{Point3, Vector3};

use super::{
    boxes::BoxTree,
    near::Points,
    parts::Bounds,
    triangle::{Triangle, bounds_of},
};

/// Points of a lattice, about; a large body has more, so that its spacing stays under the greatest, but no more than the
/// greatest count.
const POINTS: [f64; 2] = [120_000.0, 4_000_000.0];
/// Least and greatest spacing [m].
const SPACINGS: [f64; 2] = [0.003, 0.012];
/// Bound on the error of storing a distance as `f32` [m].
const ROUNDING: f64 = 1e-6;

/// Exact distances at the points of a lattice over a mesh's box. A point's distance binds those around it, since a
/// distance changes by no more than one goes.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    low: Point3<f64>,
    high: Point3<f64>,
    spacing: f64,
    inverse_spacing: f64,
    counts: [usize; 3],
    /// Distance to the surface [m], negative where no path leads out of the mesh. C order over x, y, z.
    distances: Vec<f32>,
}

impl Lattice {
    /// Builds the lattice from triangles with their boxes.
    pub fn new(triangles: &[Triangle], boxes: &BoxTree) -> Self {
        let Bounds { low, high } = bounds_of(triangles);
        let sides: Vector3<f64> = high - low;
        let spacing = POINTS.map(|points| libm::cbrt(sides.product().max(1e-12) / points));
        let spacing = spacing[0].clamp(SPACINGS[0], SPACINGS[1]).max(spacing[1]);
        let counts = std::array::from_fn(|axis| (sides[axis] / spacing).ceil() as usize + 1);
        let mut lattice = Self {
            low,
            high,
            spacing,
            inverse_spacing: 1.0 / spacing,
            counts,
            distances: vec![0.0; counts.iter().product()],
        };
        lattice.fill(boxes);
        lattice.find_inside(boxes);
        lattice
    }

    /// From signed distances [m] at points in C order that are `spacing` apart [m] and begin at `low`; they must enclose the
    /// surface.
    pub fn of_distances(low: Point3<f64>, spacing: f64, counts: [usize; 3], distances: Vec<f32>) -> Self {
        assert_eq!(distances.len(), counts.iter().product::<usize>(), "a lattice is full");
        let high = low + Vector3::from(counts.map(|count| (count - 1) as f64 * spacing));
        Self { low, high, spacing, inverse_spacing: 1.0 / spacing, counts, distances }
    }

    /// The distance of every point. That of the one before it in its row, or in its layer where a row begins, bounds it.
    fn fill(&mut self, boxes: &BoxTree) {
        let rows = self.counts[0] * self.counts[1];
        let mut at_row = f64::INFINITY;
        for row in 0..rows {
            let [x, y] = [row / self.counts[1], row % self.counts[1]];
            if y == 0 {
                at_row = f64::INFINITY;
            }
            let mut limit = at_row;
            for z in 0..self.counts[2] {
                let nearest = boxes.squared_distance_within(&self.point([x, y, z]), limit * limit).sqrt();
                let index = self.index([x, y, z]);
                self.distances[index] = nearest as f32;
                limit = nearest + self.spacing + ROUNDING;
                if z == 0 {
                    at_row = limit;
                }
            }
        }
    }

    /// Reverses the sign of every point that cannot be reached from the box's faces: from a point to its neighbour leads a path
    /// when the balls of free space around both overlap, so that no gap narrower than the spacing lets anything in. Points
    /// so near the surface that no path leads to them are on the side of a neighbour in sight, outside if both sides are.
    fn find_inside(&mut self, boxes: &BoxTree) {
        // Path between neighbours: the two balls of free space overlap.
        let free = |a: usize, b: usize| {
            f64::from(self.distances[a]) + f64::from(self.distances[b]) > self.spacing + 2.0 * ROUNDING
        };
        let in_sight = |a: usize, b: usize| !boxes.crosses(&self.point(self.cell_of(a)), &self.point(self.cell_of(b)));
        // A point of the outermost layer is outside when its ball of free space sticks out of the box.
        let sticks_out = |index: usize| {
            let cell = self.cell_of(index);
            let point = self.point(cell);
            let to_face = (0..3).map(|axis| (point[axis] - self.low[axis]).min(self.high[axis] - point[axis]));
            let outermost = (0..3).any(|axis| cell[axis] == 0 || cell[axis] + 1 == self.counts[axis]);
            outermost && f64::from(self.distances[index]) > to_face.fold(f64::INFINITY, f64::min) + ROUNDING
        };
        let indices = 0..self.distances.len();
        let mut outside: Vec<bool> = indices.clone().map(sticks_out).collect();
        // Flood fill of the free space from the faces of the box.
        self.flood(&mut outside, free);
        // Points that were not reached may still be outside, but not with a ball of a whole spacing around them.
        let deep = |index: usize| f64::from(self.distances[index]) > self.spacing + ROUNDING && !outside[index];
        let mut inside: Vec<bool> = indices.map(deep).collect();
        self.flood(&mut inside, free);
        // Points near the surface take the side of a neighbour in sight; the outside is flooded first.
        self.flood(&mut outside, |a, b| !inside[b] && in_sight(a, b));
        self.flood(&mut inside, |a, b| !outside[b] && in_sight(a, b));
        for (distance, inside) in self.distances.iter_mut().zip(inside) {
            if inside {
                *distance = -*distance;
            }
        }
    }

    /// Reaches from all that is reached every neighbour to which a path leads, and so on.
    fn flood(&self, reached: &mut [bool], leads: impl Fn(usize, usize) -> bool) {
        let strides = [self.counts[1] * self.counts[2], self.counts[2], 1];
        let mut open: Vec<usize> = (0..reached.len()).filter(|index| reached[*index]).collect();
        while let Some(index) = open.pop() {
            let cell = self.cell_of(index);
            for axis in 0..3 {
                let before = (cell[axis] > 0).then(|| index - strides[axis]);
                let after = (cell[axis] + 1 < self.counts[axis]).then(|| index + strides[axis]);
                for next in before.into_iter().chain(after) {
                    if !reached[next] && leads(index, next) {
                        reached[next] = true;
                        open.push(next);
                    }
                }
            }
        }
    }

    fn cell_of(&self, index: usize) -> [usize; 3] {
        let [_, ny, nz] = self.counts;
        [index / (ny * nz), index / nz % ny, index % nz]
    }

    fn point(&self, cell: [usize; 3]) -> Point3<f64> {
        self.low + Vector3::from(cell.map(|index| index as f64 * self.spacing))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.counts[1] + y) * self.counts[2] + z
    }

    /// Lattice data for a kernel: all points, or every `step`-th of them.
    pub fn points(&self, step: usize) -> Points {
        let counts = self.counts.map(|count| (count - 1) / step + 1);
        let mut distances = Vec::with_capacity(counts.iter().product());
        for x in 0..counts[0] {
            for y in 0..counts[1] {
                let row = (0..counts[2]).map(|z| self.distances[self.index([x * step, y * step, z * step])]);
                distances.extend(row);
            }
        }
        Points::new(self.low, self.high, self.spacing * step as f64, counts, distances, ROUNDING)
    }

    /// Bounds at a point: a lower bound of the distance to the surface, and an upper bound of the signed distance [m].
    #[inline]
    pub fn bounds(&self, point: &Point3<f64>) -> (f64, f64) {
        let (stored, offset) = self.nearest(point);
        let beyond = (self.low - point).sup(&(point - self.high)).sup(&Vector3::zeros()).norm();
        (beyond.max(stored.abs() - offset), stored + offset)
    }

    /// Upper bound of the distance to the surface at a point, on either side [m].
    pub fn distance_at_most(&self, point: &Point3<f64>) -> f64 {
        let (stored, offset) = self.nearest(point);
        stored.abs() + offset
    }

    /// Distance stored at the nearest lattice point, and the distance to that point [m].
    #[inline]
    fn nearest(&self, point: &Point3<f64>) -> (f64, f64) {
        let cell = self.cell(point);
        let stored = f64::from(self.distances[self.index(cell)]);
        let beside = self.steps(point) - Vector3::from(cell.map(|index| index as f64));
        (stored, beside.norm() * self.spacing + ROUNDING)
    }

    /// From the lattice's first point [steps].
    #[inline]
    fn steps(&self, point: &Point3<f64>) -> Vector3<f64> {
        (point - self.low) * self.inverse_spacing
    }

    /// Whether a point whose distance to the surface is known [m] is inside for certain: no surface lies between it and a
    /// lattice point that is.
    pub fn is_inside(&self, point: &Point3<f64>, distance: f64) -> bool {
        let (stored, offset) = self.nearest(point);
        stored < 0.0 && offset < distance - stored
    }

    /// The lattice points around a point, two to each side, that are inside.
    pub fn inside_near(&self, point: &Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
        let cell = self.cell(point);
        let near = move |axis: usize| cell[axis].saturating_sub(2)..(cell[axis] + 3).min(self.counts[axis]);
        near(0)
            .flat_map(move |x| near(1).flat_map(move |y| near(2).map(move |z| [x, y, z])))
            .filter(|cell| self.distances[self.index(*cell)] < 0.0)
            .map(|cell| self.point(cell))
    }

    /// The lattice point nearest to a point.
    #[inline]
    pub fn cell(&self, point: &Point3<f64>) -> [usize; 3] {
        let steps = self.steps(point);
        std::array::from_fn(|axis| ((steps[axis] + 0.5).max(0.0) as usize).min(self.counts[axis] - 1))
    }

    /// Climbs from a lattice point to one where `height` of (point, signed distance at most [m]) is greatest among its
    /// neighbours, or more than `enough`; the height there, and the point.
    pub fn climb(
        &self,
        mut cell: [usize; 3],
        enough: f64,
        height: impl Fn(&Point3<f64>, f64) -> f64,
    ) -> (f64, Point3<f64>) {
        let at = |cell: [usize; 3]| {
            let point = self.point(cell);
            (height(&point, f64::from(self.distances[self.index(cell)]) + ROUNDING), point)
        };
        let mut best = at(cell);
        // Steepest ascent over the six neighbours.
        while best.0 <= enough {
            let mut next = None;
            for axis in 0..3 {
                for forward in [true, false] {
                    let mut beside = cell;
                    beside[axis] = beside[axis].wrapping_add(if forward { 1 } else { usize::MAX });
                    if beside[axis] < self.counts[axis] {
                        let found = at(beside);
                        if found.0 > best.0 {
                            (best, next) = (found, Some(beside));
                        }
                    }
                }
            }
            match next {
                Some(beside) => cell = beside,
                None => break,
            }
        }
        best
    }

    /// Every lattice point that is known to be inside, with its depth [m].
    pub fn inside(&self) -> impl Iterator<Item = (Point3<f64>, f64)> {
        let negative = self.distances.iter().enumerate().filter(|(_, distance)| **distance < 0.0);
        negative.map(|(index, distance)| (self.point(self.cell_of(index)), -f64::from(*distance) - ROUNDING))
    }
}
