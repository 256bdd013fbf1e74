//! Views and volumes in the formats of VGN and GIGA: depth images with poses, grids of distances, points with occupancy.
//!
//! Layout and fields by the public code of VGN (`vgn.io`, `vgn.perception`, `vgn.dataset`) and of GIGA (`vgn.dataset_voxel`), but
//! no code is copied. Their task frame has its origin at a corner of the cube, z up; images have whole numbers as pixel centres,
//! so `K` has half a pixel less than ours. Their `grasps.csv` contains labels of tried grasps of a hand whose y is along the
//! closing line and z along the approach; it is written for volumes with the grasps of picks.

use std::{collections::BTreeSet, f64::consts::FRAC_PI_2};

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportKey, ExportSelection, Written},
    half::half_precision,
    npz::Npz,
    selected::SelectedSamples,
    target::Target,
};
use format::{
    Depth, Noun, PickState, Product, SceneImage, SceneVolume, VolumeAffordance, VolumeTruth, VoxelGrasp,
    dataset::DatasetReader,
};
use kernel::{
    geom::{CameraCv, DepthCrop, Intrinsics, Pose, Volume, World},
    ids::{ObjectId, SampleIndex},
};

const SIZE: ExportKey = ExportKey {
    name: "size",
    default: 0.3,
    meaning: "Edge of the cube of the task, centred over the container's floor [m].",
};
const SUPPORT_HEIGHT: ExportKey = ExportKey {
    name: "support_height",
    default: 0.05,
    meaning: "Height of the supporting surface above the cube's lower side [m].",
};
const OPENING: ExportKey =
    ExportKey { name: "max_opening_width", default: 0.08, meaning: "Widest opening of the gripper [m]." };
const FINGER: ExportKey =
    ExportKey { name: "finger_depth", default: 0.05, meaning: "Length of the gripper's fingers [m]." };

/// Views and volumes for VGN and GIGA.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "vgn",
    summary: "Depth images of views, or grids, occupancy and tried grasps of volumes, in the formats of VGN and GIGA.",
    has_unpacked: false,
    forms: &[
        ExportForm {
            product: Product::VIEWS,
            counted: Noun { one: "view", many: "views" },
            keys: &[SIZE, SUPPORT_HEIGHT, OPENING, FINGER],
            layout: |_| {
                "raw data: setup.json (size, intrinsic, max_opening_width, finger_depth) and scenes/ID.npz, one per scene: depth_imgs \
                 float32 (n, height, width) [m], 0 without a return, and extrinsics float32 (n, 7), qx qy qz qw x y z of \
                 camera_from_task; scenes.csv lists scene, split and views of each ID; pixel centres are whole numbers; no grasps.csv"
            },
            write: write_views,
        },
        ExportForm {
            product: Product::VOLUMES,
            counted: Noun { one: "volume", many: "volumes" },
            keys: &[OPENING, FINGER],
            layout: |_| {
                "processed data: setup.json, scenes/ID.npz, one per volume: grid float32 (1, n, n, n), (tsdf + 1) / 2 in observed voxels with -0.98 <= tsdf < 0.98, else 0; occ/ID/0000.npz: points float16 (n^3, 3) [m], the centres of the \
                 voxels in the task frame, and occ bool, inside a body; scenes.csv lists scene, split and views of each ID; for volumes with picks grasps.csv: scene_id,qx,qy,qz,qw,i,j,k,width,label of each tried grasp, centre and width in voxels, y along \
                 the closing line, z along the approach, label 1 held and 0 failed"
            },
            write: write_volumes,
        },
    ],
};

/// Text about `grasps.csv` if there is none.
const WITHOUT_GRASPS: &str = "There is no `grasps.csv`: it would contain grasps tried in simulation, but the exported dataset has none. Training VGN or GIGA also requires this file, with a row per grasp: \
    `scene_id,qx,qy,qz,qw,x,y,z,width,label` (raw data, metres) or `scene_id,qx,qy,qz,qw,i,j,k,width,label` (processed data, voxels). \
    Volumes of a job with `[picks]` have them.";

/// Text about `grasps.csv`.
const WITH_GRASPS: &str = "`grasps.csv` has a row per grasp that was tried in simulation among the neighbours and whose centre is in the cube: rotation as a quaternion with y along the closing line and z along the approach, centre between the pads and width in voxels, label 1 if it held and 0 if it failed. Untried grasps have no row: they are not negatives. A gripper rotated about its approach by 180 degrees is equivalent; only one of the two rotations is stored.";

/// Text of README.md, which describes the files.
fn readme(of: &str, files: &str, grasps: &str) -> String {
    format!(
        "# {of} for VGN and GIGA\n\n{files}\n\n`export.json` contains the root digest of the dataset; `scenes.csv` lists scene, split and views of each ID.\n\n## Labels of grasps\n\n{grasps} There is no `mesh_pose_list`: the poses of the bodies are in the \
         dataset of views.\n\n## Conventions\n\nThe task frame has its origin at a corner of the cube, z up. Pixel centres are whole numbers, so `K` has half \
         a pixel less than the dataset's principal point. Lengths are metres. `max_opening_width` and `finger_depth` of `setup.json` \
         were given to the export; nothing in the dataset depends on them.\n"
    )
}

/// Content of `setup.json`.
fn setup(size: f64, camera: &Intrinsics, selection: &ExportSelection) -> Value {
    let k = [camera.fx, 0.0, camera.cx - 0.5, 0.0, camera.fy, camera.cy - 0.5, 0.0, 0.0, 1.0];
    json!({
        "size": size,
        "intrinsic": { "width": camera.width, "height": camera.height, "K": k },
        "max_opening_width": selection.number(&OPENING),
        "finger_depth": selection.number(&FINGER),
    })
}

/// Arrays in the form of their files.
fn bytes_of(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// The images of one scene while they are collected.
#[derive(Default)]
struct SceneArrays {
    depths: Vec<u8>,
    extrinsics: Vec<u8>,
    views: Vec<String>,
}

/// Quaternion x, y, z, w with w not negative, then position, of the task frame as a camera sees it.
fn extrinsic(camera_from_task: &Pose<CameraCv, Volume>) -> [f32; 7] {
    let rotation = UnitQuaternion::from_rotation_matrix(camera_from_task.rotation());
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let [x, y, z, w] = [rotation.i, rotation.j, rotation.k, rotation.w].map(|value| (sign * value) as f32);
    let at = camera_from_task.translation();
    [x, y, z, w, at.x as f32, at.y as f32, at.z as f32]
}

/// Name of a scene: as long as those of VGN.
fn id_of(scene: ObjectId) -> String {
    scene.to_string()[..32].to_owned()
}

const HEADING: &str = "scene_id,scene,name,split,fusion,views\n";

fn write_views(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let (size, support_height) = (selection.number(&SIZE), selection.number(&SUPPORT_HEIGHT));
    let world_from_task: Pose<World, Volume> =
        Pose::new(Rotation3::identity(), Vector3::new(-size / 2.0, -size / 2.0, -support_height));
    let mut camera: Option<Intrinsics> = None;
    let (mut current, mut arrays) = (None::<(ObjectId, String)>, SceneArrays::default());
    let (mut table, mut ids) = (HEADING.to_owned(), BTreeSet::new());
    selected.each(|sample, names| {
        let (image, depth) = (sample.read::<SceneImage>()?, sample.find::<Depth>()?);
        check_camera(&mut camera, &image.camera, names.index)?;
        if current.as_ref().is_none_or(|(scene, _)| *scene != names.id.subject) {
            finish_scene(&mut arrays, current.take(), camera.as_ref(), &mut table, target)?;
            ids.insert(id_of(names.id.subject));
            current = Some((names.id.subject, format!("{},{},{}", names.subject, quoted(names.object), names.split)));
        }
        let depth = depth.map_or_else(DepthCrop::default, |depth| depth.crop);
        let whole = depth.whole(image.camera.width, image.camera.height);
        arrays.depths.extend(bytes_of(whole.into_iter().map(|metres| if metres.is_nan() { 0.0 } else { metres })));
        arrays.extrinsics.extend(bytes_of(extrinsic(&(image.world_from_camera.inverse() * world_from_task))));
        arrays.views.push(names.id.item.0.to_string());
        Ok(())
    })?;
    finish_scene(&mut arrays, current, camera.as_ref(), &mut table, target)?;
    let camera = camera.expect("a view is selected");
    target.write_json("setup.json", &setup(size, &camera, selection))?;
    target.write("scenes.csv", table.as_bytes())?;
    let files = format!(
        "Raw data: `scenes/ID.npz` has `depth_imgs` and `extrinsics` of a scene, `setup.json` the cube of {size} m, of which {support_height} m are below the supporting surface. Bodies outside the cube are also in the images."
    );
    target.write("README.md", readme("Views", &files, WITHOUT_GRASPS).as_bytes())?;
    let mut written = Written::selection(selected.count(), "views", selection);
    written.facts.insert("scenes".to_owned(), ids.len().into());
    Ok(written)
}

/// Stores the camera of the first image; all other cameras must be equal.
fn check_camera(camera: &mut Option<Intrinsics>, own: &Intrinsics, view: SampleIndex) -> Result<(), ExportError> {
    let near = own.near;
    let first = camera.get_or_insert(*own);
    if (Intrinsics { near, ..*first }) == *own { Ok(()) } else { Err(ExportError::OtherCamera { view }) }
}

/// A name in a table: between quotation marks, which are doubled inside.
fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// Writes the images of a scene, and its row of the table.
fn finish_scene(
    arrays: &mut SceneArrays,
    scene: Option<(ObjectId, String)>,
    camera: Option<&Intrinsics>,
    table: &mut String,
    target: &mut Target,
) -> Result<(), ExportError> {
    let SceneArrays { depths, extrinsics, views } = std::mem::take(arrays);
    let (Some((scene, facts)), Some(camera)) = (scene, camera) else { return Ok(()) };
    let (id, count) = (id_of(scene), views.len() as u64);
    let mut npz = Npz::default();
    npz.add("depth_imgs", "<f4", &[count, camera.height.into(), camera.width.into()], &depths);
    npz.add("extrinsics", "<f4", &[count, 7], &extrinsics);
    target.write(&format!("scenes/{id}.npz"), &npz.finish())?;
    table.push_str(&format!("{id},{facts},,{}\n", views.join(" ")));
    Ok(())
}

/// Distances in VGN's grid, which has one value for voxels that are free, unseen, or deep behind the observed surface.
fn grid_value(volume: &SceneVolume, index: usize) -> f32 {
    let value = volume.value(index) as f32;
    let is_near = volume.weights[index] > 0 && (-0.98..0.98).contains(&value);
    if is_near { (value + 1.0) * 0.5 } else { 0.0 }
}

fn write_volumes(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let mut first: Option<(SceneVolume, Vec<u8>)> = None;
    let (mut table, mut grasps) = (HEADING.to_owned(), None::<String>);
    selected.each(|sample, names| {
        let (volume, truth) = (sample.read::<SceneVolume>()?, sample.read::<VolumeTruth>()?);
        let n = volume.grid.resolution;
        let (_, points) = first.get_or_insert_with(|| (volume.clone(), centres(&volume)));
        let points = points.clone();
        let is_alike = first.as_ref().is_none_or(|(first, _)| first.grid == volume.grid);
        if !is_alike {
            return Err(ExportError::OtherCube { index: names.index });
        }
        let id = format!("{}-{:04}", id_of(names.id.subject), names.id.item.0);
        let side = u64::from(n);
        let mut npz = Npz::default();
        npz.add(
            "grid",
            "<f4",
            &[1, side, side, side],
            &bytes_of((0..volume.steps.len()).map(|index| grid_value(&volume, index))),
        );
        target.write(&format!("scenes/{id}.npz"), &npz.finish())?;
        let occupied: Vec<u8> = truth.instances.iter().map(|own| u8::from(VolumeTruth::is_body(*own))).collect();
        let mut npz = Npz::default();
        npz.add("points", "<f2", &[side.pow(3), 3], &points);
        npz.add("occ", "|b1", &[side.pow(3)], &occupied);
        target.write(&format!("occ/{id}/0000.npz"), &npz.finish())?;
        let views: Vec<String> = volume.views.iter().map(|view| view.view.to_string()).collect();
        let facts = format!("{},{},{}", names.subject, quoted(names.object), names.split);
        table.push_str(&format!("{id},{facts},{},{}\n", names.id.item.0, views.join(" ")));
        if let Some(affordance) = sample.find::<VolumeAffordance>()? {
            let grasps = grasps.get_or_insert_with(|| GRASPS_HEADING.to_owned());
            affordance.grasps.iter().filter_map(|grasp| grasp_row(&id, &volume, grasp)).for_each(|row| *grasps += &row);
        }
        Ok(())
    })?;
    let (first, _) = first.expect("a volume is selected");
    target.write_json("setup.json", &setup(first.grid.size, &first.views[0].intrinsics, selection))?;
    target.write("scenes.csv", table.as_bytes())?;
    let files = format!(
        "Processed data: `scenes/ID.npz` has the `grid` of a volume by VGN's rule, in which free, unobserved and deep voxels behind a surface all have the value 0; the dataset distinguishes the three. `occ/ID/0000.npz` has `points` and `occ` \
         as GIGA reads them: the centres of all {} voxels of the cube, not points drawn near the bodies, and whether each is inside a body; the container does not count as a body. `intrinsic` of `setup.json` belongs to the first fused image.",
        first.grid.voxels()
    );
    let words = if grasps.is_some() { WITH_GRASPS } else { WITHOUT_GRASPS };
    target.write("README.md", readme("Volumes", &files, words).as_bytes())?;
    if let Some(grasps) = grasps {
        target.write("grasps.csv", grasps.as_bytes())?;
    }
    Ok(Written::selection(selected.count(), "volumes", selection))
}

const GRASPS_HEADING: &str = "scene_id,qx,qy,qz,qw,i,j,k,width,label\n";

/// A row of `grasps.csv`; `None` for an untried grasp.
fn grasp_row(id: &str, volume: &SceneVolume, grasp: &VoxelGrasp) -> Option<String> {
    let label = match grasp.state {
        PickState::Untried => return None,
        PickState::Held => 1,
        PickState::Failed => 0,
    };
    // Our x is along the closing line, theirs is y.
    let [x, y, z, w] = grasp.rotation;
    let ours = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
    let theirs = ours * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -FRAC_PI_2);
    let sign = if theirs.w < 0.0 { -1.0 } else { 1.0 };
    let voxel = volume.grid.voxel();
    let [i, j, k] = grasp.centre.map(|metres| metres / voxel);
    let [qx, qy, qz, qw] = [theirs.i, theirs.j, theirs.k, theirs.w].map(|part| sign * part);
    Some(format!("{id},{qx},{qy},{qz},{qw},{i},{j},{k},{},{label}\n", grasp.width / voxel))
}

/// Centres of the voxels in half precision [m].
fn centres(volume: &SceneVolume) -> Vec<u8> {
    let (grid, n) = (volume.grid, volume.grid.resolution);
    let voxels = (0..n).flat_map(move |x| (0..n).flat_map(move |y| (0..n).map(move |z| [x, y, z])));
    let numbers = voxels.flat_map(|voxel| <[f64; 3]>::from(grid.centre(voxel).coords));
    numbers.flat_map(|value| half_precision(value).to_le_bytes()).collect()
}
