//! Objects with handles: solids of revolution with tubes growing out of them, each a single surface.

use std::f64::consts::PI;

use super::{
    lathe::{Profile, Sampled, revolve_points},
    surface::Surface,
    tube::{Tube, rounded, towards_end},
};
use kernel::seed::Stream;

/// The half-plane of the main handle: along x.
const FRONT: (f64, f64) = (0.0, 1.0);

/// Radius of a sampled profile at the middle of a patch.
fn radius_at(sampled: &Sampled, rows: &std::ops::Range<usize>) -> [f64; 2] {
    sampled.points[(rows.start + rows.end) / 2]
}

/// Sections of a tube with this many columns that bring a surface to the wanted number of triangles.
fn sections(wanted: usize, faces: usize, columns: usize) -> usize {
    wanted.saturating_sub(faces).div_ceil(2 * columns).max(6)
}

/// Triangles for a solid of revolution, given the area of its handles.
fn body_share(triangles: usize, profile: &Profile, handle_area: f64) -> usize {
    let area = profile.area();
    libm::ceil(triangles as f64 * area / (area + handle_area)) as usize
}

/// A mug with a handle in the shape of half an ellipse.
pub(super) fn mug(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.034, 0.048);
    let height = radius * draw.uniform(1.7, 2.8);
    let (base, wall) = (radius * draw.uniform(0.75, 1.0), draw.uniform(0.003, 0.005));
    let (reach, thick) = (draw.uniform(0.024, 0.036), draw.uniform(0.004, 0.0065));
    let (low, high) = (height * draw.uniform(0.2, 0.32), height * draw.uniform(0.7, 0.82));
    let width = thick * draw.uniform(1.0, 1.5);
    let profile = Profile::start(0.0)
        .line(base, 0.0)
        .line(radius, height - wall / 2.0)
        .arc([radius - wall / 2.0, height - wall / 2.0], PI)
        .line(base - wall, 1.3 * wall)
        .line(0.0, 1.3 * wall);
    let sampled = profile.sample(body_share(triangles, &profile, 2.0 * PI * thick * (high - low + reach)));
    handled(&sampled, 2, [low, high], [reach, width, thick], triangles)
}

/// Adds a handle that leaves a curve of the profile high and comes back low.
fn handled(sampled: &Sampled, curve: usize, [low, high]: [f64; 2], handle: [f64; 3], triangles: usize) -> Surface {
    let [reach, width, thick] = handle;
    let above = sampled.patch(curve, high, 0, 1.8 * thick);
    let mut below = sampled.patch(curve, low, 0, 1.8 * thick);
    // Both patches need the same rows and columns, and a row of cells between them.
    below.half_width = above.half_width;
    let first = sampled.rows_of_curve[curve].start;
    let start = below.rows.start.min(above.rows.start.saturating_sub(above.rows.len() + 1)).max(first);
    below.rows = start..start + above.rows.len();
    let ([top_x, top_z], [end_x, end_z]) = (radius_at(sampled, &above.rows), radius_at(sampled, &below.rows));
    let patches = [above, below];
    let mut revolved = revolve_points(&sampled.points, sampled.columns, &patches);
    let [from, to] = [&patches[0], &patches[1]].map(|patch| revolved.rim(patch));
    let path = |u: f64| {
        let (sin, cos) = libm::sincos(PI * u);
        let down = (1.0 - cos) / 2.0;
        [top_x + (end_x - top_x) * down + reach * sin, top_z + (end_z - top_z) * down]
    };
    let sections = sections(triangles, revolved.surface.faces.len(), from.len());
    Tube { path: &path, radii: &|_| [width, thick], sections, azimuth: FRONT }.bridge(&mut revolved, &from, &to);
    revolved.surface
}

/// A straight or bent stick out of a patch on a curve of the profile, rounded at its end.
struct Stick {
    curve: usize,
    /// Height where it leaves [m].
    height: f64,
    /// Length away from the axis and rise [m].
    reach: f64,
    rise: f64,
    /// Half width and half thickness [m], at the root and at the end.
    root: [f64; 2],
    end: [f64; 2],
    /// Bulge of the middle, as a share.
    belly: f64,
    azimuth: (f64, f64),
}

impl Stick {
    fn length(&self) -> f64 {
        libm::hypot(self.reach, self.rise)
    }

    fn area(&self) -> f64 {
        PI * (self.root[0] + self.end[0]).max(self.root[1] + self.end[1]) * self.length()
    }
}

/// Revolves a profile and grows sticks out of it; all get a like share of the triangles that are left.
fn with_sticks(profile: &Profile, sticks: &[Stick], triangles: usize) -> Surface {
    let sampled = profile.sample(body_share(triangles, profile, sticks.iter().map(Stick::area).sum()));
    let column = |stick: &Stick| if stick.azimuth.1 > 0.0 { 0 } else { sampled.columns / 2 };
    // A patch of the wall around each root, wide enough for it.
    let patches: Vec<_> = sticks
        .iter()
        .map(|stick| sampled.patch(stick.curve, stick.height, column(stick), 0.9 * (stick.root[0] + stick.root[1])))
        .collect();
    let mut revolved = revolve_points(&sampled.points, sampled.columns, &patches);
    // Triangles still to be spent, shared evenly among the sticks.
    let missing = triangles.saturating_sub(revolved.surface.faces.len());
    for (stick, patch) in sticks.iter().zip(&patches) {
        let [x, z] = radius_at(&sampled, &patch.rows);
        let rim = revolved.rim(patch);
        // Straight out at first, so that the root is perpendicular to the wall; then the rise begins.
        let path = |u: f64| {
            let u = towards_end(u);
            [x + stick.reach * u, z + stick.rise * u * u]
        };
        // Radii blend from root to end, swell by the belly and close in a rounded tip.
        let radii = |u: f64| {
            let u = towards_end(u);
            let left = (1.0 - u) * stick.length();
            [0, 1].map(|k| {
                let radius = stick.root[k] + (stick.end[k] - stick.root[k]) * u;
                radius * (1.0 + 4.0 * stick.belly * u * (1.0 - u)) * rounded(left, stick.end[1])
            })
        };
        // Each section adds two triangles per column of the rim.
        let sections = (missing / sticks.len()).div_ceil(2 * rim.len()).max(8);
        Tube { path: &path, radii: &radii, sections, azimuth: stick.azimuth }.attach(&mut revolved, &rim);
    }
    revolved.surface
}

/// A frying pan.
pub(super) fn pan(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.06, 0.12);
    let height = radius * draw.uniform(0.3, 0.6);
    let (base, wall) = (radius * draw.uniform(0.75, 0.92), draw.uniform(0.003, 0.005));
    let thick = draw.uniform(0.006, 0.009).min(0.3 * height);
    let profile = Profile::start(0.0)
        .line(base, 0.0)
        .line(radius, height - wall / 2.0)
        .arc([radius - wall / 2.0, height - wall / 2.0], PI)
        .line(base - wall, wall)
        .line(0.0, wall);
    let handle = Stick {
        curve: 2,
        height: 0.6 * height,
        reach: radius * draw.uniform(1.2, 1.9),
        rise: radius * draw.uniform(0.0, 0.5),
        root: [1.2 * thick, thick],
        end: [1.4 * thick, 0.8 * thick],
        belly: 0.1,
        azimuth: FRONT,
    };
    with_sticks(&profile, &[handle], triangles)
}

/// A soup ladle: a small bowl with a long handle that rises from its side.
pub(super) fn ladle(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.025, 0.042);
    let height = radius * draw.uniform(0.6, 1.0);
    let wall = draw.uniform(0.003, 0.0045);
    let thick = draw.uniform(0.0035, 0.0055);
    let belly = draw.uniform(0.7, 0.85);
    let profile = Profile::start(0.0)
        .line(0.3 * radius, 0.0)
        .curve(&[[belly * radius, 0.35 * height], [radius, height - wall / 2.0]])
        .arc([radius - wall / 2.0, height - wall / 2.0], PI)
        .curve(&[[belly * radius - 1.2 * wall, 0.35 * height + 0.6 * wall], [0.25 * radius, wall]])
        .line(0.0, wall);
    let handle = Stick {
        curve: 2,
        height: 0.75 * height,
        reach: draw.uniform(0.07, 0.12),
        rise: draw.uniform(0.03, 0.12),
        root: [1.3 * thick, thick],
        end: [1.9 * thick, thick],
        belly: 0.0,
        azimuth: FRONT,
    };
    with_sticks(&profile, &[handle], triangles)
}

/// A closed kettle with a stubby handle and a spout across from it.
pub(super) fn kettle(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.05, 0.075);
    let height = radius * draw.uniform(1.3, 2.2);
    let (neck, knob) = (radius * draw.uniform(0.45, 0.65), radius * draw.uniform(0.12, 0.2));
    // Body, shoulder, lid and knob of a closed profile.
    let profile = Profile::start(0.0)
        .line(0.7 * radius, 0.0)
        .curve(&[[radius, 0.35 * height], [0.88 * radius, 0.65 * height], [neck, 0.9 * height]])
        .line(0.9 * neck, 0.95 * height)
        .line(knob, height)
        .curve(&[[1.3 * knob, height + knob], [0.0, height + 1.8 * knob]]);
    // Half thicknesses of the handle and of the spout.
    let (thick, spout) = (draw.uniform(0.006, 0.009), draw.uniform(0.008, 0.012));
    let sticks = [
        // Handle, in front.
        Stick {
            curve: 2,
            height: 0.62 * height,
            reach: radius * draw.uniform(0.9, 1.4),
            rise: radius * draw.uniform(0.1, 0.5),
            root: [1.2 * thick, thick],
            end: [1.3 * thick, 0.9 * thick],
            belly: 0.1,
            azimuth: FRONT,
        },
        // Spout, opposite, tapering to its mouth.
        Stick {
            curve: 2,
            height: 0.5 * height,
            reach: radius * draw.uniform(0.55, 0.9),
            rise: height * draw.uniform(0.3, 0.45),
            root: [1.3 * spout, 1.3 * spout],
            end: [0.7 * spout, 0.7 * spout],
            belly: 0.0,
            azimuth: (0.0, -1.0),
        },
    ];
    with_sticks(&profile, &sticks, triangles)
}

/// A hammer, upright on the end of its handle: a revolved head across, the handle growing out of its side.
pub(super) fn hammer(draw: &mut Stream, triangles: usize) -> Surface {
    let radius = draw.uniform(0.012, 0.019);
    let length = radius * draw.uniform(4.2, 6.5);
    let (face, chamfer) = (radius * draw.uniform(0.9, 1.25), 0.12 * radius);
    let peen = radius * draw.uniform(0.35, 1.0);
    let thick = radius * draw.uniform(0.55, 0.75);
    // Head from the striking face over the body to the peen.
    let profile = Profile::start(0.0)
        .line(face - chamfer, 0.0)
        .line(face, chamfer)
        .line(face, 0.2 * length)
        .line(radius, 0.28 * length)
        .line(radius, 0.75 * length)
        .line(peen, length - chamfer)
        .line(peen - chamfer, length)
        .line(0.0, length);
    // Handle from the middle of the head, slightly flared towards its end.
    let handle = Stick {
        curve: 5,
        height: 0.51 * length,
        reach: length * draw.uniform(2.0, 3.0),
        rise: 0.0,
        root: [0.8 * thick, thick],
        end: [0.95 * thick, 1.15 * thick],
        belly: draw.uniform(-0.1, 0.15),
        azimuth: FRONT,
    };
    // Lowest point once the handle hangs down: its rounded end lies at height 0.
    let bottom = handle.reach + radius;
    let mut surface = with_sticks(&profile, &[handle], triangles);
    // A quarter of a revolution about y: the handle from +x to -z.
    for [x, _, z] in &mut surface.positions {
        (*x, *z) = (*z - length / 2.0, bottom - *x);
    }
    surface
}

/// A banana: a tube along an arc, thick in the middle.
pub(super) fn banana(draw: &mut Stream, triangles: usize) -> Surface {
    let (length, bend) = (draw.uniform(0.14, 0.21), draw.uniform(0.7, 1.5));
    let thick = draw.uniform(0.015, 0.021);
    let (stem, width) = (draw.uniform(0.25, 0.4), draw.uniform(0.9, 1.1));
    let radius = length / bend;
    // Lies on its back, ends up.
    let path = |u: f64| {
        let (sin, cos) = libm::sincos(bend * (u - 0.5));
        [radius * sin, thick + radius * (1.0 - cos)]
    };
    let radii = |u: f64| {
        let body = libm::sqrt((1.0 - (2.0 * u - 1.0) * (2.0 * u - 1.0)).max(0.0));
        // A stem at one end.
        let stalk = stem * rounded((1.0 - u) * length, 0.3 * thick) * libm::fmin(1.0, 6.0 * u);
        let reach = thick * libm::fmax(body * libm::fmin(1.0, 0.35 + 5.0 * (1.0 - u)), stalk);
        [width * reach, reach]
    };
    let girth = 2.0 * PI * thick;
    let columns = (libm::sqrt(triangles as f64 / 2.0 * girth / length) as usize / 2 * 2).max(12);
    let sections = triangles.div_ceil(2 * columns);
    Tube { path: &path, radii: &radii, sections, azimuth: FRONT }.alone(columns)
}
