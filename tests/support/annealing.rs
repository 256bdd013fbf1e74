//! Default settings of annealing for tests and benches.

use graspmill::grasp::{AmplitudeRange, Annealing, EnergyKind, Keeping, SearchFrame, WrenchSpace};

/// Contact energy and potential over wrenches, 10,000 steps.
pub const ANNEALING: Annealing = Annealing {
    steps: 10_000,
    energy: EnergyKind::ContactAndPotential,
    space: WrenchSpace::Wrench,
    friction: 0.2,
    potential_scale: 100.0,
    whole_schedule: true,
    descent: false,
    frame: SearchFrame::Seed,
    amplitudes: AmplitudeRange::Joints,
    best: 20,
    max_failures: 100,
};

/// Limits that a grasp has to keep within to be kept.
pub const KEEPING: Keeping = Keeping {
    friction: 0.5,
    edges: 16,
    torsion: None,
    space: WrenchSpace::Wrench,
    min_epsilon: 0.01,
    advance: 0.03,
    max_penetration: 5e-4,
    table: false,
};
