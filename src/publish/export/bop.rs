//! Views as a dataset of the BOP challenge: models in millimetres, scenes of depth, poses and masks.
//!
//! Layout and fields by the format description of BOP (bop.felk.cvut.cz, "BOP format") and its toolkit's rules of counting:
//! `px_count_all` counts parts outside the image, boxes are largest less smallest pixel without 1, whole silhouettes are not
//! clipped, and all is -1 where nothing is seen. Pixel centres are whole numbers there and at +0.5 here, so `cam_K` has half a
//! pixel less.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use serde_json::{Map, Value, json};

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    rle::run_lengths,
    selected::SelectedSamples,
    target::Target,
};
use format::{
    Noun, Product, SceneColour, SceneImage, SceneInstance,
    dataset::{AssetRow, DatasetReader},
    products::grasps::Shapes,
};
use kernel::{
    geom::{CameraCv, DepthCrop, Object, Pose, TriMesh, World, convex_hull_corners},
    ids::ObjectId,
    words::Split,
};

/// Millimetres per metre.
const MM: f64 = 1e3;

/// Millimetres per step of stored depth.
const DEPTH_SCALE: f64 = 0.1;

/// Views as scenes of the BOP challenge.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "bop",
    summary: "Views as a dataset of the BOP challenge: models, depth, poses, masks and boxes.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::VIEWS,
        counted: Noun { one: "view", many: "views" },
        keys: &[],
        layout: |_| {
            "models/obj_ID.ply in mm about the centre of the object's box, with models_info.json and objects.json (name, digest, \
             centre of the box in the object's own frame); train_pbr, val_holdout, val and test: a folder per scene with \
             scene_camera.json, scene_gt.json, scene_gt_info.json, scene_gt_coco.json, depth (16 bit, 0.1 mm), rgb where the views \
             are in colour, mask and mask_visib; pixel centres are whole numbers"
        },
        write,
    }],
};

/// A model of an object.
struct Model {
    /// Number of the object, from 1.
    number: u32,
    /// Centre of the object's box in its own frame [m]: the origin of the model.
    centre: Vector3<f64>,
}

/// Texts of one scene while it grows, by number of the image.
#[derive(Default)]
struct SceneTexts {
    camera: Map<String, Value>,
    poses: Map<String, Value>,
    info: Map<String, Value>,
    images: Vec<Value>,
    annotations: Vec<Value>,
}

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let models = models(reader, &assets.objects, target)?;
    // Scenes are numbered within their folder of a split, in the dataset's order.
    let mut numbers: BTreeMap<&'static str, u32> = BTreeMap::new();
    let mut current: Option<(ObjectId, String)> = None;
    let mut texts = SceneTexts::default();
    selected.each(|sample, names| {
        let (image, depth) = (sample.scene_image()?, sample.view_depth()?);
        let depth = depth.map_or_else(DepthCrop::default, |depth| depth.crop);
        let colour = sample.view_colour()?;
        let folder = match &current {
            Some((scene, folder)) if *scene == names.id.subject => folder.clone(),
            _ => {
                finish_scene(&mut texts, current.as_ref().map(|(_, folder)| folder.as_str()), &models, target)?;
                let split = folder_of(reader.split(names.index));
                let number = numbers.entry(split).or_default();
                let folder = format!("{split}/{number:06}");
                *number += 1;
                current = Some((names.id.subject, folder.clone()));
                folder
            }
        };
        write_image(&mut texts, &folder, (&image, &depth, colour.as_ref()), &models, target)
    })?;
    finish_scene(&mut texts, current.as_ref().map(|(_, folder)| folder.as_str()), &models, target)?;
    Ok(Written::selection(selected.count(), "views", selection))
}

/// Folder of a split, by BOP's names of splits and types.
fn folder_of(split: Option<Split>) -> &'static str {
    match split {
        None | Some(Split::Training) => "train_pbr",
        Some(Split::Holdout) => "val_holdout",
        Some(Split::Validation) => "val",
        Some(Split::Test) => "test",
    }
}

/// Writes the models; they are numbered in the order of the asset table.
fn models(
    reader: &DatasetReader,
    assets: &[AssetRow],
    target: &mut Target,
) -> Result<BTreeMap<ObjectId, Model>, ExportError> {
    let shapes = Shapes::open(reader.folder())?;
    let (mut models, mut infos, mut objects) = (BTreeMap::new(), Map::new(), Map::new());
    for (number, (index, row)) in (1..).zip(assets.iter().enumerate()) {
        let mesh = shapes.object(index)?.mesh;
        let Some(bounds) = mesh.aabb() else { continue };
        let centre = bounds.centre().coords;
        let name = format!("models/obj_{number:06}.ply");
        target.write(&name, &model_file(&mesh, &centre))?;
        let size = bounds.extents().map(|side| MM * side);
        infos.insert(
            number.to_string(),
            json!({
                "diameter": MM * diameter(&mesh),
                "min_x": -size[0] / 2.0, "min_y": -size[1] / 2.0, "min_z": -size[2] / 2.0,
                "size_x": size[0], "size_y": size[1], "size_z": size[2],
            }),
        );
        objects.insert(
            number.to_string(),
            json!({ "name": row.name, "object": row.object.to_string(), "centre": [centre.x, centre.y, centre.z] }),
        );
        models.insert(row.object, Model { number, centre });
    }
    target.write("models/models_info.json", pretty(&infos.into()).as_bytes())?;
    target.write("objects.json", pretty(&objects.into()).as_bytes())?;
    Ok(models)
}

/// A mesh about its centre in millimetres, as binary PLY with normals of the vertices.
fn model_file(mesh: &TriMesh, centre: &Vector3<f64>) -> Vec<u8> {
    let mut normals = vec![Vector3::<f64>::zeros(); mesh.vertices.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(index);
        let normal = (b - a).cross(&(c - a));
        triangle.iter().for_each(|vertex| normals[*vertex as usize] += normal);
    }
    let mut text = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{}element face {}\nproperty list uchar int \
         vertex_indices\nend_header\n",
        mesh.vertices.len(),
        ["x", "y", "z", "nx", "ny", "nz"].map(|name| format!("property float {name}\n")).concat(),
        mesh.triangles.len()
    )
    .into_bytes();
    for (vertex, normal) in mesh.vertices.iter().zip(&normals) {
        let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let moved = (0..3).map(|axis| MM * (f64::from(vertex[axis]) - centre[axis]));
        text.extend(moved.chain(normal.iter().copied()).flat_map(|value| (value as f32).to_le_bytes()));
    }
    for triangle in &mesh.triangles {
        text.push(3);
        text.extend(triangle.iter().flat_map(|vertex| (*vertex as i32).to_le_bytes()));
    }
    text
}

/// Largest distance of two vertices [m]: of two corners of the convex hull.
fn diameter(mesh: &TriMesh) -> f64 {
    let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|vertex| vertex.map(f64::from).into()).collect();
    // A flat mesh has no hull.
    let corners = convex_hull_corners(&points).unwrap_or(points);
    let mut largest = 0.0f64;
    for (index, one) in corners.iter().enumerate() {
        for other in &corners[index + 1..] {
            largest = largest.max((one - other).norm_squared());
        }
    }
    largest.sqrt()
}

/// Writes the files of an image, and notes it in the texts of its scene.
fn write_image(
    texts: &mut SceneTexts,
    folder: &str,
    (image, depth, colour): (&SceneImage, &DepthCrop, Option<&SceneColour>),
    models: &BTreeMap<ObjectId, Model>,
    target: &mut Target,
) -> Result<(), ExportError> {
    let SceneImage { camera, world_from_camera, .. } = image;
    let [width, height] = [camera.width, camera.height];
    let number = texts.camera.len();
    let camera_from_world = world_from_camera.inverse();
    texts.camera.insert(
        number.to_string(),
        json!({
            "cam_K": [camera.fx, 0.0, camera.cx - 0.5, 0.0, camera.fy, camera.cy - 0.5, 0.0, 0.0, 1.0],
            "depth_scale": DEPTH_SCALE,
            "cam_R_w2c": by_rows(camera_from_world.rotation()),
            "cam_t_w2c": millimetres(camera_from_world.translation()),
        }),
    );
    let whole = depth.whole(width, height);
    let steps = whole.iter().map(|metres| {
        let steps = (MM / DEPTH_SCALE * f64::from(*metres) + 0.5).floor();
        if (1.0..=65_535.0).contains(&steps) { steps as u16 } else { 0 }
    });
    let bytes: Vec<u8> = steps.flat_map(u16::to_be_bytes).collect();
    let png = png_file([width, height], (png::ColorType::Grayscale, png::BitDepth::Sixteen), &bytes);
    target.write(&format!("{folder}/depth/{number:06}.png"), &png)?;
    if let Some(colour) = colour {
        let kind = (png::ColorType::Rgb, png::BitDepth::Eight);
        let png = png_file([width, height], kind, colour.rgb.as_flattened());
        target.write(&format!("{folder}/rgb/{number:06}.png"), &png)?;
    }
    let shown = if colour.is_some() { "rgb" } else { "depth" };
    texts.images.push(json!({
        "id": number, "file_name": format!("{shown}/{number:06}.png"), "width": width, "height": height,
    }));
    let (mut poses, mut infos) = (Vec::new(), Vec::new());
    for (index, body) in image.bodies.iter().enumerate() {
        let Some(model) = models.get(&body.object) else { continue };
        poses.push(pose(&camera_from_world, body, model));
        let pixels = || (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        let alone: Vec<bool> = pixels().map(|(column, row)| body.mask.get(column, row)).collect();
        let seen: Vec<bool> = image.instances.iter().map(|own| usize::from(*own) == index + 1).collect();
        infos.push(info(body, alone.iter().zip(&whole).filter(|(own, depth)| **own && !depth.is_nan()).count()));
        for (kind, mask) in [("mask", &alone), ("mask_visib", &seen)] {
            let bytes: Vec<u8> = mask.iter().map(|own| if *own { 255 } else { 0 }).collect();
            let png = png_file([width, height], (png::ColorType::Grayscale, png::BitDepth::Eight), &bytes);
            target.write(&format!("{folder}/{kind}/{number:06}_{index:06}.png"), &png)?;
        }
        if body.pixels_visible > 0 {
            texts.annotations.push(json!({
                "id": texts.annotations.len() + 1,
                "image_id": number,
                "category_id": model.number,
                "iscrowd": 0,
                "area": body.pixels_visible,
                "bbox": body.visible_box,
                "segmentation": run_lengths(&seen, width, height),
                "ignore": body.visible_share() < 0.1,
            }));
        }
    }
    texts.poses.insert(number.to_string(), poses.into());
    texts.info.insert(number.to_string(), infos.into());
    Ok(())
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

/// Writes the texts of a scene, and begins those of the next.
fn finish_scene(
    texts: &mut SceneTexts,
    folder: Option<&str>,
    models: &BTreeMap<ObjectId, Model>,
    target: &mut Target,
) -> Result<(), ExportError> {
    let SceneTexts { camera, poses, info, images, annotations } = std::mem::take(texts);
    let Some(folder) = folder else { return Ok(()) };
    let mut categories: Vec<u32> = models.values().map(|model| model.number).collect();
    categories.sort_unstable();
    let category = |number: &u32| json!({ "id": number, "name": number.to_string(), "supercategory": "graspmill" });
    let coco = json!({
        "images": images,
        "annotations": annotations,
        "categories": categories.iter().map(category).collect::<Vec<_>>(),
    });
    for (name, text) in [
        ("scene_camera.json", pretty(&camera.into())),
        ("scene_gt.json", pretty(&poses.into())),
        ("scene_gt_info.json", pretty(&info.into())),
        ("scene_gt_coco.json", coco.to_string()),
    ] {
        target.write(&format!("{folder}/{name}"), text.as_bytes())?;
    }
    Ok(())
}

fn by_rows(rotation: &Rotation3<f64>) -> Vec<f64> {
    let matrix: &Matrix3<f64> = rotation.matrix();
    matrix.transpose().iter().copied().collect()
}

fn millimetres(metres: &Vector3<f64>) -> [f64; 3] {
    [metres.x, metres.y, metres.z].map(|value| MM * value)
}

/// One line per entry of the outermost table.
fn pretty(value: &Value) -> String {
    let Some(table) = value.as_object() else { return value.to_string() };
    let lines: Vec<String> = table.iter().map(|(key, value)| format!("  \"{key}\": {value}")).collect();
    format!("{{\n{}\n}}\n", lines.join(",\n"))
}

/// An image of this kind as PNG; numbers of 16 bits are big-endian.
fn png_file([width, height]: [u32; 2], (colour, depth): (png::ColorType, png::BitDepth), bytes: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.set_filter(if depth == png::BitDepth::Sixteen { png::Filter::Sub } else { png::Filter::NoFilter });
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(bytes)?;
        writer.finish()
    });
    written.expect("memory takes every byte, and the image is complete");
    file
}
