//! Tar shards for WebDataset: the members of a sample are adjacent and share their name up to the first dot.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
};

use serde_json::{Map, Value};

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat},
    npy,
    pair::PairSample,
    pairs::{WritePairs, write_pairs},
    target::Target,
};
use format::{Noun, Product, VoxelPair};
use kernel::ids::SampleIndex;

/// Samples per shard: 36 MB at 40^3, a few hundred shards for the largest datasets.
const SHARD_SAMPLES: u64 = 2048;

/// `completion-000000.tar` and on: `<index>.json`, `<index>.partial.npy`, `<index>.complete.npy` of each sample, with touch
/// also `<index>.tactile.npy`.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "webdataset",
    summary: "Tar shards, for WebDataset's loaders.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::COMPLETION,
        counted: Noun { one: "sample", many: "samples" },
        keys: &[],
        layout: |_| {
            "completion-<shard>.tar, 2048 samples each: <sample index>.json, .partial.npy, .complete.npy, with touch \
             .tactile.npy (cells that any kind of touch met), uint8 of n^3 / 8 bytes, for numpy.unpackbits(..., \
             bitorder='little')[:n**3].reshape(n, n, n), indexed [x, y, z]"
        },
        write: |reader, selection, target| write_pairs(reader, selection, target, |_| TarShards::default()),
    }],
};

/// The shards while they are written.
#[derive(Default)]
struct TarShards {
    open: Option<(tar::Builder<BufWriter<File>>, PathBuf)>,
    samples: u64,
}

impl WritePairs for TarShards {
    const FILE_PER_SAMPLE: bool = false;

    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError> {
        if self.samples.is_multiple_of(SHARD_SAMPLES) {
            self.close()?;
            let (file, path) = target.open(&format!("completion-{:06}.tar", self.samples / SHARD_SAMPLES))?;
            self.open = Some((tar::Builder::new(file), path));
        }
        self.samples += 1;
        let Some((shard, path)) = &mut self.open else { return Ok(()) };
        let index = sample.index();
        let mut member = |extension: &str, bytes: &[u8]| {
            append(shard, &format!("{:09}.{extension}", index.0), bytes).map_err(ExportError::io("writing", path))
        };
        member("json", facts(index, sample.pair, sample.names.object, sample.names.split).as_bytes())?;
        for (name, grid) in sample.grids() {
            let mut bytes = npy::head("|u1", &[grid.bytes().len() as u64]);
            bytes.extend(grid.bytes());
            member(&format!("{name}.npy"), &bytes)?;
        }
        Ok(())
    }

    fn finish(mut self, _: &mut Target) -> Result<Map<String, Value>, ExportError> {
        self.close().map(|()| Map::new())
    }
}

impl TarShards {
    /// Closes the open shard.
    fn close(&mut self) -> Result<(), ExportError> {
        let Some((shard, path)) = self.open.take() else { return Ok(()) };
        let finished = shard.into_inner().and_then(|mut file| file.flush());
        finished.map_err(ExportError::io("writing", &path))
    }
}

/// A member without clock or owner: equal samples give equal bytes.
fn append(shard: &mut tar::Builder<BufWriter<File>>, name: &str, bytes: &[u8]) -> std::io::Result<()> {
    let mut header = tar::Header::new_ustar();
    header.set_size(bytes.len() as u64);
    header.set_mode(0o644);
    header.set_mtime(0);
    header.set_uid(0);
    header.set_gid(0);
    shard.append_data(&mut header, name, bytes)
}

/// Ids, grid, camera and poses of the sample, as one JSON object with its keys sorted.
fn facts(index: SampleIndex, pair: &VoxelPair, object: &str, split: &str) -> String {
    let (id, grid, camera) = (pair.sample, pair.grid, pair.camera);
    serde_json::json!({
        "sample_index": index.0,
        "sample": id.to_string(),
        "subject": id.subject.to_string(),
        "item": id.item.0,
        "instance": id.instance,
        "camera": id.camera,
        "object": object,
        "split": split,
        "resolution": grid.resolution,
        "cell_size": grid.cell_size,
        "centre": [grid.centre.x, grid.centre.y, grid.centre.z],
        "intrinsics": { "width": camera.width, "height": camera.height,
            "fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy },
        "camera_from_object": pair.camera_from_object.to_rows(),
        "world_from_object": pair.world_from_object.to_rows(),
        "world_from_camera": pair.world_from_camera.to_rows(),
        "partial_cells": pair.partial_cells,
        "complete_cells": pair.complete_cells,
        "both_cells": pair.both_cells,
        "solid_share": pair.solid_share,
    })
    .to_string()
}
