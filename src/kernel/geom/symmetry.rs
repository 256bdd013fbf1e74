//! Symmetries of an object: rotations and reflections that map its surface onto itself within a tolerance.
//!
//! An axis of symmetry of a solid is a principal axis of its inertia, and a plane of symmetry is perpendicular to one.
//! If the three moments differ, three directions are tried; if two are alike, all directions of a plane; if all are
//! alike, all directions. A motion is accepted if all but one in fifty of a thousand points spread over the surface map
//! to within the tolerance of the surface: a dent of a scan or the tab of a can breaks no symmetry, the handle of a mug
//! does.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::{MassProperties, TriMesh, TriangleTree};

/// Symmetries of an object, in `Object`. All axes and planes go through one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetries {
    /// The point: the centre of mass of the solid [m].
    pub centre: Point3<f64>,
    /// Distance from the surface within which all but one mapped point in fifty must be [m].
    pub tolerance: f64,
    /// Axes of rotation by any angle: none, one, or for a ball three at right angles.
    pub continuous: Vec<Unit<Vector3<f64>>>,
    /// Axes of finite rotational symmetry, those of the highest order first. With a continuous axis, at most one of
    /// many equal ones, perpendicular to it.
    pub axes: Vec<SymmetryAxis>,
    /// Normals of planes of reflection. Planes through a continuous axis, which all are one, are left out.
    pub mirrors: Vec<Unit<Vector3<f64>>>,
}

/// An axis of rotation by a part of a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SymmetryAxis {
    /// Direction of the axis.
    pub direction: Unit<Vector3<f64>>,
    /// Rotations by 1/`order` of a full turn, and its multiples, are symmetries; at least 2.
    pub order: u32,
}

/// Points of the surface that a motion is tried with.
const POINTS: u32 = 1024;
/// Share of the points that may be farther off: the second number applies to the first few points, so that motions far
/// from a symmetry are rejected early.
const ASTRAY: [f64; 2] = [0.02, 0.125];
/// The first few points.
const FIRST_POINTS: usize = 32;
/// Highest order that is tested: at higher orders, within the tolerance, few bodies differ from round ones.
const MAX_ORDER: u32 = 12;
/// Moments of inertia nearer than this share of the largest count as alike.
const ALIKE: f64 = 0.1;
/// Angles by which a continuous axis is tried, evenly spread over half a turn.
const ANGLES: u32 = 36;
/// Directions tried in half a plane.
const IN_PLANE: u32 = 180;
/// Directions tried in half of space: 1.6 degrees apart.
const IN_SPACE: u32 = 8192;
/// Number of 64 directions about which half turns hold, from which on a body is nearly a ball; of an icosahedron about one does.
const FEW_OF_A_BALL: usize = 16;
/// Directions nearer than this are one axis [rad].
const ONE_AXIS: f64 = 0.15;
/// Halvings that find the end of the directions that hold.
const HALVINGS: u32 = 12;
/// Multiples of these modulo 1 spread over a cube from their beginning on: powers of the root of x^4 = x + 1 (Roberts 2018,
/// "The unreasonable effectiveness of quasirandom sequences").
const SPREAD: [f64; 3] = [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_2];

type Direction = Unit<Vector3<f64>>;

impl Symmetries {
    /// Tolerance, as a share of the diagonal of the object's box.
    pub const TOLERANCE: f64 = 0.02;

    /// Symmetries of a mesh, with its tree and the mass properties of its solid.
    pub fn from_mesh(mesh: &TriMesh, tree: &TriangleTree, mass: &MassProperties) -> Self {
        let diagonal = mesh.aabb().map_or(0.0, |bounds| (bounds.max - bounds.min).norm());
        let search = Search { tree, centre: mass.centre, tolerance: Self::TOLERANCE * diagonal, points: points(mesh) };
        let found = search.run(&mass.inertia);
        Self { centre: mass.centre, tolerance: search.tolerance, ..found }
    }

    /// Name of the group of its rotations, after Schoenflies: C1 for none, C and D with the order of the main axis, `inf` for a
    /// continuous one, T, O and I of a tetrahedron, a cube and an icosahedron, K of a ball.
    pub fn group(&self) -> String {
        let main = self.axes.first().map_or(1, |axis| axis.order);
        let of_main = self.axes.iter().filter(|axis| axis.order == main).count();
        match (self.continuous.len(), main, of_main) {
            (0, 5, 6) => "I".to_owned(),
            (0, 4, 3) => "O".to_owned(),
            (0, 3, 4) => "T".to_owned(),
            (0, ..) => format!("{}{main}", if self.axes.len() > 1 { "D" } else { "C" }),
            (1, ..) => if self.axes.is_empty() { "Cinf" } else { "Dinf" }.to_owned(),
            _ => "K".to_owned(),
        }
    }

    /// Every rotation of the group except the identity, about the origin; with a continuous axis, those that
    /// distinguish the others from its own.
    pub fn rotations(&self) -> Vec<Matrix3<f64>> {
        let of_axis = |axis: &SymmetryAxis| {
            let (direction, order) = (axis.direction, axis.order);
            (1..order).map(move |part| rotation(&direction, TAU * f64::from(part) / f64::from(order)))
        };
        self.axes.iter().flat_map(of_axis).collect()
    }
}

/// Points spread over the surface by area, in an order in which the first few are spread as well.
fn points(mesh: &TriMesh) -> Vec<Point3<f64>> {
    let mut sum = 0.0;
    let sums: Vec<f64> = (0..mesh.triangles.len())
        .map(|face| {
            let [a, b, c] = mesh.corners(face);
            sum += (b - a).cross(&(c - a)).norm();
            sum
        })
        .collect();
    let point = |number: u32| {
        let part = |axis: usize| (f64::from(number + 1) * SPREAD[axis]).fract();
        let face = sums.partition_point(|until| *until <= part(0) * sum).min(sums.len() - 1);
        let [a, b, c] = mesh.corners(face);
        let (u, v) = (part(1), part(2));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        a + (b - a) * u + (c - a) * v
    };
    (0..if sums.is_empty() { 0 } else { POINTS }).map(point).collect()
}

/// Rotation about a direction by an angle [rad], by Rodrigues' formula.
fn rotation(about: &Direction, angle: f64) -> Matrix3<f64> {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    Matrix3::identity() * cos + about.cross_matrix() * sin + about.into_inner() * about.transpose() * (1.0 - cos)
}

/// Half a turn about a direction.
fn half_turn(about: &Direction) -> Matrix3<f64> {
    about.into_inner() * about.transpose() * 2.0 - Matrix3::identity()
}

/// Reflection at the plane with a normal.
fn mirror(normal: &Direction) -> Matrix3<f64> {
    Matrix3::identity() - normal.into_inner() * normal.transpose() * 2.0
}

/// Two directions square to one and to each other.
fn square_to(direction: &Direction) -> [Direction; 2] {
    let smallest = direction.iamin();
    let first = Unit::new_normalize(direction.cross(&Vector3::ith(smallest, 1.0)));
    [first, Unit::new_normalize(direction.cross(&first))]
}

/// A direction or its opposite: that whose largest component is positive.
fn upright(direction: Direction) -> Direction {
    if direction[direction.iamax()] < 0.0 { -direction } else { direction }
}

/// Search for the motions that map a surface onto itself.
struct Search<'a> {
    tree: &'a TriangleTree,
    centre: Point3<f64>,
    tolerance: f64,
    points: Vec<Point3<f64>>,
}

/// Order of an axis.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Order {
    Parts(u32),
    Continuous,
}

impl Search<'_> {
    /// Whether a linear map about the centre leaves nearly every point within the tolerance of the surface.
    fn holds(&self, map: &Matrix3<f64>) -> bool {
        let bound = (self.tolerance * self.tolerance) as f32;
        let allowed = ASTRAY[0] * self.points.len() as f64;
        let mut astray = 0.0;
        for (index, point) in self.points.iter().enumerate() {
            let moved = self.centre + map * (point - self.centre);
            if !self.tree.is_near(moved.coords.map(|part| part as f32).into(), bound) {
                astray += 1.0;
                if astray > allowed || (index >= FIRST_POINTS && astray > ASTRAY[1] * index as f64) {
                    return false;
                }
            }
        }
        true
    }

    fn run(&self, inertia: &Matrix3<f64>) -> Symmetries {
        let eigen = inertia.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|one, other| eigen.eigenvalues[*one].total_cmp(&eigen.eigenvalues[*other]));
        let [low, middle, high] = order.map(|index| eigen.eigenvalues[index]);
        let [first, second, third] =
            order.map(|index| Unit::new_normalize(eigen.eigenvectors.column(index).into_owned()));
        let alike = [middle - low < ALIKE * high, high - middle < ALIKE * high];
        let directions = match alike {
            [true, true] => return self.of_alike_moments([first, second, third]),
            [true, false] => self.main_and_plane(&third),
            [false, true] => self.main_and_plane(&first),
            [false, false] => vec![first, second, third],
        };
        self.about(&directions)
    }

    fn found(&self, continuous: Vec<Direction>, mut axes: Vec<SymmetryAxis>, mirrors: Vec<Direction>) -> Symmetries {
        axes.sort_by_key(|axis| std::cmp::Reverse(axis.order));
        axes.iter_mut().for_each(|axis| axis.direction = upright(axis.direction));
        let [continuous, mirrors] =
            [continuous, mirrors].map(|list| list.into_iter().map(upright).collect::<Vec<Direction>>());
        Symmetries { centre: self.centre, tolerance: self.tolerance, continuous, axes, mirrors }
    }

    /// Directions worth trying where two moments are alike: the main axis, and the best of the plane square to it.
    fn main_and_plane(&self, main: &Direction) -> Vec<Direction> {
        let of_plane = [half_turn, mirror].into_iter().filter_map(|map| self.best_square_to(main, map));
        std::iter::once(*main).chain(of_plane).chain(square_to(main)).collect()
    }

    /// Symmetries whose main axis, or else whose one plane, is among the directions.
    fn about(&self, directions: &[Direction]) -> Symmetries {
        let orders: Vec<Order> = directions.iter().map(|direction| self.order(direction)).collect();
        let highest = orders.iter().copied().max().unwrap_or(Order::Parts(1));
        let main = orders.iter().position(|order| *order == highest).map(|index| directions[index]);
        let Some(main) = main else { return self.found(Vec::new(), Vec::new(), Vec::new()) };
        match highest {
            Order::Continuous => self.round(&main),
            Order::Parts(1) => {
                let plane = directions.iter().find(|direction| self.holds(&mirror(direction)));
                self.found(Vec::new(), Vec::new(), plane.copied().into_iter().collect())
            }
            Order::Parts(order) => self.of_main_axis(&main, order),
        }
    }

    /// A body of revolution.
    fn round(&self, main: &Direction) -> Symmetries {
        let [across, _] = square_to(main);
        let flip = self.holds(&half_turn(&across)).then_some(SymmetryAxis { direction: across, order: 2 });
        let plane = self.holds(&mirror(main)).then_some(*main);
        self.found(vec![*main], flip.into_iter().collect(), plane.into_iter().collect())
    }

    /// A body with one main axis, with half turns about axes square to it where they hold, and planes.
    fn of_main_axis(&self, main: &Direction, order: u32) -> Symmetries {
        let mut axes = vec![SymmetryAxis { direction: *main, order }];
        let flips = self.fan(main, order, half_turn);
        axes.extend(flips.into_iter().map(|direction| SymmetryAxis { direction, order: 2 }));
        let mut mirrors: Vec<Direction> = self.holds(&mirror(main)).then_some(*main).into_iter().collect();
        mirrors.extend(self.fan(main, order, mirror));
        self.found(Vec::new(), axes, mirrors)
    }

    /// Directions perpendicular to a main axis, evenly spread, as many as its order; none if a map about one is not a
    /// symmetry.
    fn fan(&self, main: &Direction, order: u32, map: fn(&Direction) -> Matrix3<f64>) -> Vec<Direction> {
        let Some(first) = self.best_square_to(main, map) else { return Vec::new() };
        let step = PI / f64::from(order);
        let fan: Vec<Direction> = (0..order)
            .map(|part| Unit::new_normalize(rotation(main, step * f64::from(part)) * first.into_inner()))
            .collect();
        if fan.iter().all(|direction| self.holds(&map(direction))) { fan } else { Vec::new() }
    }

    /// Order of an axis; 1 where no rotation about it holds.
    fn order(&self, axis: &Direction) -> Order {
        let turned = |angle: f64| self.holds(&rotation(axis, angle));
        if (1..=ANGLES).all(|part| turned(PI * f64::from(part) / f64::from(ANGLES))) {
            return Order::Continuous;
        }
        let whole = |order: &u32| (1..*order).all(|part| turned(TAU * f64::from(part) / f64::from(*order)));
        Order::Parts((2..=MAX_ORDER).rev().find(whole).unwrap_or(1))
    }

    /// The middle of the widest range of directions square to an axis about which a map holds.
    fn best_square_to(&self, main: &Direction, map: fn(&Direction) -> Matrix3<f64>) -> Option<Direction> {
        let [along, across] = square_to(main).map(Unit::into_inner);
        let direction = |angle: f64| Unit::new_normalize(along * libm::cos(angle) + across * libm::sin(angle));
        let holds = |angle: f64| self.holds(&map(&direction(angle)));
        let step = PI / f64::from(IN_PLANE);
        let held: Vec<bool> = (0..IN_PLANE).map(|index| holds(step * f64::from(index))).collect();
        // Begin after a direction that does not hold, so that no range is cut in two.
        let Some(start) = held.iter().position(|held| !held) else { return Some(direction(0.0)) };
        let (mut widest, mut length) = (None, 0);
        let mut best = 0;
        for offset in 1..=held.len() {
            length = if held[(start + offset) % held.len()] { length + 1 } else { 0 };
            if length > best {
                best = length;
                widest = Some(start + offset);
            }
        }
        let last = step * widest? as f64;
        let first = last - step * (best - 1) as f64;
        let ends = [(first, -step), (last, step)].map(|(inside, step)| end_of(inside, step, holds));
        Some(direction(f64::midpoint(ends[0], ends[1])))
    }

    /// Where all moments are alike: axes anywhere.
    fn of_alike_moments(&self, principal: [Direction; 3]) -> Symmetries {
        let square = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
        // A ball: continuous about all three axes.
        if square.iter().all(|axis| self.order(axis) == Order::Continuous) {
            return self.found(square.to_vec(), Vec::new(), Vec::new());
        }
        // Nearly a ball: half turns are symmetries about directions everywhere, of which no group could be made.
        let few = lattice().step_by(128);
        if few.filter(|direction| self.holds(&half_turn(direction))).count() > FEW_OF_A_BALL {
            return self.about(&principal.into_iter().chain(square).collect::<Vec<_>>());
        }
        // Axes of orders 2, 3 and 5; an axis of order 4 is also one of order 2.
        let mut axes: Vec<SymmetryAxis> = Vec::new();
        for part in [2, 3, 5] {
            let found = self.everywhere(&|direction| rotation(direction, TAU / f64::from(part)));
            for direction in found {
                if axes.iter().any(|axis| is_one_axis(&axis.direction, &direction)) {
                    continue;
                }
                match self.order(&direction) {
                    Order::Continuous => return self.round(&direction),
                    Order::Parts(1) => {}
                    Order::Parts(order) => axes.push(SymmetryAxis { direction, order }),
                }
            }
        }
        let mut orders: Vec<u32> = axes.iter().map(|axis| axis.order).collect();
        orders.sort_unstable();
        // Axes of the groups of a tetrahedron, a cube and an icosahedron, by their orders.
        let platonic = [[(2, 3), (3, 4), (0, 0)], [(2, 6), (3, 4), (4, 3)], [(2, 15), (3, 10), (5, 6)]];
        let is_platonic = platonic.iter().any(|group| {
            let wanted = group.iter().flat_map(|(order, count)| std::iter::repeat_n(*order, *count));
            wanted.eq(orders.iter().copied())
        });
        if is_platonic {
            let mirrors = self.everywhere(&mirror);
            return self.found(Vec::new(), axes, mirrors);
        }
        // Otherwise the group of the axis of the highest order, or of single planes.
        let main = axes.iter().max_by(|one, other| one.order.cmp(&other.order).then(std::cmp::Ordering::Greater));
        match main {
            Some(axis) => self.of_main_axis(&axis.direction, axis.order),
            None => {
                let planes = self.everywhere(&mirror);
                self.about(&planes.into_iter().chain(principal).collect::<Vec<_>>())
            }
        }
    }

    /// Directions about which a map is a symmetry, one for each patch of them.
    fn everywhere(&self, map: &dyn Fn(&Direction) -> Matrix3<f64>) -> Vec<Direction> {
        let mut patches: Vec<Vec<Direction>> = Vec::new();
        for direction in lattice().filter(|direction| self.holds(&map(direction))) {
            let near = patches.iter_mut().find(|patch| is_one_axis(&patch[0], &direction));
            match near {
                Some(patch) => patch.push(direction),
                None => patches.push(vec![direction]),
            }
        }
        patches.iter().map(|patch| self.middle(patch, map)).collect()
    }

    /// The middle of a patch of directions about which a map holds.
    fn middle(&self, patch: &[Direction], map: &dyn Fn(&Direction) -> Matrix3<f64>) -> Direction {
        let sum: Vector3<f64> = patch.iter().map(|one| one.into_inner() * one.dot(&patch[0]).signum()).sum();
        let mut middle = Unit::new_normalize(sum);
        if !self.holds(&map(&middle)) {
            middle = patch[0];
        }
        // The middle along one great circle, then along one square to it, twice.
        for about in square_to(&middle).into_iter().cycle().take(4) {
            let turned = |angle: f64| Unit::new_normalize(rotation(&about, angle) * middle.into_inner());
            let holds = |angle: f64| self.holds(&map(&turned(angle)));
            let ends = [-ONE_AXIS, ONE_AXIS].map(|step| end_of(0.0, step, holds));
            let better = turned(f64::midpoint(ends[0], ends[1]));
            if self.holds(&map(&better)) {
                middle = better;
            }
        }
        middle
    }
}

/// Directions in half of space, evenly spread: a Fibonacci lattice.
fn lattice() -> impl Iterator<Item = Direction> {
    let golden = PI * (3.0 - libm::sqrt(5.0));
    (0..IN_SPACE).map(move |index| {
        let z = (f64::from(index) + 0.5) / f64::from(IN_SPACE);
        let (radius, angle) = (libm::sqrt(1.0 - z * z), golden * f64::from(index));
        Unit::new_normalize(Vector3::new(radius * libm::cos(angle), radius * libm::sin(angle), z))
    })
}

/// The boundary between an accepted angle and a rejected one, a step beyond it.
fn end_of(inside: f64, step: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut inside, mut outside) = (inside, inside + step);
    for _ in 0..HALVINGS {
        let between = f64::midpoint(inside, outside);
        if holds(between) {
            inside = between;
        } else {
            outside = between;
        }
    }
    inside
}

fn is_one_axis(one: &Direction, other: &Direction) -> bool {
    libm::fabs(one.dot(other)) > libm::cos(ONE_AXIS)
}
