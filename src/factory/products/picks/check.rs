//! From the keys of a job for picks to settings that make sense: every mistake that the schema cannot see.

use std::{
    cell::Cell,
    collections::BTreeSet,
    path::{Path as FilePath, PathBuf},
};

use super::{
    grasps_reader::{InvalidPickGrasps, read_pick_grasps},
    settings::{PickGrasps, PickSettings, PickSource, ScenePoses},
    spec::{PickGraspsSpec, PickSpec, PicksSpec, SamplerSpec},
};
use crate::{
    products::{
        input::InputSection,
        settled::{FoundScenes, ObjectKeys, SCENES, found_scenes, object_keys, rolling_friction},
    },
    sections::{JobHand, read_hand},
};
use form::Checker;
use kernel::{ids::ObjectId, words::Show};
use sim::HandModel;

/// The section that names the dataset of grasps.
const GRASPS: InputSection = InputSection {
    name: "grasps",
    make: "make one first, and name its folder: `graspmill run jobs/clutter-grasps-quick.toml --out \
           datasets/clutter-grasps-quick`",
};

const NO_PADS: &str = "name a dataset of grasps of this hand (`grasps.dataset`), which are transferred, or a gripper whose two \
                       pads slide towards each other (`hand.model`)";

const MAKE_TRIALS: &str = "make a dataset with trials (a section `[physics]` in the job for grasps), or use the kept \
                           ones: `picks.grasps = \"kept\"`";

/// Default directions of a hand with a closing line.
const ROLLS: u32 = 16;

/// A job for picks but for the meshes.
pub(super) struct Checked {
    pub scenes_folder: PathBuf,
    pub scenes: FoundScenes,
    pub rolling: f64,
    pub keys: ObjectKeys,
    pub source: PickSource,
    pub hand: JobHand,
    pub settings: PickSettings,
}

/// The job; `None` when something is wrong, which is reported.
pub(super) fn checked(checker: &mut Checker, spec: &PicksSpec, folder: &FilePath) -> Option<Checked> {
    let hand = hand(checker, spec, folder);
    let sampler = sampler(spec);
    let settings = hand.as_ref().and_then(|(hand, has_line)| settings(checker, spec, sampler, (hand, *has_line)));
    let scenes_folder = SCENES.folder(checker, spec.scenes.dataset.as_ref(), folder);
    let grasps_folder = match sampler {
        SamplerSpec::Scene => None,
        SamplerSpec::Transferred => GRASPS.folder(checker, spec.grasps.dataset.as_ref(), folder),
    };
    let scenes = found_scenes(checker, &spec.scenes, scenes_folder.as_ref()?);
    let rolling = scenes.as_ref().and_then(|scenes| rolling_friction(checker, scenes));
    let keys = scenes.as_ref().and_then(|scenes| object_keys(checker, scenes));
    let (scenes_folder, scenes) = (scenes_folder?, scenes?);
    let source = match sampler {
        SamplerSpec::Scene => {
            let PickSpec { poses, half_angle_deg, cone_friction, .. } = spec.picks;
            PickSource::Scene(ScenePoses { poses, half_angle_deg, cone_friction })
        }
        SamplerSpec::Transferred => {
            let folder = grasps_folder?;
            let grasps = grasps(checker, spec, &folder, &scenes)?;
            PickSource::Transferred { folder, grasps }
        }
    };
    let (hand, _) = hand?;
    if let Some((_, grasps)) = source.transferred().filter(|(_, grasps)| grasps.hand != hand.id) {
        let expected = format!("the hand of the grasps, of content {}", grasps.hand.0.short());
        let seen = format!("{} of content {}", hand.name, hand.id.0.short());
        let report = checker.invalid("hand.model", expected, seen);
        report.help("name the hand's description as the job of the grasps does");
        return None;
    }
    let (rolling, keys, settings) = (rolling?, keys?, settings?);
    Some(Checked { scenes_folder, scenes, rolling, keys, source, hand, settings })
}

/// The sampler of a job: where it names none, a dataset of grasps decides.
fn sampler(spec: &PicksSpec) -> SamplerSpec {
    let default = if spec.grasps.dataset.is_some() { SamplerSpec::Transferred } else { SamplerSpec::Scene };
    spec.picks.sampler.unwrap_or(default)
}

/// Whether a job whose grasps are sampled in the scene has a hand with two pads, and no key of stored grasps; mistakes are reported.
fn can_sample(checker: &mut Checker, spec: &PicksSpec, (hand, has_line): (&JobHand, bool)) -> bool {
    let PicksSpec { grasps: PickGraspsSpec { dataset, root, trials_root }, picks, .. } = spec;
    let stored = [
        ("grasps.dataset", dataset.is_some()),
        ("grasps.root", root.is_some()),
        ("grasps.trials_root", trials_root.is_some()),
        ("picks.grasps", picks.grasps.is_some()),
        ("picks.rolls", picks.rolls.is_some()),
    ];
    let named = stored.into_iter().find(|(_, is_named)| *is_named);
    if let Some((key, _)) = named {
        let report = checker.invalid(key, "no key of stored grasps with `sampler = \"scene\"`", "one");
        report.help(format!("remove `{key}` from the job, or name a dataset with `sampler = \"transferred\"`"));
    }
    if !has_line {
        let expected = "\"transferred\" for a hand without two pads that slide towards each other";
        checker.invalid("picks.sampler", expected, format!("\"scene\" with {}", hand.name)).help(NO_PADS);
    }
    named.is_none() && has_line
}

/// The hand, and whether it has a closing line.
fn hand(checker: &mut Checker, spec: &PicksSpec, folder: &FilePath) -> Option<(JobHand, bool)> {
    let has_line = Cell::new(false);
    let can = |model: &HandModel| {
        has_line.set(model.hand().closing_line().is_some());
        model.check_grasping()
    };
    let hand = read_hand(checker, "hand", spec.hand.as_ref()?, folder, can)?;
    Some((hand, has_line.get()))
}

fn settings(
    checker: &mut Checker,
    spec: &PicksSpec,
    sampler: SamplerSpec,
    (hand, has_line): (&JobHand, bool),
) -> Option<PickSettings> {
    let PickSpec { rolls, candidates, margin, trials, movable, .. } = spec.picks;
    if sampler == SamplerSpec::Scene {
        let is_fine = can_sample(checker, spec, (hand, has_line));
        return is_fine.then_some(PickSettings { rolls: 1, candidates, margin, trials, awake: movable.into() });
    }
    if let Some(rolls) = rolls.filter(|rolls| *rolls > 1 && !has_line) {
        let expected = "1 for a hand without two pads that slide towards each other";
        let report = checker.invalid("picks.rolls", expected, rolls.to_string());
        report.help("remove `picks.rolls` from the job: such a hand has no line to rotate about");
        return None;
    }
    let rolls = rolls.unwrap_or(if has_line { ROLLS } else { 1 });
    Some(PickSettings { rolls, candidates, margin, trials, awake: movable.into() })
}

/// The grasps of the scenes' objects, compared with the roots that the job pins.
fn grasps(checker: &mut Checker, spec: &PicksSpec, dataset: &FilePath, scenes: &FoundScenes) -> Option<PickGrasps> {
    let objects: BTreeSet<ObjectId> =
        scenes.list.iter().flat_map(|scene| scene.bodies.iter().map(|(object, _)| *object)).collect();
    let found = read_pick_grasps(dataset, spec.picks.grasps.map(Into::into), &objects);
    if let Err(InvalidPickGrasps::NoTrials(_)) = found {
        let seen = format!("{} has none", dataset.shown());
        checker.invalid("picks.grasps", "a dataset of grasps with trials", seen).help(MAKE_TRIALS);
        return None;
    }
    let found = GRASPS.found(checker, found)?;
    if !GRASPS.has_root(checker, spec.grasps.root.as_deref(), found.root, dataset) {
        return None;
    }
    if !GRASPS.has_trials_root(checker, spec.grasps.trials_root.as_deref(), found.trials, dataset) {
        return None;
    }
    if found.objects.values().all(Vec::is_empty) {
        let seen = format!("none in {}, of {} objects", dataset.shown(), objects.len());
        let expected = format!("at least one grasp of the scenes' objects that is {}", found.take.name());
        let report = checker.invalid("grasps.dataset", expected, seen);
        report.help("make grasps of the objects of the scenes: both jobs need the same `[[objects]]`");
        return None;
    }
    Some(found)
}
