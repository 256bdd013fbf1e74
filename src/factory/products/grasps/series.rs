//! From a trial over time to a record.

use format::TrialSeries;
use sim::{Gravity, Phase, Series};

/// The record of a series under a gravity: links that never press are left out, numbers are rounded to single precision.
pub(super) fn recorded_series(series: &Series, gravity: Gravity) -> TrialSeries {
    let phases = match gravity {
        Gravity::Lifted => 3,
        Gravity::Six => 7,
    };
    let mut counts = vec![0; phases];
    for sample in &series.samples {
        counts[phase_index(sample.phase)] += 1;
    }
    let links = series.samples.first().map_or(0, |sample| sample.forces.len());
    let presses = |link: &usize| series.samples.iter().any(|sample| sample.forces[*link] > 0.0);
    let links: Vec<usize> = (0..links).filter(presses).collect();
    let forces = series.samples.iter().flat_map(|sample| links.iter().map(|link| sample.forces[*link] as f32));
    TrialSeries {
        samples: counts,
        forces: forces.collect(),
        links: links.iter().map(|link| *link as u32).collect(),
        moved: series.samples.iter().map(|sample| sample.moved as f32).collect(),
        turned: series.samples.iter().map(|sample| sample.turned as f32).collect(),
    }
}

/// Index of a phase in the names that records have for it.
pub(super) fn phase_index(phase: Phase) -> usize {
    match phase {
        Phase::Closing => 0,
        Phase::Lift => 1,
        Phase::Shake => 2,
        Phase::Turned(direction) => 1 + usize::from(direction),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use format::trial_phases;
    use sim::SeriesSample;

    #[test]
    fn links_that_never_press_are_left_out_and_phases_are_counted() {
        let sample = |phase: Phase, forces: [f64; 3], moved: f64| {
            let forces = forces.to_vec();
            SeriesSample { phase, forces, moved, turned: 2.0 * moved }
        };
        let samples = [
            sample(Phase::Closing, [0.0, 0.0, 0.0], 0.0),
            sample(Phase::Closing, [0.0, 0.0, 3.0], 0.5),
            sample(Phase::Lift, [1.0, 0.0, 2.0], 0.25),
        ];
        let mut series = Series::default();
        series.samples.extend(samples);
        let record = recorded_series(&series, Gravity::Lifted);
        assert_eq!((record.samples.as_slice(), record.links.as_slice()), (&[2, 1, 0][..], &[0, 2][..]));
        assert_eq!(record.forces, [0.0, 0.0, 0.0, 3.0, 1.0, 2.0]);
        assert_eq!((record.moved, record.turned), (vec![0.0, 0.5, 0.25], vec![0.0, 1.0, 0.5]));
        // A trial that was refused has no samples, and a phase for each name.
        for (gravity, name) in [(Gravity::Lifted, "lifted"), (Gravity::Six, "six")] {
            let empty = recorded_series(&Series::default(), gravity);
            assert_eq!(empty.samples, vec![0; trial_phases(name).len()]);
            assert!(empty.links.is_empty() && empty.moved.is_empty());
        }
        assert_eq!(phase_index(Phase::Turned(5)), trial_phases("six").len() - 1);
    }
}
