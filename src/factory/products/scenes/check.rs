//! From the keys of a job for scenes to settings that make sense: every mistake that the schema cannot see.

use std::{path::Path, sync::Arc};

use super::{
    settings::{PileWalls, Region, SceneSettings},
    spec::{
        ContainerSpec, CountRangeSpec, CountSpec, FrictionSpec, ModeSpec, PileSpec, RectangleSpec, RegionSpec,
        RingSpec, ScenePhysicsSpec, ScenesSpec,
    },
    vessel::{self, VesselFile},
};
use form::Checker;
use format::{SceneContainer, SceneMode};
use sim::SettleSettings;

/// The settings; mistakes are reported.
pub(super) fn settings(checker: &mut Checker, spec: &ScenesSpec, folder: &Path) -> SceneSettings {
    let mode = match spec.mode {
        _ if spec.import.is_some() => SceneMode::Imported,
        ModeSpec::Table => SceneMode::Table,
        ModeSpec::Heap => SceneMode::Heap,
        ModeSpec::Bin => SceneMode::Bin,
        ModeSpec::Packed => SceneMode::Packed,
        ModeSpec::Pile => SceneMode::Pile,
    };
    let is_contained = mode == SceneMode::Bin || mode == SceneMode::Imported && checker.has("container");
    check_idle(checker, mode, is_contained);
    let (container, vessel) = container(checker, spec, is_contained, folder);
    let walls = (mode == SceneMode::Pile).then(|| walls(checker, &spec.pile, spec.table.size));
    let region = spec.region.and_then(|region_spec| region(checker, region_spec, spec.table.size));
    let count = match spec.count {
        CountSpec::Exactly(count) => [count; 2],
        CountSpec::Between(CountRangeSpec { min, max }) => {
            if min > max {
                checker.invalid("count.min", "at most `count.max`", format!("{min} above {max}"));
            }
            [min, max]
        }
    };
    let scenes = [spec.scenes.training, spec.scenes.holdout, spec.scenes.validation, spec.scenes.test];
    if scenes.iter().all(|count| *count == 0) && mode != SceneMode::Imported {
        let report = checker.invalid("scenes", "at least one scene", "none in any split");
        report.help("set their number, for example scenes = { training = 100 }");
    }
    SceneSettings {
        mode,
        container,
        vessel,
        import: None,
        walls,
        region,
        count,
        repeats: spec.repeats,
        scenes,
        friction: friction(checker, &spec.physics),
        settle: settle(checker, &spec.physics),
    }
}

/// Keys that an import makes idle.
const IMPORTED_IDLE: [&str; 13] = [
    "mode",
    "count",
    "repeats",
    "scenes",
    "pile",
    "region",
    "physics.release_interval",
    "physics.release_height",
    "physics.rest_speed",
    "physics.rest_time",
    "physics.settle_timeout",
    "physics.substeps",
    "physics.max_redrops",
];

/// Reports keys that the mode makes idle.
fn check_idle(checker: &mut Checker, mode: SceneMode, is_contained: bool) {
    let other = if mode == SceneMode::Imported { "import".to_owned() } else { format!("mode = \"{}\"", mode.name()) };
    for (key, because) in idle_keys(mode, is_contained) {
        if checker.has(key) {
            checker.contradiction(key, &other, because);
        }
    }
}

/// Keys of the job file that a mode makes idle, and why. `is_contained`: whether the bodies are in a container.
pub(super) fn idle_keys(mode: SceneMode, is_contained: bool) -> Vec<(&'static str, &'static str)> {
    const CONTAINER: (&str, &str) = ("container", "a bin has a container, all other modes have a table");
    const TABLE: (&str, &str) = ("table", "a bin has a container, all other modes have a table");
    const PILE: (&str, &str) = ("pile", "only a pile has walls that are lifted away");
    const REGION: (&str, &str) = ("region", "only on a table are bodies put next to each other");
    const AT_ONCE: &str = "on a table all bodies are released at once, 2 mm above it";
    const CONTAINED: &str = "bodies are imported into a container or onto a table";
    const AS_THEY_ARE: &str = "imported scenes are kept as they are: nothing is drawn, dropped or settled";
    let put_down =
        ["physics.release_interval", "physics.release_height", "physics.max_redrops"].map(|key| (key, AT_ONCE));
    match mode {
        SceneMode::Bin => vec![TABLE, PILE, REGION],
        SceneMode::Pile => vec![CONTAINER, REGION],
        SceneMode::Heap => vec![CONTAINER, PILE, REGION],
        SceneMode::Table => [CONTAINER, PILE].into_iter().chain(put_down).collect(),
        SceneMode::Packed => [CONTAINER, PILE, REGION].into_iter().chain(put_down).collect(),
        SceneMode::Imported => {
            let floor = if is_contained { ("table", CONTAINED) } else { CONTAINER };
            std::iter::once(floor).chain(IMPORTED_IDLE.map(|key| (key, AS_THEY_ARE))).collect()
        }
    }
}

/// The container, and the file that it is out of, if it is. One with a mistake, which is reported, becomes a box.
fn container(
    checker: &mut Checker,
    spec: &ScenesSpec,
    is_contained: bool,
    folder: &Path,
) -> (SceneContainer, Option<VesselFile>) {
    let &ContainerSpec { ref mesh, unit, ref content, inner_size, wall, tilt_deg } = &spec.container;
    match (is_contained, mesh) {
        (true, Some(file)) => {
            if let Some((file, shape)) = vessel::read(checker, &spec.container, file, folder) {
                return (SceneContainer::Mesh { shape: Arc::new(shape), tilt_deg }, Some(file));
            }
        }
        (true, None) => {
            let of_mesh = [("container.unit", unit.is_some()), ("container.content", content.is_some())];
            for (key, _) in of_mesh.into_iter().filter(|(_, is_given)| *is_given) {
                checker.invalid(key, "`container.mesh` beside it", "a box has no file");
            }
        }
        (false, _) => return (SceneContainer::Plane { size: spec.table.size }, None),
    }
    (SceneContainer::Bin { inner: inner_size, wall, tilt_deg }, None)
}

/// A region of a table of these sides [m].
fn region(checker: &mut Checker, spec: RegionSpec, table: [f64; 2]) -> Option<Region> {
    let region = match spec {
        RegionSpec::Rectangle(RectangleSpec { x, y }) => {
            let ordered = [("region.x", x), ("region.y", y)].map(|(key, range)| checker.check_range(key, &range));
            ordered.iter().all(|ordered| *ordered).then_some(Region::Rectangle([x, y]))
        }
        RegionSpec::Ring(RingSpec { around, radius }) => {
            checker.check_range("region.radius", &radius).then_some(Region::Ring { around, radius })
        }
    }?;
    if !region.meets(table) {
        let found = format!("no part of a table of {} x {} m", table[0], table[1]);
        checker.invalid("region", "a part of the table (`table.size`), whose middle is at x = y = 0", found);
    }
    Some(region)
}

/// The walls of a pile on a table of these sides [m].
fn walls(checker: &mut Checker, spec: &PileSpec, table: [f64; 2]) -> PileWalls {
    let &PileSpec { side, height, lift_speed } = spec;
    if table.iter().any(|of_table| side > *of_table) {
        let found = format!("{side} m on a table of {} x {} m", table[0], table[1]);
        checker.invalid("pile.side", "at most the sides of the table (`table.size`)", found);
    }
    PileWalls { side, height, lift_speed }
}

fn friction(checker: &mut Checker, spec: &ScenePhysicsSpec) -> [f64; 2] {
    match spec.friction {
        FrictionSpec::Exactly(friction) => [friction; 2],
        FrictionSpec::Between(range) => {
            checker.check_range("physics.friction", &range);
            range
        }
    }
}

fn settle(checker: &mut Checker, spec: &ScenePhysicsSpec) -> SettleSettings {
    let &ScenePhysicsSpec {
        friction: _,
        rolling,
        timestep,
        release_interval,
        release_height,
        rest_speed,
        rest_time,
        settle_timeout,
        stability_time,
        substeps,
        max_redrops,
    } = spec;
    if rest_time >= settle_timeout {
        checker.invalid(
            "physics.rest_time",
            "less than `physics.settle_timeout`",
            format!("{rest_time} s of {settle_timeout} s"),
        );
    }
    SettleSettings {
        timestep,
        rolling,
        release_every: release_interval,
        release_height,
        rest_speed,
        rest_time,
        cap: settle_timeout,
        recheck: stability_time,
        finer: substeps,
        put_back: max_redrops,
    }
}
