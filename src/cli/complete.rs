//! `graspmill complete`: closed meshes of the objects in a depth picture.

use std::{
    fmt::Write as _,
    path::Path,
    time::{Duration, Instant},
};

use nalgebra::{Isometry3, Point3};
use serde::Serialize;

use super::{
    completion_args::{CompleteArgs, DetailName, LooseName, MeshFormat},
    completion_method::{BUNDLED, baseline_of, smoothed},
    contacts::read_contacts,
    exit::{Exit, Failure},
    machine,
    model::refused,
    parallel::in_parallel,
    picture::{FRAME, PictureRow, PlaneRow, SegmentedPicture, given_pose, milliseconds_since},
    printer::Printer,
    scene_picture::completed_picture,
    segment::write,
};
use format::dataset::NewFolder;
use kernel::{files::Folder, geom::TriMesh, words::Show};
use measure::free_space_violation;
use perception::{CONTAINER_LABEL, LabelImage, PLANE_LABEL, read_mask};
use runtime::completion::{Completed, Completer, CompletionError, CompletionModel, InputName, SegmentedScene};
use surface::{LooseBodies, MeshBody, TablePlane, write_mjcf, write_obj, write_ply, write_stl};

/// Density of completed objects in a MuJoCo scene [kg/m^3]: that of filled packages, between foam and water.
const DENSITY: f64 = 550.0;

/// Content of `scene.json`.
#[derive(Serialize)]
struct SceneReport<'a> {
    format: &'static str,
    frame: &'static str,
    picture: PictureRow,
    plane: Option<PlaneRow>,
    /// Pose of the camera in the world, row by row, if it was given; every other number is in the camera's frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    world_from_camera: Option<[[f64; 4]; 4]>,
    model: Option<ModelRow<'a>>,
    /// Baseline used instead of a model.
    #[serde(skip_serializing_if = "Option::is_none")]
    method: Option<&'a str>,
    /// Meshing method for targets.
    detail: DetailName,
    objects: Vec<ObjectRow>,
    overlay: &'static str,
    milliseconds: Times,
}

#[derive(Serialize)]
struct ModelRow<'a> {
    /// Folder as given, or `bundled` for the network in the program.
    folder: String,
    network: &'a str,
    /// SHA-256 of `model.json`.
    digest: &'a str,
    inputs: &'a [String],
}

/// A cluster and its mesh.
#[derive(Serialize)]
struct ObjectRow {
    name: String,
    /// `target`, or `obstacle`: the fast mesh of all cells that it may touch.
    role: &'static str,
    /// Count of its pixels in the given picture.
    pixels: usize,
    /// Reason why the cluster has no mesh.
    refusal: Option<String>,
    completed: Option<CompletedRow>,
}

#[derive(Serialize)]
struct CompletedRow {
    mesh: String,
    /// Middle of the visible part's box [m].
    grid_centre: [f64; 3],
    cell_size: f64,
    /// Cells with an observed point.
    partial_cells: u32,
    /// Pixels left out as outliers.
    outliers: usize,
    /// Cells that were touched.
    touched_cells: u32,
    /// Contacts outside the grid, which were ignored.
    contacts_outside: usize,
    triangles: usize,
    /// [m^3].
    volume: f64,
    /// Lower and upper corner [m].
    bounds: [[f64; 3]; 2],
    /// Pieces under 1 % of the volume that were dropped.
    dropped_pieces: usize,
    /// Disconnected bodies, and the shares of area and volume in all but the largest.
    #[serde(flatten)]
    bodies: LooseBodies,
    /// Voxels per cell along each axis, where they are finer than cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    upsampling: Option<usize>,
    /// Share of the mesh's area that is more than 8 mm in front of every depth within 3 pixels.
    free_space_violation: f64,
    /// Share of the mesh's vertices below the plane; `None` without one.
    below_plane: Option<f64>,
    milliseconds: CompletedTimes,
}

#[derive(Serialize)]
struct CompletedTimes {
    input: f64,
    network: f64,
    mesh: f64,
}

/// Time by part [ms]. Without reading, the thesis reports T = segment + target + others (section 5.4.5).
#[derive(Serialize)]
struct Times {
    open_model: f64,
    read: f64,
    /// Plane and clusters.
    segment: f64,
    /// Mean time per target on one thread.
    target: f64,
    /// Mean time per obstacle on one thread.
    other: f64,
    /// Wall-clock time of all objects.
    objects: f64,
}

/// `graspmill complete` on a picture.
pub fn complete(arguments: &CompleteArgs, printer: &Printer) -> Result<Exit, Failure> {
    if arguments.split.is_some() || arguments.limit.is_some() {
        let message = format!("{} is not a dataset: leave out --split and --limit", arguments.picture.depth.shown());
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let world_from_camera =
        arguments.camera_pose.as_deref().map(|text| given_pose("--camera-pose", text)).transpose()?;
    let contacts = arguments.touch.as_deref().map(read_contacts).transpose()?.unwrap_or_default();
    let began = Instant::now();
    let detail = arguments.detail.unwrap_or(DetailName::Joined);
    let completer = completer_of(arguments, detail)?;
    let open_model = milliseconds_since(began);
    let mut picture = SegmentedPicture::open(&arguments.picture)?;
    let targets = targets(arguments, &mut picture)?;
    if !contacts.is_empty() {
        check_touch(&completer, &targets)?;
    }
    let scene = &picture.scene;
    let began = Instant::now();
    let results = complete_all(&completer, scene, &targets, &contacts, arguments.threads);
    let objects = milliseconds_since(began);
    if let (Some(file), Some(error)) = (&arguments.touch, results.iter().find_map(without_contact)) {
        return Err(Failure::message(Exit::BadSpec, format!("--touch {}: {error}", file.shown())));
    }
    let folder = NewFolder::begin(&arguments.out)?;
    let rows = write_meshes(folder.folder(), arguments, &completer, &picture, &targets, &results)?;
    if arguments.to == MeshFormat::Mjcf {
        write(folder.folder(), "scene.xml", scene_xml(scene, &rows, world_from_camera.as_ref()).as_bytes())?;
    }
    let meshes: Vec<Option<&TriMesh>> = results.iter().map(|result| Some(&result.as_ref().ok()?.mesh)).collect();
    write(folder.folder(), "overlay.png", &completed_picture(scene, &meshes).to_png())?;
    let report = SceneReport {
        format: "graspmill scene 1",
        frame: FRAME,
        picture: picture.picture_row(),
        plane: picture.plane_row(),
        world_from_camera: world_from_camera.map(|pose| pose.to_homogeneous().transpose().into()),
        model: completer.model().map(|model| ModelRow {
            folder: arguments.model.as_deref().map_or_else(|| BUNDLED.to_owned(), |folder| folder.shown().to_string()),
            network: &model.facts().network,
            digest: model.digest(),
            inputs: &model.facts().inputs,
        }),
        method: arguments.method.as_deref(),
        detail,
        objects: rows,
        overlay: "overlay.png",
        milliseconds: Times {
            open_model,
            read: picture.read,
            segment: picture.segment,
            target: mean_milliseconds(&results, |index| targets.contains(&index)),
            other: mean_milliseconds(&results, |index| !targets.contains(&index)),
            objects,
        },
    };
    write(folder.folder(), "scene.json", (serde_json::to_string_pretty(&report)? + "\n").as_bytes())?;
    let out = folder.publish()?;
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&text(&report, &picture.plane_text(&arguments.picture), targets.len(), &out));
    }
    let is_whole = report.objects.iter().all(|object| object.refusal.is_none()) && !report.objects.is_empty();
    Ok(if is_whole { Exit::Complete } else { Exit::Refused })
}

/// The model or the baseline that the arguments select, with its settings; the network in the program by default.
fn completer_of(arguments: &CompleteArgs, detail: DetailName) -> Result<Completer, Failure> {
    let completer = match (&arguments.model, &arguments.method) {
        (Some(folder), _) => Completer::new(CompletionModel::open(folder).map_err(refused)?, detail.into()),
        (None, method) => {
            let (name, rule) = smoothed(method.as_deref().unwrap_or(BUNDLED), arguments.smoothing);
            let completer = match name {
                BUNDLED => Completer::new(CompletionModel::bundled(), detail.into()),
                _ => Completer::by_baseline(baseline_of(name)?, detail.into()),
            };
            match rule {
                Some(rule) => completer.with_smoothing(rule),
                None => completer,
            }
        }
    };
    Ok(match arguments.loose {
        LooseName::Keep => completer,
        LooseName::Drop => completer.without_loose_bodies(),
    })
}

/// Mesh of a cluster, or the reason why there is none.
type ClusterResult = Result<Completed, CompletionError>;

/// Error of an object whose contacts are all outside its grid.
fn without_contact(result: &ClusterResult) -> Option<&CompletionError> {
    result.as_ref().err().filter(|error| matches!(error, CompletionError::NoContactInside { .. }))
}

/// Writes the meshes of all clusters; a row per cluster.
fn write_meshes(
    folder: &Folder,
    arguments: &CompleteArgs,
    completer: &Completer,
    picture: &SegmentedPicture,
    targets: &[usize],
    results: &[ClusterResult],
) -> Result<Vec<ObjectRow>, Failure> {
    let scene = &picture.scene;
    let extents = LabelImage::of_clusters(&scene.frame, &scene.clusters).extents();
    let made_by = match completer.model() {
        Some(model) => format!("model: {}", model.digest()),
        None => format!("method: {}", arguments.method.as_deref().unwrap_or_default()),
    };
    let mut rows = Vec::new();
    for (index, (label, result)) in (1..CONTAINER_LABEL).zip(results).enumerate() {
        let name = format!("object-{label}");
        let role = if targets.contains(&index) { "target" } else { "obstacle" };
        let pixels = extents.get(&label).map_or(0, |extent| extent.pixels);
        let row = match result {
            Ok(completed) => {
                let file = format!("{name}.{}", arguments.to.extension());
                let comments = [format!("frame: {FRAME}"), format!("role: {role}"), made_by.clone()];
                write(folder, &file, &mesh_bytes(&completed.mesh, arguments.to, &comments))?;
                let completed = Some(completed_row(scene, completed, file));
                ObjectRow { name, role, pixels, refusal: None, completed }
            }
            Err(error) => ObjectRow { name, role, pixels, refusal: Some(error.to_string()), completed: None },
        };
        rows.push(row);
    }
    Ok(rows)
}

/// Mean time of the completed clusters with these indices [ms]; 0 without any.
fn mean_milliseconds(results: &[ClusterResult], is_chosen: impl Fn(usize) -> bool) -> f64 {
    let chosen = results.iter().enumerate().filter(|(index, _)| is_chosen(*index));
    let times: Vec<Duration> = chosen.filter_map(|(_, result)| Some(result.as_ref().ok()?.timings.total())).collect();
    times.iter().sum::<Duration>().as_secs_f64() * 1e3 / times.len().max(1) as f64
}

/// Completes every cluster, each by one thread, in the clusters' order.
fn complete_all(
    completer: &Completer,
    scene: &SegmentedScene,
    targets: &[usize],
    contacts: &[[f32; 3]],
    threads: Option<u16>,
) -> Vec<ClusterResult> {
    in_parallel(scene.clusters.len(), machine::threads(threads), |index| {
        let cluster = &scene.clusters[index];
        if targets.contains(&index) {
            completer.complete_touched(scene, cluster, contacts)
        } else {
            completer.complete_obstacle(scene, cluster)
        }
    })
}

/// Refuses contacts without a target, with several targets, or for a model without a touch input.
fn check_touch(completer: &Completer, targets: &[usize]) -> Result<(), Failure> {
    let wrong = |problem: String| Err(Failure::message(Exit::BadSpec, format!("--touch: {problem}")));
    if targets.len() != 1 {
        return wrong(format!("contacts belong to one object, but --target selects {}", targets.len()));
    }
    if completer.model().is_some_and(|model| !model.inputs().contains(&InputName::Touch)) {
        return wrong(CompletionError::TakesNoTouch.to_string());
    }
    Ok(())
}

/// Indices of the clusters that `--target` selects. The pixels of a mask become the first cluster.
fn targets(arguments: &CompleteArgs, picture: &mut SegmentedPicture) -> Result<Vec<usize>, Failure> {
    let text = arguments.target.as_str();
    if text.to_ascii_lowercase().ends_with(".png") {
        let pixels = read_mask(Path::new(text), &picture.scene.frame).map_err(Failure::of_input)?;
        picture.scene.put_first(pixels, arguments.picture.min_points as usize);
        return Ok(vec![0]);
    }
    let scene = &picture.scene;
    let count = scene.clusters.len();
    let wrong = |problem: String| {
        let remedy = "give auto, all, the number of an object, a pixel U,V (column and row), or a mask (.png)";
        Err(Failure::message(Exit::BadSpec, format!("--target {text}: {problem}; {remedy}")))
    };
    match text {
        "all" => return Ok((0..count).collect()),
        "auto" => return Ok(nearest_to_middle(picture).into_iter().collect()),
        _ => {}
    }
    if let Ok(number) = text.parse::<usize>() {
        return if (1..=count).contains(&number) {
            Ok(vec![number - 1])
        } else {
            wrong(format!("the picture has {count} objects"))
        };
    }
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let pixel = text.split_once(',').and_then(|(u, v)| Some([number(u)?, number(v)?]));
    let Some(pixel) = pixel else { return wrong("not a valid target".to_owned()) };
    object_at(pixel, picture).map(|index| vec![index]).or_else(wrong)
}

/// Index of the cluster at a pixel of the given picture, or the reason why there is none. Whole numbers are pixel centres.
fn object_at([u, v]: [f64; 2], picture: &SegmentedPicture) -> Result<usize, String> {
    let labels = picture.labels();
    let Some((column, row)) = index_at(u, labels.width).zip(index_at(v, labels.height)) else {
        return Err(format!("the picture has {} x {} pixels", labels.width, labels.height));
    };
    match labels.at(column, row) {
        Some(CONTAINER_LABEL) => Err("the pixel shows the container, not an object".to_owned()),
        Some(PLANE_LABEL) => Err("the pixel shows the table, not an object".to_owned()),
        Some(label) if label > 0 => Ok(usize::from(label) - 1),
        _ if !picture.scene.frame.has_return_at(column, row) => Err("the pixel has no depth".to_owned()),
        _ => Err("no object is at that pixel".to_owned()),
    }
}

/// Index of the column or row whose centre is nearest to a coordinate; `None` outside the picture.
fn index_at(coordinate: f64, side: u32) -> Option<u32> {
    let index = (coordinate + 0.5).floor();
    (0.0..f64::from(side)).contains(&index).then_some(index as u32)
}

/// Index of the cluster whose mean pixel is nearest to the middle of the given picture, among clusters that the border does not
/// cut.
fn nearest_to_middle(picture: &SegmentedPicture) -> Option<usize> {
    let labels = picture.labels();
    let extents = labels.extents();
    let middle = [labels.width, labels.height].map(|side| 0.5 * (f64::from(side) - 1.0));
    let clusters = (1..CONTAINER_LABEL).zip(&picture.scene.clusters);
    let whole = clusters.filter(|(_, cluster)| !cluster.touches_border);
    let distances = whole.filter_map(|(label, _)| {
        let [column, row] = extents.get(&label)?.mean;
        Some((usize::from(label) - 1, (column - middle[0]).powi(2) + (row - middle[1]).powi(2)))
    });
    distances.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(index, _)| index)
}

fn completed_row(scene: &SegmentedScene, completed: &Completed, mesh: String) -> CompletedRow {
    let bounds = completed.mesh.aabb().expect("a mesh with triangles");
    let points: Vec<Point3<f64>> =
        completed.mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
    let share = |count: usize| count as f64 / points.len() as f64;
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    let timings = &completed.timings;
    CompletedRow {
        mesh,
        grid_centre: completed.placement.centre.into(),
        cell_size: completed.placement.cell_size,
        partial_cells: completed.partial.count(),
        outliers: completed.outliers,
        touched_cells: completed.touched,
        contacts_outside: completed.contacts_outside,
        triangles: completed.mesh.triangles.len(),
        volume: completed.mesh.signed_volume(),
        bounds: [bounds.min.into(), bounds.max.into()],
        dropped_pieces: completed.dropped,
        upsampling: completed.factor,
        bodies: completed.bodies,
        free_space_violation: free_space_violation(&completed.mesh, &scene.frame.camera, &scene.frame.depth),
        below_plane: scene.plane.map(|plane| share(points.iter().filter(|point| plane.height(point) < 0.0).count())),
        milliseconds: CompletedTimes {
            input: milliseconds(timings.input),
            network: milliseconds(timings.network),
            mesh: milliseconds(timings.mesh),
        },
    }
}

pub fn mesh_bytes(mesh: &TriMesh, format: MeshFormat, comments: &[String]) -> Vec<u8> {
    match format {
        MeshFormat::Ply => write_ply(mesh, comments),
        MeshFormat::Obj | MeshFormat::Mjcf => write_obj(mesh, comments).into_bytes(),
        MeshFormat::Stl => write_stl(mesh),
    }
}

fn scene_xml(scene: &SegmentedScene, rows: &[ObjectRow], world_from_camera: Option<&Isometry3<f64>>) -> String {
    let body = |row: &ObjectRow| {
        let file = row.completed.as_ref()?.mesh.clone();
        Some(MeshBody { name: row.name.clone(), file, density: DENSITY })
    };
    let bodies: Vec<MeshBody> = rows.iter().filter_map(body).collect();
    let table = scene.plane.map(|plane| TablePlane { point: plane.foot().into(), normal: plane.normal.into() });
    write_mjcf(&bodies, table.as_ref(), world_from_camera)
}

/// Text about disconnected bodies.
pub fn loose_words(found: &LooseBodies) -> String {
    let LooseBodies { bodies, loose_area, loose_volume } = found;
    let (area, volume) = (100.0 * loose_area, 100.0 * loose_volume);
    format!("{bodies} disconnected bodies; {area:.1} % of the area and {volume:.1} % of the volume outside the largest")
}

fn text(report: &SceneReport<'_>, plane: &str, targets: usize, out: &Path) -> String {
    let mut text = format!("{plane}\n");
    if let Some(ModelRow { folder, digest, .. }) = report.model.as_ref().filter(|model| model.folder == BUNDLED) {
        _ = writeln!(text, "model: {folder}, the network in this program ({}); --model selects another", &digest[..12]);
    }
    if report.objects.is_empty() {
        text.push_str("no objects found: lower --min-points or --min-height\n");
    }
    for ObjectRow { name, role, refusal, completed, .. } in &report.objects {
        if let Some(row) = completed {
            let CompletedRow { triangles, volume, free_space_violation, bounds: [low, high], .. } = row;
            let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| 1e3 * (high[axis] - low[axis]));
            _ = writeln!(
                text,
                "{name}: {role}, {x:.0} x {y:.0} x {z:.0} mm, {:.0} ml, {triangles} triangles; {:.1} % in front of the observed depth",
                1e6 * volume,
                100.0 * free_space_violation
            );
            if row.bodies.bodies > 1 {
                _ = writeln!(text, "{name}: {}", loose_words(&row.bodies));
            }
            if row.contacts_outside > 0 {
                _ = writeln!(text, "{name}: ignored contacts outside its grid: {}", row.contacts_outside);
            }
        }
        if let Some(refusal) = refusal {
            _ = writeln!(text, "{name}: refused: {refusal}");
        }
    }
    let Times { open_model, read, segment, target, other, objects } = report.milliseconds;
    let others = report.objects.iter().filter(|object| object.completed.is_some() && object.role == "obstacle").count();
    _ = writeln!(text, "model opened in {open_model:.0} ms, picture read in {read:.1} ms");
    _ = writeln!(
        text,
        "T = segment {segment:.1} + {targets} x target {target:.1} + {others} x other {other:.1} ms; all objects in {objects:.1} ms wall-clock time"
    );
    _ = write!(text, "{}: meshes, overlay.png, scene.json", out.shown());
    text
}
