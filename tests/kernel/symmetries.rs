//! Symmetries of scans, against the kind of thing that was scanned, and with a surface that the library did not search.

use graspmill::{assets::MeshSource, geom::MeshQuery, object::PreparedObject};
use nalgebra::{Matrix3, Point3};

use crate::support::meshes::scan_file;

#[test]
fn scans_have_the_symmetries_of_what_was_scanned() {
    for (name, group, mirrors) in [
        ("055_baseball", "K", 0),
        ("024_bowl", "Cinf", 0),
        ("007_tuna_fish_can", "Dinf", 1),
        ("036_wood_block", "D4", 5),
        ("009_gelatin_box", "D2", 3),
        ("025_mug", "C1", 0),
        ("011_banana", "C1", 1),
    ] {
        let file = scan_file(name);
        let object = PreparedObject::prepare(&MeshSource::of_file(name, &file)).expect("a sound scan");
        let found = object.symmetries().expect("a solid");
        assert_eq!((found.group().as_str(), found.mirrors.len()), (group, mirrors), "{name}: {found:?}");
        // The vertices, which the search did not use, also satisfy the claimed symmetry.
        let surface = MeshQuery::new(object.mesh()).expect("a surface");
        let reflections =
            found.mirrors.iter().map(|normal| Matrix3::identity() - normal.into_inner() * normal.transpose() * 2.0);
        for map in found.rotations().into_iter().chain(reflections) {
            let vertices = object.mesh().vertices.iter().step_by(23);
            let distances: Vec<f64> = vertices
                .map(|vertex| found.centre + map * (Point3::from(vertex.map(f64::from)) - found.centre))
                .map(|moved| surface.distance(&moved))
                .collect();
            let near = distances.iter().filter(|distance| **distance <= found.tolerance).count();
            assert!(near as f64 > 0.93 * distances.len() as f64, "{name}: {near} of {} by {map}", distances.len());
        }
    }
}
