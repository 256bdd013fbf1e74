//! Loads that a sealed cup holds: the wrench constraints of Dex-Net 3.0 (Mahler et al. 2018, "Dex-Net 3.0: Computing Robust Vacuum
//! Suction Grasp Targets in Point Clouds Using a New Analytic Model and Deep Learning", section IV-C).
//!
//! With the pull f_z along the axis, away from the cup, the vacuum leaves a normal force N = V - f_z. Dex-Net inscribes boxes into
//! the limits of friction and of the elastic ring: sqrt 3 |f_x|, sqrt 3 |f_y| <= mu N; sqrt 3 |t_z| <= r mu N; sqrt 2 |t_x|,
//! sqrt 2 |t_y| <= M. Such a box depends on how the cup is rolled about its axis. The constraints here are what these boxes cover at
//! all rolls: sqrt 3/2 |f_xy| <= mu N, sqrt 3 |t_z| <= r mu N, |t_xy| <= M; a cylinder and a disc inscribed into the same limits.
//!
//! Every constraint compares a convex function of the load, which grows in proportion to it, with a strength of the cup. Its
//! quotient is the used share of the strength; the cup holds the load where no share is above 1.

use nalgebra::{Unit, Vector3};

use super::cup::SuctionCup;

/// Acceleration of gravity [m/s^2].
pub const GRAVITY: f64 = 9.81;

/// Factor of |f_xy|: the corner of Dex-Net's box of side 2 mu N / sqrt 3 is mu N sqrt 2/3 away from the axis.
const SHEAR: f64 = 1.5;

/// Square of the factor of the moment about the axis.
const TORSION: f64 = 3.0;

/// Smallest margin: where a load uses twice the strength or more.
const LOWEST: f64 = -1.0;

/// A load of a cup: the weight of the object.
///
/// ```
/// use nalgebra::Vector3;
/// use graspmill_robot::suction::{CupSettings, Load, SuctionCup};
///
/// let cup = SuctionCup::new(CupSettings::default())?;
/// // 300 g that hang 40 mm below the lip: lifted straight up, and rotated to any direction.
/// let mut load = Load { mass: 0.3, safety: 2.0, lever: Vector3::new(0.0, 0.0, 0.04), down: Some(Vector3::z_axis()) };
/// assert!(cup.hold(&load, 0.0).margin > 0.6);
/// load.down = None;
/// assert!(cup.hold(&load, 0.0).margin < 0.0);
/// # Ok::<(), graspmill_robot::suction::InvalidCup>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Mass of the object [kg].
    pub mass: f64,
    /// Factor on the weight, for accelerations and leaks: data sheets of cups advise 1.5 to 2.
    pub safety: f64,
    /// From the middle of the lip to the centre of mass, in the cup's frame [m]; the cup approaches along z.
    pub lever: Vector3<f64>,
    /// Direction of gravity in the cup's frame; `None` for the worst direction of each constraint.
    pub down: Option<Unit<Vector3<f64>>>,
}

/// A strength of a cup.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum HoldLimit {
    /// The vacuum against the pull along the axis.
    Pull,
    /// Friction against sliding.
    Shear,
    /// Friction against rotation about the axis.
    Torsion,
    /// The lip against tilting.
    Tilt,
}

impl HoldLimit {
    /// All limits, in the order of [`Hold::used`].
    pub const ALL: [Self; 4] = [Self::Pull, Self::Shear, Self::Torsion, Self::Tilt];
}

/// Used shares of a cup's strengths under a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Used share of each strength, in the order of [`HoldLimit::ALL`]: 0 without load, 1 at the limit; infinite where the cup has
    /// no strength left.
    pub used: [f64; 4],
    /// Strength with the largest used share.
    pub weakest: HoldLimit,
    /// 1 less the largest used share, at least -1: the cup holds where it is at least 0.
    pub margin: f64,
}

impl Hold {
    fn of(used: [f64; 4]) -> Self {
        let used = used.map(|share| if share.is_nan() { f64::INFINITY } else { share.max(0.0) });
        let worst = (1..used.len()).fold(0, |worst, index| if used[index] > used[worst] { index } else { worst });
        Self { used, weakest: HoldLimit::ALL[worst], margin: (1.0 - used[worst]).max(LOWEST) }
    }

    /// Whether the cup holds the load.
    pub fn holds(&self) -> bool {
        self.margin >= 0.0
    }
}

impl SuctionCup {
    /// Used shares of the cup's strengths under a load, with bellows compressed by a mean length [m].
    pub fn hold(&self, load: &Load, compression: f64) -> Hold {
        let (force, weight) = (self.force(compression), load.mass * load.safety * GRAVITY);
        Hold::of(match load.down {
            Some(down) => {
                let pull = down.into_inner() * weight;
                self.used(force, &pull, &load.lever.cross(&pull))
            }
            None => self.used_at_worst(force, weight, &load.lever),
        })
    }

    /// Used shares under a force [N] and a moment about the middle of the lip [N m] that the object exerts on the cup, in the cup's
    /// frame, with bellows compressed by a mean length [m].
    ///
    /// ```
    /// use nalgebra::Vector3;
    /// use graspmill_robot::suction::{CupSettings, HoldLimit, SuctionCup};
    ///
    /// let cup = SuctionCup::new(CupSettings { max_force: Some(10.0), ..CupSettings::default() })?;
    /// let hold = cup.resist(&Vector3::new(0.0, 0.0, 4.0), &Vector3::zeros(), 0.0);
    /// assert!((hold.used[0] - 0.4).abs() < 1e-12 && hold.holds());
    /// // Friction of 0.5 has 3 N left of the normal force of 6 N; Dex-Net's box takes sqrt 2/3 of it.
    /// let hold = cup.resist(&Vector3::new(3.0, 0.0, 4.0), &Vector3::zeros(), 0.0);
    /// assert!(hold.weakest == HoldLimit::Shear && !hold.holds());
    /// # Ok::<(), graspmill_robot::suction::InvalidCup>(())
    /// ```
    pub fn resist(&self, force: &Vector3<f64>, moment: &Vector3<f64>, compression: f64) -> Hold {
        Hold::of(self.used(self.force(compression), force, moment))
    }

    /// Used shares for a force V of the vacuum.
    fn used(&self, vacuum: f64, force: &Vector3<f64>, moment: &Vector3<f64>) -> [f64; 4] {
        let settings = self.settings();
        let (friction, radius) = (settings.friction, settings.radius);
        // sqrt 3/2 |f_xy| + mu f_z <= mu V; sqrt 3 |t_z| + r mu f_z <= r mu V.
        let shear = SHEAR.sqrt() * force.xy().norm() / friction + force.z;
        let torsion = TORSION.sqrt() * moment.z.abs() / (radius * friction) + force.z;
        let tilt = moment.xy().norm();
        let tilt = match settings.max_moment {
            Some(most) => tilt / most,
            // The lip's load per length is N / (2 pi r) + M cos / (pi r^2), at least 0 where M <= N r / 2.
            None => (2.0 * tilt / radius + force.z) / vacuum,
        };
        [force.z / vacuum, shear / vacuum, torsion / vacuum, tilt]
    }

    /// Used shares for the worst direction of a weight [N] each: the largest values of the same functions over all unit vectors.
    fn used_at_worst(&self, vacuum: f64, weight: f64, lever: &Vector3<f64>) -> [f64; 4] {
        let settings = self.settings();
        let (friction, radius) = (settings.friction, settings.radius);
        // sqrt 3/2 sin / mu + cos: the largest value of a sin + b cos is sqrt(a^2 + b^2).
        let shear = (SHEAR / (friction * friction) + 1.0).sqrt();
        // t_z = u . (z x c), at right angles to f_z = u . z.
        let (aside, along) = (lever.xy().norm(), lever.z.abs());
        let arm = aside / (radius * friction);
        let torsion = (TORSION * arm * arm + 1.0).sqrt();
        // With u in the plane of axis and lever, |t_xy| = along sin + aside cos, and no direction has more.
        let tilt = match settings.max_moment {
            Some(most) => weight * (along * along + aside * aside).sqrt() / most,
            None => {
                let (of_sin, of_cos) = (2.0 * along / radius, 2.0 * aside / radius + 1.0);
                weight * (of_sin * of_sin + of_cos * of_cos).sqrt() / vacuum
            }
        };
        let share = weight / vacuum;
        [share, shear * share, torsion * share, tilt]
    }
}

#[cfg(test)]
mod tests {
    use super::{super::cup::CupSettings, *};
    use kernel::seed::Stream;

    /// A cup of 10 mm with a force of 20 N, friction 0.5, and bellows without stiffness.
    fn cup(max_moment: Option<f64>) -> SuctionCup {
        let settings =
            CupSettings { vacuum: 100e3, max_force: Some(20.0), stiffness: 0.0, max_moment, ..CupSettings::default() };
        SuctionCup::new(settings).expect("a cup")
    }

    fn share(hold: &Hold, limit: HoldLimit) -> f64 {
        hold.used[limit as usize]
    }

    #[test]
    fn forces_and_moments_at_the_limits_use_all_of_a_strength() {
        let zero = Vector3::zeros();
        for (force, moment, limit) in [
            (Vector3::new(0.0, 0.0, 20.0), zero, HoldLimit::Pull),
            // mu V / sqrt 1.5 in any direction across.
            (Vector3::new(6.0, 8.0, 0.0) / 1.5f64.sqrt(), zero, HoldLimit::Shear),
            // Half of the force is left.
            (Vector3::new(0.0, 5.0 / 1.5f64.sqrt(), 10.0), zero, HoldLimit::Shear),
            // r mu V / sqrt 3.
            (zero, Vector3::new(0.0, 0.0, -0.1 / 3f64.sqrt()), HoldLimit::Torsion),
            // V r / 2.
            (zero, Vector3::new(0.06, 0.08, 0.0), HoldLimit::Tilt),
            (Vector3::new(0.0, 0.0, 10.0), Vector3::new(0.03, -0.04, 0.0), HoldLimit::Tilt),
        ] {
            let hold = cup(None).resist(&force, &moment, 0.0);
            assert!((share(&hold, limit) - 1.0).abs() < 1e-12, "{limit:?}: {hold:?}");
            assert!(hold.weakest == limit && hold.margin.abs() < 1e-12, "{limit:?}: {hold:?}");
            let hold = cup(None).resist(&(force * 0.999), &(moment * 0.999), 0.0);
            assert!(hold.holds() && (hold.margin - 0.001).abs() < 1e-9);
            assert!(!cup(None).resist(&(force * 1.001), &(moment * 1.001), 0.0).holds());
        }
        let hold = cup(Some(0.2)).resist(&zero, &Vector3::new(0.06, 0.08, 0.0), 0.0);
        assert!((share(&hold, HoldLimit::Tilt) - 0.5).abs() < 1e-12);
        // The object rests on a cup from below: it presses, and friction grows.
        let hold = cup(None).resist(&Vector3::new(10.0, 0.0, -20.0), &zero, 0.0);
        assert!(hold.holds() && share(&hold, HoldLimit::Pull) == 0.0);
    }

    #[test]
    fn boxes_of_dex_net_at_any_roll_are_within_the_limits() {
        let cup = cup(Some(0.02));
        let mut draw = Stream::of_job(3, b"", "boxes");
        for _ in 0..1000 {
            let normal = draw.uniform(0.1, 30.0);
            let sign = |draw: &mut Stream| if draw.unit() < 0.5 { -1.0 } else { 1.0 };
            let [x, y, z] = [(); 3].map(|()| sign(&mut draw) * 0.5 * normal / 3f64.sqrt());
            let [tx, ty] = [(); 2].map(|()| sign(&mut draw) * 0.02 / 2f64.sqrt());
            let roll = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), draw.uniform(-3.0, 3.0));
            let force = roll * Vector3::new(x, y, 20.0 - normal);
            let hold = cup.resist(&force, &(roll * Vector3::new(tx, ty, 0.01 * z)), 0.0);
            // A corner of the box is on all limits but the pull.
            for limit in [HoldLimit::Shear, HoldLimit::Torsion, HoldLimit::Tilt] {
                assert!((share(&hold, limit) - 1.0).abs() < 1e-9, "{hold:?}");
            }
        }
    }

    #[test]
    fn the_worst_direction_is_that_of_a_search() {
        let mut draw = Stream::of_job(4, b"", "directions");
        for max_moment in [None, Some(0.1)] {
            for _ in 0..8 {
                let lever = Vector3::from([(); 3].map(|()| draw.uniform(-0.05, 0.05)));
                let load = Load { mass: 0.2, safety: 1.5, lever, down: None };
                let worst = cup(max_moment).hold(&load, 0.0);
                let mut found = [0.0f64; 4];
                for _ in 0..50_000 {
                    let down = Vector3::from([(); 3].map(|()| draw.normal()));
                    let hold = cup(max_moment).hold(&Load { down: Some(Unit::new_normalize(down)), ..load }, 0.0);
                    found = std::array::from_fn(|index| found[index].max(hold.used[index]));
                }
                for (worst, found) in worst.used.iter().zip(found) {
                    assert!(found <= worst * (1.0 + 1e-12) && found > 0.999 * worst, "{worst} {found} {lever}");
                }
            }
        }
    }

    #[test]
    fn a_cup_without_force_holds_nothing() {
        let weak = SuctionCup::new(CupSettings { vacuum: 1.0, ..CupSettings::default() }).expect("a cup");
        let load = Load { mass: 0.1, safety: 1.0, lever: Vector3::zeros(), down: Some(Vector3::z_axis()) };
        assert_eq!(weak.hold(&load, 0.005).margin, LOWEST);
        assert_eq!(weak.hold(&Load { down: None, ..load }, 0.005).margin, LOWEST);
    }
}
