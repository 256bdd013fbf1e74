//! Random-ray touch: rays from the object's far side towards the camera, along its optical axis, meant to meet what the
//! camera did not see (thesis ch. 6).
//!
//! With [`RayTarget::Mesh`] a ray starts on the far side of the object's box in the camera's axes, anywhere over that side
//! with equal chance, and meets the mesh. With [`RayTarget::Cells`], as in the thesis, it runs along a column of the
//! complete grid, drawn with equal chance and with replacement, from the last cell towards the camera, and stops at the
//! lower corner of the first occupied cell.
//!
//! Among other things a ray with [`RayTarget::Mesh`] ends at its first hit. It starts slightly behind the box, where a
//! touching surface leaves no room: a side of the object that rests on a table or against a neighbour is not touched. A
//! ray that leaves the box at the front has missed.

use nalgebra::{Point3, Unit, Vector3};

use super::{
    seen::SeenSurface,
    settings::{RandomRays, RayTarget},
};
use format::{BlockedProbe, TactileContacts, TouchContact, VoxelPair};
use kernel::{
    geom::{GridPlacement, Ray},
    seed::Stream,
};

/// Room behind the object's box that a ray needs among other things [m].
const ROOM: f64 = 1e-3;

impl SeenSurface<'_> {
    /// Sends random rays at the object of a pair. `stream` is the sample's own of the name `touch`; `drop_index_zero` is the
    /// quirk of the pair's grids: a contact in a cell with index 0 on any axis counts as outside.
    pub fn random_rays(
        &self,
        rays: RandomRays,
        pair: &VoxelPair,
        drop_index_zero: bool,
        stream: &mut Stream,
        out: &mut TactileContacts,
    ) {
        (out.sample, out.resolution, out.probes) = (pair.sample, pair.grid.resolution, rays.count);
        out.contacts.clear();
        out.misses.clear();
        out.blocked.clear();
        out.hand = None;
        match rays.target {
            RayTarget::Mesh => self.meet_mesh(rays.count, &pair.grid, drop_index_zero, stream, out),
            RayTarget::Cells => self.meet_cells(rays.count, pair, stream, out),
        }
    }

    fn meet_mesh(
        &self,
        count: u32,
        grid: &GridPlacement,
        drop_index_zero: bool,
        stream: &mut Stream,
        out: &mut TactileContacts,
    ) {
        let reach = self.render.reach(self.surface.level(), self.camera_from_object);
        let [[left, right], [top, bottom], [near, far]] = reach;
        // Clear of the box: a flat back is in the plane that rays are measured from.
        let margin = far - near + 1e-3;
        let towards_camera = Unit::new_unchecked(-Vector3::z());
        let direction = Unit::new_normalize(self.object_from_camera.rotation() * towards_camera.into_inner());
        for probe in 0..count {
            let (x, y) = (stream.uniform(left, right), stream.uniform(top, bottom));
            let start = self.object_from_camera.point(&Point3::new(x, y, far + margin));
            let hit = self.surface.first_hit(&Ray::new(&start, &direction));
            let hit = hit.map(|(distance, normal)| ((distance - margin).max(0.0), normal));
            // What the ray meets before the object, or before it leaves the box.
            let way = hit.map_or(far - near, |(distance, _)| distance);
            let behind = Point3::new(x, y, far + ROOM);
            if let Some(met) = self.around.first_met(&behind, &towards_camera, ROOM + way) {
                let position = single(&(behind + towards_camera.into_inner() * met.distance));
                out.blocked.push(BlockedProbe { probe, by: met.number, position });
                continue;
            }
            let Some((distance, normal)) = hit else {
                out.misses.push(single(&Point3::new(x, y, far)));
                continue;
            };
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
