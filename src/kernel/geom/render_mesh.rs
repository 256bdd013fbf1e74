//! A mesh laid out for the kernels that run once per view.

use nalgebra::{Point3, Vector3};

use super::{Affine, CameraCv, Lanes, Object, Pose, SimdLevel, TriMesh, each_of, simd_kernel};

/// A triangle mesh as arrays of coordinates, its triangles in clusters that lie and face together.
///
/// Vertices are relative to the middle of the box, so that `f32` keeps its precision for every origin of the mesh.
/// Triangles are sorted by the side they face (six), then along a Morton curve, and cut into clusters of
/// [`RenderMesh::CLUSTER`]; each has a bounding sphere and a cone of normals, by which clusters that face away are
/// skipped whole (Shirman and Abi-Ezzi 1993, "The cone of normals technique").
#[derive(Clone, Debug)]
pub struct RenderMesh {
    centre: Point3<f64>,
    half_extents: Vector3<f64>,
    radius: f64,
    cull_back_faces: bool,
    pub(crate) positions: [Vec<f32>; 3],
    pub(crate) corners: [Vec<u32>; 3],
    /// Unit normal of each triangle in steps of 1/127, x, y, z a signed byte each; 0 for one without area.
    pub(crate) normals: Vec<u32>,
    clusters: Vec<Cluster>,
}

/// A cluster that may face the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    pub(crate) cluster: u32,
    /// From the eye to the middle of the cluster [m].
    pub(crate) ray: [f32; 3],
    /// A triangle of the cluster faces away when `ray` along its normal, as kept, is more than this; infinite where back
    /// faces are drawn.
    pub(crate) away: f32,
}

/// Bounds of a run of [`RenderMesh::CLUSTER`] triangles; positions relative to the middle of the box [m].
#[derive(Clone, Copy, Debug)]
struct Cluster {
    centre: [f32; 3],
    radius: f32,
    /// Axis of the cone of normals.
    axis: [f32; 3],
    /// Cosine and sine of its half angle; a cosine of -1 never faces away.
    cosine: f32,
    sine: f32,
}

impl RenderMesh {
    /// Triangles a cluster; the last one is filled up with copies of a vertex, which cover nothing.
    pub const CLUSTER: usize = 64;

    /// Vertices are filled up to a multiple of this with copies of the last.
    pub(crate) const LANES: usize = 16;

    /// Lays a mesh out. `cull_back_faces` is for closed meshes wound outward: faces that point away are then never drawn.
    ///
    /// Vertices that no triangle uses are dropped.
    ///
    /// # Panics
    /// If a triangle names a vertex that is not there.
    pub fn new(mesh: &TriMesh, cull_back_faces: bool) -> Self {
        // Box of the used vertices; positions are stored relative to its middle.
        let used: Vec<[f32; 3]> =
            mesh.triangles.iter().flatten().map(|vertex| mesh.vertices[*vertex as usize]).collect();
        let aabb = TriMesh { vertices: used, triangles: Vec::new() }.aabb();
        let centre = aabb.map_or(Point3::origin(), |aabb| aabb.centre());
        let half_extents = aabb.map_or(Vector3::zeros(), |aabb| (aabb.max - aabb.min) * 0.5);

        // Vertices in the order of their first use by the sorted triangles.
        let order = cluster_order(mesh, &centre, half_extents.max());
        let mut renamed = vec![u32::MAX; mesh.vertices.len()];
        let mut positions = [const { Vec::new() }; 3];
        let mut corners = [const { Vec::new() }; 3];
        for triangle in order {
            // Swap corners 1 and 2: the image's y points down, and front faces must have positive area there.
            let [a, b, c] = mesh.triangles[triangle as usize];
            for (corner, vertex) in [a, c, b].into_iter().enumerate() {
                let name = &mut renamed[vertex as usize];
                if *name == u32::MAX {
                    *name = positions[0].len() as u32;
                    for axis in 0..3 {
                        let position = f64::from(mesh.vertices[vertex as usize][axis]) - centre[axis];
                        positions[axis].push(position as f32);
                    }
                }
                corners[corner].push(*name);
            }
        }
        let vertices = positions[0].len();
        let triangles = corners[0].len();
        // Fill up to whole vectors with copies of the last vertex.
        if vertices > 0 {
            for axis in &mut positions {
                axis.resize(vertices.next_multiple_of(Self::LANES), axis[vertices - 1]);
            }
            for corner in &mut corners {
                corner.resize(triangles.next_multiple_of(Self::CLUSTER), vertices as u32 - 1);
            }
        }
        let mut laid_out = Self {
            centre,
            half_extents,
            radius: 0.0,
            cull_back_faces,
            positions,
            corners,
            normals: Vec::new(),
            clusters: Vec::new(),
        };
        // Bounding sphere and cone of normals of each cluster.
        laid_out.radius = (0..vertices).map(|vertex| laid_out.position(vertex as u32).norm()).fold(0.0, f64::max);
        let mut normals = Vec::with_capacity(triangles.next_multiple_of(Self::CLUSTER));
        laid_out.clusters = (0..triangles.div_ceil(Self::CLUSTER))
            .map(|cluster| laid_out.measure_cluster(cluster, &mut normals))
            .collect();
        laid_out.normals = normals;
        laid_out
    }

    /// The middle of the mesh's box, in `Object` [m]; vertices are kept relative to it.
    pub fn centre(&self) -> Point3<f64> {
        self.centre
    }

    /// Half the sides of the mesh's box [m].
    pub fn half_extents(&self) -> Vector3<f64> {
        self.half_extents
    }

    /// Radius of the sphere around [`RenderMesh::centre`] that holds every vertex [m].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether faces that point away are skipped.
    pub fn culls_back_faces(&self) -> bool {
        self.cull_back_faces
    }

    /// Number of clusters.
    pub fn clusters(&self) -> usize {
        self.clusters.len()
    }

    /// Position of a vertex relative to the middle of the box [m].
    pub(crate) fn position(&self, vertex: u32) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| f64::from(self.positions[axis][vertex as usize]))
    }

    /// The pose as rows over positions relative to the middle of the box: (3, 4), last column the middle in `CameraCv`.
    pub(crate) fn rows(&self, camera_from_object: &Pose<CameraCv, Object>) -> [[f64; 4]; 3] {
        let rotation = camera_from_object.rotation().matrix();
        let centre = camera_from_object.point(&self.centre);
        std::array::from_fn(|row| [rotation[(row, 0)], rotation[(row, 1)], rotation[(row, 2)], centre[row]])
    }

    /// The box of all vertices in the camera's axes: lower and upper ends along x, y and z [m], good to a few times 1e-7
    /// of the box's size.
    pub fn reach(&self, level: SimdLevel, camera_from_object: &Pose<CameraCv, Object>) -> [[f64; 2]; 3] {
        let rows = self.rows(camera_from_object);
        let single = rows.map(|[a, b, c, _]| [a as f32, b as f32, c as f32, 0.0]);
        let mut ends = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
        reach(level, &self.positions, &single, &mut ends);
        std::array::from_fn(|axis| ends[axis].map(|end| rows[axis][3] + f64::from(end)))
    }

    /// Lists the clusters that may face a camera at `eye` (relative to the middle of the box [m]), in order.
    pub(crate) fn facing(&self, eye: &Vector3<f64>, list: &mut Vec<Facing>) {
        list.clear();
        let eye = [eye.x as f32, eye.y as f32, eye.z as f32];
        list.extend(
            (0..).zip(&self.clusters).filter_map(|(index, cluster)| cluster.facing(index, eye, self.cull_back_faces)),
        );
    }

    fn measure_cluster(&self, cluster: usize, bytes: &mut Vec<u32>) -> Cluster {
        let triangles = cluster * Self::CLUSTER..(cluster + 1) * Self::CLUSTER;
        let corners = |triangle: usize| self.corners.each_ref().map(|corner| self.position(corner[triangle]));
        // Bounding box of the corners, and the sum of unit normals for the cone's axis.
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let mut sum = Vector3::zeros();
        let mut normals = [Vector3::zeros(); Self::CLUSTER];
        for triangle in triangles.clone() {
            // Corners 1 and 2 are stored swapped: here they are outward again.
            let [a, c, b] = corners(triangle);
            for corner in [a, b, c] {
                low = low.inf(&corner);
                high = high.sup(&corner);
            }
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            normals[triangle % Self::CLUSTER] = normal;
            // Normal in signed bytes of 1/127, three packed into a word.
            let steps = normal.map(|value| u32::from((value * 127.0).round() as i8 as u8));
            bytes.push(steps.x | steps.y << 8 | steps.z << 16);
            sum += normal;
        }
        // Bounding sphere about the box's middle.
        let centre = (low + high) * 0.5;
        let radius = triangles.flat_map(corners).map(|corner| (corner - centre).norm()).fold(0.0, f64::max);
        // Cone of normals: its axis is the mean, its cosine the smallest one to any normal.
        let axis = sum.try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        // Triangles without area have no normal and cover nothing; a small margin is subtracted for rounding.
        let cosine = normals
            .iter()
            .filter(|normal| normal.norm_squared() > 0.5)
            .map(|normal| normal.dot(&axis))
            .fold(1.0, f64::min)
            - 1e-6;
        Cluster {
            centre: [centre.x as f32, centre.y as f32, centre.z as f32],
            radius: (radius * (1.0 + 1e-6)) as f32,
            axis: [axis.x as f32, axis.y as f32, axis.z as f32],
            cosine: cosine as f32,
            sine: (1.0 - cosine * cosine).max(0.0).sqrt() as f32,
        }
    }
}

impl Cluster {
    /// `None` only when no triangle can show its front to a camera at `eye`.
    ///
    /// With v from the eye to the cluster's middle, theta the angle between v and the axis and alpha the cone's half
    /// angle, each n . v >= |v| cos(theta + alpha) when theta + alpha <= pi; a point of the cluster is at most `radius`
    /// off. Rounding gets a slack of 1e-4 of the distance, a normal in bytes one of sqrt(3)/2 steps.
    #[inline]
    fn facing(&self, index: u32, eye: [f32; 3], cull: bool) -> Option<Facing> {
        let v = [self.centre[0] - eye[0], self.centre[1] - eye[1], self.centre[2] - eye[2]];
        if !cull {
            return Some(Facing { cluster: index, ray: v, away: f32::INFINITY });
        }
        let squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        let distance = squared.sqrt();
        let along = v[0] * self.axis[0] + v[1] * self.axis[1] + v[2] * self.axis[2];
        let across = (squared - along * along).max(0.0).sqrt();
        let away = along * self.cosine - across * self.sine - self.radius;
        if self.cosine > 0.0 && along > 0.0 && away > 1e-4 * (distance + self.radius) {
            return None;
        }
        Some(Facing { cluster: index, ray: v, away: 127.0 * (self.radius + 1e-4 * distance) + 0.88 * distance })
    }
}

simd_kernel! {
    /// Lowest and highest value of each row over all positions.
    fn reach(positions: &[Vec<f32>; 3], rows: &[[f32; 4]; 3], ends: &mut [[f32; 2]; 3]) = reach_body;
}

#[inline(always)]
fn reach_body<L: Lanes>(l: L, positions: &[Vec<f32>; 3], rows: &[[f32; 4]; 3], ends: &mut [[f32; 2]; 3]) {
    let rows = each_of!([0, 1, 2], row => Affine::new(l, rows[row]));
    let mut low = each_of!([0, 1, 2], axis => l.splat(ends[axis][0]));
    let mut high = each_of!([0, 1, 2], axis => l.splat(ends[axis][1]));
    let [xs, ys, zs] = each_of!([&positions[0], &positions[1], &positions[2]], axis => axis.as_chunks::<16>().0);
    for ((x, y), z) in xs.iter().zip(ys).zip(zs) {
        let (x, y, z) = (l.load(x), l.load(y), l.load(z));
        for axis in 0..3 {
            let value = rows[axis].at(l, x, y, z);
            low[axis] = l.min(low[axis], value);
            high[axis] = l.max(high[axis], value);
        }
    }
    for axis in 0..3 {
        let mut lanes = [[0.0; 16]; 2];
        l.store(low[axis], &mut lanes[0]);
        l.store(high[axis], &mut lanes[1]);
        ends[axis] = [
            lanes[0].into_iter().fold(f32::INFINITY, f32::min),
            lanes[1].into_iter().fold(f32::NEG_INFINITY, f32::max),
        ];
    }
}

/// The triangles by the side they face, then along a Morton curve of 10 bits per axis through their centroids.
fn cluster_order(mesh: &TriMesh, centre: &Point3<f64>, half_side: f64) -> Vec<u32> {
    let scale = if half_side > 0.0 { 511.0 / half_side } else { 0.0 };
    let mut keys: Vec<u64> = (0..mesh.triangles.len())
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            let normal = (b - a).cross(&(c - a));
            let axis = normal.iamax();
            let side = (2 * axis + usize::from(normal[axis] < 0.0)) as u64;
            let centroid = (a.coords + b.coords + c.coords) / 3.0 - centre.coords;
            let morton = (0..3)
                .fold(0, |key, axis| key | spread_bits(((centroid[axis] * scale + 512.0) as u64).min(1023)) << axis);
            side << 61 | morton << 31 | triangle as u64
        })
        .collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| (key & 0x7fff_ffff) as u32).collect()
}

/// Two zero bits between each two of ten bits.
fn spread_bits(value: u64) -> u64 {
    let mut spread = value & 0x3ff;
    for (shift, mask) in [(16, 0x0300_00ff), (8, 0x0300_f00f), (4, 0x030c_30c3), (2, 0x0924_9249)] {
        spread = (spread | spread << shift) & mask;
    }
    spread
}
