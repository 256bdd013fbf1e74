//! Trials: the hand-written encoder against the generated one, and what is refused.

use nalgebra::Vector3;
use prost::Message;

use super::*;
use crate::codec::proto;
use kernel::{
    geom::Pose,
    ids::{Digest, ItemId, ObjectId, SampleId},
    words::GraspVerdict,
};

fn outcome(verdict: TrialVerdict) -> TrialOutcome {
    TrialOutcome {
        verdict,
        time: 2.5,
        closing_time: 0.5,
        closed_at_rest: true,
        penetration: [0.0, 2e-4, 3e-4],
        farthest: 1e-3,
        slips: vec![[1e-4, 0.01], [2e-4, 0.0]],
        force: 30.0,
        links: 3,
        opened_by: 0.0,
        drawn_back: 5e-4,
        warnings: 0,
    }
}

fn series() -> TrialSeries {
    TrialSeries {
        samples: vec![2, 1, 0],
        links: vec![0, 2],
        forces: vec![0.0, 1.5, 2.5, 0.0, 0.25, 4.0],
        moved: vec![0.0, 1e-3, 2e-3],
        turned: vec![0.0, 0.1, 0.0],
    }
}

/// A grasp with its trial in the air alone.
fn tried_once(grasp: u32, outcome: TrialOutcome) -> GraspTrial {
    GraspTrial {
        grasp,
        outcome,
        closed: None,
        perturbed: vec![],
        roll_outs: [0; 2],
        variants: vec![],
        table: None,
        confirmed: vec![],
        is_unconfirmed: false,
        series: None,
    }
}

fn trials() -> GraspTrials {
    let contact = PressedContact {
        link: 2,
        point: [0.1, 0.0, -0.2],
        normal: Vector3::new(1.0, 2.0, -0.5).normalize().into(),
        distance: -1e-4,
        force: 12.0,
    };
    let closed = ClosedHand {
        joints: vec![0.5, 0.0],
        object_from_base: Pose::from_xyz_rpy([0.1, 0.2, 0.3, -0.4, 0.5, 0.6]),
        contacts: vec![contact, PressedContact { link: 0, ..contact }],
    };
    let perturbed = PerturbedTrial {
        friction: 0.4,
        mass: 0.3,
        shift: [1e-3, 0.0, -1e-3],
        turn: [0.0, 0.01, 0.0],
        outcome: outcome(TrialVerdict::LostShaking),
    };
    let refused = TrialOutcome { slips: vec![], ..outcome(TrialVerdict::StartsTooDeep) };
    GraspTrials {
        sample: SampleId::of_object(ObjectId(Digest([7; 32])), ItemId(3)),
        hand: "hand".to_owned(),
        links: ["palm", "finger", "tip"].map(str::to_owned).to_vec(),
        joints: 2,
        method: TrialMethod {
            friction: 0.5,
            torsion: 0.002,
            mass: 0.35,
            mass_from: "table".to_owned(),
            mass_source: "scales".to_owned(),
            gravity: "lifted".to_owned(),
            spreads: [0.2, 0.1, 0.001, 0.0175],
            tried: TriedStates::Closed,
            variants: vec!["free".to_owned(), "heavy".to_owned()],
            table_friction: Some(0.4),
            series_interval: Some(0.02),
            confirm_held: vec!["slippery".to_owned(), "free".to_owned()],
            confirm_failed: vec!["rough".to_owned()],
            failed_per_held: Some(0.5),
        },
        trials: vec![
            GraspTrial {
                grasp: 1,
                outcome: outcome(TrialVerdict::Held),
                closed: Some(closed),
                perturbed: vec![perturbed],
                roll_outs: [16, 12],
                variants: vec![TrialVerdict::Held, TrialVerdict::LetGo],
                table: Some(TableTrial {
                    resting_pose: 2,
                    outcome: outcome(TrialVerdict::LostLifting),
                    series: Some(series()),
                }),
                confirmed: vec![],
                is_unconfirmed: false,
                series: Some(TrialSeries {
                    samples: vec![0; 3],
                    links: vec![],
                    forces: vec![],
                    moved: vec![],
                    turned: vec![],
                }),
            },
            tried_once(4, refused),
            GraspTrial { is_unconfirmed: true, ..tried_once(6, outcome(TrialVerdict::LostLifting)) },
        ],
    }
}

#[test]
fn trials_read_back_and_have_the_generated_encoders_bytes() {
    let mut payload = Vec::new();
    trials().encode(&mut payload);
    assert_eq!(GraspTrials::decode(&payload), Ok(trials()));
    let generated = proto::GraspTrials::decode(payload.as_slice()).unwrap();
    assert_eq!(generated.encode_to_vec(), payload);
    assert_eq!(trials().facts(), TrialFacts { tried: 3, held: 1, refused: 1, tried_on_table: 1, held_on_table: 0 });
    assert_eq!((trials().trials[0].success(), trials().trials[0].turned()), (Some(0.75), 1));
    assert_eq!(trials().trials[1].success(), None);
    assert_eq!([0, 1].map(|index| trials().trials[index].is_robust()), [Some(false), None]);
    let lies: [fn(&mut proto::GraspTrials); 34] = [
        |trials| trials.trials[0].label = 2,
        |trials| trials.trials[0].confirmed.push(0),
        |trials| trials.trials[1].confirmed.push(0),
        |trials| trials.sample = None,
        |trials| trials.joints = 3,
        |trials| trials.mass = 0.0,
        |trials| trials.mass_from = "scales".to_owned(),
        |trials| trials.gravity = "up".to_owned(),
        |trials| trials.shift_spread = f64::NAN,
        |trials| trials.trials.swap(0, 1),
        |trials| trials.trials[0].links[0] = 3,
        |trials| trials.trials[0].normals[0] = 0.0,
        |trials| trials.trials[0].forces.push(1.0),
        |trials| trials.trials[0].roll_outs_held = 17,
        |trials| trials.trials[1].outcome.as_mut().unwrap().verdict = 10,
        |trials| trials.trials[0].perturbed[0].shift.push(0.0),
        |trials| trials.tried = "all".to_owned(),
        |trials| trials.trials[0].variants.push(0),
        |trials| trials.trials[0].variants[0] = 10,
        |trials| trials.table_friction.clear(),
        |trials| trials.table_friction.push(0.5),
        |trials| trials.trials[0].table.as_mut().unwrap().outcome = None,
        |trials| trials.trials[0].unconfirmed = true,
        |trials| trials.trials[2].unconfirmed = false,
        |trials| trials.failed_per_held.clear(),
        |trials| trials.failed_per_held.push(1.0),
        |trials| trials.failed_per_held[0] = -1.0,
        |trials| trials.series_interval = 0.0,
        |trials| trials.series_interval = -0.02,
        |trials| trials.trials[0].series.as_mut().unwrap().samples.push(0),
        |trials| series_of(trials).samples[2] = 1,
        |trials| series_of(trials).links.swap(0, 1),
        |trials| series_of(trials).links[1] = 3,
        |trials| series_of(trials).forces[1] = f32::NAN,
    ];
    for (number, lie) in lies.into_iter().enumerate() {
        let mut lying = generated.clone();
        lie(&mut lying);
        assert!(GraspTrials::decode(&lying.encode_to_vec()).is_err(), "lie {number}");
    }
    let [open, low, kept] = [GraspVerdict::OpenHand, GraspVerdict::LowQuality, GraspVerdict::Kept];
    let mut tried = trials();
    assert!(tried.check_beside(&[open, low, open, open, kept, open, low], 3).is_ok());
    assert!(tried.check_beside(&[open, low, open, open, kept, open, low], 2).is_err());
    assert!(tried.check_beside(&[open, low, open, open, kept], 3).is_err());
    assert!(tried.check_beside(&[low, open, open, open, kept, open, low], 3).is_err());
    tried.method.tried = TriedStates::Kept;
    assert!(tried.check_beside(&[open, low, open, open, kept, open, low], 3).is_err());
    assert!(tried.check_beside(&[low, kept, low, open, kept, low, kept], 3).is_ok());
}

fn series_of(trials: &mut proto::GraspTrials) -> &mut proto::TrialSeries {
    trials.trials[0].table.as_mut().unwrap().series.as_mut().unwrap()
}

#[test]
fn moments_of_a_series_know_phase_and_forces() {
    let series = series();
    let moments: Vec<_> = series.moments().collect();
    let phases: Vec<&str> = moments.iter().map(|moment| trial_phases("lifted")[moment.phase]).collect();
    assert_eq!(phases, ["closing", "closing", "lift"]);
    let expected = SeriesMoment { phase: 1, number: 2, forces: &[0.25, 4.0], moved: 2e-3, turned: 0.0 };
    assert_eq!(moments[2], expected);
    assert_eq!((trial_phases("lifted").len(), trial_phases("six").len()), (3, 7));
}

/// Labels follow from all trials together: the first verdict, that on a table, the perturbed ones, the confirmations, and the
/// depth of the start.
#[test]
fn labels_are_what_all_trials_say_together() {
    use GraspLabel::{Borderline, Failed, Held, Unconfirmed, Untested};
    use TrialVerdict::{LetGo, LostLifting, LostShaking, StartsTooDeep, Unstable};
    let trial = |first: TrialVerdict, table: Option<TrialVerdict>, confirmed: &[TrialVerdict], start: f64| {
        let mut trial = trials().trials.swap_remove(0);
        trial.outcome = TrialOutcome { penetration: [start, 0.0, 0.0], ..outcome(first) };
        trial.table = table.map(|verdict| TableTrial { resting_pose: 0, outcome: outcome(verdict), series: None });
        trial.confirmed = confirmed.to_vec();
        trial.perturbed.clear();
        trial
    };
    let held = TrialVerdict::Held;
    for (first, table, confirmed, start, expected) in [
        (held, None, &[][..], 0.0, Held),
        (held, Some(held), &[held, held], 4e-4, Held),
        (held, Some(held), &[held, LostShaking], 0.0, Borderline),
        (held, Some(LetGo), &[], 0.0, Borderline),
        (held, Some(StartsTooDeep), &[held], 0.0, Held),
        (LostLifting, Some(LetGo), &[LostLifting], 0.0, Failed),
        (LostLifting, None, &[held], 0.0, Borderline),
        (LostLifting, Some(held), &[], 0.0, Borderline),
        (held, Some(held), &[held], 6e-4, Untested),
        (StartsTooDeep, Some(held), &[], 2e-3, Untested),
        (Unstable, None, &[], 0.0, Untested),
    ] {
        let label = trial(first, table, confirmed, start).label();
        assert_eq!(label, expected, "{first:?} {table:?} {confirmed:?} {start}");
    }
    for (first, perturbed, expected) in [
        (held, held, Held),
        (held, LostLifting, Borderline),
        (LetGo, held, Borderline),
        (LetGo, LostLifting, Failed),
        (LetGo, StartsTooDeep, Failed),
    ] {
        let mut trial = trial(first, None, &[first], 0.0);
        let run = trials().trials[0].perturbed[0].clone();
        trial.perturbed = vec![PerturbedTrial { outcome: outcome(perturbed), ..run }];
        assert_eq!(trial.label(), expected, "{first:?}, perturbed {perturbed:?}");
        trial.is_unconfirmed = expected == Failed;
        let expected = if trial.is_unconfirmed { Unconfirmed } else { expected };
        assert_eq!(trial.label(), expected, "{first:?}, perturbed {perturbed:?}, and no further");
    }
}
