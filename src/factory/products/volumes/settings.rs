//! A job for volumes, checked, with everything that it takes from the dataset of views but images and meshes.

use std::path::PathBuf;

use nalgebra::{Rotation3, Vector3};

use crate::{
    products::{picked::FoundPicks, viewed::FoundViews},
    sections::JobHand,
};
use format::SceneContainer;
use kernel::{
    geom::{Pose, Volume, World},
    voxel::VolumeGrid,
};

/// Views and settings of a job for volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeJob {
    /// The folder of the dataset of views.
    pub dataset: PathBuf,
    /// Views of that dataset.
    pub views: FoundViews,
    /// Settings of the volumes.
    pub settings: VolumeSettings,
    /// Grasps that go with each volume; `None` without.
    pub grasps: Option<VolumeGrasps>,
}

/// Grasps that go with volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct VolumeGrasps {
    /// The folder of the dataset of picks.
    pub dataset: PathBuf,
    /// Picks of that dataset.
    pub picks: FoundPicks,
    /// The hand.
    pub hand: JobHand,
}

/// Settings of volumes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeSettings {
    /// The cube.
    pub grid: VolumeGrid,
    /// Distances are cut at this [voxels].
    pub truncation_voxels: f64,
    /// Height of what carries the bodies above the lower side of the cube [m].
    pub support_height: f64,
    /// Fewest and most images that are fused.
    pub views: [u32; 2],
    /// Fusions of each scene.
    pub per_scene: u32,
}

impl VolumeSettings {
    /// Pose of the cube in every scene: upright, centred over the world's origin.
    pub fn world_from_volume(&self) -> Pose<World, Volume> {
        let half = self.grid.size / 2.0;
        Pose::new(Rotation3::identity(), Vector3::new(-half, -half, -self.support_height))
    }

    /// Key and numbers of a cube that the room in a container does not fit into; `None` where it fits. A plane has no sides.
    pub fn too_small_for(&self, container: &SceneContainer) -> Option<(&'static str, String)> {
        let ([x, y, z], room) = (container.inner()?, container.room()?);
        let Self { grid: VolumeGrid { size, .. }, support_height, .. } = *self;
        let wide = 2.0 * [0, 1].map(|axis| room.max[axis].max(-room.min[axis])).into_iter().fold(0.0, f64::max);
        let (high, deep) = (room.max.z, -room.min.z);
        if deep > support_height {
            let what = format!(
                "the tilted bin reaches {deep:.3} m below the middle of its floor, the cube {support_height} m"
            );
            return Some(("fusion.support_height", format!("{what}; at least {deep:.3} m are needed")));
        }
        (wide > size || high > size - support_height).then(|| {
            let needed = wide.max(high + support_height);
            let what = format!(
                "the bin is {x} x {y} x {z} m inside, the cube {size} m with {support_height} m of it below the floor"
            );
            ("fusion.size", format!("{what}; at least {needed:.3} m are needed"))
        })
    }
}
