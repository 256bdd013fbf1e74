//! Commands to motors, and the effort with which they obey.

/// Command to a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorCommand {
    /// Stay where it is.
    Hold,
    /// To the posture of the closed hand; with an open clutch, on to the limit of the joint that it moves. A joint that does
    /// not close the hand stays.
    Close,
    /// To the posture of the opened hand.
    Open,
    /// To an angle, brought within the joint's range [rad or m].
    To(f64),
}

/// Law by which motors press.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotorLaw {
    /// A position servo behind gears: a motor stops at its torque, and its gears then hold the reached angle.
    #[default]
    Position,
    /// A torque: a motor whose joints close the hand presses with its torque all the time, no faster than its speed, and
    /// gives way to a larger load at once. A follower with a clutch presses on its own, with the torque of the clutch.
    Torque,
}

/// Effort of the motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Share of their speed, above 0 up to 1.
    pub speed: f64,
    /// Share of the torque at which they stop, above 0 up to 1.
    pub torque: f64,
    /// Whether the load that stops a joint opens its clutch.
    pub clutches: bool,
    /// Force of one contact at which its fingers give way [N]; infinite if they never do.
    pub max_force: f64,
}

impl Effort {
    /// Effort of a hand that closes to hold something.
    pub const GRASP: Self = Self { speed: 1.0, torque: 1.0, clutches: true, max_force: f64::INFINITY };
    /// Effort of a finger that feels for something: it stops where it touches first.
    pub const FEEL: Self = Self { speed: 0.35, torque: 0.1, clutches: false, max_force: f64::INFINITY };

    /// The effort of fingers that give way to a contact of more than a force [N].
    pub fn giving_way_at(self, max_force: f64) -> Self {
        Self { max_force, ..self }
    }
}
