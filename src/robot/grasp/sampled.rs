//! Grasps that no search was for: approaches all round an axis, as a planner of the thesis has them (7.4.1), and pads on
//! opposite sides of the object. For comparison with annealing, and where many plain grasps are wanted.

use std::{f64::consts::TAU, sync::Arc};

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::{
    best::BestList,
    closing::Closing,
    found::{Grasp, GraspRun, Stretch},
    frame::Frame,
    kind::camera_axes,
    object::ObjectSearch,
    pairs::Pair,
    rate::{Rating, Start},
    settings::{Annealing, Antipodal, Keeping, Uniform},
    solids::ALLOWED_OVERLAP,
    solids::Solid,
    state::HandSearch,
    variables::State,
};
use crate::{hand::Hand, kinematics::JointKind};
use kernel::{
    geom::{SimdLevel, rotation_towards},
    seed::Stream,
    words::STRETCHES,
};

/// Before it closes a finger is so far from where it meets the object, by its motor: [rad], of a slide [m].
const BEFORE: [f64; 2] = [0.1, 0.005];

/// One thread's sampling of one hand.
pub struct GraspSampler {
    hand: Arc<Hand>,
    closing: Closing,
    rating: Rating,
    best: BestList,
}

impl GraspSampler {
    /// With vector instructions up to a level; what is found is the same at all. Of `annealing` the energy alone counts.
    pub fn new(search: &Arc<HandSearch>, annealing: &Annealing, keeping: &Keeping, level: SimdLevel) -> Self {
        Self {
            hand: Arc::clone(&search.hand),
            closing: Closing::new(&search.hand, &search.solids),
            rating: Rating::new(search, annealing, keeping, level.usable()),
            best: BestList::new(0),
        }
    }

    /// A run all round the z axis of a frame.
    pub fn uniform(
        &mut self,
        object: &ObjectSearch,
        object_from_frame: &IsometryMatrix3<f64>,
        uniform: &Uniform,
    ) -> GraspRun {
        let mut tally = Tally::new(uniform.grasps);
        let mut grasps = Vec::new();
        for index in 0..uniform.grasps {
            let (sin, cos) = libm::sincos(TAU * f64::from(index) / f64::from(uniform.grasps));
            let sight = Vector3::new(-cos, -sin, 0.0);
            let [right, down] = camera_axes(&sight);
            let (sin, cos) = libm::sincos(uniform.rolls.of(index));
            let x = right * cos + down * sin;
            let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, sight.cross(&x), sight]));
            let frame_from_approach = IsometryMatrix3::from_parts(Translation3::identity(), rotation);
            let start = self.come(object, &(object_from_frame * frame_from_approach));
            let grasp = self.rating.started(object, start);
            tally.count(index, Some(grasp.energies.total));
            grasps.push(grasp);
        }
        tally.run(object_from_frame, grasps)
    }

    /// Comes along an approach from afar with the opened hand until it meets the object, or the approach frame is where it was
    /// to come to, and closes there but for the last part of each motor's range.
    fn come(&mut self, object: &ObjectSearch, object_from_approach: &IsometryMatrix3<f64>) -> Start {
        let hand = Arc::clone(&self.hand);
        let opened = preshape(&hand);
        let joints = hand.posture_values(&opened);
        let approach_from_base = hand.approach_pose(&hand.link_frames(&joints)).isometry().inverse();
        let direction = object_from_approach.rotation * Vector3::z();
        // From where a ball that holds the hand is outside of one that holds the object.
        let aside = (object_from_approach.translation.vector - object.middle.coords).norm();
        let far = object.radius + aside + self.reach(&joints);
        let outside = Translation3::from(direction * -far) * object_from_approach * approach_from_base;
        let come = match self.closing.advance(&object.surface, &outside, &joints, &direction, far) {
            0.0 => far,
            come => come,
        };
        let object_from_approach = Translation3::from(direction * (come - far)) * object_from_approach;
        let closed = self.closing.close(&object.surface, &(object_from_approach * approach_from_base), &opened);
        let before = hand.driven().iter().zip(&closed.motors).zip(&opened).map(|((driven, motor), opened)| {
            let slides = hand.tree().joints()[driven.joint].joint.kind == JointKind::Prismatic;
            let back = BEFORE[usize::from(slides)];
            let value = driven.value(*motor);
            if (value - opened).abs() <= back { *opened } else { value - driven.closing_sign() * back }
        });
        Start { object_from_approach, posture: before.collect(), amplitudes: Vec::new() }
    }

    /// Radius of a ball about the approach frame's origin that holds the hand [m].
    fn reach(&self, joints: &[f64]) -> f64 {
        let frames = self.hand.link_frames(joints);
        let origin = self.hand.approach_pose(&frames).isometry().translation.vector;
        let far = |solid: &Solid| {
            let centre = if solid.link == 0 { solid.centre } else { frames[solid.link - 1] * solid.centre };
            (centre.coords - origin).norm() + solid.reach
        };
        self.closing.solids.solids.iter().map(far).fold(0.0, f64::max)
    }

    /// A run over pairs of points on opposite sides of an object, drawn over all its surface: the best of the points of the
    /// pads by energy, no two alike.
    ///
    /// # Panics
    /// When the hand has no [`Hand::closing_line`].
    pub fn antipodal(&mut self, object: &ObjectSearch, antipodal: &Antipodal, stream: &mut Stream) -> GraspRun {
        let pads = Pads::new(&self.hand).expect("pairs are asked of hands that close along a line");
        self.best = BestList::new(antipodal.best as usize);
        self.best.clear(object.radius);
        let mut tally = Tally::new(antipodal.pairs);
        for index in 0..antipodal.pairs {
            let pair = Pair::draw(&object.surface, antipodal.friction, stream);
            let roll = stream.uniform(0.0, TAU);
            let start = pair.and_then(|pair| self.on_pair(object, &pads, &pair, roll));
            let energy = start.as_ref().map(|start| self.rating.energies_of(object, start).total);
            tally.count(index, energy);
            if let Some((start, energy)) = start.zip(energy) {
                let mut state = State::default();
                state[0] = start.posture[pads.index];
                self.best.offer(energy, &Frame::of(&start.object_from_approach), &state);
            }
        }
        let start = |candidate: &super::best::Candidate| Start {
            object_from_approach: candidate.object_from_approach.isometry(),
            posture: pads.posture(&self.hand, candidate.state[0]),
            amplitudes: Vec::new(),
        };
        let grasps = self.best.list().iter().map(|candidate| self.rating.started(object, start(candidate))).collect();
        tally.run(&Translation3::from(object.middle.coords).into(), grasps)
    }

    /// The gripper with its pads on both sides of a pair, a little open; `None` where it does not open so far, or would be in
    /// the object.
    fn on_pair(&mut self, object: &ObjectSearch, pads: &Pads, pair: &Pair, roll: f64) -> Option<Start> {
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

/// The opened hand, its shape as the eigengrasps begin with it.
fn preshape(hand: &Hand) -> Vec<f64> {
    let shape = hand.eigengrasps().map_or_else(|| hand.opened(), |grasps| grasps.origin.clone());
    let of = |(driven, shape): (&crate::hand::Driven, f64)| match driven.closing_sign() {
        0.0 => shape.max(driven.range()[0]).min(driven.range()[1]),
        _ => driven.opened,
    };
    hand.driven().iter().zip(shape).map(of).collect()
}

/// The two pads of a gripper.
struct Pads {
    /// Index of the motor.
    index: usize,
    /// Displacement of the first pad per unit of the motor, expressed in the base frame.
    line: Vector3<f64>,
    /// The motor's opened and closed value, and the width of the opened hand [m].
    opened: f64,
    closed: f64,
    widest: f64,
    links: [usize; 2],
}

impl Pads {
    fn new(hand: &Hand) -> Option<Self> {
        let line = hand.closing_line()?;
        let index = hand.driven().iter().position(|driven| driven.closing_sign() != 0.0)?;
        let driven = &hand.driven()[index];
        let widest = hand.width(&hand.link_frames(&hand.posture_values(&hand.opened())))?;
        let links = hand.pads()?.map(|contact| hand.contacts()[contact].link);
        Some(Self { index, line, opened: driven.opened, closed: driven.closed?, widest, links })
    }

    /// The motor's value at a width; `None` where the pads do not go.
    fn value(&self, width: f64) -> Option<f64> {
        let rotation = (self.widest - width) / (2.0 * self.line.norm());
        let max = self.closed - self.opened;
        (0.0..=max.abs()).contains(&rotation).then(|| self.opened + max.signum() * rotation)
    }

    fn posture(&self, hand: &Hand, value: f64) -> Vec<f64> {
        let mut posture = preshape(hand);
        posture[self.index] = value;
        posture
    }

    /// A frame half way between the pads, its z along the first one's direction of motion; the middle of a pad is that of its
    /// contacts.
    fn base_from_pads(&self, hand: &Hand, frames: &[IsometryMatrix3<f64>]) -> IsometryMatrix3<f64> {
        let middle = |link: usize| {
            let on_it = (0..hand.contacts().len()).filter(|contact| hand.contacts()[*contact].link == link);
            let points: Vec<_> = on_it.map(|contact| hand.contact_in_base(contact, frames).0.coords).collect();
            points.iter().sum::<Vector3<f64>>() / points.len() as f64
        };
        let [first, second] = self.links.map(middle);
        let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&self.line.normalize(), 0.0));
        IsometryMatrix3::from_parts(Translation3::from((first + second) / 2.0), rotation)
    }
}

/// Counts a run's steps as they go.
struct Tally {
    steps: u32,
    failed: u32,
    stretches: [(u32, f64); STRETCHES],
}

impl Tally {
    fn new(steps: u32) -> Self {
        Self { steps, failed: 0, stretches: [(0, 0.0); STRETCHES] }
    }

    /// Step `index` came to a state of this energy, or to none.
    fn count(&mut self, index: u32, energy: Option<f64>) {
        let stretch = &mut self.stretches[(u64::from(index) * STRETCHES as u64 / u64::from(self.steps)) as usize];
        match energy {
            Some(energy) => *stretch = (stretch.0 + 1, stretch.1 + energy),
            None => self.failed += 1,
        }
    }

    fn run(self, object_from_seed: &IsometryMatrix3<f64>, mut grasps: Vec<Grasp>) -> GraspRun {
        grasps.sort_by(|one, other| one.energies.total.total_cmp(&other.energies.total));
        let mean = |(count, sum): (u32, f64)| if count == 0 { f64::NAN } else { sum / f64::from(count) };
        GraspRun {
            object_from_seed: *object_from_seed,
            steps: self.steps,
            failed: self.failed,
            tries: u64::from(self.steps),
            potentials: u64::from(self.steps - self.failed),
            course: self.stretches.map(|stretch| Stretch { accepted: stretch.0, mean_energy: mean(stretch) }),
            grasps,
        }
    }
}

/// Frames that runs go round: z is the axis.
///
/// Upright ones stand in the middle of the object's box one above the other, spread evenly over its height, each rotated on by
/// the same part of the angle between two grasps. Else the axis has any direction, through the middle of the box.
pub fn axes(
    surface: &kernel::contact::ContactSurface,
    uniform: &Uniform,
    runs: u32,
    stream: &mut Stream,
) -> Vec<IsometryMatrix3<f64>> {
    let bounds = surface.bounds();
    let middle = bounds.centre();
    let one = |run: u32| {
        let along = (f64::from(run) + 0.5) / f64::from(runs);
        if uniform.upright {
            let height = bounds.min.z + (bounds.max.z - bounds.min.z) * along;
            let azimuth = TAU * f64::from(run) / f64::from(runs) / f64::from(uniform.grasps);
            let rotation = Rotation3::from_matrix_unchecked(about_z(azimuth));
            return IsometryMatrix3::from_parts(Translation3::new(middle.x, middle.y, height), rotation);
        }
        let z = stream.uniform(-1.0, 1.0);
        let (sin, cos) = libm::sincos(stream.uniform(0.0, TAU));
        let across = (1.0 - z * z).max(0.0).sqrt();
        let rotation = rotation_towards(&Vector3::new(across * cos, across * sin, z), stream.uniform(0.0, TAU));
        IsometryMatrix3::from_parts(Translation3::from(middle.coords), Rotation3::from_matrix_unchecked(rotation))
    };
    (0..runs).map(one).collect()
}

fn about_z(angle: f64) -> Matrix3<f64> {
    let (sin, cos) = libm::sincos(angle);
    Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0)
}
