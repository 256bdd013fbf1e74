//! The z-buffer: depth images of triangle meshes in the projected box of the object.
//!
//! Image coordinates are counted in pixels from the centre of the pixel nearest the principal point, so that pixel
//! centres are whole numbers and coordinates near the axis keep their precision. Depth is kept as 1/z, which is linear
//! in the image (Blinn 1992, "Hyperbolic interpolation"). A pixel belongs to a triangle when its centre lies inside or on
//! the edge; the nearest surface wins in any order, so clusters, lanes and levels cannot change a bit.

use nalgebra::Vector3;

use super::raster_kernels::{self as kernels, Fragment, Projected, Survivors, Target};
use crate::geom::{CameraCv, DepthCrop, Facing, Intrinsics, Object, Pose, RenderMesh, SimdLevel};

/// Renders depth; one a worker, its memory is used again for every view.
pub struct Rasteriser {
    level: SimdLevel,
    facing: Vec<Facing>,
    projected: Projected,
    clipped: [Vec<u32>; 3],
    clipped_normals: Vec<u32>,
    survivors: Survivors,
    target: Target,
    column_max: Vec<f32>,
    crop: DepthCrop,
}

/// The camera in the form that the kernels need.
struct Lens {
    /// Column and row of the pixel that image coordinates count from [px].
    origin: [i32; 2],
    /// Principal point less the centre of that pixel [px].
    offset: [f64; 2],
    /// First and past-the-end column and row of the image, counted from the origin [px].
    low: [f32; 2],
    high: [f32; 2],
}

impl Lens {
    fn new(camera: &Intrinsics) -> Self {
        let size = [camera.width, camera.height];
        let principal = [camera.cx, camera.cy];
        let origin: [i32; 2] =
            std::array::from_fn(|axis| principal[axis].floor().clamp(0.0, f64::from(size[axis])) as i32);
        Self {
            origin,
            offset: std::array::from_fn(|axis| principal[axis] - 0.5 - f64::from(origin[axis])),
            low: origin.map(|origin| -origin as f32),
            high: std::array::from_fn(|axis| (size[axis] as i32 - origin[axis]) as f32),
        }
    }
}

impl Rasteriser {
    /// A rasteriser at this level, or at the best one that the machine has.
    pub fn new(level: SimdLevel) -> Self {
        Self {
            level: level.usable(),
            facing: Vec::new(),
            projected: Projected::default(),
            clipped: Default::default(),
            clipped_normals: Vec::new(),
            survivors: Survivors::default(),
            target: Target::default(),
            column_max: Vec::new(),
            crop: DepthCrop::default(),
        }
    }

    /// The depth image of a mesh: the crop is tight, the smallest box that holds every pixel with a return, and empty
    /// (0 x 0 at (0, 0)) when there is none.
    ///
    /// Parts nearer than `camera.near` and parts outside the image are cut off. Against exact rays through the pixel
    /// centres depth is off by a few times 1e-7 of its value (single precision).
    pub fn render(
        &mut self,
        mesh: &RenderMesh,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
    ) -> &DepthCrop {
        let lens = Lens::new(camera);
        let rows = mesh.rows(camera_from_object);
        // Project all vertices if the bounding sphere is beyond the near plane; otherwise clip the triangles first.
        let bounds = if rows[2][3] - mesh.radius() > camera.near {
            let eye = camera_from_object.inverse().translation() - mesh.centre().coords;
            mesh.facing(&eye, &mut self.facing);
            let bounds = self.project(mesh, camera, &lens, &rows);
            self.target.reset(bounds);
            kernels::cull(self.level, &mesh.corners, &mesh.normals, &self.facing, &self.projected, &mut self.survivors);
            bounds
        } else {
            let bounds = self.project_clipped(mesh, camera, &lens, &rows);
            self.target.reset(bounds);
            let clusters = 0..(self.clipped[0].len() / RenderMesh::CLUSTER) as u32;
            self.facing.clear();
            self.facing.extend(clusters.map(|cluster| Facing { cluster, ray: [0.0; 3], away: f32::INFINITY }));
            self.clipped_normals.clear();
            self.clipped_normals.resize(self.clipped[0].len(), 0);
            kernels::cull(
                self.level,
                &self.clipped,
                &self.clipped_normals,
                &self.facing,
                &self.projected,
                &mut self.survivors,
            );
            bounds
        };
        // Fill small triangles by class of size, then large ones.
        if self.target.width > 0 {
            let two_sided = !mesh.culls_back_faces();
            for class in 0..kernels::SMALL_CLASSES {
                let (level, survivors) = (self.level, &mut self.survivors);
                kernels::fill_small(level, survivors, class, &self.projected, two_sided, &mut self.target);
            }
            kernels::fill_large(self.level, &self.survivors, &self.projected, two_sided, &mut self.target);
        }
        self.finish(bounds, &lens);
        &self.crop
    }

    /// The last image.
    pub fn crop(&self) -> &DepthCrop {
        &self.crop
    }

    /// The last image, for a sensor model to work on.
    pub fn crop_mut(&mut self) -> &mut DepthCrop {
        &mut self.crop
    }

    /// Every vertex to image coordinates; all of them are in front of the camera. Returns the box of the pixels whose
    /// centres lie in the box of the vertices: first column, first row, past-the-end column, past-the-end row.
    fn project(&mut self, mesh: &RenderMesh, camera: &Intrinsics, lens: &Lens, rows: &[[f64; 4]; 3]) -> [i32; 4] {
        self.projected.resize(mesh.positions[0].len());
        if mesh.positions[0].is_empty() {
            return [0; 4];
        }
        let scale = [camera.fx, camera.fy, 1.0];
        let rows = std::array::from_fn(|row| rows[row].map(|value| (value * scale[row]) as f32));
        let offset = lens.offset.map(|offset| offset as f32);
        let bounds = kernels::project(
            self.level,
            &mesh.positions,
            &kernels::Projection { rows, offset, low: lens.low, high: lens.high },
            &mut self.projected,
        );
        bounds.map(|bound| bound as i32)
    }

    /// Projects a mesh that reaches behind the near plane, as [`Self::project`]: triangles are cut at the plane, and
    /// the remaining ones are written to `self.clipped`. A rare case, so plain code in double precision.
    fn project_clipped(
        &mut self,
        mesh: &RenderMesh,
        camera: &Intrinsics,
        lens: &Lens,
        rows: &[[f64; 4]; 3],
    ) -> [i32; 4] {
        self.projected.resize(0);
        self.clipped.iter_mut().for_each(Vec::clear);
        let mut bounds = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];
        // Vertices in the camera's frame.
        let seen: Vec<Vector3<f64>> = (0..mesh.positions[0].len() as u32)
            .map(|vertex| {
                let p = mesh.position(vertex);
                Vector3::from_fn(|row, _| {
                    let [a, b, c, d] = rows[row];
                    a * p.x + b * p.y + c * p.z + d
                })
            })
            .collect();
        // Cut each triangle at the near plane and split the polygon into a fan.
        for triangle in 0..mesh.corners[0].len() {
            let corners = mesh.corners.each_ref().map(|corner| seen[corner[triangle] as usize]);
            let polygon = clip_near(&corners, camera.near);
            for last in 2..polygon.len() {
                for (corner, point) in [polygon[0], polygon[last - 1], polygon[last]].into_iter().enumerate() {
                    let vertex = self.projected.push(project_point(&point, camera, lens), lens.low, lens.high);
                    let [column, row] = self.projected.pixel(vertex);
                    bounds = [bounds[0].min(column), bounds[1].min(row), bounds[2].max(column), bounds[3].max(row)];
                    self.clipped[corner].push(vertex);
                }
            }
        }
        let triangles = self.clipped[0].len();
        if triangles == 0 {
            return [0; 4];
        }
        // Fill up to whole clusters.
        for corner in &mut self.clipped {
            corner.resize(triangles.next_multiple_of(RenderMesh::CLUSTER), 0);
        }
        bounds
    }

    /// From the z-buffer to the crop.
    fn finish(&mut self, bounds: [i32; 4], lens: &Lens) {
        let width = self.target.width;
        self.column_max.clear();
        self.column_max.resize(width, 0.0);
        let (mut top, mut bottom) = (usize::MAX, 0);
        if width > 0 {
            kernels::column_maxima(self.level, &self.target, &mut self.column_max, &mut top, &mut bottom);
        }
        let left = self.column_max.iter().position(|w| *w > 0.0);
        let right = self.column_max.iter().rposition(|w| *w > 0.0);
        self.crop.depth.clear();
        let (Some(left), Some(right)) = (left, right) else {
            self.crop = DepthCrop { depth: std::mem::take(&mut self.crop.depth), ..DepthCrop::default() };
            return;
        };
        self.crop.left = (bounds[0] + left as i32 + lens.origin[0]) as u32;
        self.crop.top = (bounds[1] + top as i32 + lens.origin[1]) as u32;
        self.crop.width = (right - left + 1) as u32;
        self.crop.height = (bottom - top + 1) as u32;
        self.crop.depth.resize((right - left + 1) * (bottom - top + 1), 0.0);
        kernels::metres(self.level, &self.target, left, top, right - left + 1, &mut self.crop.depth);
    }
}

/// A point in front of the camera in image coordinates.
fn project_point(point: &Vector3<f64>, camera: &Intrinsics, lens: &Lens) -> Fragment {
    let w = 1.0 / point.z;
    Fragment {
        u: (camera.fx * point.x * w + lens.offset[0]) as f32,
        v: (camera.fy * point.y * w + lens.offset[1]) as f32,
        w: w as f32,
    }
}

/// The part of a triangle beyond the plane z = `near`: nothing, a triangle or a quadrangle (Sutherland and Hodgman 1974).
fn clip_near(corners: &[Vector3<f64>; 3], near: f64) -> Vec<Vector3<f64>> {
    let mut polygon = Vec::with_capacity(4);
    for (index, a) in corners.iter().enumerate() {
        let b = &corners[(index + 1) % 3];
        if a.z >= near {
            polygon.push(*a);
        }
        if (a.z >= near) != (b.z >= near) {
            // From the nearer end, so that both triangles at an edge find the same point.
            let (low, high) = if a.z < b.z { (a, b) } else { (b, a) };
            let mut cut = low + (high - low) * ((near - low.z) / (high.z - low.z));
            cut.z = near;
            polygon.push(cut);
        }
    }
    polygon
}
