//! Voxel grids as binvox files.

use serde_json::{Map, Value};

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat},
    pair::PairSample,
    pairs::{WritePairs, write_pairs},
    target::Target,
};
use format::{Noun, Product};
use kernel::{
    geom::{GridPlacement, OccupancyGrid},
    voxel::Binvox,
};

/// `<object>/view_00003_partial.binvox` and `..._complete.binvox`, with touch also `..._tactile.binvox`.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "binvox",
    summary: "binvox, two files per sample.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::COMPLETION,
        counted: Noun { one: "sample", many: "samples" },
        keys: &[],
        layout: |_| {
            "<stem>_partial.binvox, <stem>_complete.binvox, with touch <stem>_tactile.binvox (cells that any kind of touch met); \
             stems in samples.csv; translate is the grid's lower corner and scale its side, in camera axes [m]"
        },
        write: |reader, selection, target| write_pairs(reader, selection, target, |_| BinvoxFiles),
    }],
};

/// Files per sample.
struct BinvoxFiles;

impl WritePairs for BinvoxFiles {
    const FILE_PER_SAMPLE: bool = true;

    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError> {
        for (name, grid) in sample.grids() {
            let file = format!("{}_{name}.binvox", sample.stem);
            target.write(&file, &in_camera_axes(grid, &sample.pair.grid).to_bytes())?;
        }
        Ok(())
    }

    fn finish(self, _: &mut Target) -> Result<Map<String, Value>, ExportError> {
        Ok(Map::new())
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
