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

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Images of settled scenes.
    pub const VIEWS: Self = Self::named("views");
}

impl Channel {
    /// [`SceneImage`]: camera, instances and silhouettes; every view has one.
    pub const VIEW_IMAGE: Self = Self::at("/views/image");

    /// [`Depth`](crate::Depth): the depth of the whole image, after the sensor.
    pub const VIEW_DEPTH: Self = Self::at("/views/depth");

    /// [`SceneColour`]: the image in colour.
    pub const VIEW_COLOUR: Self = Self::at("/views/colour");
}

impl Record for SceneImage {
    const CHANNEL: Channel = Channel::VIEW_IMAGE;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for SceneColour {
    const CHANNEL: Channel = Channel::VIEW_COLOUR;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
