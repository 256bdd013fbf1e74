//! Colours with fixed meanings: safe for colour-blind readers, with even lightness.

/// An opaque sRGB colour, 8 bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub [u8; 3]);

/// A colour in Oklab (Ottosson 2020, "A perceptual color space for image processing"): lightness 0 to 1, and two
/// opponent axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oklab {
    /// Lightness, 0 black to 1 white.
    pub lightness: f64,
    /// Green to red.
    pub a: f64,
    /// Blue to yellow.
    pub b: f64,
}

impl Colour {
    /// Seen by the camera: blue of Okabe and Ito's colour-blind safe set (2008, "Color Universal Design").
    pub const PARTIAL: Self = Self([0x00, 0x72, 0xb2]);
    /// The whole solid: orange of the same set.
    pub const COMPLETE: Self = Self([0xe6, 0x9f, 0x00]);
    /// Touched: bluish green of the same set.
    pub const TOUCHED: Self = Self([0x00, 0x9e, 0x73]);
    /// Contacts of a feeling hand: sky blue of the same set.
    pub const EXPLORED: Self = Self([0x56, 0xb4, 0xe9]);
    /// Where a hand took hold: vermilion of the same set.
    pub const HELD: Self = Self([0xd5, 0x5e, 0x00]);
    /// Contacts over a hand and an object: black of the same set.
    pub const CONTACT: Self = Self([0x00, 0x00, 0x00]);
    /// A table: light grey, not part of the set.
    pub const TABLE: Self = Self([0xc8, 0xc8, 0xc8]);
    /// Surroundings of an object: middle grey, not part of the set.
    pub const OTHERS: Self = Self([0x8c, 0x8c, 0x90]);
    /// Errors: reddish purple of the same set.
    pub const WRONG: Self = Self([0xcc, 0x79, 0xa7]);

    /// With full alpha.
    pub fn opaque(self) -> [u8; 4] {
        let [r, g, b] = self.0;
        [r, g, b, 255]
    }

    /// Colour in the form `#rrggbb`.
    pub fn hex(self) -> String {
        let [r, g, b] = self.0;
        format!("#{r:02x}{g:02x}{b:02x}")
    }

    /// In Oklab.
    pub fn oklab(self) -> Oklab {
        let [r, g, b] = self.0.map(|channel| linear(f64::from(channel) / 255.0));
        let l = libm::cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
        let m = libm::cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
        let s = libm::cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
        Oklab {
            lightness: 0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            a: 1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
            b: 0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
        }
    }
}

impl Oklab {
    /// From lightness, chroma and hue [rad].
    pub fn from_hue(lightness: f64, chroma: f64, hue: f64) -> Self {
        let (sine, cosine) = libm::sincos(hue);
        Self { lightness, a: chroma * cosine, b: chroma * sine }
    }

    /// Linear sRGB, channels outside 0 to 1 when the colour is out of gamut.
    fn linear_srgb(self) -> [f64; 3] {
        let Self { lightness, a, b } = self;
        let cube = |x: f64| x * x * x;
        let l = cube(lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
        let m = cube(lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
        let s = cube(lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
        [
            4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
            -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
            -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
        ]
    }

    /// Whether an sRGB screen can show it.
    pub fn in_gamut(self) -> bool {
        self.linear_srgb().iter().all(|channel| (-1e-6..=1.0 + 1e-6).contains(channel))
    }

    /// The nearest sRGB colour, channel by channel.
    pub fn srgb(self) -> Colour {
        Colour(self.linear_srgb().map(|channel| (companded(channel.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8))
    }
}

/// IEC 61966-2-1: stored value to linear light.
fn linear(value: f64) -> f64 {
    if value <= 0.040_45 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

/// IEC 61966-2-1: linear light to stored value.
fn companded(value: f64) -> f64 {
    if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * libm::pow(value, 1.0 / 2.4) - 0.055 }
}

/// A colour map for numbers, dark violet over teal to pale yellow: Oklab lightness rises in equal steps, so that equal
/// differences look equal, in colour, in grey and to colour-blind eyes. Chroma is as large as sRGB allows, up to 0.15.
pub fn depth_colours() -> [Colour; 256] {
    std::array::from_fn(|step| {
        let t = step as f64 / 255.0;
        let lightness = 0.25 + 0.67 * t;
        // Degrees on the Oklab hue circle: 300 violet, 200 teal, 105 yellow.
        let hue = (300.0 - 195.0 * t).to_radians();
        let mut chroma = 0.15;
        while !Oklab::from_hue(lightness, chroma, hue).in_gamut() {
            chroma -= 0.002;
        }
        Oklab::from_hue(lightness, chroma, hue).srgb()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ottosson's table of Oklab values for the sRGB primaries (given there to three digits).
    #[test]
    fn oklab_of_the_primaries() {
        for (colour, expected) in [
            ([255, 255, 255], [1.0, 0.0, 0.0]),
            ([255, 0, 0], [0.628, 0.225, 0.126]),
            ([0, 255, 0], [0.866, -0.234, 0.179]),
            ([0, 0, 255], [0.452, -0.032, -0.312]),
        ] {
            let Oklab { lightness, a, b } = Colour(colour).oklab();
            for (found, wanted) in [lightness, a, b].iter().zip(expected) {
                assert!((found - wanted).abs() < 1e-3, "{colour:?}: {found} is not {wanted}");
            }
        }
    }

    #[test]
    fn every_grey_and_corner_comes_back() {
        for colour in (0..=255).map(|v| [v, v, v]).chain([[255, 0, 0], [1, 200, 77], Colour::PARTIAL.0]) {
            assert_eq!(Colour(colour).oklab().srgb(), Colour(colour));
        }
    }

    #[test]
    fn lightness_rises_evenly() {
        let lightness = depth_colours().map(|colour| colour.oklab().lightness);
        for pair in lightness.windows(2) {
            let step = pair[1] - pair[0];
            // Rounding to 8 bits moves a colour by up to about half a step.
            assert!(step > -0.001 && step < 0.007, "{step}");
        }
        assert!((lightness[255] - lightness[0] - 0.67).abs() < 0.01);
        assert!((lightness[128] - (lightness[0] + lightness[255]) / 2.0).abs() < 0.01);
    }
}
