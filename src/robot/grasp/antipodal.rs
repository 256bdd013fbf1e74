//! Hands on pairs of points on opposite sides of an object: contacts come first, and the hand follows from them. A gripper takes
//! a pair between its pads, every other hand between two of its contacts that face each other.

use std::{f64::consts::TAU, sync::Arc};

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::{
    best::{BestList, Candidate},
    found::{PairLosses, RatedGrasp, SearchRun},
    frame::Frame,
    known::KnownStates,
    object::ObjectSearch,
    opposition::Oppositions,
    pads::{Grip, Pads},
    pairs::{NoPair, Pair, PairRule},
    points::PointMixture,
    rate::HandState,
    sampled::{BEFORE, GraspSampler},
    settings::{Antipodal, PairHold, RestingChoice, Support},
    solids::ALLOWED_OVERLAP,
    state::is_feasible,
    tally::Tally,
    variables::State,
};
use kernel::{
    geom::{RestingPose, rotation_towards},
    seed::Stream,
    words::PointScheme,
};

/// Rolls about the line of a pair that are tried at most: of a gripper, and of every hold of another hand.
const ROLLS: [u32; 2] = [8, 24];

/// Holds of a hand of many fingers that are tried on a pair at most.
const HOLDS: u32 = 4;

/// An opened pad is so far from its point at least [m]; [`BEFORE`] where the hand opens that far.
const MIN_GAP: f64 = 0.001;

/// Least and largest opening margin of a many-fingered hand for a pair [m].
const OPENED_BY: [f64; 2] = [0.002, 0.016];

/// For fingers that sink as they close, the hand is lifted by the missing part of the margin, and by this [m], if that
/// is no more than [`MAX_LIFT`].
const LIFT: f64 = 0.0005;

/// Farther than this no hand is lifted [m].
const MAX_LIFT: f64 = 0.03;

/// Parts of a hand between which it takes a pair.
enum Holds<'a> {
    Pads(&'a Pads),
    Contacts(&'a Oppositions),
}

/// Source of the pairs of a run.
struct PairSource<'a> {
    rule: PairRule<'a>,
    mixture: PointMixture<'a>,
    /// Straight up, in `Object`, above a table.
    up: Option<Vector3<f64>>,
}

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
    /// If [`PairHold::Middle`] is used with a hand without a [`Hand::closing_line`](crate::hand::Hand::closing_line).
    pub fn antipodal(&mut self, object: &ObjectSearch, antipodal: &Antipodal, stream: &mut Stream) -> SearchRun {
        let pads = Pads::new(&self.search.hand);
        match antipodal.hold {
            PairHold::Middle => {
                let pads = pads.expect("only a hand that closes along a line has middles of pads");
                self.by_middles(object, &pads, antipodal, stream)
            }
            PairHold::Along(support) => {
                let search = Arc::clone(&self.search);
                let holds = match &pads {
                    Some(pads) => Holds::Pads(pads),
                    None => Holds::Contacts(search.oppositions()),
                };
                self.along(object, &holds, antipodal, support, stream)
            }
        }
    }

    /// Pairs anywhere along the fingers: the first that the hand holds once closed, no two alike. The run ends once it has its
    /// states.
    fn along(
        &mut self,
        object: &ObjectSearch,
        holds: &Holds<'_>,
        antipodal: &Antipodal,
        support: Support,
        stream: &mut Stream,
    ) -> SearchRun {
        let mut losses = PairLosses::default();
        // Pose of the object on the table, drawn once per run.
        let table = match support {
            Support::Air => None,
            Support::Table { margin, resting } => {
                let table = Table::draw(object, margin, resting, stream);
                losses.no_resting_pose = table.is_none();
                table
            }
        };
        let source = self.pair_source(object, holds, antipodal.friction, table.as_ref());
        let mut known = KnownStates::new(&self.search);
        let (mut energies, mut grasps) = (Vec::new(), Vec::<RatedGrasp>::new());
        losses.nowhere_thin = source.mixture.is_empty();
        let budget = if losses.no_resting_pose || losses.nowhere_thin { 0 } else { antipodal.pairs };
        while losses.pairs < budget && grasps.len() < antipodal.best as usize {
            // Two points, then the opened hand about them.
            let (scheme, pair) = source.draw(losses.pairs, stream);
            losses.pairs += 1;
            energies.push(None);
            let pair = match pair {
                Ok(pair) => pair,
                Err(NoPair::Unopposed) => {
                    losses.unopposed += 1;
                    continue;
                }
                Err(NoPair::TooWide) => {
                    losses.too_wide += 1;
                    continue;
                }
            };
            let Some(start) = self.place(object, holds, &pair, table.as_ref(), &mut losses, stream) else { continue };
            // Closing costs most: states like a known one are left out before.
            if known.has(&start.object_from_approach) {
                losses.known += 1;
                continue;
            }
            let mut grasp = self.rating.placed(object, start.clone());
            *energies.last_mut().expect("one of this pair") = Some(grasp.energies.total);
            if let (Some(table), Holds::Contacts(_)) = (&table, holds)
                && let Some(lifted) = table.lifted(&grasp, start)
            {
                grasp = self.rating.placed(object, lifted);
            }
            // Keep what the closed hand holds, what the table allows, and what is unlike the kept grasps.
            if !self.is_held(holds, &grasp) {
                losses.open += 1;
            } else if table.as_ref().is_some_and(|table| table.lacks(&grasp).is_none_or(|lacks| lacks > 0.0)) {
                losses.lowered += 1;
            } else if known.has(&grasp.object_from_approach) {
                losses.known += 1;
            } else {
                known.add(&grasp.object_from_approach);
                grasps.push(RatedGrasp { point_scheme: Some(scheme), ..grasp });
            }
        }
        losses.budget_spent = budget > 0 && losses.pairs == budget && grasps.len() < antipodal.best as usize;
        // Energies of the closed states, and the frame from which the run starts.
        let mut tally = Tally::new(losses.pairs);
        (0..).zip(energies).for_each(|(index, energy)| tally.count(index, energy));
        let seed = match &table {
            Some(table) => table.pose.world_from_object.isometry().inverse(),
            None => Translation3::from(object.middle.coords).into(),
        };
        SearchRun { losses: Some(losses), ..tally.run(&seed, grasps) }
    }

    /// Pairs of points that the hand may take, of an object on a table or in the air.
    fn pair_source<'o>(
        &self,
        object: &'o ObjectSearch,
        holds: &Holds<'_>,
        friction: f64,
        table: Option<&Table<'_>>,
    ) -> PairSource<'o> {
        let max = match holds {
            Holds::Pads(pads) => pads.widest - 2.0 * MIN_GAP,
            Holds::Contacts(oppositions) => oppositions.widest() - OPENED_BY[0],
        };
        let (surface, level) = (&**object.surface(), self.level);
        let rule = PairRule { surface, friction, max, level };
        let mixture = PointMixture::new(surface, object.sample(level), rule.max_thickness(), level);
        PairSource { rule, mixture, up: table.map(|table| table.up) }
    }

    /// The hand opened a little farther than a pair; `None` where it does not open so far.
    fn grip(&self, holds: &Holds<'_>, pair: &Pair, stream: &mut Stream) -> Option<Grip> {
        let (hand, solids, length) = (&self.search.hand, &self.closing.solids, pair.length());
        match holds {
            Holds::Pads(pads) => {
                let gap = ((pads.widest - length) / 2.0).min(BEFORE[1]);
                let value = pads.value((length + 2.0 * gap).min(pads.widest)).filter(|_| gap >= MIN_GAP)?;
                Some(pads.grip(hand, solids, value))
            }
            Holds::Contacts(oppositions) => oppositions.draw(hand, solids, OPENED_BY.map(|by| length + by), stream),
        }
    }

    /// The opened hand about a pair, at a roll and a depth along its fingers where it is neither in the object nor too
    /// near to the table; `None` if there is no such pose.
    fn place(
        &mut self,
        object: &ObjectSearch,
        holds: &Holds<'_>,
        pair: &Pair,
        table: Option<&Table<'_>>,
        losses: &mut PairLosses,
        stream: &mut Stream,
    ) -> Option<HandState> {
        let (tries, rolls) = match holds {
            Holds::Pads(_) => (1, ROLLS[0]),
            Holds::Contacts(_) => (HOLDS, ROLLS[1]),
        };
        let (mut is_opened, mut is_above) = (false, false);
        for _ in 0..tries {
            let Some(grip) = self.grip(holds, pair, stream) else { break };
            is_opened = true;
            let found = self.place_grip(object, &grip, pair, (table, rolls), &mut is_above, stream);
            if let Some(object_from_approach) = found {
                return Some(HandState { object_from_approach, posture: grip.posture, amplitudes: grip.amplitudes });
            }
        }
        match (is_opened, is_above) {
            (false, _) => losses.too_wide += 1,
            (_, true) => losses.in_object += 1,
            (_, false) => losses.below_table += 1,
        }
        None
    }

    /// Pose of the approach frame for this grip, at the first of `rolls` rolls where the hand is neither in the object
    /// nor too near to the table; sets `is_above` if only the object rules out a roll.
    fn place_grip(
        &mut self,
        object: &ObjectSearch,
        grip: &Grip,
        pair: &Pair,
        (table, rolls): (Option<&Table<'_>>, u32),
        is_above: &mut bool,
        stream: &mut Stream,
    ) -> Option<IsometryMatrix3<f64>> {
        let Grip { amplitudes, joints, frames, base_from_line, extent, .. } = grip;
        let base_from_approach = *self.search.hand.approach_pose(frames).isometry();
        let approach = base_from_approach.rotation * Vector3::z();
        let [inner, outer] = *extent;
        // Either side of the hand may take the first point.
        let line = if stream.unit() < 0.5 { pair.inward() } else { -pair.inward() };
        // Cheap tests first: the table by geometry, then the object.
        for _ in 0..rolls {
            let (roll, share) = (stream.uniform(0.0, TAU), stream.unit());
            let base_from_pair = |depth: f64| Translation3::from(approach * depth) * *base_from_line;
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
                let spare = self.rating.table.height(table.pose, &object_from_base(roll, outer), frames) - table.margin;
                if spare < 0.0 {
                    continue;
                }
                first = first.max(outer - spare / rise(roll).max(f64::MIN_POSITIVE));
            }
            *is_above = true;
            // A random depth in the remaining range.
            let here = object_from_base(roll, first + (outer - first) * share);
            if self.is_clear(object, &here, amplitudes)
                && !self.closing.overlaps(object.surface(), &here, joints, ALLOWED_OVERLAP)
            {
                return Some(here * base_from_approach);
            }
        }
        None
    }

    /// Whether the hand in a posture of amplitudes may be clear of the object, by the test of annealing, which is by far the
    /// cheaper one; true of a gripper without amplitudes.
    pub(super) fn is_clear(
        &mut self,
        object: &ObjectSearch,
        object_from_base: &IsometryMatrix3<f64>,
        amplitudes: &[f64],
    ) -> bool {
        let base = Frame::of(object_from_base);
        amplitudes.is_empty()
            || is_feasible(self.level, &self.search, object.field(), &base, amplitudes, &mut self.scratch)
    }

    /// Whether the closed hand holds the object between both pads, or between two links that press against each other.
    fn is_held(&self, holds: &Holds<'_>, grasp: &RatedGrasp) -> bool {
        let contacts = &grasp.contacts;
        match holds {
            Holds::Pads(_) => {
                let touches =
                    |side: f64| contacts.iter().any(|contact| self.search.hand.closing_side(contact.link) == side);
                touches(1.0) && touches(-1.0)
            }
            Holds::Contacts(_) => grasp.presses_from_both_sides(),
        }
    }

    /// Pairs half way along the pads, at any roll: the best by energy, no two duplicates.
    fn by_middles(
        &mut self,
        object: &ObjectSearch,
        pads: &Pads,
        antipodal: &Antipodal,
        stream: &mut Stream,
    ) -> SearchRun {
        self.best = BestList::new(antipodal.best as usize);
        self.best.clear(object.radius);
        let mut tally = Tally::new(antipodal.pairs);
        // Farther apart than the hand opens, no posture is found.
        let rule =
            PairRule { surface: object.surface(), friction: antipodal.friction, max: f64::INFINITY, level: self.level };
        for index in 0..antipodal.pairs {
            let point = rule.point_by_area(stream);
            let pair = rule.draw(point, stream).ok();
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
        let start = |candidate: &Candidate| HandState {
            object_from_approach: candidate.object_from_approach.isometry(),
            posture: pads.posture(&self.search.hand, candidate.state[0]),
            amplitudes: Vec::new(),
        };
        let grasps = self.best.list().iter().map(|candidate| self.rating.started(object, start(candidate))).collect();
        tally.run(&Translation3::from(object.middle.coords).into(), grasps)
    }

    /// The gripper with the middles of its pads on both sides of a pair, a little open; `None` where it does not open so far,
    /// or would be in the object.
    fn on_middles(&mut self, object: &ObjectSearch, pads: &Pads, pair: &Pair, roll: f64) -> Option<HandState> {
        let hand = Arc::clone(&self.search.hand);
        let posture = pads.posture(&hand, pads.value(pair.length() + 2.0 * BEFORE[1])?);
        let joints = hand.posture_values(&posture);
        let base_from_pads = pads.base_from_pads(&hand, &hand.link_frames(&joints));
        let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&pair.inward(), roll));
        let object_from_pads = IsometryMatrix3::from_parts(Translation3::from(pair.middle()), rotation);
        let object_from_base = object_from_pads * base_from_pads.inverse();
        let object_from_approach = object_from_base * hand.approach_pose(&hand.link_frames(&joints)).isometry();
        let is_clear = !self.closing.overlaps(object.surface(), &object_from_base, &joints, ALLOWED_OVERLAP);
        is_clear.then_some(HandState { object_from_approach, posture, amplitudes: Vec::new() })
    }
}

impl PairSource<'_> {
    /// Draws the pair with a number in its run.
    fn draw(&self, number: u32, stream: &mut Stream) -> (PointScheme, Result<Pair, NoPair>) {
        let scheme = PointMixture::scheme(stream);
        let pair = match &self.up {
            // From above a gripper takes only level pairs; from aside it also takes others.
            Some(up) if number.is_multiple_of(2) => {
                self.rule.draw_level(|stream| self.mixture.draw(scheme, stream), up, stream)
            }
            _ => {
                let point = self.mixture.draw(scheme, stream);
                self.rule.draw(point, stream)
            }
        };
        (scheme, pair)
    }
}

impl<'a> Table<'a> {
    /// The table below an object in one of its resting poses; `None` where it has none.
    fn draw(object: &'a ObjectSearch, margin: f64, resting: RestingChoice, stream: &mut Stream) -> Option<Self> {
        let poses = &object.resting().poses;
        let index = match resting {
            RestingChoice::Likeliest => 0,
            RestingChoice::Drawn => {
                let mut left = stream.unit() * poses.iter().map(|pose| pose.probability).sum::<f64>();
                let drawn = poses.iter().position(|pose| {
                    left -= pose.probability;
                    left < 0.0
                });
                // Rounding may leave a little after the last.
                drawn.or(poses.len().checked_sub(1))?
            }
        };
        let pose = poses.get(index)?;
        Some(Self { index, pose, up: pose.up(), margin })
    }

    /// Height that a closed hand lacks of the margin [m], below 0 where it keeps it; `None` where it was not closed.
    fn lacks(&self, grasp: &RatedGrasp) -> Option<f64> {
        Some(self.margin - grasp.clearances.get(self.index)?.shaped)
    }

    /// The start of a grasp whose fingers sink too low as they close, moved back along its approach by the missing
    /// distance; `None` if they do not, or if that is too far.
    fn lifted(&self, grasp: &RatedGrasp, start: HandState) -> Option<HandState> {
        let lacks = self.lacks(grasp).filter(|lacks| *lacks > 0.0)?;
        let direction = start.object_from_approach.rotation * Vector3::z();
        let back = (lacks + LIFT) / -self.up.dot(&direction);
        let object_from_approach = Translation3::from(direction * -back) * start.object_from_approach;
        (0.0..=MAX_LIFT).contains(&back).then_some(HandState { object_from_approach, ..start })
    }
}
