//! Record of a view: camera, which body each pixel sees, and the silhouette of each body alone.

use prost::Message;

use super::ViewFacts;
use crate::{
    PixelMask, SceneContainer,
    codec::{
        RecordError,
        fields::{broken, intrinsics, lengthy, pose, ranged},
        proto, sample_from_proto, wire,
    },
};
use kernel::{
    geom::{CameraCv, Intrinsics, Object, Pose, World},
    ids::{Digest, ObjectId, SampleId},
};

const MESSAGE: &str = "SceneImage";

/// A settled scene as one camera sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneImage {
    /// Which sample.
    pub sample: SampleId,
    /// The camera [px].
    pub camera: Intrinsics,
    /// Pose of the camera in the scene.
    pub world_from_camera: Pose<World, CameraCv>,
    /// Container of the scene.
    pub container: SceneContainer,
    /// Sides of the table below it, along x and y [m].
    pub table: [f64; 2],
    /// The bodies of the scene, in its order.
    pub bodies: Vec<SceneInstance>,
    /// Map of the true scene, what each pixel sees: [`Self::NOTHING`], the number of a body from 1, [`Self::CONTAINER`] or
    /// [`Self::TABLE`]. Shape (height, width), row-major.
    pub instances: Vec<u8>,
    /// With a sensor, what each measured depth belongs to: as `instances`, or [`Self::BETWEEN`], and [`Self::NOTHING`] where
    /// there is no return.
    pub point_instances: Option<Vec<u8>>,
    /// Cameras discarded before this one that were inside or next to something.
    pub near_draws: u32,
    /// Cameras discarded before this one that saw too little of every body.
    pub unseen_draws: u32,
}

/// A body of a scene in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneInstance {
    /// The body's object.
    pub object: ObjectId,
    /// Pose of the object in the scene.
    pub world_from_object: Pose<World, Object>,
    /// Pixels of its silhouette alone, including those outside the image.
    pub pixels_all: u32,
    /// Pixels that see it.
    pub pixels_visible: u32,
    /// Left, top, width and height of its whole silhouette; may extend beyond the image [px].
    pub whole_box: [i32; 4],
    /// Left, top, width and height of the pixels that see it; zeros if none does [px].
    pub visible_box: [u32; 4],
    /// Silhouette alone, in the image.
    pub mask: PixelMask,
    /// Nearness to the sensor; `None` without one.
    pub near: Option<NearBody>,
}

/// Nearness of a body to a depth sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NearBody {
    /// Pixels that see it nearer than the sensor measures.
    pub pixels: u32,
    /// Smallest true depth of the pixels that see it [m]; 0 if none does.
    pub nearest: f32,
}

impl SceneInstance {
    /// Visible share of its silhouette; 0 for a body without a pixel.
    pub fn visible_share(&self) -> f64 {
        f64::from(self.pixels_visible) / f64::from(self.pixels_all.max(1))
    }

    /// Whether at least half of the pixels that see it see it nearer than the sensor measures.
    pub fn is_too_near(&self) -> bool {
        self.near.is_some_and(|near| near.pixels > 0 && 2 * near.pixels >= self.pixels_visible)
    }

    /// Whether it extends beyond the image.
    pub fn is_truncated(&self) -> bool {
        self.mask.count() < self.pixels_all
    }
}

impl SceneImage {
    /// Number of pixels that see nothing.
    pub const NOTHING: u8 = 0;

    /// Number of depths between those of two bodies.
    pub const BETWEEN: u8 = 253;

    /// Number of pixels that see the container.
    pub const CONTAINER: u8 = 254;

    /// Number of pixels that see the table.
    pub const TABLE: u8 = 255;

    /// Bodies of a scene, at most.
    pub const MAX_BODIES: usize = 252;

    /// Count and box of the pixels that see each of some bodies.
    pub fn visible(instances: &[u8], width: u32, bodies: usize) -> Vec<(u32, [u32; 4])> {
        let mut counts = [0u32; 256];
        let mut ends = [[u32::MAX, u32::MAX, 0, 0]; 256];
        for (row, line) in (0..).zip(instances.chunks_exact(width as usize)) {
            let mut column = 0;
            for run in line.chunk_by(|one, other| one == other) {
                let (own, length) = (usize::from(run[0]), run.len() as u32);
                counts[own] += length;
                let [left, top, right, bottom] = &mut ends[own];
                (*left, *right) = ((*left).min(column), (*right).max(column + length));
                (*top, *bottom) = ((*top).min(row), row + 1);
                column += length;
            }
        }
        let of = |number: usize| {
            let [left, top, right, bottom] = ends[number];
            (counts[number], if counts[number] == 0 { [0; 4] } else { [left, top, right - left, bottom - top] })
        };
        (1..=bodies).map(of).collect()
    }

    /// Counts for tables.
    pub fn facts(&self) -> ViewFacts {
        let (near_draws, unseen_draws) = (self.near_draws, self.unseen_draws);
        let mut facts = ViewFacts { near_draws, unseen_draws, ..ViewFacts::default() };
        for body in &self.bodies {
            facts.add(body.visible_share(), body.is_truncated());
            facts.too_near += u32::from(body.is_too_near());
            let nearest = body.near.map_or(0.0, |near| f64::from(near.nearest));
            if nearest > 0.0 && (facts.nearest == 0.0 || nearest < facts.nearest) {
                facts.nearest = nearest;
            }
        }
        facts
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let bodies = || self.bodies.iter();
        wire::sample(out, 1, &self.sample);
        wire::camera(out, 2, &self.camera);
        wire::doubles(out, 3, &self.world_from_camera.to_rows());
        wire::bytes(out, 4, self.container.name().as_bytes());
        wire::doubles(out, 5, &self.container.sizes());
        wire::doubles(out, 6, &self.table);
        let objects: Vec<u8> = bodies().flat_map(|body| body.object.0.0).collect();
        wire::bytes(out, 7, &objects);
        wire::doubles_of(out, 8, bodies().flat_map(|body| body.world_from_object.to_rows()));
        wire::bytes(out, 9, &self.instances);
        wire::uint32s(out, 10, bodies().map(|body| body.pixels_all));
        wire::uint32s(out, 11, bodies().map(|body| body.mask.count()));
        wire::uint32s(out, 12, bodies().map(|body| body.pixels_visible));
        let whole: Vec<u8> = bodies().flat_map(|body| body.whole_box).flat_map(i32::to_le_bytes).collect();
        wire::bytes(out, 13, &whole);
        let visible: Vec<u32> = bodies().flat_map(|body| body.visible_box).collect();
        wire::uint32s(out, 14, visible.iter().copied());
        let boxes: Vec<u32> = bodies().map(|body| &body.mask).flat_map(box_of).collect();
        wire::uint32s(out, 15, boxes.iter().copied());
        wire::bytes(out, 16, &bodies().flat_map(|body| &body.mask.bits).copied().collect::<Vec<u8>>());
        wire::bytes(out, 17, self.point_instances.as_deref().unwrap_or_default());
        wire::uint32(out, 18, self.near_draws);
        wire::uint32(out, 19, self.unseen_draws);
        self.container.encode_mesh(out, [20, 21]);
        let near: Vec<NearBody> = bodies().filter_map(|body| body.near).collect();
        wire::uint32s(out, 22, near.iter().map(|near| near.pixels));
        wire::singles(out, 23, near.iter().map(|near| near.nearest));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length, a range, a rotation or a count does not hold, or a body is seen outside its own silhouette.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::SceneImage::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        let camera = intrinsics(MESSAGE, raw.camera)?;
        let pixels = camera.width as usize * camera.height as usize;
        lengthy(MESSAGE, "table_size", 2, raw.table_size.len())?;
        let table = [raw.table_size[0], raw.table_size[1]];
        let flat = table.iter().find(|side| !(**side > 0.0 && side.is_finite()));
        ranged(MESSAGE, "table_size", flat.copied().unwrap_or(1.0), flat.is_none(), "positive and finite")?;
        let count = raw.pixels_all.len();
        let fits = (1..=Self::MAX_BODIES).contains(&count);
        ranged(MESSAGE, "pixels_all", count as f64, fits, "1 to 252 bodies")?;
        lengthy(MESSAGE, "instances", pixels, raw.instances.len())?;
        check_numbers("instances", &raw.instances, count, false)?;
        let point_instances = (!raw.point_instances.is_empty()).then_some(raw.point_instances);
        if let Some(points) = &point_instances {
            lengthy(MESSAGE, "point_instances", pixels, points.len())?;
            check_numbers("point_instances", points, count, true)?;
        }
        lengthy(MESSAGE, "objects", 32 * count, raw.objects.len())?;
        lengthy(MESSAGE, "world_from_object", 12 * count, raw.world_from_object.len())?;
        lengthy(MESSAGE, "pixels_in_image", count, raw.pixels_in_image.len())?;
        lengthy(MESSAGE, "pixels_visible", count, raw.pixels_visible.len())?;
        lengthy(MESSAGE, "whole_boxes", 16 * count, raw.whole_boxes.len())?;
        lengthy(MESSAGE, "visible_boxes", 4 * count, raw.visible_boxes.len())?;
        lengthy(MESSAGE, "mask_boxes", 4 * count, raw.mask_boxes.len())?;
        let whole: Vec<i32> = (raw.whole_boxes.chunks_exact(4))
            .map(|bytes| i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            .collect();
        // A sensor measures all of them, or none.
        let measured = if point_instances.is_some() { count } else { 0 };
        lengthy(MESSAGE, "pixels_too_near", measured, raw.pixels_too_near.len())?;
        lengthy(MESSAGE, "nearest_depths", measured, raw.nearest_depths.len())?;
        let near = raw.pixels_too_near.iter().zip(&raw.nearest_depths);
        let near: Vec<NearBody> =
            near.map(|(pixels, nearest)| NearBody { pixels: *pixels, nearest: *nearest }).collect();
        let masks = masks(&camera, &raw.mask_boxes, &raw.masks)?;
        let visible = Self::visible(&raw.instances, camera.width, count);
        let mut bodies = Vec::with_capacity(count);
        for (index, mask) in masks.into_iter().enumerate() {
            let body = SceneInstance {
                object: ObjectId(Digest(raw.objects[32 * index..][..32].try_into().expect("32 bytes"))),
                world_from_object: pose(MESSAGE, "world_from_object", &raw.world_from_object[12 * index..][..12])?,
                pixels_all: raw.pixels_all[index],
                pixels_visible: raw.pixels_visible[index],
                whole_box: whole[4 * index..][..4].try_into().expect("four numbers"),
                visible_box: raw.visible_boxes[4 * index..][..4].try_into().expect("four numbers"),
                mask,
                near: near.get(index).copied(),
            };
            for (field, stated, counted) in [
                ("pixels_in_image", raw.pixels_in_image[index], body.mask.count()),
                ("pixels_visible", body.pixels_visible, visible[index].0),
            ] {
                if stated != counted {
                    return Err(RecordError::Count { message: MESSAGE, field, stated, counted });
                }
            }
            check_boxes(&body, visible[index].1)?;
            check_near(&body)?;
            bodies.push(body);
        }
        check_seen(&raw.instances, &camera, &bodies)?;
        Ok(Self {
            sample,
            camera,
            world_from_camera: pose(MESSAGE, "world_from_camera", &raw.world_from_camera)?,
            container: SceneContainer::of(
                MESSAGE,
                &raw.container,
                &raw.container_size,
                [&raw.container_vertices, &raw.container_triangles],
            )?,
            table,
            bodies,
            instances: raw.instances,
            point_instances,
            near_draws: raw.near_draws,
            unseen_draws: raw.unseen_draws,
        })
    }
}

fn box_of(mask: &PixelMask) -> [u32; 4] {
    [mask.left, mask.top, mask.width, mask.height]
}

/// Checks that every number of a map is nothing, a body, the container or the table.
fn check_numbers(field: &'static str, map: &[u8], bodies: usize, of_points: bool) -> Result<(), RecordError> {
    let is_known = |number: &u8| match *number {
        SceneImage::CONTAINER | SceneImage::TABLE => true,
        SceneImage::BETWEEN => of_points,
        number => usize::from(number) <= bodies,
    };
    let strange = map.iter().find(|number| !is_known(number));
    let value = strange.map_or(0.0, |number| f64::from(*number));
    ranged(MESSAGE, field, value, strange.is_none(), "nothing, a body of the scene, container or table")
}

/// The silhouettes, from their boxes and their bits, one after the other.
fn masks(camera: &Intrinsics, boxes: &[u32], mut bits: &[u8]) -> Result<Vec<PixelMask>, RecordError> {
    for side in boxes.chunks_exact(4) {
        for (first, length, whole) in [(side[0], side[2], camera.width), (side[1], side[3], camera.height)] {
            let fits = u64::from(first) + u64::from(length) <= u64::from(whole);
            ranged(MESSAGE, "mask_boxes", f64::from(length), fits, "inside the image")?;
        }
    }
    let pixels_of = |side: &[u32]| side[2] as usize * side[3] as usize;
    let total: usize = boxes.chunks_exact(4).map(|side| pixels_of(side).div_ceil(8)).sum();
    lengthy(MESSAGE, "masks", total, bits.len())?;
    let mut masks = Vec::new();
    for side in boxes.chunks_exact(4) {
        let ([left, top, width, height], pixels) = ([side[0], side[1], side[2], side[3]], pixels_of(side));
        let (own, rest) = bits.split_at(pixels.div_ceil(8));
        let padding = own.last().map_or(0, |last| u32::from(*last) >> (8 - (8 * own.len() - pixels)));
        ranged(MESSAGE, "masks", f64::from(padding), padding == 0, "without bits after the last pixel")?;
        masks.push(PixelMask { left, top, width, height, bits: own.to_vec() });
        bits = rest;
    }
    Ok(masks)
}

/// Checks the boxes of a body: the whole silhouette contains the part in the image, which contains the visible pixels.
fn check_boxes(body: &SceneInstance, visible: [u32; 4]) -> Result<(), RecordError> {
    let fits = body.visible_box == visible;
    ranged(MESSAGE, "visible_boxes", f64::from(body.visible_box[0]), fits, "the box of the pixels that see the body")?;
    let [left, top, width, height] = body.whole_box.map(i64::from);
    let mask = box_of(&body.mask).map(i64::from);
    let holds = mask[2] * mask[3] == 0
        || left <= mask[0] && top <= mask[1] && left + width >= mask[0] + mask[2] && top + height >= mask[1] + mask[3];
    let is_box = width >= 0 && height >= 0 && (width * height == 0) == (body.pixels_all == 0);
    ranged(MESSAGE, "whole_boxes", width as f64, holds && is_box, "a box that holds the silhouette in the image")?;
    let counted = body.mask.count();
    let fits = counted <= body.pixels_all && i64::from(body.pixels_all) <= width * height;
    ranged(MESSAGE, "pixels_all", f64::from(body.pixels_all), fits, "from those in the image to those of the box")
}

/// Checks that at most the visible pixels are too near, and that a visible body has a nearest depth.
fn check_near(body: &SceneInstance) -> Result<(), RecordError> {
    let Some(NearBody { pixels, nearest }) = body.near else { return Ok(()) };
    let fits = pixels <= body.pixels_visible;
    ranged(MESSAGE, "pixels_too_near", f64::from(pixels), fits, "at most pixels_visible")?;
    let fits = nearest.is_finite() && nearest >= 0.0 && (nearest > 0.0) == (body.pixels_visible > 0);
    ranged(MESSAGE, "nearest_depths", f64::from(nearest), fits, "above 0 for a visible body, else 0")
}

/// Checks that every body is seen only inside its own silhouette.
fn check_seen(instances: &[u8], camera: &Intrinsics, bodies: &[SceneInstance]) -> Result<(), RecordError> {
    for (row, line) in (0..).zip(instances.chunks_exact(camera.width as usize)) {
        for (column, own) in (0..).zip(line) {
            let body = bodies.get(usize::from(*own).wrapping_sub(1));
            let is_inside = body.is_none_or(|body| body.mask.get(column, row));
            ranged(MESSAGE, "instances", f64::from(*own), is_inside, "a body inside its own silhouette")?;
        }
    }
    Ok(())
}
