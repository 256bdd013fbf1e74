//! Trials, one after another.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Translation3, Vector3};

use super::{
    Gravity, Grip, Outcome, Phase, Slip, Start, TrialConditions, TrialProtocol, TrialSim, Verdict, WhileClosing,
};
use crate::{
    closing::{Command, HandWorker},
    error::HandError,
    ffi,
    free_object::FreeObject,
    hand_sim::{Hold, SLIDE_MASS, STEP, quaternion},
};
use kernel::contact::EDGE_RADIUS;

/// [m/s^2].
const GRAVITY: f64 = 9.81;

/// A hand that backs off is clear of the object when it is no deeper than this [m].
const CLEAR: f64 = 1e-4;

/// Steps of backing off: share of their range that fingers open per step, distance that a hand draws back per step, and
/// in all [m].
const OPENS: f64 = 0.02;
const DRAWS_BACK: f64 = 5e-4;
const MAX_BACK: f64 = 0.005;

/// Distance beyond which an object that closing pushed away has left the hand [m].
const PUSHED_AWAY: f64 = 0.1;

/// Working memory of one thread that makes trials; its state is its own.
pub struct TrialWorker {
    hand: HandWorker,
    object: FreeObject,
    protocol: TrialProtocol,
    /// Mass, friction and torsion that the model has.
    set: Option<[f64; 3]>,
    commands: Vec<Command>,
}

/// Ends a trial early.
type Decided<T> = Result<T, Verdict>;

impl TrialWorker {
    /// A worker with a model of its own.
    pub fn new(sim: &TrialSim) -> Self {
        let Hold::Free(object) = sim.sim.hold else { unreachable!("trials are compiled with a free object") };
        let hand = HandWorker::new(&sim.sim);
        let commands = vec![Command::Close; sim.hand().driven().len()];
        Self { hand, object, protocol: sim.protocol, set: None, commands }
    }

    /// Tries one grasp: the hand's posture before it closes, one value per driven joint, and the object expressed in its base
    /// frame. The trials before leave no trace.
    ///
    /// # Errors
    /// When the posture does not fit the hand, or a number is not finite or out of range. What goes wrong in the trial itself
    /// is in its verdict.
    pub fn run(
        &mut self,
        posture: &[f64],
        base_from_object: &IsometryMatrix3<f64>,
        conditions: &TrialConditions,
    ) -> Result<Outcome, HandError> {
        conditions.check()?;
        self.set_object(conditions, self.closing_mass(conditions));
        let pose = conditions.placed(base_from_object, &self.object.centre);
        let start = self.seat(posture, &pose, conditions.backs_off)?;
        let mut outcome = Outcome {
            verdict: Verdict::Held,
            start,
            closed: None,
            closed_at_rest: false,
            closing_time: 0.0,
            slips: Vec::new(),
            farthest: 0.0,
            shaken_penetration: 0.0,
            end: None,
            steps: 0,
            warnings: 0,
        };
        let decided = self.decide(&mut outcome, conditions);
        outcome.verdict = decided.err().unwrap_or(Verdict::Held);
        outcome.steps = self.hand.steps();
        outcome.warnings = self.hand.data.warning().iter().map(|warning| warning.number as u32).sum();
        if !matches!(outcome.verdict, Verdict::Refused { .. } | Verdict::Unstable { .. }) {
            outcome.end = Some(self.grip());
        }
        Ok(outcome)
    }

    /// The phases, until one decides.
    fn decide(&mut self, outcome: &mut Outcome, conditions: &TrialConditions) -> Decided<()> {
        // Start too deep in the object: refused before any motion.
        let penetration = outcome.start.penetration;
        if penetration > self.deepest_start() {
            return Err(Verdict::Refused { penetration });
        }
        self.close(outcome, conditions)?;
        // Axes of the object at the start, in which the accelerations are given; they act in the hand's base frame.
        let upright = outcome.start.base_from_object.rotation;
        let reference = self.hand.base_from_object();
        let protocol = self.protocol;
        match conditions.gravity {
            Gravity::Lifted => {
                // Apparent acceleration in the frame of the moving hand: gravity minus the acceleration of the motion.
                let lift = |time| -protocol.lifting(time) - Vector3::z() * GRAVITY;
                self.carry(outcome, &reference, (Phase::Lift, protocol.lift_time), |time| upright * lift(time))?;
                let shake = |time| -protocol.shaking(time) - Vector3::z() * GRAVITY;
                self.carry(outcome, &reference, (Phase::Shake, protocol.shake_time), |time| upright * shake(time))?;
            }
            Gravity::Six => {
                // Gravity along each axis of the object in both senses, -z first.
                for direction in 0..6_u8 {
                    let mut down = Vector3::zeros();
                    down[2 - usize::from(direction / 2)] = if direction % 2 == 0 { -GRAVITY } else { GRAVITY };
                    let phase = (Phase::Turned(direction), protocol.turned_time);
                    self.carry(outcome, &reference, phase, |_| upright * down)?;
                }
            }
        }
        // Grasp held only if at least two links touch the object.
        let links = self.grip().links().len();
        if links < 2 { Err(Verdict::LetGo { links }) } else { Ok(()) }
    }

    /// Mass of the object while the hand closes [kg]: one that stays is heavy, so that contacts are as hard as on a
    /// wall.
    fn closing_mass(&self, conditions: &TrialConditions) -> f64 {
        match self.protocol.while_closing {
            WhileClosing::Still => SLIDE_MASS,
            WhileClosing::Free | WhileClosing::Damped => conditions.mass,
        }
    }

    /// Gives the object a mass [kg], and its friction.
    fn set_object(&mut self, conditions: &TrialConditions, mass: f64) {
        let wanted = [mass, conditions.friction, conditions.torsion];
        if self.set != Some(wanted) {
            // What MuJoCo derives from the masses it derives in the hand's first posture, and leaves the hand there.
            let [qpos, qvel] = [self.hand.data.qpos().to_vec(), self.hand.data.qvel().to_vec()];
            ffi::set_object(&mut self.hand.data, &self.object, wanted);
            self.hand.data.qpos_mut().copy_from_slice(&qpos);
            self.hand.data.qvel_mut().copy_from_slice(&qvel);
            self.set = Some(wanted);
        }
        self.hand.data.model_opt_mut().gravity = [0.0; 3];
    }

    /// Puts hand and object where they start.
    fn seat(
        &mut self,
        posture: &[f64],
        base_from_object: &IsometryMatrix3<f64>,
        backs_off: bool,
    ) -> Result<Start, HandError> {
        self.hand.start(posture, base_from_object)?;
        self.hand.set_effort(self.protocol.effort);
        let (mut posture, mut pose) = (posture.to_vec(), *base_from_object);
        let (mut opened_by, mut drawn_back) = (0.0, 0.0);
        let mut deepest = self.depths();
        if backs_off && deepest.iter().any(|depth| *depth > self.deepest_start()) {
            let hand = Arc::clone(self.hand.hand());
            let frames = hand.link_frames(&hand.posture_values(&posture));
            let back = hand.approach_pose(&frames).isometry().rotation * Vector3::z() * DRAWS_BACK;
            loop {
                let [base, fingers] = deepest;
                if fingers > CLEAR && opened_by < 1.0 {
                    opened_by = f64::min(opened_by + OPENS, 1.0);
                    for (value, driven) in posture.iter_mut().zip(hand.driven()) {
                        let range = driven.opened - driven.closed.unwrap_or(driven.opened);
                        let [one, other] = [*value, driven.opened];
                        let within = [one.min(other), one.max(other)];
                        *value = (*value + OPENS * range).max(within[0]).min(within[1]);
                    }
                } else if base.max(fingers) > CLEAR && drawn_back < MAX_BACK {
                    drawn_back += DRAWS_BACK;
                    pose = Translation3::from(back) * pose;
                } else {
                    break;
                }
                self.hand.start(&posture, &pose)?;
                self.hand.set_effort(self.protocol.effort);
                deepest = self.depths();
            }
        }
        let penetration = deepest[0].max(deepest[1]);
        Ok(Start { posture, base_from_object: pose, penetration, opened_by, drawn_back })
    }

    /// The deepest start that is none too deep [m]. A box or a cylinder whose core is cut by the surface is reported as deep as
    /// its edges are rounded, or a little less, however deep it is: so much is too deep whatever the protocol says.
    fn deepest_start(&self) -> f64 {
        self.protocol.start_depth.min(0.98 * EDGE_RADIUS)
    }

    /// Penetration of the object by the base and by the other links [m], 0 where they are clear.
    fn depths(&self) -> [f64; 2] {
        self.hand.touches().iter().fold([0.0; 2], |mut deepest, touch| {
            let of = &mut deepest[usize::from(touch.link > 0)];
            *of = f64::max(*of, -touch.distance);
            deepest
        })
    }

    /// Closes the hand without gravity, and lets the object go.
    fn close(&mut self, outcome: &mut Outcome, conditions: &TrialConditions) -> Decided<()> {
        let from = outcome.start.base_from_object * self.object.centre;
        for _ in 0..steps_in(self.protocol.closing) {
            self.step(Phase::Closing)?;
            self.hold_object(outcome);
            if self.hand.is_at_rest() {
                outcome.closed_at_rest = true;
                break;
            }
            if (self.centre() - from).norm() > PUSHED_AWAY {
                return Err(self.lost(Phase::Closing));
            }
        }
        outcome.closing_time = f64::from(self.hand.steps()) * STEP;
        self.touching(outcome)?;
        if self.protocol.while_closing != WhileClosing::Free {
            self.set_object(conditions, conditions.mass);
            for _ in 0..steps_in(self.protocol.settling) {
                self.step(Phase::Closing)?;
                if (self.centre() - from).norm() > PUSHED_AWAY {
                    return Err(self.lost(Phase::Closing));
                }
            }
            self.touching(outcome)?;
        }
        Ok(())
    }

    /// Keeps the closed hand; with fewer than two links at the object nothing can hold it.
    fn touching(&self, outcome: &mut Outcome) -> Decided<()> {
        let closed = self.grip();
        let links = closed.links().len();
        outcome.closed = Some(closed);
        match links {
            0 => Err(Verdict::NotTouching),
            1 => Err(Verdict::OneLink),
            _ => Ok(()),
        }
    }

    /// Takes from the object the motion or the speed that the last step gave it, as its support while the hand closes
    /// asks.
    fn hold_object(&mut self, outcome: &Outcome) {
        let FreeObject { address, dof, .. } = self.object;
        if self.protocol.while_closing == WhileClosing::Free {
            return;
        }
        if self.protocol.while_closing == WhileClosing::Still {
            let pose = &outcome.start.base_from_object;
            let coordinates = &mut self.hand.data.qpos_mut()[address..][..7];
            coordinates[..3].copy_from_slice(pose.translation.vector.as_slice());
            coordinates[3..].copy_from_slice(&quaternion(pose));
        }
        self.hand.data.qvel_mut()[dof..][..6].fill(0.0);
    }

    /// One phase under a field of acceleration in the hand's base [m/s^2], as a function of the time since it began; the object
    /// may not leave where it was at `reference`.
    fn carry(
        &mut self,
        outcome: &mut Outcome,
        reference: &IsometryMatrix3<f64>,
        (phase, time): (Phase, f64),
        field: impl Fn(f64) -> Vector3<f64>,
    ) -> Decided<()> {
        let before = self.hand.base_from_object();
        let origin = reference * self.object.centre;
        for step in 0..steps_in(time) {
            self.hand.data.model_opt_mut().gravity = field((f64::from(step) + 0.5) * STEP).into();
            self.step(phase)?;
            outcome.shaken_penetration = outcome.shaken_penetration.max(self.depth());
            let now = self.hand.base_from_object();
            let moved = (now * self.object.centre - origin).norm();
            outcome.farthest = outcome.farthest.max(moved);
            if moved > self.protocol.lost_distance || angle_between(reference, &now) > self.protocol.lost_angle {
                return Err(self.lost(phase));
            }
        }
        let now = self.hand.base_from_object();
        let moved = (now * self.object.centre - before * self.object.centre).norm();
        let rate = if time > 0.0 { moved / time } else { 0.0 };
        outcome.slips.push(Slip { phase, moved, turned: angle_between(&before, &now), rate });
        Ok(())
    }

    fn step(&mut self, phase: Phase) -> Decided<()> {
        self.hand.step(&self.commands).map_err(|what| Verdict::Unstable { phase, what })
    }

    fn lost(&self, phase: Phase) -> Verdict {
        Verdict::Lost { phase, time: f64::from(self.hand.steps()) * STEP }
    }

    /// The object's centre of mass, expressed in the hand's base frame.
    fn centre(&self) -> Point3<f64> {
        self.hand.base_from_object() * self.object.centre
    }

    /// Present overlap depth of hand and object [m].
    fn depth(&self) -> f64 {
        let object = self.object.geom as i32;
        let of_object = self.hand.data.contact().iter().filter(|contact| contact.geom.contains(&object));
        of_object.map(|contact| -contact.dist).fold(0.0, f64::max)
    }

    fn grip(&self) -> Grip {
        Grip {
            joints: self.hand.joints(),
            motors: self.hand.motors(),
            base_from_object: self.hand.base_from_object(),
            touches: self.hand.touches(),
        }
    }
}

fn steps_in(time: f64) -> u32 {
    (time / STEP).round() as u32
}

/// The angle between two placements [rad].
fn angle_between(one: &IsometryMatrix3<f64>, other: &IsometryMatrix3<f64>) -> f64 {
    // By the chord: good for small angles as well.
    let chord = (one.rotation.matrix() - other.rotation.matrix()).norm() / std::f64::consts::SQRT_2;
    2.0 * libm::asin((chord / 2.0).min(1.0))
}
