//! Suction in the layout of the labels of SuctionNet-1Billion.
//!
//! Source: H. Cao, H.-S. Fang, W. Liu, C. Lu, "SuctionNet-1Billion: A Large-Scale Benchmark for Suction Grasping", 2021, and the files
//! that `suctionnetAPI` reads; no code is copied. There, points belong to an object and are the same in every scene. Here, poses are
//! drawn in each scene, so every body of a scene has an object number of its own. A cup approaches against the normal of its point.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    npz::Npz,
    selected::SelectedSamples,
    target::Target,
};
use format::{Noun, Product, SuctionPose, SuctionPoses, dataset::DatasetReader};
use kernel::ids::ObjectId;

/// Labels of points with normals, per body and per scene.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "suctionnet",
    summary: "Suction poses with seal, wrench and collision labels in the layout of SuctionNet-1Billion.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::SUCTION,
        counted: Noun { one: "body", many: "bodies" },
        keys: &[],
        layout: |_| "seal_label/%03d_seal.npz, one per body of a scene: points float32 (n, 3) [m] and outward normals float32 (n, 3), in the object's frame, scores float32 (n), seal; wrench_label/%04d_wrench.npz, one per scene: arr_i float32 (n), wrench scores of body i, for 1 kg and z up; suction_collision_label/%04d_collision.npz: arr_i bool (n), true where something but the body is on the path of the cup; scenes/scene_%04d/object_id_list.txt: number of the seal label of each body; bodies.csv: sample, scene, object, split and pose of each",
        write,
    }],
};

/// First line of `bodies.csv`.
const HEADING: &str = "object_id,scene_id,place,sample_index,scene,body,object,split,world_from_object\n";

/// Files of one scene while its bodies are read.
#[derive(Default)]
struct SceneLabels {
    wrenches: Npz,
    collisions: Npz,
    ids: String,
    bodies: u64,
}

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let objects: BTreeMap<ObjectId, &str> = assets.objects.iter().map(|row| (row.object, row.name.as_str())).collect();
    let selected = SelectedSamples::of(reader, &assets.subjects, selection)?;
    let (mut current, mut labels) = (None::<ObjectId>, SceneLabels::default());
    let (mut scene, mut object_id, mut table) = (0_u64, 0_u64, HEADING.to_owned());
    selected.each(|sample, names| {
        if current.is_some_and(|current| current != names.id.subject) {
            std::mem::take(&mut labels).write(scene, target)?;
            scene += 1;
        }
        current = Some(names.id.subject);
        let record = sample.read::<SuctionPoses>()?;
        target.write(&format!("seal_label/{object_id:03}_seal.npz"), &seal_label(&record))?;
        let name = objects.get(&record.object()).copied().unwrap_or_default().replace('"', "\"\"");
        let pose: Vec<String> = record.world_from_object().to_rows().iter().map(f64::to_string).collect();
        let (place, body) = (labels.bodies, record.body());
        table.push_str(&format!(
            "{object_id},{scene},{place},{},{},{body},\"{name}\",{},{}\n",
            names.index,
            names.subject,
            names.split,
            pose.join(" ")
        ));
        labels.add(&record, object_id);
        object_id += 1;
        Ok(())
    })?;
    labels.write(scene, target)?;
    target.write("bodies.csv", table.as_bytes())?;
    let mut written = Written::selection(selected.count(), "bodies", selection);
    written.facts.insert("scenes".to_owned(), (scene + 1).into());
    Ok(written)
}

impl SceneLabels {
    /// Adds a body.
    fn add(&mut self, record: &SuctionPoses, object_id: u64) {
        let (name, count) = (format!("arr_{}", self.bodies), record.poses.len() as u64);
        let wrenches = record.poses.iter().map(|pose| pose.suctionnet[1]);
        self.wrenches.add(&name, "<f4", &[count], &single(wrenches));
        let blocked: Vec<u8> = record.poses.iter().map(|pose| u8::from(!pose.passage.is_free())).collect();
        self.collisions.add(&name, "|b1", &[count], &blocked);
        self.ids.push_str(&format!("{object_id}\n"));
        self.bodies += 1;
    }

    /// Writes the files of a scene.
    fn write(self, scene: u64, target: &mut Target) -> Result<(), ExportError> {
        target.write(&format!("wrench_label/{scene:04}_wrench.npz"), &self.wrenches.finish())?;
        target.write(&format!("suction_collision_label/{scene:04}_collision.npz"), &self.collisions.finish())?;
        target.write(&format!("scenes/scene_{scene:04}/object_id_list.txt"), self.ids.as_bytes())
    }
}

/// Points, outward normals and seal scores of a body.
fn seal_label(record: &SuctionPoses) -> Vec<u8> {
    let count = record.poses.len() as u64;
    let all = || record.poses.iter();
    let point = |pose: &SuctionPose| <[f64; 3]>::from(*pose.object_from_cup.translation());
    let normal = |pose: &SuctionPose| <[f64; 3]>::from(pose.object_from_cup.isometry().rotation * -Vector3::z());
    let mut npz = Npz::default();
    npz.add("points", "<f4", &[count, 3], &single(all().flat_map(point)));
    npz.add("normals", "<f4", &[count, 3], &single(all().flat_map(normal)));
    npz.add("scores", "<f4", &[count], &single(all().map(|pose| pose.suctionnet[0])));
    npz.finish()
}

/// Numbers in single precision, as bytes of a file.
fn single(values: impl IntoIterator<Item = f64>) -> Vec<u8> {
    values.into_iter().flat_map(|value| (value as f32).to_le_bytes()).collect()
}
