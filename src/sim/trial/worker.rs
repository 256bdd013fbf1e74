//! Trials, one after another.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Translation3, Vector3};

use super::{
    FOLLOWED, Gravity, Grip, Margins, Outcome, Phase, Series, Slip, Start, TrialConditions, TrialProtocol, TrialSim,
    Verdict, WhileClosing, pressing_links,
};
use crate::{
    convert::{angle_between, quaternion},
    error::HandError,
    ffi,
    hand::{
        closing::HandWorker,
        effort::{MotorCommand, MotorLaw},
        sim::{GeomOwner, Hold, SLIDE_MASS},
    },
    objects::{free_object::FreeObject, true_mesh::TrueMesh},
    physics::{GRAVITY, Instability, STEP, Unstable},
};
use kernel::contact::EDGE_RADIUS;

/// A hand that backs off is clear of the object when it is no deeper than this [m].
const CLEAR: f64 = 1e-4;

/// Steps of backing off: share of their range that fingers open per step, distance that a hand draws back per step, and
/// in all [m].
const OPENS: f64 = 0.02;
const DRAWS_BACK: f64 = 5e-4;
const MAX_BACK: f64 = 0.005;

/// Distance beyond which an object that closing pushed away has left the hand [m].
pub(crate) const PUSHED_AWAY: f64 = 0.1;

/// Working memory of one thread that makes trials; it has its own state.
pub struct TrialWorker {
    hand: HandWorker,
    object: FreeObject,
    protocol: TrialProtocol,
    /// Mass, friction and torsion that the model has.
    set: Option<[f64; 3]>,
    commands: Vec<MotorCommand>,
    /// The table that the hand lifts the object off, at its pose when the lift began, in the hand's base frame.
    receding: Option<IsometryMatrix3<f64>>,
    /// The trial over time so far, if its conditions request it.
    series: Option<Series>,
    /// Motion of the object so far, if its conditions request it.
    margins: Option<Margins>,
    /// Law of the motors.
    motors: MotorLaw,
}

/// Ends a trial early.
type Decided<T> = Result<T, Verdict>;

/// Penetration of the hand at the start [m], 0 where it is clear.
#[derive(Clone, Copy)]
struct Depths {
    /// Depth of the base in the object.
    base: f64,
    /// Depth of the other links in the object.
    fingers: f64,
    /// Depth of the lowest link below the table.
    table: f64,
}

impl Depths {
    fn deepest(&self) -> f64 {
        self.base.max(self.fingers).max(self.table)
    }
}

impl TrialWorker {
    /// A worker with its own model.
    pub fn new(sim: &TrialSim) -> Self {
        let Hold::Free(object) = sim.sim.hold else { unreachable!("trials are compiled with a free object") };
        let hand = HandWorker::new(&sim.sim);
        let commands = vec![MotorCommand::Close; sim.hand().driven().len()];
        Self {
            hand,
            object,
            protocol: sim.protocol,
            set: None,
            commands,
            receding: None,
            series: None,
            margins: None,
            motors: MotorLaw::Position,
        }
    }

    /// Tries one grasp: the hand's posture before it closes, one value per driven joint, and the object expressed in its base
    /// frame. The trials before leave no trace.
    ///
    /// # Errors
    /// When the posture does not fit the hand, or a number is not finite or out of range. Failures in the trial itself
    /// are in its verdict.
    pub fn run(
        &mut self,
        posture: &[f64],
        base_from_object: &IsometryMatrix3<f64>,
        conditions: &TrialConditions,
    ) -> Result<Outcome, HandError> {
        // Set friction, contacts, table and mass for these conditions.
        conditions.check()?;
        self.hand.set_numerics(conditions.numerics);
        self.hand.set_edges(conditions.has_sharp_edges);
        let object_from_table = self.table_of(conditions)?;
        self.receding = None;
        self.series = conditions.has_series.then(Series::default);
        self.margins = conditions.has_margins.then(Margins::default);
        self.motors = conditions.motors;
        self.set_object(conditions, self.closing_mass(conditions));
        // Start pose with the errors of the conditions, then backed off if it is too deep.
        let pose = self.approached(posture, conditions) * conditions.placed(base_from_object, &self.object.centre);
        let start = self.seat(posture, &pose, object_from_table.as_ref(), conditions.backs_off)?;
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
            series: None,
            margins: None,
        };
        // Run the phases, and record the results.
        let decided = self.decide(&mut outcome, conditions, object_from_table.as_ref());
        outcome.verdict = decided.err().unwrap_or(Verdict::Held);
        outcome.steps = self.hand.steps();
        outcome.series = self.series.take();
        outcome.margins = self.margins.take();
        outcome.warnings = self.hand.data.warning().iter().map(|warning| warning.number as u32).sum();
        if !matches!(outcome.verdict, Verdict::Refused { .. } | Verdict::Unstable { .. }) {
            outcome.end = Some(self.grip());
        }
        Ok(outcome)
    }

    /// The table under the object, in `Object`, and its friction in the model.
    fn table_of(&mut self, conditions: &TrialConditions) -> Result<Option<IsometryMatrix3<f64>>, HandError> {
        let Some(support) = conditions.table else { return Ok(None) };
        let sim = Arc::clone(&self.hand.sim);
        let (Some(table), Some(TrueMesh { corners, .. })) = (&sim.table, &sim.true_mesh) else {
            let reason = "a table, in a simulation that has none: TrialSim::on_table makes one with it";
            return Err(HandError::Trial { reason: reason.into() });
        };
        ffi::set_table_friction(&mut self.hand.data, table, support.friction);
        Ok(Some(support.object_from_table(corners)))
    }

    /// The phases, until one decides.
    fn decide(
        &mut self,
        outcome: &mut Outcome,
        conditions: &TrialConditions,
        object_from_table: Option<&IsometryMatrix3<f64>>,
    ) -> Decided<()> {
        // Start too deep in the object or the table: refused before any motion.
        let penetration = outcome.start.penetration.max(outcome.start.table_penetration);
        if penetration > deepest_start(self.protocol.start_depth) {
            return Err(Verdict::Refused { penetration });
        }
        // Axes in which the accelerations are given: those of the object at the start, or of the table, whose z is up. They act
        // in the hand's base frame.
        let base_from_object = outcome.start.base_from_object;
        let base_from_table = object_from_table.map(|table| base_from_object * table);
        let upright = base_from_table.map_or(base_from_object.rotation, |table| table.rotation);
        if let Some(table) = &base_from_table {
            self.hand.put_table(table);
            self.hand.data.model_opt_mut().gravity = (upright * -Vector3::z() * GRAVITY).into();
        }
        let closed = self.close(outcome, conditions);
        if let Some(margins) = &mut self.margins {
            margins.close(&base_from_object, &self.hand.base_from_object(), &self.object.centre);
        }
        closed?;
        let reference = self.hand.base_from_object();
        let protocol = self.protocol;
        match conditions.gravity {
            Gravity::Lifted => {
                // Apparent acceleration in the frame of the moving hand: gravity minus the acceleration of the motion.
                let lift = |time| -protocol.lifting(time) - Vector3::z() * GRAVITY;
                self.receding = base_from_table;
                self.carry(outcome, &reference, (Phase::Lift, protocol.lift_time), |time| upright * lift(time))?;
                self.receding = None;
                self.hand.take_table_away();
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
        // An object that was lost has been followed.
        if let Some(loss) = self.margins.as_ref().and_then(|margins| margins.loss) {
            return Err(Verdict::Lost { phase: loss.phase, time: loss.time });
        }
        // Grasp held only if at least two links touch the object.
        let links = self.grip().links().len();
        if links < 2 {
            return Err(Verdict::LetGo { links });
        }
        // Contacts without a direction do not hold: those of a true mesh lose theirs beneath rounded edges.
        let is_deep = outcome.shaken_penetration > EDGE_RADIUS && self.margins.is_none();
        if self.hand.sim.true_mesh.is_some() && is_deep {
            let what = Unstable { step: self.hand.steps(), kind: Instability::Depth };
            return Err(Verdict::Unstable { phase: Phase::Shake, what });
        }
        Ok(())
    }

    /// Mass of the object while the hand closes [kg]: one that stays is heavy, so that contacts are as hard as on a
    /// wall.
    fn closing_mass(&self, conditions: &TrialConditions) -> f64 {
        match self.while_closing(conditions) {
            WhileClosing::Still => SLIDE_MASS,
            WhileClosing::Free | WhileClosing::Damped => conditions.mass,
        }
    }

    /// Support of the object while the hand closes, in addition to a table.
    fn while_closing(&self, conditions: &TrialConditions) -> WhileClosing {
        let is_free = conditions.is_free || conditions.table.is_some();
        if is_free { WhileClosing::Free } else { self.protocol.while_closing }
    }

    /// Gives the object a mass [kg], and its friction.
    fn set_object(&mut self, conditions: &TrialConditions, mass: f64) {
        let wanted = [mass, conditions.friction, conditions.torsion];
        if self.set != Some(wanted) {
            // MuJoCo derives quantities from the masses in the hand's first posture, and leaves the hand there.
            let [qpos, qvel] = [self.hand.data.qpos().to_vec(), self.hand.data.qvel().to_vec()];
            ffi::set_object(&mut self.hand.data, &self.object, wanted);
            self.hand.data.qpos_mut().copy_from_slice(&qpos);
            self.hand.data.qvel_mut().copy_from_slice(&qvel);
            self.set = Some(wanted);
        }
        self.hand.data.model_opt_mut().gravity = [0.0; 3];
    }

    /// Motion of the object in the hand's base that brings the hand [nearer](TrialConditions::advance) to it.
    fn approached(&self, posture: &[f64], conditions: &TrialConditions) -> Translation3<f64> {
        if conditions.advance == 0.0 {
            return Translation3::identity();
        }
        Translation3::from(self.approach(posture) * -conditions.advance)
    }

    /// Direction of the hand's approach in its base frame.
    fn approach(&self, posture: &[f64]) -> Vector3<f64> {
        let hand = self.hand.hand();
        let frames = hand.link_frames(&hand.posture_values(posture));
        hand.approach_direction(&frames)
    }

    /// Puts hand and object where they start.
    fn seat(
        &mut self,
        posture: &[f64],
        base_from_object: &IsometryMatrix3<f64>,
        object_from_table: Option<&IsometryMatrix3<f64>>,
        backs_off: bool,
    ) -> Result<Start, HandError> {
        self.hand.start(posture, base_from_object)?;
        self.set_motors();
        let (mut posture, mut pose) = (posture.to_vec(), *base_from_object);
        let (mut opened_by, mut drawn_back) = (0.0, 0.0);
        // Depth of fingers, base and table at a pose.
        let depths = |worker: &Self, pose: &IsometryMatrix3<f64>| {
            worker.depths(object_from_table.map(|table| pose * table).as_ref())
        };
        let mut deepest = depths(self, &pose);
        if backs_off && deepest.deepest() > deepest_start(self.protocol.start_depth) {
            let hand = Arc::clone(self.hand.hand());
            let back = self.approach(&posture) * DRAWS_BACK;
            // Open the fingers step by step until they are clear, then draw the hand back.
            loop {
                if deepest.fingers > CLEAR && opened_by < 1.0 {
                    opened_by = f64::min(opened_by + OPENS, 1.0);
                    for (value, driven) in posture.iter_mut().zip(hand.driven()) {
                        let range = driven.opened - driven.closed.unwrap_or(driven.opened);
                        let [one, other] = [*value, driven.opened];
                        let within = [one.min(other), one.max(other)];
                        *value = (*value + OPENS * range).max(within[0]).min(within[1]);
                    }
                } else if deepest.deepest() > CLEAR && drawn_back < MAX_BACK {
                    drawn_back += DRAWS_BACK;
                    pose = Translation3::from(back) * pose;
                } else {
                    break;
                }
                self.hand.start(&posture, &pose)?;
                self.set_motors();
                deepest = depths(self, &pose);
            }
        }
        let Depths { base, fingers, table } = deepest;
        let penetration = base.max(fingers);
        Ok(Start { posture, base_from_object: pose, penetration, table_penetration: table, opened_by, drawn_back })
    }

    fn set_motors(&mut self) {
        self.hand.set_effort(self.protocol.effort);
        self.hand.set_motor_law(self.motors);
    }

    /// Penetration of the object and of a table by the hand in its current state.
    fn depths(&self, base_from_table: Option<&IsometryMatrix3<f64>>) -> Depths {
        let table = base_from_table.map_or(0.0, |table| self.hand.depth_below(table));
        self.hand.touches().iter().fold(Depths { base: 0.0, fingers: 0.0, table }, |mut deepest, touch| {
            let of = if touch.link > 0 { &mut deepest.fingers } else { &mut deepest.base };
            *of = f64::max(*of, -touch.distance);
            deepest
        })
    }

    /// Closes the hand, without gravity unless there is a table, and releases the object.
    fn close(&mut self, outcome: &mut Outcome, conditions: &TrialConditions) -> Decided<()> {
        let from = outcome.start.base_from_object * self.object.centre;
        let support = self.while_closing(conditions);
        for _ in 0..steps_in(self.protocol.closing) {
            self.step(Phase::Closing)?;
            self.hold_object(outcome, support);
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
        if support != WhileClosing::Free {
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

    /// Removes from the object the motion or the speed that the last step gave it, as its support while the hand closes
    /// requires.
    fn hold_object(&mut self, outcome: &Outcome, support: WhileClosing) {
        let FreeObject { address, dof, .. } = self.object;
        if support == WhileClosing::Free {
            return;
        }
        if support == WhileClosing::Still {
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
            if let Some(table) = self.receding {
                let lifted = self.protocol.lifted(f64::from(step) * STEP);
                self.hand.put_table(&(table * Translation3::new(0.0, 0.0, -lifted)));
            }
            self.step(phase)?;
            outcome.shaken_penetration = outcome.shaken_penetration.max(self.depth());
            let now = self.hand.base_from_object();
            let moved = (now * self.object.centre - origin).norm();
            outcome.farthest = outcome.farthest.max(moved);
            if let Some(margins) = &mut self.margins {
                let limits = [self.protocol.lost_distance, self.protocol.lost_angle];
                let time = f64::from(self.hand.steps()) * STEP;
                margins.carry(phase, time, [moved, angle_between(reference, &now)], limits);
                if let Some(loss) = margins.loss.filter(|_| moved > FOLLOWED) {
                    return Err(Verdict::Lost { phase: loss.phase, time: loss.time });
                }
                continue;
            }
            if moved > self.protocol.lost_distance || angle_between(reference, &now) > self.protocol.lost_angle {
                return Err(self.lost(phase));
            }
        }
        if self.margins.as_ref().is_some_and(|margins| margins.loss.is_some()) {
            return Ok(());
        }
        let now = self.hand.base_from_object();
        let moved = (now * self.object.centre - before * self.object.centre).norm();
        let rate = if time > 0.0 { moved / time } else { 0.0 };
        outcome.slips.push(Slip { phase, moved, turned: angle_between(&before, &now), rate });
        Ok(())
    }

    fn step(&mut self, phase: Phase) -> Decided<()> {
        if let Some(series) = &mut self.series {
            series.begin(phase, &self.hand);
        }
        self.hand.step(&self.commands).map_err(|what| Verdict::Unstable { phase, what })?;
        if let Some(series) = &mut self.series {
            series.add(phase, &self.hand, &self.object.centre);
        }
        if let Some(margins) = self.margins.as_mut().filter(|_| phase == Phase::Closing) {
            margins.press(&pressing_links(&self.hand.touches()), self.hand.base_from_object() * self.object.centre);
        }
        Ok(())
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
        let contacts = self.hand.data.contact().iter().filter(|contact| {
            let owners = self.hand.owners_of(contact);
            owners.contains(&Some(GeomOwner::Object)) && !owners.contains(&Some(GeomOwner::Table))
        });
        contacts.map(|contact| -contact.dist).fold(0.0, f64::max)
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

/// The deepest start that is not too deep, from a protocol's [m]. A box or a cylinder whose core is cut by the surface
/// is reported at most as deep as its edges are rounded, or a little less: that depth is too deep for every protocol.
pub(crate) fn deepest_start(of_protocol: f64) -> f64 {
    of_protocol.min(0.98 * EDGE_RADIUS)
}

/// Number of steps in a time [s].
pub(crate) fn steps_in(time: f64) -> u32 {
    (time / STEP).round() as u32
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use mujoco_rs::wrappers::{
        mj_auxiliary::MjContact,
        mj_data::MjData,
        mj_editing::MjSpec,
        mj_model::{MjModel, MjtGeomBase},
    };
    use nalgebra::Unit;

    use super::*;
    use crate::{
        HandModel, TableSupport,
        hand::sim::set_option,
        physics::{CONTACT_SOLIMP, CONTACT_SOLREF},
    };
    use assets::{MeshSource, list_folder, object::PreparedObject, prepare};
    use kernel::{
        contact::ContactSurface,
        geom::{MassProperties, TriMesh},
        voxel::InsideTest,
    };

    const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

    fn scan(name: &str) -> PreparedObject {
        let files = list_folder(&Path::new(ROOT).join(".deps/ycb"));
        let files = files.unwrap_or_else(|error| panic!("{error}; `make setup` fetches the scans"));
        let path = files.into_iter().find(|file| file.to_string_lossy().contains(name)).expect("a scan");
        prepare(&MeshSource::of_file(name, &path)).expect("a sound scan").into()
    }

    /// A closed box about the origin, by its half sides.
    fn block(half: [f32; 3]) -> TriMesh {
        let corner =
            |corner: usize| std::array::from_fn(|axis| if corner >> axis & 1 == 0 { -half[axis] } else { half[axis] });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        TriMesh { vertices: (0..8).map(corner).collect(), triangles }
    }

    fn on_table(surface: &Arc<ContactSurface>, mass: &MassProperties) -> TrialWorker {
        let gripper = HandModel::open(&Path::new(ROOT).join("scenes/parallel_gripper.xml")).expect("the gripper");
        TrialWorker::new(&TrialSim::on_table(&gripper, surface, mass).expect("a simulation"))
    }

    impl TrialWorker {
        /// Puts the object on its table, a metre below the hand, with gravity along a direction of the table's frame; returns the
        /// table, expressed in the hand's base frame.
        fn stand(&mut self, conditions: &TrialConditions, gravity: Vector3<f64>) -> IsometryMatrix3<f64> {
            let object_from_table = self.table_of(conditions).expect("fitting").expect("a table");
            self.set_object(conditions, conditions.mass);
            let away = IsometryMatrix3::translation(0.0, 0.0, -1.0) * object_from_table.inverse();
            let opened = self.hand.hand().opened();
            let start = self.seat(&opened, &away, Some(&object_from_table), false).expect("a pose");
            let base_from_table = start.base_from_object * object_from_table;
            self.hand.put_table(&base_from_table);
            self.hand.data.model_opt_mut().gravity = (base_from_table.rotation * gravity).into();
            base_from_table
        }

        /// Steps with the hand still; the table's force on the object along its normal [N].
        fn wait(&mut self) -> f64 {
            self.hand.step(&vec![MotorCommand::Hold; self.commands.len()]).expect("stable");
            let data = &self.hand.data;
            let is_table = |contact: &MjContact| self.hand.owners_of(contact).contains(&Some(GeomOwner::Table));
            let contacts = data.contact().iter().enumerate().filter(|(_, contact)| is_table(contact));
            contacts.map(|(index, _)| data.contact_force(index)[0]).sum()
        }
    }

    /// Distance from the point below the centre of mass to the nearest side of the object's footprint, as a lower bound
    /// [m].
    fn footing(corners: &[Point3<f64>], centre: &Point3<f64>, object_from_table: &IsometryMatrix3<f64>) -> f64 {
        let seen = |point: &Point3<f64>| object_from_table.inverse_transform_point(point);
        let foot = seen(centre).xy();
        let stands: Vec<_> = corners.iter().map(seen).filter(|corner| corner.z < 1e-6).collect();
        let reach = |step: u32| {
            let (sine, cosine) = libm::sincos(f64::from(step) * std::f64::consts::TAU / 360.0);
            let along = nalgebra::Vector2::new(cosine, sine);
            stands.iter().map(|corner| along.dot(&(corner.xy() - foot))).fold(f64::NEG_INFINITY, f64::max)
        };
        (0..360).map(reach).fold(f64::INFINITY, f64::min)
    }

    /// Objects in a resting pose stay on the table, and press on it with their weight; but for poses in which less than
    /// 0.35 mm keeps them from tipping over.
    #[test]
    fn objects_rest_on_the_table() {
        const KILOGRAMS: f64 = 0.3;
        for name in ["006_mustard", "025_mug", "011_banana"] {
            let object = scan(name);
            let (surface, mass) = (object.contact_surface().expect("a surface"), object.mass().expect("a solid"));
            let corners = surface.hull_corners().expect("a solid");
            let mut worker = on_table(surface, mass);
            let mut stable = 0.0;
            for pose in &object.resting().poses {
                let support = TableSupport::under(pose);
                let conditions = TrialConditions { table: Some(support), ..TrialConditions::new(KILOGRAMS) };
                worker.stand(&conditions, -Vector3::z() * GRAVITY);
                let before = worker.hand.base_from_object();
                let forces: Vec<f64> = (0..500).map(|_| worker.wait()).collect();
                let after = worker.hand.base_from_object();
                let moved = (after * mass.centre - before * mass.centre).norm();
                let (turned, force) = (angle_between(&before, &after), forces[250..].iter().sum::<f64>() / 250.0);
                let of_weight = force / (KILOGRAMS * GRAVITY);
                let footing = footing(&corners, &mass.centre, &support.object_from_table(&corners));
                println!(
                    "{name} ({:.0} %, {} corners, footing {:.2} mm): moved {:.3} mm, {:.3} degrees, presses with \
                     {of_weight:.4} of its weight, {} contacts",
                    100.0 * pose.probability,
                    corners.len(),
                    1e3 * footing,
                    1e3 * moved,
                    turned.to_degrees(),
                    worker.hand.data.contact().len(),
                );
                let stays = moved < 5e-4 && turned < 0.5_f64.to_radians();
                assert!(stays || footing < 3.5e-4, "{name}: {moved} m, {turned} rad");
                if stays {
                    assert!((of_weight - 1.0).abs() < 0.02, "{name}: {of_weight} of its weight");
                    stable += pose.probability;
                }
            }
            assert!(stable > 0.85, "{name}: {stable}");
        }
    }

    /// MuJoCo's own box on its own plane: how far it has slid along x after a number of steps [m].
    fn native_slide(half: f64, friction: f64, gravity: Vector3<f64>, steps: u32) -> f64 {
        ffi::prepare_library();
        let mut spec = MjSpec::new();
        let plane = spec.world_body_mut().add_geom();
        plane.set_type(MjtGeomBase::mjGEOM_PLANE);
        *plane.size_mut() = [0.0, 0.0, 1.0];
        *plane.friction_mut() = [friction, 0.005, 1e-4];
        plane.set_priority(2);
        let body = spec.world_body_mut().add_body();
        *body.pos_mut() = [0.0, 0.0, half];
        body.add_free_joint();
        let geom = body.add_geom();
        geom.set_type(MjtGeomBase::mjGEOM_BOX);
        *geom.size_mut() = [half; 3];
        geom.set_mass(0.3);
        let mut model = spec.compile().expect("a model");
        set_option(model.opt_mut());
        model.opt_mut().gravity = gravity.into();
        model.geom_solref_mut().fill(CONTACT_SOLREF);
        model.geom_solimp_mut().fill(CONTACT_SOLIMP);
        let mut data: MjData<Box<MjModel>> = MjData::new(Box::new(model));
        for _ in 0..steps {
            data.step();
        }
        data.qpos()[0]
    }

    /// A cube on a tilted table slides where the tilt exceeds friction, by g (sin - mu cos) t^2 / 2, as MuJoCo's own
    /// box does on its own plane; the hand's friction is ignored.
    #[test]
    fn a_cube_slides_where_friction_ends() {
        const FRICTION: f64 = 0.4;
        let half = 0.03_f32;
        let surface = Arc::new(ContactSurface::new(&block([half; 3]), InsideTest::Crossings).expect("a surface"));
        let mass = MassProperties::of_solid(&surface.solid()).expect("a solid");
        let mut worker = on_table(&surface, &mass);
        let table = Some(TableSupport { up: Vector3::z_axis(), friction: FRICTION });
        for of_limit in [0.5, 0.9, 0.97, 1.03, 1.1, 1.2] {
            let angle = libm::atan(of_limit * FRICTION);
            let (sine, cosine) = libm::sincos(angle);
            let gravity = Vector3::new(sine, 0.0, -cosine) * GRAVITY;
            let way = |acceleration: f64| 0.5 * acceleration * 0.6 * 0.6;
            let slide = way(GRAVITY * (sine - FRICTION * cosine).max(0.0));
            let native = native_slide(f64::from(half), FRICTION, gravity, 300);
            for hand_friction in [0.1, 2.0] {
                let conditions = TrialConditions { friction: hand_friction, table, ..TrialConditions::new(0.3) };
                let base_from_table = worker.stand(&conditions, gravity);
                let before = worker.centre();
                let force = (0..300).map(|_| worker.wait()).sum::<f64>() / 300.0;
                let moved = base_from_table.inverse_transform_vector(&(worker.centre() - before));
                println!(
                    "tan {of_limit} of {FRICTION}: {:.2} mm aside, {:.3} down; {:.2} in closed form, {:.2} by MuJoCo's \
                     box; {:.4} of its weight",
                    1e3 * moved.x,
                    -1e3 * moved.z,
                    1e3 * slide,
                    1e3 * native,
                    force / (0.3 * GRAVITY * cosine),
                );
                // To a hundredth of the distance that friction takes.
                let of_friction = 0.01 * way(GRAVITY * FRICTION * cosine);
                let off = if slide > 0.0 { of_friction } else { 1e-4 };
                assert!((moved.x - slide).abs() < off, "{of_limit}: {moved:?}, {slide}");
                assert!((moved.x - native).abs() < 1e-5 + 0.001 * native, "{of_limit}: {moved:?}, {native}");
                // A box that slides fast hops.
                assert!((force / (0.3 * GRAVITY * cosine) - 1.0).abs() < 0.03, "{of_limit}: {force} N");
            }
        }
        // A table without a side up refuses to be one.
        let table = Some(TableSupport { up: Unit::new_unchecked(Vector3::z() * 2.0), friction: FRICTION });
        let conditions = TrialConditions { table, ..TrialConditions::new(0.3) };
        assert!(worker.run(&[0.03], &IsometryMatrix3::identity(), &conditions).is_err());
    }
}
