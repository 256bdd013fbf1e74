//! Settings of touch stored with pairs.

use std::path::Path as FilePath;

use super::{
    settings::{Exploration, ExplorationTarget, RandomRays, Touch, TouchByHand},
    spec::TouchSpec,
};
use crate::{product::HandUse, sections::read_hand};
use form::Checker;
use sim::HandModel;

/// Exploration by a hand, with whether a hand can do it.
pub const EXPLORES: HandUse = HandUse { setting: "touch.exploration = true", check: HandModel::check_touching };

/// Kinds of touch by a hand, each with whether a hand can do it.
pub const HAND_USES: &[HandUse] =
    &[EXPLORES, HandUse { setting: "touch.grasp = true", check: HandModel::check_touching }];

impl Touch {
    /// The kinds of touch that the keys select; mistakes are reported.
    pub fn read(checker: &mut Checker, spec: &TouchSpec, folder: &FilePath) -> Self {
        let asked = spec.exploration || spec.grasp;
        idle(checker, &["rays", "ray_target"], &[("random_rays", spec.random_rays)]);
        idle(checker, &["approaches", "exploration_target"], &[("exploration", spec.exploration)]);
        idle(checker, &["hand"], &[("exploration", spec.exploration), ("grasp", spec.grasp)]);
        if asked && spec.hand.is_none() {
            let help =
                "`hand = { model = \"../scenes/barrett_bh8_280.xml\" }`; docs/hands.md explains how to add your own";
            checker.missing("touch.hand", "the hand that touches").help(help);
        }
        let can_touch = HandModel::check_touching;
        let hand = spec.hand.as_ref().filter(|_| asked);
        let hand = hand.and_then(|hand| read_hand(checker, "touch.hand", hand, folder, can_touch));
        Self {
            random_rays: spec.random_rays.then_some(RandomRays { count: spec.rays, target: spec.ray_target }),
            by_hand: hand.map(|hand| TouchByHand {
                hand,
                exploration: spec.exploration.then_some(Exploration {
                    approaches: spec.approaches,
                    // Set by the profile.
                    target: spec.exploration_target.unwrap_or(ExplorationTarget::UnseenCells),
                }),
                grasp: spec.grasp,
            }),
        }
    }
}

/// Reports settings of a kind of touch that the job does not have, unless the kind's own key is written as `false`.
fn idle(checker: &mut Checker, keys: &[&str], kinds: &[(&str, bool)]) {
    let written = |key: &str| checker.has(&format!("touch.{key}"));
    let Some(key) = keys.iter().find(|key| written(key)) else { return };
    if kinds.iter().any(|(kind, asked)| *asked || written(kind)) {
        return;
    }
    let kinds: Vec<String> = kinds.iter().map(|(kind, _)| (*kind).to_owned()).collect();
    let asked: Vec<String> = kinds.iter().map(|kind| format!("`{kind} = true`")).collect();
    checker.missing(&format!("touch.{}", kinds[0]), format!("{} beside `{key}`", asked.join(" or ")));
}
