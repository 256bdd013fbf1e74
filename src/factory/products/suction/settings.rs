//! A job for suction, checked, with everything that it takes from the dataset of scenes but meshes.

use std::path::PathBuf;

use crate::{products::settled::FoundScenes, sections::JobObjects};
use robot::suction::{PoseErrors, SuctionCup, SuctionSampling};

/// Scenes, cup and settings of a job for suction.
#[derive(Clone, Debug, PartialEq)]
pub struct SuctionJob {
    /// The folder of the dataset of scenes.
    pub scenes_folder: PathBuf,
    /// Scenes of that dataset.
    pub scenes: FoundScenes,
    /// Objects of the scenes, by their own job.
    pub objects: JobObjects,
    /// The cup.
    pub cup: SuctionCup,
    /// Everything else.
    pub settings: SuctionSettings,
}

/// Settings of suction; angles are as the job states them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuctionSettings {
    /// Poses of a body, at most.
    pub poses: u32,
    /// Free poses at which drawing ends.
    pub free: u32,
    /// Largest angle between the approach and straight down [degree].
    pub half_angle_deg: f64,
    /// Largest angle between the approach and the inward normal [degree].
    pub tilt_deg: f64,
    /// Factor on the weight.
    pub safety: f64,
    /// Whether the cup must hold the body in every direction of gravity.
    pub any_direction: bool,
    /// Distance that cup and tube keep from everything but the body [m].
    pub margin: f64,
    /// Poses with errors of each free pose; 0 for no robustness.
    pub error_poses: u32,
    /// Largest error across the axis [m].
    pub error_distance: f64,
    /// Largest error of the axis [degree].
    pub error_angle_deg: f64,
}

impl SuctionSettings {
    /// Settings of the sampler.
    pub fn sampling(&self) -> SuctionSampling {
        SuctionSampling {
            poses: self.poses,
            free: self.free,
            half_angle: self.half_angle_deg.to_radians(),
            tilt: self.tilt_deg.to_radians(),
            safety: self.safety,
            any_direction: self.any_direction,
        }
    }

    /// Errors of poses; `None` without robustness.
    pub fn errors(&self) -> Option<PoseErrors> {
        let (distance, angle) = (self.error_distance, self.error_angle_deg.to_radians());
        (self.error_poses > 0).then_some(PoseErrors { poses: self.error_poses, distance, angle })
    }
}
