//! Points of an object's surface from which pairs begin, drawn by three schemes, so that handles, rims and blades, which have little
//! area and hold well, get their share.

use std::collections::BTreeMap;

use nalgebra::{Point3, Unit, Vector3};

use kernel::{contact::ContactSurface, geom::SimdLevel, seed::Stream, words::PointScheme};

/// Points of an object, drawn uniformly by area.
const POINTS: usize = 4096;

/// The first octave of thickness ends at twice this [m]; thinner parts belong to it, too.
const THINNEST: f64 = 0.0005;

/// Side of a cell [m].
const CELL: f64 = 0.02;

/// A ray begins so far below the surface [m].
const BELOW: f64 = 1e-6;

/// A point of a surface with the outward unit normal, in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfacePoint {
    pub(super) point: Point3<f64>,
    pub(super) out: Vector3<f64>,
}

/// Draws points of a surface uniformly by area.
struct AreaDraw<'a> {
    surface: &'a ContactSurface,
    level: SimdLevel,
    exits: Vec<(f64, Vector3<f64>)>,
}

impl<'a> AreaDraw<'a> {
    fn new(surface: &'a ContactSurface, level: SimdLevel) -> Self {
        Self { surface, level, exits: Vec::new() }
    }

    /// The next point, with the thickness there [m]: the distance to the first exit along the inward normal, infinite where there is
    /// none.
    fn next(&mut self, stream: &mut Stream) -> Option<(SurfacePoint, f64)> {
        let [share, u, v] = [(); 3].map(|()| stream.unit());
        let (point, out) = self.surface.point_at(share, u, v)?;
        // A triangle without area has no normal.
        let inward = Unit::try_new(-out, 0.5)?;
        let below = point + inward.into_inner() * BELOW;
        self.surface.exits(self.level, &below, &inward, f64::INFINITY, &mut self.exits);
        let thickness = self.exits.first().map_or(f64::INFINITY, |(distance, _)| distance + BELOW);
        Some((SurfacePoint { point, out }, thickness))
    }
}

/// A sample of an object's surface with the thickness: made once per object, a function of the mesh and a key alone.
pub(super) struct SurfaceSample {
    points: Vec<(SurfacePoint, f64)>,
    /// Lowest corner of the object's box: cells are counted from there.
    corner: Point3<f64>,
}

impl SurfaceSample {
    /// Draws 4,096 points uniformly by area.
    pub(super) fn new(surface: &ContactSurface, key: &[u8], level: SimdLevel) -> Self {
        let mut stream = Stream::of_job(0, key, "points of pads");
        let mut draw = AreaDraw::new(surface, level);
        let points = (0..POINTS).filter_map(|_| draw.next(&mut stream)).collect();
        Self { points, corner: surface.bounds().min }
    }

    /// The points no thicker than `widest` [m], in groups.
    pub(super) fn no_thicker_than(&self, widest: f64) -> SurfacePoints {
        let mut points = Vec::new();
        let (mut octaves, mut cells) = (BTreeMap::<u32, Vec<usize>>::new(), BTreeMap::<[i64; 3], Vec<usize>>::new());
        for (point, thickness) in self.points.iter().filter(|(_, thickness)| *thickness <= widest) {
            octaves.entry(octave(*thickness)).or_default().push(points.len());
            cells.entry(cell(&self.corner, &point.point)).or_default().push(points.len());
            points.push(*point);
        }
        SurfacePoints { points, octaves: octaves.into_values().collect(), cells: cells.into_values().collect() }
    }
}

/// Number of the octave of a thickness [m]; thinner parts belong to the first one.
fn octave(thickness: f64) -> u32 {
    let ratio = thickness / THINNEST;
    // Comparisons are exact, a logarithm is not.
    (0..32).find(|octave| ratio < (2u64 << octave) as f64).unwrap_or(32)
}

/// Cell of a point, counted from a corner.
fn cell(corner: &Point3<f64>, point: &Point3<f64>) -> [i64; 3] {
    (point.coords - corner.coords).map(|side| (side / CELL).floor() as i64).into()
}

/// Points of an object that are no thicker there than a hand opens, in groups: shared by threads.
pub struct SurfacePoints {
    points: Vec<SurfacePoint>,
    octaves: Vec<Vec<usize>>,
    cells: Vec<Vec<usize>>,
}

impl SurfacePoints {
    /// Draws 4,096 points uniformly over the area of a body, and keeps those no thicker than `widest` [m]. `key` names the body, as
    /// its digest does.
    pub fn new(surface: &ContactSurface, key: &[u8], widest: f64, level: SimdLevel) -> Self {
        SurfaceSample::new(surface, key, level).no_thicker_than(widest)
    }

    /// A point by three numbers from 0 to 1; `None` if the body is too thick everywhere.
    pub(super) fn at(&self, [scheme, group, place]: [f64; 3]) -> Option<(PointScheme, &SurfacePoint)> {
        let scheme = PointScheme::ALL[index(scheme, PointScheme::ALL.len())];
        self.of_scheme(scheme, [group, place]).map(|point| (scheme, point))
    }

    /// A point of a scheme by two numbers from 0 to 1; `None` if the body is too thick everywhere.
    fn of_scheme(&self, scheme: PointScheme, [group, place]: [f64; 2]) -> Option<&SurfacePoint> {
        if self.points.is_empty() {
            return None;
        }
        let within = |groups: &[Vec<usize>]| {
            let group = &groups[index(group, groups.len())];
            group[index(place, group.len())]
        };
        let chosen = match scheme {
            PointScheme::Area => index(place, self.points.len()),
            PointScheme::Thickness => within(&self.octaves),
            PointScheme::Cells => within(&self.cells),
        };
        Some(&self.points[chosen])
    }

    /// Whether the body is thicker everywhere than the hand opens.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

/// Index of a number from 0 to 1 among `count` equal parts.
fn index(share: f64, count: usize) -> usize {
    ((share * count as f64) as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::{geom::TriMesh, voxel::InsideTest};

    #[test]
    fn octaves_begin_at_half_a_millimetre() {
        let octaves = [0.0, 0.0004, 0.0005, 0.000_999, 0.001, 0.0019, 0.002, 0.0041, 0.08, f64::INFINITY];
        assert_eq!(octaves.map(octave), [0, 0, 0, 0, 1, 1, 2, 3, 7, 32]);
        assert_eq!(cell(&Point3::origin(), &Point3::new(-0.001, 0.0199, 0.0201)), [-1, 0, 1]);
    }

    /// A tray of walls and a floor of 5 mm; the widest hand opens 30 mm.
    #[test]
    fn thin_parts_have_their_share_of_points() {
        let mesh = TriMesh::open_box([0.1, 0.1, 0.06], 0.005);
        let surface = ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
        let sample = SurfaceSample::new(&surface, b"tray", SimdLevel::Scalar);
        let points = sample.no_thicker_than(0.03);
        let thin = sample.points.iter().filter(|(_, thickness)| *thickness <= 0.03).count();
        assert!(points.points.len() == thin && thin < sample.points.len(), "{thin}");
        // 5 mm lie in the octave from 4 to 8 mm, and so do most of the points.
        let sizes: Vec<usize> = points.octaves.iter().map(Vec::len).collect();
        assert!(sizes.iter().max() > Some(&3000), "{sizes:?}");
        // 36 cells of the floor, and 20 along the walls in each of three layers above it.
        assert!(points.cells.len() > 60, "{}", points.cells.len());
        for (number, scheme) in PointScheme::ALL.into_iter().enumerate() {
            let drawn = points.at([(number as f64 + 0.5) / 3.0, 0.3, 0.9]).expect("a point");
            assert_eq!(drawn.0, scheme);
        }
        assert!(SurfacePoints::new(&surface, b"tray", 0.001, SimdLevel::Scalar).is_empty());
    }
}
