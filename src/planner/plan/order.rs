//! States that wait for their rating, and the order in which they are rated.

use super::member::{Member, Proposal};

/// A proposed state that waits.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    pub(super) member: Member,
    pub(super) proposal: Proposal,
    /// Probability that it can be reached.
    pub(super) p_reach: f64,
}

/// Sorts waiting states by P(reach) / rank, the rank counted from 1 among those of the same member by energy. Equals stay in the order
/// in which they were proposed.
pub(super) fn sort_by_rank(waiting: &mut Vec<Waiting>) {
    waiting.sort_by(|one, other| one.proposal.energy.total_cmp(&other.proposal.energy));
    let mut ranks = [0u32; Member::ALL.len()];
    let mut keyed: Vec<(f64, Waiting)> = std::mem::take(waiting)
        .into_iter()
        .map(|state| {
            let rank = &mut ranks[state.member as usize];
            *rank += 1;
            (state.p_reach / f64::from(*rank), state)
        })
        .collect();
    keyed.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    waiting.extend(keyed.into_iter().map(|(_, state)| state));
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::IsometryMatrix3;
    use robot::grasp::HandState;

    fn state(member: Member, energy: f64, p_reach: f64) -> Waiting {
        let start = HandState {
            object_from_approach: IsometryMatrix3::identity(),
            posture: Vec::new(),
            amplitudes: Vec::new(),
        };
        Waiting { member, proposal: Proposal { start, energy, rated: None }, p_reach }
    }

    #[test]
    fn members_alternate_and_reach_comes_first() {
        let mut waiting = vec![
            state(Member::FromSeeds, 5.0, 1.0),
            state(Member::FromSeeds, 3.0, 1.0),
            state(Member::Sampler, 90.0, 1.0),
            state(Member::Sampler, 80.0, 0.1),
        ];
        sort_by_rank(&mut waiting);
        let order: Vec<(Member, f64)> = waiting.iter().map(|state| (state.member, state.proposal.energy)).collect();
        // The sampler's better state is likely out of reach.
        let expected =
            [(Member::FromSeeds, 3.0), (Member::FromSeeds, 5.0), (Member::Sampler, 90.0), (Member::Sampler, 80.0)];
        assert_eq!(order, expected);
    }
}
