//! Depth image of a view, by our raster, or by MuJoCo's rays or renderer.

use std::sync::Arc;

use super::settings::Renderer;
use crate::ProduceError;
use kernel::geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, TriMesh};
use sim::{Inertia, SimError, SimModel, SimWorker};

/// One thread's source of depth.
pub(super) enum DepthSource {
    /// The z-buffer; it shares the view's vertices with the complete grid, so the worker calls it itself.
    Raster,
    /// MuJoCo; the worker is made with the first object.
    Sim {
        /// `mujoco-ray` or `mujoco-gl`.
        renderer: Renderer,
        /// Renders one object after the other.
        worker: Option<Box<SimWorker>>,
    },
}

/// Models of an object for MuJoCo; nothing when it does not render.
#[derive(Default)]
pub(super) struct SimObject {
    model: Option<Arc<SimModel>>,
}

impl DepthSource {
    /// The source that the job names.
    pub(super) fn new(renderer: Renderer) -> Self {
        match renderer {
            Renderer::Raster => Self::Raster,
            Renderer::MujocoRay | Renderer::MujocoGl => Self::Sim { renderer, worker: None },
        }
    }

    /// Compiles an object's scene where MuJoCo renders.
    pub(super) fn model(&self, mesh: &TriMesh) -> Result<SimObject, ProduceError> {
        match self {
            Self::Raster => Ok(SimObject::default()),
            Self::Sim { renderer, .. } => {
                let model = SimModel::new(mesh, Inertia::Shell).map_err(|error| failed(*renderer, error))?;
                Ok(SimObject { model: Some(Arc::new(model)) })
            }
        }
    }

    /// Depth by MuJoCo; the rasteriser is not used here.
    pub(super) fn render(
        &mut self,
        object: &SimObject,
        camera: &Intrinsics,
        camera_from_object: &Pose<CameraCv, Object>,
        crop: &mut DepthCrop,
    ) -> Result<(), ProduceError> {
        if let (Self::Sim { renderer, worker }, Some(model)) = (self, &object.model) {
            let worker = worker.get_or_insert_with(|| Box::new(SimWorker::new(model)));
            worker.use_model(model);
            let seen = match renderer {
                Renderer::MujocoGl => worker.gl_depth(camera, camera_from_object),
                Renderer::MujocoRay | Renderer::Raster => worker.ray_depth(camera, camera_from_object),
            };
            crop.clone_from(seen.map_err(|error| failed(*renderer, error))?);
        }
        Ok(())
    }
}

fn failed(renderer: Renderer, error: SimError) -> ProduceError {
    ProduceError::NoRenderer { renderer: renderer.name(), cause: error.into() }
}
