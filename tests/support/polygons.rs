//! Regions of a plane with holes, whose areas their rings alone tell, as faces and as prisms.

use std::f64::consts::{PI, TAU};

use graspmill::{geom::rotation_from_rpy, seed::Stream};
use nalgebra::Vector3;

/// A region of a plane: a ring around it and rings around its holes, all counter-clockwise.
pub struct Region {
    pub kind: &'static str,
    pub rings: Vec<Vec<[f64; 2]>>,
    /// The face: ring and corner of each of its corners. Holes are joined to the outer ring by bridges that are run along both
    /// ways.
    pub outline: Vec<(usize, usize)>,
}

/// Signed area of a ring, by the sum of Gauss.
fn ring_area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|([x, y], [u, v])| (x * v - u * y) / 2.0).sum()
}

fn ring_length(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|([x, y], [u, v])| libm::hypot(u - x, v - y)).sum()
}

fn polar(radius: f64, angle: f64) -> [f64; 2] {
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

fn circle(centre: [f64; 2], radius: f64, start: f64, count: usize) -> Vec<[f64; 2]> {
    let point = |step: usize| polar(radius, start + TAU * step as f64 / count as f64);
    (0..count).map(|step| [0, 1].map(|axis| centre[axis] + point(step)[axis])).collect()
}

impl Region {
    /// A region of one ring.
    fn simple(kind: &'static str, ring: Vec<[f64; 2]>) -> Self {
        let outline = (0..ring.len()).map(|corner| (0, corner)).collect();
        Self { kind, rings: vec![ring], outline }
    }

    /// The region whose corners number about `corners`, of the kind that `index` chooses.
    pub fn drawn(index: usize, corners: usize, draw: &mut Stream) -> Self {
        match index % 10 {
            0 => Self::star(corners, draw),
            1 => Self::spiral(corners),
            2 => Self::comb(corners, draw),
            3 => Self::keyhole(corners, 1, draw),
            4 => Self::keyhole(corners, 2 + draw.below(6) as usize, draw),
            5 => Self::nested_holes(corners, draw),
            6 => Self::gear(corners),
            7 => Self::blob(corners, draw),
            8 => Self::straight_runs(corners, draw),
            _ => Self::keyhole(corners, 3, draw).with_repeats(draw),
        }
    }

    fn star(corners: usize, draw: &mut Stream) -> Self {
        let inner = draw.uniform(0.2, 0.8);
        let point =
            |step: usize| polar(if step.is_multiple_of(2) { 1.0 } else { inner }, TAU * step as f64 / corners as f64);
        Self::simple("star", (0..corners / 2 * 2).map(point).collect())
    }

    fn spiral(corners: usize) -> Self {
        let turns = (corners as f64 / 40.0).clamp(0.7, 6.0);
        let steps = corners / 2;
        let side = |width: f64| {
            (0..steps).map(move |step| {
                let share = step as f64 / (steps - 1) as f64;
                polar(0.2 + 0.8 * share + width / turns.max(1.0), TAU * turns * share)
            })
        };
        Self::simple("spiral", side(0.35).chain(side(0.0).rev()).collect())
    }

    fn comb(corners: usize, draw: &mut Stream) -> Self {
        let teeth = corners / 4;
        let mut ring = vec![[0.0, 0.0], [1.0, 0.0]];
        for tooth in (0..teeth).rev() {
            let [left, right] = [0.0, 0.6].map(|part| (tooth as f64 + part) / teeth as f64);
            let height = draw.uniform(0.3, 1.0);
            ring.extend([[right, 0.2], [right, height], [left, height], [left, 0.2]]);
        }
        Self::simple("comb", ring)
    }

    fn gear(corners: usize) -> Self {
        let point = |step: usize| polar(if step % 4 < 2 { 1.0 } else { 0.8 }, TAU * step as f64 / corners as f64);
        Self::simple("gear", (0..corners / 4 * 4).map(point).collect())
    }

    fn blob(corners: usize, draw: &mut Stream) -> Self {
        let waves: Vec<[f64; 3]> =
            (1..6).map(|wave| [f64::from(wave), draw.uniform(0.0, 0.12), draw.uniform(0.0, TAU)]).collect();
        let point = |step: usize| {
            let angle = TAU * step as f64 / corners as f64;
            let bend = waves.iter().map(|[wave, height, phase]| height * libm::cos(wave * angle + phase));
            polar(1.0 + bend.sum::<f64>(), angle)
        };
        Self::simple("blob", (0..corners).map(point).collect())
    }

    /// An L whose straight sides have corners all along.
    fn straight_runs(corners: usize, draw: &mut Stream) -> Self {
        let (x, y) = (draw.uniform(0.3, 0.7), draw.uniform(0.3, 0.7));
        let turns = [[0.0, 0.0], [1.0, 0.0], [1.0, y], [x, y], [x, 1.0], [0.0, 1.0]];
        let parts = (corners / 6).max(1);
        let ring = (0..6 * parts).map(|step| {
            let (from, to) = (turns[step / parts], turns[(step / parts + 1) % 6]);
            [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * (step % parts) as f64 / parts as f64)
        });
        Self::simple("straight runs", ring.collect())
    }

    /// A ring whose corners are seen from the middle, with round holes about the middle, each bridged outward.
    fn keyhole(corners: usize, holes: usize, draw: &mut Stream) -> Self {
        let round = (corners / (2 * holes)).clamp(3, 400);
        let outer = corners.saturating_sub(holes * round).max(4 * holes).max(8);
        let ring = (0..outer).map(|step| polar(draw.uniform(0.9, 1.3), TAU * step as f64 / outer as f64)).collect();
        let radius = 0.2_f64.min(0.4 * libm::sin(PI / (holes.max(2) as f64)));
        let mut region = Self { kind: "keyhole", rings: vec![ring], outline: Vec::new() };
        let mut bridges = vec![None; outer];
        for hole in 0..holes {
            let at = hole * outer / holes;
            let angle = TAU * at as f64 / outer as f64;
            bridges[at] = Some(region.rings.len());
            region.rings.push(circle(polar(0.6, angle), radius, angle, round));
        }
        for (corner, bridge) in bridges.into_iter().enumerate() {
            region.outline.push((0, corner));
            if let Some(hole) = bridge {
                region.outline.extend(around_hole(hole, round));
                region.outline.push((0, corner));
            }
        }
        region
    }

    /// A hole bridged outward, with a second one bridged to its far side.
    fn nested_holes(corners: usize, draw: &mut Stream) -> Self {
        let mut region = Self::keyhole(corners, 1, draw);
        let round = region.rings[1].len() / 2 * 2;
        region.rings[1] = circle([0.6, 0.0], 0.2, 0.0, round);
        region.rings.push(circle([-0.1, 0.0], 0.15, 0.0, round));
        let far = (1, round / 2);
        region.outline = vec![(0, 0)];
        for corner in around_hole(1, round) {
            region.outline.push(corner);
            if corner == far {
                region.outline.extend(around_hole(2, round));
                region.outline.push(far);
            }
        }
        region.outline.extend((0..region.rings[0].len()).map(|corner| (0, corner)));
        Self { kind: "nested holes", ..region }
    }

    /// This region with some corners named twice or three times in a row.
    fn with_repeats(self, draw: &mut Stream) -> Self {
        let times = |draw: &mut Stream| if draw.unit() < 0.1 { 2 + draw.below(2) as usize } else { 1 };
        let outline = self.outline.into_iter().flat_map(|corner| vec![corner; times(draw)]).collect();
        Self { kind: "repeated corners", outline, ..self }
    }

    pub fn corners(&self) -> usize {
        self.outline.len()
    }

    pub fn holes(&self) -> usize {
        self.rings.len() - 1
    }

    /// Area of the region.
    pub fn area(&self) -> f64 {
        ring_area(&self.rings[0]) - self.rings[1..].iter().map(|ring| ring_area(ring)).sum::<f64>()
    }

    /// Length of all rings.
    pub fn perimeter(&self) -> f64 {
        self.rings.iter().map(|ring| ring_length(ring)).sum()
    }
}

/// Corners of a hole from its first one back to it, clockwise.
fn around_hole(hole: usize, round: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..=round).map(move |step| (hole, (round - step) % round))
}

/// A prism over a region, somewhere in space.
pub struct Prism {
    pub positions: Vec<[f64; 3]>,
    pub faces: Vec<Vec<usize>>,
    /// Volume [m^3] and area [m^2], by the rings.
    pub volume: f64,
    pub area: f64,
    /// Sides of the region [m], for errors.
    pub perimeter: f64,
}

impl Prism {
    /// A prism of this height over a region that is this large, both in metres per unit of the region, in any attitude.
    pub fn over(region: &Region, scale: f64, height: f64, draw: &mut Stream) -> Self {
        let rotation = rotation_from_rpy(draw.uniform(-PI, PI), draw.uniform(-1.5, 1.5), draw.uniform(-PI, PI));
        Self::placed(region, scale, height, |point| rotation * point)
    }

    /// A prism whose base is the plane z = 0.
    pub fn upright(region: &Region, scale: f64, height: f64) -> Self {
        Self::placed(region, scale, height, |point| point)
    }

    fn placed(region: &Region, scale: f64, height: f64, place: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Self {
        let starts: Vec<usize> = region
            .rings
            .iter()
            .scan(0, |sum, ring| {
                *sum += ring.len();
                Some(*sum - ring.len())
            })
            .collect();
        let points: Vec<[f64; 2]> = region.rings.iter().flatten().copied().collect();
        let level = |z: f64| points.iter().map(move |[x, y]| Vector3::new(scale * x, scale * y, scale * z));
        let positions = level(0.0).chain(level(height)).map(|point| place(point).into()).collect();
        let face: Vec<usize> = region.outline.iter().map(|(ring, corner)| starts[*ring] + corner).collect();
        let top = points.len();
        let mut faces = vec![face.iter().map(|corner| top + corner).collect(), face.into_iter().rev().collect()];
        for (ring, start) in region.rings.iter().zip(&starts) {
            for corner in 0..ring.len() {
                let (a, b) = (start + corner, start + (corner + 1) % ring.len());
                // Outward of the outer ring, into a hole.
                faces.push(if *start == 0 { vec![a, b, top + b, top + a] } else { vec![b, a, top + a, top + b] });
            }
        }
        let (area, perimeter) = (scale * scale * region.area(), scale * region.perimeter());
        let height = scale * height;
        Self { positions, faces, volume: area * height, area: 2.0 * area + perimeter * height, perimeter }
    }

    /// The prism as an OBJ file.
    pub fn to_obj(&self) -> String {
        let vertices = self.positions.iter().map(|[x, y, z]| format!("v {x:.9} {y:.9} {z:.9}\n"));
        let faces = self.faces.iter().map(|face| {
            let corners: Vec<String> = face.iter().map(|corner| (corner + 1).to_string()).collect();
            format!("f {}\n", corners.join(" "))
        });
        vertices.chain(faces).collect()
    }

    /// The prism as an OFF file.
    pub fn to_off(&self) -> String {
        format!("OFF\n{} {} 0\n", self.positions.len(), self.faces.len()) + &self.rows()
    }

    /// The prism as a PLY file in text.
    pub fn to_ply(&self) -> String {
        let (vertices, faces) = (self.positions.len(), self.faces.len());
        format!(
            "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\nproperty double z\n\
             element face {faces}\nproperty list int int vertex_indices\nend_header\n"
        ) + &self.rows()
    }

    /// Vertices and faces as OFF and PLY list them.
    fn rows(&self) -> String {
        let vertices = self.positions.iter().map(|[x, y, z]| format!("{x:.9} {y:.9} {z:.9}\n"));
        let faces = self.faces.iter().map(|face| {
            let corners: Vec<String> = face.iter().map(ToString::to_string).collect();
            format!("{} {}\n", face.len(), corners.join(" "))
        });
        vertices.chain(faces).collect()
    }
}

/// A plate with round or square outlines: `corners` of the outer ring and of the hole, and their radii.
pub fn plate(outer: (usize, f64), hole: (usize, f64)) -> Region {
    // A square rests on a side.
    let start = |corners: usize| if corners == 4 { PI / 4.0 } else { 0.0 };
    let rings = [outer, hole].map(|(corners, radius)| circle([0.0; 2], radius, start(corners), corners)).to_vec();
    let outline = (0..outer.0).map(|corner| (0, corner)).chain([(0, 0)]).chain(around_hole(1, hole.0)).collect();
    Region { kind: "plate", rings, outline }
}
