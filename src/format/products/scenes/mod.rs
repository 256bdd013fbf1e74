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

use crate::{
    Channel, Product,
    dataset::{DatasetError, Sample},
};

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

impl Sample {
    /// Bodies, poses, contacts and checks of a scene.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn scene(&self) -> Result<Scene, DatasetError> {
        self.leading(Channel::SCENE, Scene::decode)
    }

    /// The scene from above; `None` in a dataset without.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn scene_overview(&self) -> Result<Option<SceneOverview>, DatasetError> {
        self.decoded(Channel::SCENE_OVERVIEW, SceneOverview::decode)
    }
}
