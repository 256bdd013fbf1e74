//! Views as one COCO file of instances: boxes and masks of what is seen, with the silhouettes beside them.

use serde_json::json;

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    rle::run_lengths,
    selected::SelectedSamples,
    target::Target,
};
use format::{Noun, Product, dataset::DatasetReader};

/// Views as COCO instances.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "coco",
    summary: "Views as COCO instances: boxes, masks and shares of what is seen.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::VIEWS,
        counted: Noun { one: "view", many: "views" },
        keys: &[],
        layout: |_| {
            "instances.json: images (with sample, scene, split and intrinsics; pixel centres at +0.5), categories (name and digest \
             of each object) and annotations: bbox, area and segmentation of the pixels that see the body, as uncompressed run \
             lengths, with amodal_bbox (not clipped), amodal_segmentation (in the image), amodal_area (parts outside the image \
             included) and visible_share"
        },
        write,
    }],
};

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let (mut images, mut annotations) = (Vec::new(), Vec::new());
    selected.each(|sample, names| {
        let image = sample.scene_image()?;
        let camera = image.camera;
        let (id, [width, height]) = (images.len() + 1, [camera.width, camera.height]);
        images.push(json!({
            "id": id, "width": width, "height": height, "file_name": format!("{:06}", names.index.0),
            "sample": names.id.to_string(), "scene": names.subject, "split": names.split,
            "fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy,
        }));
        for (number, body) in (1u8..).zip(&image.bodies).filter(|(_, body)| body.pixels_visible > 0) {
            let category = assets.objects.iter().position(|row| row.object == body.object);
            let seen: Vec<bool> = image.instances.iter().map(|own| *own == number).collect();
            let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
            let alone: Vec<bool> = pixels.map(|(column, row)| body.mask.get(column, row)).collect();
            annotations.push(json!({
                "id": annotations.len() + 1,
                "image_id": id,
                "category_id": category.map_or(0, |category| category + 1),
                "iscrowd": 0,
                "instance": number,
                "area": body.pixels_visible,
                "bbox": body.visible_box,
                "segmentation": run_lengths(&seen, width, height),
                "amodal_area": body.pixels_all,
                "amodal_bbox": body.whole_box,
                "amodal_segmentation": run_lengths(&alone, width, height),
                "visible_share": body.visible_share(),
            }));
        }
        Ok(())
    })?;
    let category = |(number, row): (usize, &format::dataset::AssetRow)| json!({ "id": number, "name": row.name, "object": row.object.to_string(), "supercategory": "object" });
    let categories: Vec<_> = (1..).zip(&assets.objects).map(category).collect();
    let text = json!({ "images": images, "categories": categories, "annotations": annotations }).to_string();
    target.write("instances.json", text.as_bytes())?;
    Ok(Written::selection(selected.count(), "views", selection))
}
