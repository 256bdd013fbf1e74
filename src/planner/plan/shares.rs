//! Shares of the members in the work of the next round.

/// Smallest share of a member.
const FLOOR: f64 = 0.1;

/// Members of the portfolio.
pub(super) const MEMBERS: usize = super::member::Member::ALL.len();

/// Shares of the first round: the samplers prepare what annealing starts from.
pub(super) const FIRST: [f64; MEMBERS] = [0.5, 0.25, 0.25];

/// Shares in proportion to the distinct kept grasps per unit of work, none below a tenth; those before where no member had any.
pub(super) fn next_shares(before: [f64; MEMBERS], kept: [u64; MEMBERS], work: [u64; MEMBERS]) -> [f64; MEMBERS] {
    let rates: [f64; MEMBERS] = std::array::from_fn(|member| kept[member] as f64 / work[member].max(1) as f64);
    let sum: f64 = rates.iter().sum();
    if sum == 0.0 {
        return before;
    }
    let free = 1.0 - FLOOR * MEMBERS as f64;
    rates.map(|rate| FLOOR + free * rate / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_follow_the_rates_above_a_floor() {
        let shares = next_shares(FIRST, [30, 10, 0], [1000, 1000, 500]);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((shares[0] - (0.1 + 0.7 * 0.75)).abs() < 1e-12 && (shares[2] - 0.1).abs() < 1e-12, "{shares:?}");
        assert_eq!(next_shares(FIRST, [0; 3], [1000, 0, 10]), FIRST);
    }
}
