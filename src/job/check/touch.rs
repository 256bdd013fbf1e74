//! Settings of touch beside completion pairs.

use std::path::Path as FilePath;

use super::{Checker, described};
use crate::{
    assets::Description,
    ids::ObjectId,
    job::{
        checked::{JobHand, RandomRays, RayTarget, Touch, TouchByHand},
        discover,
        document::Path,
        errors::Problem,
        spec::touch::{HandSpec, RayTargetSpec, TouchSpec},
    },
};

/// Tries a hand; the error says why it cannot touch, or grasp, in words.
///
/// Only the `sim` room compiles MJCF, so whoever reads a job passes it in.
pub type HandReader<'a> = dyn Fn(&JobHand) -> Result<(), String> + 'a;

/// The reader of a program without the simulator: refuses every hand.
///
/// # Errors
/// Always.
pub fn no_hands(_: &JobHand) -> Result<(), String> {
    Err("this build has no simulator to read a hand with (feature `sim`)".to_owned())
}

/// What is touched and how.
pub(super) fn touch(checker: &mut Checker<'_>, spec: &TouchSpec, folder: &FilePath, hands: &HandReader<'_>) -> Touch {
    let asked = spec.exploration || spec.grasp;
    idle(checker, &["rays", "ray_target"], &[("random_rays", spec.random_rays)]);
    idle(checker, &["approaches"], &[("exploration", spec.exploration)]);
    idle(checker, &["hand"], &[("exploration", spec.exploration), ("grasp", spec.grasp)]);
    let target = match spec.ray_target {
        RayTargetSpec::Mesh => RayTarget::Mesh,
        RayTargetSpec::Cells => RayTarget::Cells,
    };
    if asked && spec.hand.is_none() {
        let problem = Problem::Missing { expected: "the hand that touches".to_owned() };
        let help = "`hand = { scene = \"../scenes/barrett_bh8_280.xml\" }`; docs/hands.md says how to bring your own";
        checker.fail(&Path::of("touch.hand"), problem, Some(help.to_owned()));
    }
    let hand =
        spec.hand.as_ref().filter(|_| asked).and_then(|hand| read_hand(checker, "touch.hand", hand, folder, hands));
    Touch {
        random_rays: spec.random_rays.then_some(RandomRays { count: spec.rays, target }),
        by_hand: hand.map(|hand| TouchByHand {
            hand,
            exploration: spec.exploration.then_some(spec.approaches),
            grasp: spec.grasp,
        }),
    }
}

/// What is set for a kind of touch that nobody asks for is a slip; where the kind's own key is written as `false`, it is
/// meant.
fn idle(checker: &mut Checker<'_>, keys: &[&str], kinds: &[(&str, bool)]) {
    let written = |key: &str| checker.document.has(&format!("touch.{key}"));
    let Some(key) = keys.iter().find(|key| written(key)) else { return };
    if kinds.iter().any(|(kind, asked)| *asked || written(kind)) {
        return;
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, _)| (*kind).to_owned()).collect();
    let asked: Vec<String> = kinds.iter().map(|kind| format!("`{kind} = true`")).collect();
    let problem = Problem::Missing { expected: format!("{} beside `{key}`", asked.join(" or ")) };
    checker.fail(&Path::of(&format!("touch.{}", kinds[0])), problem, None);
}

/// The hand that stands at `key`; `None` where something is wrong with it, which was reported.
pub(super) fn read_hand(
    checker: &mut Checker<'_>,
    key: &str,
    spec: &HandSpec,
    folder: &FilePath,
    hands: &HandReader<'_>,
) -> Option<JobHand> {
    let before = checker.errors.len();
    let scene = discover::tidy(&folder.join(&spec.scene));
    if scene.extension().is_some_and(|ending| ending == "toml") {
        let expected = "the hand's MJCF file: its table is found beside it";
        checker.senseless(&format!("{key}.scene"), expected, format!("a table, {}", scene.display()));
        return None;
    }
    let Description { name, digest } =
        described(checker, key, "hand", &scene, Description::of_hand(&scene), spec.content.as_deref())?;
    let hand = JobHand { scene, name, id: ObjectId(digest) };
    if let Err(detail) = hands(&hand) {
        let problem = Problem::NotFound { what: "hand".to_owned(), detail };
        checker.fail(&Path::of(key).key("scene"), problem, None);
    }
    (checker.errors.len() == before).then_some(hand)
}
