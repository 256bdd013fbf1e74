//! Grasps of an object that was completed or is known, ranked: a portfolio of samplers and searches within a budget of counted work.
//!
//! A plan runs in rounds. In each, three members propose states of the hand: a sampler (pairs of pads for grippers, approaches along
//! normals for hands with several fingers), annealing from the sampler's states, and annealing from seeds on the surface. States are
//! rated in the order of their rank, and only until the list is full. The next round's work is shared by the members in proportion to
//! the distinct grasps that each gave per unit of work, with a floor of a tenth. Every state that is lost has a named reason, and
//! the counts add up. The result depends on the inputs alone: not on threads, and not on a clock.

mod funnel;
mod inputs;
mod member;
mod object;
mod order;
mod ranked;
mod score;
mod shares;
mod solve;
#[cfg(test)]
mod tests;
mod workers;

pub use funnel::{Funnel, FunnelEnd};
pub use inputs::{
    HeatmapInput, MotionStage, MotionVerdict, PlanCamera, PlanInputs, PlanReach, PlanSettings, Ranking, SearchEnergy,
};
pub use member::Member;
pub use object::{PlanObject, UnplannableObject};
pub use ranked::{GraspPlan, RankedEnergies, RankedGrasp, RoundReport};
pub use solve::{UnplannableHand, plan_grasps};
