//! From a cluster of pixels to a closed mesh.

use std::time::{Duration, Instant};

use infer::{CompletionModel, InputName, Inputs, Prediction};
use kernel::geom::{GridPlacement, OccupancyGrid, SimdLevel, TriMesh};
use measure::{Baseline, SeenCells, SeenPoint, SupportPlane};
use perception::{Cluster, DepthFrame, NetworkInput, Refusal, SceneRule, SegmentedScene, visible_sheet};
use surface::{CubeField, LaplacianRule, LooseBodies, SeenObject, keep_largest_body};

use super::{
    answer::{Answer, Detail},
    error::CompletionError,
};

/// Minimum number of cells with an observed point: a square of five by five.
const MIN_CELLS: u32 = 25;

/// Time by part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timings {
    /// Time to fill the grids of the input.
    pub input: Duration,
    /// Time of the network.
    pub network: Duration,
    /// Time from grids to a mesh.
    pub mesh: Duration,
}

impl Timings {
    /// Total of all parts.
    pub fn total(&self) -> Duration {
        self.input + self.network + self.mesh
    }
}

/// An object completed by the part that no camera saw.
#[derive(Clone, Debug, PartialEq)]
pub struct Completed {
    /// Placement of the grids.
    pub placement: GridPlacement,
    /// Cells that contain an observed point.
    pub partial: OccupancyGrid,
    /// Cells that the camera sees through, and those below the plane.
    pub free: OccupancyGrid,
    /// Prediction of the network or the baseline.
    pub prediction: Prediction,
    /// A closed, manifold mesh in `CameraCv` [m], wound outward.
    pub mesh: TriMesh,
    /// Pieces under 1 % of the volume that were dropped, and bodies that were dropped by a setting.
    pub dropped: usize,
    /// Disconnected bodies of the mesh, and their shares.
    pub bodies: LooseBodies,
    /// Pixels left out as outliers.
    pub outliers: usize,
    /// Cells that were touched.
    pub touched: u32,
    /// Contacts outside the grid, which were ignored.
    pub contacts_outside: usize,
    /// Voxels per cell along each axis; `None` for a mesh of the grid's own cells.
    pub factor: Option<usize>,
    /// Time by part.
    pub timings: Timings,
}

/// Completes objects with a model or a baseline. Threads can share it; each call runs on the thread of its caller.
///
/// ```no_run
/// use graspmill_runtime::completion::{
///     CameraDescription, Completer, CompletionModel, Detail, FrameRule, SceneRule, read_frame,
/// };
///
/// let camera = CameraDescription::parse("615.2,615.4,320.1,239.7")?;
/// let rule = FrameRule { camera: Some(camera), ..FrameRule::default() };
/// let frame = read_frame("depth.png".as_ref(), &rule)?.frame;
///
/// let completer = Completer::new(CompletionModel::open("models/standard".as_ref())?, Detail::Joined);
/// let scene = completer.segment(frame, &SceneRule::default());
/// for cluster in &scene.clusters {
///     let completed = completer.complete(&scene, cluster)?;
///     println!("{} triangles in {:?}", completed.mesh.triangles.len(), completed.timings.total());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Completer {
    method: Method,
    detail: Detail,
    smoothing: Option<LaplacianRule>,
    drops_loose: bool,
}

#[derive(Debug)]
enum Method {
    Model(Box<CompletionModel>),
    Baseline(Baseline),
}

/// Cells per axis of the grid that baselines fill: that of the networks.
const BASELINE_RESOLUTION: u32 = 40;

impl Completer {
    /// Creates a completer for a model.
    pub fn new(model: CompletionModel, detail: Detail) -> Self {
        Self { method: Method::Model(Box::new(model)), detail, smoothing: None, drops_loose: false }
    }

    /// Creates a completer for a baseline that learns nothing.
    pub fn by_baseline(baseline: Baseline, detail: Detail) -> Self {
        Self { method: Method::Baseline(baseline), detail, smoothing: None, drops_loose: false }
    }

    /// Smooths the meshes of targets, for every meshing method. Obstacles stay as they are, because smoothing shrinks.
    pub fn with_smoothing(self, rule: LaplacianRule) -> Self {
        Self { smoothing: Some(rule), ..self }
    }

    /// Drops all bodies of a mesh but the largest; without it, only pieces under 1 % of the volume are dropped.
    pub fn without_loose_bodies(self) -> Self {
        Self { drops_loose: true, ..self }
    }

    /// The model; `None` for a baseline.
    pub fn model(&self) -> Option<&CompletionModel> {
        match &self.method {
            Method::Model(model) => Some(model),
            Method::Baseline(_) => None,
        }
    }

    /// Segments a picture.
    ///
    /// # Panics
    /// If the clusters' tolerance is not positive.
    pub fn segment(&self, frame: DepthFrame, rule: &SceneRule) -> SegmentedScene {
        SegmentedScene::segment(frame, rule)
    }

    /// Completes an object to grasp.
    ///
    /// # Errors
    /// When the picture's border cuts it, too little of it was seen, or the network's answer can't be used.
    pub fn complete(&self, scene: &SegmentedScene, cluster: &Cluster) -> Result<Completed, CompletionError> {
        self.by(scene, cluster, Some(self.detail), &[])
    }

    /// Completes an object to grasp that was touched at these points, in `CameraCv` [m]. Points outside its grid are ignored.
    ///
    /// # Errors
    /// Like those of [`Completer::complete`]; and when there are contacts, but none in the grid.
    pub fn complete_touched(
        &self,
        scene: &SegmentedScene,
        cluster: &Cluster,
        contacts: &[[f32; 3]],
    ) -> Result<Completed, CompletionError> {
        self.by(scene, cluster, Some(self.detail), contacts)
    }

    /// Completes an object to avoid: the fast mesh of all cells that it may touch, about 0.7 cells outside it. Cells that the
    /// camera sees through are excluded.
    ///
    /// # Errors
    /// Like those of [`Completer::complete`].
    pub fn complete_obstacle(&self, scene: &SegmentedScene, cluster: &Cluster) -> Result<Completed, CompletionError> {
        self.by(scene, cluster, None, &[])
    }

    fn by(
        &self,
        scene: &SegmentedScene,
        cluster: &Cluster,
        detail: Option<Detail>,
        contacts: &[[f32; 3]],
    ) -> Result<Completed, CompletionError> {
        let began = Instant::now();
        if let Some(refusal) = Refusal::from_cluster(cluster, &visible_sheet(&scene.frame, &cluster.pixels)) {
            return Err(refusal.into());
        }
        let resolution = self.model().map_or(BASELINE_RESOLUTION, |model| model.facts().resolution);
        let input = NetworkInput::new(&scene.frame, cluster, scene.plane.as_ref(), resolution, SimdLevel::detect())?;
        let cells = input.partial.count();
        if cells < MIN_CELLS {
            return Err(CompletionError::FewCells { cells, needed: MIN_CELLS });
        }
        let (touched, contacts_outside) = touched_cells(contacts, &input.placement);
        if !contacts.is_empty() && contacts_outside == contacts.len() {
            return Err(CompletionError::NoContactInside { count: contacts.len() });
        }
        let after_input = Instant::now();
        let answer = self.predict(scene, &input, &touched)?;
        let after_network = Instant::now();
        // Without an occupied cell there are only observed points: a sheet, and no body to grasp.
        if detail.is_some() && answer.cells().count() == 0 {
            return Err(CompletionError::Nothing);
        }
        let (mut completed, factor) = match detail {
            None | Some(Detail::Fast) => {
                let possible = possible_cells(&answer.prediction.occupancy, &input);
                (answer.obstacle(&possible, &input.placement), None)
            }
            Some(detail) => {
                let seen = || Ok::<_, CompletionError>(seen_object(scene, &input));
                answer.mesh(detail, &input.placement, contacts, seen)?
            }
        };
        if completed.mesh.triangles.is_empty() {
            return Err(CompletionError::Nothing);
        }
        if self.drops_loose {
            completed.dropped += keep_largest_body(&mut completed.mesh);
        }
        if let Some(rule) = self.smoothing.filter(|_| detail.is_some()) {
            rule.smooth(&mut completed.mesh);
        }
        let timings =
            Timings { input: after_input - began, network: after_network - after_input, mesh: after_network.elapsed() };
        Ok(Completed {
            bodies: LooseBodies::from_mesh(&completed.mesh),
            placement: input.placement,
            partial: input.partial,
            free: input.free,
            prediction: answer.prediction,
            mesh: completed.mesh,
            dropped: completed.dropped,
            outliers: input.outliers.len(),
            touched: touched.count(),
            contacts_outside,
            factor,
            timings,
        })
    }

    /// Occupancy, and coverage if the method predicts it.
    fn predict(
        &self,
        scene: &SegmentedScene,
        input: &NetworkInput,
        touched: &OccupancyGrid,
    ) -> Result<Answer, CompletionError> {
        match &self.method {
            Method::Model(model) => {
                if touched.count() > 0 && !model.inputs().contains(&InputName::Touch) {
                    return Err(CompletionError::TakesNoTouch);
                }
                let [partial, free, touch] = [&input.partial, &input.free, touched].map(CubeField::from_grid);
                let inputs = Inputs { partial: Some(&partial), free: Some(&free), touch: Some(&touch) };
                Ok(Answer::of_model(model, model.predict(&inputs)?))
            }
            Method::Baseline(baseline) => {
                // Touched cells count as observed ones.
                let mut partial = input.partial.clone();
                touched.cells().for_each(|cell| partial.set(cell));
                let support = scene.plane.map(|plane| SupportPlane { normal: plane.normal, offset: plane.offset });
                if baseline.needs_table() && support.is_none() {
                    return Err(CompletionError::NoTable(*baseline));
                }
                let points = if baseline.needs_points() { seen_points(&seen_object(scene, input)) } else { Vec::new() };
                let (free, placement) = (Some(&input.free), &input.placement);
                let seen = SeenCells { partial: &partial, free, points: &points, placement, support };
                Ok(Answer::of_cells(&baseline.complete(&seen)))
            }
        }
    }
}

/// The object as the camera saw it, without outliers.
fn seen_object(scene: &SegmentedScene, input: &NetworkInput) -> SeenObject {
    let DepthFrame { camera, depth, .. } = &scene.frame;
    SeenObject::new(camera, depth, &input.pixels, &input.outliers)
}

/// Points of an observed object with their normals, as input of baselines.
pub fn seen_points(object: &SeenObject) -> Vec<SeenPoint> {
    let point =
        |(position, normal): ([f64; 3], [f64; 3])| SeenPoint { position: position.into(), normal: normal.into() };
    object.oriented_points().map(point).collect()
}

/// Cells that an obstacle may touch: the network's cells without those that the camera sees through, and all observed cells.
fn possible_cells(occupancy: &CubeField, input: &NetworkInput) -> CubeField {
    let mut possible = occupancy.clone();
    input.free.cells().for_each(|cell| *possible.at_mut(cell.map(|index| index as usize)) = 0.0);
    input.partial.cells().for_each(|cell| *possible.at_mut(cell.map(|index| index as usize)) = 1.0);
    possible
}

/// Cells with a contact, and the number of contacts outside the grid.
fn touched_cells(contacts: &[[f32; 3]], placement: &GridPlacement) -> (OccupancyGrid, usize) {
    let n = placement.resolution;
    let mut grid = OccupancyGrid::new(n);
    let mut outside = 0;
    for contact in contacts {
        let cell = placement.coordinates_of(contact.map(f64::from)).map(f64::floor);
        if cell.iter().all(|index| (0.0..f64::from(n)).contains(index)) {
            grid.set(cell.map(|index| index as u32));
        } else {
            outside += 1;
        }
    }
    (grid, outside)
}
