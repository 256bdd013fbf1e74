//! The chain from a cluster of pixels to a closed mesh.

use std::time::{Duration, Instant};

use infer::{CompletionModel, Inputs, Prediction};
use kernel::geom::{GridPlacement, OccupancyGrid, SimdLevel, TriMesh};
use perception::{Cluster, DepthFrame, NetworkInput, Refusal, Scene, SceneRule, visible_sheet};
use surface::{CompletedMesh, CubeField};

use super::error::CompletionError;

/// Fewest cells with a seen point: those of a square of five.
const MIN_CELLS: u32 = 25;

/// Ways to make a target's mesh of the network's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// The surface where coverage has it.
    #[default]
    Surface,
    /// The thesis's algorithm 2: observed points merged with occupied cells, and the smoothest field of their sign.
    Algorithm2,
}

/// Time by part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timings {
    /// Grids of the input.
    pub input: Duration,
    /// The network.
    pub network: Duration,
    /// From grids to a mesh.
    pub mesh: Duration,
}

impl Timings {
    /// All parts together.
    pub fn total(&self) -> Duration {
        self.input + self.network + self.mesh
    }
}

/// An object with the part that no camera saw.
#[derive(Clone, Debug, PartialEq)]
pub struct Completed {
    /// Where the grids lie.
    pub placement: GridPlacement,
    /// Cells that hold a seen point.
    pub partial: OccupancyGrid,
    /// Cells that the camera sees through, and those below the plane.
    pub free: OccupancyGrid,
    /// The network's answer.
    pub prediction: Prediction,
    /// A closed, manifold mesh in `CameraCv` [m], wound outward.
    pub mesh: TriMesh,
    /// Pieces under 1 % of the volume that were dropped.
    pub dropped: usize,
    /// Pixels left out as outliers.
    pub outliers: usize,
    /// Voxels per cell along each axis, of [`Detail::Algorithm2`] alone.
    pub factor: Option<usize>,
    /// Time by part.
    pub timings: Timings,
}

/// A model with everything around it. It can be shared by threads; each call runs on its caller's.
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
/// let completer = Completer::new(CompletionModel::open("models/standard".as_ref())?, Detail::Surface);
/// let scene = completer.segment(frame, &SceneRule::default());
/// for cluster in &scene.clusters {
///     let completed = completer.complete(&scene, cluster)?;
///     println!("{} triangles in {:?}", completed.mesh.triangles.len(), completed.timings.total());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Completer {
    model: CompletionModel,
    detail: Detail,
}

impl Completer {
    /// Completes by this model.
    pub fn new(model: CompletionModel, detail: Detail) -> Self {
        Self { model, detail }
    }

    /// The model.
    pub fn model(&self) -> &CompletionModel {
        &self.model
    }

    /// Takes a picture apart.
    ///
    /// # Panics
    /// If the clusters' tolerance is not positive.
    pub fn segment(&self, frame: DepthFrame, rule: &SceneRule) -> Scene {
        Scene::segment(frame, rule)
    }

    /// Completes an object that is to be grasped.
    ///
    /// # Errors
    /// When the picture's border cuts it, too little of it was seen, or the network's answer can't be used.
    pub fn complete(&self, scene: &Scene, cluster: &Cluster) -> Result<Completed, CompletionError> {
        self.by(scene, cluster, Some(self.detail))
    }

    /// Completes an object that is only to be avoided: the fast mesh of all cells that it may touch, some .7 cell outside of
    /// it.
    ///
    /// # Errors
    /// Like those of [`Completer::complete`].
    pub fn complete_obstacle(&self, scene: &Scene, cluster: &Cluster) -> Result<Completed, CompletionError> {
        self.by(scene, cluster, None)
    }

    fn by(&self, scene: &Scene, cluster: &Cluster, detail: Option<Detail>) -> Result<Completed, CompletionError> {
        let began = Instant::now();
        if let Some(refusal) = Refusal::of(cluster, &visible_sheet(&scene.frame, &cluster.pixels)) {
            return Err(refusal.into());
        }
        let resolution = self.model.facts().resolution;
        let input = NetworkInput::new(&scene.frame, cluster, scene.plane.as_ref(), resolution, SimdLevel::detect())?;
        let cells = input.partial.count();
        if cells < MIN_CELLS {
            return Err(CompletionError::FewCells { cells, needed: MIN_CELLS });
        }
        let (partial, free) = (CubeField::from_grid(&input.partial), CubeField::from_grid(&input.free));
        let after_input = Instant::now();
        let prediction = self.model.predict(&Inputs { partial: Some(&partial), free: Some(&free), touch: None })?;
        let after_network = Instant::now();
        let thresholds = self.model.facts().thresholds;
        let threshold = thresholds.occupancy;
        let (completed, factor) = match detail {
            None => (CompletedMesh::obstacle(&prediction.occupancy, &input.placement, threshold), None),
            Some(Detail::Surface) => (
                CompletedMesh::surface_at(
                    &prediction.coverage,
                    &prediction.occupancy,
                    &input.placement,
                    thresholds.coverage,
                ),
                None,
            ),
            Some(Detail::Algorithm2) => {
                let cells = prediction.occupancy.grid_above(threshold);
                let points = points_of(&scene.frame, cluster);
                let detailed = CompletedMesh::algorithm_2(&cells, &points, &input.placement);
                (detailed.completed, Some(detailed.factor))
            }
        };
        if completed.mesh.triangles.is_empty() {
            return Err(CompletionError::Nothing);
        }
        let timings =
            Timings { input: after_input - began, network: after_network - after_input, mesh: after_network.elapsed() };
        Ok(Completed {
            placement: input.placement,
            partial: input.partial,
            free: input.free,
            prediction,
            mesh: completed.mesh,
            dropped: completed.dropped,
            outliers: input.outliers,
            factor,
            timings,
        })
    }
}

/// Points of a cluster in `CameraCv` [m], outliers left out.
fn points_of(frame: &DepthFrame, cluster: &Cluster) -> Vec<[f32; 3]> {
    let pixels = perception::without_outliers(frame, &cluster.pixels);
    pixels.iter().map(|pixel| frame.point(*pixel).coords.map(|value| value as f32).into()).collect()
}
