//! Where searches begin: points spread evenly over an object's surface.

use std::f64::consts::PI;

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Vector3};

use kernel::{
    contact::ContactSurface,
    geom::{farthest_first, rotation_towards},
    seed::Stream,
};

/// Points that are drawn for each seed, and at least.
const DRAWN: (u32, u32) = (8, 1024);

/// This number of frames expressed in the object's frame: origin on the surface, z along the inward normal, a random
/// roll about it.
///
/// Points are drawn uniformly by area; each point is the one of them that is farthest from those before, so that the first
/// few seeds are spread, too.
pub fn seeds(surface: &ContactSurface, count: u32, stream: &mut Stream) -> Vec<IsometryMatrix3<f64>> {
    let points = drawn(surface, (DRAWN.0 * count).max(DRAWN.1), stream);
    let starts: Vec<Point3<f64>> = points.iter().map(|(point, _)| *point).collect();
    farthest_first(&starts, count)
        .into_iter()
        .map(|taken| {
            let (point, out) = points[taken];
            let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&-out, stream.uniform(-PI, PI)));
            IsometryMatrix3::from_parts(Translation3::from(point), rotation)
        })
        .collect()
}

/// Points of the surface with their outward normals; one at least.
fn drawn(surface: &ContactSurface, count: u32, stream: &mut Stream) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let mut points = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let [share, u, v] = [(); 3].map(|()| stream.unit());
        points.extend(surface.point_at(share, u, v));
    }
    if points.is_empty() {
        points.push((surface.bounds().centre(), Vector3::z()));
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use assets::{MeshOrigin, MeshSource, ScaleRule, SizeRule, object::inside_test, prepare};

    fn surface(name: &str) -> ContactSurface {
        let source = MeshSource {
            name: name.to_owned(),
            origin: MeshOrigin::BuiltIn(name.to_owned()),
            scale: ScaleRule::MetresPerUnit(1.0),
            size: SizeRule { min: 0.0, max: 10.0 },
            group: None,
            licence: None,
            citation: None,
        };
        let prepared = prepare(&source).expect("a built-in shape");
        ContactSurface::new(&prepared.mesh, inside_test(&prepared.record)).expect("it has a surface")
    }

    fn min_distance(starts: &[Vector3<f64>]) -> f64 {
        let pairs = starts.iter().enumerate().flat_map(|(k, a)| starts[..k].iter().map(move |b| (a - b).norm()));
        pairs.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn seeds_are_spread_and_look_inward() {
        let surface = surface("can-01");
        let stream = |name| Stream::of_job(3, b"object", name);
        let made = seeds(&surface, 20, &mut stream("grasp seeds"));
        assert_eq!(made, seeds(&surface, 20, &mut stream("grasp seeds")), "the same every time");
        assert_ne!(made, seeds(&surface, 20, &mut stream("another")));
        let starts: Vec<_> = made.iter().map(|seed| seed.translation.vector).collect();
        let random: Vec<_> = drawn(&surface, 20, &mut stream("random")).iter().map(|(point, _)| point.coords).collect();
        let (even, random) = (min_distance(&starts), min_distance(&random));
        assert!(even > 3.0 * random, "{even} m apart, random points {random} m");
        for seed in &made {
            assert!(surface.signed_distance(&seed.translation.vector.into()).abs() < 1e-6);
            let inside = seed * Point3::new(0.0, 0.0, 1e-3);
            assert!(surface.signed_distance(&inside) < 0.0, "z goes into the object");
            assert!((seed.rotation.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }

    /// More seeds of an object leave those before where they are, as long as no more points are drawn.
    #[test]
    fn the_first_seeds_stay() {
        let surface = surface("can-01");
        let stream = || Stream::of_job(3, b"object", "grasp seeds");
        assert_eq!(seeds(&surface, 5, &mut stream()), seeds(&surface, 40, &mut stream())[..5]);
    }
}
