//! Record of physical trials among neighbours.

use nalgebra::Vector3;
use prost::Message;

use super::{AwakeBodies, PickCandidates, PickPhase, PickVerdict};
use crate::{
    PressedContact,
    codec::{
        RecordError,
        fields::{broken, lengthy, named, pose, ranged},
        proto, sample_from_proto, wire,
    },
};
use kernel::{
    geom::{HandBase, Object, Pose},
    ids::SampleId,
};

const MESSAGE: &str = "PickTrials";

/// Trials of some of the free candidates of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct PickTrials {
    /// Which sample.
    pub sample: SampleId,
    /// Names of the hand's links; the base is the first.
    pub links: Vec<String>,
    /// Mass of the body [kg].
    pub mass: f64,
    /// Friction of the body against the hand.
    pub friction: f64,
    /// Torque about a contact's normal is at most friction times this times the force [m].
    pub torsion: f64,
    /// Rolling friction among bodies [m].
    pub rolling: f64,
    /// Choice of the bodies that may move.
    pub awake: AwakeBodies,
    /// Protocol of the trials.
    pub protocol: PickProtocol,
    /// The trials, by candidate.
    pub trials: Vec<PickTrial>,
}

/// Protocol of trials among neighbours. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickProtocol {
    /// Distance along its approach at which the hand starts [m], and the time of the approach [s].
    pub approach: [f64; 2],
    /// Deepest overlap at the start [m].
    pub start_depth: f64,
    /// Longest closing [s].
    pub closing_time: f64,
    /// Height of the lift [m] and its time [s].
    pub lift: [f64; 2],
    /// Time for which the hand holds the body after the lift [s].
    pub hold_time: f64,
    /// Smallest height gain of the centre of mass of a held body [m].
    pub least_raised: f64,
    /// A body that moves farther in the hand [m] or rotates more [rad] is lost.
    pub lost: [f64; 2],
    /// A neighbour that is this much higher at the end was carried along [m].
    pub carried_height: f64,
}

/// The trial of one candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct PickTrial {
    /// Index in the candidates of the sample.
    pub candidate: u32,
    /// Verdict on the trial.
    pub verdict: PickVerdict,
    /// Time of the decision since the trial began [s].
    pub time: f64,
    /// Steps of 2 ms that were simulated.
    pub steps: u32,
    /// Height gain of the body's centre of mass at the end [m].
    pub raised: f64,
    /// Deepest overlap of hand and body after the hand closed [m].
    pub penetration: f64,
    /// The hand's base when it had closed; `None` if it did not close.
    pub object_from_base: Option<Pose<Object, HandBase>>,
    /// Touches on the body then, in the frame of the hand's base.
    pub contacts: Vec<PressedContact>,
    /// Things that the hand pressed on, other than the body, in the order of the first touch.
    pub touched: Vec<PressedThing>,
    /// The neighbours that could move, by their numbers.
    pub awake: Vec<AwakeNeighbour>,
}

/// Something that the hand pressed on, other than the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedThing {
    /// Number of the body, from 1; 0 is the container, or the plane.
    pub thing: u32,
    /// Phase of the trial in which it was first touched.
    pub phase: PickPhase,
    /// Time of the first touch since the trial began [s].
    pub time: f64,
    /// The largest normal force of one contact [N].
    pub force: f64,
}

/// Motion of a neighbour that could move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AwakeNeighbour {
    /// Number of the body, from 1.
    pub body: u32,
    /// Largest displacement of its centre of mass [m].
    pub moved: f64,
    /// Height gain of its centre of mass at the end [m].
    pub lifted: f64,
}

impl PickTrial {
    /// A neighbour with a larger displacement was moved [m].
    pub const MOVED: f64 = 0.01;

    /// Whether a neighbour was moved.
    pub fn moves_neighbours(&self) -> bool {
        self.awake.iter().any(|neighbour| neighbour.moved > Self::MOVED)
    }

    /// The neighbours that were lifted with the body, by at least a height [m].
    pub fn carried(&self, height: f64) -> impl Iterator<Item = u32> + '_ {
        self.awake.iter().filter(move |neighbour| neighbour.lifted >= height).map(|neighbour| neighbour.body)
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let Self { contacts, touched, awake, .. } = self;
        wire::uint32(out, 1, self.candidate);
        wire::uint32(out, 2, self.verdict as u32);
        wire::double(out, 3, self.time);
        wire::uint32(out, 4, self.steps);
        wire::double(out, 5, self.raised);
        wire::double(out, 6, self.penetration);
        wire::doubles_of(out, 7, self.object_from_base.iter().flat_map(Pose::to_rows));
        wire::uint32s(out, 8, contacts.iter().map(|contact| contact.link));
        wire::doubles_of(out, 9, contacts.iter().flat_map(|contact| contact.point));
        wire::doubles_of(out, 10, contacts.iter().flat_map(|contact| contact.normal));
        wire::doubles_of(out, 11, contacts.iter().map(|contact| contact.distance));
        wire::doubles_of(out, 12, contacts.iter().map(|contact| contact.force));
        wire::uint32s(out, 13, touched.iter().map(|thing| thing.thing));
        wire::uint32s(out, 14, touched.iter().map(|thing| thing.phase as u32));
        wire::doubles_of(out, 15, touched.iter().map(|thing| thing.time));
        wire::doubles_of(out, 16, touched.iter().map(|thing| thing.force));
        wire::uint32s(out, 17, awake.iter().map(|neighbour| neighbour.body));
        wire::doubles_of(out, 18, awake.iter().map(|neighbour| neighbour.moved));
        wire::doubles_of(out, 19, awake.iter().map(|neighbour| neighbour.lifted));
    }

    fn of(raw: &proto::PickTrial, links: usize) -> Result<Self, RecordError> {
        let number = raw.verdict as usize;
        let known = "0 to 10";
        ranged(MESSAGE, "trials.verdict", f64::from(raw.verdict), number < PickVerdict::ALL.len(), known)?;
        not_below_zero("trials.time", &[raw.time])?;
        not_below_zero("trials.penetration", &[raw.penetration])?;
        finite("trials.raised", &[raw.raised])?;
        let object_from_base = match raw.object_from_base.is_empty() {
            true => None,
            false => Some(pose(MESSAGE, "trials.object_from_base", &raw.object_from_base)?),
        };
        let verdict = PickVerdict::ALL[number];
        let came = f64::from(u8::from(object_from_base.is_some()));
        let has_closed = object_from_base.is_some() || !verdict.is_held();
        ranged(MESSAGE, "trials.object_from_base", came, has_closed, "a pose where the grasp held")?;
        Ok(Self {
            candidate: raw.candidate,
            verdict,
            time: raw.time,
            steps: raw.steps,
            raised: raw.raised,
            penetration: raw.penetration,
            object_from_base,
            contacts: contacts(raw, links)?,
            touched: touched(raw)?,
            awake: awake(raw)?,
        })
    }
}

impl PickProtocol {
    fn values(&self) -> [f64; 11] {
        let &Self {
            approach: [stand_off, approach_time],
            start_depth,
            closing_time,
            lift: [lift, lift_time],
            hold_time,
            least_raised,
            lost: [distance, angle],
            carried_height,
        } = self;
        [
            stand_off,
            approach_time,
            start_depth,
            closing_time,
            lift,
            lift_time,
            hold_time,
            least_raised,
            distance,
            angle,
            carried_height,
        ]
    }

    fn of(raw: &proto::PickTrials) -> Result<Self, RecordError> {
        let protocol = Self {
            approach: [raw.stand_off, raw.approach_time],
            start_depth: raw.start_depth,
            closing_time: raw.closing_time,
            lift: [raw.lift, raw.lift_time],
            hold_time: raw.hold_time,
            least_raised: raw.least_raised,
            lost: [raw.lost_distance, raw.lost_angle],
            carried_height: raw.carried_height,
        };
        not_below_zero("protocol", &protocol.values())?;
        Ok(protocol)
    }
}

impl PickTrials {
    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        self.links.iter().for_each(|name| wire::element(out, 2, name.as_bytes()));
        wire::double(out, 3, self.mass);
        wire::double(out, 4, self.friction);
        wire::double(out, 5, self.torsion);
        wire::double(out, 6, self.rolling);
        wire::bytes(out, 7, self.awake.name().as_bytes());
        (8..).zip(self.protocol.values()).for_each(|(field, value)| wire::double(out, field, value));
        let mut message = Vec::new();
        for trial in &self.trials {
            message.clear();
            trial.encode(&mut message);
            wire::element(out, 19, &message);
        }
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When lengths do not fit each other, a number is out of range or not finite, or trials are out of order.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PickTrials::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.clone())?;
        ranged(MESSAGE, "links", raw.links.len() as f64, !raw.links.is_empty(), "at least one, the base")?;
        not_below_zero("mass", &[raw.mass, raw.friction, raw.torsion, raw.rolling])?;
        let names = AwakeBodies::ALL.map(AwakeBodies::name);
        named(MESSAGE, "awake", &raw.awake, &names)?;
        let mut trials: Vec<PickTrial> = Vec::with_capacity(raw.trials.len());
        for trial in &raw.trials {
            let trial = PickTrial::of(trial, raw.links.len())?;
            let is_next = trials.last().is_none_or(|before| before.candidate < trial.candidate);
            ranged(MESSAGE, "trials.candidate", f64::from(trial.candidate), is_next, "ascending")?;
            trials.push(trial);
        }
        Ok(Self {
            sample,
            mass: raw.mass,
            friction: raw.friction,
            torsion: raw.torsion,
            rolling: raw.rolling,
            awake: AwakeBodies::ALL[names.iter().position(|name| *name == raw.awake).unwrap_or_default()],
            protocol: PickProtocol::of(&raw)?,
            links: raw.links,
            trials,
        })
    }

    /// Compares the record with the candidates of its sample.
    ///
    /// # Errors
    /// When a trial is not of a free candidate, or names the grasped body or a body that is not in the scene.
    pub fn check_beside(&self, candidates: &PickCandidates) -> Result<(), RecordError> {
        let (own, bodies) = (candidates.body(), candidates.bodies.len() as u32);
        for trial in &self.trials {
            let of = candidates.candidates.get(trial.candidate as usize);
            let is_free = of.is_some_and(|candidate| candidate.is_free());
            ranged(MESSAGE, "trials.candidate", f64::from(trial.candidate), is_free, "a free candidate")?;
            let touched = trial.touched.iter().map(|thing| ("trials.touched", thing.thing));
            let awake = trial.awake.iter().map(|neighbour| ("trials.awake", neighbour.body));
            for (field, number) in touched.chain(awake) {
                let fits = number <= bodies && number != own;
                ranged(MESSAGE, field, f64::from(number), fits, "another body of the scene")?;
            }
        }
        Ok(())
    }
}

fn contacts(raw: &proto::PickTrial, links: usize) -> Result<Vec<PressedContact>, RecordError> {
    let count = raw.links.len();
    for (field, expected, values) in [
        ("trials.points", 3 * count, &raw.points),
        ("trials.normals", 3 * count, &raw.normals),
        ("trials.distances", count, &raw.distances),
        ("trials.forces", count, &raw.forces),
    ] {
        lengthy(MESSAGE, field, expected, values.len())?;
        finite(field, values)?;
    }
    let triple = |values: &[f64], index: usize| [values[3 * index], values[3 * index + 1], values[3 * index + 2]];
    let contact = |(index, link): (usize, &u32)| {
        ranged(MESSAGE, "trials.links", f64::from(*link), (*link as usize) < links, "an index into links")?;
        let normal = triple(&raw.normals, index);
        let length = Vector3::from(normal).norm();
        ranged(MESSAGE, "trials.normals", length, (length - 1.0).abs() < 1e-9, "of unit length")?;
        Ok(PressedContact {
            link: *link,
            point: triple(&raw.points, index),
            normal,
            distance: raw.distances[index],
            force: raw.forces[index],
        })
    };
    raw.links.iter().enumerate().map(contact).collect()
}

fn touched(raw: &proto::PickTrial) -> Result<Vec<PressedThing>, RecordError> {
    let count = raw.touched.len();
    lengthy(MESSAGE, "trials.touched_phases", count, raw.touched_phases.len())?;
    lengthy(MESSAGE, "trials.touched_times", count, raw.touched_times.len())?;
    lengthy(MESSAGE, "trials.touched_forces", count, raw.touched_forces.len())?;
    not_below_zero("trials.touched_times", &raw.touched_times)?;
    not_below_zero("trials.touched_forces", &raw.touched_forces)?;
    let thing = |index: usize| {
        let phase = raw.touched_phases[index];
        let known = PickPhase::ALL.get(phase as usize).copied();
        ranged(MESSAGE, "trials.touched_phases", f64::from(phase), known.is_some(), "0 to 3")?;
        let is_first = !raw.touched[..index].contains(&raw.touched[index]);
        ranged(MESSAGE, "trials.touched", f64::from(raw.touched[index]), is_first, "each thing once")?;
        Ok(PressedThing {
            thing: raw.touched[index],
            phase: known.unwrap_or(PickPhase::Approach),
            time: raw.touched_times[index],
            force: raw.touched_forces[index],
        })
    };
    (0..count).map(thing).collect()
}

fn awake(raw: &proto::PickTrial) -> Result<Vec<AwakeNeighbour>, RecordError> {
    let count = raw.awake.len();
    lengthy(MESSAGE, "trials.moved", count, raw.moved.len())?;
    lengthy(MESSAGE, "trials.lifted", count, raw.lifted.len())?;
    not_below_zero("trials.moved", &raw.moved)?;
    finite("trials.lifted", &raw.lifted)?;
    let mut before = 0;
    let neighbour = |index: usize| {
        let body = raw.awake[index];
        ranged(MESSAGE, "trials.awake", f64::from(body), body > before, "bodies from 1, ascending")?;
        before = body;
        Ok(AwakeNeighbour { body, moved: raw.moved[index], lifted: raw.lifted[index] })
    };
    (0..count).map(neighbour).collect()
}

fn finite(field: &'static str, values: &[f64]) -> Result<(), RecordError> {
    let wild = values.iter().find(|value| !value.is_finite());
    ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "finite")
}

fn not_below_zero(field: &'static str, values: &[f64]) -> Result<(), RecordError> {
    let wild = values.iter().find(|value| !(**value >= 0.0 && value.is_finite()));
    ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "0 or positive, and finite")
}
