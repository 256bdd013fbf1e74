//! Depth images on demand, for modules that do not depend on the renderer.

use std::error::Error;

use crate::{geom::DepthCrop, ids::SampleId};

/// Source of depth images that a dataset does not store.
pub trait DepthSource {
    /// Makes the depth image of a sample again; `None` for a sample of an unknown subject.
    ///
    /// # Errors
    /// When a mesh is gone or a renderer fails.
    fn depth(&mut self, sample: &SampleId) -> Result<Option<DepthCrop>, DepthError>;
}

/// Reason why a source has no depth image.
pub type DepthError = Box<dyn Error + Send + Sync>;
