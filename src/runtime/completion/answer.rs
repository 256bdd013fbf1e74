//! Result of a model or a baseline for an object, and the meshes made from it.

use std::borrow::Borrow;

use infer::{CompletionModel, Prediction, Thresholds};
use kernel::geom::{GridPlacement, OccupancyGrid};
use surface::{CompletedMesh, CubeField, DetailedMesh, OBSTACLE_THRESHOLD, SeenObject};

/// Meshing methods for targets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detail {
    /// Fast mesh of all cells that the object may touch, as for obstacles.
    Fast,
    /// Surface of the coverage.
    Surface,
    /// Algorithm 2 of the thesis: observed points merged with occupied cells, and the smoothest field of their sign.
    Algorithm2,
    /// Coverage joined with the surface that the camera observed, and the smoothest field that fits both.
    #[default]
    Joined,
}

/// Fields of one object, and the thresholds of its surface in them.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The fields.
    pub prediction: Prediction,
    /// Thresholds of the surface.
    pub thresholds: Thresholds,
}

impl Answer {
    /// Wraps a model's prediction.
    pub fn of_model(model: &CompletionModel, prediction: Prediction) -> Self {
        Self { prediction, thresholds: model.facts().thresholds }
    }

    /// Wraps occupied cells without further fields.
    pub fn of_cells(cells: &OccupancyGrid) -> Self {
        Self {
            prediction: Prediction { occupancy: CubeField::from_grid(cells), coverage: None },
            thresholds: Thresholds { occupancy: OBSTACLE_THRESHOLD, coverage: OBSTACLE_THRESHOLD },
        }
    }

    /// The occupied cells.
    pub fn cells(&self) -> OccupancyGrid {
        self.prediction.occupancy.grid_above(self.thresholds.occupancy)
    }

    /// Fast mesh of an occupancy field.
    pub(super) fn obstacle(&self, occupancy: &CubeField, placement: &GridPlacement) -> CompletedMesh {
        CompletedMesh::obstacle(occupancy, placement, self.thresholds.occupancy)
    }

    /// Mesh of a target, and voxels per cell along each axis if they are finer than cells. `seen`, which returns the object as
    /// the camera saw it, is called only if the method needs it. Contacts are points of the surface, in `CameraCv` [m]. Without
    /// coverage, the surface is that of the occupied cells.
    ///
    /// # Errors
    /// Errors of `seen`.
    ///
    /// # Panics
    /// If the fields' sides are not the placement's resolution.
    pub fn mesh<S: Borrow<SeenObject>, E>(
        &self,
        detail: Detail,
        placement: &GridPlacement,
        contacts: &[[f32; 3]],
        seen: impl FnOnce() -> Result<S, E>,
    ) -> Result<(CompletedMesh, Option<usize>), E> {
        let Prediction { occupancy, coverage } = &self.prediction;
        let (share, level) = match coverage {
            Some(coverage) => (coverage, self.thresholds.coverage),
            None => (occupancy, self.thresholds.occupancy),
        };
        let DetailedMesh { completed, factor, .. } = match detail {
            Detail::Surface if coverage.is_some() => {
                return Ok((CompletedMesh::surface_at(share, occupancy, placement, level), None));
            }
            Detail::Fast | Detail::Surface => return Ok((self.obstacle(occupancy, placement), None)),
            Detail::Algorithm2 => {
                let points = [seen()?.borrow().points(), contacts].concat();
                CompletedMesh::merge_observed(&self.cells(), &points, placement)
            }
            Detail::Joined => CompletedMesh::joined(share, occupancy, placement, level, seen()?.borrow()),
        };
        Ok((completed, Some(factor)))
    }
}
