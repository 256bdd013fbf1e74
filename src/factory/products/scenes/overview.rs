//! The picture of a scene from above: the depth of each body alone, of which the nearest counts.

use format::{SceneContainer, SceneOverview};
use kernel::{
    geom::{CameraCv, DepthCrop, Object, Pose, RenderMesh, SimdLevel, World},
    ids::SampleId,
    render::LayeredImage,
};

/// Width and height of the picture [px].
const SIZE: [u32; 2] = [240, 180];

/// Height of the camera over its largest view, as a multiple of that: the view is narrow, so that walls hide little.
const DISTANCE: f64 = 2.0;

/// Room around the container [m].
const AROUND: f64 = 0.01;

/// Paints pictures of one container; its memory is reused.
pub(super) struct Painter {
    level: SimdLevel,
    /// Made with the first picture.
    image: Option<LayeredImage>,
    depth: DepthCrop,
    walls: Option<RenderMesh>,
    focal: f64,
    camera_z: f64,
}

impl Painter {
    /// A painter whose pictures hold the whole container.
    pub fn new(container: &SceneContainer, level: SimdLevel) -> Self {
        let walls = container.mesh().map(|mesh| RenderMesh::new(&mesh, true));
        let (sides, rim) = match *container {
            SceneContainer::Plane { size } => (size, 0.0),
            SceneContainer::Bin { inner, wall, tilt_deg: 0.0 } => {
                ([inner[0] + 2.0 * wall, inner[1] + 2.0 * wall], inner[2])
            }
            SceneContainer::Bin { .. } | SceneContainer::Mesh { .. } => {
                let bounds = container.mesh().and_then(|mesh| mesh.aabb()).expect("all but a plane have walls");
                let across = |axis: usize| 2.0 * bounds.max[axis].max(-bounds.min[axis]);
                ([across(0), across(1)], bounds.max.z)
            }
        };
        let sides = sides.map(|side| side + 2.0 * AROUND);
        let camera_z = DISTANCE * sides[0].max(sides[1]) + rim;
        let fit = |axis: usize| f64::from(SIZE[axis]) * (camera_z - rim) / sides[axis];
        let focal = fit(0).min(fit(1));
        Self { level, image: None, depth: DepthCrop::default(), walls, focal, camera_z }
    }

    /// The picture of some bodies.
    pub fn paint<'b>(
        &mut self,
        sample: SampleId,
        bodies: impl Iterator<Item = (&'b RenderMesh, &'b Pose<World, Object>)>,
    ) -> SceneOverview {
        let [width, height] = SIZE;
        let pixels = (width * height) as usize;
        let (focal, camera_z) = (self.focal, self.camera_z);
        let mut overview =
            SceneOverview { sample, size: SIZE, focal, camera_z, instances: vec![0; pixels], depths: vec![0; pixels] };
        let (camera, camera_from_world) = (overview.camera(), overview.camera_from_world());
        let image = self.image.get_or_insert_with(|| LayeredImage::new(camera, self.level));
        image.begin(camera);
        for (number, (mesh, world_from_object)) in (1..).zip(bodies) {
            let camera_from_object: Pose<CameraCv, Object> = camera_from_world * *world_from_object;
            image.add(mesh, &camera_from_object, number);
        }
        if let Some(walls) = &self.walls {
            let camera_from_walls: Pose<CameraCv, Object> = Pose::from_isometry(*camera_from_world.isometry());
            image.add(walls, &camera_from_walls, SceneOverview::WALLS);
        }
        overview.instances.copy_from_slice(image.instances());
        image.depth(&mut self.depth);
        for (depth, nearest) in overview.depths.iter_mut().zip(&self.depth.depth) {
            let steps = f64::from(*nearest) / SceneOverview::STEP;
            *depth = if nearest.is_nan() { 0 } else { steps.round().min(f64::from(u16::MAX)) as u16 };
        }
        overview
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use assets::{built_in_source, prepare};
    use kernel::ids::{Digest, ItemId, ObjectId};

    #[test]
    fn what_lies_above_hides_what_lies_below_and_depths_are_those_of_the_tops() {
        let mesh = prepare(&built_in_source("box-01")).expect("a sound shape").mesh;
        let bounds = mesh.aabb().expect("vertices");
        let render = RenderMesh::new(&mesh, false);
        let container = SceneContainer::Bin { inner: [0.4, 0.3, 0.2], wall: 0.02, tilt_deg: 0.0 };
        let mut painter = Painter::new(&container, SimdLevel::Scalar);
        let at = |height: f64| Pose::from_xyz_rpy([0.0, 0.0, height - bounds.min.z, 0.0, 0.0, 0.0]);
        let (low, high) = (at(0.0), at(0.1));
        let sample = SampleId::of_object(ObjectId(Digest([1; 32])), ItemId(0));
        let overview = painter.paint(sample, [(&render, &low), (&render, &high)].into_iter());
        let [width, height] = overview.size;
        let (column, row) = (width / 2, height / 2);
        let index = (row * width + column) as usize;
        assert_eq!(overview.instances[index], 2);
        let expected = overview.camera_z - (0.1 + bounds.max.z - bounds.min.z);
        assert!((f64::from(overview.depth(column, row)) - expected).abs() < 2e-4, "{expected}");
        // The floor of the bin, the walls at the border, and the whole picture inside the frame.
        assert_eq!(overview.instances[(row * width + 20) as usize], SceneOverview::WALLS);
        assert!(overview.instances.iter().filter(|instance| **instance == 0).count() > 0);
        assert_eq!(painter.paint(sample, std::iter::empty()).instances.iter().filter(|own| **own == 2).count(), 0);
    }
}
