//! Views as one COCO file of instances with its images: boxes and masks of the visible pixels, with the full silhouettes.

use serde_json::json;

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    image_file::{colour_png, depth_png},
    rle::run_lengths,
    selected::SelectedSamples,
    target::Target,
};
use format::{
    Depth, Noun, Product, SceneColour, SceneImage,
    dataset::{AssetRow, DatasetReader},
};

/// Millimetres per step of a depth image.
const DEPTH_SCALE: f64 = 1.0;

/// Views as COCO instances.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "coco",
    summary: "Views as COCO instances: images, boxes, masks and visible shares.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::VIEWS,
        counted: Noun { one: "view", many: "views" },
        keys: &[],
        layout: |_| {
            "instances.json: images (file_name below this folder: rgb/*.png in colour, 8 bits, or depth/*.png if the views have no colours, 16 bits, depth in mm, 0 = no return; depth_file_name is always the depth image; sample, \
             scene, split and intrinsics; pixel centres at +0.5), categories (name and digest of each object) and annotations: bbox, area \
             and segmentation of the pixels that see the body, as uncompressed run lengths, with amodal_bbox (not clipped), \
             amodal_segmentation (in the image), amodal_area (including parts outside the image) and visible_share"
        },
        write,
    }],
};

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let (mut images, mut annotations) = (Vec::new(), Vec::new());
    selected.each(|stored, sample| {
        let (image, colour) = (stored.read::<SceneImage>()?, stored.find::<SceneColour>()?);
        let camera = image.camera;
        let (id, size) = (images.len() + 1, [camera.width, camera.height]);
        let depth_name = match stored.find::<Depth>()? {
            Some(depth) => {
                let name = format!("depth/{:06}.png", sample.index.0);
                let whole = depth.crop.whole(camera.width, camera.height);
                target.write(&name, &depth_png(size, &whole, DEPTH_SCALE, sample.index)?)?;
                Some(name)
            }
            None => None,
        };
        let colour_name = match colour {
            Some(colour) => {
                let name = format!("rgb/{:06}.png", sample.index.0);
                target.write(&name, &colour_png(size, &colour.rgb))?;
                Some(name)
            }
            None => None,
        };
        let Some(file_name) = colour_name.or_else(|| depth_name.clone()) else {
            return Err(ExportError::NoImages { view: sample.index });
        };
        images.push(json!({
            "id": id, "width": camera.width, "height": camera.height,
            "file_name": file_name, "depth_file_name": depth_name, "depth_scale": DEPTH_SCALE,
            "sample": sample.id.to_string(), "scene": sample.subject, "split": sample.split,
            "fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy,
        }));
        annotate(&mut annotations, id, &image, &assets.objects);
        Ok(())
    })?;
    let category = |(number, row): (usize, &AssetRow)| json!({ "id": number, "name": row.name, "object": row.object.to_string(), "supercategory": "object" });
    let categories: Vec<_> = (1..).zip(&assets.objects).map(category).collect();
    let root = reader.manifest().root;
    let instances = json!({
        "info": { "description": format!("views of a graspmill dataset with root {root}"), "version": root.to_string() },
        "licenses": [],
        "images": images,
        "categories": categories,
        "annotations": annotations,
    });
    target.write("instances.json", instances.to_string().as_bytes())?;
    Ok(Written::selection(selected.count(), "views", selection))
}

/// Adds the bodies in an image.
fn annotate(annotations: &mut Vec<serde_json::Value>, image_id: usize, image: &SceneImage, objects: &[AssetRow]) {
    let [width, height] = [image.camera.width, image.camera.height];
    for (number, body) in (1u8..).zip(&image.bodies).filter(|(_, body)| body.pixels_visible > 0) {
        let category = objects.iter().position(|row| row.object == body.object);
        let seen: Vec<bool> = image.instances.iter().map(|own| *own == number).collect();
        annotations.push(json!({
            "id": annotations.len() + 1,
            "image_id": image_id,
            "category_id": category.map_or(0, |category| category + 1),
            "iscrowd": 0,
            "instance": number,
            "area": body.pixels_visible,
            "bbox": body.visible_box,
            "segmentation": run_lengths(&seen, width, height),
            "amodal_area": body.pixels_all,
            "amodal_bbox": body.whole_box,
            "amodal_segmentation": run_lengths(&body.mask.whole(width, height), width, height),
            "visible_share": body.visible_share(),
        }));
    }
}
