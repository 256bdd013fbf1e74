//! Hands closed by kinematics alone, against MuJoCo and parry.

use std::sync::Arc;

use graspmill::{
    geom::MeshQuery,
    grasp::TOUCHES,
    sim::{HandSim, HandWorker, RunEnd},
    words::GraspVerdict,
};

use super::{QUICK, Searcher};

/// Contacts are on the mesh, as near to the links as closing guarantees.
#[test]
fn contacts_lie_on_the_mesh() {
    let searcher = Searcher::new("mug-01@16k");
    let query = MeshQuery::new(&searcher.mesh).expect("a surface");
    let mut count = 0;
    for grasp in searcher.runs(&QUICK, 6).iter().flat_map(|run| &run.grasps) {
        for contact in &grasp.contacts {
            let off = (query.closest_point(&contact.point) - contact.point).norm();
            assert!(off < 1e-6, "{off} m");
            assert!(contact.distance < 2.0 * TOUCHES && contact.distance > -5.1e-4, "{contact:?}");
            count += 1;
        }
    }
    assert!(count > 100, "{count} contacts");
}

/// MuJoCo closes the hand by motors and contact forces. Fingers that meet the object straight end where kinematics has them.
#[test]
fn fingers_end_where_mujoco_has_them() {
    let searcher = Searcher::new("can-01");
    let sim = Arc::new(HandSim::with_mesh(&searcher.model, &searcher.surface).expect("a simulation"));
    let mut worker = HandWorker::new(&sim);
    let mut off = Vec::new();
    for grasp in searcher.runs(&QUICK, 6).iter().flat_map(|run| &run.grasps) {
        if grasp.verdict == GraspVerdict::Penetrates {
            continue;
        }
        let frames = searcher.hand.link_frames(&searcher.hand.posture_values(&grasp.posture));
        let base_from_object = searcher.hand.approach_pose(&frames).isometry() * grasp.object_from_approach.inverse();
        worker.start(&grasp.posture, &base_from_object).expect("a posture");
        let run = worker.close(3000);
        if run.end != RunEnd::AtRest {
            continue;
        }
        for name in ["proximal_1", "proximal_2", "proximal_3", "distal_1", "distal_2", "distal_3"] {
            let joint = searcher.hand.tree().joint_named(name).expect("a joint");
            off.push((run.joints[joint] - grasp.joints[joint]).abs().to_degrees());
        }
    }
    off.sort_by(f64::total_cmp);
    let at = |share: f64| off[((off.len() - 1) as f64 * share) as usize];
    println!("{} joints: off by {:.3} deg median, {:.2} at 80 %, {:.1} at 95 %", off.len(), at(0.5), at(0.8), at(0.95));
    assert!(off.len() > 200 && at(0.5) < 0.5, "median {}", at(0.5));
}
