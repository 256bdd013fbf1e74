//! Seals of cups: the surface below the lip and inside of it, measured by rays along the axis.
//!
//! Rays start behind the object's near side and run along the approach, so that a part of the object in the way of the cup is met
//! first. 72 rays meet the surface along the lip, as many as SuctionNet-1Billion (Cao et al. 2021) has bins; one on the axis and 24
//! each at 0.35, 0.6 and 0.8 of the radius inside of it; 24 along the outer edge. Each must enter the mesh.
//!
//! The lip's points are compared with the plane fitted to them, to which the bellows tilt. A ring is flat on a ball, too: the
//! curvature comes from a quadric fitted to all points up to the lip, and not from angles between facets, which depend on the mesh.

use std::f64::consts::TAU;

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Translation3, Unit, Vector2, Vector3};

use super::{
    cup::SuctionCup,
    shape::{LIP, RING, SealShape},
};
use crate::grasp::STAND_OFF;
use kernel::{
    contact::ContactSurface,
    geom::{SimdLevel, rotation_towards},
};

/// Circles inside of the lip, as shares of its radius.
const RINGS: [f64; 3] = [0.35, 0.6, 0.8];

/// Smallest margin: where a measure is twice its limit or more.
const LOWEST: f64 = -1.0;

/// Limit of a seal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SealLimit {
    /// Every ray enters the mesh.
    Surface,
    /// Range of the lip's distances along the axis: the stroke of the bellows.
    Stroke,
    /// Range of the lip's distances from a plane: the flex of the lip.
    Flex,
    /// Stretch of a piece of the lip.
    Stretch,
    /// Height of the surface inside of the lip: the depth of the cup.
    Bulge,
    /// Depth of the surface inside of the lip or at its outer edge: no hole deeper than the stroke.
    Hole,
    /// Radius of curvature.
    Curvature,
}

impl SealLimit {
    /// All limits.
    pub const ALL: [Self; 7] =
        [Self::Surface, Self::Stroke, Self::Flex, Self::Stretch, Self::Bulge, Self::Hole, Self::Curvature];
}

/// Seal of a cup in a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seal {
    /// Rays that do not enter the mesh.
    pub missed: u32,
    /// Measures of the surface; `None` if a ray misses it.
    pub shape: Option<SealShape>,
    /// Limit that is used most.
    pub weakest: SealLimit,
    /// 1 less the largest share of a limit that is used, at least -1; minus the share of rays that miss, if any does. The cup seals
    /// where it is at least 0.
    pub margin: f64,
}

impl Seal {
    fn missed(missed: usize, rays: usize) -> Self {
        let margin = -(missed as f64 / rays as f64);
        Self { missed: missed as u32, shape: None, weakest: SealLimit::Surface, margin }
    }

    fn of(shape: SealShape, cup: &SuctionCup) -> Self {
        let used = used(&shape, cup);
        let (weakest, share) =
            used.into_iter().fold(used[0], |worst, next| if next.1 > worst.1 { next } else { worst });
        Self { missed: 0, shape: Some(shape), weakest, margin: (1.0 - share).max(LOWEST) }
    }

    /// Whether the cup seals.
    pub fn is_sealed(&self) -> bool {
        self.margin >= 0.0
    }
}

/// Measures the surface under a cup. Each thread needs its own.
///
/// ```
/// use kernel::{contact::ContactSurface, geom::{SimdLevel, TriMesh}, voxel::InsideTest};
/// use nalgebra::{Point3, Vector3};
/// use graspmill_robot::suction::{CupSettings, SealMeter, SuctionCup};
///
/// // The floor of a tray of 100 mm, from above, and beside its wall.
/// let tray = ContactSurface::new(&TriMesh::open_box([0.1, 0.1, 0.02], 0.005), InsideTest::WindingNumber)?;
/// let mut meter = SealMeter::new(&SuctionCup::new(CupSettings::default())?, SimdLevel::detect());
/// let seal = meter.measure(&tray, &SealMeter::pose(&Point3::origin(), &-Vector3::z()));
/// assert!(seal.is_sealed() && seal.margin > 0.999);
/// let seal = meter.measure(&tray, &SealMeter::pose(&Point3::new(0.043, 0.0, 0.0), &-Vector3::z()));
/// assert!(!seal.is_sealed(), "on the rim");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SealMeter {
    cup: SuctionCup,
    level: SimdLevel,
    /// Points across the axis [m]: along the lip, inside of it, along its outer edge.
    points: Vec<Vector2<f64>>,
    /// Distances along the axis from the cup's frame, one per point [m]; infinite where a ray misses.
    gaps: Vec<f64>,
    /// Distances of the lip's points from its plane [m].
    residuals: Vec<f64>,
}

impl SealMeter {
    /// A meter of a cup.
    pub fn new(cup: &SuctionCup, level: SimdLevel) -> Self {
        let radius = cup.settings().radius;
        let mut points = circle(radius, LIP);
        points.push(Vector2::zeros());
        points.extend(RINGS.iter().flat_map(|share| circle(share * radius, RING)));
        points.extend(circle(cup.outer_radius(), RING));
        Self {
            cup: *cup,
            level: level.usable(),
            gaps: vec![0.0; points.len()],
            residuals: Vec::with_capacity(LIP),
            points,
        }
    }

    /// The cup.
    pub fn cup(&self) -> &SuctionCup {
        &self.cup
    }

    /// A cup's pose: its frame has the origin at a point of the surface in `Object` [m], and z along the approach, a unit vector.
    pub fn pose(point: &Point3<f64>, approach: &Vector3<f64>) -> IsometryMatrix3<f64> {
        let axes: Matrix3<f64> = rotation_towards(approach, 0.0);
        let rotation = nalgebra::Rotation3::from_matrix_unchecked(axes);
        IsometryMatrix3::from_parts(Translation3::from(point.coords), rotation)
    }

    /// Seal of the cup in a pose on a surface. The cup comes along z from [`STAND_OFF`] behind the origin of its frame.
    pub fn measure(&mut self, surface: &ContactSurface, object_from_cup: &IsometryMatrix3<f64>) -> Seal {
        let approach = Unit::new_unchecked(object_from_cup.rotation * Vector3::z());
        // Deeper than this, the lip misses by more than the stroke even where it touches first on the axis.
        let reach = STAND_OFF + self.cup.outer_radius() + self.cup.settings().stroke;
        for (point, gap) in self.points.iter().zip(&mut self.gaps) {
            let from = object_from_cup * Point3::new(point.x, point.y, -STAND_OFF);
            let hit = surface.entry(self.level, &from, &approach, reach);
            *gap = hit.map_or(f64::INFINITY, |(distance, _)| distance - STAND_OFF);
        }
        let missed = self.gaps.iter().filter(|gap| gap.is_infinite()).count();
        if missed > 0 {
            return Seal::missed(missed, self.gaps.len());
        }
        let radius = self.cup.settings().radius;
        Seal::of(SealShape::of(&self.points, &self.gaps, radius, &mut self.residuals), &self.cup)
    }

    /// The pose, rotated about the origin of its frame so that the axis is normal to the plane of the lip; the pose itself where a ray
    /// misses.
    pub fn aligned(
        &mut self,
        surface: &ContactSurface,
        object_from_cup: &IsometryMatrix3<f64>,
    ) -> IsometryMatrix3<f64> {
        let Some(shape) = self.measure(surface, object_from_cup).shape else { return *object_from_cup };
        // The plane z = a + b x + c y has the normal (-b, -c, 1).
        let [b, c] = shape.slope;
        let approach = object_from_cup.rotation * Vector3::new(-b, -c, 1.0).normalize();
        Self::pose(&Point3::from(object_from_cup.translation.vector), &approach)
    }
}

/// Used share of each limit but the first.
fn used(shape: &SealShape, cup: &SuctionCup) -> [(SealLimit, f64); 6] {
    let settings = cup.settings();
    let curvature = shape.curvatures[0].abs().max(shape.curvatures[1].abs());
    [
        (SealLimit::Stroke, shape.spread / settings.stroke),
        (SealLimit::Flex, shape.flex / settings.lip_flex),
        (SealLimit::Stretch, shape.stretch / settings.max_stretch),
        (SealLimit::Bulge, shape.bulge / settings.inner_depth),
        (SealLimit::Hole, shape.hole / settings.stroke),
        (SealLimit::Curvature, curvature * settings.min_curvature_radius),
    ]
}

/// Evenly spaced points of a circle.
fn circle(radius: f64, count: usize) -> Vec<Vector2<f64>> {
    let point = |index: usize| {
        let (sin, cos) = libm::sincos(TAU * index as f64 / count as f64);
        Vector2::new(cos, sin) * radius
    };
    (0..count).map(point).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{super::cup::CupSettings, *};
    use kernel::{geom::TriMesh, voxel::InsideTest};

    const RADIUS: f64 = 0.01;

    fn surface(mesh: &TriMesh) -> ContactSurface {
        ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface")
    }

    fn meter() -> SealMeter {
        SealMeter::new(&SuctionCup::new(CupSettings::default()).expect("a cup"), SimdLevel::detect())
    }

    /// Surface of revolution about x: circles of these radii at these x, with points at both ends of the axis.
    fn revolved(profile: &[[f64; 2]], ends: [f64; 2], sides: u32) -> TriMesh {
        let ring = |[x, radius]: [f64; 2]| {
            (0..sides).map(move |side| {
                let (sin, cos) = libm::sincos(TAU * f64::from(side) / f64::from(sides));
                [x as f32, (radius * cos) as f32, (radius * sin) as f32]
            })
        };
        let mut vertices: Vec<[f32; 3]> = profile.iter().copied().flat_map(ring).collect();
        let rings = profile.len() as u32;
        let [first, last] = [rings * sides, rings * sides + 1];
        vertices.extend(ends.map(|x| [x as f32, 0.0, 0.0]));
        let mut triangles = Vec::new();
        for side in 0..sides {
            let next = (side + 1) % sides;
            triangles.push([first, next, side]);
            let top = (rings - 1) * sides;
            triangles.push([last, top + side, top + next]);
            for ring in 0..rings - 1 {
                let [a, b] = [ring * sides + side, ring * sides + next];
                triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
            }
        }
        TriMesh { vertices, triangles }
    }

    /// A cylinder of 100 mm about x.
    fn cylinder(radius: f64) -> ContactSurface {
        surface(&revolved(&[[-0.05, radius], [0.05, radius]], [-0.05, 0.05], 1440))
    }

    fn ball(radius: f64) -> ContactSurface {
        let rings = 128;
        let point = |ring: u32| {
            let (sin, cos) = libm::sincos(PI * f64::from(ring) / f64::from(rings));
            [-radius * cos, radius * sin]
        };
        let profile: Vec<_> = (1..rings).map(point).collect();
        surface(&revolved(&profile, [-radius, radius], 128))
    }

    fn shape(seal: &Seal) -> &SealShape {
        seal.shape.as_ref().expect("all rays meet the surface")
    }

    #[test]
    fn meshes_of_the_tests_are_closed() {
        let radius: f64 = 0.03;
        let mesh = revolved(&[[-0.05, radius], [0.05, radius]], [-0.05, 0.05], 1440);
        assert!((mesh.signed_volume() / (PI * radius * radius * 0.1) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_plane_has_no_gap_and_a_tilted_one_is_a_slope() {
        let tray = surface(&TriMesh::open_box([0.2, 0.2, 0.01], 0.01));
        let mut meter = meter();
        for degrees in [0.0f64, 2.0, 10.0] {
            let angle = degrees.to_radians();
            let approach = Vector3::new(angle.sin(), 0.0, -angle.cos());
            let seal = meter.measure(&tray, &SealMeter::pose(&Point3::origin(), &approach));
            let found = shape(&seal);
            assert!((found.tilt() - angle).abs() < 1e-9, "{degrees}: {found:?}");
            assert!((found.spread - 2.0 * RADIUS * angle.tan()).abs() < 1e-5, "{degrees}: {found:?}");
            assert!(found.flex < 1e-9 && found.stretch < 1e-9 && found.bulge.abs() < 1e-9, "{degrees}: {found:?}");
            assert!(found.curvatures.iter().all(|curvature| curvature.abs() < 1e-4), "{degrees}: {found:?}");
            // The farthest point of the lip.
            assert!(
                (found.compression - found.spread / 2.0).abs() < 1e-5 && (found.seat - found.compression).abs() < 1e-9
            );
            assert!(seal.is_sealed(), "{degrees}");
            let aligned = meter.aligned(&tray, &SealMeter::pose(&Point3::origin(), &approach));
            assert!((aligned.rotation * Vector3::z() + Vector3::z()).norm() < 1e-9);
        }
        let flat = meter.measure(&tray, &SealMeter::pose(&Point3::origin(), &-Vector3::z()));
        assert!(shape(&flat).suctionnet > 0.999_999 && flat.margin > 0.999);
        // A stroke of 6 mm is used up at a slope of 0.3.
        let steep = Vector3::new(0.35, 0.0, -1.0).normalize();
        let seal = meter.measure(&tray, &SealMeter::pose(&Point3::origin(), &steep));
        assert!(!seal.is_sealed() && seal.weakest == SealLimit::Stroke, "{seal:?}");
    }

    #[test]
    fn a_cylinder_has_the_gap_of_its_section() {
        let mut meter = meter();
        for (radius, score) in [(0.02, 0.883), (0.03, 0.950), (0.05, 0.982)] {
            let seal =
                meter.measure(&cylinder(radius), &SealMeter::pose(&Point3::new(0.0, 0.0, radius), &-Vector3::z()));
            let found = shape(&seal);
            let gap = radius - (radius * radius - RADIUS * RADIUS).sqrt();
            assert!((found.spread - gap).abs() < 5e-6 && (found.flex - gap).abs() < 5e-6, "{radius}: {found:?}");
            assert!((found.seat - gap).abs() < 5e-6 && found.tilt() < 1e-4, "{radius}: {found:?}");
            // Along the axis straight, across it round; a quadric is a little more curved than a circle there.
            assert!(found.curvatures[0].abs() * radius < 0.05, "{radius}: {found:?}");
            let ratio = found.curvatures[1] * radius;
            assert!(ratio > 1.0 && ratio < 1.0 + 0.4 * (RADIUS / radius) * (RADIUS / radius), "{radius}: {ratio}");
            assert!((found.suctionnet - score).abs() < 3e-3, "{radius}: {found:?}");
            // 2 mm of flex are used up between 20 and 30 mm.
            assert_eq!(seal.is_sealed(), radius > 0.025, "{radius}: {seal:?}");
        }
    }

    #[test]
    fn a_ball_is_flat_along_the_lip_and_curved_all_the_same() {
        let mut meter = meter();
        for radius in [0.015, 0.03, 0.1] {
            let ball = ball(radius);
            let pose = SealMeter::pose(&Point3::new(radius, 0.0, 0.0), &-Vector3::x());
            let seal = meter.measure(&ball, &pose);
            let found = shape(&seal);
            let height = radius - (radius * radius - RADIUS * RADIUS).sqrt();
            assert!(found.spread < 5e-6 && found.suctionnet > 0.999, "{radius}: {found:?}");
            assert!((found.seat - height).abs() < 2e-5 && (found.bulge - height).abs() < 2e-5, "{radius}: {found:?}");
            let [low, high] = found.curvatures.map(|curvature| curvature * radius);
            let most = 1.02 + 0.75 * (RADIUS / radius) * (RADIUS / radius);
            assert!(low > 0.97 && high < most && high - low < 0.02, "{radius}: {low} {high}");
            assert_eq!(seal.is_sealed(), radius > 0.02, "{radius}: {seal:?}");
            if radius < 0.02 {
                assert_eq!(seal.weakest, SealLimit::Curvature);
            }
            // Out of the middle of a ball the surface is met from inside.
            let inside = SealMeter::pose(&Point3::new(0.1, 0.0, 0.0), &Vector3::x());
            assert!(!meter.measure(&ball, &inside).is_sealed());
        }
    }

    /// A block of 100 mm: the outer edge of the lip is 11 mm from the axis.
    #[test]
    fn the_whole_lip_must_be_on_a_face() {
        let block = surface(&TriMesh {
            vertices: (0..8).map(|k| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 0.05 } else { -0.05 })).collect(),
            triangles: [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
                .iter()
                .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
                .collect(),
        });
        let mut meter = meter();
        for (from_edge, is_sealed) in [(0.02, true), (0.0111, true), (0.0109, false), (0.009, false)] {
            let point = Point3::new(0.05 - from_edge, 0.0, 0.05);
            let seal = meter.measure(&block, &SealMeter::pose(&point, &-Vector3::z()));
            assert_eq!(seal.is_sealed(), is_sealed, "{from_edge}: {seal:?}");
            if !is_sealed {
                assert!(seal.missed > 0 && seal.weakest == SealLimit::Surface && seal.shape.is_none());
            }
        }
        // Not even the axis meets it.
        let beside = meter.measure(&block, &SealMeter::pose(&Point3::new(0.2, 0.0, 0.05), &-Vector3::z()));
        assert_eq!(beside.margin, -1.0);
    }

    /// A plate with a square hole of 4 mm: under the lip, inside of it and beyond it.
    #[test]
    fn a_hole_under_the_cup_leaks() {
        let plate = surface(&TriMesh::walls([0.004, 0.004, 0.01], 0.04));
        let mut meter = meter();
        for (x, is_sealed) in [(0.0, false), (0.006, false), (0.01, false), (0.0135, true)] {
            let seal = meter.measure(&plate, &SealMeter::pose(&Point3::new(x, 0.0, 0.01), &-Vector3::z()));
            assert_eq!(seal.is_sealed(), is_sealed, "{x}: {seal:?}");
        }
        // A tray of 30 mm: the cup is inside of its walls, which are not in its way.
        let tray = surface(&TriMesh::open_box([0.03, 0.03, 0.04], 0.004));
        assert!(meter.measure(&tray, &SealMeter::pose(&Point3::origin(), &-Vector3::z())).is_sealed());
        // Beside the middle, the wall is met first.
        let seal = meter.measure(&tray, &SealMeter::pose(&Point3::new(0.006, 0.0, 0.0), &-Vector3::z()));
        assert!(!seal.is_sealed(), "{seal:?}");
    }

    /// Facets of a cylinder: the curvature is that of the quadric, not of an edge.
    #[test]
    fn facets_hardly_change_the_curvature() {
        let mut meter = meter();
        for sides in [32, 64] {
            let mesh = revolved(&[[-0.05, 0.03], [0.05, 0.03]], [-0.05, 0.05], sides);
            let seal = meter.measure(&surface(&mesh), &SealMeter::pose(&Point3::new(0.0, 0.0, 0.03), &-Vector3::z()));
            let curvature = shape(&seal).curvatures[1];
            assert!((curvature * 0.03 - 1.0).abs() < 0.1, "{sides}: {curvature}");
        }
    }

    #[test]
    fn levels_of_instructions_give_the_same_bits() {
        let cylinder = cylinder(0.03);
        let cup = SuctionCup::new(CupSettings::default()).expect("a cup");
        let pose = SealMeter::pose(&Point3::new(0.0, 0.001, 0.03), &Vector3::new(0.05, 0.02, -1.0).normalize());
        let seals: Vec<Seal> =
            SimdLevel::available().map(|level| SealMeter::new(&cup, level).measure(&cylinder, &pose)).collect();
        assert!(seals.iter().all(|seal| *seal == seals[0] && seal.shape.is_some()));
    }
}
