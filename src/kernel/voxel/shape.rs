//! Tests whether objects have the same shape in any pose and size.
//!
//! A descriptor is the solid on a 32^3 grid along its own principal axes, each axis scaled to its own standard deviation,
//! so that a knife fills its grid as well as a ball. Where two standard deviations nearly coincide the axes are free to
//! rotation, and fourth moments fix them: they settle along the sides of a box or a cube. Thin walls hardly fill a cell: a
//! thin-walled body is known by its skin as well.

use nalgebra::{Matrix3, Vector3};

use super::{
    caps::Caps,
    columns::{Columns, Lattice, in_cells, in_ticks},
    rim::RimCaps,
    skin::Skin,
    solid::InsideTest,
};
use crate::geom::TriMesh;

type V3 = Vector3<f64>;

/// Cells along each axis.
const SIDE: usize = 32;

/// Half the grid, in standard deviations: a box reaches to 1.73, a ball to 2.24, a cone's tip to 3.87.
const HALF: f64 = 2.75;

/// Standard deviations nearer than this ratio leave the axes free.
const ROUND: f64 = 1.12;

/// Share of a harmonic below which a cross-section counts as round.
const FAINT: f64 = 0.02;

/// Shells of the radial histogram.
const SHELLS: usize = 12;

/// A solid's shape without pose and size. About 4 KiB; 100 KiB more where its walls are thin.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDescriptor {
    /// Standard deviations along the grid's axes, for a volume of 1; zeros for a mesh that encloses nothing.
    spread: [f64; 3],
    /// Extents in descending order.
    sorted: [f64; 3],
    /// Whether neighbours in `sorted` nearly coincide.
    round: [bool; 2],
    /// Row (x, y) is word `x * 32 + y`, bit z.
    rows: Vec<u32>,
    /// Occupied cells by distance from the middle.
    shells: [u32; SHELLS],
    /// The surface of a body with thin walls.
    skin: Option<Skin>,
}

impl ShapeDescriptor {
    /// The shape of a mesh; holes are closed by caps when the test is `WindingNumber`. A mesh that encloses nothing gets
    /// a descriptor that is like no other.
    pub fn from_mesh(mesh: &TriMesh, test: InsideTest) -> Self {
        let Some(triangles) = closed_triangles(mesh, test) else { return Self::nothing() };
        let Some(body) = Body::of(&triangles) else { return Self::nothing() };
        let (axes, deviations) = body.principal_axes();
        let skin = Skin::of(mesh, &triangles, body.volume, &body.centre, &axes);
        let rows = rows_along(&triangles, &body.centre, &axes, &deviations);
        let round = [deviations[0] < ROUND * deviations[1], deviations[1] < ROUND * deviations[2]];
        if round == [false; 2] {
            return Self { skin, ..Self::new(&body, deviations, round, rows) };
        }
        let mut points: Vec<V3> = cells(&rows).map(middle).collect();
        let rotation = settle(&mut points, round);
        let axes = axes * rotation.transpose();
        let deviations = V3::from_fn(|axis, _| axes.column(axis).dot(&(body.covariance * axes.column(axis))).sqrt());
        let rows = rows_along(&triangles, &body.centre, &axes, &deviations);
        Self { skin, ..Self::new(&body, deviations, round, rows) }
    }

    fn nothing() -> Self {
        Self {
            spread: [0.0; 3],
            sorted: [0.0; 3],
            round: [false; 2],
            rows: vec![0; SIDE * SIDE],
            shells: [0; SHELLS],
            skin: None,
        }
    }

    fn new(body: &Body, deviations: V3, round: [bool; 2], rows: Vec<u32>) -> Self {
        let spread: [f64; 3] = (deviations / libm::cbrt(body.volume)).into();
        let mut sorted = spread;
        sorted.sort_by(|a, b| b.total_cmp(a));
        let mut shells = [0; SHELLS];
        for cell in cells(&rows) {
            let shell = middle(cell).norm() / (SIDE / 2) as f64 * SHELLS as f64;
            shells[(shell as usize).min(SHELLS - 1)] += 1;
        }
        Self { spread, sorted, round, rows, shells, skin: None }
    }

    /// Intersection over union of two shapes after they are brought to the same volume, centre and axes: the best of the
    /// orientations that their axes leave open (4, or up to 24 where axes are free to rotate). Mirrored shapes differ.
    ///
    /// The grids are compared with each axis scaled to its own deviation; how far those scales differ is taken off as
    /// between two boxes.
    pub fn likeness(&self, other: &Self) -> f64 {
        self.best_likeness(other, f64::INFINITY)
    }

    /// The best likeness, or the first of at least `enough`.
    fn best_likeness(&self, other: &Self, enough: f64) -> f64 {
        if self.sorted[2] <= 0.0 || other.sorted[2] <= 0.0 {
            return 0.0;
        }
        let total: u32 = self.shells.iter().sum::<u32>() + other.shells.iter().sum::<u32>();
        let round = [self.round[0] || other.round[0], self.round[1] || other.round[1]];
        let mut best = 0.0f64;
        for (order, odd) in ORDERS {
            if !fits(order, round) {
                continue;
            }
            let scale = overlap_of_scales(&self.spread, &order.map(|axis| other.spread[axis]));
            if iou_from_dice(scale) <= best {
                continue;
            }
            let rows = reordered(&other.rows, order);
            for flips in (0..8u32).filter(|flips| (flips.count_ones() % 2 == 1) == odd) {
                let both = common(&self.rows, &rows, flips);
                best = best.max(iou_from_dice(2.0 * f64::from(both) / f64::from(total) * scale));
                if best >= enough {
                    return best;
                }
            }
        }
        best
    }

    /// Whether two shapes are twins: their solids are alike, or they are thin and have one surface.
    fn is_twin_of(&self, other: &Self, threshold: f64) -> bool {
        let are_alike = || self.best_likeness(other, threshold) >= threshold;
        let skins = self.skin.as_ref().zip(other.skin.as_ref());
        self.likeness_bound(other) >= threshold && are_alike() || skins.is_some_and(|(a, b)| a.is_one_with(b))
    }

    /// An upper bound of the likeness that costs next to nothing.
    fn likeness_bound(&self, other: &Self) -> f64 {
        if self.sorted[2] <= 0.0 || other.sorted[2] <= 0.0 {
            return 0.0;
        }
        let pairs = || self.shells.iter().zip(&other.shells);
        let both: u32 = pairs().map(|(a, b)| a.min(b)).sum();
        let total: u32 = pairs().map(|(a, b)| a + b).sum();
        iou_from_dice(2.0 * f64::from(both) / f64::from(total) * overlap_of_scales(&self.sorted, &other.sorted))
    }
}

/// Groups of shapes that are joined by likenesses of at least `threshold` (0.85 in the splits) or, where their walls are thin, by
/// one surface: indices into `shapes`, each group of two or more sorted, groups by their first index.
///
/// Only shapes whose largest spreads are near each other are compared, and those already in one group are not compared
/// again.
pub fn twins(shapes: &[ShapeDescriptor], threshold: f64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..shapes.len()).filter(|shape| shapes[*shape].sorted[2] > 0.0).collect();
    order.sort_by(|a, b| shapes[*a].sorted[0].total_cmp(&shapes[*b].sorted[0]).then(a.cmp(b)));
    // The scales alone allow a Dice overlap of exp(-sum |ln ratio| / 2) at most, and the three ratios multiply to about 1.
    let dice = 2.0 * threshold / (1.0 + threshold);
    let widest = 1.0 / (dice * dice);
    let mut parent: Vec<usize> = (0..shapes.len()).collect();
    for (index, a) in order.iter().enumerate() {
        for b in order[index + 1..].iter().take_while(|b| shapes[**b].sorted[0] <= widest * shapes[*a].sorted[0]) {
            let (root_a, root_b) = (root(&mut parent, *a), root(&mut parent, *b));
            if root_a != root_b && shapes[*a].is_twin_of(&shapes[*b], threshold) {
                parent[root_a.max(root_b)] = root_a.min(root_b);
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); shapes.len()];
    for shape in 0..shapes.len() {
        groups[root(&mut parent, shape)].push(shape);
    }
    groups.retain(|group| group.len() > 1);
    groups
}

fn root(parent: &mut [usize], mut shape: usize) -> usize {
    while parent[shape] != shape {
        parent[shape] = parent[parent[shape]];
        shape = parent[shape];
    }
    shape
}

fn iou_from_dice(dice: f64) -> f64 {
    dice / (2.0 - dice)
}

/// Dice overlap of two boxes with one centre and these sides, each weighed by its own volume.
fn overlap_of_scales(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.min(*b) / (a * b).sqrt()).product()
}

/// The orders of three axes, and whether each is odd.
const ORDERS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], false),
    ([1, 0, 2], true),
    ([0, 2, 1], true),
    ([2, 1, 0], true),
    ([1, 2, 0], false),
    ([2, 0, 1], false),
];

/// Whether only axes that are free to rotate change places.
fn fits(order: [usize; 3], round: [bool; 2]) -> bool {
    match order {
        [0, 1, 2] => true,
        [1, 0, 2] => round[0],
        [0, 2, 1] => round[1],
        _ => round[0] && round[1],
    }
}

/// A grid whose axis i is axis `order[i]` of the given one.
fn reordered(rows: &[u32], order: [usize; 3]) -> Vec<u32> {
    if order == [0, 1, 2] {
        return rows.to_vec();
    }
    let mut transposed = vec![0; SIDE * SIDE];
    for cell in cells(rows) {
        let [x, y, z] = order.map(|axis| cell[axis]);
        transposed[x * SIDE + y] |= 1 << z;
    }
    transposed
}

/// Cells in both grids when the second is flipped along the axes whose bit is set.
fn common(a: &[u32], b: &[u32], flips: u32) -> u32 {
    let row = |index: usize, flip: bool| if flip { SIDE - 1 - index } else { index };
    let mut count = 0;
    for x in 0..SIDE {
        let line = &b[row(x, flips & 1 != 0) * SIDE..][..SIDE];
        for y in 0..SIDE {
            let word = line[row(y, flips & 2 != 0)];
            let word = if flips & 4 != 0 { word.reverse_bits() } else { word };
            count += (a[x * SIDE + y] & word).count_ones();
        }
    }
    count
}

fn cells(rows: &[u32]) -> impl Iterator<Item = [usize; 3]> + '_ {
    rows.iter()
        .enumerate()
        .flat_map(|(row, bits)| (0..SIDE).filter(move |z| bits >> z & 1 != 0).map(move |z| [row / SIDE, row % SIDE, z]))
}

/// Centre of a cell, from the middle of the grid [cells].
fn middle(cell: [usize; 3]) -> V3 {
    V3::from_fn(|axis, _| cell[axis] as f64 + 0.5 - (SIDE / 2) as f64)
}

/// The triangles, closed, in cells of the solid grid.
fn closed_triangles(mesh: &TriMesh, test: InsideTest) -> Option<Vec<[V3; 3]>> {
    let vertices = Lattice::of(mesh)?.vertices(mesh);
    let mut triangles: Vec<[V3; 3]> = mesh
        .triangles
        .iter()
        .map(|triangle| triangle.map(|vertex| V3::from(in_cells(vertices[vertex as usize]))))
        .collect();
    if test == InsideTest::WindingNumber {
        triangles.extend(Caps::new(&RimCaps::of(&vertices, &mesh.triangles).polygons()).triangles());
    }
    Some(triangles)
}

/// The moments of a closed surface's inside.
struct Body {
    volume: f64,
    centre: V3,
    /// About `centre`, over the volume.
    covariance: Matrix3<f64>,
}

impl Body {
    /// Sums over the tetrahedra between the triangles and one point; `None` when nothing is enclosed.
    fn of(triangles: &[[V3; 3]]) -> Option<Self> {
        let from = triangles.first()?[0];
        let (mut volume, mut first, mut second) = (0.0, V3::zeros(), Matrix3::zeros());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| corner - from);
            let (part, sum) = (a.dot(&b.cross(&c)) / 6.0, a + b + c);
            volume += part;
            first += sum * (part / 4.0);
            second +=
                (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * (part / 20.0);
        }
        if volume < 0.0 {
            (volume, first, second) = (-volume, -first, -second);
        }
        let mean = first / volume;
        let covariance = second / volume - mean * mean.transpose();
        // A cell of the solid grid is 1: below that there is no body.
        (volume > 1.0 && covariance.iter().all(|value| value.is_finite())).then_some(Self {
            volume,
            centre: from + mean,
            covariance,
        })
    }

    /// Right-handed axes as columns and the standard deviations along them, largest first.
    fn principal_axes(&self) -> (Matrix3<f64>, V3) {
        let eigen = self.covariance.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]).then(a.cmp(b)));
        let mut axes = Matrix3::from_columns(&order.map(|axis| eigen.eigenvectors.column(axis).into_owned()));
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        // Scans are never thinner than this; it keeps the scales finite for a body that folds over itself.
        (axes, V3::from_fn(|axis, _| eigen.eigenvalues[order[axis]].max(1e-6).sqrt()))
    }
}

/// The solid on the grid along `axes`, cell by centre.
fn rows_along(triangles: &[[V3; 3]], centre: &V3, axes: &Matrix3<f64>, deviations: &V3) -> Vec<u32> {
    let half = (SIDE / 2) as f64;
    let scale = Matrix3::from_diagonal(&deviations.map(|deviation| half / (HALF * deviation)));
    let to_grid = scale * axes.transpose();
    let ticks = triangles
        .iter()
        .map(|triangle| triangle.map(|corner| in_ticks((to_grid * (corner - centre) + V3::repeat(half)).into())));
    let mut rows = vec![0u32; SIDE * SIDE];
    Columns::<SIDE>::of(ticks).for_each_run(|row, from, to| {
        if from < to {
            rows[row] |= (u32::MAX >> (SIDE - (to - from))) << from;
        }
    });
    rows
}

/// Rotates the points about the axes that are free, so that fourth moments are smallest along the axes: the sides of a
/// square or a cube. Returns the rotation, new from old.
fn settle(points: &mut [V3], round: [bool; 2]) -> Matrix3<f64> {
    let (planes, sweeps): (&[[usize; 2]], usize) = match round {
        [true, true] => (&[[0, 1], [1, 2], [0, 2]], 6),
        [true, false] => (&[[0, 1]], 1),
        _ => (&[[1, 2]], 1),
    };
    let mut rotation = Matrix3::identity();
    for _ in 0..sweeps {
        let mut largest = 0.0f64;
        for [i, j] in planes {
            let angle = settling_angle(points, *i, *j, planes.len() == 1);
            let (sine, cosine) = libm::sincos(angle);
            let mut step = Matrix3::identity();
            (step[(*i, *i)], step[(*i, *j)], step[(*j, *i)], step[(*j, *j)]) = (cosine, sine, -sine, cosine);
            points.iter_mut().for_each(|point| *point = step * *point);
            rotation = step * rotation;
            largest = largest.max(angle.abs());
        }
        if largest < 1e-3 {
            break;
        }
    }
    rotation
}

/// The angle, within 45 degrees for a square, that settles the plane of axes `i` and `j`: by the fourth harmonic, or by
/// the third where that is stronger and `thirds` allows it.
fn settling_angle(points: &[V3], i: usize, j: usize, thirds: bool) -> f64 {
    let (mut third, mut third_size, mut fourth, mut fourth_size) = ([0.0; 2], 0.0, [0.0; 2], 0.0);
    for point in points {
        let (x, y) = (point[i], point[j]);
        let (re, im) = (x * x - y * y, 2.0 * x * y);
        let squared = x * x + y * y;
        third[0] += re * x - im * y;
        third[1] += re * y + im * x;
        third_size += squared * squared.sqrt();
        fourth[0] += re * re - im * im;
        fourth[1] += 2.0 * re * im;
        fourth_size += squared * squared;
    }
    let share = |sum: [f64; 2], size: f64| (sum[0] * sum[0] + sum[1] * sum[1]).sqrt() / size.max(f64::MIN_POSITIVE);
    let (third_share, fourth_share) = (share(third, third_size), share(fourth, fourth_size));
    if thirds && third_share > fourth_share && third_share > FAINT {
        libm::atan2(third[1], third[0]) / 3.0
    } else if fourth_share > FAINT {
        // z^4 of the rotated points becomes negative and real.
        libm::atan2(-fourth[1], -fourth[0]) / 4.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Rotation3;

    use super::*;
    use crate::geom::rotation_from_rpy;

    fn rotated(mesh: &TriMesh, rotation: &Rotation3<f64>, scale: f64) -> TriMesh {
        let rotate = |vertex: &[f32; 3]| {
            let point = rotation * V3::from(vertex.map(f64::from)) * scale;
            [point.x as f32 + 0.3, point.y as f32 - 0.1, point.z as f32]
        };
        TriMesh { vertices: mesh.vertices.iter().map(rotate).collect(), triangles: mesh.triangles.clone() }
    }

    /// A prism over a convex polygon that holds the origin, `height` high, closed and wound outward.
    fn prism(polygon: &[[f32; 2]], height: f32) -> TriMesh {
        let n = polygon.len() as u32;
        let mut mesh = TriMesh::default();
        for z in [0.0, height] {
            mesh.vertices.extend(polygon.iter().map(|[x, y]| [*x, *y, z]));
        }
        mesh.triangles.extend((1..n - 1).flat_map(|i| [[0, i + 1, i], [n, n + i, n + i + 1]]));
        mesh.triangles.extend((0..n).flat_map(|i| [[i, (i + 1) % n, n + i], [(i + 1) % n, n + (i + 1) % n, n + i]]));
        mesh
    }

    fn regular(sides: usize, radius: f32) -> Vec<[f32; 2]> {
        (0..sides)
            .map(|side| {
                let (sine, cosine) = libm::sincos(2.0 * PI * side as f64 / sides as f64);
                [radius * cosine as f32, radius * sine as f32]
            })
            .collect()
    }

    fn cuboid(x: f32, y: f32, z: f32) -> TriMesh {
        prism(&[[-x, -y], [x, -y], [x, y], [-x, y]], 2.0 * z)
    }

    fn shape(mesh: &TriMesh) -> ShapeDescriptor {
        ShapeDescriptor::from_mesh(mesh, InsideTest::Crossings)
    }

    #[test]
    fn pose_and_size_do_not_matter() {
        let wedge = prism(&[[-0.3, -0.2], [0.9, -0.2], [0.1, 0.5], [-0.3, 0.4]], 0.35);
        let meshes = [
            cuboid(1.0, 1.0, 1.0),
            cuboid(1.0, 1.0, 0.3),
            cuboid(3.0, 1.0, 0.1),
            prism(&regular(3, 1.0), 4.0),
            prism(&regular(48, 1.0), 2.5),
            wedge,
        ];
        for (index, mesh) in meshes.iter().enumerate() {
            let original = shape(mesh);
            for (roll, pitch, yaw) in [(0.4, 1.1, -2.0), (2.5, -0.3, 0.9), (-1.2, 0.7, 3.0), (0.1, 0.05, -0.07)] {
                let likeness = original.likeness(&shape(&rotated(mesh, &rotation_from_rpy(roll, pitch, yaw), 0.17)));
                assert!(likeness > 0.93, "shape {index} rotated by {roll} {pitch} {yaw}: {likeness}");
            }
        }
        let shapes: Vec<ShapeDescriptor> = meshes.iter().map(shape).collect();
        assert_eq!(twins(&shapes, 0.85), Vec::<Vec<usize>>::new());
    }

    #[test]
    fn likeness_of_boxes_is_their_overlap() {
        // Scaled to one volume, boxes with sides (1, 1, 1) and (1, 1, h) overlap in min^2 max... of the side ratios.
        for h in [1.05f32, 1.2, 1.5] {
            let side = f64::from(h).powf(-1.0 / 3.0);
            let inside = side * side;
            let expected = inside / (2.0 - inside);
            let likeness = shape(&cuboid(1.0, 1.0, 1.0)).likeness(&shape(&cuboid(1.0, 1.0, h)));
            assert!((likeness - expected).abs() < 0.03, "height {h}: {likeness}, expected {expected}");
        }
    }

    #[test]
    fn a_mirrored_wedge_is_another_shape() {
        let wedge = prism(&[[-0.3, -0.2], [0.9, -0.2], [0.1, 0.7]], 0.15);
        let mut skew = wedge.clone();
        skew.vertices.iter_mut().for_each(|vertex| vertex[2] += 0.8 * vertex[0] * vertex[0] + 0.5 * vertex[1]);
        let mut mirrored = skew.clone();
        mirrored.vertices.iter_mut().for_each(|vertex| vertex[0] = -vertex[0]);
        mirrored.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        assert!(shape(&skew).likeness(&shape(&skew)) > 0.999);
        assert!(shape(&skew).likeness(&shape(&mirrored)) < 0.9);
    }

    #[test]
    fn groups_are_sorted_and_nothing_is_like_nothing() {
        let flat = TriMesh { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]] };
        let small = rotated(&cuboid(1.0, 0.7, 0.4), &rotation_from_rpy(1.0, 0.3, 0.2), 0.01);
        let meshes = [
            flat.clone(),
            cuboid(1.0, 0.7, 0.4),
            prism(&regular(40, 1.0), 1.0),
            small,
            flat,
            prism(&regular(60, 2.0), 2.0),
        ];
        let shapes: Vec<ShapeDescriptor> = meshes.iter().map(shape).collect();
        assert_eq!(twins(&shapes, 0.85), [vec![1, 3], vec![2, 5]]);
    }

    /// A thin tube, twisted about its axis and bent aside, closed and wound outward.
    fn twisted_tube(twist: f64, thickness: f64) -> TriMesh {
        const AROUND: u32 = 64;
        const ALONG: u32 = 40;
        let mut mesh = TriMesh::default();
        for inner in [false, true] {
            for level in 0..=ALONG {
                for step in 0..AROUND {
                    let (angle, height) =
                        (f64::from(step) / f64::from(AROUND) * 2.0 * PI, f64::from(level) / f64::from(ALONG));
                    // A cross-section like a bean, so that the twist shows.
                    let radius = 1.0 + 0.35 * libm::cos(2.0 * angle) + 0.2 * libm::cos(angle)
                        - if inner { thickness } else { 0.0 };
                    let (sine, cosine) = libm::sincos(angle + twist * height);
                    mesh.vertices.push([radius * cosine, radius * sine, 3.0 * height].map(|part| 0.03 * part as f32));
                }
            }
        }
        let at = |inner: bool, level: u32, step: u32| (u32::from(inner) * (ALONG + 1) + level) * AROUND + step % AROUND;
        for step in 0..AROUND {
            for level in 0..ALONG {
                for inner in [false, true] {
                    let [a, b, c, d] = [(level, step), (level, step + 1), (level + 1, step + 1), (level + 1, step)]
                        .map(|(l, s)| at(inner, l, s));
                    let quad = if inner { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
                    mesh.triangles.extend(quad);
                }
            }
            for (level, up) in [(0, false), (ALONG, true)] {
                let [a, b, c, d] =
                    [(false, step), (false, step + 1), (true, step + 1), (true, step)].map(|(i, s)| at(i, level, s));
                let quad = if up { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                mesh.triangles.extend(quad);
            }
        }
        mesh
    }

    #[test]
    fn thin_walls_are_twins_by_their_surface() {
        let tube = twisted_tube(1.2, 0.04);
        let own = shape(&tube);
        assert!(own.skin.is_some() && shape(&cuboid(1.0, 0.7, 0.4)).skin.is_none());
        // Turned and scaled, and with a thinner wall of the same size.
        for (index, (roll, pitch, yaw, scale)) in
            [(0.4, 1.1, -2.0, 0.17), (2.5, -0.3, 0.9, 3.0)].into_iter().enumerate()
        {
            let other = shape(&rotated(&tube, &rotation_from_rpy(roll, pitch, yaw), scale));
            assert_eq!(twins(&[own.clone(), other], 0.85), [[0, 1]], "copy {index}");
        }
        assert_eq!(twins(&[own.clone(), shape(&twisted_tube(1.2, 0.03))], 0.85), [[0, 1]]);
        // Mirrored, or twisted by another angle, it is another shape.
        for twist in [-1.2, 0.2, 2.4] {
            let other = shape(&rotated(&twisted_tube(twist, 0.04), &rotation_from_rpy(0.4, 1.1, -2.0), 1.0));
            assert!(other.skin.is_some());
            assert!(twins(&[own.clone(), other], 0.85).is_empty(), "twisted by {twist}");
        }
    }
}
