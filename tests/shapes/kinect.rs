//! Real Kinect frames from others, against labels of every point.
//!
//! The 45 frames for learning of the Object Segmentation Database (Richtsfeld et al.), from the Point Cloud Library's data. Their
//! labels are 1 for the table and ten times an object's number for the rest, plus a number for each separately visible
//! part.
#![expect(clippy::print_stdout, reason = "figures for the log")]

use std::{env, path::Path};

use graspmill::{
    geom::SimdLevel,
    perception::{FrameRule, NetworkInput, SceneRule, SegmentationScore, SegmentedScene, read_frame, visible_sheet},
};

const FRAMES: std::ops::Range<u32> = 0..45;
/// Smallest label of an object.
const OBJECT: u32 = 20;
/// Intersection over union of an object that is found: an F-score of 0.75.
const FOUND: f64 = 0.6;

/// The folder of samples, or a loud note that it is missing.
fn samples() -> Option<String> {
    let folder = env::var("GRASPMILL_SAMPLES").ok();
    if folder.is_none() {
        println!("SKIPPED: GRASPMILL_SAMPLES names no folder of real frames");
    }
    folder
}

#[test]
fn objects_on_tables_are_found_as_people_labelled_them() {
    let Some(folder) = samples() else { return };
    let (mut objects, mut found, mut merged, mut split) = (0, 0, 0, 0);
    for number in FRAMES {
        let path = Path::new(&folder).join(format!("kinect/mosd_learn{number}.pcd"));
        let read = read_frame(&path, &FrameRule::default()).unwrap_or_else(|error| panic!("{error}"));
        let frame = read.frame;
        // Its makers' driver had a focal length of 525 px, and pixel centres at 0: half a pixel is added.
        let camera = frame.camera;
        for (value, wanted) in [(camera.fx, 525.0), (camera.fy, 525.0), (camera.cx, 320.0), (camera.cy, 240.0)] {
            assert!((value - wanted).abs() < 0.05, "frame {number}: {camera:?}");
        }
        let SegmentedScene { frame, plane, clusters, .. } = SegmentedScene::segment(frame, &SceneRule::default());
        let plane = plane.expect("a table");
        let labels = read.labels.expect("labels");
        let objects_of: Vec<u32> = labels.iter().map(|label| if *label < OBJECT { 0 } else { label / 10 }).collect();
        let score = SegmentationScore::new(&clusters, &objects_of, |pixel| !frame.depth[pixel].is_nan());
        let found_here = score.objects.iter().filter(|object| object.iou >= FOUND).count();
        println!(
            "frame {number}: precision {:.3}, recall {:.3}, F {:.3}; {} objects, {} found, {} merged, {} split, {} spurious",
            score.precision,
            score.recall,
            score.f_score,
            score.objects.len(),
            found_here,
            score.merged,
            score.split,
            score.spurious
        );
        assert!(score.precision > 0.99 && score.recall > 0.9, "frame {number}: {score:?}");
        assert_eq!(score.spurious, 0, "frame {number}");
        objects += score.objects.len();
        found += found_here;
        merged += score.merged;
        split += score.split;
        // Every cluster has a sheet and the grids of a network's input.
        for cluster in &clusters {
            assert!(!visible_sheet(&frame, &cluster.pixels).triangles.is_empty());
            let input = NetworkInput::new(&frame, cluster, Some(&plane), 40, SimdLevel::detect()).expect("grids");
            assert!(input.partial.count() > 0 && input.partial.count_both(&input.free) == 0);
        }
    }
    println!("{found} of {objects} objects found, {merged} merged, {split} split");
    assert!(10 * found >= 9 * objects && 25 * merged <= objects, "{found} of {objects}, {merged} merged");
}

#[test]
fn a_cloud_with_another_camera_axis_is_refused() {
    let Some(folder) = samples() else { return };
    // Its z points backwards.
    let path = Path::new(&folder).join("kinect/milk_cartoon_all_small_clorox.pcd");
    let error = read_frame(&path, &FrameRule::default()).expect_err("a cloud behind the camera");
    assert!(error.to_string().contains("which looks along +z") && error.to_string().contains("give --flip"), "{error}");
    // Mirrored, it is what its camera saw.
    let frame = read_frame(&path, &FrameRule { is_flipped: true, ..FrameRule::default() }).expect("a cloud").frame;
    assert!((frame.camera.fx - 525.0).abs() < 0.5 && (frame.camera.fy - 525.0).abs() < 0.5, "{:?}", frame.camera);
    assert!(SegmentedScene::segment(frame, &SceneRule::default()).clusters.len() >= 3);
}
