//! `graspmill complete` on the samples of a dataset.

use std::time::Instant;

use serde::Serialize;

use super::{
    complete::mesh_bytes,
    completion_args::{CompleteArgs, DetailName, LooseName, MeshFormat},
    completion_method::{BUNDLED, CompletionMethod},
    exit::{Exit, Failure},
    machine,
    parallel::in_parallel,
    picture::milliseconds_since,
    printer::Printer,
    segment::write,
    stored_samples::{StoredSample, choose_samples},
};
use format::dataset::NewFolder;
use kernel::{files::Folder, geom::TriMesh, words::Show};
use measure::GridOverlap;
use surface::{LooseBodies, keep_largest_body};

/// Content of `samples.json`.
#[derive(Serialize)]
struct Report<'a> {
    format: &'static str,
    /// Root digest of the dataset.
    dataset: String,
    /// SHA-256 of the model's `model.json`; `None` for a baseline.
    model: Option<&'a str>,
    /// Folder of the model, or name of the baseline.
    method: String,
    detail: DetailName,
    samples: Vec<SampleRow>,
}

#[derive(Serialize)]
struct SampleRow {
    sample: String,
    /// File of the mesh; `None` if nothing is found.
    mesh: Option<String>,
    /// Overlap of the occupied cells with the true ones.
    overlap: GridOverlap,
    triangles: usize,
    /// [m^3].
    volume: f64,
    /// Disconnected bodies, and the shares of area and volume in all but the largest.
    #[serde(flatten)]
    bodies: LooseBodies,
}

/// Completes stored samples: one mesh per sample, in the camera's frame.
pub fn complete_dataset(arguments: &CompleteArgs, printer: &Printer) -> Result<Exit, Failure> {
    let picture = &arguments.picture;
    let is_about_camera =
        picture.intrinsics.is_some() || picture.depth_scale.is_some() || picture.range || picture.flip;
    if is_about_camera || picture.plane.is_some() || picture.no_plane {
        let message = format!("{} is a dataset: leave out the options for pictures", picture.depth.shown());
        return Err(Failure::message(Exit::BadSpec, message));
    }
    if arguments.to == MeshFormat::Mjcf || arguments.touch.is_some() || arguments.camera_pose.is_some() {
        let message = "samples of a dataset are written as ply, obj or stl and contain their own contacts and poses: leave out --to mjcf, --touch and --camera-pose";
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let detail = arguments.detail.unwrap_or(DetailName::Coverage);
    let folder = Folder::at(&picture.depth);
    let (reader, chosen) = choose_samples(&folder, "complete", arguments.split.as_deref(), arguments.limit)?;
    let method = match (&arguments.model, &arguments.method) {
        (Some(folder), _) => CompletionMethod::open(folder)?,
        (None, name) => CompletionMethod::by_name(name.as_deref().unwrap_or(BUNDLED), arguments.smoothing, &reader)?,
    };
    let made_by = method.digest().map_or_else(|| method.name(), str::to_owned);
    let began = Instant::now();
    let work = |index: usize| -> Result<(SampleRow, TriMesh), Failure> {
        let sample = StoredSample::read(&reader, chosen[index])?;
        let answer = method.complete(&sample)?;
        let mut mesh = method.mesh(&answer, &sample, detail)?;
        if arguments.loose == LooseName::Drop {
            keep_largest_body(&mut mesh);
        }
        let file = format!("{}.{}", plain(&sample.name), arguments.to.extension());
        let row = SampleRow {
            overlap: GridOverlap::new(&answer.cells(), &sample.pair.complete, &sample.pair.partial),
            mesh: (!mesh.triangles.is_empty()).then_some(file),
            triangles: mesh.triangles.len(),
            volume: mesh.signed_volume(),
            bodies: LooseBodies::from_mesh(&mesh),
            sample: sample.name,
        };
        Ok((row, mesh))
    };
    let results = in_parallel(chosen.len(), machine::threads(arguments.threads), work);
    let took = milliseconds_since(began);
    let folder = NewFolder::begin(&arguments.out)?;
    let mut rows = Vec::new();
    for result in results {
        let (row, mesh) = result?;
        if let Some(file) = &row.mesh {
            let comments = [format!("sample: {}", row.sample), format!("model: {made_by}")];
            write(folder.folder(), file, &mesh_bytes(&mesh, arguments.to, &comments))?;
        }
        rows.push(row);
    }
    let report = Report {
        format: "graspmill completed samples 1",
        dataset: reader.manifest().root.hex(),
        model: method.digest(),
        method: method.name(),
        detail,
        samples: rows,
    };
    write(folder.folder(), "samples.json", (serde_json::to_string_pretty(&report)? + "\n").as_bytes())?;
    let out = folder.publish()?;
    let empty = report.samples.iter().filter(|row| row.mesh.is_none()).count();
    if arguments.json {
        printer.json(&report)?;
    } else {
        let count = report.samples.len() as f64;
        let mean = report.samples.iter().map(|row| row.overlap.iou).sum::<f64>() / count;
        let meshes = report.samples.len() - empty;
        let loose = report.samples.iter().filter(|row| row.bodies.bodies > 1).count();
        printer.result(&format!(
            "{meshes} meshes, {empty} samples without; mean intersection over union {mean:.3}; {:.1} ms per sample\n{loose} meshes with disconnected bodies\n{}: meshes, samples.json",
            took / count,
            out.shown()
        ));
    }
    Ok(if empty == 0 { Exit::Complete } else { Exit::Refused })
}

/// Sample name as a file name.
fn plain(name: &str) -> String {
    name.chars().map(|letter| if letter.is_ascii_alphanumeric() || letter == '-' { letter } else { '_' }).collect()
}
