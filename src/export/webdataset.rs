//! Tar shards as WebDataset reads them: the members of a sample stand side by side and share their name up to the first dot.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::PathBuf,
};

use super::{ExportError, npy, target::Target};
use crate::{geom::OccupancyGrid, ids::SampleIndex, record::VoxelPair};

/// Samples of a shard: 36 MB at 40^3, a few hundred shards of the largest datasets.
const SHARD: u64 = 2048;

/// The shards while they grow.
#[derive(Default)]
pub(super) struct TarShards {
    open: Option<(tar::Builder<BufWriter<File>>, PathBuf)>,
    samples: u64,
}

impl TarShards {
    /// Adds a sample.
    pub fn push(
        &mut self,
        target: &mut Target,
        index: SampleIndex,
        pair: &VoxelPair,
        tactile: Option<&OccupancyGrid>,
        (object, split): (&str, &str),
    ) -> Result<(), ExportError> {
        if self.samples.is_multiple_of(SHARD) {
            self.close()?;
            let (file, path) = target.open(&format!("completion-{:06}.tar", self.samples / SHARD))?;
            self.open = Some((tar::Builder::new(file), path));
        }
        self.samples += 1;
        let Some((shard, path)) = &mut self.open else { return Ok(()) };
        let mut member = |extension: &str, bytes: &[u8]| {
            append(shard, &format!("{:09}.{extension}", index.0), bytes).map_err(ExportError::io("writing", path))
        };
        member("json", facts(index, pair, object, split).as_bytes())?;
        for (name, grid) in [("partial", Some(&pair.partial)), ("complete", Some(&pair.complete)), ("tactile", tactile)]
        {
            let Some(grid) = grid else { continue };
            let mut bytes = npy::head("|u1", &[grid.bytes().len() as u64]);
            bytes.extend(grid.bytes());
            member(&format!("{name}.npy"), &bytes)?;
        }
        Ok(())
    }

    fn close(&mut self) -> Result<(), ExportError> {
        let Some((shard, path)) = self.open.take() else { return Ok(()) };
        let finished = shard.into_inner().and_then(|mut file| file.flush());
        finished.map_err(ExportError::io("writing", &path))
    }

    /// Ends the last shard.
    pub fn finish(mut self) -> Result<(), ExportError> {
        self.close()
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

/// What places the sample, as one JSON object with its keys sorted.
fn facts(index: SampleIndex, pair: &VoxelPair, object: &str, split: &str) -> String {
    let (id, grid, camera) = (pair.sample, pair.grid, pair.camera);
    serde_json::json!({
        "sample_index": index.0,
        "sample": id.to_string(),
        "subject": id.subject.to_string(),
        "instance": id.instance,
        "view": id.view.0,
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
