//! Families of clean meshes: each draw is another closed solid of some centimetres.

use std::f64::consts::{PI, TAU};

use graspmill::seed::Stream;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::support::solid::{Ends, P3, Solid, circle};

/// A family, by its name: a draw of it, [m]. `fans`: whether plane ends are cut into triangles.
type Family = (&'static str, fn(&mut Stream, fans: Ends) -> Solid);

/// All families.
pub const FAMILIES: [Family; 25] = [
    ("block", block),
    ("prism", prism),
    ("frustum", frustum),
    ("ball of latitudes", latitudes),
    ("icosphere", icosphere),
    ("superquadric", superquadric),
    ("torus", torus),
    ("torus knot", knot),
    ("spring", spring),
    ("vase", vase),
    ("cup with walls", cup),
    ("thin bowl", bowl),
    ("twisted gear", gear),
    ("smooth noise", noise),
    ("union", union),
    ("difference", difference),
    ("intersection", intersection),
    ("blobs", blobs),
    ("ball with a cavity", cavity),
    ("block with several cavities", cavities),
    ("parts apart", apart),
    ("parts that overlap", overlapping),
    ("chain", chain),
    ("wavy plate", plate),
    ("band of half twists", band),
];

/// A solid that only formats with polygons hold: its ends are no stars.
pub fn comb(draw: &mut Stream) -> Solid {
    let (teeth, depth) = (3 + draw.below(12) as usize, draw.uniform(0.3, 0.9));
    let mut outline = vec![[0.0, 0.0], [0.0, 1.0]];
    for tooth in 0..teeth {
        let x = |part: f64| (tooth as f64 + part) / teeth as f64;
        outline.extend([[x(0.5), 1.0], [x(0.5), 1.0 - depth], [x(1.0), 1.0 - depth]]);
        if tooth + 1 < teeth {
            outline.push([x(1.0), 1.0]);
        }
    }
    outline.push([1.0, 0.0]);
    let size = draw.uniform(0.03, 0.2);
    let ring = |z: f64| outline.iter().map(|[x, y]| P3::new(size * x, size * y, z)).collect();
    Solid::sweep(&[ring(0.0), ring(draw.uniform(0.005, 0.05))], Ends::Polygons)
}

fn count(draw: &mut Stream, low: u64, high: u64) -> usize {
    (low + draw.below(high - low + 1)) as usize
}

/// Any rotation, all equally likely (Shoemake 1992).
pub fn rotation(draw: &mut Stream) -> UnitQuaternion<f64> {
    let [share, one, other] = [(); 3].map(|()| draw.unit());
    let (a, b) = ((1.0 - share).sqrt(), share.sqrt());
    let (sin, cos) = (|turn: f64| (TAU * turn).sin(), |turn: f64| (TAU * turn).cos());
    UnitQuaternion::new_normalize(nalgebra::Quaternion::new(a * sin(one), a * cos(one), b * sin(other), b * cos(other)))
}

fn sized(draw: &mut Stream, solid: Solid) -> Solid {
    solid.scaled(draw.uniform(0.02, 0.12))
}

fn outline(points: impl Iterator<Item = [f64; 2]>, height: f64) -> Vec<P3> {
    points.map(|[x, y]| P3::new(x, y, height)).collect()
}

fn block(draw: &mut Stream, ends: Ends) -> Solid {
    let [x, y, z] = [(); 3].map(|()| draw.uniform(0.003, 0.15));
    let ring = |z: f64| outline([[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]].into_iter(), z);
    Solid::sweep(&[ring(0.0), ring(z)], ends)
}

fn prism(draw: &mut Stream, ends: Ends) -> Solid {
    let (corners, height) = (count(draw, 3, 60), draw.uniform(0.1, 3.0));
    let solid = Solid::sweep(&[outline(circle(corners), 0.0), outline(circle(corners), height)], ends);
    sized(draw, solid)
}

fn frustum(draw: &mut Stream, ends: Ends) -> Solid {
    let top = if draw.unit() < 0.5 { 0.0 } else { draw.uniform(0.05, 1.5) };
    let profile = [[1.0, 0.0], [top, draw.uniform(0.2, 3.0)]];
    let solid = Solid::lathe(&profile, count(draw, 3, 96), ends);
    sized(draw, solid)
}

fn latitudes(draw: &mut Stream, ends: Ends) -> Solid {
    let rings = count(draw, 3, 40);
    let at = |ring: usize| {
        let polar = PI * ring as f64 / rings as f64;
        [if ring == 0 || ring == rings { 0.0 } else { polar.sin() }, polar.cos()]
    };
    let profile: Vec<[f64; 2]> = (0..=rings).map(at).collect();
    let solid = Solid::lathe(&profile, count(draw, 3, 80), ends);
    sized(draw, solid)
}

fn icosphere(draw: &mut Stream, _: Ends) -> Solid {
    let mut solid = Solid::icosphere(draw.below(5) as u32);
    let sides = [(); 3].map(|()| draw.uniform(0.2, 1.0));
    solid.points.iter_mut().for_each(|point| (0..3).for_each(|axis| point[axis] *= sides[axis]));
    sized(draw, solid)
}

fn superquadric(draw: &mut Stream, _: Ends) -> Solid {
    let [north, east] = [(); 2].map(|()| draw.uniform(0.3, 1.8));
    let power = |value: f64, exponent: f64| value.signum() * value.abs().powf(exponent);
    let mut solid = Solid::icosphere(4);
    for point in &mut solid.points {
        let (flat, polar) = (point.x.hypot(point.y), point.z);
        let (cos, sin) = if flat > 0.0 { (point.x / flat, point.y / flat) } else { (1.0, 0.0) };
        let across = power(flat, north);
        *point = P3::new(across * power(cos, east), across * power(sin, east), power(polar, north));
    }
    sized(draw, solid)
}

/// A tube of this radius round a closed curve that goes round z.
fn closed_tube(radius: f64, around: usize, steps: usize, curve: impl Fn(f64) -> P3) -> Solid {
    let ring = |step: usize| {
        let at = |step: f64| curve(step / steps as f64);
        let (here, step) = (at(step as f64), step as f64);
        let tangent = (at(step + 1e-3) - at(step - 1e-3)).normalize();
        let radial = Vector3::new(here.x, here.y, 0.0);
        let normal = (radial - tangent * tangent.dot(&radial)).normalize();
        let binormal = tangent.cross(&normal);
        circle(around).map(|[x, y]| here + (normal * x + binormal * y) * radius).collect()
    };
    Solid::sweep(&(0..steps).map(ring).collect::<Vec<_>>(), Ends::Meet(0))
}

fn torus(draw: &mut Stream, _: Ends) -> Solid {
    let (around, steps) = (count(draw, 3, 40), count(draw, 5, 80));
    let solid = closed_tube(draw.uniform(0.05, 0.7), around, steps, |turn| {
        P3::new((TAU * turn).cos(), (TAU * turn).sin(), 0.0)
    });
    sized(draw, solid)
}

fn knot(draw: &mut Stream, _: Ends) -> Solid {
    let [windings, turns] = [[2.0, 3.0], [3.0, 2.0], [2.0, 5.0], [3.0, 4.0], [5.0, 2.0]][draw.below(5) as usize];
    let (around, steps) = (count(draw, 5, 16), count(draw, 150, 300));
    let solid = closed_tube(draw.uniform(0.05, 0.12), around, steps, |share| {
        let (long, short) = (TAU * windings * share, TAU * turns * share);
        let radius = 1.0 + 0.4 * short.cos();
        P3::new(radius * long.cos(), radius * long.sin(), 0.4 * short.sin())
    });
    sized(draw, solid)
}

fn spring(draw: &mut Stream, ends: Ends) -> Solid {
    let (turns, around) = (draw.uniform(2.0, 6.0), count(draw, 4, 16));
    let (steps, rise, radius) = ((24.0 * turns) as usize, draw.uniform(0.35, 0.6), draw.uniform(0.05, 0.15));
    let ring = |step: usize| {
        let turn = TAU * turns * step as f64 / steps as f64;
        let here = P3::new(turn.cos(), turn.sin(), rise * turn / TAU);
        let tangent = Vector3::new(-turn.sin(), turn.cos(), rise / TAU).normalize();
        let normal = Vector3::new(turn.cos(), turn.sin(), 0.0);
        let binormal = tangent.cross(&normal);
        circle(around).map(|[x, y]| here + (normal * x + binormal * y) * radius).collect()
    };
    let solid = Solid::sweep(&(0..=steps).map(ring).collect::<Vec<_>>(), ends);
    sized(draw, solid)
}

/// Radii over the height, smooth and above 0.2.
fn smooth_radius(draw: &mut Stream) -> impl Fn(f64) -> f64 + use<> {
    let waves = [(); 3].map(|()| (draw.uniform(0.0, 0.25), draw.uniform(0.0, TAU)));
    move |height| {
        1.0 + (1..).zip(waves).map(|(k, (size, phase))| size * (PI * f64::from(k) * height + phase).sin()).sum::<f64>()
    }
}

fn vase(draw: &mut Stream, ends: Ends) -> Solid {
    let (radius, rings) = (smooth_radius(draw), count(draw, 3, 40));
    let heights = (0..=rings).map(|ring| ring as f64 / rings as f64);
    let profile: Vec<[f64; 2]> = heights.map(|height| [radius(height), 2.5 * height]).collect();
    let solid = Solid::lathe(&profile, count(draw, 8, 80), ends);
    sized(draw, solid)
}

fn cup(draw: &mut Stream, ends: Ends) -> Solid {
    let (radius, wall) = (smooth_radius(draw), draw.uniform(0.02, 0.15));
    let (rings, height) = (count(draw, 3, 30), 2.0);
    let up = (0..=rings).map(|ring| ring as f64 / rings as f64);
    let outer = up.clone().map(|share| [radius(share), height * share]);
    // The wall is as thick everywhere, measured level.
    let inner = up.rev().map(|share| wall + (height - wall) * share).map(|z| [radius(z / height) - wall, z]);
    let solid = Solid::lathe(&outer.chain(inner).collect::<Vec<_>>(), count(draw, 8, 80), ends);
    sized(draw, solid)
}

fn bowl(draw: &mut Stream, _: Ends) -> Solid {
    let (rings, wall, opening) = (count(draw, 4, 40), draw.uniform(0.01, 0.05), draw.uniform(0.6, 2.2));
    let arc = |radius: f64| {
        (0..=rings)
            .map(move |ring| PI - (PI - opening) * ring as f64 / rings as f64)
            .map(move |polar| [if polar == PI { 0.0 } else { radius * polar.sin() }, radius * polar.cos()])
    };
    let inner: Vec<[f64; 2]> = arc(1.0 - wall).collect();
    let profile: Vec<[f64; 2]> = arc(1.0).chain(inner.into_iter().rev()).collect();
    let solid = Solid::lathe(&profile, count(draw, 12, 80), Ends::Fans);
    sized(draw, solid)
}

fn gear(draw: &mut Stream, ends: Ends) -> Solid {
    let (teeth, depth, twist) = (count(draw, 3, 30), draw.uniform(0.05, 0.4), draw.uniform(-1.0, 1.0));
    let (rings, height) = (count(draw, 1, 12), draw.uniform(0.1, 1.5));
    let ring = |ring: usize| {
        let share = ring as f64 / rings as f64;
        let corner = |(index, [x, y]): (usize, [f64; 2])| {
            let radius = if index % 4 < 2 { 1.0 } else { 1.0 - depth };
            let (sin, cos) = (twist * share).sin_cos();
            P3::new(radius * (x * cos - y * sin), radius * (x * sin + y * cos), height * share)
        };
        circle(4 * teeth).enumerate().map(corner).collect()
    };
    let solid = Solid::sweep(&(0..=rings).map(ring).collect::<Vec<_>>(), ends);
    sized(draw, solid)
}

fn noise(draw: &mut Stream, _: Ends) -> Solid {
    let mut solid = Solid::icosphere(4);
    let waves = [(); 6].map(|()| {
        let along = Vector3::from([(); 3].map(|()| draw.uniform(-4.0, 4.0)));
        (along, draw.uniform(0.0, TAU), draw.uniform(0.0, 0.09))
    });
    for point in &mut solid.points {
        let wave = |(along, phase, size): &(Vector3<f64>, f64, f64)| size * (along.dot(&point.coords) + phase).sin();
        *point *= 1.0 + waves.iter().map(wave).sum::<f64>();
    }
    sized(draw, solid)
}

/// Signed distance to a ball, a block, a cylinder or a torus about a point within the unit cube.
fn distance(draw: &mut Stream) -> impl Fn(&P3) -> f64 + use<> {
    let centre = P3::from([(); 3].map(|()| draw.uniform(-0.3, 0.3)));
    let rotation = rotation(draw).inverse();
    let (kind, [a, b, c]) = (draw.below(4), [(); 3].map(|()| draw.uniform(0.2, 0.5)));
    move |point| {
        let at = rotation * (point - centre);
        match kind {
            0 => at.norm() - a,
            1 => (at.x.abs() - a).max(at.y.abs() - b).max(at.z.abs() - c),
            2 => (at.x.hypot(at.y) - a).max(at.z.abs() - b),
            _ => (at.x.hypot(at.y) - a).hypot(at.z) - b / 3.0,
        }
    }
}

/// Cells along each side of the lattices of implicit bodies.
const CELLS: usize = 26;

/// A body cut from two or more others, with some volume left.
fn cut_from_space(draw: &mut Stream, merge: impl Fn(&[f64]) -> f64) -> Solid {
    loop {
        let parts: Vec<_> = (0..count(draw, 2, 4)).map(|_| distance(draw)).collect();
        let solid = Solid::implicit(CELLS, |point| merge(&parts.iter().map(|part| part(point)).collect::<Vec<_>>()));
        if solid.volume() > 0.05 {
            return sized(draw, solid);
        }
    }
}

fn union(draw: &mut Stream, _: Ends) -> Solid {
    cut_from_space(draw, |parts| parts.iter().copied().fold(f64::INFINITY, f64::min))
}

fn difference(draw: &mut Stream, _: Ends) -> Solid {
    cut_from_space(draw, |parts| parts[1..].iter().fold(parts[0], |left, part| left.max(-part)))
}

fn intersection(draw: &mut Stream, _: Ends) -> Solid {
    cut_from_space(draw, |parts| parts[0].max(parts[1]))
}

fn blobs(draw: &mut Stream, _: Ends) -> Solid {
    cut_from_space(draw, |parts| 0.6 - parts.iter().map(|part| (-6.0 * part).exp()).sum::<f64>())
}

fn cavity(draw: &mut Stream, _: Ends) -> Solid {
    let (outer, inner) = (Solid::icosphere(3), Solid::icosphere(draw.below(4) as u32));
    let by = [(); 3].map(|()| draw.uniform(-0.1, 0.1));
    let solid = Solid::join([outer, inner.scaled(draw.uniform(0.2, 0.7)).shifted(by).reversed()]);
    sized(draw, solid)
}

fn cavities(draw: &mut Stream, ends: Ends) -> Solid {
    let ring = |z: f64| outline([[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]].into_iter(), z);
    let mut parts = vec![Solid::sweep(&[ring(0.0), ring(1.0)], ends)];
    for hole in 0..count(draw, 1, 4) {
        let ball = Solid::icosphere(2).scaled(draw.uniform(0.1, 0.4)).shifted([hole as f64 + 0.5, 0.5, 0.5]);
        parts.push(ball.reversed());
    }
    sized(draw, Solid::join(parts))
}

/// A few solids of other families.
fn few(draw: &mut Stream, ends: Ends, mut place: impl FnMut(&mut Stream, usize) -> [f64; 3]) -> Solid {
    let makers: [fn(&mut Stream, Ends) -> Solid; 6] = [block, prism, frustum, torus, vase, icosphere];
    let parts = 2 + draw.below(6) as usize;
    let part = |index: usize| {
        let maker = makers[draw.below(makers.len() as u64) as usize];
        let solid = maker(draw, ends).moved(&Isometry3::from_parts(Default::default(), rotation(draw)));
        solid.shifted(place(draw, index))
    };
    Solid::join((0..parts).map(part).collect::<Vec<_>>())
}

fn apart(draw: &mut Stream, ends: Ends) -> Solid {
    // Each is less than 0.5 m wide.
    few(draw, ends, |_, index| [0.5 * index as f64, 0.0, 0.0]).scaled(0.4)
}

fn overlapping(draw: &mut Stream, ends: Ends) -> Solid {
    few(draw, ends, |draw, _| [(); 3].map(|()| draw.uniform(-0.05, 0.05)))
}

fn chain(draw: &mut Stream, _: Ends) -> Solid {
    let link = |index: usize| {
        let ring = closed_tube(0.2, 8, 24, |turn| P3::new((TAU * turn).cos(), (TAU * turn).sin(), 0.0));
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI / 2.0 * index as f64);
        ring.moved(&Isometry3::from_parts(Default::default(), turned)).shifted([1.3 * index as f64, 0.0, 0.0])
    };
    let links = Solid::join((0..count(draw, 2, 9)).map(link));
    links.scaled(draw.uniform(0.01, 0.04))
}

fn plate(draw: &mut Stream, _: Ends) -> Solid {
    let (cells, thickness) = (count(draw, 4, 30) as u32, draw.uniform(0.005, 0.05));
    let [x_waves, y_waves] = [(); 2].map(|()| draw.uniform(0.0, 6.0));
    let row = cells + 1;
    let vertex = |top: u32, x: u32, y: u32| (top * row + x) * row + y;
    let mut solid = Solid::default();
    for [top, x, y] in (0..2).flat_map(|top| (0..row).flat_map(move |x| (0..row).map(move |y| [top, x, y]))) {
        let [u, v] = [x, y].map(|along| f64::from(along) / f64::from(cells));
        let height = 0.1 * (x_waves * u).sin() * (y_waves * v).cos();
        solid.points.push(P3::new(u, v, height + thickness * f64::from(top)));
    }
    for [x, y] in (0..cells).flat_map(|x| (0..cells).map(move |y| [x, y])) {
        let quad = |top: u32| [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]].map(|[x, y]| vertex(top, x, y)).to_vec();
        solid.faces.push(quad(1));
        solid.faces.push(quad(0).into_iter().rev().collect());
    }
    for step in 0..cells {
        // Along the four sides, counter-clockwise seen from above.
        let sides = [
            [[step, 0], [step + 1, 0]],
            [[cells, step], [cells, step + 1]],
            [[cells - step, cells], [cells - step - 1, cells]],
            [[0, cells - step], [0, cells - step - 1]],
        ];
        for [[ax, ay], [bx, by]] in sides {
            solid.faces.push(vec![vertex(0, ax, ay), vertex(0, bx, by), vertex(1, bx, by), vertex(1, ax, ay)]);
        }
    }
    sized(draw, solid)
}

/// A band with thickness, whose ends meet after some half twists: closed and two-sided, unlike the strip that it follows.
fn band(draw: &mut Stream, _: Ends) -> Solid {
    let (half_twists, steps, thickness) = (draw.below(4) as usize, count(draw, 40, 160), draw.uniform(0.01, 0.1));
    let across: Vec<[f64; 2]> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].to_vec();
    let ring = |step: usize| {
        let share = step as f64 / steps as f64;
        let (turn, tilt) = (TAU * share, PI * half_twists as f64 * share);
        let corner = |&[x, y]: &[f64; 2]| {
            let (x, y) = (0.3 * x, thickness * y);
            let (out, up) = (x * tilt.cos() - y * tilt.sin(), x * tilt.sin() + y * tilt.cos());
            P3::new((1.0 + out) * turn.cos(), (1.0 + out) * turn.sin(), up)
        };
        across.iter().map(corner).collect()
    };
    let solid = Solid::sweep(&(0..steps).map(ring).collect::<Vec<_>>(), Ends::Meet(2 * (half_twists % 2)));
    sized(draw, solid)
}
