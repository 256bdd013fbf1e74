//! Settings of the search for grasps, and of the choice which are kept.

/// Energy that annealing minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnergyKind {
    /// The contact energy.
    Contact,
    /// The potential where it is below 0, else the contact energy (thesis, algorithm 4).
    ContactAndPotential,
}

/// In which space the potential's epsilon is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrenchSpace {
    /// Forces alone (`thesis`).
    Force,
    /// Forces and torques.
    Wrench,
}

/// The frame in which position and rotation of the hand are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SearchFrame {
    /// The seed's: origin on the surface, z along the inward normal.
    Seed,
    /// The object's, its origin moved to the centre of its box (`thesis`).
    Object,
}

/// Range of eigengrasp amplitudes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AmplitudeRange {
    /// Range that the joints allow.
    Joints,
    /// From minus to plus this, joints held at their limits beyond (`thesis`).
    Clamped(f64),
}

/// Simulated annealing (Ingber 1989).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Annealing {
    /// Steps of a run, at least 1.
    pub steps: u32,
    /// Energy to be minimised.
    pub energy: EnergyKind,
    /// The space of the potential.
    pub space: WrenchSpace,
    /// Friction coefficient of the potential, above 0.
    pub friction: f64,
    /// The potential is multiplied by this, so that temperatures mean the same for both energies.
    pub potential_scale: f64,
    /// Whether the schedule is stretched over the steps, so that short runs also end cold; otherwise (`thesis`) step i
    /// has the temperature of k = 30,000 + i for every number of steps.
    pub whole_schedule: bool,
    /// Only what lowers the energy is accepted: for comparison.
    pub descent: bool,
    /// Where the hand is searched for.
    pub frame: SearchFrame,
    /// Range of the amplitudes.
    pub amplitudes: AmplitudeRange,
    /// Length of the best list.
    pub best: u32,
    /// A seed is given up after this many steps in a row without a legal neighbour.
    pub max_failures: u32,
}

/// Which grasps are kept, and by which contact model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keeping {
    /// Friction coefficient of the quality, above 0.
    pub friction: f64,
    /// Edges of the friction cone, at least 3.
    pub edges: u32,
    /// Makes soft fingers of the contacts: their greatest torque about the normal for a unit of normal force [m]; `None` for
    /// hard points.
    pub torsion: Option<f64>,
    /// The space in which force closure is required.
    pub space: WrenchSpace,
    /// Smallest accepted epsilon in that space.
    pub min_epsilon: f64,
    /// Largest distance that the hand may come along its approach before it closes, until it meets the object [m].
    pub advance: f64,
    /// Deepest overlap of hand and true mesh before closing [m].
    pub max_penetration: f64,
    /// Whether a grasp is kept only where the hand stays above the table in one of the object's resting poses at least.
    pub table: bool,
}

/// Sampler of the hand's states.
#[derive(Clone, Debug, PartialEq)]
pub enum Sampler {
    /// Simulated annealing searches for them.
    Annealing,
    /// Approaches all round an axis.
    Uniform(Uniform),
    /// Hands on pairs of points on opposite sides of the object.
    Antipodal(Antipodal),
    /// Preshaped hands that come along the normals of the object's surface.
    Approach(ApproachDraws),
}

/// Approaches all round an axis, at right angles to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Uniform {
    /// Grasps of a run, at least 1.
    pub grasps: u32,
    /// Rolls of the hand about its approach, which grasps take one after another.
    pub rolls: Rolls,
    /// Whether the axis is the object's z axis, at a separate height for each run; otherwise it has any direction.
    pub upright: bool,
}

/// Rolls about an approach [rad], at least one: at 0 the approach frame's x axis is level, to the right along the approach.
#[derive(Clone, Debug, PartialEq)]
pub struct Rolls(pub Vec<f64>);

impl Rolls {
    /// Roll of a grasp, by its number.
    pub fn roll_of(&self, grasp: u32) -> f64 {
        self.0[grasp as usize % self.0.len()]
    }
}

/// Hands on pairs of points on opposite sides of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Antipodal {
    /// Pairs that a run draws at most, at least 1.
    pub pairs: u32,
    /// The line between two points is within the friction cones of this coefficient, above 0.
    pub friction: f64,
    /// Largest number of states that a run returns, at least 1.
    pub best: u32,
    /// Hold of the hand on a pair.
    pub hold: PairHold,
}

/// Preshaped hands that come along approaches near the normals of the object's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApproachDraws {
    /// Approaches that a run draws at most, at least 1.
    pub draws: u32,
    /// Largest angle between an approach and the inward normal of its point [rad], 0 to below pi / 2.
    pub cone: f64,
    /// The line between the two sides is within the friction cones of this coefficient, above 0.
    pub friction: f64,
    /// Largest number of states that a run returns, at least 1.
    pub best: u32,
}

/// Hold of a hand on a pair of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairHold {
    /// Half way along the pads of a gripper, from any side; the hand then comes on to the object, and states of low energy are returned.
    Middle,
    /// Anywhere along its fingers; the hand stays where it is.
    Along(Support),
}

/// Support of an object while a hand takes hold of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// Nothing: the hand may come from below, too.
    Air,
    /// A table, over which the hand stays by a margin, in one of the object's resting poses.
    Table {
        /// Least clearance of the hand over the table [m].
        margin: f64,
        /// Resting pose of the object in each run.
        resting: RestingChoice,
    },
}

/// Choice of the resting pose in which an object lies during a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestingChoice {
    /// Drawn for each run, by the poses' probabilities.
    Drawn,
    /// The most probable one, in every run.
    Likeliest,
}
