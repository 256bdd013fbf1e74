//! Outcome of a scene, as it is recorded: facts, rejects, which body rests on which.

use std::collections::BTreeMap;

use format::{CONTAINER, SceneContact, SceneFacts, SceneSupport};
use sim::{Fault, SceneTouch, SettleOutcome};

/// Reason and detail of a rejected scene. Bodies are counted from 1, in the order of their first release.
pub(super) fn reject_words(fault: &Fault) -> (&'static str, String) {
    let of =
        |body: &Option<usize>| body.map_or_else(|| "the container".to_owned(), |index| format!("body {}", index + 1));
    match fault {
        Fault::NeverRested { speed } => ("never_rested", format!("still moves at {speed:.4} m/s")),
        Fault::TooDeep { pair: [one, other], depth } => {
            ("too_deep", format!("{} and {} overlap by {:.2} mm", of(one), of(other), 1e3 * depth))
        }
        Fault::Crossed { pair: [one, other] } => {
            ("crossed", format!("{} and {} go through each other", of(one), of(other)))
        }
        Fault::Gone { bodies } => {
            let bodies: Vec<String> = bodies.iter().map(|index| (index + 1).to_string()).collect();
            ("gone", format!("left the container: {}", bodies.join(", ")))
        }
        Fault::Moved { body, drift, turn } => {
            let (millimetres, degrees) = (1e3 * drift, turn.to_degrees());
            ("moved", format!("stepped again, body {} moves {millimetres:.2} mm and {degrees:.2} deg", body + 1))
        }
        Fault::Unstable(kind) => ("unstable", format!("MuJoCo's numbers blow up: {kind:?}")),
    }
}

/// Facts of a scene that is rejected: it has no bodies and no contacts.
pub(super) fn reject_facts(scene: &SettleOutcome) -> SceneFacts {
    SceneFacts {
        bodies: 0,
        contacts: 0,
        gone: scene.gone.len() as u32,
        steps: scene.steps,
        rest_time: scene.rest_time,
        top_speed: scene.top_speed,
        depths: scene.depths,
        drift: scene.drift(),
    }
}

/// Number of a body in records.
fn number(body: Option<usize>) -> u32 {
    body.map_or(CONTAINER, |index| index as u32 + 1)
}

/// Contacts as they are recorded.
pub(super) fn contacts(touches: &[SceneTouch]) -> Vec<SceneContact> {
    let contact = |touch: &SceneTouch| SceneContact {
        pair: touch.pair.map(number),
        point: touch.point.coords.into(),
        normal: touch.normal.into(),
        distance: touch.distance,
        force: touch.force.into(),
        torque: touch.torque.into(),
    };
    touches.iter().map(contact).collect()
}

/// Bodies that rest on others: the vertical force of one body on another over the other's weight [N], where it carries it.
pub(super) fn supports(touches: &[SceneTouch], weights: &[f64]) -> Vec<SceneSupport> {
    let mut forces: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for touch in touches {
        let [first, second] = touch.pair.map(number);
        *forces.entry((second, first)).or_default() += touch.force.z;
        *forces.entry((first, second)).or_default() -= touch.force.z;
    }
    let carried = forces.into_iter().filter(|((body, _), force)| *body != CONTAINER && *force > 0.0);
    let support =
        |((body, by), force): ((u32, u32), f64)| SceneSupport { by, body, share: force / weights[body as usize - 1] };
    carried.map(support).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    fn touch(pair: [Option<usize>; 2], up: f64) -> SceneTouch {
        let force = Vector3::new(0.1, 0.0, up);
        let torque = Vector3::new(1e-3, 0.0, 0.0);
        SceneTouch { pair, point: Point3::origin(), normal: Vector3::z(), distance: -1e-5, force, torque }
    }

    /// A body on another one on the floor: the floor carries both, whichever comes first.
    #[test]
    fn supports_are_shares_of_the_weight_of_what_is_carried() {
        // The second body, 2 N, carries the first, 1 N.
        let touches = [touch([None, Some(1)], 1.5), touch([None, Some(1)], 1.5), touch([Some(0), Some(1)], -1.0)];
        let found = supports(&touches, &[1.0, 2.0]);
        let expected =
            [SceneSupport { by: 2, body: 1, share: 1.0 }, SceneSupport { by: CONTAINER, body: 2, share: 1.5 }];
        assert_eq!(found, expected);
        assert_eq!(contacts(&touches)[2].pair, [1, 2]);
    }
}
