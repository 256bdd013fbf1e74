//! Closing a hand by kinematics alone: every finger moves until it meets the object.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use super::{
    found::GraspContact,
    frame::Frame,
    meeting::overlap,
    motion::{motor_at, moves, reach, velocities, velocity},
    solids::HandSolids,
};
use crate::hand::{Driven, Hand, Motor};
use kernel::contact::{ContactScratch, ContactSurface, OverlapProbe, Probe, SurfaceContact};

/// A link that is so near touches [m].
pub const TOUCHES: f64 = 1e-5;

/// Nearer than this [m], distances are exact; farther away a lower bound does.
const NEAR: f64 = 0.002;

/// Largest step of a solid that moves away from the object [m].
pub(super) const LEAVES: f64 = 1e-4;

/// A finger that has not met the object after this many steps creeps along it, and stays.
pub(super) const MAX_STEPS_OF_CLOSING: u32 = 1000;

/// Largest step of a motor between two tests for contact between links [rad]; a slide moves by a hundredth of it [m].
const STRIDE: f64 = 0.01;

/// A hand and what of it can touch.
pub(super) struct Closing {
    pub(super) hand: Arc<Hand>,
    pub(super) solids: HandSolids,
    pub(super) probes: Vec<Probe>,
    /// Reach of each solid per driven joint, before and after its clutch has opened: largest motion of a point of the
    /// solid per unit of the motor [m].
    reaches: Vec<Vec<[f64; 2]>>,
    /// Motors that close the hand, those together that move the same solids: fingers.
    groups: Vec<Vec<usize>>,
    /// Closing line of a gripper: its motor, and the first pad's displacement per unit of it, expressed in the base frame.
    pub(super) line: Option<(usize, Vector3<f64>)>,
    /// Side of each solid: 1 where it moves as the first pad does, -1 as the second one, 0 as the base.
    pub(super) sides: Vec<f64>,
    pub(super) scratch: ContactScratch,
    pub(super) found: Vec<SurfaceContact>,
    overlap: OverlapTest,
}

/// Solids of a hand that are tested for overlap with an object.
struct OverlapTest {
    /// Overlap that is allowed [m].
    depth: f64,
    solids: Vec<OverlapProbe>,
    /// The solids, those first that overlapped last, before that the farthest along the approach.
    order: Vec<usize>,
    /// Whether triangles in a solid are searched first, which is by far the cheaper test.
    has_prefilter: bool,
}

impl OverlapTest {
    fn new(hand: &Hand, solids: &HandSolids) -> Self {
        let frames = hand.link_frames(&hand.posture_values(&hand.opened()));
        let approach = hand.approach_direction(&frames);
        let ahead = |solid: &usize| solids.solids[*solid].reach_along(&approach, &frames);
        let mut order: Vec<usize> = (0..solids.solids.len()).collect();
        order.sort_by(|one, other| ahead(other).total_cmp(&ahead(one)));
        Self { depth: f64::NAN, solids: Vec::new(), order, has_prefilter: true }
    }
}

/// Present state of the hand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Closed {
    /// The motors, one per driven joint.
    pub(super) motors: Vec<Motor>,
    /// Values of all joints.
    pub(super) joints: Vec<f64>,
}

impl Closing {
    pub(super) fn new(hand: &Arc<Hand>, solids: &HandSolids) -> Self {
        let probe = |solid: &super::solids::Solid| Probe::new(&solid.shape).expect("no mesh is a solid of a hand");
        let reaches = solids.solids.iter().map(|solid| {
            hand.driven().iter().map(|driven| reach(hand, solid.link, solid.centre, solid.reach, driven)).collect()
        });
        let reaches: Vec<Vec<[f64; 2]>> = reaches.collect();
        let groups = groups(hand, &reaches);
        let line = hand.closing_line().zip(groups.first()).map(|(line, group)| (group[0], line));
        let sides = solids.solids.iter().map(|solid| hand.closing_side(solid.link)).collect();
        Self {
            hand: Arc::clone(hand),
            probes: solids.solids.iter().map(probe).collect(),
            reaches,
            groups,
            line,
            sides,
            overlap: OverlapTest::new(hand, solids),
            solids: solids.clone(),
            scratch: ContactScratch::default(),
            found: Vec::new(),
        }
    }

    /// Leaves out the test for triangles in a solid: every overlap is found by distances.
    pub(super) fn without_prefilter(&mut self) {
        self.overlap.has_prefilter = false;
    }

    /// Penetration of the object by the hand in a posture [m]; below 0 where it is clear, and then no less than
    /// -`NEAR`.
    pub(super) fn penetration(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        joints: &[f64],
    ) -> f64 {
        let frames = self.hand.link_frames(joints);
        let solids = 0..self.probes.len();
        -solids.map(|solid| self.distance(surface, object_from_base, &frames, solid)).fold(NEAR, f64::min)
    }

    /// Whether the hand in a posture is deeper in the object than `max_overlap` [m].
    pub(super) fn overlaps(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        joints: &[f64],
        max_overlap: f64,
    ) -> bool {
        if self.overlap.depth != max_overlap {
            self.overlap.depth = max_overlap;
            self.overlap.solids = self.probes.iter().map(|probe| OverlapProbe::new(probe, max_overlap)).collect();
        }
        let frames = self.hand.link_frames(joints);
        let poses: Vec<_> =
            (0..self.probes.len()).map(|solid| self.object_from_solid(object_from_base, &frames, solid)).collect();
        let (OverlapTest { solids, order, has_prefilter, .. }, scratch) = (&mut self.overlap, &mut self.scratch);
        // Cheap test first, of all solids: a triangle in one of them. Exact distances decide on the rest.
        let mut first = |overlaps: &mut dyn FnMut(usize) -> bool| {
            let rank = order.iter().position(|solid| overlaps(*solid));
            // Most likely the next pose is ruled out by the same solid.
            rank.inspect(|rank| order[..=*rank].rotate_right(1)).is_some()
        };
        *has_prefilter && first(&mut |solid| surface.surely_overlaps(&solids[solid], &poses[solid]))
            || first(&mut |solid| surface.overlaps(&solids[solid], &poses[solid], scratch))
    }

    /// Distance that the hand can come along a direction in `Object`, its joints still, until it meets the object [m]:
    /// 0 where it does not within `max`.
    pub(super) fn advance(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        joints: &[f64],
        direction: &Vector3<f64>,
        max: f64,
    ) -> f64 {
        if max == 0.0 {
            return 0.0;
        }
        let frames = self.hand.link_frames(joints);
        let mut come = 0.0;
        // Conservative advancement: move by the smallest distance of a solid that does not leave the object.
        for _ in 0..MAX_STEPS_OF_CLOSING {
            let moved = Translation3::from(direction * come) * object_from_base;
            let mut nearest = f64::INFINITY;
            for solid in 0..self.probes.len() {
                let distance = self.distance(surface, &moved, &frames, solid);
                let comes =
                    |contact: &SurfaceContact| contact.distance <= TOUCHES && contact.normal.dot(direction) < 0.0;
                let leaves = distance <= TOUCHES && !self.found.iter().any(comes);
                nearest = nearest.min(if leaves { LEAVES } else { distance });
            }
            if nearest <= TOUCHES {
                return come;
            }
            come += nearest - TOUCHES / 2.0;
            if come > max {
                break;
            }
        }
        0.0
    }

    /// Closes the hand from a posture: each closing joint moves until a link that it moves meets the object, or to its
    /// limit. Where its own link met the object, the clutch opens and the follower behind it moves on. Links that meet
    /// each other also stop.
    pub(super) fn close(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
    ) -> Closed {
        let hand = Arc::clone(&self.hand);
        let start: Vec<Motor> = posture.iter().copied().map(Motor::engaged).collect();
        let mut ends = start.clone();
        for group in self.groups.clone() {
            let mut motors = start.clone();
            self.close_group(surface, object_from_base, &mut motors, &group);
            group.iter().for_each(|index| ends[*index] = motors[*index]);
        }
        self.part(&start, &mut ends);
        let mut joints = vec![0.0; hand.tree().len()];
        hand.joint_values(&ends, &mut joints);
        Closed { motors: ends, joints }
    }

    /// Where links at these joint values touch the object.
    pub(super) fn contacts(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        joints: &[f64],
    ) -> Vec<GraspContact> {
        let frames = self.hand.link_frames(joints);
        let mut contacts = Vec::new();
        for solid in 0..self.probes.len() {
            let object_from_solid = self.object_from_solid(object_from_base, &frames, solid);
            let (scratch, found) = (&mut self.scratch, &mut self.found);
            surface.contacts(&self.probes[solid], &object_from_solid, 2.0 * TOUCHES, scratch, found);
            let link = self.solids.solids[solid].link;
            contacts.extend(self.found.iter().map(|contact| GraspContact {
                link,
                // On the object's own surface.
                point: contact.point - contact.normal.into_inner() * contact.distance,
                normal: contact.normal,
                distance: contact.distance,
            }));
        }
        contacts
    }

    /// Drives a group of motors together, each at its speed, until something that it moves meets the object.
    fn close_group(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        motors: &mut [Motor],
        group: &[usize],
    ) {
        let hand = Arc::clone(&self.hand);
        // Remaining angle of a motor towards the closed hand.
        let left = |index: usize, motor: Motor| {
            let driven = &hand.driven()[index];
            (driven.closed_angle(motor) - motor.angle) * driven.closing_sign()
        };
        let mut going = group.to_vec();
        let mut joints = vec![0.0; hand.tree().len()];
        let mut gaps = Gaps::new(self.probes.len());
        // Conservative advancement (Mirtich 1996): steps so short that no solid can cover the distance left to the object.
        for _ in 0..MAX_STEPS_OF_CLOSING {
            going.retain(|index| left(*index, motors[*index]) > 0.0);
            if going.is_empty() {
                break;
            }
            hand.joint_values(motors, &mut joints);
            let frames = hand.link_frames(&joints);
            // Bound on the speed of each solid's points: sum over the motors of reach times speed.
            gaps.set_speeds(|solid| {
                let speed_of = |index: &usize| {
                    let after = usize::from(motors[*index].released.is_some());
                    self.reaches[solid][*index][after] * hand.driven()[*index].speed
                };
                going.iter().map(speed_of).sum()
            });
            let mut met = Vec::new();
            let time = gaps.time(|solid| {
                let distance = self.distance(surface, object_from_base, &frames, solid);
                // Touching solid: motors that press it into the object stop; other motion continues in short steps.
                if distance <= TOUCHES {
                    let link = self.solids.solids[solid].link;
                    let presses = |index: &usize| self.presses(object_from_base, &frames, motors[*index], *index, link);
                    met.extend(going.iter().copied().filter(presses).map(|index| (index, link)));
                }
                distance
            });
            // Motors that met the object: a clutch opens where the driven link itself met it, else the motor stops.
            for (index, link) in &met {
                let (driven, motor) = (&hand.driven()[*index], motors[*index]);
                if *link == driven.joint + 1 && driven.breakaway.is_some() && motor.released.is_none() {
                    motors[*index] = driven.stopped(motor);
                } else if !(*link == driven.joint + 1 && driven.breakaway.is_some()) {
                    going.retain(|going| going != index);
                }
            }
            // Advance of all motors by the common time, each no farther than its limit.
            if met.is_empty() {
                for index in &going {
                    let (driven, motor) = (&hand.driven()[*index], motors[*index]);
                    let step = (time * driven.speed).min(left(*index, motor));
                    motors[*index] = driven.driven_to(motor, motor.angle + driven.closing_sign() * step);
                }
            }
            gaps.pass(if met.is_empty() { time } else { 0.0 });
        }
    }

    /// Whether a motor moves a link into the object where it touches, as `found` has it.
    fn presses(
        &self,
        object_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
        motor: Motor,
        index: usize,
        link: usize,
    ) -> bool {
        let hand = &self.hand;
        let velocities = velocities(hand, frames, motor, &hand.driven()[index]);
        self.found.iter().filter(|contact| contact.distance <= TOUCHES).any(|contact| {
            let at = object_from_base.inverse() * contact.point;
            let normal = object_from_base.rotation.inverse() * contact.normal.into_inner();
            normal.dot(&velocity(&velocities, hand, link, &at)) < 0.0
        })
    }

    /// From the object to a solid [m]: exact where it is below [`NEAR`], with the contacts in `found`; else a lower bound.
    pub(super) fn distance(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
        solid: usize,
    ) -> f64 {
        let object_from_solid = self.object_from_solid(object_from_base, frames, solid);
        let probe = &self.probes[solid];
        let bound = surface.clearance_at_least(probe, &object_from_solid);
        self.found.clear();
        if bound > NEAR {
            return bound;
        }
        surface.contacts(probe, &object_from_solid, NEAR, &mut self.scratch, &mut self.found);
        self.found.first().map_or(NEAR, |contact| contact.distance)
    }

    /// Bound on the speed of a solid's points while motors go from start to end, each at its speed [m/s].
    pub(super) fn speed_bound(&self, solid: usize, start: &[Motor], end: &[Motor]) -> f64 {
        let moving = self.hand.driven().iter().zip(start.iter().zip(end)).zip(&self.reaches[solid]);
        let speed = |((driven, (start, end)), [before, after]): ((&Driven, (&Motor, &Motor)), &[f64; 2])| {
            let reach = if end.released.is_some() { before.max(*after) } else { *before };
            if start.angle == end.angle { 0.0 } else { reach * driven.speed }
        };
        moving.map(speed).sum()
    }

    pub(super) fn object_from_solid(
        &self,
        object_from_base: &IsometryMatrix3<f64>,
        frames: &[IsometryMatrix3<f64>],
        solid: usize,
    ) -> IsometryMatrix3<f64> {
        let solid = &self.solids.solids[solid];
        match solid.link {
            0 => object_from_base * solid.link_from_shape,
            link => object_from_base * frames[link - 1] * solid.link_from_shape,
        }
    }

    /// Stops motors earlier whose links would meet each other, all closing together at their speeds.
    pub(super) fn part(&self, start: &[Motor], ends: &mut [Motor]) {
        let hand = &self.hand;
        let mut joints = vec![0.0; hand.tree().len()];
        let mut frames = vec![Frame::identity(); hand.tree().len() + 1];
        let mut meets = |motors: &[Motor]| {
            hand.joint_values(motors, &mut joints);
            for (into, frame) in frames[1..].iter_mut().zip(hand.link_frames(&joints)) {
                *into = Frame::of(&frame);
            }
            let meet = |pair: &&[usize; 2]| {
                let [one, other] = pair.map(|solid| &self.solids.solids[solid]);
                overlap(one, other, &frames)
            };
            self.solids.pairs.iter().find(meet).map(|pair| pair.map(|solid| self.solids.solids[solid].link))
        };
        let speed = |index: usize| hand.driven()[index].speed;
        let fastest = (0..start.len()).map(speed).fold(0.0, f64::max);
        let longest = (0..start.len()).map(|index| (ends[index].angle - start[index].angle).abs() / speed(index));
        let steps = (longest.fold(0.0, f64::max) * fastest / STRIDE).ceil() as u32;
        let mut now = start.to_vec();
        for step in 1..=steps {
            let before = now.clone();
            for (index, driven) in hand.driven().iter().enumerate() {
                let distance = f64::from(step) * STRIDE / fastest * speed(index);
                now[index] = motor_at(start[index], ends[index], driven, distance);
            }
            // Each meeting stops the motors of both links; what remains is tested again.
            while let Some(links) = meets(&now) {
                let stopped: Vec<usize> = (0..now.len())
                    .filter(|index| now[*index] != before[*index])
                    .filter(|index| links.iter().any(|link| moves(hand, *link, &hand.driven()[*index])))
                    .collect();
                if stopped.is_empty() {
                    break;
                }
                for index in stopped {
                    now[index] = before[index];
                    ends[index] = before[index];
                }
            }
        }
    }
}

/// Lower bounds of the distances of a moving hand's solids from the object: each is measured only where it may be the next to meet it.
pub(super) struct Gaps {
    /// At least [m]; 0 where nothing is known.
    gaps: Vec<f64>,
    /// Bounds on the speed of their points [m per unit of time].
    speeds: Vec<f64>,
    /// Solids that touch and move on.
    touching: Vec<usize>,
}

impl Gaps {
    pub(super) fn new(solids: usize) -> Self {
        Self { gaps: vec![0.0; solids], speeds: vec![0.0; solids], touching: Vec::new() }
    }

    /// Sets the speed of each solid; one of speed 0 meets nothing.
    pub(super) fn set_speeds(&mut self, speed: impl Fn(usize) -> f64) {
        for (solid, speed_of) in self.speeds.iter_mut().enumerate() {
            *speed_of = speed(solid);
        }
    }

    /// Time in which no solid can meet the object; `measure` returns a solid's distance from it. A touching solid
    /// leaves the object in steps of [`LEAVES`].
    pub(super) fn time(&mut self, mut measure: impl FnMut(usize) -> f64) -> f64 {
        let mut measured = vec![false; self.gaps.len()];
        loop {
            let times = self.gaps.iter().zip(&self.speeds).enumerate();
            let times = times.filter(|(_, (_, speed))| **speed > 0.0);
            let times = times.map(|(solid, (gap, speed))| (solid, (gap - TOUCHES / 2.0) / speed));
            let Some((next, time)) = times.min_by(|one, other| one.1.total_cmp(&other.1)) else {
                return f64::INFINITY;
            };
            if measured[next] {
                return time;
            }
            measured[next] = true;
            self.gaps[next] = measure(next);
            if self.gaps[next] <= TOUCHES {
                self.gaps[next] = LEAVES;
                self.touching.push(next);
            }
        }
    }

    /// Lets time pass, or none.
    pub(super) fn pass(&mut self, time: f64) {
        for (gap, speed) in self.gaps.iter_mut().zip(&self.speeds) {
            *gap = (*gap - speed * time).max(0.0);
        }
        self.touching.drain(..).for_each(|solid| self.gaps[solid] = 0.0);
    }
}

/// Motors that close a hand, grouped by the solids that they move.
fn groups(hand: &Hand, reaches: &[Vec<[f64; 2]>]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let closes = |index: &usize| hand.driven()[*index].closing_sign() != 0.0;
    for index in (0..hand.driven().len()).filter(closes) {
        let shares = |group: &Vec<usize>| {
            group.iter().any(|other| reaches.iter().any(|of| of[index][0] > 0.0 && of[*other][0] > 0.0))
        };
        let (mut joined, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(shares);
        joined.push(vec![index]);
        groups = apart;
        groups.push(joined.concat());
    }
    groups
}
