//! Lights and colours of what MuJoCo draws.

use std::f64::consts::PI;

use nalgebra::{Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Cause, ProduceError};
use form::Checker;
use kernel::seed::Stream;
use sim::{Appearance, Light, gl_facts};

/// The images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RenderSpec {
    /// Colours besides depth, drawn by MuJoCo. Needs EGL (`make deps-gl`); nothing else does.
    pub colour: bool,
    /// With `colour`: lights and the colours of everything in the image are drawn for each sample, by the job's seed.
    pub randomise: bool,
}

/// Settings of colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colours {
    /// Whether lights and colours are drawn for each sample.
    pub randomise: bool,
}

impl RenderSpec {
    /// The settings; `None` without colours. Mistakes are reported.
    pub(super) fn check(&self, checker: &mut Checker) -> Option<Colours> {
        if self.randomise && !self.colour {
            let because = "depth has neither lights nor colours";
            checker.contradiction("render.randomise", "render.colour = false", because);
        }
        self.colour.then_some(Colours { randomise: self.randomise })
    }

    /// The keys of settings.
    pub(super) fn of(colours: Option<Colours>) -> Self {
        Self { colour: colours.is_some(), randomise: colours.is_some_and(|colours| colours.randomise) }
    }
}

/// Whether colours can be drawn here.
///
/// # Errors
/// When OpenGL does not work without a window, with the remedy.
pub fn check_colours() -> Result<(), ProduceError> {
    gl_facts().map(drop).map_err(no_renderer)
}

/// An error of the renderer as one of a producer.
pub(super) fn no_renderer(cause: impl Into<Cause>) -> ProduceError {
    ProduceError::NoRenderer { renderer: "colours cannot be drawn", cause: cause.into() }
}

/// Lights from above, of any brightness, and colours of object and background.
pub(super) fn random_appearance(stream: &mut Stream) -> Appearance {
    let object = random_paint(stream);
    let background = [(); 3].map(|()| stream.uniform(0.0, 255.0) as f32 as u8);
    let (ambient, headlight) = (stream.uniform(0.1, 0.4), stream.uniform(0.05, 0.4));
    let mut light = || {
        // Uniform over the directions that point down.
        let (down, turn) = (stream.uniform(0.05, 1.0), stream.uniform(-PI, PI));
        let (sin, cos) = libm::sincos(turn);
        let level = libm::sqrt(1.0 - down * down);
        let brightness = stream.uniform(0.0, 0.6);
        let colour = [(); 3].map(|()| (brightness * stream.uniform(0.85, 1.0)) as f32);
        Light { direction: Unit::new_normalize(Vector3::new(level * cos, level * sin, -down)), colour }
    };
    let lights = [light(), light()];
    Appearance { object, background, ambient: [ambient as f32; 3], headlight: [headlight as f32; 3], lights }
}

/// Any colour but the darkest and the brightest.
pub(super) fn random_paint(stream: &mut Stream) -> [f32; 3] {
    [(); 3].map(|()| stream.uniform(0.15, 0.95) as f32)
}
