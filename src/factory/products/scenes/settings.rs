//! A job for scenes, checked.

use format::{SceneContainer, SceneMode};
use kernel::{
    ids::{Digest, ObjectId},
    words::Split,
};
use sim::SettleSettings;

use crate::job::JobObjects;

/// Objects and settings of a job for scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneJob {
    /// The objects and their split.
    pub objects: JobObjects,
    /// Everything else.
    pub settings: SceneSettings,
}

/// Settings of scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSettings {
    /// Way in which bodies come to a scene.
    pub mode: SceneMode,
    /// Container.
    pub container: SceneContainer,
    /// The fewest and the most bodies of a scene.
    pub count: [u32; 2],
    /// Scenes per split, in the order of [`Split::ALL`].
    pub scenes: [u32; 4],
    /// The lowest and the highest friction of a body.
    pub friction: [f64; 2],
    /// Rules of settling.
    pub settle: SettleSettings,
}

impl SceneSettings {
    /// The splits that have scenes, with their counts, in the order of the plan.
    pub fn splits(&self) -> impl Iterator<Item = (Split, u32)> + '_ {
        Split::ALL.into_iter().zip(self.scenes).filter(|(_, count)| *count > 0)
    }

    /// Subject of the scenes of a split: a digest of container, mode and split.
    pub fn subject(&self, split: Split) -> ObjectId {
        let sizes: Vec<u8> = self.container.sizes().iter().flat_map(|size| size.to_le_bytes()).collect();
        let words = [self.mode.name(), self.container.name(), split.name()];
        ObjectId(Digest::of_parts(
            std::iter::once(b"scenes 1".as_slice())
                .chain(words.iter().map(|word| word.as_bytes()))
                .chain([sizes.as_slice()]),
        ))
    }
}
