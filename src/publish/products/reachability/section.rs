//! A cross-section through a map: a rose of approach directions in each cell, over the field.

use std::fmt::Write as _;

use nalgebra::Vector3;
use serde::Serialize;

use super::{
    census::Census,
    contour::{Plane, band_colour},
};
use crate::{
    chart::short,
    escape::html as escaped,
    markup::Markup,
    picture::{Colour, Picture},
};
use kernel::geom::{PoseGrid, PoseLabel, approach_directions};

/// Side of a rose [px of the drawing].
const SIDE: f64 = 44.0;
/// Room for axes on the left and below.
const MARGIN: f64 = 46.0;
/// Maximum number of roses along an axis; finer grids show every second, third, ... position.
const MAX: usize = 30;

/// The plane of a section, and its viewing side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Horizontal at this cell of z, from above: x up, y to the left.
    Level(usize),
    /// Vertical at this cell of y, from -y: x to the right, z up.
    Upright(usize),
}

impl Cut {
    /// Axes to the right and up and across, and the sign of the first one.
    fn axes(self) -> ([usize; 3], f64) {
        match self {
            Self::Level(_) => ([1, 0, 2], -1.0),
            Self::Upright(_) => ([0, 2, 1], 1.0),
        }
    }

    /// A direction to the right, up and towards the eye.
    fn seen(self, direction: &Vector3<f64>) -> [f64; 3] {
        let [x, y, z] = [direction.x, direction.y, direction.z];
        match self {
            Self::Level(_) => [-y, x, z],
            Self::Upright(_) => [x, z, -y],
        }
    }

    /// `z = 0.7 m`.
    pub fn name(self, grid: &PoseGrid) -> String {
        let ([_, _, across], _) = self.axes();
        let (Self::Level(cell) | Self::Upright(cell)) = self;
        let axis = &grid.position_axes()[across];
        // Rounding errors of `first + index * step` are not shown.
        let at = (axis.centre(cell) * 1e6).round() / 1e6 + 0.0;
        format!("{} = {} m", axis.name, short(at))
    }

    /// Stride of the positions with a rose.
    pub fn stride(self, grid: &PoseGrid) -> usize {
        let ([right, up, _], _) = self.axes();
        grid.position_counts()[right].max(grid.position_counts()[up]).div_ceil(MAX)
    }

    /// The drawing as an `<svg>` element. `band` is the width of the field's bands, in its unit.
    pub fn svg(self, grid: &PoseGrid, census: &Census, band: f64) -> Markup {
        let ([right, up, _], sense) = self.axes();
        let count = [right, up].map(|axis| grid.position_counts()[axis]);
        let stride = self.stride(grid);
        // A rose represents a square of `stride` cells, and is at its middle.
        let cell = SIDE / stride as f64;
        let [width, height] = count.map(|count| count as f64 * cell);
        // Distance by which roses at the rim extend beyond it.
        let out = (SIDE - cell) / 2.0;
        let name = escaped(&self.name(grid));
        // All cuts have the same scale: marks and letters do not depend on the number of positions.
        let wide = width + MARGIN + 8.0 + 2.0 * out;
        let mut svg = format!(
            concat!(
                r#"<svg class="chart cut" style="max-width:{wide}px" viewBox="{} {} {wide} {}" role="img" "#,
                r#"aria-label="cross-section {name}"><title>cross-section {name}</title>"#
            ),
            -MARGIN - out,
            -8.0 - out,
            height + MARGIN + 2.0 * out,
            wide = wide,
            name = name,
        );
        let plane = self.plane(grid, census);
        let _ = write!(
            svg,
            r#"<image width="{width}" height="{height}" preserveAspectRatio="none" href="{}"/>"#,
            plane.bands(band).to_data_uri()
        );
        if let Some((min, max)) = plane.range() {
            let (first, last) = ((min / band).ceil() as i64, (max / band).floor() as i64);
            let others = (first.max(-20)..=last.min(40)).filter(|level| *level != 0);
            let lines: String = others.map(|level| plane.line(level as f64 * band, cell)).collect();
            let border = plane.line(0.0, cell);
            let _ = write!(svg, r#"<path class="level" d="{lines}"/><path class="border" d="{border}"/>"#);
        }
        self.scales(&mut svg, grid, [width, height], cell);
        let roses = Roses::new(self);
        let mut ink = Inks::default();
        for column in (0..count[0]).step_by(stride) {
            for row in (0..count[1]).step_by(stride) {
                let index = if sense < 0.0 { count[0] - 1 - column } else { column };
                let position = &census.positions[self.position(grid, index, row)];
                let middle = [(column as f64 + 0.5) * cell, height - (row as f64 + 0.5) * cell];
                roses.draw(&mut ink, middle, &position.approaches);
            }
        }
        ink.write(&mut svg);
        svg.push_str("</svg>");
        Markup(svg)
    }

    /// Index of a position in C order over x, y, z.
    fn position(self, grid: &PoseGrid, right: usize, up: usize) -> usize {
        let index = match self {
            Self::Level(z) => [up, right, z],
            Self::Upright(y) => [right, y, up],
        };
        PoseGrid::position(grid.position_counts(), index)
    }

    /// Largest number of pixels per position that fits a square of `side` pixels.
    pub fn fitting_cell(self, grid: &PoseGrid, side: u32) -> u32 {
        let ([right, up, _], _) = self.axes();
        let positions = grid.position_counts()[right].max(grid.position_counts()[up]);
        (side / positions.max(1) as u32).max(1)
    }

    /// The cut as a picture without roses, `cell` pixels per position: green by the share of reachable directions, orange by that
    /// of colliding ones, white by that of unreachable ones.
    pub fn picture(self, grid: &PoseGrid, census: &Census, cell: u32) -> Picture {
        let ([right, up, _], sense) = self.axes();
        let [columns, rows] = [right, up].map(|axis| grid.position_counts()[axis]);
        let mut picture = Picture::filled(columns as u32 * cell, rows as u32 * cell, [255; 4]);
        for column in 0..columns {
            for row in 0..rows {
                let index = if sense < 0.0 { columns - 1 - column } else { column };
                let approaches = &census.positions[self.position(grid, index, row)].approaches;
                let count = |wanted: PoseLabel| approaches.iter().flatten().filter(|label| **label == wanted).count();
                let [free, hit] = [PoseLabel::Reachable, PoseLabel::Colliding].map(count);
                let all = approaches.iter().flatten().count().max(1);
                let mixed = std::array::from_fn(|part| {
                    let [green, orange] = [Colour::TOUCHED, Colour::COMPLETE].map(|Colour(ink)| usize::from(ink[part]));
                    let sum = free * green + hit * orange + (all - free - hit) * 255;
                    ((sum + all / 2) / all) as u8
                });
                let (left, top) = (column as u32 * cell, (rows - 1 - row) as u32 * cell);
                picture.fill(left..left + cell, top..top + cell, Colour(mixed).opaque());
            }
        }
        picture
    }

    fn plane(self, grid: &PoseGrid, census: &Census) -> Plane {
        let ([right, up, _], sense) = self.axes();
        let shape = [right, up].map(|axis| grid.position_counts()[axis]);
        let mut values = Vec::with_capacity(shape[0] * shape[1]);
        for column in 0..shape[0] {
            let index = if sense < 0.0 { shape[0] - 1 - column } else { column };
            values.extend((0..shape[1]).map(|row| census.positions[self.position(grid, index, row)].distance));
        }
        Plane { shape, values }
    }

    /// Numbers along both axes, and the origin of the frame of the poses.
    fn scales(self, svg: &mut String, grid: &PoseGrid, [width, height]: [f64; 2], cell: f64) {
        let ([right, up, _], sense) = self.axes();
        let [across, along] = [right, up].map(|axis| &grid.position_axes()[axis]);
        let from_left = |value: f64| {
            let pixel = ((value - across.first) / across.step + 0.5) * cell;
            if sense < 0.0 { width - pixel } else { pixel }
        };
        let from_top = |value: f64| height - ((value - along.first) / along.step + 0.5) * cell;
        let out = (SIDE - cell) / 2.0;
        let every = |count: usize| count.div_ceil(12);
        let number = |value: f64| short((value * 1e6).round() / 1e6 + 0.0);
        for index in (0..across.count).step_by(every(across.count)) {
            let value = across.centre(index);
            let _ = write!(
                svg,
                r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
                from_left(value),
                height + out + 15.0,
                number(value)
            );
        }
        for index in (0..along.count).step_by(every(along.count)) {
            let value = along.centre(index);
            let _ = write!(
                svg,
                r#"<text x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
                -7.0 - out,
                from_top(value) + 4.0,
                number(value)
            );
        }
        let _ = write!(
            svg,
            concat!(
                r#"<text class="quiet" x="{:.1}" y="{:.1}" text-anchor="middle">{} [m]{}</text>"#,
                r#"<text class="quiet" transform="translate({:.1} {:.1}) rotate(-90)" text-anchor="middle">{} [m]</text>"#
            ),
            width / 2.0,
            height + out + 31.0,
            across.name,
            if sense < 0.0 { ", growing to the left" } else { "" },
            10.0 - MARGIN - out,
            height / 2.0,
            along.name,
        );
        let (x, y) = (from_left(0.0), from_top(0.0));
        if (0.0..=width).contains(&x) && (0.0..=height).contains(&y) {
            let _ = write!(svg, r#"<path class="origin" d="M{:.1} {y:.1}h44M{x:.1} {:.1}v44"/>"#, x - 22.0, y - 22.0);
        }
    }
}

/// Strokes and fillings of one label.
#[derive(Default)]
struct Ink {
    strokes: String,
    fillings: String,
}

/// One entry per label, the most important drawn last.
#[derive(Default)]
struct Inks([Ink; 3]);

impl Inks {
    fn write(&self, svg: &mut String) {
        for (label, Ink { strokes, fillings }) in PoseLabel::ALL.iter().zip(&self.0) {
            let class = class(*label);
            let _ = write!(
                svg,
                r#"<g class="{class}"><path class="stroke" d="{strokes}"/><path class="fill" d="{fillings}"/></g>"#
            );
        }
    }
}

/// The page's name for the colour of a label.
pub fn class(label: PoseLabel) -> &'static str {
    match label {
        PoseLabel::NoSolution => "pose-never",
        PoseLabel::Colliding => "pose-colliding",
        PoseLabel::Reachable => "pose-free",
    }
}

/// The marks of all directions, drawn about (0, 0).
struct Roses(Vec<Ink>);

impl Roses {
    fn new(cut: Cut) -> Self {
        Self(approach_directions().iter().map(|direction| mark(cut.seen(direction))).collect())
    }

    fn draw(&self, inks: &mut Inks, [x, y]: [f64; 2], approaches: &[Option<PoseLabel>; 26]) {
        for (mark, label) in self.0.iter().zip(approaches) {
            let Some(label) = label else { continue };
            let ink = &mut inks.0[*label as usize];
            for (to, from) in [(&mut ink.strokes, &mark.strokes), (&mut ink.fillings, &mark.fillings)] {
                if !from.is_empty() {
                    let _ = write!(to, "M{x:.0} {y:.0}{from}");
                }
            }
        }
    }
}

/// An arrow in the plane, an arrowhead beside its ray for a direction that rises from it (filled) or sinks below it
/// (open), a dot (towards the eye) or a ring (away from it) in the middle. Path data relative to the middle.
fn mark([right, up, near]: [f64; 3]) -> Ink {
    let angle = libm::atan2(up, right);
    let mut ink = Ink::default();
    // Polar coordinates about the middle; relative steps from one point to the next.
    let steps = |points: &[(f64, f64)]| {
        let mut path = String::new();
        let mut last = (0.0, 0.0);
        for (index, (along, aside)) in points.iter().enumerate() {
            let (sine, cosine) = libm::sincos(angle);
            let here = (along * cosine - aside * sine, -(along * sine + aside * cosine));
            let _ = write!(path, "{}{:.1} {:.1}", ["m", "l"][index.min(1)], here.0 - last.0, here.1 - last.1);
            last = here;
        }
        path
    };
    if near.abs() > 0.9 {
        let radius: f64 = if near > 0.0 { 2.2 } else { 4.4 };
        let circle = format!("m{radius} 0a{radius} {radius} 0 1 0 -{0} 0a{radius} {radius} 0 1 0 {0} 0", 2.0 * radius);
        *(if near > 0.0 { &mut ink.fillings } else { &mut ink.strokes }) = circle;
    } else if near.abs() > 0.4 {
        let aside = if near > 0.0 { 3.6 } else { -3.6 };
        let head = [(9.4, aside - 2.0), (14.2, aside), (9.4, aside + 2.0)];
        if near > 0.0 { ink.fillings = steps(&head) + "z" } else { ink.strokes = steps(&head) }
    } else {
        ink.strokes = steps(&[(6.6, 0.0), (17.0, 0.0)]);
        ink.fillings = steps(&[(15.6, -2.3), (21.2, 0.0), (15.6, 2.3)]) + "z";
    }
    ink
}

/// One large rose with labels.
pub fn legend() -> Markup {
    let mut svg = String::from(concat!(
        r#"<svg class="chart cut key" viewBox="-24 -24 200 48" role="img" aria-label="marks of a cell">"#,
        r#"<rect class="cell" x="-22" y="-22" width="44" height="44"/><g class="pose-free">"#
    ));
    let mut draw = |x: f64, y: f64, Ink { strokes, fillings }: &Ink| {
        for (class, path) in [("stroke", strokes), ("fill", fillings)] {
            if !path.is_empty() {
                let _ = write!(svg, r#"<path class="{class}" d="M{x} {y}{path}"/>"#);
            }
        }
    };
    Roses::new(Cut::Level(0)).0.iter().for_each(|mark| draw(0.0, 0.0, mark));
    let rows = [
        (0.0, 28.0, "in the plane"),
        (0.7, 30.5, "rising towards you"),
        (-0.7, 30.5, "sinking away from you"),
        (1.0, 42.0, "straight towards you"),
        (-1.0, 42.0, "straight away from you"),
    ];
    let mut words = String::new();
    for (index, (near, x, text)) in rows.into_iter().enumerate() {
        let y = 9.4 * index as f64 - 18.8;
        // Arrowheads are next to their ray.
        let aside = if near == 0.7 {
            3.6
        } else if near == -0.7 {
            -3.6
        } else {
            0.0
        };
        draw(x, y + aside, &mark([libm::sqrt(1.0 - near * near), 0.0, near]));
        let _ = write!(words, r#"<text class="tiny" x="56" y="{:.1}">{text}</text>"#, y + 2.4);
    }
    Markup(svg + "</g>" + &words + "</svg>")
}

/// A band of the field.
#[derive(Serialize)]
pub struct BandView {
    colour: String,
    /// Lower end.
    from: String,
}

/// The field's bands, from the one that holds `min` to the one that holds `max`.
pub fn band_key(band: f64, min: f64, max: f64) -> Vec<BandView> {
    let (first, last) = ((min / band).floor().max(-8.0) as i64, (max / band).floor().min(24.0) as i64);
    // Far outside, every second band is enough.
    let levels = (first..=last).filter(|level| *level < 4 || level % 2 == 0);
    let view = |level: i64| BandView { colour: band_colour(level as f64).hex(), from: short(level as f64 * band) };
    levels.map(view).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_point_where_they_should() {
        // Right, up (y grows downwards in a drawing), towards the eye.
        assert_eq!(mark([1.0, 0.0, 0.0]).strokes, "m6.6 -0.0l10.4 0.0");
        assert_eq!(mark([0.0, 1.0, 0.0]).strokes, "m0.0 -6.6l0.0 -10.4");
        let (up, down) = (mark([0.7, 0.0, 0.7]), mark([0.7, 0.0, -0.7]));
        assert!(up.strokes.is_empty() && up.fillings.ends_with('z') && down.fillings.is_empty());
        assert!(mark([0.0, 0.0, 1.0]).fillings.contains("2.2") && mark([0.0, 0.0, -1.0]).strokes.contains("4.4"));
        // From above, y grows to the left; from the right side, away from the eye.
        assert_eq!(Cut::Level(0).seen(&Vector3::y()), [-1.0, 0.0, 0.0]);
        assert_eq!(Cut::Upright(0).seen(&Vector3::y()), [0.0, 0.0, -1.0]);
    }
}
