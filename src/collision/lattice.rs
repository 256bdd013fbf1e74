//! Distances to a triangle mesh on a lattice, as bounds that hold between its points.

use nalgebra::{Point3, Vector3};

use super::{
    boxes::BoxTree,
    triangle::{Triangle, bounds_of, squared_distance},
};

/// Points of a lattice, about; a large body has more, so that its spacing stays under the greatest, but no more than the
/// greatest count.
const POINTS: [f64; 2] = [120_000.0, 4_000_000.0];
/// Least and greatest spacing [m].
const SPACINGS: [f64; 2] = [0.003, 0.012];
/// What storing a distance as `f32` may cost, and more [m].
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
    /// Distance to the surface [m], negative where no way leads out of the mesh. C order over x, y, z.
    distances: Vec<f32>,
}

impl Lattice {
    /// Of triangles with their boxes.
    pub fn new(triangles: &[Triangle], boxes: &BoxTree) -> Self {
        let (low, high) = bounds_of(triangles);
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
        let side = counts.iter().max().copied().unwrap_or(1).next_power_of_two();
        lattice.fill(triangles, &(0..triangles.len() as u32).collect::<Vec<_>>(), [0; 3], side);
        lattice.find_inside(triangles, boxes);
        lattice
    }

    /// Distances of the block of `side`^3 points from `first`: the triangle that is nearest to any of its points is among
    /// those that are not much farther from its centre than the nearest one is.
    fn fill(&mut self, triangles: &[Triangle], near: &[u32], first: [usize; 3], side: usize) {
        if (0..3).any(|axis| first[axis] >= self.counts[axis]) {
            return;
        }
        if side == 1 {
            let point = self.point(first);
            let nearest = near.iter().map(|place| squared_distance(&point, &triangles[*place as usize]));
            let place = self.place(first);
            self.distances[place] = nearest.fold(f64::INFINITY, f64::min).sqrt() as f32;
            return;
        }
        let half = 0.5 * (side - 1) as f64 * self.spacing;
        let centre = self.point(first) + Vector3::repeat(half);
        let reach = half * 3f64.sqrt();
        let distances: Vec<f64> =
            near.iter().map(|place| squared_distance(&centre, &triangles[*place as usize]).sqrt()).collect();
        let limit = distances.iter().copied().fold(f64::INFINITY, f64::min) + 2.0 * reach + ROUNDING;
        let near: Vec<u32> =
            near.iter().zip(&distances).filter(|(_, d)| **d <= limit).map(|(place, _)| *place).collect();
        let step = side / 2;
        for octant in 0..8 {
            let corner = std::array::from_fn(|axis| first[axis] + step * (octant >> axis & 1));
            self.fill(triangles, &near, corner, step);
        }
    }

    /// Turns the sign of every point that cannot be reached from the box's faces: from a point to its neighbour leads a way
    /// when the balls of free space around both overlap, so that no gap narrower than the spacing lets anything in. Points
    /// so near the surface that no way leads to them are on the side of a neighbour in sight, outside if both sides are.
    fn find_inside(&mut self, triangles: &[Triangle], boxes: &BoxTree) {
        let free = |a: usize, b: usize| {
            f64::from(self.distances[a]) + f64::from(self.distances[b]) > self.spacing + 2.0 * ROUNDING
        };
        let in_sight =
            |a: usize, b: usize| !boxes.crosses(triangles, &self.point(self.cell_of(a)), &self.point(self.cell_of(b)));
        // A point of the outermost layer is outside when its ball of free space sticks out of the box.
        let sticks_out = |place: usize| {
            let cell = self.cell_of(place);
            let point = self.point(cell);
            let to_face = (0..3).map(|axis| (point[axis] - self.low[axis]).min(self.high[axis] - point[axis]));
            let outermost = (0..3).any(|axis| cell[axis] == 0 || cell[axis] + 1 == self.counts[axis]);
            outermost && f64::from(self.distances[place]) > to_face.fold(f64::INFINITY, f64::min) + ROUNDING
        };
        let places = 0..self.distances.len();
        let mut outside: Vec<bool> = places.clone().map(sticks_out).collect();
        self.flood(&mut outside, free);
        // What was not reached may be outside all the same, but not with a ball of a whole spacing around it.
        let deep = |place: usize| f64::from(self.distances[place]) > self.spacing + ROUNDING && !outside[place];
        let mut inside: Vec<bool> = places.map(deep).collect();
        self.flood(&mut inside, free);
        self.flood(&mut outside, |a, b| !inside[b] && in_sight(a, b));
        self.flood(&mut inside, |a, b| !outside[b] && in_sight(a, b));
        for (distance, inside) in self.distances.iter_mut().zip(inside) {
            if inside {
                *distance = -*distance;
            }
        }
    }

    /// Reaches from all that is reached every neighbour to which a way leads, and so on.
    fn flood(&self, reached: &mut [bool], leads: impl Fn(usize, usize) -> bool) {
        let strides = [self.counts[1] * self.counts[2], self.counts[2], 1];
        let mut open: Vec<usize> = (0..reached.len()).filter(|place| reached[*place]).collect();
        while let Some(place) = open.pop() {
            let cell = self.cell_of(place);
            for axis in 0..3 {
                let before = (cell[axis] > 0).then(|| place - strides[axis]);
                let after = (cell[axis] + 1 < self.counts[axis]).then(|| place + strides[axis]);
                for next in before.into_iter().chain(after) {
                    if !reached[next] && leads(place, next) {
                        reached[next] = true;
                        open.push(next);
                    }
                }
            }
        }
    }

    fn cell_of(&self, place: usize) -> [usize; 3] {
        let [_, ny, nz] = self.counts;
        [place / (ny * nz), place / nz % ny, place % nz]
    }

    fn point(&self, cell: [usize; 3]) -> Point3<f64> {
        self.low + Vector3::from(cell.map(|index| index as f64 * self.spacing))
    }

    fn place(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.counts[1] + y) * self.counts[2] + z
    }

    /// Bounds at a point: at least so far from the surface, and signed distance at most so much [m].
    #[inline]
    pub fn bounds(&self, point: &Point3<f64>) -> (f64, f64) {
        let (stored, offset) = self.nearest(point);
        let beyond = (self.low - point).sup(&(point - self.high)).sup(&Vector3::zeros()).norm();
        (beyond.max(stored.abs() - offset), stored + offset)
    }

    /// Whether the surface is certainly farther from a point than this [m].
    #[inline]
    pub fn is_farther(&self, point: &Point3<f64>, distance: f64) -> bool {
        let (stored, offset) = self.nearest(point);
        stored.abs() - offset > distance || {
            let beyond = (self.low - point).sup(&(point - self.high)).sup(&Vector3::zeros());
            beyond.norm_squared() > distance * distance
        }
    }

    /// What is stored at the nearest point of the lattice, and how far that is [m].
    #[inline]
    fn nearest(&self, point: &Point3<f64>) -> (f64, f64) {
        let cell = self.cell(point);
        let stored = f64::from(self.distances[self.place(cell)]);
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
            .filter(|cell| self.distances[self.place(*cell)] < 0.0)
            .map(|cell| self.point(cell))
    }

    /// The lattice point nearest to a point.
    #[inline]
    pub fn cell(&self, point: &Point3<f64>) -> [usize; 3] {
        let steps = self.steps(point);
        std::array::from_fn(|axis| ((steps[axis] + 0.5).max(0.0) as usize).min(self.counts[axis] - 1))
    }

    /// Climbs from a lattice point to one where `height` of (point, signed distance at most [m]) is greatest among its
    /// neighbours; the height there, and the point.
    pub fn climb(&self, mut cell: [usize; 3], height: impl Fn(&Point3<f64>, f64) -> f64) -> (f64, Point3<f64>) {
        let at = |cell: [usize; 3]| {
            let point = self.point(cell);
            (height(&point, f64::from(self.distances[self.place(cell)]) + ROUNDING), point)
        };
        let mut best = at(cell);
        loop {
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
                None => return best,
            }
        }
    }

    /// Every lattice point that is known to be inside, with its depth [m].
    pub fn inside(&self) -> impl Iterator<Item = (Point3<f64>, f64)> {
        let negative = self.distances.iter().enumerate().filter(|(_, distance)| **distance < 0.0);
        negative.map(|(place, distance)| (self.point(self.cell_of(place)), -f64::from(*distance) - ROUNDING))
    }
}
