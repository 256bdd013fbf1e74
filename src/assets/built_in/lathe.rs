//! Solids of revolution: a profile around the z axis.

use std::f64::consts::{PI, TAU};

use super::surface::Surface;
use kernel::seed::Stream;

/// A profile from the axis at the bottom, along the outside, back to the axis: points (radius, height) [m].
///
/// Corners stay sharp; between two corners the curve is sampled evenly by length.
pub(super) struct Profile {
    /// Curves between corners, each a dense polyline that starts where the last one ended.
    curves: Vec<Vec<[f64; 2]>>,
}

impl Profile {
    pub(super) fn start(height: f64) -> Self {
        Self { curves: vec![vec![[0.0, height]]] }
    }

    fn end(&self) -> [f64; 2] {
        *self.curves.last().and_then(|curve| curve.last()).expect("a profile starts with a point")
    }

    /// A straight line to a corner.
    pub(super) fn line(mut self, radius: f64, height: f64) -> Self {
        self.curves.push(vec![self.end(), [radius, height]]);
        self
    }

    /// A smooth curve through points (centripetal in spirit, uniform in fact: Catmull and Rom 1974), ending in a corner.
    pub(super) fn curve(mut self, points: &[[f64; 2]]) -> Self {
        const STEPS: usize = 32;
        let mut through = vec![self.end()];
        through.extend_from_slice(points);
        let at = |i: isize| through[i.clamp(0, through.len() as isize - 1) as usize];
        let mut curve = vec![self.end()];
        for i in 0..points.len() as isize {
            let [p, q, r, s] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
            for step in 1..=STEPS {
                let t = step as f64 / STEPS as f64;
                curve.push(std::array::from_fn(|k| {
                    let [p, q, r, s] = [p[k], q[k], r[k], s[k]];
                    let value =
                        q + 0.5 * t * (r - p + t * (2.0 * p - 5.0 * q + 4.0 * r - s + t * (3.0 * (q - r) + s - p)));
                    // The spline may overshoot the axis, a lathe may not.
                    if k == 0 { value.max(0.0) } else { value }
                }));
            }
            // The last step lands on the point itself.
            *curve.last_mut().expect("steps") = r;
        }
        self.curves.push(curve);
        self
    }

    /// A circular arc around `centre` from the end by `angle` [rad], counter-clockwise in (radius, height).
    pub(super) fn arc(mut self, centre: [f64; 2], angle: f64) -> Self {
        const STEPS: usize = 48;
        let from = self.end();
        let (x, y) = (from[0] - centre[0], from[1] - centre[1]);
        let curve = (0..=STEPS).map(|step| {
            let (sin, cos) = libm::sincos(angle * step as f64 / STEPS as f64);
            [(centre[0] + x * cos - y * sin).max(0.0), centre[1] + x * sin + y * cos]
        });
        self.curves.push(curve.collect());
        self
    }

    /// Revolves the profile, which must have returned to the axis, into at least `triangles` triangles.
    fn revolve(self, triangles: usize) -> Surface {
        let sampled = self.sample(triangles);
        revolve_points(&sampled.points, sampled.columns, &[]).surface
    }

    /// Chooses rows and columns so that the cells are nearly square and make at least `triangles` triangles.
    pub(super) fn sample(&self, triangles: usize) -> Sampled {
        let lengths: Vec<f64> = self.curves.iter().map(|curve| length(curve)).collect();
        let total: f64 = lengths.iter().sum();
        let mean_girth = self.area() / total;
        let columns = libm::sqrt(triangles as f64 / 2.0 * mean_girth / total) as usize / 4 * 4;
        let columns = columns.max(12);
        let rows = triangles.div_ceil(2 * columns) + 1;

        let mut points = vec![self.curves[0][0]];
        let mut rows_of_curve = Vec::new();
        rows_of_curve.push(0..0);
        for (curve, length) in self.curves.iter().zip(&lengths).skip(1) {
            let steps = libm::ceil(rows as f64 * length / total).max(1.0) as usize;
            rows_of_curve.push(points.len() - 1..points.len() - 1 + steps);
            points.extend((1..=steps).map(|step| along(curve, *length * step as f64 / steps as f64)));
        }
        Sampled { points, columns, rows_of_curve }
    }

    /// Area of the surface of revolution [m^2].
    pub(super) fn area(&self) -> f64 {
        let steps = self.curves.iter().flat_map(|curve| curve.windows(2));
        PI * steps.map(|step| distance(step[0], step[1]) * (step[0][0] + step[1][0])).sum::<f64>()
    }
}

/// A profile cut into rows, ready to be revolved.
pub(super) struct Sampled {
    /// Points (radius, height) [m]; the first and the last lie on the axis.
    pub(super) points: Vec<[f64; 2]>,
    pub(super) columns: usize,
    /// Rows of cells that each curve of the profile takes; the first is the starting point, without any.
    pub(super) rows_of_curve: Vec<std::ops::Range<usize>>,
}

/// Cells of a surface of revolution that are left open, where a handle continues.
pub(super) struct Patch {
    /// Rows of cells; row r lies between points r and r + 1.
    pub(super) rows: std::ops::Range<usize>,
    /// The column in the middle, and how many columns of cells lie on each side of it.
    pub(super) column: usize,
    pub(super) half_width: usize,
}

impl Sampled {
    /// A patch of about `size` on a side [m] around (`column`, `height`) on a curve of the profile that runs upwards.
    pub(super) fn patch(&self, curve: usize, height: f64, column: usize, size: f64) -> Patch {
        let within = self.rows_of_curve[curve].clone();
        let mid = within.clone().min_by(|&a, &b| {
            let off = |row: usize| libm::fabs(self.points[row][1] - height);
            off(a).total_cmp(&off(b))
        });
        let mid = mid.unwrap_or(within.start);
        let step = distance(self.points[mid], self.points[mid + 1]);
        let rows = (libm::round(size / step) as usize).clamp(2, within.len().max(2));
        let start = mid.saturating_sub(rows / 2).clamp(within.start, within.end.saturating_sub(rows).max(within.start));
        let width = TAU * self.points[mid][0] / self.columns as f64;
        let half_width = (libm::round(size / (2.0 * width)) as usize).clamp(1, self.columns / 6);
        Patch { rows: start..start + rows, column, half_width }
    }
}

/// A surface of revolution and the rows of its vertices.
pub(super) struct Revolved {
    pub(super) surface: Surface,
    rows: Vec<Vec<u32>>,
    columns: usize,
}

impl Revolved {
    /// The rim of a patch, counter-clockwise seen from outside: vertices, and their positions in the patch, -1 to 1 to the
    /// right and upwards.
    pub(super) fn rim(&self, patch: &Patch) -> Vec<(u32, [f64; 2])> {
        let (height, width) = (patch.rows.len(), 2 * patch.half_width);
        let bottom = (0..width).map(|i| (i, 0));
        let right = (0..height).map(|j| (width, j));
        let top = (1..=width).rev().map(|i| (i, height));
        let left = (1..=height).rev().map(|j| (0, j));
        let point = |(i, j): (usize, usize)| {
            let column = (patch.column + self.columns - patch.half_width + i) % self.columns;
            let share = [2.0 * i as f64 / width as f64 - 1.0, 2.0 * j as f64 / height as f64 - 1.0];
            (self.rows[patch.rows.start + j][column], share)
        };
        bottom.chain(right).chain(top).chain(left).map(point).collect()
    }
}

/// The surface of a polygonal profile, without the patches: first and last point on the axis, the others off it.
pub(super) fn revolve_points(points: &[[f64; 2]], columns: usize, patches: &[Patch]) -> Revolved {
    let mut surface = Surface::default();
    let directions: Vec<(f64, f64)> =
        (0..columns).map(|column| libm::sincos(TAU * column as f64 / columns as f64)).collect();
    let mut rows: Vec<Vec<u32>> = Vec::with_capacity(points.len());
    for (index, &[radius, height]) in points.iter().enumerate() {
        let row = if index == 0 || index == points.len() - 1 {
            surface.row([[0.0, 0.0, height]])
        } else {
            surface.row(directions.iter().map(|&(sin, cos)| [radius * cos, radius * sin, height]))
        };
        rows.push(row.collect());
    }
    for (row, pair) in rows.windows(2).enumerate() {
        surface.join_where(&pair[0], &pair[1], |column| {
            !patches.iter().any(|patch| {
                let from_left = (column + columns + patch.half_width - patch.column) % columns;
                patch.rows.contains(&row) && from_left < 2 * patch.half_width
            })
        });
    }
    Revolved { surface, rows, columns }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

fn length(curve: &[[f64; 2]]) -> f64 {
    curve.windows(2).map(|step| distance(step[0], step[1])).sum()
}

/// The point at a distance along a polyline.
fn along(curve: &[[f64; 2]], mut arc: f64) -> [f64; 2] {
    for step in curve.windows(2) {
        let length = distance(step[0], step[1]);
        if arc < length {
            let t = arc / length;
            return [step[0][0] + t * (step[1][0] - step[0][0]), step[0][1] + t * (step[1][1] - step[0][1])];
        }
        arc -= length;
    }
    *curve.last().expect("a curve has points")
}

/// A food can: straight wall, rims, recessed lids.
pub(super) fn can(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.025, 0.055);
    let height = radius * draw.uniform(0.9, 3.6);
    let (rim, recess) = (radius * draw.uniform(0.03, 0.08), draw.uniform(0.001, 0.004));
    Profile::start(recess)
        .line(radius - rim, recess)
        .line(radius - rim, 0.0)
        .line(radius, 0.0)
        .line(radius, height)
        .line(radius - rim, height)
        .line(radius - rim, height - recess)
        .line(0.0, height - recess)
        .revolve(triangles)
}

/// A closed bottle: body, shoulder, neck, cap.
pub(super) fn bottle(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.02, 0.045);
    let height = radius * draw.uniform(4.0, 8.0);
    let neck = radius * draw.uniform(0.28, 0.6);
    let (waist, shoulder) = (radius * draw.uniform(0.8, 1.0), height * draw.uniform(0.5, 0.72));
    let top = shoulder + (height - shoulder) * draw.uniform(0.45, 0.75);
    let foot = 0.08 * radius;
    let cap = neck * draw.uniform(1.08, 1.35);
    Profile::start(0.0)
        .line(radius - foot, 0.0)
        .arc([radius - foot, foot], PI / 2.0)
        .curve(&[[waist, shoulder * 0.5], [radius, shoulder]])
        .curve(&[[0.55 * (radius + neck), 0.5 * (shoulder + top)], [neck, top]])
        .line(neck, top + 0.3 * (height - top))
        .line(cap, top + 0.3 * (height - top))
        .line(cap, height)
        .line(0.0, height)
        .revolve(triangles)
}

/// A hollow bowl on a foot.
pub(super) fn bowl(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.05, 0.11);
    let height = radius * draw.uniform(0.35, 0.95);
    let wall = draw.uniform(0.003, 0.006);
    let foot = radius * draw.uniform(0.3, 0.5);
    let belly = draw.uniform(0.62, 0.9);
    let outer = [[foot + belly * (radius - foot), 0.42 * height], [radius, height - wall / 2.0]];
    Profile::start(0.0)
        .line(foot, 0.0)
        .curve(&outer)
        .arc([radius - wall / 2.0, height - wall / 2.0], PI)
        .curve(&[[foot + belly * (radius - foot) - 1.25 * wall, 0.42 * height + 0.5 * wall], [foot, 1.5 * wall]])
        .line(0.0, 1.5 * wall)
        .revolve(triangles)
}

/// A tumbler: a straight or flared hollow cup.
pub(super) fn cup(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.028, 0.045);
    let height = radius * draw.uniform(1.6, 3.4);
    let base = radius * draw.uniform(0.65, 1.0);
    let (wall, floor) = (draw.uniform(0.0025, 0.005), draw.uniform(0.004, 0.01));
    Profile::start(0.0)
        .line(base, 0.0)
        .line(radius, height - wall / 2.0)
        .arc([radius - wall / 2.0, height - wall / 2.0], PI)
        .line(base - wall, floor)
        .line(0.0, floor)
        .revolve(triangles)
}

/// An apple, a pear, a lemon: round, with a dent or a neck.
pub(super) fn fruit(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.022, 0.05);
    let height = radius * draw.uniform(1.5, 2.9);
    let belly = height * draw.uniform(0.35, 0.6);
    let shoulder = radius * draw.uniform(0.4, 0.85);
    let dent = height * draw.uniform(0.0, 0.12);
    Profile::start(0.02 * height)
        .curve(&[
            [0.45 * radius, 0.0],
            [radius, belly],
            [shoulder, 0.5 * (belly + height) + 0.2 * (height - belly)],
            [0.3 * shoulder, height],
            [0.0, height - dent],
        ])
        .revolve(triangles)
}

/// A glass with a stem.
pub(super) fn goblet(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.03, 0.045);
    let (foot, stem) = (radius * draw.uniform(0.75, 1.0), draw.uniform(0.004, 0.008));
    let (rise, depth) = (radius * draw.uniform(1.2, 2.4), radius * draw.uniform(1.4, 2.6));
    let mouth = radius * draw.uniform(0.75, 1.05);
    let wall = draw.uniform(0.0025, 0.004);
    let top = rise + depth;
    Profile::start(0.0)
        .line(foot, 0.0)
        .line(foot, 0.003)
        .curve(&[[1.6 * stem, 0.012], [stem, 0.4 * rise], [1.5 * stem, rise]])
        .curve(&[[radius, rise + 0.45 * depth], [mouth, top - wall / 2.0]])
        .arc([mouth - wall / 2.0, top - wall / 2.0], PI)
        .curve(&[[radius - wall, rise + 0.45 * depth], [0.0, rise + 2.5 * wall]])
        .revolve(triangles)
}

/// A hollow vase with a belly and a lip.
pub(super) fn vase(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.03, 0.06);
    let height = radius * draw.uniform(2.6, 4.4);
    let foot = radius * draw.uniform(0.45, 0.85);
    let (neck, lip) = (radius * draw.uniform(0.35, 0.7), radius * draw.uniform(0.6, 1.0));
    let (belly, throat) = (height * draw.uniform(0.3, 0.5), height * draw.uniform(0.72, 0.85));
    let wall = draw.uniform(0.003, 0.005);
    Profile::start(0.0)
        .line(foot, 0.0)
        .curve(&[[radius, belly], [neck, throat], [lip, height - wall / 2.0]])
        .arc([lip - wall / 2.0, height - wall / 2.0], PI)
        .curve(&[[neck - wall, throat], [radius - wall, belly], [foot - wall, 2.0 * wall]])
        .line(0.0, 2.0 * wall)
        .revolve(triangles)
}

/// A screwdriver, upright on its tip: shaft, collar, grip.
pub(super) fn screwdriver(draw: &mut Stream, triangles: usize) -> Surface {
    let (shaft, length) = (draw.uniform(0.002, 0.004), draw.uniform(0.06, 0.14));
    let (grip, height) = (draw.uniform(0.011, 0.018), draw.uniform(0.07, 0.115));
    let (waist, top) = (grip * draw.uniform(0.65, 0.9), length + height);
    let tip = shaft * draw.uniform(0.25, 0.9);
    Profile::start(0.0)
        .line(tip, 0.0)
        .line(shaft, 0.012)
        .line(shaft, length)
        .line(0.6 * grip, length)
        .curve(&[[waist, length + 0.12 * height], [grip, length + 0.55 * height], [0.9 * grip, top - 0.3 * grip]])
        .curve(&[[0.6 * grip, top - 0.05 * grip], [0.0, top]])
        .revolve(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of frustums over a regular polygon: exact for the result of `revolve_points`.
    fn closed_form(points: &[[f64; 2]], columns: usize) -> f64 {
        let circle = columns as f64 / 2.0 * (TAU / columns as f64).sin();
        let frustum = |s: &[[f64; 2]]| {
            let [[r, low], [q, high]] = [s[0], s[1]];
            (high - low) * (r * r + r * q + q * q) / 3.0
        };
        circle * points.windows(2).map(frustum).sum::<f64>()
    }

    #[test]
    fn a_turned_profile_has_the_volume_of_its_frustums() {
        let hollow = [[0.0, 0.0], [0.03, 0.0], [0.04, 0.1], [0.037, 0.1], [0.027, 0.005], [0.0, 0.005]];
        for columns in [12, 64] {
            let surface = revolve_points(&hollow, columns, &[]).surface;
            let volume: f64 = surface
                .faces
                .iter()
                .map(|face| {
                    let [a, b, c] = face.map(|vertex| nalgebra::Vector3::from(surface.positions[vertex as usize]));
                    a.dot(&b.cross(&c)) / 6.0
                })
                .sum();
            assert!((volume / closed_form(&hollow, columns) - 1.0).abs() < 1e-12);
        }
    }
}
