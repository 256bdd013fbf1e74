//! `graspmill segment`: the table in a depth picture, and the objects on it.

use std::{fmt::Write as _, io::Write as _, path::Path, time::Instant};

use serde::Serialize;

use super::{
    completion_args::SegmentArgs,
    exit::{Exit, Failure},
    picture::{FRAME, PictureRow, PlaneRow, SegmentedPicture, milliseconds_since},
    printer::Printer,
};
use format::dataset::NewFolder;
use kernel::{files::Folder, words::Show};
use perception::{Cluster, DepthFrame, PLANE_LABEL, Refusal, draw_outlines};
use surface::write_ply;

/// Content of `scene.json`.
#[derive(Serialize)]
struct SceneReport {
    format: &'static str,
    frame: &'static str,
    picture: PictureRow,
    plane: Option<PlaneRow>,
    objects: Vec<ObjectRow>,
    outlines: &'static str,
    /// File of the labels: 0 for no object, n for the n-th object, `table_label` for the table.
    labels: &'static str,
    table_label: u16,
    milliseconds: Times,
}

/// A cluster.
#[derive(Serialize)]
struct ObjectRow {
    name: String,
    /// File of the visible surface; `None` if it has no triangle.
    surface: Option<String>,
    pixels: usize,
    /// Columns and rows of the object's pixels in the given picture: left, top, right, bottom, the last included [px]; `None` if
    /// the given picture shows none of them.
    pixel_box: Option<[u32; 4]>,
    /// Mean of the object's points [m].
    centre: [f64; 3],
    /// Largest height of the object's points above the plane [m].
    height: Option<f64>,
    triangles: usize,
    /// Reason why the object cannot be completed.
    refusal: Option<String>,
}

/// Time by part [ms].
#[derive(Serialize)]
struct Times {
    read: f64,
    /// Plane and clusters.
    segment: f64,
    /// Visible surfaces.
    surfaces: f64,
}

/// `graspmill segment`.
pub fn segment(arguments: &SegmentArgs, printer: &Printer) -> Result<Exit, Failure> {
    let picture = SegmentedPicture::open(&arguments.picture)?;
    let scene = &picture.scene;
    let began = Instant::now();
    let sheets = scene.sheets();
    let surfaces = milliseconds_since(began);
    let labels = picture.labels();
    let extents = labels.extents();
    let folder = NewFolder::begin(&arguments.out)?;
    let mut objects = Vec::new();
    for (number, (cluster, sheet)) in (1..PLANE_LABEL).zip(scene.clusters.iter().zip(&sheets)) {
        let name = format!("object-{number}");
        let file = (!sheet.triangles.is_empty()).then(|| format!("{name}.ply"));
        if let Some(file) = &file {
            let comments = [format!("frame: {FRAME}"), "the visible surface, open at its rim".to_owned()];
            write(folder.folder(), file, &write_ply(sheet, &comments))?;
        }
        let centre = mean_point(&scene.frame, cluster);
        let extent = extents.get(&number);
        objects.push(ObjectRow {
            name,
            surface: file,
            pixels: extent.map_or(0, |extent| extent.pixels),
            pixel_box: extent.map(|extent| extent.bounds),
            centre,
            height: scene.plane.map(|plane| {
                let heights = cluster.pixels.iter().map(|pixel| plane.height(&scene.frame.point(*pixel)));
                heights.fold(f64::NEG_INFINITY, f64::max)
            }),
            triangles: sheet.triangles.len(),
            refusal: Refusal::from_cluster(cluster, sheet).map(|refusal| refusal.to_string()),
        });
    }
    write(folder.folder(), "outlines.png", &draw_outlines(&scene.frame, &scene.clusters))?;
    write(folder.folder(), "labels.png", &labels.to_png())?;
    let report = SceneReport {
        format: "graspmill scene 1",
        frame: FRAME,
        picture: picture.picture_row(),
        plane: picture.plane_row(),
        objects,
        outlines: "outlines.png",
        labels: "labels.png",
        table_label: PLANE_LABEL,
        milliseconds: Times { read: picture.read, segment: picture.segment, surfaces },
    };
    write(folder.folder(), "scene.json", (serde_json::to_string_pretty(&report)? + "\n").as_bytes())?;
    let out = folder.publish()?;
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report, &picture.plane_text(&arguments.picture), &out));
    }
    let is_whole = report.objects.iter().all(|object| object.refusal.is_none()) && !report.objects.is_empty();
    Ok(if is_whole { Exit::Complete } else { Exit::Refused })
}

/// Writes a file into a new folder.
pub fn write(folder: &Folder, name: &str, content: &[u8]) -> Result<(), Failure> {
    let written = folder.create_new(name).and_then(|mut file| file.write_all(content));
    written.map_err(|error| anyhow::Error::new(error).context(folder.path_of(name).shown().to_string()).into())
}

fn mean_point(frame: &DepthFrame, cluster: &Cluster) -> [f64; 3] {
    let sum = cluster.pixels.iter().map(|pixel| frame.point(*pixel).coords).sum::<nalgebra::Vector3<f64>>();
    (sum / cluster.pixels.len().max(1) as f64).into()
}

fn text(report: &SceneReport, plane: &str, out: &Path) -> String {
    let Times { read, segment, surfaces } = report.milliseconds;
    let mut text = format!("{plane}\n");
    if report.objects.is_empty() {
        text.push_str("no objects found: lower --min-points or --min-height\n");
    }
    for object in &report.objects {
        let ObjectRow { name, pixels, pixel_box, centre: [x, y, z], refusal, .. } = object;
        let [left, top, right, bottom] = pixel_box.unwrap_or_default();
        let height = object.height.map_or(String::new(), |height| format!(", {:.0} mm high", 1e3 * height));
        _ = writeln!(
            text,
            "{name}: {pixels} pixels in columns {left}-{right}, rows {top}-{bottom}; at {x:.3} {y:.3} {z:.3} m{height}"
        );
        if let Some(refusal) = refusal {
            _ = writeln!(text, "  refused: {refusal}");
        }
    }
    _ = writeln!(text, "read in {read:.1} ms, segmented in {segment:.1} ms, surfaces in {surfaces:.1} ms");
    _ = write!(text, "{}: surfaces (PLY), outlines.png, labels.png, scene.json", out.shown());
    text
}
