//! From the outcome of a trial to a record.

use nalgebra::{IsometryMatrix3, Unit, Vector3};

use format::{ClosedHand, PressedContact, TrialOutcome, TrialVerdict};
use kernel::geom::Pose;
use sim::{Grip, Outcome, Verdict};

pub(super) fn recorded(outcome: &Outcome) -> TrialOutcome {
    let closed = outcome.closed.as_ref();
    TrialOutcome {
        verdict: verdict(&outcome.verdict),
        time: outcome.time(),
        closing_time: outcome.closing_time,
        closed_at_rest: outcome.closed_at_rest,
        penetration: [outcome.start.penetration, closed.map_or(0.0, Grip::penetration), outcome.shaken_penetration],
        farthest: outcome.farthest,
        slips: outcome.slips.iter().map(|slip| [slip.moved, slip.turned]).collect(),
        force: closed.map_or(0.0, Grip::force),
        links: outcome.end.as_ref().map_or(0, |end| end.links().len() as u32),
        opened_by: outcome.start.opened_by,
        drawn_back: outcome.start.drawn_back,
        warnings: outcome.warnings,
    }
}

pub(super) fn verdict(verdict: &Verdict) -> TrialVerdict {
    TrialVerdict::from_name(verdict.reason()).expect("records know every verdict (a test compares them)")
}

/// The closed hand as the object sees it.
pub(super) fn closed_hand(grip: &Grip) -> ClosedHand {
    let object_from_base: IsometryMatrix3<f64> = grip.base_from_object.inverse();
    let contacts = grip.touches.iter().map(|touch| {
        let normal: Vector3<f64> = object_from_base.rotation * touch.normal.into_inner();
        PressedContact {
            link: touch.link as u32,
            point: (object_from_base * touch.point).coords.into(),
            normal: Unit::new_normalize(normal).into_inner().into(),
            distance: touch.distance,
            force: touch.force,
        }
    });
    ClosedHand {
        joints: grip.joints.clone(),
        object_from_base: Pose::from_isometry(object_from_base),
        contacts: contacts.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim::Phase;

    #[test]
    fn records_know_every_verdict() {
        let lost = |phase| Verdict::Lost { phase, time: 1.0 };
        let verdicts = [
            Verdict::Held,
            Verdict::Refused { penetration: 0.1 },
            Verdict::NotTouching,
            Verdict::OneLink,
            lost(Phase::Closing),
            lost(Phase::Lift),
            lost(Phase::Shake),
            lost(Phase::Turned(3)),
            Verdict::LetGo { links: 1 },
        ];
        assert_eq!(verdicts.map(|known| verdict(&known)), TrialVerdict::ALL[..9]);
        assert_eq!(TrialVerdict::from_name("unstable"), Some(TrialVerdict::Unstable));
    }
}
