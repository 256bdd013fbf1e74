//! Energy of a grasp with a reachability term (thesis, algorithm 5).

/// Weights of the reachability distance for stable grasps within reach, and for all others.
const WITHIN: f64 = 0.1;
const OUTSIDE: f64 = 10.0;

/// Factor of the potential in [`EnergyForm::Standard`] and in the searches of a plan, as in `robot::grasp`.
pub(crate) const POTENTIAL_SCALE: f64 = 100.0;

/// Depth inside the reachable set [cells] from which more of it is worth nothing: all poses there were reachable.
const DEEP_ENOUGH: f64 = 0.5;

/// Formula of the energy, with the potential e_p, the contact energy E_c [mm] and the distance d from the border of the reachable
/// set [cells], negative inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EnergyForm {
    /// 100 e_p + 0.1 s for stable grasps within reach, E_c + 10 s for all others, with s = max(d, -0.5): half a cell inside, nothing
    /// is gained by leaving the object towards the middle of the workspace.
    Standard,
    /// Algorithm 5 with its signs corrected: e_p + 0.1 d for stable grasps within reach, E_c + 10 d for all others. It falls
    /// monotonically from far outside to deep inside.
    Corrected,
    /// Algorithm 5 as printed: -0.1, 1 and -10 before a value that is negative inside. These factors suit a field that is positive
    /// inside: with this sign the energy rises with depth, and poses far outside are best. Kept as a named quirk.
    Printed {
        /// The largest value of the field [cells], `reach_max`.
        reach_max: f64,
    },
}

/// Energy of a grasp; lower is better. Infinite where `distance` is NaN: such a pose is refused.
///
/// `potential` is below zero for a stable grasp; `contact` is the contact energy [mm]; `distance` is the field's value at the grasp's
/// pose, negative inside, in cells (divide metres by the side of a cell).
///
/// ```
/// use graspmill_planner::energy::{EnergyForm, grasp_energy};
///
/// let energy = |distance| grasp_energy(EnergyForm::Standard, -0.2, 8.0, distance);
/// assert!(energy(-0.3) < energy(0.1) && energy(0.1) < energy(2.0), "a stable grasp is best within reach");
/// assert_eq!(energy(-0.6), energy(-4.0), "half a cell inside is enough");
/// assert_eq!(energy(f64::NAN), f64::INFINITY);
/// ```
pub fn grasp_energy(form: EnergyForm, potential: f64, contact: f64, distance: f64) -> f64 {
    let (stable, reachable) = (potential < 0.0, distance < 0.0);
    let held = distance.max(-DEEP_ENOUGH);
    match form {
        _ if distance.is_nan() => f64::INFINITY,
        EnergyForm::Standard if stable && reachable => POTENTIAL_SCALE * potential + WITHIN * held,
        EnergyForm::Standard => contact + OUTSIDE * held,
        EnergyForm::Corrected if stable && reachable => potential + WITHIN * distance,
        EnergyForm::Corrected => contact + OUTSIDE * distance,
        EnergyForm::Printed { .. } if stable && reachable => potential - WITHIN * distance,
        EnergyForm::Printed { reach_max } if reachable => contact + (reach_max - distance),
        EnergyForm::Printed { .. } => contact - OUTSIDE * distance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(form: EnergyForm, potential: f64) -> Vec<f64> {
        (0..=1250).map(|step| grasp_energy(form, potential, 3.0, 10.5 - 0.01 * f64::from(step))).collect()
    }

    #[test]
    fn energy_falls_from_far_outside_to_deep_inside() {
        for potential in [-5.0, -0.2, 0.0, 4.0] {
            assert!(along(EnergyForm::Corrected, potential).is_sorted_by(|before, after| before > after));
        }
    }

    #[test]
    fn the_standard_form_falls_until_half_a_cell_inside() {
        for potential in [-1.2, -0.2, 0.0, 1.0] {
            let energies = along(EnergyForm::Standard, potential);
            assert!(energies[..1095].is_sorted_by(|before, after| before > after), "{potential}");
            assert!(energies[1101..].iter().all(|energy| *energy == energies[1101]), "{potential}");
        }
        // An unstable hand is paid no more than 5 mm for being within reach.
        assert_eq!(grasp_energy(EnergyForm::Standard, 1.0, 3.0, -40.0), -2.0);
    }

    #[test]
    fn the_printed_form_rises_and_jumps() {
        let energies = along(EnergyForm::Printed { reach_max: 10.55 }, -0.2);
        assert!(energies[..1000].is_sorted_by(|before, after| before < after), "outside");
        assert!(energies[1060..].is_sorted_by(|before, after| before < after), "inside");
        let unstable = along(EnergyForm::Printed { reach_max: 10.55 }, 1.0);
        assert!(unstable[1060] > unstable[1040] + 10.0, "the second branch jumps up on entering");
    }

    #[test]
    fn a_pose_without_a_distance_is_refused() {
        for form in [EnergyForm::Standard, EnergyForm::Corrected, EnergyForm::Printed { reach_max: 4.0 }] {
            for potential in [-0.3, 1.0] {
                assert_eq!(grasp_energy(form, potential, 3.0, f64::NAN), f64::INFINITY);
            }
        }
    }
}
