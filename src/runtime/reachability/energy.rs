//! Grasp energy of the thesis with a reachability term (algorithm 5).

/// Formula of the energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EnergyForm {
    /// Potential + 0.1 d for stable grasps within reach, contact + 10 d for all others: it falls monotonically from far
    /// outside to deep inside.
    Falling,
    /// Formula as printed: -0.1, 1 and -10 before a value that is negative inside. These factors suit a field that is positive
    /// inside: with this sign the energy rises with depth, and poses far outside are best. Kept as a named quirk.
    Printed {
        /// The largest value of the field [cells], `reach_max`.
        reach_max: f64,
    },
}

/// Energy of a grasp; lower is better.
///
/// `potential` is below zero for a stable grasp; `contact` is the mean distance of the hand to the object; `distance` is
/// the field's value at the grasp's pose, negative inside, in cells (divide metres by the side of a cell).
pub fn grasp_energy(form: EnergyForm, potential: f64, contact: f64, distance: f64) -> f64 {
    let (stable, reachable) = (potential < 0.0, distance < 0.0);
    match form {
        EnergyForm::Falling if stable && reachable => potential + 0.1 * distance,
        EnergyForm::Falling => contact + 10.0 * distance,
        EnergyForm::Printed { .. } if stable && reachable => potential - 0.1 * distance,
        EnergyForm::Printed { reach_max } if reachable => contact + (reach_max - distance),
        EnergyForm::Printed { .. } => contact - 10.0 * distance,
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
            assert!(along(EnergyForm::Falling, potential).is_sorted_by(|before, after| before > after));
        }
    }

    #[test]
    fn the_printed_form_rises_and_jumps() {
        let energies = along(EnergyForm::Printed { reach_max: 10.55 }, -0.2);
        assert!(energies[..1000].is_sorted_by(|before, after| before < after), "outside");
        assert!(energies[1060..].is_sorted_by(|before, after| before < after), "inside");
        let unstable = along(EnergyForm::Printed { reach_max: 10.55 }, 1.0);
        assert!(unstable[1060] > unstable[1040] + 10.0, "the second branch jumps up on entering");
    }
}
