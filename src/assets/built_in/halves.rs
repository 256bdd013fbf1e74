//! The conjoined half-shapes of thesis ch. 6: a camera in front cannot distinguish some backs, touch can.

use std::{
    f64::consts::{PI, TAU},
    fmt,
    ops::RangeInclusive,
    str::FromStr,
};

use super::surface::Surface;

/// A conjoined half-shape: two halves of one size, joined in the plane x = 0 about the origin.
///
/// The front half lies at x < 0, towards a head-on camera that points along +x. The size is the diameter of a sphere, the
/// side of a cube, the diagonal of a diamond (an octahedron), so all have one box. Written `half-FRONT-BACK` at
/// 100 mm, or with its size, `half-FRONT-BACK-80mm`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfShape {
    front: Half,
    back: Half,
    /// Size in millimetres as the name states it; without one, [`HalfShape::DEFAULT_MILLIMETRES`].
    millimetres: Option<u32>,
}

/// Why a name is no half-shape's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoHalfShape {
    /// A half or both are unknown or missing.
    #[error("half-shapes are called half-FRONT-BACK, each of {}", Half::ALL.map(Half::name).join(", "))]
    Halves,
    /// The text after the name of a half-shape is not a valid size.
    #[error(
        "the size of a half-shape is {} to {} in whole millimetres, like half-cube-sphere-80mm",
        HalfShape::MILLIMETRES.start(),
        HalfShape::MILLIMETRES.end()
    )]
    Size,
}

impl HalfShape {
    /// Sizes that a name may request [mm], limited to what a hand can close on or touch.
    pub const MILLIMETRES: RangeInclusive<u32> = 20..=300;

    /// Default size of a shape [mm].
    const DEFAULT_MILLIMETRES: u32 = 100;

    /// All nine pairs of a front and a back, of this size [mm]; without one, under the names without size.
    pub fn all(millimetres: Option<u32>) -> impl Iterator<Item = Self> {
        let with = move |front| Half::ALL.into_iter().map(move |back| Self { front, back, millimetres });
        Half::ALL.into_iter().flat_map(with)
    }

    /// Whether a head-on camera cannot distinguish this shape from another with the same front and size: the back is
    /// hidden, and this front hides more backs than one.
    ///
    /// So it is of a cube before any back, and of a sphere before a sphere or a diamond.
    pub fn is_ambiguous(self) -> bool {
        let hidden = Half::ALL.into_iter().filter(|back| self.front.hides(*back));
        self.front.hides(self.back) && hidden.count() > 1
    }

    /// The shape in at least `triangles` triangles [m].
    pub(super) fn surface(self, triangles: usize) -> Surface {
        let Self { front, back, millimetres } = self;
        let radius = f64::from(millimetres.unwrap_or(Self::DEFAULT_MILLIMETRES)) / 1000.0 / 2.0;
        // A column every 1/columns of a revolution, a multiple of 8 so that the corners of cube and diamond are hit.
        let columns = libm::ceil(libm::sqrt(triangles as f64) / 8.0) as usize * 8;
        let rows = triangles.div_ceil(4 * columns) + 1;
        let directions: Vec<(f64, f64)> = (0..columns).map(|column| direction(column, columns)).collect();
        let mut surface = Surface::default();
        let front_rim = front.rows(&mut surface, -radius, &directions, rows, None);
        // Where both sections reach equally far the rims share the vertex.
        let shared = |column: usize| {
            let same = libm::fabs(front.reach(directions[column]) - back.reach(directions[column])) < 1e-12;
            same.then(|| front_rim[column])
        };
        let shared: Vec<Option<u32>> = (0..columns).map(shared).collect();
        let back_rim = back.rows(&mut surface, radius, &directions, rows, Some(&shared));
        surface.join(&front_rim, &back_rim);
        surface
    }
}

impl fmt::Display for HalfShape {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "half-{}-{}", self.front.name(), self.back.name())?;
        self.millimetres.map_or(Ok(()), |millimetres| write!(out, "-{millimetres}mm"))
    }
}

impl FromStr for HalfShape {
    type Err = NoHalfShape;

    /// # Errors
    /// When the halves are unknown, or the size is no whole number of millimetres in [`HalfShape::MILLIMETRES`].
    fn from_str(name: &str) -> Result<Self, NoHalfShape> {
        let halves = name.strip_prefix("half-").ok_or(NoHalfShape::Halves)?;
        let (front, rest) = halves.split_once('-').ok_or(NoHalfShape::Halves)?;
        let (back, size) = rest.split_once('-').map_or((rest, None), |(back, size)| (back, Some(size)));
        let half = |name: &str| Half::ALL.into_iter().find(|half| half.name() == name).ok_or(NoHalfShape::Halves);
        let (front, back) = (half(front)?, half(back)?);
        let Some(size) = size else { return Ok(Self { front, back, millimetres: None }) };
        let millimetres = size.strip_suffix("mm").and_then(|number| number.parse().ok());
        let millimetres = millimetres.filter(|millimetres| Self::MILLIMETRES.contains(millimetres));
        let shape = Self { front, back, millimetres };
        // One name a shape: neither `080mm` nor `+80mm`.
        if millimetres.is_some() && shape.to_string() == name { Ok(shape) } else { Err(NoHalfShape::Size) }
    }
}

/// One half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Half {
    Sphere,
    Cube,
    Diamond,
}

impl Half {
    const ALL: [Self; 3] = [Self::Sphere, Self::Cube, Self::Diamond];

    fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Cube => "cube",
            Self::Diamond => "diamond",
        }
    }

    /// From the axis to the rim in a direction (sin, cos) of the middle plane, as a share of half the size.
    fn reach(self, (sin, cos): (f64, f64)) -> f64 {
        match self {
            Self::Sphere => 1.0,
            Self::Cube => 1.0 / libm::fmax(libm::fabs(sin), libm::fabs(cos)),
            Self::Diamond => 1.0 / (libm::fabs(sin) + libm::fabs(cos)),
        }
    }

    /// Height over the middle plane, as a share of half the size, and width, as a share of the rim, from the tip (t = 0)
    /// to the rim (1).
    fn profile(self, t: f64) -> (f64, f64) {
        match self {
            Self::Sphere => {
                let (sin, cos) = libm::sincos(t * PI / 2.0);
                (cos, sin)
            }
            Self::Cube if t < 0.5 => (1.0, 2.0 * t),
            Self::Cube => (2.0 - 2.0 * t, 1.0),
            Self::Diamond => (1.0 - t, t),
        }
    }

    /// Whether `back` is completely hidden behind this half for a head-on camera: its rim, where it is widest, is
    /// nowhere wider.
    fn hides(self, back: Self) -> bool {
        // Rims that differ do so at an eighth of a revolution, where the corners are.
        EIGHTHS.into_iter().all(|direction| back.reach(direction) < self.reach(direction) + 1e-12)
    }

    /// The rows from the tip, `radius` away from the middle plane (negative: in front) [m], to the rim; returns the rim.
    fn rows(
        self,
        surface: &mut Surface,
        radius: f64,
        directions: &[(f64, f64)],
        rows: usize,
        shared: Option<&[Option<u32>]>,
    ) -> Vec<u32> {
        let size = libm::fabs(radius);
        let rows = rows / 2 * 2 + 2;
        let mut last: Vec<u32> = surface.row([[radius, 0.0, 0.0]]).collect();
        for row in 1..=rows {
            let (height, share) = self.profile(row as f64 / rows as f64);
            let at = |&(sin, cos): &(f64, f64)| {
                let width = size * share * self.reach((sin, cos));
                [if row == rows { 0.0 } else { radius * height }, width * cos, width * sin]
            };
            let next: Vec<u32> = directions
                .iter()
                .enumerate()
                .map(|(column, direction)| match shared.and_then(|shared| shared[column]) {
                    Some(vertex) if row == rows => vertex,
                    _ => surface.row([at(direction)]).start,
                })
                .collect();
            if radius < 0.0 {
                surface.join(&last, &next);
            } else {
                surface.join(&next, &last);
            }
            last = next;
        }
        last
    }
}

/// sin and cos of the eighths of a revolution.
const EIGHTHS: [(f64, f64); 8] = {
    const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        (0.0, 1.0),
        (DIAGONAL, DIAGONAL),
        (1.0, 0.0),
        (DIAGONAL, -DIAGONAL),
        (0.0, -1.0),
        (-DIAGONAL, -DIAGONAL),
        (-1.0, 0.0),
        (-DIAGONAL, DIAGONAL),
    ]
};

/// sin and cos of a column, exact at the eighths of a revolution where the corners are.
fn direction(column: usize, columns: usize) -> (f64, f64) {
    match (8 * column).is_multiple_of(columns) {
        true => EIGHTHS[8 * column / columns],
        false => libm::sincos(TAU * column as f64 / columns as f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_shapes_have_half_of_each_volume() {
        for (millimetres, size) in [(None, 0.1_f64), (Some(20), 0.02), (Some(100), 0.1), (Some(137), 0.137)] {
            let whole = |half| match half {
                Half::Sphere => PI / 6.0 * size.powi(3),
                Half::Cube => size.powi(3),
                Half::Diamond => size.powi(3) / 6.0,
            };
            for shape in HalfShape::all(millimetres) {
                let wanted = (whole(shape.front) + whole(shape.back)) / 2.0;
                let found = shape.surface(20_000).volume();
                let round = [shape.front, shape.back].contains(&Half::Sphere);
                assert!((found / wanted - 1.0).abs() < if round { 1e-3 } else { 1e-12 }, "{shape} {found} {wanted}");
            }
        }
    }

    #[test]
    fn a_name_without_a_size_is_100_mm() {
        for (plain, sized) in HalfShape::all(None).zip(HalfShape::all(Some(100))) {
            assert_eq!(format!("{plain}-100mm"), sized.to_string());
            let (plain, sized) = (plain.surface(6000), sized.surface(6000));
            assert_eq!((plain.positions, plain.faces), (sized.positions, sized.faces));
        }
    }

    #[test]
    fn names_say_halves_and_size_and_nothing_else() {
        for shape in [None, Some(20), Some(80), Some(300)].into_iter().flat_map(HalfShape::all) {
            assert_eq!(shape.to_string().parse(), Ok(shape));
        }
        for name in ["half-cube", "half-cube-egg", "half-cube-egg-80mm", "halve-cube-cube", "cube-cube", "half-"] {
            assert_eq!(name.parse::<HalfShape>(), Err(NoHalfShape::Halves), "{name}");
        }
        for size in ["19mm", "301mm", "080mm", "+80mm", "80", "80.5mm", "8cm", "mm", "", "80mm-80mm", "4294967376mm"] {
            assert_eq!(format!("half-cube-cube-{size}").parse::<HalfShape>(), Err(NoHalfShape::Size), "{size}");
        }
    }

    #[test]
    fn five_of_nine_are_ambiguous_head_on() {
        let ambiguous: Vec<String> =
            HalfShape::all(None).filter(|shape| shape.is_ambiguous()).map(|shape| shape.to_string()).collect();
        let wanted = ["sphere-sphere", "sphere-diamond", "cube-sphere", "cube-cube", "cube-diamond"];
        assert_eq!(ambiguous, wanted.map(|pair| format!("half-{pair}")));
    }
}
