//! A resolved job for scenes as keys of a job file.

use std::path::Path;

use super::{
    check::idle_keys,
    import::{
        Import, ImportedBody, ImportedScene, SourceFrame,
        spec::{ImportSpec, ImportedBodySpec, ImportedSceneSpec},
    },
    settings::{PileWalls, Region, SceneJob, SceneSettings},
    spec::{
        CountRangeSpec, CountSpec, FrictionSpec, ModeSpec, PileSpec, RectangleSpec, RegionSpec, RingSpec,
        ScenePhysicsSpec, ScenesPerSplitSpec, ScenesSpec, TableSpec,
    },
    vessel::VesselFile,
};
use crate::sections::{keys_of, relative_to, with_slashes, without};
use format::{SceneContainer, SceneMode};
use sim::SettleSettings;

impl SceneJob {
    /// Keys of the job file other than objects, split and shards, without those that the other keys make idle. `name`
    /// returns the job's name of an object. With a folder the container's file is named relative to it, otherwise by
    /// content alone.
    pub(super) fn keys(&self, name: impl Fn(&str) -> String, folder: Option<&Path>) -> toml::Table {
        let SceneSettings {
            mode,
            container,
            vessel,
            import,
            walls,
            region,
            count: [min, max],
            repeats,
            scenes,
            friction,
            settle,
        } = &self.settings;
        let mut spec = ScenesSpec::standard();
        let idle = idle_keys(*mode, self.settings.is_contained()).into_iter().map(|(key, _)| key);
        // Without repeats the keys are those of jobs that do not have `repeats`.
        let idle = idle.chain((!repeats).then_some("repeats"));
        let of_box = ["container.inner_size", "container.wall"].into_iter().filter(|_| vessel.is_some());
        let idle: Vec<&str> = ["objects", "split", "shards"].into_iter().chain(idle).chain(of_box).collect();
        spec.mode = match mode {
            SceneMode::Table => ModeSpec::Table,
            SceneMode::Heap => ModeSpec::Heap,
            SceneMode::Bin => ModeSpec::Bin,
            SceneMode::Packed => ModeSpec::Packed,
            SceneMode::Pile => ModeSpec::Pile,
            SceneMode::Imported => spec.mode,
        };
        spec.import = import.as_ref().map(|import| import_spec(import, name));
        container_keys(&mut spec, container, folder.zip(vessel.as_ref()));
        if let Some(PileWalls { side, height, lift_speed }) = *walls {
            spec.pile = PileSpec { side, height, lift_speed };
        }
        spec.region = region.map(|region| match region {
            Region::Rectangle([x, y]) => RegionSpec::Rectangle(RectangleSpec { x, y }),
            Region::Ring { around, radius } => RegionSpec::Ring(RingSpec { around, radius }),
        });
        spec.count = match min == max {
            true => CountSpec::Exactly(*min),
            false => CountSpec::Between(CountRangeSpec { min: *min, max: *max }),
        };
        spec.repeats = *repeats;
        let [training, holdout, validation, test] = *scenes;
        spec.scenes = ScenesPerSplitSpec { training, holdout, validation, test };
        let friction = match friction[0] == friction[1] {
            true => FrictionSpec::Exactly(friction[0]),
            false => FrictionSpec::Between(*friction),
        };
        let SettleSettings {
            timestep,
            rolling,
            release_every,
            release_height,
            rest_speed,
            rest_time,
            cap,
            recheck,
            finer,
            put_back,
        } = *settle;
        spec.physics = ScenePhysicsSpec {
            friction,
            rolling,
            timestep,
            release_interval: release_every,
            release_height,
            rest_speed,
            rest_time,
            settle_timeout: cap,
            stability_time: recheck,
            substeps: finer,
            max_redrops: put_back,
        };
        without(keys_of(&spec), &idle)
    }
}

/// Writes the container into the keys: a mesh by its file, relative to a folder, and its content, or by content alone.
fn container_keys(spec: &mut ScenesSpec, container: &SceneContainer, file: Option<(&Path, &VesselFile)>) {
    spec.container.tilt_deg = container.tilt_deg();
    match container {
        SceneContainer::Plane { size } => spec.table = TableSpec { size: *size },
        SceneContainer::Bin { inner, wall, .. } => (spec.container.inner_size, spec.container.wall) = (*inner, *wall),
        SceneContainer::Mesh { shape, .. } => {
            spec.container.mesh = file.map(|(folder, file)| with_slashes(&relative_to(&file.path, folder)).into());
            spec.container.unit = file.and_then(|(_, file)| file.unit);
            spec.container.content = Some(shape.digest().hex());
        }
    }
}

/// The list of arrangements, from any kind of file.
fn import_spec(import: &Import, name: impl Fn(&str) -> String) -> ImportSpec {
    let Import { scenes, split, frame } = import;
    let body = |ImportedBody { object, pose }: &ImportedBody| ImportedBodySpec { object: name(object), pose: *pose };
    let scene = |ImportedScene { source, bodies }: &ImportedScene| ImportedSceneSpec {
        source: source.clone(),
        bodies: bodies.iter().map(body).collect(),
    };
    let spec = ImportSpec {
        scenes: Some(scenes.iter().map(scene).collect()),
        split: Some((*split).into()),
        ..ImportSpec::default()
    };
    match *frame {
        SourceFrame::Table { up, height } => ImportSpec { up: Some(up), table_height: height, ..spec },
        SourceFrame::Container { pose } => ImportSpec { container_pose: Some(pose), ..spec },
    }
}
