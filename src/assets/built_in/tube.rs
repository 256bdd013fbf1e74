//! Tubes along a curve: handles, spouts, whole bent shapes.

use std::f64::consts::{PI, TAU};

use super::{lathe::Revolved, surface::Surface};

/// A tube in a half-plane that holds the z axis.
pub(super) struct Tube<'a> {
    /// Middle (distance from the axis, height) [m] at 0 to 1 along the tube.
    pub(super) path: &'a dyn Fn(f64) -> [f64; 2],
    /// Half width across the half-plane and half thickness in it [m].
    pub(super) radii: &'a dyn Fn(f64) -> [f64; 2],
    /// Cross-sections between the ends.
    pub(super) sections: usize,
    /// Where the half-plane lies: the angle around the axis, as (sin, cos).
    pub(super) azimuth: (f64, f64),
}

impl Tube<'_> {
    fn point(&self, u: f64, (sin, cos): (f64, f64)) -> [f64; 3] {
        let ([x, z], [tx, tz]) = ((self.path)(u), self.tangent(u));
        let [width, thickness] = (self.radii)(u);
        // The normal in the half-plane: the tangent rotated by a right angle to the left, up where the tube leaves the axis.
        let (x, y, z) = (x - tz * thickness * sin, width * cos, z + tx * thickness * sin);
        let (azimuth_sin, azimuth_cos) = self.azimuth;
        [x * azimuth_cos - y * azimuth_sin, x * azimuth_sin + y * azimuth_cos, z]
    }

    fn tangent(&self, u: f64) -> [f64; 2] {
        const STEP: f64 = 1e-4;
        let ([ax, az], [bx, bz]) = ((self.path)((u - STEP).max(0.0)), (self.path)((u + STEP).min(1.0)));
        let length = libm::hypot(bx - ax, bz - az);
        [(bx - ax) / length, (bz - az) / length]
    }

    /// Adds the cross-sections to a surface, from a row that is there already; returns the last one.
    fn grow(&self, surface: &mut Surface, start: Vec<u32>, directions: &[(f64, f64)]) -> Vec<u32> {
        let mut last = start;
        for section in 1..=self.sections {
            let u = section as f64 / (self.sections + 1) as f64;
            let ring = directions.iter().map(|&direction| self.point(u, direction)).collect::<Vec<_>>();
            let next: Vec<u32> = surface.row(ring).collect();
            surface.join(&last, &next);
            last = next;
        }
        last
    }

    /// A closed shape: the tube from tip to tip.
    pub(super) fn alone(&self, columns: usize) -> Surface {
        let mut surface = Surface::default();
        let directions: Vec<(f64, f64)> =
            (0..columns).map(|column| libm::sincos(TAU * column as f64 / columns as f64)).collect();
        let start = surface.row([self.tip(0.0)]).collect();
        let last = self.grow(&mut surface, start, &directions);
        let tip: Vec<u32> = surface.row([self.tip(1.0)]).collect();
        surface.join(&last, &tip);
        surface
    }

    fn tip(&self, u: f64) -> [f64; 3] {
        let ([x, z], (sin, cos)) = ((self.path)(u), self.azimuth);
        [x * cos, x * sin, z]
    }

    /// Grows from the rim of a patch to a tip.
    pub(super) fn attach(&self, revolved: &mut Revolved, rim: &[(u32, [f64; 2])]) {
        let start = rim.iter().map(|(vertex, _)| *vertex).collect();
        let last = self.grow(&mut revolved.surface, start, &directions(rim));
        let tip: Vec<u32> = revolved.surface.row([self.tip(1.0)]).collect();
        revolved.surface.join(&last, &tip);
    }

    /// Grows from the rim of one patch to the rim of another of the same size, arriving upside down.
    pub(super) fn bridge(&self, revolved: &mut Revolved, from: &[(u32, [f64; 2])], to: &[(u32, [f64; 2])]) {
        let start = from.iter().map(|(vertex, _)| *vertex).collect();
        let last = self.grow(&mut revolved.surface, start, &directions(from));
        let opposite = |&(_, [right, up]): &(u32, [f64; 2])| {
            let off = |point: [f64; 2]| libm::fabs(point[0] - right) + libm::fabs(point[1] + up);
            to.iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1))).map_or(0, |(vertex, _)| *vertex)
        };
        let end: Vec<u32> = from.iter().map(opposite).collect();
        revolved.surface.join(&last, &end);
    }
}

/// Directions of a round section through the points of a square rim, as (sin, cos).
fn directions(rim: &[(u32, [f64; 2])]) -> Vec<(f64, f64)> {
    rim.iter()
        .map(|&(_, [right, up])| {
            let reach = libm::hypot(right, up);
            (up / reach, right / reach)
        })
        .collect()
}

/// Share of the full radius near a rounded end, for `left` of `radius` to go.
pub(super) fn rounded(left: f64, radius: f64) -> f64 {
    if left >= radius {
        return 1.0;
    }
    let off = 1.0 - left / radius;
    libm::sqrt((1.0 - off * off).max(0.0))
}

/// Places along a tube that crowd towards a rounded end (at 1), so that the end has sections too.
pub(super) fn towards_end(u: f64) -> f64 {
    libm::sin(u * PI / 2.0)
}
