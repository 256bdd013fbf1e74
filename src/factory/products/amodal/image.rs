//! An image of a scene as its pairs need it: which body each depth is of, and where each line of sight ends.

use std::sync::Arc;

use super::{meshes::LoadedObject, scene::StillSolid, settings::PointSource};
use crate::products::viewed::redraw;
use format::{SceneImage, SceneInstance};
use kernel::{
    geom::{CameraCv, DepthCrop, Object, Pose, SimdLevel},
    render::{LayeredImage, Rasteriser},
};

/// An image of a scene.
pub(super) struct ViewImage {
    /// Camera, bodies and which of them each pixel sees.
    pub record: SceneImage,
    /// Depth of the whole image [m]: as the sensor measured it, or exact.
    pub depth: DepthCrop,
    /// The depth that is of the body that was taken last [m].
    pub body: DepthCrop,
    points: PointSource,
    /// Left, top, width and height of the pixels whose measured depth is taken for each body.
    boxes: Vec<[u32; 4]>,
    image: LayeredImage,
    rasteriser: Rasteriser,
}

/// Count of the depths that are of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BodyPoints {
    /// All that are taken for it.
    pub all: u32,
    /// Depths among them that were measured on its surface.
    pub own: u32,
}

impl ViewImage {
    /// An image before its depth is known.
    pub fn new(record: SceneImage, points: PointSource, level: SimdLevel) -> Self {
        let (image, rasteriser) = (LayeredImage::new(record.camera, level), Rasteriser::new(level));
        let (depth, body, boxes) = (DepthCrop::default(), DepthCrop::default(), Vec::new());
        Self { record, depth, body, points, boxes, image, rasteriser }
    }

    /// Takes the depth that a sensor measured.
    pub fn measured(&mut self, depth: DepthCrop) {
        self.depth = depth;
        let visible = SceneImage::visible(self.owners(), self.record.camera.width, self.record.bodies.len());
        self.boxes = visible.into_iter().map(|(_, visible_box)| visible_box).collect();
    }

    /// Takes another image; its depth is to be set.
    pub fn with(&mut self, record: SceneImage) -> &mut Self {
        self.record = record;
        self
    }

    /// Renders the depth of an image without a sensor: the stored one is rounded to its step. Returns whether each
    /// pixel sees the same body as in the image.
    pub fn render(&mut self, bodies: &[Arc<LoadedObject>], still: &StillSolid) -> bool {
        let Self { record, image, depth, .. } = self;
        let bodies = bodies.iter().map(|object| &object.render);
        redraw(image, record, bodies, (still.container_surface.as_ref(), &still.table), depth)
    }

    /// Pose of a body as the camera sees it.
    pub fn camera_from_object(&self, body: &SceneInstance) -> Pose<CameraCv, Object> {
        self.record.world_from_camera.inverse() * body.world_from_object
    }

    /// Number of the body that each depth of the image is taken for. Shape (height, width), row-major.
    fn owners(&self) -> &[u8] {
        match (&self.record.point_instances, self.points) {
            (Some(measured), PointSource::Surface) => measured,
            _ => &self.record.instances,
        }
    }

    /// Takes the depth of one body, by its number from 1; counts its points.
    pub fn take_body(&mut self, number: u8, object: &LoadedObject) -> BodyPoints {
        let mut body = std::mem::take(&mut self.body);
        if self.record.point_instances.is_none() {
            // As completion renders the object alone, bit for bit; obstacles in front of it are removed below.
            let pose = self.camera_from_object(&self.record.bodies[usize::from(number) - 1]);
            let alone = self.rasteriser.render(&object.pair.kernel.render, &self.record.camera, &pose);
            body.clone_from(alone);
        } else {
            let [left, top, width, height] = self.boxes[usize::from(number) - 1];
            self.copy_window([left, top, left + width, top + height], &mut body);
        }
        let (owners, measured) = (self.owners(), self.record.point_instances.as_deref());
        let mut counts = BodyPoints::default();
        self.for_pixels(&mut body, |depth, pixel| {
            if owners[pixel] != number {
                *depth = f32::NAN;
            } else if !depth.is_nan() {
                counts.all += 1;
                counts.own += u32::from(measured.is_none_or(|measured| measured[pixel] == number));
            }
        });
        self.body = body;
        counts
    }

    /// Copies the depth of a part of the image: first column and row, past-the-end column and row.
    fn copy_window(&self, [left, top, right, bottom]: [u32; 4], crop: &mut DepthCrop) {
        (crop.left, crop.top, crop.width, crop.height) = (left, top, right - left, bottom - top);
        crop.depth.clear();
        for row in top..bottom {
            let first = row as usize * self.depth.width as usize;
            crop.depth.extend_from_slice(&self.depth.depth[first + left as usize..first + right as usize]);
        }
    }

    /// The depth of everything but one body in a part of the image.
    pub fn others(&self, number: u8, window: [u32; 4], crop: &mut DepthCrop) {
        self.copy_window(window, crop);
        self.for_pixels(crop, |depth, pixel| {
            if self.owners()[pixel] == number {
                *depth = f32::NAN;
            }
        });
    }

    /// Depth at which each line of sight through a part of the image ends: NaN where it meets nothing, 0 where the sensor has no
    /// depth of what it meets.
    pub fn sight(&self, window: [u32; 4], crop: &mut DepthCrop) {
        self.copy_window(window, crop);
        self.for_pixels(crop, |depth, pixel| {
            if depth.is_nan() && self.record.instances[pixel] != SceneImage::NOTHING {
                *depth = 0.0;
            }
        });
    }

    /// Visits each depth of a part of the image with the index of its pixel in the whole image.
    fn for_pixels(&self, crop: &mut DepthCrop, mut visit: impl FnMut(&mut f32, usize)) {
        let (stride, width) = (self.record.camera.width as usize, (crop.width as usize).max(1));
        for (y, row) in crop.depth.chunks_exact_mut(width).enumerate() {
            let first = (crop.top as usize + y) * stride + crop.left as usize;
            row.iter_mut().zip(first..).for_each(|(depth, pixel)| visit(depth, pixel));
        }
    }
}
