//! `graspmill segment`: the table in a depth picture, and the objects on it.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    io::Write as _,
    path::{Path, PathBuf},
    time::Instant,
};

use serde::Serialize;

use super::{
    completion_args::{PictureArgs, SegmentArgs},
    exit::{Exit, Failure},
    picture::{ContainerRow, FRAME, PictureRow, PlaneRow, SegmentedPicture, milliseconds_since},
    printer::Printer,
};
use format::dataset::NewFolder;
use kernel::{files::Folder, words::Show};
use perception::{CONTAINER_LABEL, Cluster, DepthFrame, OrientedBox, PLANE_LABEL, Refusal, Support, draw_outlines};
use surface::write_ply;

/// Summary of several pictures.
const FRAMES_FILE: &str = "frames.json";

/// Content of `scene.json`.
#[derive(Serialize)]
struct SceneReport {
    format: &'static str,
    frame: &'static str,
    picture: PictureRow,
    plane: Option<PlaneRow>,
    container: Option<ContainerRow>,
    objects: Vec<ObjectRow>,
    outlines: &'static str,
    /// File of the labels: 0 for no object, n for the n-th object, `table_label` for the table, `container_label` for the container.
    labels: &'static str,
    table_label: u16,
    container_label: u16,
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
    /// Box of smallest footprint around the visible points; `None` if all are outliers.
    #[serde(rename = "box")]
    cuboid: Option<BoxRow>,
    /// Share of the outline at which the picture shows that the object ends.
    confidence: f64,
    /// Things that the object leans on, in contact with it.
    leans_on: Vec<SupportRow>,
    /// Reason why the object cannot be completed.
    refusal: Option<String>,
}

/// Box of an object.
#[derive(Serialize)]
struct BoxRow {
    /// Middle [m].
    centre: [f64; 3],
    /// Unit vectors: the longer and the shorter side of the footprint, and the plane's normal.
    axes: [[f64; 3]; 3],
    /// Full lengths along them [m].
    size: [f64; 3],
}

/// Something that an object leans on.
#[derive(Serialize)]
struct SupportRow {
    /// Name of an object, `ground` or `container`.
    on: String,
    /// Length of the border that both share in the picture [m].
    border: f64,
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

/// Content of `frames.json`: several pictures in one call.
#[derive(Serialize)]
struct FramesReport {
    format: &'static str,
    frames: Vec<FrameRow>,
}

/// A picture of several.
#[derive(Serialize)]
struct FrameRow {
    /// Path of the file as given.
    file: String,
    /// Subfolder of its files; `None` for a refused picture.
    folder: Option<String>,
    objects: usize,
    /// Objects that cannot be completed.
    refused_objects: usize,
    /// Reason why the picture was refused.
    refusal: Option<String>,
}

/// `graspmill segment`.
pub fn segment(arguments: &SegmentArgs, printer: &Printer) -> Result<Exit, Failure> {
    if !arguments.more.is_empty() {
        return segment_several(arguments, printer);
    }
    let picture = SegmentedPicture::open(&arguments.picture)?;
    let folder = NewFolder::begin(&arguments.out)?;
    let report = write_scene(&picture, folder.folder())?;
    let out = folder.publish()?;
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report, &picture.plane_text(&arguments.picture), &out));
    }
    Ok(if report.is_whole() { Exit::Complete } else { Exit::Refused })
}

/// Segments each picture into a subfolder. A picture that cannot be read is refused, and the others are written.
fn segment_several(arguments: &SegmentArgs, printer: &Printer) -> Result<Exit, Failure> {
    SegmentedPicture::check_settings(&arguments.picture)?;
    let files: Vec<&PathBuf> = std::iter::once(&arguments.picture.depth).chain(&arguments.more).collect();
    let names = subfolder_names(&files)?;
    let folder = NewFolder::begin(&arguments.out)?;
    let (mut frames, mut is_whole) = (Vec::new(), true);
    for (file, name) in files.into_iter().zip(names) {
        let settings = PictureArgs { depth: file.clone(), ..arguments.picture.clone() };
        let file = file.shown().to_string();
        let picture = match SegmentedPicture::open(&settings) {
            Ok(picture) => picture,
            Err(failure) if failure.exit == Exit::BadSpec => {
                let refusal = Some(failure.text());
                frames.push(FrameRow { file, folder: None, objects: 0, refused_objects: 0, refusal });
                is_whole = false;
                continue;
            }
            Err(failure) => return Err(failure),
        };
        let inner = folder.folder().subfolder(&name);
        let created = inner.create();
        created.map_err(|error| anyhow::Error::new(error).context(inner.path().shown().to_string()))?;
        let report = write_scene(&picture, &inner)?;
        is_whole &= report.is_whole();
        let refused_objects = report.objects.iter().filter(|object| object.refusal.is_some()).count();
        let objects = report.objects.len();
        frames.push(FrameRow { file, folder: Some(name), objects, refused_objects, refusal: None });
    }
    let report = FramesReport { format: "graspmill frames 1", frames };
    write(folder.folder(), FRAMES_FILE, (serde_json::to_string_pretty(&report)? + "\n").as_bytes())?;
    let out = folder.publish()?;
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&frames_text(&report, &out));
    }
    Ok(if is_whole { Exit::Complete } else { Exit::Refused })
}

/// Subfolder of each picture: the name of its file without the ending.
fn subfolder_names(files: &[&PathBuf]) -> Result<Vec<String>, Failure> {
    let mut taken: BTreeMap<String, String> = BTreeMap::from([(FRAMES_FILE.to_owned(), FRAMES_FILE.to_owned())]);
    let name_of = |file: &&PathBuf| {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        match taken.insert(name.clone(), file.shown().to_string()) {
            None => Ok(name),
            Some(other) => {
                let remedy = "rename one of them, or segment them in two calls";
                let message = format!("{other}, {}: both would be written to {name}; {remedy}", file.shown());
                Err(Failure::message(Exit::BadSpec, message))
            }
        }
    };
    files.iter().map(name_of).collect()
}

/// Writes everything about a picture into its folder.
fn write_scene(picture: &SegmentedPicture, folder: &Folder) -> Result<SceneReport, Failure> {
    let scene = &picture.scene;
    let began = Instant::now();
    let sheets = scene.sheets();
    let surfaces = milliseconds_since(began);
    let labels = picture.labels();
    let extents = labels.extents();
    let outlines = picture.outlines();
    let mut objects = Vec::new();
    let parts = scene.clusters.iter().zip(&sheets).zip(&outlines);
    for (number, ((cluster, sheet), outline)) in (1..CONTAINER_LABEL).zip(parts) {
        let name = format!("object-{number}");
        let file = (!sheet.triangles.is_empty()).then(|| format!("{name}.ply"));
        if let Some(file) = &file {
            let comments = [format!("frame: {FRAME}"), "the visible surface, open at its rim".to_owned()];
            write(folder, file, &write_ply(sheet, &comments))?;
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
            cuboid: scene.box_of(cluster).map(box_row),
            confidence: outline.confidence,
            leans_on: outline.leans_on.iter().map(support_row).collect(),
            refusal: Refusal::from_cluster(cluster, sheet).map(|refusal| refusal.to_string()),
        });
    }
    write(folder, "outlines.png", &draw_outlines(&scene.frame, &scene.clusters))?;
    write(folder, "labels.png", &labels.to_png())?;
    let report = SceneReport {
        format: "graspmill scene 1",
        frame: FRAME,
        picture: picture.picture_row(),
        plane: picture.plane_row(),
        container: picture.container_row(),
        objects,
        outlines: "outlines.png",
        labels: "labels.png",
        table_label: PLANE_LABEL,
        container_label: CONTAINER_LABEL,
        milliseconds: Times { read: picture.read, segment: picture.segment, surfaces },
    };
    write(folder, "scene.json", (serde_json::to_string_pretty(&report)? + "\n").as_bytes())?;
    Ok(report)
}

impl SceneReport {
    /// Whether there are objects, and all can be completed.
    fn is_whole(&self) -> bool {
        self.objects.iter().all(|object| object.refusal.is_none()) && !self.objects.is_empty()
    }
}

/// Writes a file into a new folder.
pub fn write(folder: &Folder, name: &str, content: &[u8]) -> Result<(), Failure> {
    let written = folder.create_new(name).and_then(|mut file| file.write_all(content));
    written.map_err(|error| anyhow::Error::new(error).context(folder.path_of(name).shown().to_string()).into())
}

fn box_row(OrientedBox { centre, axes, size }: OrientedBox) -> BoxRow {
    BoxRow { centre: centre.into(), axes: axes.map(Into::into), size }
}

fn support_row((support, border): (&Support, &f64)) -> SupportRow {
    let on = match support {
        Support::Object(index) => format!("object-{}", index + 1),
        Support::Ground => "ground".to_owned(),
        Support::Container => "container".to_owned(),
    };
    SupportRow { on, border: *border }
}

fn mean_point(frame: &DepthFrame, cluster: &Cluster) -> [f64; 3] {
    let sum = cluster.pixels.iter().map(|pixel| frame.point(*pixel).coords).sum::<nalgebra::Vector3<f64>>();
    (sum / cluster.pixels.len().max(1) as f64).into()
}

fn frames_text(report: &FramesReport, out: &Path) -> String {
    let mut text = String::new();
    for FrameRow { file, folder, objects, refused_objects, refusal } in &report.frames {
        _ = match (folder, refusal) {
            (Some(folder), _) => writeln!(text, "{folder}: {objects} objects, {refused_objects} of them refused"),
            (None, refusal) => writeln!(text, "{file}: refused: {}", refusal.as_deref().unwrap_or_default()),
        };
    }
    _ = write!(text, "{}: a subfolder per picture, {FRAMES_FILE}", out.shown());
    text
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
