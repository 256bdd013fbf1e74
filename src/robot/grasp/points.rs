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

/// Points by area that are drawn at most until one is on a part that is thin enough.
const AREA_DRAWS: u32 = 8;

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

    /// A point in `Object` [m] drawn by three numbers from 0 to 1, with its scheme and the outward unit normal there; `None` if the
    /// body is too thick everywhere.
    pub fn draw(&self, numbers: [f64; 3]) -> Option<(PointScheme, Point3<f64>, Vector3<f64>)> {
        self.at(numbers).map(|(scheme, point)| (scheme, point.point, point.out))
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

/// Draws points of a surface where it is no thicker than a hand opens, by one of three schemes, each as likely. Points by area are
/// always new ones; those of the other schemes are of a sample.
pub(super) struct PointMixture<'a> {
    surface: &'a ContactSurface,
    points: SurfacePoints,
    /// Thicker parts are left out [m].
    max: f64,
    level: SimdLevel,
}

impl<'a> PointMixture<'a> {
    /// Points where the thickness is at most `max` [m].
    pub(super) fn new(surface: &'a ContactSurface, sample: &SurfaceSample, max: f64, level: SimdLevel) -> Self {
        Self { surface, points: sample.no_thicker_than(max), max, level }
    }

    /// Whether no part is thin enough.
    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Chooses a scheme.
    pub(super) fn scheme(stream: &mut Stream) -> PointScheme {
        PointScheme::ALL[stream.below(PointScheme::ALL.len() as u64) as usize]
    }

    /// Draws a point by a scheme; `None` where no part is thin enough.
    pub(super) fn draw(&self, scheme: PointScheme, stream: &mut Stream) -> Option<SurfacePoint> {
        if scheme == PointScheme::Area {
            let mut draw = AreaDraw::new(self.surface, self.level);
            let mut draws = (0..AREA_DRAWS).filter_map(|_| draw.next(stream));
            return draws.find(|(_, thickness)| *thickness <= self.max).map(|(point, _)| point);
        }
        self.points.of_scheme(scheme, [(); 2].map(|()| stream.unit())).copied()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use kernel::{geom::TriMesh, voxel::InsideTest};

    /// Boxes side by side, given by corners and sides [m].
    pub(in super::super) fn boxes(of: &[[[f64; 3]; 2]]) -> ContactSurface {
        let mut mesh = TriMesh::default();
        for [low, sides] in of {
            let first = mesh.vertices.len() as u32;
            let corner =
                |i: usize| std::array::from_fn(|axis| (low[axis] + sides[axis] * (i >> (2 - axis) & 1) as f64) as f32);
            mesh.vertices.extend((0..8).map(corner));
            let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
            let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
            mesh.triangles.extend(triangles.map(|triangle: [u32; 3]| triangle.map(|vertex| vertex + first)));
        }
        ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface")
    }

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

    /// A block of 60 mm and a handle of 5 mm apart from it: the handle has .05 of the area, half of the octaves, and a
    /// share of the cells.
    #[test]
    fn schemes_share_the_surface_by_their_measures() {
        let surface = boxes(&[[[0.0; 3], [0.06; 3]], [[0.1, 0.0, 0.0], [0.005, 0.02, 0.02]]]);
        let level = SimdLevel::Scalar;
        let sample = SurfaceSample::new(&surface, b"", level);
        let mixture = PointMixture::new(&surface, &sample, 0.08, level);
        let mut stream = Stream::of_job(1, b"", "mixture");
        let share = |scheme: PointScheme, stream: &mut Stream| {
            let drawn = (0..3000).map(|_| mixture.draw(scheme, stream).expect("a thin part").point.x > 0.08);
            drawn.filter(|on_handle| *on_handle).count() as f64 / 3000.0
        };
        let by_area = share(PointScheme::Area, &mut stream);
        assert!((by_area - 1.2e-3 / 22.8e-3).abs() < 0.015, "{by_area}");
        // Thicknesses of 5, 20 and 60 mm: three octaves, two of them on the handle.
        let by_thickness = share(PointScheme::Thickness, &mut stream);
        assert!((by_thickness - 2.0 / 3.0).abs() < 0.03, "{by_thickness}");
        let by_cells = share(PointScheme::Cells, &mut stream);
        assert!(by_cells > 0.02 && by_cells < 0.2, "{by_cells}");
        let schemes: Vec<_> = (0..3000).map(|_| PointMixture::scheme(&mut stream)).collect();
        for scheme in PointScheme::ALL {
            let count = schemes.iter().filter(|other| **other == scheme).count();
            assert!((900..1100).contains(&count), "{scheme:?}: {count}");
        }
    }

    #[test]
    fn parts_that_are_too_thick_are_left_out() {
        let surface = boxes(&[[[0.0; 3], [0.1, 0.1, 0.03]]]);
        let level = SimdLevel::Scalar;
        let sample = SurfaceSample::new(&surface, b"", level);
        let mut stream = Stream::of_job(2, b"", "mixture");
        let mixture = PointMixture::new(&surface, &sample, 0.05, level);
        for _ in 0..300 {
            for scheme in PointScheme::ALL {
                let point = mixture.draw(scheme, &mut stream);
                // Eight draws by area may all be on the narrow sides.
                let level = point.is_none_or(|point| point.out.z.abs() > 0.99);
                assert!(level && (point.is_some() || scheme == PointScheme::Area), "{scheme:?}");
            }
        }
        let none = PointMixture::new(&surface, &sample, 0.01, level);
        assert!(none.is_empty() && PointScheme::ALL.iter().all(|scheme| none.draw(*scheme, &mut stream).is_none()));
    }
}
