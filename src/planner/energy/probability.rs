//! Probabilities by which a list of grasps is ranked.

/// Probability that a grasp can be reached, by the distance d from the border of the reachable set [cells], negative inside:
/// 1 / (1 + exp(slope (d + shift))).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReachModel {
    /// Per cell.
    pub slope: f64,
    /// Depth inside at which the probability is a half, below 0 for a point outside [cells].
    pub shift: f64,
}

impl ReachModel {
    /// A Fetch on 1,200 random poses with a table, truth by inverse kinematics free of collisions.
    pub const FETCH: Self = Self { slope: 8.5, shift: 0.07 };

    /// The probability at a distance [cells]; 0 where it is NaN.
    pub fn probability(&self, distance: f64) -> f64 {
        if distance.is_nan() { 0.0 } else { logistic(-self.slope * (distance + self.shift)) }
    }
}

/// Probability that a grasp holds in a trial, by its epsilon: 1 / (1 + exp(-(intercept + slope epsilon))). Fit it on the trials of a
/// dataset of the same hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldModel {
    /// Logit at epsilon 0.
    pub intercept: f64,
    /// Logit per unit of epsilon.
    pub slope: f64,
}

impl HeldModel {
    /// The probability of an epsilon.
    pub fn probability(&self, epsilon: f64) -> f64 {
        logistic(self.intercept + self.slope * epsilon)
    }
}

fn logistic(logit: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-logit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_are_logistic() {
        let model = ReachModel::FETCH;
        assert!((model.probability(-0.07) - 0.5).abs() < 1e-12);
        assert!(model.probability(-0.75) > 0.99 && model.probability(1.0) < 1e-3);
        assert_eq!(model.probability(f64::NAN), 0.0);
        assert_eq!(model.probability(f64::INFINITY), 0.0);
        let held = HeldModel { intercept: -1.0, slope: 20.0 };
        assert!((held.probability(0.05) - 0.5).abs() < 1e-12 && held.probability(0.2) > 0.9);
    }
}
