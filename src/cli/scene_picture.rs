//! Picture of completed objects: outlines in the camera's view, and solids from two sides.

use std::{f64::consts::PI, sync::Arc};

use kernel::geom::{Shape, TouchShape, TriMesh, Triangles};
use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Vector3};
use publish::picture::{Colour, Picture, Solid, SolidView, solid_picture};
use runtime::completion::SegmentedScene;

/// Largest side of a view [px].
const SIDE: u32 = 480;
const GAP: u32 = 8;
/// Angle of both views above the table [rad].
const ELEVATION: f64 = 0.35;
/// Angles about the table's normal from the camera's side [rad]: from its right, and from behind.
const AZIMUTHS: [f64; 2] = [PI / 3.0, PI];

/// Draws one view from the camera, and two of the meshes only.
pub fn completed_picture(scene: &SegmentedScene, meshes: &[Option<&TriMesh>]) -> Picture {
    let seen = perception::outline_pixels(&scene.frame, &scene.clusters);
    let mut panels = vec![Picture {
        width: scene.frame.camera.width,
        height: scene.frame.camera.height,
        pixels: seen.into_iter().map(|[r, g, b]| [r, g, b, 255]).collect(),
    }];
    let world_from_camera = world_from_camera(scene);
    let shapes: Vec<(TouchShape, Colour)> = meshes
        .iter()
        .enumerate()
        .filter_map(|(index, mesh)| {
            let shape = Shape::Mesh(Arc::new(triangles_of((*mesh)?)));
            Some((TouchShape::new(&shape).ok()?, Colour(perception::cluster_colour(index))))
        })
        .collect();
    let solids: Vec<Solid<'_>> =
        shapes.iter().map(|(shape, colour)| Solid { shape, pose: world_from_camera, colour: *colour }).collect();
    if let Some((middle, extent)) = middle_and_extent(meshes, &world_from_camera) {
        for azimuth in AZIMUTHS {
            // The camera's side is the negative y axis.
            let view = SolidView { azimuth: azimuth - PI / 2.0, elevation: ELEVATION, middle, extent };
            panels.push(solid_picture(&solids, &view, SIDE).framed());
        }
    }
    Picture::row(&panels, GAP)
}

/// A frame with z along the plane's normal, y away from the camera, and its origin at the camera.
fn world_from_camera(scene: &SegmentedScene) -> IsometryMatrix3<f64> {
    // Without a plane, up is the picture's up direction.
    let up = scene.plane.map_or_else(|| -Vector3::y(), |plane| plane.normal);
    let ahead = Vector3::z() - up * up.z;
    // A camera that looks straight down has no defined side.
    let ahead = ahead.try_normalize(1e-6).unwrap_or_else(|| -Vector3::y());
    let right = ahead.cross(&up);
    let rows = Matrix3::from_rows(&[right.transpose(), ahead.transpose(), up.transpose()]);
    IsometryMatrix3::from_parts(Translation3::identity(), Rotation3::from_matrix_unchecked(rows))
}

/// Middle of the meshes' box in the world, and a view length that contains all of it [m].
fn middle_and_extent(
    meshes: &[Option<&TriMesh>],
    world_from_camera: &IsometryMatrix3<f64>,
) -> Option<(Point3<f64>, f64)> {
    let mut points = meshes.iter().flatten().flat_map(|mesh| &mesh.vertices);
    let in_world = |vertex: &[f32; 3]| world_from_camera * Point3::from(vertex.map(f64::from));
    let first = in_world(points.next()?);
    let (low, high) = points.fold((first, first), |(low, high), vertex| {
        let point = in_world(vertex);
        (low.inf(&point), high.sup(&point))
    });
    Some((low + (high - low) / 2.0, 1.1 * (high - low).norm()))
}

fn triangles_of(mesh: &TriMesh) -> Triangles {
    let corners = mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
    Triangles { corners, triangles: mesh.triangles.clone() }
}
