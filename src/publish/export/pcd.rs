//! Point clouds as the Point Cloud Library's binary PCD, version 0.7.

use serde_json::{Map, Value};

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat},
    pair::PairSample,
    pairs::{WritePairs, write_pairs},
    target::Target,
};
use format::{Cloud, Depth, Noun, Product, TouchContact, dataset::DatasetError};
use kernel::geom::OccupancyGrid;

/// `<object>/view_00003_x.pcd` (partial) and `..._y.pcd` (complete): occupied cells by index, as in the data of the thesis; if
/// depth or cloud is stored also `..._pc.pcd`: the seen points [m]; with touch `..._t.pcd`, the touched cells by index, and
/// `..._tc.pcd`, the contacts with their normals [m].
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "pcd",
    summary: "Point clouds of occupied cells (PCD).",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::COMPLETION,
        counted: Noun { one: "sample", many: "samples" },
        keys: &[],
        layout: |_| {
            "<stem>_x.pcd (partial), <stem>_y.pcd (complete): indices x, y, z of the occupied cells as float32; \
             <stem>_pc.pcd: the seen points in camera axes [m], where stored; with touch <stem>_t.pcd: indices of \
             the touched cells, <stem>_tc.pcd: contacts and normals in camera axes [m], kind after kind (rays, exploration, \
             grasp); stems in samples.csv"
        },
        write: |reader, selection, target| write_pairs(reader, selection, target, |_| PcdFiles),
    }],
};

/// Files per sample.
struct PcdFiles;

impl WritePairs for PcdFiles {
    const FILE_PER_SAMPLE: bool = true;

    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError> {
        let PairSample { pair, stem, .. } = *sample;
        target.write(&format!("{stem}_x.pcd"), &cells_file(&pair.partial))?;
        target.write(&format!("{stem}_y.pcd"), &cells_file(&pair.complete))?;
        if let Some(touched) = sample.touched {
            let contacts = touched.touch.iter().flat_map(|(_, touch)| touch.contacts.iter().copied());
            target.write(&format!("{stem}_t.pcd"), &cells_file(&touched.tactile))?;
            target.write(&format!("{stem}_tc.pcd"), &contacts_file(&contacts.collect::<Vec<_>>()))?;
        }
        match seen_points(sample)? {
            Some(points) => target.write(&format!("{stem}_pc.pcd"), &points_file(&points)),
            None => Ok(()),
        }
    }

    fn finish(self, _: &mut Target) -> Result<Map<String, Value>, ExportError> {
        Ok(Map::new())
    }
}

/// The points behind the partial grid, in `CameraCv` [m]: the stored cloud, or the depth crop's; `None` without both.
fn seen_points(sample: &PairSample<'_>) -> Result<Option<Vec<[f32; 3]>>, DatasetError> {
    if let Some(cloud) = sample.sample.find::<Cloud>()? {
        return Ok(Some(cloud.points));
    }
    let Some(depth) = sample.sample.find::<Depth>()? else { return Ok(None) };
    let crop = depth.crop;
    let points = (0u32..).zip(&crop.depth).filter(|(_, depth)| !depth.is_nan()).map(|(pixel, depth)| {
        let (u, v) = (crop.left + pixel % crop.width, crop.top + pixel / crop.width);
        let point = sample.pair.camera.unproject(f64::from(u) + 0.5, f64::from(v) + 0.5, f64::from(*depth));
        [point.x as f32, point.y as f32, point.z as f32]
    });
    Ok(Some(points.collect()))
}

/// The indices (x, y, z) of the occupied cells as float32, in C order.
fn cells_file(grid: &OccupancyGrid) -> Vec<u8> {
    // Indices are below 128: exact in float32.
    let points: Vec<[f32; 3]> = grid.cells().map(|cell| cell.map(|index| index as f32)).collect();
    points_file(&points)
}

/// Points without conversion.
fn points_file(points: &[[f32; 3]]) -> Vec<u8> {
    rows_file("x y z", points)
}

/// Contacts with their normals, in PCL's field names.
fn contacts_file(contacts: &[TouchContact]) -> Vec<u8> {
    let row = |contact: &TouchContact| {
        let ([x, y, z], [a, b, c]) = (contact.position, contact.normal);
        [x, y, z, a, b, c]
    };
    rows_file("x y z normal_x normal_y normal_z", &contacts.iter().map(row).collect::<Vec<_>>())
}

fn rows_file<const N: usize>(fields: &str, rows: &[[f32; N]]) -> Vec<u8> {
    let (count, [four, float, one]) = (rows.len(), ["4", "F", "1"].map(|word| [word; N].join(" ")));
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {fields}\nSIZE {four}\nTYPE {float}\nCOUNT {one}\n\
         WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    .into_bytes();
    bytes.extend(rows.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
