//! The sensor model: converts a perfect depth image to the output of a structured-light or stereo camera.
//!
//! `docs/sensors.md` has equations, sources and limitations; [`CONSTANTS`] is the one table of constants.

use std::fmt;

use crate::geom::Intrinsics;

/// One constant of the sensor model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorConstant {
    /// Key in a job file and in [`SensorModel::set`].
    pub key: &'static str,
    /// Unit; `1` for a plain number.
    pub unit: &'static str,
    /// Least allowed value.
    pub min: f64,
    /// Greatest allowed value.
    pub max: f64,
    /// Meaning of the constant.
    pub meaning: &'static str,
}

/// Why a constant cannot be set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidConstant {
    /// The model has no constant of this name.
    #[error("'{key}' is no constant of a depth sensor: one of {}", SensorModel::keys().collect::<Vec<_>>().join(", "))]
    Unknown {
        /// The key as given.
        key: String,
    },
    /// The value does not fit.
    #[error("{key} = {value} {unit}: must lie in {min} to {max}")]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// The value as given.
        value: f64,
        /// Unit of the value.
        unit: &'static str,
        /// Least allowed value.
        min: f64,
        /// Greatest allowed value.
        max: f64,
    },
    /// Only odd whole numbers have a middle pixel.
    #[error("window_px = {0} px: must be an odd whole number")]
    EvenWindow(f64),
}

macro_rules! constants {
    ($($key:ident: $unit:literal, $min:literal ..= $max:literal, kinect $kinect:literal, d435 $d435:literal, $meaning:literal;)*) => {
        /// Constants of a depth sensor that finds depth by matching along a baseline: `kinect-v1`, `d435`, or either
        /// with constants of your own. Applied by [`SensorModel::apply`](crate::render::SensorModel::apply).
        #[derive(Clone, PartialEq)]
        pub struct SensorModel {
            profile: &'static str,
            $(#[doc = $meaning] pub(super) $key: f64,)*
        }

        /// Every constant of [`SensorModel`], in canonical order.
        pub const CONSTANTS: &[SensorConstant] = &[
            $(SensorConstant { key: stringify!($key), unit: $unit, min: $min, max: $max, meaning: $meaning },)*
        ];

        impl SensorModel {
            /// Microsoft Kinect for Xbox 360: a projected speckle pattern matched against its memory.
            fn kinect_v1() -> Self {
                Self { profile: "kinect-v1", $($key: $kinect,)* }
            }

            /// Intel RealSense D435 at 848 x 480: active stereo.
            fn d435() -> Self {
                Self { profile: "d435", $($key: $d435,)* }
            }

            fn field(&mut self, key: &str) -> Option<&mut f64> {
                match key {
                    $(stringify!($key) => Some(&mut self.$key),)*
                    _ => None,
                }
            }

            /// Every constant with its value, in canonical order: for the job's digest and the resolved job.
            pub fn canonical(&self) -> Vec<(&'static str, f64)> {
                vec![$((stringify!($key), self.$key),)*]
            }
        }
    };
}

constants! {
    focal_px: "px", 1.0..=16384.0, kinect 586.3, d435 424.0,
        "Focal length of the device's own matcher; the job's camera may differ";
    baseline_m: "m", -1.0..=1.0, kinect 0.075, d435 0.05,
        "Position of the projector (or second camera) along the image's x; positive: to the right, shadows to the left";
    disparity_sigma_px: "px", 0.0..=10.0, kinect 0.0625, d435 0.08,
        "Standard deviation of the disparity on a surface seen head-on, quantisation included";
    disparity_step_px: "px", 0.0..=10.0, kinect 0.125, d435 0.03125,
        "Quantisation step of the disparity; 0: none";
    window_px: "px", 1.0..=31.0, kinect 9.0, d435 9.0,
        "Side of the square matching window, over which all errors are correlated; odd";
    angle_sigma_m: "m", 0.0..=0.1, kinect 0.0001, d435 0.0001,
        "Growth of the axial noise with the angle of incidence: times (theta / (pi/2 - theta))^2 / sqrt(depth in m)";
    lateral_sigma_px: "px", 0.0..=10.0, kinect 0.8, d435 0.8,
        "Standard deviation of the position of an edge in the image";
    grazing_angle_deg: "deg", 0.0..=180.0, kinect 80.0, d435 80.0,
        "Angle of incidence at which half of the pixels are lost; 180: none are";
    grazing_spread_deg: "deg", 0.0..=90.0, kinect 3.0, d435 3.0,
        "Standard deviation of that angle";
    min_support: "1", 0.0..=1.0, kinect 0.3, d435 0.3,
        "Smallest share of the matching window that must see something; below it the pixel is lost";
    jump_px: "px", 0.01..=1000.0, kinect 1.0, d435 1.0,
        "Step of disparity between neighbouring pixels from which on they are two surfaces";
    edge_dropout: "1", 0.0..=1.0, kinect 0.5, d435 0.2,
        "Share of the pixels next to a jump that are lost";
    edge_mixed: "1", 0.0..=1.0, kinect 0.0, d435 0.3,
        "Share of the pixels next to a jump that get a disparity between both sides (flying pixels)";
    shadow: "1", 0.0..=1.0, kinect 1.0, d435 1.0,
        "1: what the projector (or second camera) does not see is lost; 0: no shadow";
    min_range_m: "m", 0.0..=1000.0, kinect 0.5, d435 0.195,
        "Nearest depth that is returned";
    max_range_m: "m", 0.0..=1000.0, kinect 5.0, d435 10.0,
        "Farthest depth that is returned";
    depth_step_m: "m", 0.0..=1.0, kinect 0.0, d435 0.001,
        "Rounding of the depth that the driver hands out; 0: none";
}

impl SensorModel {
    /// The named profiles.
    pub fn profiles() -> impl Iterator<Item = &'static str> {
        ["kinect-v1", "d435"].into_iter()
    }

    /// A named profile.
    pub fn profile(name: &str) -> Option<Self> {
        match name {
            "kinect-v1" => Some(Self::kinect_v1()),
            "d435" => Some(Self::d435()),
            _ => None,
        }
    }

    /// The profile that this model started from.
    pub fn profile_name(&self) -> &'static str {
        self.profile
    }

    /// The keys of all constants.
    pub fn keys() -> impl Iterator<Item = &'static str> {
        CONSTANTS.iter().map(|constant| constant.key)
    }

    /// Overrides one constant; [`CONSTANTS`] has units and ranges.
    ///
    /// # Errors
    /// When there is no such constant or the value does not fit it; the model is then as before.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), InvalidConstant> {
        let Some(constant) = CONSTANTS.iter().find(|constant| constant.key == key) else {
            return Err(InvalidConstant::Unknown { key: key.to_owned() });
        };
        let SensorConstant { key, unit, min, max, .. } = *constant;
        if !(min..=max).contains(&value) {
            return Err(InvalidConstant::OutOfRange { key, value, unit, min, max });
        }
        if key == "window_px" && value % 2.0 != 1.0 {
            return Err(InvalidConstant::EvenWindow(value));
        }
        if let Some(field) = self.field(key) {
            *field = value;
        }
        Ok(())
    }

    /// Standard deviation of the depth [m] that the constants promise on a plane at `depth` [m] under the angle of
    /// incidence `angle` [rad]: Khoshelham and Elberink 2012, equation 10, plus the angle term of Nguyen et al. 2012.
    pub fn depth_sigma(&self, depth: f64, angle: f64) -> f64 {
        let head_on = depth * depth * self.disparity_sigma_px / (self.focal_px * self.baseline_m.abs());
        head_on + self.angle_sigma(depth, angle)
    }

    /// The angle term of the axial noise [m]. Measured up to 80 degrees; held there beyond.
    pub(super) fn angle_sigma(&self, depth: f64, angle: f64) -> f64 {
        let angle = angle.min(MAX_ANGLE);
        let steep = angle / (std::f64::consts::FRAC_PI_2 - angle);
        self.angle_sigma_m * steep * steep / depth.sqrt()
    }

    /// Distance in the image over which a surface at `nearest` [m] changes the measurement of one at `farthest` [m]: width
    /// of its shadow, of the matching window and of moving edges [px].
    pub fn reach(&self, camera: &Intrinsics, nearest: f64, farthest: f64) -> u32 {
        let shadow = camera.fx * self.baseline_m.abs() * (1.0 / nearest - 1.0 / farthest);
        libm::ceil(shadow.max(0.0) + self.window_px + 3.0 * self.lateral_sigma_px).min(16_384.0) as u32
    }

    /// Nearest and farthest depth that is returned [m].
    pub fn range(&self) -> [f64; 2] {
        [self.min_range_m, self.max_range_m]
    }

    /// Distance between neighbouring depth values [m] at `depth` [m].
    pub fn depth_step(&self, depth: f64) -> f64 {
        depth * depth * self.disparity_step_px / (self.focal_px * self.baseline_m.abs())
    }
}

/// Nguyen et al. measured up to 80 degrees [rad].
pub(super) const MAX_ANGLE: f64 = 80.0 * std::f64::consts::PI / 180.0;

impl fmt::Debug for SensorModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.profile)?;
        f.debug_map().entries(self.canonical()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_lie_inside_their_own_ranges() {
        for name in SensorModel::profiles() {
            let model = SensorModel::profile(name).expect("a listed profile exists");
            let mut copy = model.clone();
            for (key, value) in model.canonical() {
                copy.set(key, value).expect("a profile's own constant fits");
            }
            assert_eq!(copy, model);
            assert_eq!(model.profile_name(), name);
            assert_eq!(model.canonical().len(), CONSTANTS.len());
        }
        assert_eq!(SensorModel::profile("kinect"), None);
    }

    #[test]
    fn wrong_constants_are_refused_and_change_nothing() {
        let mut model = SensorModel::kinect_v1();
        assert!(matches!(model.set("baseline", 0.1), Err(InvalidConstant::Unknown { .. })));
        assert!(matches!(model.set("min_support", 1.5), Err(InvalidConstant::OutOfRange { .. })));
        assert!(matches!(model.set("focal_px", f64::NAN), Err(InvalidConstant::OutOfRange { .. })));
        assert_eq!(model.set("window_px", 4.0), Err(InvalidConstant::EvenWindow(4.0)));
        assert_eq!(model, SensorModel::kinect_v1());
    }

    #[test]
    fn kinect_meets_the_published_figures() {
        // Khoshelham and Elberink 2012: 1.425e-3 m of noise and 2.85e-3 m a step at 1 m, 7 cm a step at 5 m.
        let model = SensorModel::kinect_v1();
        assert!((model.depth_sigma(1.0, 0.0) / 1.425e-3 - 1.0).abs() < 0.005);
        assert!((model.depth_step(1.0) / 2.85e-3 - 1.0).abs() < 0.005);
        assert!((model.depth_step(5.0) - 0.07).abs() < 0.002);
    }

    #[test]
    fn d435_meets_intels_formula() {
        // "Tuning depth cameras for best performance": z^2 subpixel / (focal baseline), 848 px over 90 degrees.
        let model = SensorModel::d435();
        assert!((model.depth_sigma(2.0, 0.0) - 4.0 * 0.08 / (424.0 * 0.05)).abs() < 1e-12);
    }
}
