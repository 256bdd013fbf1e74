//! From the world of the files to the scene's: the table is the plane z = 0 with the bodies in its middle, or the container is
//! where it is.

use nalgebra::{Point3, Vector3};

use super::{Import, ImportedScene, SourceFrame};
use kernel::geom::{Frame, Object, Pose, SourceWorld, World, rotation_from_quaternion, upright};

/// The world of the files in the scene's, and the bodies in the scene. `corners` are those of each body's convex hull [m].
///
/// A table's normal becomes z by the smallest rotation. The origin is on the table, below the middle of the box around
/// all bodies. In a container bodies stay at the poses of the files.
pub(in super::super) fn place(
    import: &Import,
    scene: &ImportedScene,
    corners: &[&[Point3<f64>]],
) -> (Pose<World, SourceWorld>, Vec<Pose<World, Object>>) {
    let world_from_source = match import.frame {
        SourceFrame::Table { up, height } => world_of_table(up, height, scene, corners),
        SourceFrame::Container { pose } => listed::<SourceWorld, World>(&pose).inverse(),
    };
    (world_from_source, scene.bodies.iter().map(|body| world_from_source * listed(&body.pose)).collect())
}

/// The world of the files in that of a scene on a table.
fn world_of_table(
    up: [f64; 3],
    height: Option<f64>,
    scene: &ImportedScene,
    corners: &[&[Point3<f64>]],
) -> Pose<World, SourceWorld> {
    let rotation = upright(&Vector3::from(up).normalize());
    let turned = Pose::<World, SourceWorld>::new(rotation, Vector3::zeros());
    let poses: Vec<Pose<World, Object>> = scene.bodies.iter().map(|body| turned * listed(&body.pose)).collect();
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for (pose, corners) in poses.iter().zip(corners) {
        for corner in *corners {
            let corner = pose.point(corner).coords;
            (low, high) = (low.inf(&corner), high.sup(&corner));
        }
    }
    let table = height.unwrap_or(low.z);
    Pose::new(rotation, -Vector3::new(f64::midpoint(low.x, high.x), f64::midpoint(low.y, high.y), table))
}

/// A pose of position and quaternion.
fn listed<To: Frame, From: Frame>([x, y, z, qx, qy, qz, qw]: &[f64; 7]) -> Pose<To, From> {
    Pose::new(rotation_from_quaternion([*qw, *qx, *qy, *qz]), Vector3::new(*x, *y, *z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::products::scenes::import::ImportedBody;
    use kernel::words::Split;

    fn import(up: [f64; 3], height: Option<f64>) -> (Import, ImportedScene) {
        in_frame(SourceFrame::Table { up, height })
    }

    fn in_frame(frame: SourceFrame) -> (Import, ImportedScene) {
        let body = |x: f64, z: f64| ImportedBody { object: "cube".to_owned(), pose: [x, 0.3, z, 0.0, 0.0, 0.0, 1.0] };
        let scene = ImportedScene { source: "one".to_owned(), bodies: vec![body(1.0, 0.25), body(1.2, 0.26)] };
        (Import { scenes: vec![scene.clone()], split: Split::Test, frame }, scene)
    }

    fn cube() -> Vec<Point3<f64>> {
        (0..8).map(|k| Point3::from([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { -0.05 } else { 0.05 }))).collect()
    }

    #[test]
    fn the_lowest_point_or_the_stated_height_lies_on_the_table() {
        let cube = cube();
        for (up, height, expected) in [
            ([0.0, 0.0, 2.0], None, [[-0.1, 0.0, 0.05], [0.1, 0.0, 0.06]]),
            ([0.0, 0.0, 1.0], Some(0.1), [[-0.1, 0.0, 0.15], [0.1, 0.0, 0.16]]),
        ] {
            let (import, scene) = import(up, height);
            let (world_from_source, poses) = place(&import, &scene, &[&cube, &cube]);
            for ((pose, expected), body) in poses.iter().zip(expected).zip(&scene.bodies) {
                assert!((pose.translation() - Vector3::from(expected)).norm() < 1e-12, "{pose:?}");
                assert!(
                    (world_from_source.point(&Point3::from_slice(&body.pose[..3])) - pose.translation()).coords.norm()
                        < 1e-12
                );
            }
        }
    }

    #[test]
    fn a_table_may_face_any_way() {
        let cube = cube();
        // A camera that looks along the table: its y points down.
        let (import, scene) = import([0.0, -1.0, 0.0], None);
        let (world_from_source, poses) = place(&import, &scene, &[&cube, &cube]);
        assert!(((world_from_source.rotation() * -Vector3::y()) - Vector3::z()).norm() < 1e-12);
        assert!(poses.iter().all(|pose| (pose.translation().z - 0.05).abs() < 1e-12), "{poses:?}");
        let apart = poses[1].translation() - poses[0].translation();
        assert!((apart.norm() - 0.2_f64.hypot(0.01)).abs() < 1e-12);
    }

    #[test]
    fn a_container_stays_where_the_files_have_it() {
        let cube = cube();
        let (import, scene) = in_frame(SourceFrame::Container { pose: SourceFrame::SAME });
        let (_, poses) = place(&import, &scene, &[&cube, &cube]);
        for (pose, body) in poses.iter().zip(&scene.bodies) {
            assert_eq!(*pose.translation(), Vector3::new(body.pose[0], body.pose[1], body.pose[2]));
        }
        // Its x points along y of the files.
        let half = 0.5_f64.sqrt();
        let pose = [1.0, 0.3, 0.2, 0.0, 0.0, half, half];
        let (import, scene) = in_frame(SourceFrame::Container { pose });
        let (world_from_source, poses) = place(&import, &scene, &[&cube, &cube]);
        for (pose, expected) in poses.iter().zip([[0.0, 0.0, 0.05], [0.0, -0.2, 0.06]]) {
            assert!((pose.translation() - Vector3::from(expected)).norm() < 1e-12, "{pose:?}");
        }
        assert!(world_from_source.point(&Point3::from_slice(&pose[..3])).coords.norm() < 1e-12);
    }
}
