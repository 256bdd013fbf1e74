//! Clouds of coloured points. Foxglove draws them as it draws scenes of solids and arrows; Rerun draws them alone.

use nalgebra::{IsometryMatrix3, Point3, Unit};

use super::{
    foxglove::{self, Color, PackedElementField, PointCloud, packed_element_field::NumericType},
    google::protobuf::Timestamp,
};
use kernel::geom::{HealPix, TouchShape, TriMesh};

/// Points on the surface of an object.
const OBJECT_POINTS: usize = 6000;

/// A cloud in a frame: `data` holds single-precision numbers called `floats` for each point, x, y and z [m] first, then red,
/// green, blue and alpha as bytes.
pub(super) fn coloured_cloud(time: Option<Timestamp>, frame: &str, floats: &[&str], data: Vec<u8>) -> PointCloud {
    let colours = 4 * floats.len() as u32;
    let element = |name: &str, offset, kind: NumericType| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: kind as i32,
    };
    let numbers = floats.iter().zip((0..).step_by(4)).map(|(name, offset)| element(name, offset, NumericType::Float32));
    let bytes = ["red", "green", "blue", "alpha"].iter().zip(colours..);
    PointCloud {
        timestamp: time,
        frame_id: frame.to_owned(),
        pose: Some(foxglove::Pose {
            position: Some(foxglove::Vector3::default()),
            orientation: Some(foxglove::Quaternion { w: 1.0, ..Default::default() }),
        }),
        point_stride: colours + 4,
        fields: numbers.chain(bytes.map(|(name, offset)| element(name, offset, NumericType::Uint8))).collect(),
        data,
    }
}

/// A cloud of points [m] in one colour.
pub(super) fn plain_cloud(
    time: Option<Timestamp>,
    frame: &str,
    points: impl IntoIterator<Item = Point3<f64>>,
    colour: Color,
) -> PointCloud {
    let colour = [colour.r, colour.g, colour.b, colour.a].map(|share| (share * 255.0 + 0.5) as u8);
    let position = |at: Point3<f64>| [at.x, at.y, at.z].into_iter().flat_map(|value| (value as f32).to_le_bytes());
    let data = points.into_iter().flat_map(|at| position(at).chain(colour)).collect();
    coloured_cloud(time, frame, &["x", "y", "z"], data)
}

/// Points spread evenly over the area of a mesh [m].
///
/// Source: M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018, for the points within triangles.
pub(super) fn surface_points(mesh: &TriMesh) -> Vec<Point3<f64>> {
    let areas: Vec<f64> = (0..mesh.triangles.len())
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle);
            0.5 * (b - a).cross(&(c - a)).norm()
        })
        .collect();
    let step = areas.iter().sum::<f64>() / OBJECT_POINTS as f64;
    let (mut points, mut before) = (Vec::with_capacity(OBJECT_POINTS), 0.0);
    for (triangle, area) in areas.iter().enumerate() {
        let [a, b, c] = mesh.corners(triangle);
        before += area;
        // Point k is at the position where the area before it is k and a half steps.
        while step > 0.0 && (points.len() as f64 + 0.5) * step <= before {
            let number = points.len() as f64;
            let [mut u, mut v] =
                [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|way| (0.5 + number * way).fract());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

/// Points on a solid [m] placed in a frame: where rays from all round towards its middle meet it.
pub(super) fn solid_points(shape: &TouchShape, pose: &IsometryMatrix3<f64>) -> Vec<Point3<f64>> {
    let (centre, radius) = shape.ball(pose);
    let directions = HealPix::new(5).map(HealPix::directions).unwrap_or_default();
    let points = directions.into_iter().filter_map(|outward| {
        let origin = centre + outward * (1.1 * radius);
        let (way, _) = shape.first_hit(pose, &origin, &Unit::new_normalize(-outward), 1.1 * radius)?;
        Some(origin - outward * way)
    });
    points.collect()
}
