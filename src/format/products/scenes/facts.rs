//! Facts of a scene.

use crate::{FactFormat, FactKind, FactRange, Facts};

/// Numbers of a scene that was settled, kept or not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneFacts {
    /// Bodies of the scene; 0 for a rejected scene.
    pub bodies: u32,
    /// Contacts; 0 for a rejected scene.
    pub contacts: u32,
    /// Bodies that left the container.
    pub gone: u32,
    /// Steps until rest.
    pub steps: u32,
    /// From the last release to rest [s].
    pub rest_time: f64,
    /// Largest speed at rest [m/s].
    pub top_speed: f64,
    /// Largest overlap of two bodies, and of a body and the container [m].
    pub depths: [f64; 2],
    /// Largest motion of a centre of mass [m] and largest rotation [rad] when stepped again from rest.
    pub drift: [f64; 2],
}

const fn count(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

const fn number(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Number(FactRange::FromZero), topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 10] = [
    count("bodies", "Bodies of the scene; 0 for a rejected scene."),
    count("contacts", "Contacts of its bodies with each other and with the container; 0 for a rejected scene."),
    count("gone", "Bodies that left the container and are not part of the scene."),
    count("steps", "Steps of the simulation until rest."),
    number("rest_time", "Time from the last release to rest [s]."),
    number("top_speed", "Largest speed at rest [m/s]."),
    number("depth_bodies", "Largest overlap of two bodies [m]."),
    number("depth_container", "Largest overlap of a body and the container [m]."),
    number("drift", "Largest motion of a centre of mass when the scene is stepped again from rest [m]."),
    number("turn", "Largest rotation of a body when the scene is stepped again from rest [rad]."),
];

impl From<SceneFacts> for Facts {
    fn from(facts: SceneFacts) -> Self {
        let SceneFacts { bodies, contacts, gone, steps, rest_time, top_speed, depths, drift } = facts;
        let counts = [bodies, contacts, gone, steps].map(f64::from);
        Self::new(counts.into_iter().chain([rest_time, top_speed]).chain(depths).chain(drift))
    }
}

impl From<&Facts> for SceneFacts {
    fn from(facts: &Facts) -> Self {
        let values = facts.values();
        let [bodies, contacts, gone, steps] = [0, 1, 2, 3].map(|index| facts.integer(index));
        let of = |index: usize| values[index];
        Self {
            bodies,
            contacts,
            gone,
            steps,
            rest_time: of(4),
            top_speed: of(5),
            depths: [of(6), of(7)],
            drift: [of(8), of(9)],
        }
    }
}
