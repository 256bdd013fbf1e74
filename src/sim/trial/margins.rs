//! Motion of the object during a trial, and the limit that it passed.

use nalgebra::{IsometryMatrix3, Point3};

use super::Phase;
use crate::{convert::angle_between, physics::STEP};

/// Distance from where it was in the hand up to which a lost object is followed [m]: twice the distance at which it is lost.
pub const FOLLOWED: f64 = 0.06;

/// Limit of the motion of the object in the hand, by the quantity that it bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// Distance from where it was.
    Distance,
    /// Rotation.
    Angle,
}

/// The moment when the object was lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// The limit that it passed first; of both at once, the distance.
    pub limit: Limit,
    /// Part of the trial.
    pub phase: Phase,
    /// Since the trial began [s].
    pub time: f64,
}

/// A largest value, and when it was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The value [m or rad].
    pub value: f64,
    /// Part of the trial.
    pub phase: Phase,
}

/// Motion of the object during a trial.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Margins {
    /// Whether a link pressed on the object while the hand closed.
    pub has_touched: bool,
    /// Displacement of the centre of mass [m], and rotation [rad], while the hand closed.
    pub closing: [f64; 2],
    /// Largest speed of the centre of mass while the hand closed, after two links had pressed on the object [m/s].
    pub pressed_speed: f64,
    /// Largest distance of the centre of mass from where it was in the hand when gravity came on [m]; `None` if it did not.
    pub farthest: Option<Peak>,
    /// Largest rotation of the object since then [rad].
    pub rotation: Option<Peak>,
    /// When the object was lost after that, if it was.
    pub loss: Option<Loss>,
    /// Whether two links have pressed on the object at once while the hand closed.
    pub(super) was_pressed: bool,
    /// The centre of mass after the last step of closing, in the hand's base frame.
    pub(super) centre: Option<Point3<f64>>,
}

impl Margins {
    /// Adds a step of closing: the links that press on the object, and its centre of mass in the hand's base frame.
    pub(super) fn press(&mut self, links: &[usize], centre: Point3<f64>) {
        if let Some(before) = self.centre.replace(centre).filter(|_| self.was_pressed) {
            self.pressed_speed = self.pressed_speed.max((centre - before).norm() / STEP);
        }
        self.has_touched |= !links.is_empty();
        self.was_pressed |= links.len() > 1;
    }

    /// Notes the motion while the hand closed, between two poses of the object in the hand's base frame; `centre` is its centre
    /// of mass in `Object`.
    pub(super) fn close(&mut self, start: &IsometryMatrix3<f64>, end: &IsometryMatrix3<f64>, centre: &Point3<f64>) {
        self.closing = [(end * centre - start * centre).norm(), angle_between(start, end)];
    }

    /// Adds a step of carrying: displacement [m] and rotation [rad] since gravity came on, and their limits.
    pub(super) fn carry(&mut self, phase: Phase, time: f64, motion: [f64; 2], limits: [f64; 2]) {
        for (peak, value) in [&mut self.farthest, &mut self.rotation].into_iter().zip(motion) {
            if peak.is_none_or(|peak| value > peak.value) {
                *peak = Some(Peak { value, phase });
            }
        }
        let passed = [Limit::Distance, Limit::Angle].into_iter().zip(motion.into_iter().zip(limits));
        let mut passed = passed.filter(|(_, (value, limit))| value > limit);
        if let Some((limit, _)) = passed.next() {
            self.loss.get_or_insert(Loss { limit, phase, time });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_counts_once_two_links_have_pressed() {
        let mut margins = Margins::default();
        let at = |x: f64| Point3::new(x, 0.0, 0.0);
        margins.press(&[], at(0.0));
        assert!(!margins.has_touched);
        margins.press(&[1], at(0.002));
        assert_eq!((margins.has_touched, margins.pressed_speed), (true, 0.0));
        margins.press(&[1, 2], at(0.004));
        assert_eq!(margins.pressed_speed, 0.0);
        margins.press(&[], at(0.005));
        assert!((margins.pressed_speed - 0.001 / STEP).abs() < 1e-9);
    }

    #[test]
    fn the_first_limit_is_the_loss_and_peaks_go_on() {
        let mut margins = Margins::default();
        let limits = [0.03, 0.5];
        margins.carry(Phase::Lift, 1.0, [0.01, 0.2], limits);
        assert_eq!(margins.loss, None);
        margins.carry(Phase::Lift, 1.1, [0.02, 0.6], limits);
        margins.carry(Phase::Shake, 2.1, [0.05, 0.3], limits);
        assert_eq!(margins.loss, Some(Loss { limit: Limit::Angle, phase: Phase::Lift, time: 1.1 }));
        assert_eq!(margins.farthest, Some(Peak { value: 0.05, phase: Phase::Shake }));
        assert_eq!(margins.rotation, Some(Peak { value: 0.6, phase: Phase::Lift }));
    }
}
