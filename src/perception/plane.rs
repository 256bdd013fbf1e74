//! Support plane of objects: RANSAC (Fischler and Bolles 1981), then least squares.

use kernel::seed::Stream;
use nalgebra::{Matrix3, Point3, Vector3};

use crate::frame::DepthFrame;

/// Thresholds and seed by which a plane is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneRule {
    /// Points nearer than this belong to the plane [m].
    pub tolerance: f64,
    /// Planes through three points that are tried.
    pub hypotheses: u32,
    /// Stride of the points that rate a hypothesis.
    pub stride: usize,
    /// Share of all points that a plane must hold.
    pub min_share: f64,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for PlaneRule {
    fn default() -> Self {
        Self { tolerance: 0.005, hypotheses: 300, stride: 37, min_share: 0.1, seed: 0 }
    }
}

/// A plane in `CameraCv`: points with `normal . point + offset = 0`, the normal towards the camera's side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal; the camera lies on its side.
    pub normal: Vector3<f64>,
    /// Height of the camera above the plane [m].
    pub offset: f64,
    /// Points that belong to it.
    pub points: usize,
}

impl Plane {
    /// Height of a point above the plane [m]; NaN for a point that is.
    pub fn height(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) + self.offset
    }

    /// The point of the plane nearest to the camera [m].
    pub fn foot(&self) -> Point3<f64> {
        Point3::from(self.normal * -self.offset)
    }

    /// The plane of these numbers, with the normal made a unit vector towards the camera; `None` without a direction.
    pub fn from_numbers([x, y, z, offset]: [f64; 4]) -> Option<Self> {
        let normal = Vector3::new(x, y, z);
        let point = normal * (-offset / normal.norm_squared());
        point.iter().all(|value| value.is_finite()).then(|| Self::through(normal, &point)).flatten()
    }

    /// A plane by a normal and a point; `None` without a direction.
    pub(crate) fn through(normal: Vector3<f64>, point: &Vector3<f64>) -> Option<Self> {
        let normal = normal.try_normalize(1e-12)?;
        let offset = -normal.dot(point);
        let sign = if offset < 0.0 { -1.0 } else { 1.0 };
        Some(Self { normal: normal * sign, offset: offset * sign, points: 0 })
    }
}

/// The plane with the largest count of points; `None` if none has enough.
pub fn find_plane(frame: &DepthFrame, rule: &PlaneRule) -> Option<Plane> {
    plane_of(&frame.points(), rule)
}

/// [`find_plane`] with the picture's points.
pub(crate) fn plane_of(points: &[(u32, Point3<f64>)], rule: &PlaneRule) -> Option<Plane> {
    if points.len() < 3 {
        return None;
    }
    let judges = Judges::new(points, rule.stride.max(1));
    // Hypotheses through three points; the first of equal ones stays.
    let mut draw = Stream::of_job(rule.seed, b"plane", "hypotheses");
    let mut best: Option<(u64, Plane)> = None;
    for _ in 0..rule.hypotheses {
        let [a, b, c] = std::array::from_fn(|_| points[draw.below(points.len() as u64) as usize].1.coords);
        let Some(plane) = Plane::through((b - a).cross(&(c - a)), &a) else { continue };
        let votes = judges.votes(&plane, rule.tolerance);
        if best.as_ref().is_none_or(|(most, _)| votes > *most) {
            best = Some((votes, plane));
        }
    }
    // Least squares over all points near it, twice: the first changes which are near.
    let near = |plane: Plane| {
        points.iter().map(|(_, point)| point).filter(move |point| plane.height(point).abs() < rule.tolerance)
    };
    let mut plane = best?.1;
    for _ in 0..2 {
        plane = fitted(near(plane), &plane.foot())?;
    }
    plane.points = near(plane).count();
    (plane.points as f64 >= rule.min_share * points.len() as f64).then_some(plane)
}

/// Every few points one, by coordinate: hundreds of planes are judged by them.
struct Judges([Vec<f64>; 3]);

impl Judges {
    fn new(points: &[(u32, Point3<f64>)], stride: usize) -> Self {
        Self([0, 1, 2].map(|axis| points.iter().step_by(stride).map(|(_, point)| point[axis]).collect()))
    }

    /// Points nearer to a plane than this [m].
    fn votes(&self, plane: &Plane, tolerance: f64) -> u64 {
        let Self([x, y, z]) = self;
        let [a, b, c] = plane.normal.into();
        let points = x.iter().zip(y).zip(z);
        points.map(|((x, y), z)| u64::from((a * x + b * y + c * z + plane.offset).abs() < tolerance)).sum()
    }
}

/// The plane of least squares; sums are of offsets from a point near it.
pub(crate) fn fitted<'a>(points: impl Iterator<Item = &'a Point3<f64>>, origin: &Point3<f64>) -> Option<Plane> {
    let (mut count, mut sum, mut squares) = (0_u32, Vector3::zeros(), Matrix3::zeros());
    for offset in points.map(|point| point - origin) {
        count += 1;
        sum += offset;
        squares += Matrix3::from_columns(&[offset * offset.x, offset * offset.y, offset * offset.z]);
    }
    if count < 3 {
        return None;
    }
    let mean = sum / f64::from(count);
    let eigen = (squares - mean * sum.transpose()).symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    Plane::through(eigen.eigenvectors.column(smallest).into_owned(), &(origin.coords + mean))
}
