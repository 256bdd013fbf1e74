//! Views as a dataset of the BOP challenge: models in millimetres, scenes of depth, poses and masks, targets of its test images.
//!
//! Layout and fields by the format description of BOP (bop.felk.cvut.cz, "BOP format") and its toolkit's rules of counting:
//! `px_count_all` counts parts outside the image, boxes are the largest minus the smallest pixel, without adding 1, whole
//! silhouettes are not clipped, and all values are -1 if the body is not visible. Pixel centres are whole numbers there and at
//! +0.5 here, so `cam_K` has half a pixel less.

mod models;
mod scene;
mod text;

use std::collections::BTreeMap;

use serde_json::{Value, json};

use self::{
    models::write_models,
    scene::{SceneTexts, Shown},
    text::{LEAST_SEEN, pretty},
};
use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    selected::SelectedSamples,
    target::Target,
};
use format::{Depth, Noun, Product, SceneColour, SceneImage, dataset::DatasetReader};
use kernel::{geom::DepthCrop, ids::ObjectId, words::Split};

/// Views as scenes of the BOP challenge.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "bop",
    summary: "Views as a dataset of the BOP challenge: models, depth, poses, masks, boxes and targets.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::VIEWS,
        counted: Noun { one: "view", many: "views" },
        keys: &[],
        layout: |_| {
            "models/obj_ID.ply in mm about the centre of the object's box, models_eval/ the same surfaces in edges of at most a 50th of the \
             diameter, each with models_info.json (boxes, diameters, symmetries); objects.json (name, digest, centre of the box in the \
             object's own frame); camera.json of the first image; test_targets_bop19.json and test_targets_bop24.json where test images \
             are exported; train, val_holdout (views of training objects that are held out), val and test: a folder per scene with \
             scene_camera.json, scene_gt.json, scene_gt_info.json, scene_gt_coco.json (boxes of silhouettes in the image), \
             scene_gt_coco_modal.json (boxes of visible pixels), depth (16 bits, depth_scale mm), rgb if the views have colours, mask and \
             mask_visib; pixel centres are whole numbers"
        },
        write,
    }],
};

/// Images of the test split, and their sufficiently visible objects.
#[derive(Default)]
struct Targets {
    /// Image, object and number of visible instances, for localisation.
    bop19: Vec<Value>,
    /// Images, for detection.
    bop24: Vec<Value>,
}

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let models = write_models(reader, &assets.objects, target)?;
    // Scenes are numbered within the folder of their split, in the dataset's order.
    let mut numbers: BTreeMap<&'static str, u32> = BTreeMap::new();
    let mut current: Option<(ObjectId, SceneTexts)> = None;
    let (mut targets, mut camera) = (Targets::default(), None);
    selected.each(|stored, sample| {
        let (image, depth, colour) =
            (stored.read::<SceneImage>()?, stored.find::<Depth>()?, stored.find::<SceneColour>()?);
        let depth = depth.map_or_else(DepthCrop::default, |depth| depth.crop);
        let split = reader.split(sample.index);
        if current.as_ref().is_none_or(|(scene, _)| *scene != sample.id.subject) {
            finish(current.take(), target)?;
            let number = numbers.entry(folder_of(split)).or_default();
            current = Some((sample.id.subject, SceneTexts::new(folder_of(split), *number)));
            *number += 1;
        }
        let Some((_, scene)) = &mut current else { unreachable!("a scene was started") };
        if split == Some(Split::Test) {
            targets.add(scene, &image, |object| models.get(&object).map(|model| model.number));
        }
        let shown = Shown { view: sample.index, image: &image, depth: &depth, colour: colour.as_ref() };
        let scale = scene.write_image(&shown, &models, target)?;
        camera.get_or_insert_with(|| {
            let camera = image.camera;
            json!({
                "width": camera.width, "height": camera.height, "fx": camera.fx, "fy": camera.fy,
                "cx": camera.cx - 0.5, "cy": camera.cy - 0.5, "depth_scale": scale,
            })
        });
        Ok(())
    })?;
    finish(current, target)?;
    target.write("camera.json", pretty(&camera.unwrap_or_default()).as_bytes())?;
    targets.write(target)?;
    Ok(Written::selection(selected.count(), "views", selection))
}

/// Ends a scene.
fn finish(scene: Option<(ObjectId, SceneTexts)>, target: &mut Target) -> Result<(), ExportError> {
    scene.map_or(Ok(()), |(_, texts)| texts.finish(target))
}

/// Folder of a split, by BOP's names of splits and split types.
fn folder_of(split: Option<Split>) -> &'static str {
    match split {
        None | Some(Split::Training) => "train",
        Some(Split::Holdout) => "val_holdout",
        Some(Split::Validation) => "val",
        Some(Split::Test) => "test",
    }
}

impl Targets {
    /// Adds the next image of a scene.
    fn add(&mut self, scene: &SceneTexts, image: &SceneImage, number_of: impl Fn(ObjectId) -> Option<u32>) {
        let (scene_id, im_id) = (scene.number(), scene.count());
        self.bop24.push(json!({ "scene_id": scene_id, "im_id": im_id }));
        let seen = image.bodies.iter().filter(|body| body.visible_share() >= LEAST_SEEN);
        let mut counts: BTreeMap<u32, u32> = BTreeMap::new();
        seen.filter_map(|body| number_of(body.object)).for_each(|number| *counts.entry(number).or_default() += 1);
        self.bop19.extend(counts.into_iter().map(|(obj_id, inst_count)| {
            json!({ "scene_id": scene_id, "im_id": im_id, "obj_id": obj_id, "inst_count": inst_count })
        }));
    }

    /// Writes the lists, unless there is no test image.
    fn write(self, target: &mut Target) -> Result<(), ExportError> {
        if self.bop24.is_empty() {
            return Ok(());
        }
        for (name, list) in [("test_targets_bop19.json", self.bop19), ("test_targets_bop24.json", self.bop24)] {
            target.write(name, pretty(&list.into()).as_bytes())?;
        }
        Ok(())
    }
}
