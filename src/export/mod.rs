//! Datasets in other formats: NumPy arrays, Parquet tables, WebDataset tars, binvox grids, PCD point clouds; reachability maps as GraspIt's files; trials of
//! grasps as scenes of plain MuJoCo.
//!
//! An export is a view of a dataset, not a second truth: `export.json` in it names the root digest that it was made
//! from, and `samples.csv` says which sample each row or file is.

mod error;
mod graspit;
mod mujoco;
mod names;
mod npy;
mod pcd;
mod table;
mod target;
mod webdataset;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

pub use error::ExportError;

use self::{names::object_folders, npy::PairArrays, table::SampleTable, target::Target, webdataset::TarShards};
use crate::{
    dataset::{AssetRow, DatasetError, DatasetReader, PairRow, PairTableWriter, Sample, Selection},
    geom::{GridPlacement, OccupancyGrid},
    ids::{ObjectId, Product, SampleIndex},
    record::VoxelPair,
    voxel::Binvox,
};

/// What to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `partial.npy` and `complete.npy`, with touch also `tactile.npy`, one row a sample. In every format all kinds of touch
    /// of a sample are joined.
    Npy {
        /// Bits as stored, uint8 of shape (samples, resolution^3 / 8), for
        /// `numpy.unpackbits(..., axis=1, bitorder="little")`; otherwise bool of shape (samples, n, n, n).
        packed: bool,
    },
    /// `pairs.parquet`, one row a sample: bits, ids, grid, camera and poses ([`PairTableWriter`]).
    Parquet,
    /// `completion-000000.tar` and on: of each sample `<index>.json`, `<index>.partial.npy`, `<index>.complete.npy`, with touch
    /// also `<index>.tactile.npy`.
    Webdataset,
    /// `<object>/view_00003_partial.binvox` and `..._complete.binvox`, with touch also `..._tactile.binvox`.
    Binvox,
    /// `<object>/view_00003_x.pcd` (partial) and `..._y.pcd` (complete): occupied cells by index, as the data of the
    /// thesis has them; where depth or cloud is stored also `..._pc.pcd`: the seen points [m]; with touch `..._t.pcd`, the
    /// touched cells by index, and `..._tc.pcd`, the contacts with their normals [m].
    Pcd,
    /// `reach_data.full`, `.sdf`, `.dims`, `.mins`, `.step` and `.csv` of a reachability dataset, after the thesis's code;
    /// their field is positive where reachable.
    Graspit,
    /// `<object>/scene.xml` and `grasps.json` of a dataset of grasps that were tried, with `hand.xml`, `drive.json` and `replay.py`,
    /// which makes the trials again in plain MuJoCo.
    Mujoco,
}

impl Format {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Npy { .. } => "npy",
            Self::Parquet => "parquet",
            Self::Webdataset => "webdataset",
            Self::Binvox => "binvox",
            Self::Pcd => "pcd",
            Self::Graspit => "graspit",
            Self::Mujoco => "mujoco",
        }
    }

    /// What stands where, in words, for `export.json`.
    fn layout(self) -> &'static str {
        match self {
            Self::Npy { packed: true } => {
                "partial.npy, complete.npy, with touch tactile.npy (cells that any kind of touch met): uint8 (samples, n^3 / 8), in the order of samples.csv; \
                 numpy.unpackbits(rows, axis=1, bitorder='little')[:, :n**3].reshape(-1, n, n, n) is indexed \
                 [sample, x, y, z]"
            }
            Self::Npy { packed: false } => {
                "partial.npy, complete.npy, with touch tactile.npy (cells that any kind of touch met): bool (samples, n, n, n), indexed [sample, x, y, z], in \
                 the order of samples.csv"
            }
            Self::Parquet => {
                "pairs.parquet: one row a sample in row groups of 256, in the order of samples.csv; partial, complete, with \
                 touch tactile (cells that any kind of touch met) are n^3 / 8 bytes, for numpy.unpackbits(..., \
                 bitorder='little')[:n**3].reshape(n, n, n), indexed [x, y, z]; poses are the top three rows of 4 x 4, row-major"
            }
            Self::Webdataset => {
                "completion-<shard>.tar, 2048 samples each: <sample index>.json, .partial.npy, .complete.npy, with touch \
                 .tactile.npy (cells that any kind of touch met), uint8 of n^3 / 8 bytes, for numpy.unpackbits(..., \
                 bitorder='little')[:n**3].reshape(n, n, n), indexed [x, y, z]"
            }
            Self::Binvox => {
                "<stem>_partial.binvox, <stem>_complete.binvox, with touch <stem>_tactile.binvox (cells that any kind of touch met); stems in samples.csv; translate is the grid's lower \
                 corner and scale its side, in camera axes [m]"
            }
            Self::Pcd => {
                "<stem>_x.pcd (partial), <stem>_y.pcd (complete): indices x, y, z of the occupied cells as float32; \
                 <stem>_pc.pcd: the seen points in camera axes [m], where stored; with touch <stem>_t.pcd: indices of \
                 the touched cells, <stem>_tc.pcd: contacts and normals in camera axes [m], kind after kind (rays, exploration, grasp); stems in samples.csv"
            }
            Self::Graspit => {
                "reach_data.full: 1 reachable, 0 not; reach_data.sdf: signed distance, POSITIVE where reachable (the \
                 dataset's own field is negative there); both raw little-endian float64, C order over x, y, z, roll, \
                 pitch, yaw. reach_data.dims, .mins, .step: cells, first centre and step of the six axes [m, rad]. \
                 reach_data.csv: i x y z roll pitch yaw 0|1 a line, rotation Rz(yaw) Ry(pitch) Rx(roll)"
            }
            Self::Mujoco => {
                "hand.xml: the hand with a servo for each joint; drive.json: what drives them, and how a trial goes on; \
                 <object>/scene.xml, scene_sdf.xml: that hand and the object for MuJoCo 3.17, by triangles and by distances; \
                 <object>/grasps.json: postures, object_from_base (3, 4) row-major [m], and what came of each trial; replay.py \
                 makes the trials again and writes agreement.json"
            }
        }
    }
}

/// Which samples to write.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportSelection {
    /// Of a split or a nested training subset.
    pub samples: Selection,
    /// Of the objects of these names alone; of all when empty.
    pub objects: Vec<String>,
    /// At most so many, in the dataset's order; of tried grasps as many, evenly over the selection.
    pub limit: Option<u64>,
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    /// The folder.
    pub folder: PathBuf,
    /// Samples; of a reachability dataset poses, of trials grasps.
    pub samples: u64,
    /// Files.
    pub files: u64,
}

/// Writes samples of the finished dataset in `folder` to `out`, which must not exist yet or be empty.
///
/// Samples stream through: one chunk of a shard is in memory at a time. The folder appears when it is complete, and
/// the same dataset and selection give the same bytes.
///
/// # Errors
/// When the dataset is not finished or damaged, `out` holds something, an object is unknown, nothing is selected, or a
/// file can't be written.
pub fn export(
    folder: &Path,
    format: Format,
    out: &Path,
    selection: &ExportSelection,
) -> Result<ExportSummary, ExportError> {
    let reader = DatasetReader::open(folder)?;
    if format == Format::Graspit {
        return graspit::export(&reader, out, selection);
    }
    if format == Format::Mujoco {
        return mujoco::export(&reader, out, selection);
    }
    let product = reader.manifest().product;
    if product != Product::Completion {
        return Err(ExportError::OtherProduct { product, format: format.name(), of: Product::Completion });
    }
    let assets = reader.assets()?.objects;
    let wanted = wanted_objects(&assets, &selection.objects)?;
    let limit = selection.limit.map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX));
    let indices: Vec<SampleIndex> = (reader.indices(selection.samples))
        .filter(|index| wanted.is_empty() || reader.id(*index).is_some_and(|sample| wanted.contains(&sample.subject)))
        .take(limit)
        .collect();
    if indices.is_empty() {
        return Err(ExportError::NothingSelected { kept: reader.manifest().counts.kept });
    }
    let mut target = Target::create(out)?;
    let names: BTreeMap<ObjectId, &str> = assets.iter().map(|row| (row.object, row.name.as_str())).collect();
    let mut writer = Writer {
        format,
        folders: object_folders(&assets),
        table: SampleTable::create(&mut target)?,
        arrays: None,
        rows: None,
        tars: TarShards::default(),
        samples: indices.len() as u64,
        root: reader.manifest().root.to_string(),
    };
    let mut take = |sample: Sample, target: &mut Target| -> Result<(), ExportError> {
        let name = names.get(&sample.id.subject).copied().unwrap_or_default();
        let split = reader.split(sample.index).map_or("", |split| split.name());
        writer.sample(&sample, name, split, target)
    };
    if wanted.is_empty() {
        for sample in reader.iter(selection.samples).take(limit) {
            take(sample?, &mut target)?;
        }
    } else {
        for index in &indices {
            if let Some(sample) = reader.sample(*index)? {
                take(sample, &mut target)?;
            }
        }
    }
    writer.finish()?;
    let facts = serde_json::json!({
        "root": reader.manifest().root,
        "format": format.name(),
        "layout": format.layout(),
        "samples": indices.len(),
        "split": selection.samples.split,
        "training_subset": selection.samples.subset,
        "objects": selection.objects,
    });
    let text = serde_json::to_string_pretty(&facts).expect("plain data with text keys") + "\n";
    target.write("export.json", text.as_bytes())?;
    let files = target.publish()?;
    Ok(ExportSummary { folder: out.to_owned(), samples: indices.len() as u64, files })
}

/// The objects of these names; every name must be known.
fn wanted_objects(assets: &[AssetRow], names: &[String]) -> Result<BTreeSet<ObjectId>, ExportError> {
    names
        .iter()
        .map(|name| {
            let row = assets.iter().find(|row| row.name == *name);
            row.map(|row| row.object).ok_or_else(|| ExportError::UnknownObject {
                name: name.clone(),
                known: assets.iter().map(|row| row.name.clone()).collect(),
            })
        })
        .collect()
}

/// What grows while samples go by.
struct Writer {
    format: Format,
    /// Folder of each object, for formats with files of their own a sample.
    folders: BTreeMap<ObjectId, String>,
    table: SampleTable,
    arrays: Option<PairArrays>,
    rows: Option<PairTableWriter>,
    tars: TarShards,
    samples: u64,
    /// Of the dataset.
    root: String,
}

impl Writer {
    fn sample(&mut self, sample: &Sample, name: &str, split: &str, target: &mut Target) -> Result<(), ExportError> {
        let pair = sample.pair()?;
        let touched = sample.touched()?;
        let tactile = touched.as_ref().map(|touched| &touched.tactile);
        let stem = self.stem(&pair);
        self.table.row(sample.index, &pair, name, split, &stem)?;
        match self.format {
            Format::Npy { packed } => {
                let arrays = match &mut self.arrays {
                    Some(arrays) => arrays,
                    None => {
                        let resolution = pair.grid.resolution;
                        let arrays = PairArrays::create(target, self.samples, resolution, packed, tactile.is_some())?;
                        self.arrays.insert(arrays)
                    }
                };
                arrays.push(sample.index, &pair, tactile)
            }
            Format::Parquet => {
                let rows = match &mut self.rows {
                    Some(rows) => rows,
                    None => {
                        let (file, path) = target.file("pairs.parquet")?;
                        self.rows.insert(PairTableWriter::create(file, path, tactile.is_some(), &self.root)?)
                    }
                };
                Ok(rows.push(&PairRow { index: sample.index, pair: &pair, tactile, object: name, split })?)
            }
            Format::Webdataset => self.tars.push(target, sample.index, &pair, tactile, (name, split)),
            Format::Binvox => {
                let grids =
                    [("partial", Some(&pair.partial)), ("complete", Some(&pair.complete)), ("tactile", tactile)];
                for (kind, grid) in grids {
                    let Some(grid) = grid else { continue };
                    target.write(&format!("{stem}_{kind}.binvox"), &in_camera_axes(grid, &pair.grid).to_bytes())?;
                }
                Ok(())
            }
            Format::Pcd => {
                target.write(&format!("{stem}_x.pcd"), &pcd::of_cells(&pair.partial))?;
                target.write(&format!("{stem}_y.pcd"), &pcd::of_cells(&pair.complete))?;
                if let Some(touched) = &touched {
                    let contacts = touched.touch.iter().flat_map(|(_, touch)| touch.contacts.iter().copied());
                    target.write(&format!("{stem}_t.pcd"), &pcd::of_cells(&touched.tactile))?;
                    target.write(&format!("{stem}_tc.pcd"), &pcd::of_contacts(&contacts.collect::<Vec<_>>()))?;
                }
                match seen_points(sample, &pair)? {
                    Some(points) => target.write(&format!("{stem}_pc.pcd"), &pcd::of_points(&points)),
                    None => Ok(()),
                }
            }
            // Of another product: it has no samples, and `export` has turned aside before.
            Format::Graspit | Format::Mujoco => Ok(()),
        }
    }

    /// `<object>/view_00003`, with instance and camera where they are not the first; empty where samples have no files of
    /// their own.
    fn stem(&self, pair: &VoxelPair) -> String {
        if matches!(self.format, Format::Npy { .. } | Format::Parquet | Format::Webdataset) {
            return String::new();
        }
        let id = pair.sample;
        let folder = self.folders.get(&id.subject).cloned().unwrap_or_else(|| id.subject.0.short());
        let mut stem = format!("{folder}/view_{:05}", id.view.0);
        if (id.instance, id.camera) != (0, 0) {
            stem.push_str(&format!("_instance_{}_camera_{}", id.instance, id.camera));
        }
        stem
    }

    fn finish(self) -> Result<(), ExportError> {
        if let Some(arrays) = self.arrays {
            arrays.finish()?;
        }
        if let Some(rows) = self.rows {
            rows.finish()?;
        }
        self.tars.finish()?;
        self.table.finish()
    }
}

/// A grid as binvox places it: lower corner and side of the whole grid, in `CameraCv` [m].
fn in_camera_axes(grid: &OccupancyGrid, placement: &GridPlacement) -> Binvox {
    Binvox {
        grid: grid.clone(),
        translate: placement.lower_corner().coords.into(),
        scale: f64::from(placement.resolution) * placement.cell_size,
    }
}

/// The points behind the partial grid, in `CameraCv` [m]: the stored cloud, or the depth crop's; `None` without both.
fn seen_points(sample: &Sample, pair: &VoxelPair) -> Result<Option<Vec<[f32; 3]>>, DatasetError> {
    if let Some(cloud) = sample.cloud()? {
        return Ok(Some(cloud.points));
    }
    let Some(depth) = sample.depth()? else { return Ok(None) };
    let crop = depth.crop;
    let points = (0u32..).zip(&crop.depth).filter(|(_, depth)| !depth.is_nan()).map(|(place, depth)| {
        let (u, v) = (crop.left + place % crop.width, crop.top + place / crop.width);
        let point = pair.camera.unproject(f64::from(u) + 0.5, f64::from(v) + 0.5, f64::from(*depth));
        [point.x as f32, point.y as f32, point.z as f32]
    });
    Ok(Some(points.collect()))
}
