//! A job for scenes, checked.

use format::{SceneContainer, SceneMode};
use kernel::{
    ids::{Digest, ObjectId},
    words::Split,
};
use sim::SettleSettings;

use super::import::Import;
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
    /// Arrangements of others, of [`SceneMode::Imported`]: `scenes` are then their count.
    pub import: Option<Import>,
    /// Walls between which the bodies of a pile are dropped.
    pub walls: Option<PileWalls>,
    /// The fewest and the most bodies of a scene.
    pub count: [u32; 2],
    /// Whether a scene may have an object twice.
    pub repeats: bool,
    /// Scenes per split, in the order of [`Split::ALL`].
    pub scenes: [u32; 4],
    /// The lowest and the highest friction of a body.
    pub friction: [f64; 2],
    /// Rules of settling.
    pub settle: SettleSettings,
}

/// Four walls around the middle of a table, which are lifted away from what was dropped between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PileWalls {
    /// Sides of the square between them [m].
    pub side: f64,
    /// Height of the walls [m].
    pub height: f64,
    /// [m/s].
    pub lift_speed: f64,
}

impl PileWalls {
    /// The room inside along x, y and z [m].
    pub fn inner(&self) -> [f64; 3] {
        [self.side, self.side, self.height]
    }
}

impl SceneSettings {
    /// Sides of the floor that bodies come to [m].
    pub fn floor(&self) -> [f64; 2] {
        self.walls.map_or_else(|| self.container.floor(), |walls| [walls.side; 2])
    }

    /// The settings with arrangements of others: as many scenes of their split.
    #[must_use]
    pub fn with_import(self, import: Import) -> Self {
        let count = import.scenes.len() as u32;
        let scenes = Split::ALL.map(|split| if split == import.split { count } else { 0 });
        Self { scenes, import: Some(import), ..self }
    }

    /// The splits that have scenes, with their counts, in the order of the plan.
    pub fn splits(&self) -> impl Iterator<Item = (Split, u32)> + '_ {
        Split::ALL.into_iter().zip(self.scenes).filter(|(_, count)| *count > 0)
    }

    /// Subject of the scenes of a split: a digest of container, walls, mode and split.
    pub fn subject(&self, split: Split) -> ObjectId {
        let walls = self.walls.map(|walls| walls.inner());
        let sizes = self.container.sizes().into_iter().chain(walls.into_iter().flatten());
        let sizes: Vec<u8> = sizes.flat_map(f64::to_le_bytes).collect();
        let words = [self.mode.name(), self.container.name(), split.name()];
        ObjectId(Digest::of_parts(
            std::iter::once(b"scenes 1".as_slice())
                .chain(words.iter().map(|word| word.as_bytes()))
                .chain([sizes.as_slice()]),
        ))
    }
}
