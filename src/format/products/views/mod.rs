//! Views: images of settled scenes, with exact silhouettes.

mod check;
mod colour;
mod facts;
mod image;
mod row;
#[cfg(test)]
mod tests;

pub(super) use check::CHECKS;
pub use colour::SceneColour;
pub use facts::ViewFacts;
pub use image::{NearBody, SceneImage, SceneInstance};
pub use row::FORMAT;

use crate::{
    Channel, Depth, Product,
    dataset::{DatasetError, Sample},
};

impl Product {
    /// Images of settled scenes.
    pub const VIEWS: Self = Self::named("views");
}

impl Channel {
    /// [`SceneImage`]: camera, instances and silhouettes; every view has one.
    pub const VIEW_IMAGE: Self = Self::at("/views/image");

    /// [`Depth`]: the depth of the whole image, after the sensor.
    pub const VIEW_DEPTH: Self = Self::at("/views/depth");

    /// [`SceneColour`]: the image in colour.
    pub const VIEW_COLOUR: Self = Self::at("/views/colour");
}

impl Sample {
    /// Camera, instances and silhouettes of a view.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn scene_image(&self) -> Result<SceneImage, DatasetError> {
        self.leading(Channel::VIEW_IMAGE, SceneImage::decode)
    }

    /// Depth of a view; `None` in a dataset without.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn view_depth(&self) -> Result<Option<Depth>, DatasetError> {
        self.decoded(Channel::VIEW_DEPTH, Depth::decode)
    }

    /// Colours of a view; `None` in a dataset without.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn view_colour(&self) -> Result<Option<SceneColour>, DatasetError> {
        self.decoded(Channel::VIEW_COLOUR, SceneColour::decode)
    }
}
