//! Pads of a gripper on pairs of points on opposite sides of an object: contacts come first, and the hand follows from them.

use std::{f64::consts::TAU, sync::Arc};

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::{
    best::{BestList, Candidate, Likeness},
    found::{Grasp, GraspRun, PairLosses},
    frame::Frame,
    object::ObjectSearch,
    pads::Pads,
    pairs::Pair,
    rate::Start,
    sampled::{BEFORE, GraspSampler},
    settings::{Antipodal, PairHold, Support},
    solids::ALLOWED_OVERLAP,
    tally::Tally,
    variables::State,
};
use kernel::{
    geom::{RestingPose, rotation_towards},
    seed::Stream,
};

/// Rolls about the line of a pair that are tried at most.
const ROLLS: u32 = 8;

/// An opened pad is so far from its point at least [m]; [`BEFORE`] where the hand opens that far.
const MIN_GAP: f64 = 0.001;

/// A table below an object.
struct Table<'a> {
    /// Index of the object's resting pose.
    index: usize,
    pose: &'a RestingPose,
    /// Straight up, in `Object`.
    up: Vector3<f64>,
    margin: f64,
}

impl GraspSampler {
    /// A run over pairs of points on opposite sides of an object, drawn over all its surface.
    ///
    /// # Panics
    /// When the hand has no [`Hand::closing_line`](crate::hand::Hand::closing_line).
    pub fn antipodal(&mut self, object: &ObjectSearch, antipodal: &Antipodal, stream: &mut Stream) -> GraspRun {
        let pads = Pads::new(&self.hand).expect("pairs are asked of hands that close along a line");
        match antipodal.hold {
            PairHold::Middle => self.by_middles(object, &pads, antipodal, stream),
            PairHold::Along(support) => self.along_pads(object, &pads, antipodal, support, stream),
        }
    }

    /// Pairs anywhere along the pads: the first that both pads hold once closed, no two alike. The run ends once it has its
    /// states.
    fn along_pads(
        &mut self,
        object: &ObjectSearch,
        pads: &Pads,
        antipodal: &Antipodal,
        support: Support,
        stream: &mut Stream,
    ) -> GraspRun {
        let mut losses = PairLosses::default();
        let table = match support {
            Support::Air => None,
            Support::Table { margin } => {
                let table = Table::draw(object, margin, stream);
                losses.no_resting_pose = table.is_none();
                table
            }
        };
        let alike = Likeness::of_grasps();
        let (mut energies, mut grasps, mut frames) = (Vec::new(), Vec::<Grasp>::new(), Vec::<Frame>::new());
        while losses.pairs < antipodal.pairs && grasps.len() < antipodal.best as usize {
            // Two points, then the opened hand about them.
            let pair = match &table {
                _ if losses.no_resting_pose => None,
                // From above a gripper takes level pairs alone; from aside it takes others, too.
                Some(table) if losses.pairs % 2 == 0 => {
                    Pair::draw_level(&object.surface, antipodal.friction, &table.up, stream)
                }
                _ => Pair::draw(&object.surface, antipodal.friction, stream),
            };
            losses.pairs += 1;
            losses.unopposed += u32::from(pair.is_none());
            let start = pair.and_then(|pair| self.place(object, pads, &pair, table.as_ref(), &mut losses, stream));
            energies.push(start.as_ref().map(|start| self.rating.energies_of(object, start).total));
            // Closing costs most: what is like a state that is there already is left out before.
            let is_known = |frame: &Frame| frames.iter().any(|known| alike.joins(known, frame));
            let Some(start) = start.filter(|start| !is_known(&Frame::of(&start.object_from_approach))) else {
                continue;
            };
            let grasp = self.rating.placed(object, start);
            let frame = Frame::of(&grasp.object_from_approach);
            let is_low =
                |table: &Table<'_>| grasp.clearances.get(table.index).is_none_or(|lowest| lowest.shaped < table.margin);
            if !self.is_held(&grasp) {
                losses.open += 1;
            } else if table.as_ref().is_some_and(is_low) {
                losses.lowered += 1;
            } else if !is_known(&frame) {
                grasps.push(grasp);
                frames.push(frame);
            }
        }
        let mut tally = Tally::new(losses.pairs);
        (0..).zip(energies).for_each(|(index, energy)| tally.count(index, energy));
        let seed = match &table {
            Some(table) => table.pose.world_from_object.isometry().inverse(),
            None => Translation3::from(object.middle.coords).into(),
        };
        GraspRun { losses: Some(losses), ..tally.run(&seed, grasps) }
    }

    /// The opened gripper about a pair, at a roll and a depth along its pads where it is neither in the object nor too near
    /// to the table; `None` where there is none.
    fn place(
        &mut self,
        object: &ObjectSearch,
        pads: &Pads,
        pair: &Pair,
        table: Option<&Table<'_>>,
        losses: &mut PairLosses,
        stream: &mut Stream,
    ) -> Option<Start> {
        let hand = Arc::clone(&self.hand);
        // Opened a little farther than the pair; either pad may take its first point.
        let gap = ((pads.widest - pair.length()) / 2.0).min(BEFORE[1]);
        let value = pads.value((pair.length() + 2.0 * gap).min(pads.widest)).filter(|_| gap >= MIN_GAP);
        let Some(value) = value else {
            losses.too_wide += 1;
            return None;
        };
        let posture = pads.posture(&hand, value);
        let joints = hand.posture_values(&posture);
        let frames = hand.link_frames(&joints);
        let base_from_pads = pads.base_from_pads(&hand, &frames);
        let base_from_approach = *hand.approach_pose(&frames).isometry();
        let approach = base_from_approach.rotation * Vector3::z();
        let [inner, outer] = pads.extent(&hand, &self.closing.solids, &frames);
        let line = if stream.unit() < 0.5 { pair.inward() } else { -pair.inward() };
        // Cheap tests first: the table by geometry, then the object.
        let mut is_above = false;
        for _ in 0..ROLLS {
            let (roll, share) = (stream.uniform(0.0, TAU), stream.unit());
            let base_from_pair = |depth: f64| Translation3::from(approach * depth) * base_from_pads;
            let object_from_base = |roll: f64, depth: f64| {
                let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&line, roll));
                let object_from_pair = IsometryMatrix3::from_parts(Translation3::from(pair.middle()), rotation);
                object_from_pair * base_from_pair(depth).inverse()
            };
            let (mut roll, mut first) = (roll, inner);
            if let Some(table) = table {
                let rise = |roll: f64| -table.up.dot(&(object_from_base(roll, outer).rotation * approach));
                // Half a turn on, a hand that would come from below comes from above.
                if rise(roll) < 0.0 {
                    roll += TAU / 2.0;
                }
                // Backing off by a length lifts the hand by that length times the rise.
                let spare = self.rating.height(table.pose, &object_from_base(roll, outer), &frames) - table.margin;
                if spare < 0.0 {
                    continue;
                }
                first = first.max(outer - spare / rise(roll).max(f64::MIN_POSITIVE));
            }
            is_above = true;
            // A depth of those that are left.
            let here = object_from_base(roll, first + (outer - first) * share);
            if self.closing.penetration(&object.surface, &here, &joints) <= ALLOWED_OVERLAP {
                return Some(Start {
                    object_from_approach: here * base_from_approach,
                    posture,
                    amplitudes: Vec::new(),
                });
            }
        }
        if is_above {
            losses.in_object += 1;
        } else {
            losses.below_table += 1;
        }
        None
    }

    /// Whether both pads touch.
    fn is_held(&self, grasp: &Grasp) -> bool {
        let touches = |side: f64| grasp.contacts.iter().any(|contact| self.hand.closing_side(contact.link) == side);
        touches(1.0) && touches(-1.0)
    }

    /// Pairs half way along the pads, at any roll: the best by energy, no two duplicates.
    fn by_middles(
        &mut self,
        object: &ObjectSearch,
        pads: &Pads,
        antipodal: &Antipodal,
        stream: &mut Stream,
    ) -> GraspRun {
        self.best = BestList::new(antipodal.best as usize);
        self.best.clear(object.radius);
        let mut tally = Tally::new(antipodal.pairs);
        for index in 0..antipodal.pairs {
            let pair = Pair::draw(&object.surface, antipodal.friction, stream);
            let roll = stream.uniform(0.0, TAU);
            let start = pair.and_then(|pair| self.on_middles(object, pads, &pair, roll));
            let energy = start.as_ref().map(|start| self.rating.energies_of(object, start).total);
            tally.count(index, energy);
            if let Some((start, energy)) = start.zip(energy) {
                let mut state = State::default();
                state[0] = start.posture[pads.index];
                self.best.offer(energy, &Frame::of(&start.object_from_approach), &state);
            }
        }
        let start = |candidate: &Candidate| Start {
            object_from_approach: candidate.object_from_approach.isometry(),
            posture: pads.posture(&self.hand, candidate.state[0]),
            amplitudes: Vec::new(),
        };
        let grasps = self.best.list().iter().map(|candidate| self.rating.started(object, start(candidate))).collect();
        tally.run(&Translation3::from(object.middle.coords).into(), grasps)
    }

    /// The gripper with the middles of its pads on both sides of a pair, a little open; `None` where it does not open so far,
    /// or would be in the object.
    fn on_middles(&mut self, object: &ObjectSearch, pads: &Pads, pair: &Pair, roll: f64) -> Option<Start> {
        let hand = Arc::clone(&self.hand);
        let posture = pads.posture(&hand, pads.value(pair.length() + 2.0 * BEFORE[1])?);
        let joints = hand.posture_values(&posture);
        let base_from_pads = pads.base_from_pads(&hand, &hand.link_frames(&joints));
        let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&pair.inward(), roll));
        let object_from_pads = IsometryMatrix3::from_parts(Translation3::from(pair.middle()), rotation);
        let object_from_base = object_from_pads * base_from_pads.inverse();
        let deep = self.closing.penetration(&object.surface, &object_from_base, &joints);
        let object_from_approach = object_from_base * hand.approach_pose(&hand.link_frames(&joints)).isometry();
        (deep <= ALLOWED_OVERLAP).then_some(Start { object_from_approach, posture, amplitudes: Vec::new() })
    }
}

impl<'a> Table<'a> {
    /// The table below an object in one of its resting poses, drawn by their probabilities; `None` where it has none.
    fn draw(object: &'a ObjectSearch, margin: f64, stream: &mut Stream) -> Option<Self> {
        let poses = &object.resting().poses;
        let mut left = stream.unit() * poses.iter().map(|pose| pose.probability).sum::<f64>();
        let drawn = poses.iter().position(|pose| {
            left -= pose.probability;
            left < 0.0
        });
        // Rounding may leave a little after the last.
        let index = drawn.or(poses.len().checked_sub(1))?;
        let pose = &poses[index];
        Some(Self { index, pose, up: pose.up(), margin })
    }
}
