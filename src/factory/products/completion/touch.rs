//! Random-ray touch: rays from the object's far side towards the camera, along its optical axis, meant to meet what the
//! camera did not see (thesis ch. 6).
//!
//! With [`RayTarget::Mesh`] a ray starts on the far side of the object's box in the camera's axes, anywhere over that side
//! with equal chance, and meets the mesh. With [`RayTarget::Cells`], as in the thesis, it runs along a column of the
//! complete grid, drawn with equal chance and with replacement, from the last cell towards the camera, and stops at the
//! lower corner of the first occupied cell.

use std::sync::Arc;

use nalgebra::{Point3, Unit, Vector3};

use super::settings::{RandomRays, RayTarget};
use format::{TactileContacts, TouchContact, VoxelPair};
use kernel::{
    geom::{CameraCv, GridPlacement, Object, Pose, Ray, RenderMesh, SimdLevel, TriMesh, TriangleTree},
    seed::Stream,
};

/// Surface nearer than this to a contact does not hide it [m]: the triangle itself, and what rounding makes of its
/// neighbours.
const CLEARANCE: f64 = 1e-6;

/// An object's surface for rays.
pub struct TouchSurface {
    tree: Arc<TriangleTree>,
    level: SimdLevel,
}

/// The surface as a view has it.
pub(super) struct SeenSurface<'a> {
    /// Closed and wound outward: what faces away from the camera is hidden by the object itself.
    closed: bool,
    surface: &'a TouchSurface,
    camera_from_object: &'a Pose<CameraCv, Object>,
    object_from_camera: Pose<Object, CameraCv>,
}

impl TouchSurface {
    /// Kernels at this level, or at the best one that the machine has.
    pub fn new(mesh: &TriMesh, level: SimdLevel) -> Self {
        Self::of_tree(&Arc::new(TriangleTree::new(mesh)), level)
    }

    /// The surface of a mesh whose tree has been built already.
    pub fn of_tree(tree: &Arc<TriangleTree>, level: SimdLevel) -> Self {
        Self { tree: Arc::clone(tree), level: level.usable() }
    }

    /// Sends random rays at the object of a pair. `render` is the same mesh; `stream` is the sample's own of the name
    /// `touch`; `drop_index_zero` is the quirk of the pair's grids: a contact in a cell with index 0 on any axis counts as
    /// outside.
    pub fn random_rays(
        &self,
        render: &RenderMesh,
        rays: RandomRays,
        pair: &VoxelPair,
        drop_index_zero: bool,
        stream: &mut Stream,
        out: &mut TactileContacts,
    ) {
        let camera_from_object = &pair.camera_from_object;
        let seen = self.seen(render, camera_from_object);
        (out.sample, out.resolution, out.probes) = (pair.sample, pair.grid.resolution, rays.count);
        out.contacts.clear();
        out.misses.clear();
        out.hand = None;
        match rays.target {
            RayTarget::Mesh => {
                let reach = render.reach(self.level, camera_from_object);
                seen.meet_mesh(rays.count, reach, &pair.grid, drop_index_zero, stream, out);
            }
            RayTarget::Cells => seen.meet_cells(rays.count, pair, stream, out),
        }
    }

    /// The surface as a view has it; `render` is the same mesh.
    pub(super) fn seen<'a>(
        &'a self,
        render: &RenderMesh,
        camera_from_object: &'a Pose<CameraCv, Object>,
    ) -> SeenSurface<'a> {
        let object_from_camera = camera_from_object.inverse();
        SeenSurface { closed: render.culls_back_faces(), surface: self, camera_from_object, object_from_camera }
    }
}

impl SeenSurface<'_> {
    fn meet_mesh(
        &self,
        count: u32,
        [[left, right], [top, bottom], [near, far]]: [[f64; 2]; 3],
        grid: &GridPlacement,
        drop_index_zero: bool,
        stream: &mut Stream,
        out: &mut TactileContacts,
    ) {
        // Clear of the box: a flat back lies on the very plane that rays are counted from.
        let margin = far - near + 1e-3;
        let towards_camera = Unit::new_unchecked(-Vector3::z());
        let direction = Unit::new_normalize(self.object_from_camera.rotation() * towards_camera.into_inner());
        for probe in 0..count {
            let (x, y) = (stream.uniform(left, right), stream.uniform(top, bottom));
            let start = self.object_from_camera.point(&Point3::new(x, y, far + margin));
            let tree = &self.surface.tree;
            let hit = tree.first_hit(self.surface.level, &Ray::new(&start, &direction), f64::INFINITY);
            // A triangle without area is never met.
            let Some((hit, normal)) = hit.and_then(|hit| Some((hit, tree.normal(&hit)?))) else {
                out.misses.push(single(&Point3::new(x, y, far)));
                continue;
            };
            let distance = (hit.distance - margin).max(0.0);
            let normal = self.camera_from_object.rotation() * normal.into_inner();
            // The side that a ray from outside comes to is the outer one, however the triangle is wound.
            let normal = if normal.z < 0.0 { -normal } else { normal };
            let point = Point3::new(x, y, far - distance);
            let position = single(&point);
            out.contacts.push(TouchContact {
                probe,
                position,
                normal: normal.map(|part| part as f32).into(),
                distance: distance as f32,
                visible: self.sees(&point, &normal),
                cell: cell_of(grid, position).filter(|cell| !(drop_index_zero && cell.contains(&0))),
            });
        }
    }

    fn meet_cells(&self, count: u32, pair: &VoxelPair, stream: &mut Stream, out: &mut TactileContacts) {
        let (n, lower) = (pair.grid.resolution, pair.grid.lower_corner());
        let corner = |cell: [u32; 3]| lower + Vector3::from(cell.map(f64::from)) * pair.grid.cell_size;
        for probe in 0..count {
            let [x, y] = [0; 2].map(|_: u32| stream.below(u64::from(n)) as u32);
            let Some(z) = (0..n).rev().find(|z| pair.complete.get([x, y, *z])) else {
                out.misses.push(single(&corner([x, y, n - 1])));
                continue;
            };
            let position = corner([x, y, z]);
            out.contacts.push(TouchContact {
                probe,
                position: single(&position),
                // Of the cell's side that the ray comes to.
                normal: [0.0, 0.0, 1.0],
                distance: (f64::from(n - 1 - z) * pair.grid.cell_size) as f32,
                visible: self.is_visible(&position),
                cell: Some([x, y, z]),
            });
        }
    }

    /// Whether the camera sees a point of the surface, both in `CameraCv`: it does not see what faces away on a closed surface.
    pub fn sees(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> bool {
        // A ray that enters a closed surface has to leave it before it comes to the camera.
        !(self.closed && normal.dot(&point.coords) > 0.0) && self.is_visible(point)
    }

    /// Whether no surface stands between the camera and a point in `CameraCv`.
    fn is_visible(&self, point: &Point3<f64>) -> bool {
        let towards_camera = self.object_from_camera.rotation() * -point.coords;
        let length = towards_camera.norm();
        let start = self.object_from_camera.point(point) + towards_camera * (CLEARANCE / length);
        let ray = Ray::new(&start, &Unit::new_unchecked(towards_camera / length));
        !self.surface.tree.blocks(self.surface.level, &ray, length - CLEARANCE)
    }
}

pub(super) fn single(point: &Point3<f64>) -> [f32; 3] {
    point.coords.map(|value| value as f32).into()
}

/// The cell of a point in `CameraCv` [m]; `None` outside the grid.
pub(super) fn cell_of(grid: &GridPlacement, position: [f32; 3]) -> Option<[u32; 3]> {
    let n = f64::from(grid.resolution);
    let cell = grid.coordinates_of(position.map(f64::from)).map(f64::floor);
    cell.iter().all(|index| (0.0..n).contains(index)).then(|| cell.map(|index| index as u32))
}
