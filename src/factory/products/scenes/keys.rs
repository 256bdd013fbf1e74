//! A resolved job for scenes as keys of a job file.

use super::{
    check::DROP_KEYS,
    settings::{SceneJob, SceneSettings},
    spec::{
        ContainerSpec, CountRangeSpec, CountSpec, FrictionSpec, ModeSpec, ScenePhysicsSpec, ScenesPerSplitSpec,
        ScenesSpec, TableSpec,
    },
};
use crate::job::{keys_of, without};
use format::{SceneContainer, SceneMode};
use sim::SettleSettings;

impl SceneJob {
    /// Keys of the job file beside objects, split and shards, without those that the other keys make idle.
    pub(super) fn keys(&self) -> toml::Table {
        let SceneSettings { mode, container, count: [min, max], scenes, friction, settle } = &self.settings;
        let mut spec = ScenesSpec::standard();
        let mut idle = vec!["objects", "split", "shards"];
        spec.mode = match mode {
            SceneMode::Table => ModeSpec::Table,
            SceneMode::Heap => ModeSpec::Heap,
            SceneMode::Bin => ModeSpec::Bin,
        };
        if *mode == SceneMode::Table {
            idle.extend(DROP_KEYS);
        }
        match *container {
            SceneContainer::Plane { size } => {
                spec.table = TableSpec { size };
                idle.push("container");
            }
            SceneContainer::Bin { inner, wall } => {
                spec.container = ContainerSpec { inner, wall };
                idle.push("table");
            }
        }
        spec.count = match min == max {
            true => CountSpec::Exactly(*min),
            false => CountSpec::Between(CountRangeSpec { min: *min, max: *max }),
        };
        let [training, holdout, validation, test] = *scenes;
        spec.scenes = ScenesPerSplitSpec { training, holdout, validation, test };
        let friction = match friction[0] == friction[1] {
            true => FrictionSpec::Exactly(friction[0]),
            false => FrictionSpec::Between(*friction),
        };
        let SettleSettings { timestep, rolling, release_every, release_height, rest_speed, rest_time, cap, recheck } =
            *settle;
        spec.physics = ScenePhysicsSpec {
            friction,
            rolling,
            timestep,
            release_every,
            release_height,
            rest_speed,
            rest_time,
            cap,
            recheck,
        };
        without(keys_of(&spec), &idle)
    }
}
