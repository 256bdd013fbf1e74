//! Conditions of a trial: friction, mass, errors of the pose, a table; and its protocol.

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use crate::{
    error::HandError,
    hand::effort::{Effort, MotorLaw},
    physics::Numerics,
};
use kernel::{geom::RestingPose, seed::Stream};

/// Density for objects without a known mass [kg/m^3], and the smallest and the largest resulting mass [kg].
const DENSITY: f64 = 400.0;
const MASSES: [f64; 2] = [0.02, 2.0];

/// The mass of a solid of which only the volume [m^3] is known [kg]: 400 kg/m^3, limited to 0.02 to 2 kg.
pub fn mass_of_volume(volume: f64) -> f64 {
    (DENSITY * volume).clamp(MASSES[0], MASSES[1])
}

/// Gravity on the object once it is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gravity {
    /// Gravity along -z of the object in its pose at the start; the hand lifts it and shakes it.
    Lifted,
    /// No lift and no shake: gravity along -z, z, -y, y, -x and x of the object in its pose at the start, one after
    /// another without a pause.
    Six,
}

/// Table on which the object rests at the start of a trial, at its lowest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableSupport {
    /// Direction out of the table, in `Object`.
    pub up: Unit<Vector3<f64>>,
    /// Coefficient of sliding friction of all contacts of the table, exactly: that of object and hand is ignored.
    pub friction: f64,
}

impl TableSupport {
    /// Default friction of a table.
    pub const FRICTION: f64 = 0.5;

    /// The table of a resting pose, with a friction of [`TableSupport::FRICTION`].
    pub fn under(pose: &RestingPose) -> Self {
        Self { up: Unit::new_unchecked(pose.up()), friction: Self::FRICTION }
    }

    /// The table in `Object`: z up, its surface at the lowest of the corners of the object's convex hull.
    pub(super) fn object_from_table(&self, corners: &[Point3<f64>]) -> IsometryMatrix3<f64> {
        let lowest = corners.iter().map(|corner| self.up.dot(&corner.coords)).fold(f64::INFINITY, f64::min);
        let half_turn = || Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let upright = Rotation3::rotation_between(&Vector3::z(), &self.up).unwrap_or_else(half_turn);
        IsometryMatrix3::from_parts((self.up.into_inner() * lowest).into(), upright)
    }
}

/// Conditions of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialConditions {
    /// Coefficient of sliding friction of all contacts of the object, exactly: the hand's own is ignored.
    pub friction: f64,
    /// Torsional friction of a contact about its normal [m]: resists with a torque of at most friction * torsion *
    /// normal force, as a patch of one and a half times that radius under even pressure. 0 for a hard point.
    pub torsion: f64,
    /// The object's mass [kg].
    pub mass: f64,
    /// Offset of the object from its position in the grasp, along the axes of the hand's base [m].
    pub shift: Vector3<f64>,
    /// Rotation of the object there about its centre of mass: an axis of the hand's base times an angle [rad].
    pub turn: Vector3<f64>,
    /// Distance by which the hand is nearer to the object than in the grasp, along its approach [m].
    pub advance: f64,
    /// Whether a hand that would start too deep in the object opens its fingers until they are clear, and draws back by
    /// up to 5 mm if its base is too deep; otherwise such a trial is refused.
    pub backs_off: bool,
    /// Gravity on the held object.
    pub gravity: Gravity,
    /// Whether nothing supports the object while the hand closes, for every protocol.
    pub is_free: bool,
    /// Whether the faces of the hand's boxes and cylinders reach to their edges, which else are
    /// [rounded](kernel::contact::EDGE_RADIUS): MuJoCo's own boxes are sharp.
    pub has_sharp_edges: bool,
    /// Settings of the simulation.
    pub numerics: Numerics,
    /// Table on which the object rests while the hand closes, in a simulation that
    /// [has one](super::TrialSim::on_table). Gravity pulls towards it from the beginning, the object is free in every
    /// protocol, and the hand lifts it off; errors of the pose move object and table together, against the hand.
    /// Without a table the object floats until the hand has closed on it.
    pub table: Option<TableSupport>,
    /// Whether the outcome has forces and drift over [time](super::Series).
    pub has_series: bool,
    /// Law of the motors.
    pub motors: MotorLaw,
    /// Whether the outcome has [margins](super::Margins). A lost object is then followed to
    /// [a distance](super::FOLLOWED), and a hand that comes deep into the object is not unstable: its depth is a number.
    pub has_margins: bool,
}

impl TrialConditions {
    /// Resistance of a contact to turning [m]: a fingertip's patch of 3 mm radius.
    pub const TORSION: f64 = 0.002;

    /// Friction 0.5, a soft finger, nothing off, no table.
    pub fn new(mass: f64) -> Self {
        Self {
            friction: 0.5,
            torsion: Self::TORSION,
            mass,
            shift: Vector3::zeros(),
            turn: Vector3::zeros(),
            advance: 0.0,
            backs_off: false,
            gravity: Gravity::Lifted,
            is_free: false,
            has_sharp_edges: false,
            numerics: Numerics::Standard,
            table: None,
            has_series: false,
            motors: MotorLaw::Position,
            has_margins: false,
        }
    }

    /// Around these, by chance; a hand that would start too deep [backs off](Self::backs_off).
    #[must_use]
    pub fn perturbed(&self, spread: &TrialSpread, draw: &mut Stream) -> Self {
        let mut factor = |deviation: f64| libm::exp(deviation * draw.normal());
        let (friction, mass) = (self.friction * factor(spread.friction), self.mass * factor(spread.mass));
        let mut around = |deviation: f64| Vector3::from_fn(|_, _| deviation * draw.normal());
        let shift = self.shift + around(spread.shift);
        let turn = self.turn + around(spread.turn);
        Self { friction, mass, shift, turn, backs_off: true, ..*self }
    }

    /// Pose of the object for a grasp's pose; `centre` is its centre of mass.
    pub(super) fn placed(&self, base_from_object: &IsometryMatrix3<f64>, centre: &Point3<f64>) -> IsometryMatrix3<f64> {
        if self.shift == Vector3::zeros() && self.turn == Vector3::zeros() {
            return *base_from_object;
        }
        let pivot = Translation3::from((base_from_object * centre).coords);
        let rotation = Rotation3::from_scaled_axis(self.turn);
        Translation3::from(self.shift) * pivot * rotation * pivot.inverse() * base_from_object
    }

    pub(super) fn check(&self) -> Result<(), HandError> {
        let wrong = |what: &str, value: f64| Err(HandError::Trial { reason: format!("{what} of {value}") });
        if !(self.friction >= 0.0 && self.friction < 1e3) {
            return wrong("a friction", self.friction);
        }
        if !(self.torsion >= 0.0 && self.torsion < 1.0) {
            return wrong("a torsion", self.torsion);
        }
        if !(self.mass > 1e-6 && self.mass < 1e6) {
            return wrong("a mass", self.mass);
        }
        let offsets = self.shift.iter().chain(&self.turn).chain([&self.advance]);
        if let Some(part) = offsets.copied().find(|part| !part.is_finite()) {
            return wrong("a shift, rotation or advance", part);
        }
        let Some(TableSupport { up, friction }) = self.table else { return Ok(()) };
        if !(0.0..1e3).contains(&friction) {
            return wrong("a table with a friction", friction);
        }
        let length = up.norm();
        if !(1.0 - 1e-6..1.0 + 1e-6).contains(&length) {
            return wrong("a table with an up direction of length", length);
        }
        match self.gravity {
            Gravity::Lifted => Ok(()),
            Gravity::Six => {
                let reason = "a table and six directions of gravity: what is lifted off a table is lifted and shaken";
                Err(HandError::Trial { reason: reason.into() })
            }
        }
    }
}

/// Spread of the conditions: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialSpread {
    /// Standard deviation of the logarithm of friction.
    pub friction: f64,
    /// Standard deviation of the logarithm of the mass.
    pub mass: f64,
    /// Standard deviation of the object's position, along each axis [m].
    pub shift: f64,
    /// Standard deviation of the object's orientation, about each axis [rad].
    pub turn: f64,
}

impl TrialSpread {
    /// 20 % of friction, 10 % of the mass, 1 mm, 1 degree.
    pub const STANDARD: Self = Self { friction: 0.2, mass: 0.1, shift: 0.001, turn: std::f64::consts::PI / 180.0 };
}

/// Support of the object while the hand closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WhileClosing {
    /// Nothing: fingers push it about.
    Free,
    /// The object moves as in syrup: it yields to a push, and stops as soon as the push ends.
    Damped,
    /// The object stays where it is until the hand has closed.
    Still,
}

/// Protocol of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrialProtocol {
    /// Deepest start [m]; 0.98 mm at most, as deep as boxes are reported.
    pub start_depth: f64,
    /// Longest closing, without gravity unless there is a table [s]; it ends before, when the hand is at rest.
    pub closing: f64,
    /// Support of the object meanwhile, unless it rests on a table.
    pub while_closing: WhileClosing,
    /// Time for hand and object to settle after the object is released, without gravity [s]; none on a table, where it
    /// is free.
    pub settling: f64,
    /// Effort with which the hand closes, and keeps closing to the end.
    pub effort: Effort,
    /// Height of the lift [m], by minimum jerk in `lift_time`.
    pub lift: f64,
    /// See [`TrialProtocol::lift`].
    pub lift_time: f64,
    /// Amplitude of the shake to either side, along each axis of the object in its pose at the start [m].
    pub shake: f64,
    /// Frequencies of the shake along x, y and z [Hz].
    pub frequencies: [f64; 3],
    /// For how long [s]; whole periods of each begin and end without acceleration.
    pub shake_time: f64,
    /// Duration of each of six directions of gravity [s].
    pub turned_time: f64,
    /// Largest distance of the object's centre of mass from where it was in the hand when gravity came on [m].
    pub lost_distance: f64,
    /// Largest rotation of the object [rad].
    pub lost_angle: f64,
}

impl TrialProtocol {
    /// 1 mm; 1 s with all effort; 10 cm in 1 s; 20 mm at 2, 3 and 4 Hz (x, y, z) for 1 s; half a second each of six directions;
    /// 30 mm, 30 degrees.
    pub const STANDARD: Self = Self {
        start_depth: 0.001,
        closing: 1.0,
        while_closing: WhileClosing::Damped,
        settling: 0.2,
        effort: Effort::GRASP,
        lift: 0.1,
        lift_time: 1.0,
        shake: 0.02,
        frequencies: [2.0, 3.0, 4.0],
        shake_time: 1.0,
        turned_time: 0.5,
        lost_distance: 0.03,
        lost_angle: std::f64::consts::PI / 6.0,
    };

    pub(super) fn check(&self) -> Result<(), HandError> {
        let [x, y, z] = self.frequencies;
        let Effort { speed, torque, .. } = self.effort;
        let sizes =
            [self.start_depth, self.closing, self.settling, self.lift, self.lift_time, self.shake, self.shake_time]
                .into_iter()
                .chain([self.turned_time, self.lost_distance, self.lost_angle, x, y, z]);
        match sizes.chain([speed, torque]).find(|size| !(*size >= 0.0 && *size < 1e3)) {
            Some(size) => Err(HandError::Trial { reason: format!("a protocol with a number of {size}") }),
            None => Ok(()),
        }
    }

    /// Acceleration of the hand `time` after the lift began [m/s^2], upward: the second derivative of
    /// `lift (10 s^3 - 15 s^4 + 6 s^5)` (Flash and Hogan 1985).
    pub(super) fn lifting(&self, time: f64) -> Vector3<f64> {
        let s = time / self.lift_time;
        let rate = self.lift / (self.lift_time * self.lift_time);
        Vector3::z() * (rate * s * (60.0 + s * (-180.0 + s * 120.0)))
    }

    /// Height of the hand `time` after the lift began [m]: [`TrialProtocol::lifting`] is its second derivative.
    pub(super) fn lifted(&self, time: f64) -> f64 {
        let s = time / self.lift_time;
        self.lift * s * s * s * (10.0 + s * (-15.0 + s * 6.0))
    }

    /// Acceleration `time` after the shake began: the second derivative of `shake sin(2 pi f t)` along each axis.
    pub(super) fn shaking(&self, time: f64) -> Vector3<f64> {
        Vector3::from(self.frequencies.map(|frequency| {
            let turn = std::f64::consts::TAU * frequency;
            -self.shake * turn * turn * libm::sin(turn * time)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Summed up twice, the accelerations make the displacements that the protocol states.
    #[test]
    fn accelerations_make_the_ways() {
        let protocol = TrialProtocol::STANDARD;
        let (mut at, mut speed, mut fastest) = (0.0, 0.0, 0.0_f64);
        for step in 0..10_000 {
            assert!((at - protocol.lifted(f64::from(step) * 1e-4)).abs() < 1e-5, "{step}: {at}");
            speed += protocol.lifting((f64::from(step) + 0.5) * 1e-4).z * 1e-4;
            at += speed * 1e-4;
            fastest = fastest.max(speed);
        }
        assert!((at - 0.1).abs() < 1e-5 && speed.abs() < 1e-6 && (fastest - 0.1875).abs() < 1e-4, "{at} {speed}");
        let angular_speeds = protocol.frequencies.map(|frequency| std::f64::consts::TAU * frequency);
        let (mut speed, mut at) = (Vector3::from(angular_speeds) * 0.02, Vector3::zeros());
        let mut farthest = Vector3::<f64>::zeros();
        for step in 0..10_000 {
            speed += protocol.shaking((f64::from(step) + 0.5) * 1e-4) * 1e-4;
            at += speed * 1e-4;
            farthest = farthest.sup(&at.abs());
        }
        assert!(at.norm() < 1e-4 && (farthest.add_scalar(-0.02)).norm() < 2e-4, "{at} {farthest}");
    }

    #[test]
    fn draws_are_of_the_spread_that_is_asked_for() {
        let mut draw = Stream::of_job(1, b"", "trial conditions");
        let made: Vec<TrialConditions> =
            (0..4000).map(|_| TrialConditions::new(0.3).perturbed(&TrialSpread::STANDARD, &mut draw)).collect();
        let deviation = |value: &dyn Fn(&TrialConditions) -> f64| {
            (made.iter().map(|one| value(one).powi(2)).sum::<f64>() / 4000.0).sqrt()
        };
        for (found, wanted) in [
            (deviation(&|one| (one.friction / 0.5).ln()), 0.2),
            (deviation(&|one| (one.mass / 0.3).ln()), 0.1),
            (deviation(&|one| one.shift.y), 0.001),
            (deviation(&|one| one.turn.z), 1.0_f64.to_radians()),
        ] {
            assert!((found / wanted - 1.0).abs() < 0.05, "{found} {wanted}");
        }
        assert!(made.iter().all(|one| one.backs_off && one.check().is_ok()));
        // A rotation about the centre of mass leaves it in place.
        let centre = Point3::new(0.1, 0.2, -0.1);
        let pose = IsometryMatrix3::new(Vector3::new(0.3, 0.1, 0.2), Vector3::new(0.4, -1.0, 0.3));
        let moved = TrialConditions { shift: Vector3::zeros(), ..made[0] }.placed(&pose, &centre);
        assert!((moved * centre - pose * centre).norm() < 1e-15);
        assert!((moved.rotation.angle_to(&pose.rotation) - made[0].turn.norm()).abs() < 1e-9);
    }

    /// A table's z is up in the object, in any direction, and no corner is below it.
    #[test]
    fn tables_carry_the_lowest_corner() {
        let corners = [[0.1, 0.0, 0.0], [-0.1, 0.02, 0.0], [0.0, 0.0, 0.3], [0.0, -0.05, -0.04]].map(Point3::from);
        for up in [Vector3::z(), -Vector3::z(), Vector3::x(), Vector3::new(0.3, -0.5, 0.8)] {
            let support = TableSupport { up: Unit::new_normalize(up), friction: 0.5 };
            let table = support.object_from_table(&corners);
            assert!((table.rotation * Vector3::z() - *support.up).norm() < 1e-12, "{up:?}");
            let heights = corners.map(|corner| table.inverse_transform_point(&corner).z);
            assert!(heights.iter().copied().fold(f64::INFINITY, f64::min).abs() < 1e-15, "{heights:?}");
        }
    }

    #[test]
    fn masses_are_brought_within_bounds() {
        assert_eq!([1e-6, 1e-3, 1.0].map(mass_of_volume), [0.02, 0.4, 2.0]);
        let wrong = [
            TrialConditions { friction: -0.1, ..TrialConditions::new(0.1) },
            TrialConditions { turn: Vector3::repeat(f64::NAN), ..TrialConditions::new(0.1) },
            TrialConditions::new(0.0),
        ];
        assert!(wrong.iter().all(|conditions| conditions.check().is_err()));
        let on_table = |up: Vector3<f64>, friction: f64, gravity: Gravity| {
            let table = Some(TableSupport { up: Unit::new_unchecked(up), friction });
            TrialConditions { table, gravity, ..TrialConditions::new(0.1) }.check().is_ok()
        };
        assert!(on_table(Vector3::z(), 0.5, Gravity::Lifted));
        assert!(!on_table(Vector3::z() * 0.9, 0.5, Gravity::Lifted));
        assert!(!on_table(Vector3::repeat(f64::NAN), 0.5, Gravity::Lifted));
        assert!(!on_table(Vector3::z(), -0.1, Gravity::Lifted));
        assert!(!on_table(Vector3::z(), 0.5, Gravity::Six));
        assert!(TrialProtocol { lift: f64::NAN, ..TrialProtocol::STANDARD }.check().is_err());
    }
}
