//! Distances between two bodies that are apart.
//!
//! A search over the balls around one body's surface, with the distance found so far as a margin (branch and bound;
//! S. Quinlan, "Efficient distance computation between non-convex objects", 1994). Pieces that are left are compared by
//! their triangles, or, with a shape whose distance is a closed form, by tangents: that distance is convex, so its tangent at
//! one point bounds it over a whole triangle.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    checker::{CheckedBody, CollisionChecker, LinkFrames, box_triangles},
    curved::{Curved, Form},
    nearest::{Nearest, Reached, TOLERANCE},
    solid::Solid,
};

/// Sides of the prism around a cylinder whose distance from another cylinder is bounded: it is 0.12 % wider.
const PRISM: usize = 64;

impl CollisionChecker {
    /// Lower bound on the distance between the bodies of a pair [m], no more than 2 um below it; `most` where the distance
    /// is at least that. Between two cylinders the bound is lower by up to 0.12 % of a radius.
    ///
    /// The bodies must not touch: a body wholly inside another has a distance from its surface. `links` are those of
    /// [`CollisionChecker::check`].
    pub fn clearance(&self, pair: usize, links: &LinkFrames, most: f64) -> f64 {
        let nearest = self.nearest(pair, links, Nearest { best: most + TOLERANCE, enough: f64::NEG_INFINITY });
        (nearest.best - TOLERANCE).max(0.0)
    }

    /// Whether the distance between the bodies of a pair is proven to be at least `enough` [m]. `false` where it is less, and
    /// possibly where it is less than three times that plus 2 um: a larger distance is not compared triangle by triangle.
    ///
    /// The bodies must not touch, as in [`CollisionChecker::clearance`].
    pub fn clearance_at_least(&self, pair: usize, links: &LinkFrames, enough: f64) -> bool {
        let bound = enough + TOLERANCE;
        self.nearest(pair, links, Nearest { best: bound, enough: bound }).best >= bound
    }

    fn nearest(&self, pair: usize, links: &LinkFrames, mut nearest: Nearest) -> Nearest {
        if let Some((first, second, here_from_there)) = self.relative(pair, links) {
            first.approach(second, &here_from_there, &mut nearest);
        }
        nearest
    }
}

impl CheckedBody {
    /// Lowers `nearest` to the distance of another body.
    fn approach(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>, nearest: &mut Nearest) {
        let apart = (here_from_there * other.centre - self.centre).norm() - self.radius - other.radius;
        if nearest.beyond(apart) {
            return;
        }
        if let (Some(one), Some(two)) = (&self.solid, &other.solid) {
            one.approach(two, here_from_there, nearest);
        }
        let there_from_here = here_from_there.inverse();
        if let Some(solid) = &self.solid {
            for curved in &other.curved {
                solid.approach_curved(curved, here_from_there, nearest);
            }
        }
        if let Some(solid) = &other.solid {
            for curved in &self.curved {
                solid.approach_curved(curved, &there_from_here, nearest);
            }
        }
        for one in &self.curved {
            for two in &other.curved {
                if nearest.decided() {
                    return;
                }
                // A cylinder's own distance is a closed form; its surface is not made of triangles.
                if two.is_cylinder() {
                    two.approach(one, &there_from_here, nearest);
                } else {
                    one.approach(two, here_from_there, nearest);
                }
            }
        }
    }
}

impl Curved {
    fn is_cylinder(&self) -> bool {
        matches!(self.form().0, Form::Round { flat: true, .. })
    }

    /// Lowers `nearest` to the distance of another shape, whose link's frame is expressed in this one's.
    fn approach(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>, nearest: &mut Nearest) {
        let [(centre, radius), (other_centre, other_radius)] = [self.ball(), other.ball()];
        if nearest.beyond((here_from_there * other_centre - centre).norm() - radius - other_radius) {
            return;
        }
        let (form, there_from_shape) = other.form();
        let here_from_shape = here_from_there * there_from_shape;
        let mut all = |triangle: [Point3<f64>; 3]| {
            if !nearest.decided() {
                self.approach_piece(triangle.map(|corner| here_from_shape * corner), 0.0, nearest);
            }
        };
        match form {
            Form::Round { radius, half: 0.0, flat: false } => {
                self.approach_piece([here_from_there * other_centre], radius, nearest);
            }
            Form::Round { radius, flat: false, .. } => {
                self.approach_piece(other.segment().map(|end| here_from_there * end), radius, nearest);
            }
            Form::Round { radius, half, flat: true } => prism(radius, half).for_each(&mut all),
            Form::Box { half } => box_triangles(half).into_iter().for_each(&mut all),
        }
    }

    /// Lowers `nearest` to the distance of the hull of up to three points, in the frame of this shape's link, with a radius
    /// around them.
    pub fn approach_piece<const N: usize>(&self, corners: [Point3<f64>; N], radius: f64, nearest: &mut Nearest) {
        let (mut open, mut next) = (Vec::new(), Some(corners));
        while let Some(corners) = next.take().or_else(|| open.pop()) {
            let middle = Point3::from(corners.iter().map(|corner| corner.coords).sum::<Vector3<f64>>() / N as f64);
            let (signed, slope) = self.signed_with_slope(&middle);
            nearest.found(signed - radius);
            if nearest.decided() {
                return;
            }
            // The tangent plane at the middle bounds a convex function from below: over a hull at one of its corners.
            let lowest = corners.iter().map(|corner| slope.dot(&(corner - middle))).fold(f64::INFINITY, f64::min);
            if nearest.beyond(signed + lowest - radius) {
                continue;
            }
            // Cut the longest edge in half.
            let pairs = (0..N).flat_map(|i| (i + 1..N).map(move |j| [i, j]));
            let length = |[i, j]: [usize; 2]| (corners[i] - corners[j]).norm_squared();
            if let Some([i, j]) = pairs.reduce(|best, next| if length(next) > length(best) { next } else { best }) {
                let cut = nalgebra::center(&corners[i], &corners[j]);
                let [mut one, mut two] = [corners; 2];
                (one[i], two[j]) = (cut, cut);
                open.push(one);
                next = Some(two);
            }
        }
    }
}

/// Triangles of a prism around a cylinder in its own frame.
fn prism(radius: f64, half: f64) -> impl Iterator<Item = [Point3<f64>; 3]> {
    let step = std::f64::consts::TAU / PRISM as f64;
    let out = radius / libm::cos(0.5 * step);
    let corner = move |index: usize, up: f64| {
        let (sin, cos) = libm::sincos(step * index as f64);
        Point3::new(out * cos, out * sin, up)
    };
    (0..PRISM).flat_map(move |index| {
        let [a, b] = [corner(index, -half), corner(index + 1, -half)];
        let [c, d] = [corner(index, half), corner(index + 1, half)];
        let [below, above] = [Point3::new(0.0, 0.0, -half), Point3::new(0.0, 0.0, half)];
        [[a, b, c], [b, d, c], [below, b, a], [above, c, d]]
    })
}

impl Solid {
    /// Lowers `nearest` to the distance of another body, whose frame is expressed in this one's.
    pub fn approach(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>, nearest: &mut Nearest) {
        // A triangle may reach into many pieces, and is compared once.
        let mut done = Vec::new();
        self.near_leaves(other, here_from_there, nearest, |leaf, nearest| {
            if nearest.coarse(leaf.radius) {
                return nearest.decide();
            }
            let distance = self.distance_within(&(here_from_there * leaf.centre), nearest.best + leaf.radius);
            if !(Reached { distance, radius: leaf.radius }).settles(nearest) {
                self.approach_leaf(other, leaf, here_from_there, &mut done, nearest);
            }
        });
    }

    /// Lowers `nearest` to the distance of a shape in closed form, whose link's frame is expressed in this one's.
    pub fn approach_curved(&self, other: &Curved, here_from_there: &IsometryMatrix3<f64>, nearest: &mut Nearest) {
        if nearest.decided() {
            return;
        }
        let there_from_here = here_from_there.inverse();
        let mut done = Vec::new();
        self.leaves_near_curved(other, here_from_there, nearest, |leaf, nearest| {
            if nearest.coarse(leaf.radius) {
                return nearest.decide();
            }
            let distance = other.signed(&(there_from_here * leaf.centre));
            if (Reached { distance, radius: leaf.radius }).settles(nearest) {
                return;
            }
            for (index, triangle) in self.triangles_of(leaf) {
                if !done.contains(&index) {
                    done.push(index);
                    other.approach_piece(triangle.map(|corner| there_from_here * corner), 0.0, nearest);
                }
                if nearest.decided() {
                    return;
                }
            }
        });
    }
}
