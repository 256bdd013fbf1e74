//! Stable poses of an object on a table, and how likely each is, by the quasi-static method of Wiegley, Rao and
//! Goldberg 1992 and Goldberg et al. 1999 ("Part pose statistics: estimators and experiments").

use std::f64::consts::PI;

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Vector3};

use super::{
    Object, Pose, TriMesh, World,
    hull::{ConvexHull, Facet},
};

/// A pose in which an object rests on the plane z = 0.
#[derive(Clone, Debug, PartialEq)]
pub struct RestingPose {
    /// The object on the table: z up, the origin on the table below the centre of mass [m].
    pub world_from_object: Pose<World, Object>,
    /// Share of random drops that end so, 0 to 1.
    pub probability: f64,
    /// Height of the centre of mass above the table [m].
    pub height: f64,
}

/// The stable poses of an object, those that are much alike as one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestingPoses {
    /// Resting poses that are kept, the most likely first.
    pub poses: Vec<RestingPose>,
    /// Number of the others: less likely than [`Self::MIN`], or after [`Self::MAX`].
    pub left_out: u32,
}

/// A facet on which the object can rest.
struct Stand {
    /// Height of the centre of mass above the facet's plane [m].
    height: f64,
    /// Probability of landing on this facet first; that of facets that tip over to it is added.
    probability: f64,
    /// Where it tips over to; `None` where it stays.
    next: Option<usize>,
}

impl RestingPose {
    /// Straight up, in `Object`: a unit vector.
    pub fn up(&self) -> Vector3<f64> {
        self.world_from_object.rotation().inverse() * Vector3::z()
    }
}

impl RestingPoses {
    /// Less likely poses are left out, unless all are: a ball has many, all unlikely.
    pub const MIN: f64 = 0.01;
    /// Poses of an object, at most.
    pub const MAX: usize = 32;
    /// Poses whose up directions differ by less than this [degrees] are merged into the most likely of them: they are
    /// facets of one rough or round side.
    pub const ALIKE: f64 = 10.0;

    /// Resting poses of a mesh with its centre of mass: the likely ones of [`every_resting_pose`], each with the summed
    /// probability of similar poses.
    pub fn from_mesh(mesh: &TriMesh, centre: &Point3<f64>) -> Self {
        let cos = libm::cos(Self::ALIKE.to_radians());
        let mut poses: Vec<(Vector3<f64>, RestingPose)> = Vec::new();
        for pose in every_resting_pose(mesh, centre) {
            let up = pose.up();
            match poses.iter_mut().find(|(other, _)| other.dot(&up) > cos) {
                Some((_, like)) => like.probability += pose.probability,
                None => poses.push((up, pose)),
            }
        }
        let mut poses: Vec<RestingPose> = poses.into_iter().map(|(_, pose)| pose).collect();
        poses.sort_by(|one, other| other.probability.total_cmp(&one.probability));
        let all = poses.len();
        if poses.first().is_some_and(|likeliest| likeliest.probability >= Self::MIN) {
            poses.retain(|pose| pose.probability >= Self::MIN);
        }
        poses.truncate(Self::MAX);
        Self { left_out: (all - poses.len()) as u32, poses }
    }

    /// Share of random drops that end in none of the kept poses.
    pub fn probability_left_out(&self) -> f64 {
        (1.0 - self.poses.iter().map(|pose| pose.probability).sum::<f64>()).max(0.0)
    }
}

/// Every facet of a mesh's convex hull on which it rests, the most likely first.
///
/// The object is dropped in a random orientation and lands on the facet below its centre of mass: the probability is
/// the facet's solid angle about the centre of mass. Where the centre of mass is not above the facet, the object tips
/// over the edge nearest to the point below it, without momentum, and so on until it rests. Empty if the mesh is flat
/// or the centre of mass is not inside the hull.
pub fn every_resting_pose(mesh: &TriMesh, centre: &Point3<f64>) -> Vec<RestingPose> {
    let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
    // Convex hull and the height of the centre of mass above each facet.
    let Some(hull) = ConvexHull::of(&points) else { return Vec::new() };
    let heights: Vec<f64> = hull.facets.iter().map(|facet| hull.height(facet, centre)).collect();
    // Centre of mass outside the hull or on it: no resting pose.
    if heights.iter().any(|height| *height <= 0.0) {
        return Vec::new();
    }
    // Initial probability of each facet: its solid angle at the centre over 4 pi.
    let mut stands: Vec<Stand> = (hull.facets.iter().zip(&heights))
        .map(|(facet, height)| Stand {
            height: *height,
            probability: hull.solid_angle(facet, centre) / (4.0 * PI),
            next: hull.tips_to(facet, centre, *height, &heights),
        })
        .collect();
    // Tipping lowers the centre of mass: processed from the highest facet down, each facet has all its probability
    // before it passes it on.
    let mut order: Vec<usize> = (0..stands.len()).collect();
    order.sort_by(|one, other| stands[*other].height.total_cmp(&stands[*one].height));
    for from in order {
        if let Some(to) = stands[from].next {
            let given = std::mem::take(&mut stands[from].probability);
            stands[to].probability += given;
        }
    }
    // Pose on each stable facet: outward normal down, facet at height 0, centre of mass above the origin.
    let mut poses: Vec<RestingPose> = (stands.iter().zip(&hull.facets))
        .filter(|(stand, _)| stand.next.is_none())
        .map(|(stand, facet)| {
            let Stand { height, probability, .. } = *stand;
            let rotation = upright(&-facet.normal);
            let down = Vector3::new(0.0, 0.0, height) - rotation * centre.coords;
            let world_from_object = Pose::from_isometry(IsometryMatrix3::from_parts(down.into(), rotation));
            RestingPose { world_from_object, probability, height }
        })
        .collect();
    poses.sort_by(|one, other| other.probability.total_cmp(&one.probability));
    poses
}

/// The smallest rotation that brings a direction of unit length up.
pub fn upright(up: &Vector3<f64>) -> Rotation3<f64> {
    let axis = up.cross(&Vector3::z());
    let cross = axis.cross_matrix();
    let rotation = if up.z > -0.999_999 {
        Matrix3::identity() + cross + cross * cross / (1.0 + up.z)
    } else {
        // Nearly half a revolution: about x, then the remaining rotation.
        let half = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let rest = half * up;
        let cross = rest.cross(&Vector3::z()).cross_matrix();
        (Matrix3::identity() + cross + cross * cross / (1.0 + rest.z)) * half
    };
    Rotation3::from_matrix_unchecked(rotation)
}

impl ConvexHull {
    fn at(&self, facet: &Facet, index: usize) -> Point3<f64> {
        self.corners[facet.corners[index % facet.corners.len()] as usize]
    }

    /// Height of a point inside above a facet's plane [m].
    fn height(&self, facet: &Facet, point: &Point3<f64>) -> f64 {
        facet.normal.dot(&(self.at(facet, 0) - point))
    }

    /// Solid angle of a facet as viewed from a point inside [sr] (Van Oosterom and Strackee 1983, equation 8).
    fn solid_angle(&self, facet: &Facet, from: &Point3<f64>) -> f64 {
        let of_triangle = |index: usize| {
            let [a, b, c] = [0, index, index + 1].map(|index| self.at(facet, index) - from);
            let [a_long, b_long, c_long] = [a, b, c].map(|arm| arm.norm());
            let below = a_long * b_long * c_long + a.dot(&b) * c_long + a.dot(&c) * b_long + b.dot(&c) * a_long;
            2.0 * libm::atan2(a.dot(&b.cross(&c)), below)
        };
        (1..facet.corners.len() - 1).map(of_triangle).sum()
    }

    /// The facet to which the object tips next; `None` if it rests.
    fn tips_to(&self, facet: &Facet, centre: &Point3<f64>, height: f64, heights: &[f64]) -> Option<usize> {
        let foot = centre + facet.normal * height;
        // Of all edges that it is beyond: how far it is from the edge, and how far beyond.
        let mut nearest: Option<([f64; 2], usize)> = None;
        for (index, neighbour) in facet.neighbours.iter().enumerate() {
            let [from, to] = [index, index + 1].map(|index| self.at(facet, index));
            let along = to - from;
            let outward = along.cross(&facet.normal).normalize();
            let beyond = outward.dot(&(foot - from));
            let lower = heights[*neighbour as usize] < height;
            // An edge that is reached only by rounding leads up.
            if beyond <= 0.0 || !lower {
                continue;
            }
            let share = (along.dot(&(foot - from)) / along.norm_squared()).clamp(0.0, 1.0);
            let corner = if share == 1.0 { to } else { from + along * share };
            let rank = [(foot - corner).norm(), -beyond];
            if nearest.is_none_or(|(best, _)| rank < best) {
                nearest = Some((rank, *neighbour as usize));
            }
        }
        nearest.map(|(_, neighbour)| neighbour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The hull's corners are all that counts.
    fn mesh(vertices: Vec<[f32; 3]>) -> TriMesh {
        TriMesh { vertices, triangles: Vec::new() }
    }

    fn brick(low: [f32; 3], high: [f32; 3]) -> TriMesh {
        let corner = |k: usize| std::array::from_fn(|axis| if k >> axis & 1 == 0 { low[axis] } else { high[axis] });
        mesh((0..8).map(corner).collect())
    }

    /// Where z of the object points, for each pose.
    fn ups(poses: &RestingPoses) -> Vec<[i64; 3]> {
        let up = |pose: &RestingPose| {
            let up = pose.up();
            up.map(|part| (part * 1e3).round() as i64).into()
        };
        poses.poses.iter().map(up).collect()
    }

    /// Solid angle of a rectangle 2a by 2b at distance d from its middle: 4 asin(a b / sqrt((a^2 + d^2)(b^2 + d^2))).
    fn of_rectangle(a: f64, b: f64, d: f64) -> f64 {
        4.0 * (a * b / ((a * a + d * d) * (b * b + d * d)).sqrt()).asin() / (4.0 * PI)
    }

    #[test]
    fn a_brick_rests_on_its_faces_as_their_solid_angles_say() {
        let [a, b, c] = [0.05, 0.03, 0.01];
        let brick = brick([-0.05, -0.03, -0.01], [0.05, 0.03, 0.01]);
        let found = RestingPoses::from_mesh(&brick, &Point3::origin());
        let wanted = [of_rectangle(a, b, c), of_rectangle(a, c, b), of_rectangle(b, c, a)];
        assert_eq!((found.poses.len(), found.left_out), (6, 0));
        for (index, pose) in found.poses.iter().enumerate() {
            assert!((pose.probability - wanted[index / 2]).abs() < 1e-7, "{pose:?}, {wanted:?}");
            assert!((pose.height - [c, b, a][index / 2]).abs() < 1e-8);
            let heights: Vec<f64> = (brick.vertices.iter())
                .map(|vertex| pose.world_from_object.point(&Point3::from(vertex.map(f64::from))).z)
                .collect();
            let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
            assert!(low.abs() < 1e-8 && heights.iter().filter(|height| height.abs() < 1e-8).count() == 4);
            let matrix = pose.world_from_object.rotation().matrix();
            assert!((matrix * matrix.transpose() - Matrix3::identity()).amax() < 1e-12 && matrix.determinant() > 0.0);
        }
        let mut sides = ups(&found);
        sides.sort_unstable();
        sides.dedup();
        assert_eq!(sides.len(), 6);
        assert!((found.poses.iter().map(|pose| pose.probability).sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_leans_out_tips_over() {
        // A slanted tower: its centre of mass lies beyond the foot.
        let square = |x: f32, z: f32| [[x, 0.0, z], [x + 0.02, 0.0, z], [x, 0.02, z], [x + 0.02, 0.02, z]];
        let tower = mesh([square(0.0, 0.0), square(0.06, 0.1)].concat());
        let found = RestingPoses::from_mesh(&tower, &Point3::new(0.04, 0.01, 0.05));
        // It stays on its four sides only; ends tip over to the slanted ones.
        assert_eq!((found.poses.len(), found.left_out), (4, 0), "{found:?}");
        let up = ups(&found);
        assert!(!up.contains(&[0, 0, 1000]) && !up.contains(&[0, 0, -1000]), "{up:?}");
        assert!((found.poses.iter().map(|pose| pose.probability).sum::<f64>() - 1.0).abs() < 1e-12);
        // With its mass low in the foot, the same tower is stable.
        let stands = RestingPoses::from_mesh(&tower, &Point3::new(0.012, 0.01, 0.01));
        assert!(ups(&stands).contains(&[0, 0, 1000]));
    }

    #[test]
    fn the_mass_decides_where_a_tetrahedron_ends() {
        let corners = vec![[0.1, 0.1, 0.1], [0.1, -0.1, -0.1], [-0.1, 0.1, -0.1], [-0.1, -0.1, 0.1]];
        let even = RestingPoses::from_mesh(&mesh(corners.clone()), &Point3::origin());
        assert_eq!(even.poses.len(), 4);
        assert!(even.poses.iter().all(|pose| (pose.probability - 0.25).abs() < 1e-7));
        assert_eq!(even.probability_left_out(), 0.0);
        let outside = RestingPoses::from_mesh(&mesh(corners), &Point3::new(0.12, 0.0, 0.0));
        assert_eq!(outside, RestingPoses::default());
        assert_eq!(outside.probability_left_out(), 1.0);
    }

    #[test]
    fn round_sides_become_a_few_poses() {
        let ring = (0..128).map(|k| f64::from(k) * PI / 64.0);
        let rim = |z: f32| ring.clone().map(move |angle| [angle.cos() as f32 * 0.05, angle.sin() as f32 * 0.05, z]);
        let can = mesh(rim(-0.05).chain(rim(0.05)).collect());
        let found = RestingPoses::from_mesh(&can, &Point3::origin());
        // The share of a disc seen under 45 degrees is (1 - cos 45) / 2.
        let ends = (1.0 - 0.5_f64.sqrt()) / 2.0;
        assert!(found.poses[..2].iter().all(|pose| (pose.probability - ends).abs() < 1e-3));
        assert!((18..=30).contains(&found.poses[2..].len()), "{}", found.poses.len());
        // Between two of them there may be room for a few facets.
        assert!(found.left_out < 8 && found.probability_left_out() < 0.05, "{found:?}");
        assert!(every_resting_pose(&can, &Point3::origin()).len() > 100);
    }

    /// A ball rests on any of its facets; the likeliest poses represent them.
    #[test]
    fn a_ball_rests_in_the_likeliest_of_many_poses() {
        let point = |index: u32| {
            let z = 1.0 - (2.0 * f64::from(index) + 1.0) / 2000.0;
            let (sine, cosine) = (f64::from(index) * PI * (3.0 - 5.0_f64.sqrt())).sin_cos();
            let across = (1.0 - z * z).sqrt();
            [across * cosine, across * sine, z].map(|part| (0.02 * part) as f32)
        };
        let found = RestingPoses::from_mesh(&mesh((0..2000).map(point).collect()), &Point3::origin());
        assert_eq!(found.poses.len(), RestingPoses::MAX);
        assert!(found.poses[0].probability < RestingPoses::MIN && found.left_out > 50, "{found:?}");
        assert!(found.poses.iter().all(|pose| (pose.height - 0.02).abs() < 1e-4));
    }

    #[test]
    fn rotations_bring_up_what_shall_be_up() {
        for up in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1e-4, 2e-4, -1.0], [0.6, -0.8, 0.0], [0.1, 0.2, -0.3]] {
            let up = Vector3::from(up).normalize();
            let rotation = upright(&up);
            assert!((rotation * up - Vector3::z()).norm() < 1e-12);
            assert!((rotation.matrix() * rotation.matrix().transpose() - Matrix3::identity()).amax() < 1e-9, "{up}");
        }
    }
}
