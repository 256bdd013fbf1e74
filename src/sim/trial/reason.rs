//! Why a grasp failed: the first reason that applies to the outcome of a trial.

use super::{Limit, Margins, Outcome, Phase, Verdict};

// Thresholds of our own, but for the limits of slip and rotation, which are those of the protocol; ACRONYM (Eppner et al. 2021) stores the
// object's motion while the hand closes and shakes without any.

/// Displacement of an object that the hand has pushed away while it closed [m]: at least half a pad's width.
const PUSHED: f64 = 0.01;

/// Speed above which an object is ejected [m/s]: that of a fall by 5 mm, and well above that of closing fingers that push it.
const EJECTED: f64 = 0.3;

/// Reason why a trial failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrialFailure {
    /// The closed hand does not touch the object, which it did not push away.
    Nothing,
    /// The hand pushed the object away while it closed.
    PushedAway,
    /// Two links pressed on the object, and it shot out of the hand while that closed.
    Ejected,
    /// All contacts of the closed hand press towards one side.
    OneSided,
    /// The object slipped during the lift.
    SlippedLift,
    /// The object rotated during the lift.
    RotatedLift,
    /// The object slipped after the lift.
    SlippedShake,
    /// The object rotated after the lift.
    RotatedShake,
    /// The object stayed, but in the end fewer than two links touch it.
    LetGo,
    /// The numbers of the simulation diverged.
    Unstable,
    /// The hand starts too deep in the object or the table: nothing was simulated.
    StartsTooDeep,
}

impl TrialFailure {
    /// The name in records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::PushedAway => "pushed_away",
            Self::Ejected => "ejected",
            Self::OneSided => "one_sided",
            Self::SlippedLift => "slipped_lift",
            Self::RotatedLift => "rotated_lift",
            Self::SlippedShake => "slipped_shake",
            Self::RotatedShake => "rotated_shake",
            Self::LetGo => "let_go",
            Self::Unstable => "unstable",
            Self::StartsTooDeep => "starts_too_deep",
        }
    }
}

/// Why a trial failed; `None` if it held.
pub fn failure_reason(outcome: &Outcome) -> Option<TrialFailure> {
    let margins = outcome.margins.clone().unwrap_or_default();
    let is_one_sided = outcome.closed.as_ref().is_some_and(|closed| closed.is_one_sided());
    match outcome.verdict {
        Verdict::Held => None,
        Verdict::Refused { .. } => Some(TrialFailure::StartsTooDeep),
        Verdict::Unstable { .. } => Some(TrialFailure::Unstable),
        Verdict::NotTouching | Verdict::Lost { phase: Phase::Closing, .. } => Some(while_closing(&margins)),
        Verdict::OneLink => Some(TrialFailure::OneSided),
        Verdict::Lost { .. } | Verdict::LetGo { .. } if is_one_sided => Some(TrialFailure::OneSided),
        Verdict::Lost { phase, .. } => {
            let limit = margins.loss.map_or(Limit::Distance, |loss| loss.limit);
            Some(match (phase, limit) {
                (Phase::Closing | Phase::Lift, Limit::Distance) => TrialFailure::SlippedLift,
                (Phase::Closing | Phase::Lift, Limit::Angle) => TrialFailure::RotatedLift,
                (Phase::Shake | Phase::Turned(_), Limit::Distance) => TrialFailure::SlippedShake,
                (Phase::Shake | Phase::Turned(_), Limit::Angle) => TrialFailure::RotatedShake,
            })
        }
        Verdict::LetGo { .. } => Some(TrialFailure::LetGo),
    }
}

/// Why a closed hand does not touch the object. An object that was ejected has been pushed away, too, so that comes first.
fn while_closing(margins: &Margins) -> TrialFailure {
    let [moved, _] = margins.closing;
    if margins.pressed_speed > EJECTED {
        TrialFailure::Ejected
    } else if margins.has_touched && moved >= PUSHED {
        TrialFailure::PushedAway
    } else {
        TrialFailure::Nothing
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

    use super::*;
    use crate::{
        hand::link_touch::LinkTouch,
        physics::{Instability, Unstable},
        trial::{Grip, Loss, Start},
    };

    fn outcome(verdict: Verdict, normals: &[[f64; 3]], margins: Margins) -> Outcome {
        let touches = normals.iter().enumerate().map(|(link, normal)| LinkTouch {
            link,
            point: Point3::origin(),
            normal: Unit::new_normalize(Vector3::from(*normal)),
            distance: -1e-4,
            force: 5.0,
        });
        let base_from_object = IsometryMatrix3::identity();
        let closed = Grip { joints: vec![], motors: vec![], base_from_object, touches: touches.collect() };
        Outcome {
            verdict,
            start: Start {
                posture: vec![],
                base_from_object,
                penetration: 0.0,
                table_penetration: 0.0,
                opened_by: 0.0,
                drawn_back: 0.0,
            },
            closed: Some(closed),
            closed_at_rest: true,
            closing_time: 0.5,
            slips: vec![],
            farthest: 0.0,
            shaken_penetration: 0.0,
            end: None,
            steps: 100,
            warnings: 0,
            series: None,
            margins: Some(margins),
        }
    }

    #[test]
    fn the_first_reason_that_applies_is_given() {
        let pinch: &[[f64; 3]] = &[[1.0, 0.0, 0.0], [-1.0, 0.2, 0.0]];
        let hook: &[[f64; 3]] = &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let lost = |phase| Verdict::Lost { phase, time: 1.0 };
        let passed = |limit| {
            let loss = Some(Loss { limit, phase: Phase::Lift, time: 1.0 });
            Margins { has_touched: true, loss, ..Margins::default() }
        };
        let closing = |has_touched: bool, moved: f64, pressed_speed: f64| Margins {
            has_touched,
            closing: [moved, 0.0],
            pressed_speed,
            ..Margins::default()
        };
        let unstable = Unstable { step: 3, kind: Instability::Velocity };
        let (nowhere, distance, angle) = (Margins::default(), passed(Limit::Distance), passed(Limit::Angle));
        for (verdict, normals, margins, expected) in [
            (Verdict::Held, pinch, nowhere.clone(), None),
            (Verdict::Refused { penetration: 0.1 }, &[], nowhere.clone(), Some(TrialFailure::StartsTooDeep)),
            (Verdict::NotTouching, &[], closing(false, 0.0, 0.0), Some(TrialFailure::Nothing)),
            (Verdict::NotTouching, &[], closing(true, 0.004, 0.0), Some(TrialFailure::Nothing)),
            (Verdict::NotTouching, &[], closing(true, 0.02, 0.1), Some(TrialFailure::PushedAway)),
            (lost(Phase::Closing), &[], closing(true, 0.11, 0.0), Some(TrialFailure::PushedAway)),
            (lost(Phase::Closing), &[], closing(true, 0.11, 0.5), Some(TrialFailure::Ejected)),
            (Verdict::OneLink, &pinch[..1], nowhere.clone(), Some(TrialFailure::OneSided)),
            (lost(Phase::Lift), hook, distance.clone(), Some(TrialFailure::OneSided)),
            (lost(Phase::Lift), pinch, distance.clone(), Some(TrialFailure::SlippedLift)),
            (lost(Phase::Lift), pinch, angle.clone(), Some(TrialFailure::RotatedLift)),
            (lost(Phase::Shake), pinch, distance, Some(TrialFailure::SlippedShake)),
            (lost(Phase::Shake), pinch, angle, Some(TrialFailure::RotatedShake)),
            (Verdict::LetGo { links: 1 }, pinch, nowhere.clone(), Some(TrialFailure::LetGo)),
            (Verdict::Unstable { phase: Phase::Lift, what: unstable }, pinch, nowhere, Some(TrialFailure::Unstable)),
        ] {
            let words = format!("{verdict:?} {margins:?}");
            assert_eq!(failure_reason(&outcome(verdict, normals, margins)), expected, "{words}");
        }
    }

    #[test]
    fn forces_that_balance_each_other_have_no_imbalance() {
        let imbalance = |normals: &[[f64; 3]]| {
            let outcome = outcome(Verdict::Held, normals, Margins::default());
            outcome.closed.map(|closed| (closed.imbalance(), closed.is_one_sided()))
        };
        assert_eq!(imbalance(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), Some((0.0, false)));
        assert_eq!(imbalance(&[[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), Some((1.0, true)));
        assert_eq!(imbalance(&[]), Some((1.0, true)));
    }
}
