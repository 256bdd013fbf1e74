//! Depth of a triangle mesh by a z-buffer in the object's projected box.
//!
//! At a metre most triangles of a scan cover no pixel centre at all, so the work is to say so quickly: each vertex
//! stores the first pixel whose centre lies at or after it, and a triangle whose corners agree on one axis is done.
//! What is left is tested at its pixel centres by edge functions. Coordinates are taken relative to the pixel centre
//! before they are multiplied, so that the function of an edge is exactly the negative of its neighbour's: no pixel on a
//! shared edge is lost. 1/z is affine in the image; the largest wins.

use crate::geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, TriMesh};

/// A mesh laid out for rendering: coordinates relative to the centre of its box, each axis apart.
pub struct PlainMesh {
    centre: nalgebra::Point3<f64>,
    position: [Vec<f32>; 3],
    triangles: Vec<[u32; 3]>,
    cull_back_faces: bool,
}

impl PlainMesh {
    /// `cull_back_faces` only for a watertight mesh wound outward: then nobody outside sees a back face first.
    pub fn new(mesh: &TriMesh, cull_back_faces: bool) -> Self {
        let centre = mesh.aabb().map_or_else(nalgebra::Point3::origin, |bounds| bounds.centre());
        let axis = |axis: usize| mesh.vertices.iter().map(|v| (f64::from(v[axis]) - centre[axis]) as f32).collect();
        Self { centre, position: [axis(0), axis(1), axis(2)], triangles: mesh.triangles.clone(), cull_back_faces }
    }

    /// Count of vertices.
    pub fn vertices(&self) -> usize {
        self.position[0].len()
    }

    /// Vertex indices, shape (triangles, 3).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}

/// The vertices of a mesh as one view sees them; what the raster and the complete grid share.
#[derive(Default)]
pub struct ViewVertices {
    /// Coordinates in `CameraCv` [m], each axis apart.
    pub camera: [Vec<f32>; 3],
}

impl ViewVertices {
    /// Moves the vertices of `mesh` into the camera's frame.
    pub fn place(&mut self, mesh: &PlainMesh, camera_from_object: &Pose<CameraCv, Object>) {
        // The centre moves in double precision; single precision only sees the small offsets from it.
        let centre = camera_from_object.point(&mesh.centre);
        let rotation = camera_from_object.rotation().matrix();
        let [x, y, z] = &mesh.position;
        for (axis, out) in self.camera.iter_mut().enumerate() {
            let row = [0, 1, 2].map(|column| rotation[(axis, column)] as f32);
            let offset = centre[axis] as f32;
            out.clear();
            out.extend(x.iter().zip(y).zip(z).map(|((x, y), z)| row[0] * x + row[1] * y + row[2] * z + offset));
        }
    }
}

/// One thread's z-buffer, reused from view to view.
#[derive(Default)]
pub struct PlainRaster {
    image: [Vec<f32>; 2],
    inverse_depth: Vec<f32>,
    first_pixel: Vec<[i16; 2]>,
    buffer: Vec<f32>,
}

/// The camera's numbers as the kernel wants them: image coordinates relative to a whole pixel near the principal point.
struct Projection {
    focal: [f32; 2],
    shift: [f32; 2],
    origin: [i32; 2],
    near: f32,
}

impl Projection {
    fn of(camera: &Intrinsics) -> Self {
        let whole = [camera.cx.floor(), camera.cy.floor()];
        Self {
            focal: [camera.fx as f32, camera.fy as f32],
            shift: [(camera.cx - whole[0]) as f32, (camera.cy - whole[1]) as f32],
            origin: whole.map(|pixel| pixel as i32),
            near: camera.near as f32,
        }
    }

    fn image(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let inverse = 1.0 / z;
        [self.focal[0] * x * inverse + self.shift[0], self.focal[1] * y * inverse + self.shift[1], inverse]
    }
}

/// The pixels that a view may touch, relative to the projection's origin; upper ends excluded.
#[derive(Clone, Copy, Default)]
struct Window {
    low: [i32; 2],
    high: [i32; 2],
}

impl Window {
    fn width(&self) -> usize {
        (self.high[0] - self.low[0]).max(0) as usize
    }

    fn height(&self) -> usize {
        (self.high[1] - self.low[1]).max(0) as usize
    }
}

impl PlainRaster {
    /// Depth of the mesh whose vertices stand in `placed`; `crop` is the mesh's projected box inside the image.
    pub fn render(&mut self, mesh: &PlainMesh, placed: &ViewVertices, camera: &Intrinsics, crop: &mut DepthCrop) {
        let projection = Projection::of(camera);
        self.project(placed, &projection);
        let window = self.window(placed, camera, &projection);
        self.buffer.clear();
        self.buffer.resize(window.width() * window.height(), 0.0);
        for triangle in &mesh.triangles {
            self.triangle(mesh, placed, &projection, &window, *triangle);
        }
        crop.left = (window.low[0] + projection.origin[0]).max(0) as u32;
        crop.top = (window.low[1] + projection.origin[1]).max(0) as u32;
        (crop.width, crop.height) = (window.width() as u32, window.height() as u32);
        crop.depth.clear();
        crop.depth.extend(self.buffer.iter().map(|inverse| if *inverse > 0.0 { 1.0 / inverse } else { f32::NAN }));
    }

    fn project(&mut self, placed: &ViewVertices, projection: &Projection) {
        let [x, y, z] = &placed.camera;
        self.inverse_depth.clear();
        self.inverse_depth.extend(z.iter().map(|z| 1.0 / z));
        for (axis, coordinates) in [x, y].into_iter().enumerate() {
            let (focal, shift) = (projection.focal[axis], projection.shift[axis]);
            self.image[axis].clear();
            self.image[axis]
                .extend(coordinates.iter().zip(&self.inverse_depth).map(|(c, inverse)| focal * c * inverse + shift));
        }
        let [u, v] = &self.image;
        self.first_pixel.clear();
        self.first_pixel.extend(u.iter().zip(v).map(|(u, v)| [first_pixel(*u), first_pixel(*v)]));
    }

    /// The projected box of the mesh, cut to the image; the whole image when part of the mesh is nearer than `near`.
    fn window(&self, placed: &ViewVertices, camera: &Intrinsics, projection: &Projection) -> Window {
        let image_low = projection.origin.map(|pixel| -pixel);
        let image_high = [camera.width as i32 - projection.origin[0], camera.height as i32 - projection.origin[1]];
        if placed.camera[2].iter().any(|z| *z < projection.near) {
            return Window { low: image_low, high: image_high };
        }
        let mut window = Window { low: image_high, high: image_low };
        for pixel in &self.first_pixel {
            for axis in 0..2 {
                let pixel = i32::from(pixel[axis]);
                window.low[axis] = window.low[axis].min(pixel);
                window.high[axis] = window.high[axis].max(pixel);
            }
        }
        for axis in 0..2 {
            window.low[axis] = window.low[axis].clamp(image_low[axis], image_high[axis]);
            window.high[axis] = window.high[axis].clamp(window.low[axis], image_high[axis]);
        }
        window
    }

    fn triangle(
        &mut self,
        mesh: &PlainMesh,
        placed: &ViewVertices,
        projection: &Projection,
        window: &Window,
        triangle: [u32; 3],
    ) {
        let corners = triangle.map(|vertex| vertex as usize);
        let depths = corners.map(|vertex| placed.camera[2][vertex]);
        if depths.iter().any(|z| *z < projection.near) {
            let corners = corners.map(|vertex| [0, 1, 2].map(|axis| placed.camera[axis][vertex]));
            self.clipped(mesh, projection, window, corners);
            return;
        }
        let pixels = corners.map(|vertex| self.first_pixel[vertex]);
        let low = [0, 1].map(|axis| pixels.iter().map(|pixel| pixel[axis]).min().unwrap_or(0));
        let high = [0, 1].map(|axis| pixels.iter().map(|pixel| pixel[axis]).max().unwrap_or(0));
        if low[0] == high[0] || low[1] == high[1] {
            return;
        }
        let corners = corners.map(|vertex| [self.image[0][vertex], self.image[1][vertex], self.inverse_depth[vertex]]);
        self.fill(mesh.cull_back_faces, window, corners, low.map(i32::from), high.map(i32::from));
    }

    /// A triangle that reaches behind the near plane: cut there, then filled as a fan.
    fn clipped(&mut self, mesh: &PlainMesh, projection: &Projection, window: &Window, corners: [[f32; 3]; 3]) {
        let mut polygon: Vec<[f32; 3]> = Vec::with_capacity(4);
        for (place, a) in corners.iter().enumerate() {
            let b = &corners[(place + 1) % 3];
            if a[2] >= projection.near {
                polygon.push(*a);
            }
            if (a[2] >= projection.near) != (b[2] >= projection.near) {
                let t = (projection.near - a[2]) / (b[2] - a[2]);
                polygon.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), projection.near]);
            }
        }
        for fan in 1..polygon.len().saturating_sub(1) {
            let corners = [polygon[0], polygon[fan], polygon[fan + 1]].map(|corner| projection.image(corner));
            let bound = |axis: usize, pick: fn(f32, f32) -> f32| {
                let value = pick(corners[0][axis], pick(corners[1][axis], corners[2][axis]));
                i32::from(first_pixel(value))
            };
            let (low, high) = ([bound(0, f32::min), bound(1, f32::min)], [bound(0, f32::max), bound(1, f32::max)]);
            self.fill(mesh.cull_back_faces, window, corners, low, high);
        }
    }

    /// Tests the pixel centres from `low` to before `high`.
    fn fill(&mut self, cull: bool, window: &Window, corners: [[f32; 3]; 3], low: [i32; 2], high: [i32; 2]) {
        let low = [low[0].max(window.low[0]), low[1].max(window.low[1])];
        let high = [high[0].min(window.high[0]), high[1].min(window.high[1])];
        for row in low[1]..high[1] {
            let start = (row - window.low[1]) as usize * window.width();
            let dv = corners.map(|corner| corner[1] - (row as f32 + 0.5));
            for column in low[0]..high[0] {
                let du = corners.map(|corner| corner[0] - (column as f32 + 0.5));
                let edges = [(1, 2), (2, 0), (0, 1)].map(|(a, b): (usize, usize)| du[a] * dv[b] - du[b] * dv[a]);
                // Rows grow downwards, so outward faces turn clockwise: their area is negative in (u, v) with v up, and
                // positive here.
                let front = edges.iter().all(|edge| *edge >= 0.0);
                let back = !cull && edges.iter().all(|edge| *edge <= 0.0);
                let area = edges[0] + edges[1] + edges[2];
                if (front || back) && area != 0.0 {
                    let [w0, w1, w2] = corners.map(|corner| corner[2]);
                    let inverse = w0 + (edges[1] * (w1 - w0) + edges[2] * (w2 - w0)) / area;
                    let cell = &mut self.buffer[start + (column - window.low[0]) as usize];
                    *cell = cell.max(inverse);
                }
            }
        }
    }
}

/// The first pixel whose centre lies at or after an image coordinate; far outside any image it is as good as the last.
fn first_pixel(coordinate: f32) -> i16 {
    let whole = coordinate.floor();
    (whole as i32 + i32::from(coordinate - whole > 0.5)).clamp(-20_000, 20_000) as i16
}
