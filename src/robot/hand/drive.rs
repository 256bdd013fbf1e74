//! Motors: from a motor's angle to the joints that it moves, before and after its clutch opens.
//!
//! Units: a driven joint's own, radians or metres. A motor's angle is counted so that it is the driven joint's value while
//! the clutch is engaged.

/// A joint that moves with a driven one.
#[derive(Clone, Debug, PartialEq)]
pub struct Follower {
    /// Index in the hand's tree of joints.
    pub joint: usize,
    /// Travel per unit of the driven joint. Below 0 for one that rotates in the opposite direction about its axis.
    pub ratio: f64,
    /// Value where the driven joint is at 0.
    pub offset: f64,
    /// Range of the joint.
    pub limits: [f64; 2],
}

/// A clutch between a motor and its driven joint: it opens when the joint is stopped while the hand closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakaway {
    /// The follower that moves on.
    pub follower: usize,
    /// Travel per unit of the motor from then on.
    pub ratio: f64,
    /// Torque or force that stops it, and the motor with it [N m or N].
    pub torque: f64,
    /// Torque or force at which it gives way once it is stopped [N m or N]; at least `torque`.
    pub holding_torque: f64,
}

/// A joint with a motor, and what follows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// Name in the table.
    pub name: String,
    /// Index in the hand's tree of joints.
    pub joint: usize,
    /// Range of the joint.
    pub limits: [f64; 2],
    /// The joints that move with it.
    pub followers: Vec<Follower>,
    /// Value in the opened hand.
    pub opened: f64,
    /// Value in the closed hand; `None` for a joint that shapes the hand but does not close it.
    pub closed: Option<f64>,
    /// Speed at which the motor moves it [rad/s or m/s].
    pub speed: f64,
    /// Torque or force that stops it [N m or N]: opens the clutch where it has one, else stops the motor.
    pub torque: f64,
    /// Torque or force at which it gives way once it is stopped [N m or N], and what follows it but for a clutch; at least
    /// `torque`.
    pub holding_torque: f64,
    /// Clutch, where there is one.
    pub breakaway: Option<Breakaway>,
}

/// Position of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Angle of the motor.
    pub angle: f64,
    /// Where it left its driven joint, when the clutch is open.
    pub released: Option<f64>,
}

impl Motor {
    /// A motor with its clutch shut.
    pub fn engaged(angle: f64) -> Self {
        Self { angle, released: None }
    }
}

impl Driven {
    /// Sign of the closing direction: 1, -1, or 0 for a joint that does not close the hand.
    pub fn closing_sign(&self) -> f64 {
        match self.closed {
            Some(closed) if closed != self.opened => (closed - self.opened).signum(),
            _ => 0.0,
        }
    }

    /// The driven joint's value: the motor's angle, or where the open clutch left it.
    pub fn value(&self, motor: Motor) -> f64 {
        motor.released.unwrap_or(motor.angle)
    }

    /// A follower's value.
    ///
    /// While the clutch is engaged: `offset + ratio * motor`. After it opened at `a`, the follower that moves on is at
    /// `offset + ratio * a + after * (motor - a)`. A Barrett finger has ratio 1/3 and after 4/3, so that its
    /// fingertip's angle to the palm is 4/3 of the motor's before and after.
    ///
    /// # Panics
    /// When there is no such follower.
    pub fn follower_value(&self, follower: usize, motor: Motor) -> f64 {
        let Follower { ratio, offset, .. } = self.followers[follower];
        let coupled = offset + ratio * self.value(motor);
        match (self.breakaway, motor.released) {
            (Some(breakaway), Some(left)) if breakaway.follower == follower => {
                coupled + breakaway.ratio * (motor.angle - left)
            }
            _ => coupled,
        }
    }

    /// The motor's angle at which the hand is closed: the joint at its closed value, or the released follower at its
    /// limit; for a joint that does not close the hand, the motor's current angle.
    pub fn closed_angle(&self, motor: Motor) -> f64 {
        match (self.closed, self.breakaway, motor.released) {
            (None, ..) => motor.angle,
            (Some(_), Some(breakaway), Some(left)) => {
                let Follower { ratio, offset, limits: [low, high], .. } = self.followers[breakaway.follower];
                let stop = if self.closing_sign() * breakaway.ratio < 0.0 { low } else { high };
                left + (stop - (offset + ratio * left)) / breakaway.ratio
            }
            (Some(closed), ..) => closed,
        }
    }

    /// The motor driven to an angle. An open clutch shuts when the motor comes back to where it left the joint.
    #[must_use]
    pub fn driven_to(&self, motor: Motor, angle: f64) -> Motor {
        let released = motor.released.filter(|left| self.closing_sign() * (angle - left) > 0.0);
        Motor { angle, released }
    }

    /// The clutch opened because the driven joint is stopped where the motor has it. Without a clutch, or with an open one,
    /// nothing changes.
    #[must_use]
    pub fn stopped(&self, motor: Motor) -> Motor {
        match self.breakaway {
            Some(_) if motor.released.is_none() => Motor { released: Some(motor.angle), ..motor },
            _ => motor,
        }
    }

    /// The driven joint's range, narrowed to where every follower is within its own.
    pub fn range(&self) -> [f64; 2] {
        self.followers.iter().filter(|follower| follower.ratio != 0.0).fold(self.limits, |[low, high], follower| {
            let [a, b] = follower.limits.map(|limit| (limit - follower.offset) / follower.ratio);
            [low.max(a.min(b)), high.min(a.max(b))]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finger() -> Driven {
        let degrees = f64::to_radians;
        Driven {
            name: "finger".into(),
            joint: 0,
            limits: [0.0, degrees(140.0)],
            followers: vec![Follower { joint: 1, ratio: 1.0 / 3.0, offset: 0.0, limits: [0.0, degrees(48.0)] }],
            opened: 0.0,
            closed: Some(degrees(140.0)),
            speed: 2.0,
            torque: 1.0,
            holding_torque: 1.25,
            breakaway: Some(Breakaway { follower: 0, ratio: 4.0 / 3.0, torque: 0.5, holding_torque: 0.625 }),
        }
    }

    /// libbarrett's numbers: the driven joint's gear is 125:1, the fingertip's 375:1; once the clutch is open the
    /// fingertip's angle is the motor's through both, less the joint that stays.
    #[test]
    fn a_barrett_finger_follows_its_maker() {
        let finger = finger();
        let (gear, tip_gear) = (125.0, 375.0);
        for left in [0.0, 0.4, 1.1] {
            for past in [0.0, 0.1, 0.3] {
                let motor_angle = gear * (left + past);
                let motor = Motor { angle: motor_angle / gear, released: Some(left) };
                let theirs = motor_angle * (1.0 / gear + 1.0 / tip_gear) - left;
                assert_eq!(finger.value(motor), left);
                assert!((finger.follower_value(0, motor) - theirs).abs() < 1e-15);
                // The fingertip's angle to the palm continues without a jump.
                let as_if = Motor::engaged(motor.angle);
                let to_palm = finger.value(as_if) + finger.follower_value(0, as_if);
                assert!((left + theirs - to_palm).abs() < 1e-15);
            }
        }
        let engaged = Motor::engaged(0.9);
        assert_eq!((finger.value(engaged), finger.follower_value(0, engaged)), (0.9, 0.3));
    }

    #[test]
    fn the_clutch_shuts_where_it_opened() {
        let finger = finger();
        let stopped = finger.stopped(Motor::engaged(0.6));
        assert_eq!(stopped, Motor { angle: 0.6, released: Some(0.6) });
        let on = finger.driven_to(stopped, 0.8);
        assert_eq!((on.released, finger.value(on)), (Some(0.6), 0.6));
        // A second stop does not move the position.
        assert_eq!(finger.stopped(on), on);
        let back = finger.driven_to(on, 0.6);
        assert_eq!((back.released, finger.follower_value(0, back)), (None, 0.6 / 3.0));
        assert_eq!(finger.driven_to(back, 0.2), Motor::engaged(0.2));
    }

    /// The fingertip ends at its stop, whichever way the joint left it.
    #[test]
    fn closed_is_closed_or_the_followers_stop() {
        let finger = finger();
        assert_eq!(finger.closed_angle(Motor::engaged(0.3)), 140.0_f64.to_radians());
        for left in [0.0, 0.5, 2.0] {
            let end = finger.closed_angle(Motor { angle: left, released: Some(left) });
            let tip = finger.follower_value(0, Motor { angle: end, released: Some(left) });
            assert!((tip - 48.0_f64.to_radians()).abs() < 1e-15, "{left}: {tip}");
        }
        let spread = Driven { closed: None, breakaway: None, ..finger.clone() };
        assert_eq!((spread.closing_sign(), spread.closed_angle(Motor::engaged(0.4))), (0.0, 0.4));
        assert_eq!(spread.stopped(Motor::engaged(0.4)), Motor::engaged(0.4));
        // A third of 140 degrees is within 48; of 150 it is not.
        assert_eq!(finger.range(), [0.0, 140.0_f64.to_radians()]);
        let wide = Driven { limits: [0.0, 150.0_f64.to_radians()], ..finger };
        assert!((wide.range()[1] - 144.0_f64.to_radians()).abs() < 1e-15);
    }

    /// A hand whose joints close towards lower values, with a follower that rotates in the opposite direction.
    #[test]
    fn closing_downwards() {
        let mut finger = finger();
        (finger.opened, finger.closed) = (2.0, Some(0.0));
        finger.followers[0] = Follower { joint: 1, ratio: -0.5, offset: 1.0, limits: [-1.0, 1.5] };
        finger.breakaway = Some(Breakaway { follower: 0, ratio: -1.5, torque: 1.0, holding_torque: 1.25 });
        let stopped = finger.stopped(Motor::engaged(1.0));
        assert_eq!(finger.follower_value(0, stopped), 0.5);
        let end = finger.closed_angle(stopped);
        assert!((finger.follower_value(0, finger.driven_to(stopped, end)) - 1.5).abs() < 1e-15 && end < 1.0);
        assert_eq!(finger.driven_to(stopped, 1.1).released, None);
    }
}
