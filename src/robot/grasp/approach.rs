//! Preshaped hands that come along the normals of an object's surface: a point and an approach come first, then two opposite sides
//! of the part that lies across the approach, and a posture of the hand that is a little wider.
//!
//! The posture depends on the width of the part: thin parts are pinched or held by three tips, thicker ones held by three tips or
//! wrapped. The hand comes from afar as deep as it gets, backs off by a drawn distance, and closes.

use std::{f64::consts::TAU, sync::Arc};

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::{
    found::{ApproachLosses, RatedGrasp, SearchRun},
    known::KnownStates,
    object::ObjectSearch,
    opposition::HoldKind,
    pads::Grip,
    pairs::min_cos,
    points::{PointMixture, SurfacePoint},
    rate::HandState,
    sampled::GraspSampler,
    settings::ApproachDraws,
    solids::ALLOWED_OVERLAP,
    tally::Tally,
};
use kernel::{
    contact::ContactSurface,
    geom::{SimdLevel, rotation_towards},
    seed::Stream,
    words::PointScheme,
};

/// Lines across an approach that are tried at most.
const LINES: u32 = 8;

/// Postures that are tried at most for one part of an object.
const HOLDS: u32 = 6;

/// Least and largest depth of a line below the point where the approach enters the object [m].
const DEPTHS: [f64; 2] = [0.003, 0.05];

/// Parts up to this width are thin [m].
const THIN: f64 = 0.03;

/// Least and largest opening margin of the hand, both sides together [m].
const OPENED_BY: [f64; 2] = [0.004, 0.024];

/// Largest opening margin on the line between the two sides of the hand, which may be oblique to the approach [m].
const MAX_MARGIN: f64 = 0.04;

/// Largest cosine of the angle between the line of a hold and the approach.
const MAX_OBLIQUE: f64 = 0.6;

/// The hand stays so far before the object at least [m].
const GAP: f64 = 0.0005;

/// A wrapping hand backs off from the object by this at most [m].
const BACK: f64 = 0.008;

/// A ray begins so far below the surface [m].
const BELOW: f64 = 1e-6;

/// Part of an object between two opposite sides.
#[derive(Clone, Copy)]
struct Part {
    /// Unit vector along which the hand comes, in `Object`.
    approach: Vector3<f64>,
    /// Unit vector from one side to the other, in `Object`.
    across: Vector3<f64>,
    /// Half way between the sides, in `Object` [m].
    middle: Point3<f64>,
    /// Depth of the middle below the point where the approach enters the object [m].
    depth: f64,
    /// Between the sides [m].
    width: f64,
}

/// Why an approach meets no part that a hand can hold.
enum NoPart {
    Unopposed,
    TooWide,
}

/// Source of the approaches of a run.
struct ApproachSource<'a> {
    surface: &'a ContactSurface,
    mixture: PointMixture<'a>,
    /// Cosine of the largest angle between an approach and the inward normal.
    min_cos: f64,
    friction: f64,
    /// Wider parts are left out [m].
    max: f64,
    level: SimdLevel,
}

impl GraspSampler {
    /// A run over approaches near the normals of all the object's surface. It ends once it has its states.
    pub fn approaches(&mut self, object: &ObjectSearch, settings: &ApproachDraws, stream: &mut Stream) -> SearchRun {
        let search = Arc::clone(&self.search);
        let source = ApproachSource {
            surface: object.surface(),
            mixture: PointMixture::new(object.surface(), object.sample(self.level), f64::INFINITY, self.level),
            min_cos: libm::cos(settings.cone),
            friction: settings.friction,
            max: search.oppositions().widest() - OPENED_BY[0],
            level: self.level,
        };
        let mut known = KnownStates::new(&search);
        let mut losses = ApproachLosses::default();
        let (mut energies, mut grasps) = (Vec::new(), Vec::<RatedGrasp>::new());
        while losses.draws < settings.draws && grasps.len() < settings.best as usize {
            losses.draws += 1;
            energies.push(None);
            let scheme = PointMixture::scheme(stream);
            let part = match source.draw(scheme, stream) {
                Ok(part) => part,
                Err(NoPart::Unopposed) => {
                    losses.unopposed += 1;
                    continue;
                }
                Err(NoPart::TooWide) => {
                    losses.too_wide += 1;
                    continue;
                }
            };
            let Some(start) = self.arrive(object, &source, &part, &mut losses, stream) else { continue };
            // Closing costs most: states like a known one are left out before.
            if known.has(&start.object_from_approach) {
                losses.known += 1;
                continue;
            }
            let grasp = self.rating.placed(object, start);
            *energies.last_mut().expect("one of this approach") = Some(grasp.energies.total);
            if !grasp.presses_from_both_sides() {
                losses.open += 1;
            } else if known.has(&grasp.object_from_approach) {
                losses.known += 1;
            } else {
                known.add(&grasp.object_from_approach);
                grasps.push(RatedGrasp { point_scheme: Some(scheme), ..grasp });
            }
        }
        losses.budget_spent = losses.draws == settings.draws && grasps.len() < settings.best as usize;
        let mut tally = Tally::new(losses.draws);
        (0..).zip(energies).for_each(|(index, energy)| tally.count(index, energy));
        let seed = Translation3::from(object.middle.coords).into();
        SearchRun { approach_losses: Some(losses), ..tally.run(&seed, grasps) }
    }

    /// The hand in a posture for a part, come along the approach until it meets the object and backed off; `None` where no
    /// posture that is tried gets there.
    fn arrive(
        &mut self,
        object: &ObjectSearch,
        source: &ApproachSource<'_>,
        part: &Part,
        losses: &mut ApproachLosses,
        stream: &mut Stream,
    ) -> Option<HandState> {
        let search = Arc::clone(&self.search);
        let (mut is_opened, mut is_clear) = (false, false);
        for _ in 0..HOLDS {
            let kind = HoldKind::draw(part.width, stream);
            let range = OPENED_BY.map(|by| part.width + by);
            let oppositions = search.oppositions();
            let hold = oppositions.draw_kind(&search.hand, &self.closing.solids, kind, range, stream);
            let side = if stream.unit() < 0.5 { 1.0 } else { -1.0 };
            let Some((grip, width)) = hold else { continue };
            let ahead = search.hand.approach_direction(&grip.frames);
            let placed =
                source.place(&grip.base_from_line, &ahead, width, &Part { across: part.across * side, ..*part });
            let Some((object_from_base, depth)) = placed else { continue };
            is_opened = true;
            // Cheap tests first, with the hand as far back as it may stay.
            let direction = part.approach;
            let shallow = Translation3::from(direction * (DEPTHS[0] - depth)) * object_from_base;
            if !self.is_clear(object, &shallow, &grip.amplitudes)
                || self.closing.overlaps(object.surface(), &shallow, &grip.joints, ALLOWED_OVERLAP)
            {
                continue;
            }
            is_clear = true;
            let ahead = self.come_to(object, &grip, &object_from_base, &direction, depth - DEPTHS[0]);
            let Some(ahead) = ahead.and_then(|most| depth_of(kind, most, DEPTHS[0] - depth, stream)) else { continue };
            let object_from_base = Translation3::from(direction * ahead) * object_from_base;
            let object_from_approach = object_from_base * search.hand.approach_pose(&grip.frames).isometry();
            return Some(HandState { object_from_approach, posture: grip.posture, amplitudes: grip.amplitudes });
        }
        match (is_opened, is_clear) {
            (false, _) => losses.too_wide += 1,
            (_, false) => losses.in_object += 1,
            (_, true) => losses.blocked += 1,
        }
        None
    }

    /// Comes with a preshaped hand from afar along a direction until it meets the object; returns how far beyond a pose it
    /// gets, at most to where its tips are [m], or `None` where it does not come within `before` of that pose.
    fn come_to(
        &mut self,
        object: &ObjectSearch,
        grip: &Grip,
        object_from_base: &IsometryMatrix3<f64>,
        direction: &Vector3<f64>,
        before: f64,
    ) -> Option<f64> {
        let object_from_approach = object_from_base * self.search.hand.approach_pose(&grip.frames).isometry();
        let far = self.distance_outside(object, &object_from_approach, &grip.joints);
        let outside = Translation3::from(direction * -far) * object_from_base;
        let max = far + object.radius;
        let come = match self.closing.advance(object.surface(), &outside, &grip.joints, direction, max) {
            0.0 => max,
            come => come,
        };
        let ahead = come - far - GAP;
        (ahead >= -before).then_some(ahead)
    }
}

/// Distance beyond the pose on the line of a part at which a hand closes [m]: fingertips anywhere between the line and as far as
/// the hand gets, a wrapping hand near that; `None` where this is before `min`.
fn depth_of(kind: HoldKind, most: f64, min: f64, stream: &mut Stream) -> Option<f64> {
    let share = stream.unit();
    let ahead = match kind {
        HoldKind::Wrap => most - BACK * share,
        HoldKind::Pinch | HoldKind::Tripod => {
            let first = most.min(0.0);
            first + (most - first) * share
        }
    };
    (ahead >= min).then_some(ahead)
}

impl HoldKind {
    /// Draws a kind for a part of a width [m].
    fn draw(width: f64, stream: &mut Stream) -> Self {
        match (width <= THIN, stream.unit() < 0.5) {
            (true, true) => Self::Pinch,
            (false, true) => Self::Wrap,
            (_, false) => Self::Tripod,
        }
    }
}

impl ApproachSource<'_> {
    /// Draws a point, an approach in a cone about the inward normal there, a depth, and two opposite sides across it. Half of the
    /// approaches are moved to the middle of the cross-section.
    fn draw(&self, scheme: PointScheme, stream: &mut Stream) -> Result<Part, NoPart> {
        let SurfacePoint { point, out } = self.mixture.draw(scheme, stream).ok_or(NoPart::Unopposed)?;
        // Uniform over the cap of the sphere about the inward normal.
        let cos = 1.0 - (1.0 - self.min_cos) * stream.unit();
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let azimuth = libm::sincos(TAU * stream.unit());
        let axes = rotation_towards(&-out, 0.0);
        let approach = axes * Vector3::new(sin * azimuth.1, sin * azimuth.0, cos);
        let [share, centred] = [(); 2].map(|()| stream.unit());
        let thickness = self.exit(&(point + approach * BELOW), &approach).ok_or(NoPart::Unopposed)?.0;
        // Thin walls are met in their middle.
        let last = DEPTHS[1].min(thickness - DEPTHS[0]);
        let depth = if last < DEPTHS[0] { thickness / 2.0 } else { DEPTHS[0] + (last - DEPTHS[0]) * share };
        let inside = point + approach * depth;
        let axes = rotation_towards(&approach, 0.0);
        let mut lost = NoPart::TooWide;
        for _ in 0..LINES {
            let (sin, cos) = libm::sincos(TAU * stream.unit());
            let across = axes.column(0) * cos + axes.column(1) * sin;
            let centre = if centred < 0.5 { self.centre(&inside, &approach.cross(&across)) } else { inside };
            match self.sides(&centre, &across) {
                Ok((middle, width)) => return Ok(Part { approach, across, middle, depth, width }),
                Err(NoPart::Unopposed) => lost = NoPart::Unopposed,
                Err(NoPart::TooWide) => {}
            }
        }
        Err(lost)
    }

    /// Distance from a point inside the object to where a ray leaves it [m], with the outward normal there.
    fn exit(&self, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let mut exits = Vec::new();
        self.surface.exits(self.level, from, &Unit::new_unchecked(*direction), f64::INFINITY, &mut exits);
        exits.first().copied()
    }

    /// Half way between the two exits from a point along a line.
    fn centre(&self, from: &Point3<f64>, along: &Vector3<f64>) -> Point3<f64> {
        match (self.exit(from, along), self.exit(from, &-along)) {
            (Some((ahead, _)), Some((behind, _))) => from + along * ((ahead - behind) / 2.0),
            _ => *from,
        }
    }

    /// Middle and distance of the two sides on a line through a point inside the object, where it is within the friction cones of both.
    fn sides(&self, from: &Point3<f64>, across: &Vector3<f64>) -> Result<(Point3<f64>, f64), NoPart> {
        let ahead = self.exit(from, across).ok_or(NoPart::Unopposed)?;
        let behind = self.exit(from, &-across).ok_or(NoPart::Unopposed)?;
        let width = ahead.0 + behind.0;
        if width > self.max {
            return Err(NoPart::TooWide);
        }
        let min = min_cos(self.friction);
        let opposes = ahead.1.dot(across) >= min && -behind.1.dot(across) >= min;
        if opposes { Ok((from + across * ((ahead.0 - behind.0) / 2.0), width)) } else { Err(NoPart::Unopposed) }
    }

    /// Pose of the base in `Object` that puts a part between the two sides of a hold, given by its line, the direction of the hand's
    /// approach, both expressed in the base frame, and its width, with the depth of the middle of the line below the surface [m].
    /// `None` where the line is too oblique, or the part does not fit.
    fn place(
        &self,
        base_from_line: &IsometryMatrix3<f64>,
        ahead: &Vector3<f64>,
        width: f64,
        part: &Part,
    ) -> Option<(IsometryMatrix3<f64>, f64)> {
        let line = base_from_line.rotation * Vector3::z();
        let oblique = line.dot(ahead);
        if oblique.abs() > MAX_OBLIQUE {
            return None;
        }
        // Axes of the hand and of the part: along the line but at right angles to the approach, the third, and the approach.
        let level = (line - ahead * oblique).normalize();
        let base = Matrix3::from_columns(&[level, ahead.cross(&level), *ahead]);
        let object = Matrix3::from_columns(&[part.across, part.approach.cross(&part.across), part.approach]);
        let rotation = Rotation3::from_matrix_unchecked(object * base.transpose());
        // The part is measured again along the line itself.
        let (middle, part_width) = self.sides(&part.middle, &(rotation * line)).ok()?;
        if !(OPENED_BY[0]..=MAX_MARGIN).contains(&(width - part_width)) {
            return None;
        }
        let held = rotation * base_from_line.translation.vector;
        let depth = part.depth + (middle - part.middle).dot(&part.approach);
        Some((IsometryMatrix3::from_parts(Translation3::from(middle.coords - held), rotation), depth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grasp::points::{SurfaceSample, tests::boxes};

    const LEVEL: SimdLevel = SimdLevel::Scalar;

    fn source<'a>(surface: &'a ContactSurface, sample: &SurfaceSample, cone: f64, max: f64) -> ApproachSource<'a> {
        let mixture = PointMixture::new(surface, sample, f64::INFINITY, LEVEL);
        ApproachSource { surface, mixture, min_cos: libm::cos(cone), friction: 0.4, max, level: LEVEL }
    }

    /// A plate of 120 by 100 by 6 mm, for a hand that opens 50 mm: only from its edges a part is narrow enough.
    #[test]
    fn parts_of_a_plate_are_between_its_faces() {
        let surface = boxes(&[[[0.0; 3], [0.12, 0.1, 0.006]]]);
        let sample = SurfaceSample::new(&surface, b"", LEVEL);
        let source = source(&surface, &sample, 0.3, 0.05);
        let mut stream = Stream::of_job(1, b"", "approaches");
        let parts: Vec<Part> =
            (0..2000).filter_map(|_| source.draw(PointMixture::scheme(&mut stream), &mut stream).ok()).collect();
        assert!(parts.len() > 100, "{}", parts.len());
        for part in parts {
            let Part { approach, across, middle, depth, width } = part;
            assert!((approach.norm() - 1.0).abs() < 1e-12 && approach.dot(&across).abs() < 1e-12);
            // From 6 mm straight through to the limit of the friction cone; the middle is half way between the faces.
            assert!(across.z.abs() >= min_cos(0.4) - 1e-9 && (width - 0.006 / across.z.abs()).abs() < 1e-6, "{width}");
            assert!((middle.z - 0.003).abs() < 1e-6, "{middle}");
            // Near a corner, half way through.
            assert!(approach.z.abs() <= 0.4 && depth > 0.0 && depth <= DEPTHS[1], "{approach} {depth}");
        }
    }

    /// The base of a hand whose line between two sides is oblique is placed so that the line goes through the part.
    #[test]
    fn hands_are_placed_with_their_line_through_the_part() {
        let surface = boxes(&[[[-0.02, -0.1, -0.1], [0.04, 0.2, 0.2]]]);
        let sample = SurfaceSample::new(&surface, b"", LEVEL);
        let source = source(&surface, &sample, 0.0, 0.1);
        let middle = Point3::new(0.0, 0.01, 0.08);
        let part = Part { approach: -Vector3::z(), across: Vector3::x(), middle, depth: 0.02, width: 0.04 };
        for (oblique, is_placed) in [(0.0, true), (0.2, true), (0.7, false)] {
            let line = Vector3::new((1.0f64 - oblique * oblique).sqrt(), 0.0, oblique);
            let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&line, 0.3));
            let base_from_line = IsometryMatrix3::from_parts(Translation3::new(0.01, 0.02, 0.09), rotation);
            let placed = source.place(&base_from_line, &Vector3::z(), 0.055, &part);
            assert_eq!(placed.is_some(), is_placed, "{oblique}");
            let Some((object_from_base, depth)) = placed else { continue };
            let object_from_line = object_from_base * base_from_line;
            assert!((object_from_line.translation.vector - middle.coords).norm() < 1e-9 && (depth - 0.02).abs() < 1e-9);
            assert!((object_from_base.rotation * Vector3::z() - part.approach).norm() < 1e-12);
            let line = object_from_line.rotation * Vector3::z();
            assert!((line - Vector3::new((1.0f64 - oblique * oblique).sqrt(), 0.0, -oblique)).norm() < 1e-12);
        }
        // Too narrow for its margins, and too wide.
        let line = IsometryMatrix3::from_parts(
            Translation3::identity(),
            Rotation3::from_matrix_unchecked(rotation_towards(&Vector3::x(), 0.0)),
        );
        assert!([0.042, 0.09].iter().all(|width| source.place(&line, &Vector3::z(), *width, &part).is_none()));
    }

    #[test]
    fn tips_stop_anywhere_beyond_the_line_and_wraps_near_the_object() {
        let mut stream = Stream::of_job(2, b"", "depths");
        for _ in 0..200 {
            let tips = depth_of(HoldKind::Tripod, 0.03, -0.01, &mut stream).expect("a depth");
            let wrap = depth_of(HoldKind::Wrap, 0.03, -0.01, &mut stream).expect("a depth");
            assert!((0.0..=0.03).contains(&tips) && (0.03 - BACK..=0.03).contains(&wrap));
            // The hand meets the object before its line is on the part.
            assert_eq!(depth_of(HoldKind::Pinch, -0.005, -0.01, &mut stream), Some(-0.005));
            assert!(depth_of(HoldKind::Wrap, -0.02, -0.01, &mut stream).is_none());
        }
        let thin = (0..300).map(|_| HoldKind::draw(0.01, &mut stream));
        assert!(thin.into_iter().all(|kind| kind != HoldKind::Wrap));
        let thick: Vec<_> = (0..300).map(|_| HoldKind::draw(0.06, &mut stream)).collect();
        assert!(thick.contains(&HoldKind::Wrap) && thick.contains(&HoldKind::Tripod));
        assert!(!thick.contains(&HoldKind::Pinch));
    }
}
