//! Surfaces that go through each other.

use std::f64::consts::TAU;

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::ContactBody;
use crate::geom::{Ray, SimdLevel};

/// Largest cosine between the two normals where an edge enters and leaves a wall. At a ridge that the edge only grazes,
/// the normals are alike.
const OPPOSITE: f64 = -0.3;

/// Directions in which an edge is moved to see whether it comes free.
const WAYS: u32 = 8;

/// Distance by which the search continues behind a hit [m].
const BEYOND: f64 = 1e-7;

/// Hits of one edge that are looked at, at most.
const MAX_HITS: usize = 16;

/// Whether an edge of one body passes through a wall of the other, in at one side and out at the opposite one, and does
/// not come free when it is moved aside by `depth` [m]. Contacts cannot find this: they ignore points on the far side
/// of a thin wall.
pub fn crosses(
    [first, second]: [&ContactBody; 2],
    first_from_second: &IsometryMatrix3<f64>,
    depth: f64,
    level: SimdLevel,
) -> bool {
    goes_through(second, first, first_from_second, depth, level)
        || goes_through(first, second, &first_from_second.inverse(), depth, level)
}

/// Whether an edge of `own` goes through a wall of `other`.
fn goes_through(
    own: &ContactBody,
    other: &ContactBody,
    other_from_own: &IsometryMatrix3<f64>,
    depth: f64,
    level: SimdLevel,
) -> bool {
    let surface = other.surface();
    if surface.at_least(&(other_from_own * own.centre())) > own.radius() {
        return false;
    }
    let vertices = own.surface().vertices();
    let vertex = |index: u32| other_from_own * Point3::from(vertices[index as usize].map(f64::from));
    own.edges().iter().any(|[from, to]| {
        let (from, to) = (vertex(*from), vertex(*to));
        let half = (to - from) / 2.0;
        // The lattice rules out nearly all.
        if surface.at_least(&(from + half)) > half.norm() {
            return false;
        }
        let Some(along) = Unit::try_new(to - from, 0.0) else { return false };
        pierces(other, &from, &along, 2.0 * half.norm(), level) && !comes_free(other, &from, &to, depth, level)
    })
}

/// Whether a piece of a line goes in at one side of a wall and out at the other.
fn pierces(other: &ContactBody, from: &Point3<f64>, along: &Unit<Vector3<f64>>, length: f64, level: SimdLevel) -> bool {
    let tree = other.surface().tree();
    let (mut start, mut entered) = (0.0, None::<Vector3<f64>>);
    for _ in 0..MAX_HITS {
        let ray = Ray::new(&(from + along.into_inner() * start), along);
        let Some(hit) = tree.first_hit(level, &ray, length - start) else { return false };
        if let Some(normal) = tree.normal(&hit) {
            match entered {
                Some(entry) if normal.dot(along) > 0.0 && entry.dot(&normal) < OPPOSITE => return true,
                _ => entered = (normal.dot(along) < 0.0).then_some(normal.into_inner()),
            }
        }
        start += hit.distance + BEYOND;
        if start >= length {
            return false;
        }
    }
    false
}

/// Whether a piece of a line meets nothing once it is moved aside by `depth` [m] in some direction.
fn comes_free(other: &ContactBody, from: &Point3<f64>, to: &Point3<f64>, depth: f64, level: SimdLevel) -> bool {
    let (along, length) = Unit::new_and_get(to - from);
    let aside = if along.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let one = along.cross(&aside).normalize();
    let two = along.cross(&one);
    (0..WAYS).any(|way| {
        let angle = TAU * f64::from(way) / f64::from(WAYS);
        let shift = (one * libm::cos(angle) + two * libm::sin(angle)) * depth;
        !other.surface().tree().blocks(level, &Ray::new(&(from + shift), &along), length)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Translation3;

    use super::*;
    use crate::{
        contact::{ContactSurface, Sampled},
        geom::TriMesh,
        voxel::InsideTest,
    };

    fn body(mesh: &TriMesh) -> ContactBody {
        let surface = Arc::new(ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface"));
        ContactBody::new(mesh, surface, Sampled::Everywhere)
    }

    /// A tray of thin walls, and a slim beam out of the same kind of box.
    #[test]
    fn a_beam_through_a_wall_is_seen_and_one_that_leans_on_it_is_not() {
        let tray = body(&TriMesh::open_box([0.2, 0.2, 0.1], 0.001));
        let beam = body(&TriMesh::open_box([0.1, 0.004, 0.004], 0.001));
        let limit = 0.0005;
        let level = SimdLevel::Scalar;
        let at =
            |x: f64, z: f64| IsometryMatrix3::from_parts(Translation3::new(x, 0.0, z), nalgebra::Rotation3::identity());
        // Through the wall at x = 0.1, half in and half out.
        assert!(crosses([&tray, &beam], &at(0.1, 0.05), limit, level));
        assert!(crosses([&beam, &tray], &at(0.1, 0.05).inverse(), limit, level));
        // On the rim, a tenth of a millimetre deep; and well inside, and outside.
        assert!(!crosses([&tray, &beam], &at(0.1, 0.1 + 0.001 - 1e-4), limit, level));
        assert!(!crosses([&tray, &beam], &at(0.0, 0.05), limit, level));
        assert!(!crosses([&tray, &beam], &at(0.3, 0.05), limit, level));
        // On the rim, but two millimetres deep.
        assert!(crosses([&tray, &beam], &at(0.1, 0.1 + 0.001 - 2e-3), limit, level));
    }
}
