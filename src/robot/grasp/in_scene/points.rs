//! Points of a body at which a pad can touch, drawn by three schemes, so that handles, rims and thin parts get their share.

use nalgebra::{Point3, Unit, Vector3};

use std::collections::BTreeMap;

use kernel::{contact::ContactSurface, geom::SimdLevel, seed::Stream};

/// Points of a body.
const POINTS: usize = 4096;

/// The first octave of thickness ends at twice this [m]; thinner parts belong to it, too.
const THINNEST: f64 = 0.0005;

/// Side of a cell [m].
const CELL: f64 = 0.02;

/// A ray begins so far below the surface [m].
const BELOW: f64 = 1e-6;

/// Choice of the first point of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PointScheme {
    /// Uniform over the area.
    Area,
    /// Uniform over the octaves of the body's thickness.
    Thickness,
    /// Uniform over the cells of a grid of 20 mm.
    Cells,
}

impl PointScheme {
    /// All schemes; each draws a third of the points.
    pub const ALL: [Self; 3] = [Self::Area, Self::Thickness, Self::Cells];
}

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfacePoint {
    /// In `Object` [m].
    pub(super) point: Point3<f64>,
    /// The outward normal there.
    pub(super) out: Vector3<f64>,
    /// Distance to the first exit along the inward normal [m].
    thickness: f64,
}

/// Points of a body that are no thicker there than a hand opens, in groups: shared by threads, a function of the mesh alone.
pub struct SurfacePoints {
    points: Vec<SurfacePoint>,
    octaves: Vec<Vec<usize>>,
    cells: Vec<Vec<usize>>,
}

impl SurfacePoints {
    /// Draws 4,096 points uniformly over the area of a body, and keeps those no thicker than `widest` [m]. `key` names the body, as
    /// its digest does.
    pub fn new(surface: &ContactSurface, key: &[u8], widest: f64, level: SimdLevel) -> Self {
        let mut stream = Stream::of_job(0, key, "points of pads");
        let (bounds, mut exits) = (surface.bounds(), Vec::new());
        let far = (bounds.max - bounds.min).norm();
        let mut points = Vec::with_capacity(POINTS);
        for _ in 0..POINTS {
            let [share, u, v] = [(); 3].map(|()| stream.unit());
            let Some((point, out)) = surface.point_at(share, u, v) else { continue };
            let Some(inward) = Unit::try_new(-out, 0.5) else { continue };
            surface.exits(level, &(point + inward.into_inner() * BELOW), &inward, far, &mut exits);
            let thickness = exits.first().map_or(f64::INFINITY, |(distance, _)| distance + BELOW);
            points.push(SurfacePoint { point, out, thickness });
        }
        points.retain(|point| point.thickness <= widest);
        let (mut octaves, mut cells) = (BTreeMap::<i32, Vec<usize>>::new(), BTreeMap::<[i64; 3], Vec<usize>>::new());
        for (index, point) in points.iter().enumerate() {
            let octave = libm::floor(libm::log2(point.thickness / THINNEST)).max(0.0) as i32;
            octaves.entry(octave).or_default().push(index);
            let cell: [i64; 3] =
                (point.point.coords - bounds.min.coords).map(|side| (side / CELL).floor() as i64).into();
            cells.entry(cell).or_default().push(index);
        }
        Self { points, octaves: octaves.into_values().collect(), cells: cells.into_values().collect() }
    }

    /// A point by three numbers from 0 to 1; `None` if the body is too thick everywhere.
    pub(super) fn at(&self, [scheme, group, place]: [f64; 3]) -> Option<(PointScheme, &SurfacePoint)> {
        let index = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        if self.points.is_empty() {
            return None;
        }
        let scheme = PointScheme::ALL[index(scheme, PointScheme::ALL.len())];
        let within = |groups: &[Vec<usize>]| {
            let group = &groups[index(group, groups.len())];
            group[index(place, group.len())]
        };
        let chosen = match scheme {
            PointScheme::Area => index(place, self.points.len()),
            PointScheme::Thickness => within(&self.octaves),
            PointScheme::Cells => within(&self.cells),
        };
        Some((scheme, &self.points[chosen]))
    }

    /// Whether the body is thicker everywhere than the hand opens.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::{geom::TriMesh, voxel::InsideTest};

    /// A tray of walls and a floor of 5 mm; the widest hand opens 30 mm.
    #[test]
    fn thin_parts_have_their_share_of_points() {
        let mesh = TriMesh::open_box([0.1, 0.1, 0.06], 0.005);
        let surface = ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
        let points = SurfacePoints::new(&surface, b"tray", 0.03, SimdLevel::Scalar);
        assert!(points.points.iter().all(|point| point.thickness <= 0.03));
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
