//! Scenes: bodies at rest on their true meshes, in a container.

mod check;
mod container;
mod facts;
mod overview;
mod row;
mod scene;
#[cfg(test)]
mod tests;

pub(super) use check::CHECKS;
pub use container::{ContainerMesh, SceneContainer};
pub use facts::SceneFacts;
pub use overview::SceneOverview;
pub use row::FORMAT;
pub use scene::{CONTAINER, Scene, SceneBody, SceneContact, SceneImport, SceneMode, SceneSupport};

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Bodies at rest on their true meshes, in a container.
    pub const SCENES: Self = Self::named("scenes");
}

impl Channel {
    /// [`Scene`]: bodies, poses, contacts and checks; every sample of scenes has one.
    pub const SCENE: Self = Self::at("/scenes/scene");

    /// [`SceneOverview`]: the scene from above, for people.
    pub const SCENE_OVERVIEW: Self = Self::at("/scenes/overview");
}

impl Record for Scene {
    const CHANNEL: Channel = Channel::SCENE;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for SceneOverview {
    const CHANNEL: Channel = Channel::SCENE_OVERVIEW;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
