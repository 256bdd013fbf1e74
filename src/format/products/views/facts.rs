//! Facts of a view.

use crate::{FactFormat, FactKind, FactRange, Facts};

/// Numbers of a view: counts of bodies by their visible share, and how near they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewFacts {
    /// Bodies of the scene; 0 for a rejected view.
    pub bodies: u32,
    /// Bodies without a visible pixel.
    pub unseen: u32,
    /// Bodies visible, but by less than a tenth of their silhouette.
    pub hidden: u32,
    /// Bodies visible by a tenth to less than a half.
    pub mostly_hidden: u32,
    /// Bodies visible by a half to less than nine tenths.
    pub partly_hidden: u32,
    /// Bodies visible by nine tenths or more.
    pub clear: u32,
    /// Bodies that extend beyond the image.
    pub truncated: u32,
    /// Discarded cameras that were inside or next to something.
    pub near_draws: u32,
    /// Discarded cameras that saw too little of every body.
    pub unseen_draws: u32,
    /// Bodies with at least half of their visible pixels nearer than the sensor measures.
    pub too_near: u32,
    /// Smallest true depth of a body [m]; 0 without a sensor, or if no body is visible.
    pub nearest: f64,
}

impl ViewFacts {
    /// Counts one body.
    pub(super) fn add(&mut self, visible_share: f64, truncated: bool) {
        self.bodies += 1;
        self.truncated += u32::from(truncated);
        let stratum = match visible_share {
            0.0 => &mut self.unseen,
            share if share < 0.1 => &mut self.hidden,
            share if share < 0.5 => &mut self.mostly_hidden,
            share if share < 0.9 => &mut self.partly_hidden,
            _ => &mut self.clear,
        };
        *stratum += 1;
    }
}

const fn count(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 11] = [
    count("bodies", "Bodies of the scene; 0 for a rejected view."),
    count("unseen", "Bodies without a visible pixel."),
    count("hidden", "Bodies visible, but by less than a tenth of their silhouette."),
    count("mostly_hidden", "Bodies visible by a tenth to less than a half."),
    count("partly_hidden", "Bodies visible by a half to less than nine tenths."),
    count("clear", "Bodies visible by nine tenths or more."),
    count("truncated", "Bodies that extend beyond the image."),
    count("near_draws", "Discarded cameras that were inside or next to something."),
    count("unseen_draws", "Discarded cameras that saw too little of every body."),
    count(
        "too_near",
        "Bodies with at least half of their visible pixels nearer than the sensor measures; 0 without a sensor.",
    ),
    FactFormat {
        name: "nearest",
        kind: FactKind::Number(FactRange::FromZero),
        topic: None,
        meaning: "Smallest true depth of a body [m]; 0 without a sensor, or if no body is visible.",
    },
];

impl From<ViewFacts> for Facts {
    fn from(facts: ViewFacts) -> Self {
        let ViewFacts {
            bodies,
            unseen,
            hidden,
            mostly_hidden,
            partly_hidden,
            clear,
            truncated,
            near_draws,
            unseen_draws,
            too_near,
            nearest,
        } = facts;
        let strata = [unseen, hidden, mostly_hidden, partly_hidden, clear];
        let counts = [bodies].into_iter().chain(strata).chain([truncated, near_draws, unseen_draws, too_near]);
        Self::new(counts.map(f64::from).chain([nearest]))
    }
}

impl From<&Facts> for ViewFacts {
    fn from(facts: &Facts) -> Self {
        let of = |index: usize| facts.integer(index);
        Self {
            bodies: of(0),
            unseen: of(1),
            hidden: of(2),
            mostly_hidden: of(3),
            partly_hidden: of(4),
            clear: of(5),
            truncated: of(6),
            near_draws: of(7),
            unseen_draws: of(8),
            too_near: of(9),
            nearest: facts.values()[10],
        }
    }
}
