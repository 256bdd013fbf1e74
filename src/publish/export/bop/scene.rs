//! One scene of BOP: its images with cameras, poses, counts, boxes and masks.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde_json::{Map, Value, json};

use super::{
    models::Model,
    text::{DEPTH_SCALES, LEAST_SEEN, MM, pretty},
};
use crate::export::{
    error::ExportError,
    image_file::{colour_png, depth_png, depth_scale, mask_png},
    rle::run_lengths,
    target::Target,
};
use format::{SceneColour, SceneImage, SceneInstance};
use kernel::{
    geom::{CameraCv, DepthCrop, Object, Pose, World},
    ids::{ObjectId, SampleIndex},
};

/// An image with its depth, and its colours if it has any.
pub(super) struct Shown<'a> {
    pub view: SampleIndex,
    pub image: &'a SceneImage,
    pub depth: &'a DepthCrop,
    pub colour: Option<&'a SceneColour>,
}

/// Boxes of a body in an image: of its full silhouette, and of its visible pixels; left, top, width and height [px].
type InstanceBoxes = [[u32; 4]; 2];

/// Texts of a scene that is being written, by image number.
pub(super) struct SceneTexts {
    folder: String,
    number: u32,
    camera: Map<String, Value>,
    poses: Map<String, Value>,
    info: Map<String, Value>,
    images: Vec<Value>,
    /// Annotations of COCO without boxes, and their boxes.
    annotations: Vec<(Map<String, Value>, InstanceBoxes)>,
    /// Numbers of the objects in the scene.
    categories: Vec<u32>,
}

impl SceneTexts {
    /// Starts a scene with this number in the folder of its split.
    pub fn new(split: &str, number: u32) -> Self {
        Self {
            folder: format!("{split}/{number:06}"),
            number,
            camera: Map::new(),
            poses: Map::new(),
            info: Map::new(),
            images: Vec::new(),
            annotations: Vec::new(),
            categories: Vec::new(),
        }
    }

    /// Number of the scene in its split.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Count of the images so far: the number of the next one.
    pub fn count(&self) -> usize {
        self.camera.len()
    }

    /// Writes the files of the next image and records it; returns the millimetres per step of its depth.
    ///
    /// # Errors
    /// When a depth does not fit into the file, or a file can't be written.
    pub fn write_image(
        &mut self,
        shown: &Shown<'_>,
        models: &BTreeMap<ObjectId, Model>,
        target: &mut Target,
    ) -> Result<f64, ExportError> {
        let Shown { image, colour, .. } = *shown;
        let SceneImage { camera, world_from_camera, .. } = image;
        let (number, size) = (self.count(), [camera.width, camera.height]);
        let (folder, camera_from_world) = (self.folder.clone(), world_from_camera.inverse());
        let whole = shown.depth.whole(camera.width, camera.height);
        let scale = depth_scale(&whole, &DEPTH_SCALES);
        self.camera.insert(
            number.to_string(),
            json!({
                "cam_K": [camera.fx, 0.0, camera.cx - 0.5, 0.0, camera.fy, camera.cy - 0.5, 0.0, 0.0, 1.0],
                "depth_scale": scale,
                "cam_R_w2c": by_rows(camera_from_world.rotation()),
                "cam_t_w2c": millimetres(camera_from_world.translation()),
            }),
        );
        target.write(&format!("{folder}/depth/{number:06}.png"), &depth_png(size, &whole, scale, shown.view)?)?;
        if let Some(colour) = colour {
            target.write(&format!("{folder}/rgb/{number:06}.png"), &colour_png(size, &colour.rgb))?;
        }
        let kind = if colour.is_some() { "rgb" } else { "depth" };
        self.images.push(json!({
            "id": number, "file_name": format!("{kind}/{number:06}.png"), "width": size[0], "height": size[1],
        }));
        self.categories = models.values().map(|model| model.number).collect();
        let (mut poses, mut infos) = (Vec::new(), Vec::new());
        for (index, body) in image.bodies.iter().enumerate() {
            let Some(model) = models.get(&body.object) else { continue };
            poses.push(pose(&camera_from_world, body, model));
            let alone = body.mask.whole(size[0], size[1]);
            let seen: Vec<bool> = image.instances.iter().map(|own| usize::from(*own) == index + 1).collect();
            infos.push(info(body, alone.iter().zip(&whole).filter(|(own, depth)| **own && !depth.is_nan()).count()));
            for (kind, mask) in [("mask", &alone), ("mask_visib", &seen)] {
                target.write(&format!("{folder}/{kind}/{number:06}_{index:06}.png"), &mask_png(size, mask))?;
            }
            if body.pixels_visible > 0 {
                self.annotate(number, (body, model), [&alone, &seen], size);
            }
        }
        self.poses.insert(number.to_string(), poses.into());
        self.info.insert(number.to_string(), infos.into());
        Ok(scale)
    }

    /// Records a body in an image, with the masks of its silhouette and of its visible pixels.
    fn annotate(
        &mut self,
        image: usize,
        (body, model): (&SceneInstance, &Model),
        [alone, seen]: [&[bool]; 2],
        [width, height]: [u32; 2],
    ) {
        let annotation = json!({
            "id": self.annotations.len() + 1,
            "image_id": image,
            "category_id": model.number,
            "iscrowd": 0,
            "area": body.pixels_visible,
            "segmentation": run_lengths(seen, width, height),
            "width": width,
            "height": height,
            "ignore": body.visible_share() < LEAST_SEEN,
        });
        let Value::Object(annotation) = annotation else { unreachable!("an annotation is a table") };
        self.annotations.push((annotation, [box_of(alone, width), body.visible_box]));
    }

    /// Writes the texts.
    ///
    /// # Errors
    /// When a file can't be written.
    pub fn finish(mut self, target: &mut Target) -> Result<(), ExportError> {
        self.categories.sort_unstable();
        let coco = ["scene_gt_coco.json", "scene_gt_coco_modal.json"].map(|name| name.to_owned());
        for (kind, name) in coco.into_iter().enumerate() {
            target.write(&format!("{}/{name}", self.folder), self.coco(kind).to_string().as_bytes())?;
        }
        for (name, table) in
            [("scene_camera.json", self.camera), ("scene_gt.json", self.poses), ("scene_gt_info.json", self.info)]
        {
            target.write(&format!("{}/{name}", self.folder), pretty(&table.into()).as_bytes())?;
        }
        Ok(())
    }

    /// The annotations in COCO's layout, with one of their boxes.
    fn coco(&self, kind: usize) -> Value {
        let category = |number: &u32| json!({ "id": number, "name": number.to_string(), "supercategory": "graspmill" });
        let annotation = |(annotation, boxes): &(Map<String, Value>, [[u32; 4]; 2])| {
            let mut annotation = annotation.clone();
            annotation.insert("bbox".to_owned(), json!(boxes[kind]));
            annotation
        };
        json!({
            "info": { "description": self.folder },
            "licenses": [],
            "images": self.images,
            "annotations": self.annotations.iter().map(annotation).collect::<Vec<_>>(),
            "categories": self.categories.iter().map(category).collect::<Vec<_>>(),
        })
    }
}

/// Left, top, width and height of the set pixels of a mask; zeros if no pixel is set.
fn box_of(mask: &[bool], width: u32) -> [u32; 4] {
    let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
    for (row, line) in (0..).zip(mask.chunks_exact(width as usize)) {
        for (column, _) in (0..).zip(line).filter(|(_, own)| **own) {
            low = [low[0].min(column), low[1].min(row)];
            high = [high[0].max(column + 1), high[1].max(row + 1)];
        }
    }
    if high == [0; 2] { [0; 4] } else { [low[0], low[1], high[0] - low[0], high[1] - low[1]] }
}

/// Pose of a model, whose origin is the centre of the object's box.
fn pose(camera_from_world: &Pose<CameraCv, World>, body: &SceneInstance, model: &Model) -> Value {
    let camera_from_object: Pose<CameraCv, Object> = *camera_from_world * body.world_from_object;
    let at = camera_from_object.point(&model.centre.into()).coords;
    json!({
        "obj_id": model.number,
        "cam_R_m2c": by_rows(camera_from_object.rotation()),
        "cam_t_m2c": millimetres(&at),
    })
}

/// Counts and boxes of a body.
fn info(body: &SceneInstance, valid: usize) -> Value {
    let is_seen = body.pixels_visible > 0;
    let bbox = |[left, top, width, height]: [i64; 4]| match is_seen {
        true => [left, top, width - 1, height - 1],
        false => [-1; 4],
    };
    json!({
        "bbox_obj": bbox(body.whole_box.map(i64::from)),
        "bbox_visib": bbox(body.visible_box.map(i64::from)),
        "px_count_all": body.pixels_all,
        "px_count_valid": valid,
        "px_count_visib": body.pixels_visible,
        "visib_fract": body.visible_share(),
    })
}

fn by_rows(rotation: &Rotation3<f64>) -> Vec<f64> {
    let matrix: &Matrix3<f64> = rotation.matrix();
    matrix.transpose().iter().copied().collect()
}

fn millimetres(metres: &Vector3<f64>) -> [f64; 3] {
    [metres.x, metres.y, metres.z].map(|value| MM * value)
}
