//! Images of a scene that a thread has read.

use std::{collections::BTreeMap, sync::Arc};

use crate::ProduceError;
use format::{Depth, SceneImage, dataset::DatasetReader};
use kernel::{geom::DepthCrop, ids::SampleId};

/// Images that are kept, at most: 1.2 MB each of 640 x 480 pixels.
const KEPT: usize = 32;

/// An image as it is fused.
pub(super) struct DepthImage {
    /// Camera, pose and bodies; without its map of instances.
    pub record: SceneImage,
    /// Depth as it is stored [m].
    pub depth: DepthCrop,
}

/// Images of one scene, by their view.
#[derive(Default)]
pub(super) struct SceneImages(BTreeMap<SampleId, Arc<DepthImage>>);

impl SceneImages {
    /// Forgets all images.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// The image of a view.
    ///
    /// # Errors
    /// When the view cannot be read.
    pub fn get(&mut self, views: &DatasetReader, view: &SampleId) -> Result<Arc<DepthImage>, ProduceError> {
        if let Some(image) = self.0.get(view) {
            return Ok(Arc::clone(image));
        }
        let name = || format!("view {} of scene {}", view.item, view.subject.0.short());
        let missing = |what| ProduceError::unusable(name(), format!("{what}; `verify` the dataset of views"));
        let sample = views.sample_of(view)?.ok_or_else(|| missing("it is not stored"))?;
        let mut record = sample.read::<SceneImage>()?;
        let depth = sample.find::<Depth>()?.ok_or_else(|| missing("it has no depth"))?.crop;
        (record.instances, record.point_instances) = (Vec::new(), None);
        if self.0.len() >= KEPT {
            self.0.pop_first();
        }
        let image = Arc::new(DepthImage { record, depth });
        self.0.insert(*view, Arc::clone(&image));
        Ok(image)
    }
}
