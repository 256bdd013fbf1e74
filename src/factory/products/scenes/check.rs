//! From the keys of a job for scenes to settings that make sense: every mistake that the schema cannot see.

use super::{
    settings::SceneSettings,
    spec::{CountRangeSpec, CountSpec, FrictionSpec, ModeSpec, ScenePhysicsSpec, ScenesSpec},
};
use form::Checker;
use format::{SceneContainer, SceneMode};
use sim::SettleSettings;

/// The settings; mistakes are reported.
pub(super) fn settings(checker: &mut Checker, spec: &ScenesSpec) -> SceneSettings {
    let (mode, idle) = match spec.mode {
        ModeSpec::Table => (SceneMode::Table, "container"),
        ModeSpec::Heap => (SceneMode::Heap, "container"),
        ModeSpec::Bin => (SceneMode::Bin, "table"),
    };
    if checker.has(idle) {
        let other = format!("mode = \"{}\"", mode.name());
        checker.contradiction(idle, &other, "a bin has a container, table and heap have a table");
    }
    let container = match mode {
        SceneMode::Bin => SceneContainer::Bin { inner: spec.container.inner, wall: spec.container.wall },
        SceneMode::Table | SceneMode::Heap => SceneContainer::Plane { size: spec.table.size },
    };
    // Settings of drops that a table makes idle.
    if mode == SceneMode::Table {
        for key in DROP_KEYS {
            if checker.has(key) {
                checker.contradiction(key, "mode = \"table\"", "on a table all bodies are let go at once, 2 mm up");
            }
        }
    }
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
    if scenes.iter().all(|count| *count == 0) {
        let report = checker.invalid("scenes", "at least one scene", "none in any split");
        report.help("say how many, for example scenes = { training = 100 }");
    }
    SceneSettings {
        mode,
        container,
        count,
        scenes,
        friction: friction(checker, &spec.physics),
        settle: settle(checker, &spec.physics),
    }
}

/// Keys that have no effect where all bodies are let go at once.
pub(super) const DROP_KEYS: [&str; 2] = ["physics.release_every", "physics.release_height"];

fn friction(checker: &mut Checker, spec: &ScenePhysicsSpec) -> [f64; 2] {
    match spec.friction {
        FrictionSpec::Exactly(friction) => [friction; 2],
        FrictionSpec::Between([low, high]) => {
            if low > high {
                checker.invalid("physics.friction", "the lower number first", format!("[{low}, {high}]"));
            }
            [low, high]
        }
    }
}

fn settle(checker: &mut Checker, spec: &ScenePhysicsSpec) -> SettleSettings {
    let &ScenePhysicsSpec {
        friction: _,
        rolling,
        timestep,
        release_every,
        release_height,
        rest_speed,
        rest_time,
        cap,
        recheck,
    } = spec;
    if rest_time >= cap {
        checker.invalid("physics.rest_time", "less than `physics.cap`", format!("{rest_time} s of {cap} s"));
    }
    SettleSettings { timestep, rolling, release_every, release_height, rest_speed, rest_time, cap, recheck }
}
