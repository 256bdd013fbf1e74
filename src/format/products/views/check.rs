//! Checks of views.

use super::{SceneColour, SceneImage};
use crate::{
    Channel, CheckSample, CheckedRecord, Depth, Facts, Product, ProductChecks, RecordError, codec::fields::ranged,
};

/// The checks of views.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::VIEWS, samples: || Box::new(ViewCheck::default()) };

/// Checks of one thread; remembers the image that it saw last.
#[derive(Default)]
struct ViewCheck {
    seen: Option<SceneImage>,
}

impl CheckSample for ViewCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        if channel == Channel::VIEW_DEPTH {
            return self.check_depth(payload);
        }
        if channel == Channel::VIEW_COLOUR {
            return self.check_colour(payload);
        }
        let image = SceneImage::decode(payload)?;
        let mut checked = CheckedRecord::without_facts(image.sample);
        checked.facts = Facts::from(image.facts()).values().iter().copied().enumerate().collect();
        self.seen = Some(image);
        Ok(checked)
    }
}

impl ViewCheck {
    /// Depth has a return only where the image sees something.
    fn check_depth(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        const MESSAGE: &str = "Depth";
        let depth = Depth::decode(payload)?;
        if let Some(image) = self.seen.as_ref().filter(|image| image.sample == depth.sample) {
            let [right, bottom] = [depth.crop.left + depth.crop.width, depth.crop.top + depth.crop.height];
            let fits = right <= image.camera.width && bottom <= image.camera.height;
            ranged(MESSAGE, "width", f64::from(right), fits, "inside the image")?;
            let seen = image.point_instances.as_ref().unwrap_or(&image.instances);
            for (index, value) in (0..).zip(&depth.crop.depth).filter(|(_, value)| !value.is_nan()) {
                let [column, row] = [index % depth.crop.width, index / depth.crop.width];
                let pixel = ((depth.crop.top + row) * image.camera.width + depth.crop.left + column) as usize;
                ranged(MESSAGE, "data", f64::from(*value), seen[pixel] != 0, "no return where nothing is seen")?;
            }
        }
        Ok(CheckedRecord::without_facts(depth.sample))
    }

    /// Colours are of the size of the camera's image.
    fn check_colour(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let colour = SceneColour::decode(payload)?;
        if let Some(SceneImage { camera, .. }) = self.seen.as_ref().filter(|image| image.sample == colour.sample) {
            for (field, found, wanted) in
                [("width", colour.width, camera.width), ("height", colour.height, camera.height)]
            {
                ranged("SceneColour", field, f64::from(found), found == wanted, "that of the camera's image")?;
            }
        }
        Ok(CheckedRecord::without_facts(colour.sample))
    }
}
