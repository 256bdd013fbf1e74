//! Inputs of a plan: what is where, what the robot reaches, and how much work may be spent.

use std::{f64::consts::FRAC_PI_2, sync::Arc};

use nalgebra::IsometryMatrix3;

use super::object::PlanObject;
use crate::energy::{ContactEnergy, EnergyForm, HeatmapEnergy, HeldModel, ReachModel};
use kernel::geom::Intrinsics;
use robot::grasp::{
    AmplitudeRange, Annealing, EnergyKind, HandSearch, Keeping, KindDigits, SceneObstacle, SearchFrame, WrenchSpace,
};

/// Energy that the searches minimise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SearchEnergy {
    /// The contact energy, of visible contacts on request; it needs [`PlanInputs::camera`] for those that face it.
    Contact(ContactEnergy),
    /// The potential where it is below 0, else the contact energy (thesis, algorithm 4).
    ContactAndPotential,
    /// Heatmaps and contacts, rho E_h + (1 - rho) E_c (thesis, equation 4.2); it needs [`PlanInputs::heatmaps`] and a camera.
    Combined {
        /// Share of the heatmap energy.
        rho: f64,
        /// The contact energy.
        contact: ContactEnergy,
    },
    /// Contact and potential with reachability (thesis, algorithm 5); it needs [`PlanInputs::reach`].
    Reachability(EnergyForm),
}

/// Order of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ranking {
    /// By expected success, P(reach) P(held).
    Success,
    /// By energy (`thesis`).
    Energy,
}

/// Reachable set of the robot.
#[derive(Clone, Copy)]
pub struct PlanReach<'a> {
    /// Distance from the border of the reachable set [cells], negative inside, of a pose of the map's site, expressed in the map's
    /// frame: x, y, z [m], roll, pitch, yaw [rad]. Divide metres by the side of a cell.
    pub distance: &'a (dyn Fn(&[f64; 6]) -> f64 + Sync),
    /// The scene expressed in the map's frame.
    pub map_from_scene: IsometryMatrix3<f64>,
    /// The map's site expressed in the frame of the hand's base.
    pub base_from_site: IsometryMatrix3<f64>,
    /// From distances to probabilities.
    pub model: ReachModel,
}

/// Camera that saw the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanCamera {
    /// The camera expressed in the scene, z forward, y down (`CameraCv`).
    pub scene_from_camera: IsometryMatrix3<f64>,
    /// Image of the camera.
    pub intrinsics: Intrinsics,
}

/// Heatmaps of a network over the camera's image.
#[derive(Clone, Copy)]
pub struct HeatmapInput<'a> {
    /// Maps, canonical types and weights.
    pub energy: &'a HeatmapEnergy,
    /// Joints that shape the hand.
    pub digits: &'a KindDigits,
    /// Indices of the contacts at the fingertips F0, F1, F2.
    pub tips: [usize; 3],
}

/// Verdict of the motion stage on a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionVerdict {
    /// There is no motion stage.
    NotTested,
    /// A motion was found at this level: 1 inverse kinematics at the grasp, 2 with approach and lift, 3 with a certified joint path.
    Reached(u8),
    /// None was found, by the name of the reason.
    Refused(&'static str),
}

/// Motion stage of the caller: the hand's base where it closes, expressed in the scene, and the posture in which it comes. It is called
/// for grasps that passed every other stage, in the order of their rank.
pub type MotionStage<'a> = &'a (dyn Fn(&IsometryMatrix3<f64>, &[f64]) -> MotionVerdict + Sync);

/// Settings of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanSettings {
    /// Energy of the searches.
    pub energy: SearchEnergy,
    /// Space, friction and scale of the potential, frame and amplitudes of the searches; lengths and `energy` are the plan's own.
    pub annealing: Annealing,
    /// Which grasps are kept, and how the hand closes.
    pub keeping: Keeping,
    /// Order of the list.
    pub ranking: Ranking,
    /// From epsilon to the probability of success.
    pub held: HeldModel,
    /// Distance that the hand keeps from table and neighbours [m], below 10 mm.
    pub margin: f64,
    /// Largest angle between the approach of a sampled pair and straight down [rad], at most a right angle.
    pub half_angle: f64,
    /// Length of the list.
    pub best: usize,
    /// Work that may be spent: one step of a search is the unit, a rating is 250. The last round may exceed it.
    pub budget: u64,
    /// Threads; the result is the same for any number.
    pub threads: usize,
}

impl PlanSettings {
    /// Contact and potential over forces with the settings of jobs for grasps, ranked by success, for a list of 20. The model of
    /// success is a placeholder that orders by epsilon: fit it on trials of the hand.
    pub const STANDARD: Self = Self {
        energy: SearchEnergy::ContactAndPotential,
        annealing: Annealing {
            steps: 10_000,
            energy: EnergyKind::ContactAndPotential,
            space: WrenchSpace::Force,
            friction: 0.2,
            potential_scale: crate::energy::POTENTIAL_SCALE,
            whole_schedule: true,
            descent: false,
            frame: SearchFrame::Seed,
            amplitudes: AmplitudeRange::Joints,
            best: 20,
            max_failures: 100,
        },
        keeping: Keeping {
            friction: 0.5,
            edges: 16,
            torsion: None,
            space: WrenchSpace::Wrench,
            min_epsilon: 0.01,
            advance: 0.03,
            max_penetration: 5e-4,
            table: false,
        },
        ranking: Ranking::Success,
        held: HeldModel { intercept: 0.0, slope: 10.0 },
        margin: 0.002,
        half_angle: FRAC_PI_2,
        best: 20,
        budget: 40_000,
        threads: 1,
    };
}

/// Inputs of a plan. The scene's z axis is up.
#[derive(Clone, Copy)]
pub struct PlanInputs<'a> {
    /// The hand.
    pub hand: &'a Arc<HandSearch>,
    /// The object to grasp.
    pub target: &'a PlanObject,
    /// Pose of the object in the scene.
    pub scene_from_target: IsometryMatrix3<f64>,
    /// Everything else that the hand must not touch.
    pub neighbours: &'a [SceneObstacle],
    /// Height of the table's plane in the scene [m]; `None` without a table.
    pub table: Option<f64>,
    /// Camera that saw the scene.
    pub camera: Option<PlanCamera>,
    /// Heatmaps over its image.
    pub heatmaps: Option<HeatmapInput<'a>>,
    /// Reachable set of the robot.
    pub reach: Option<PlanReach<'a>>,
    /// Motion stage.
    pub motion: Option<MotionStage<'a>>,
    /// Settings.
    pub settings: PlanSettings,
    /// Seed of all random numbers.
    pub seed: u64,
}
