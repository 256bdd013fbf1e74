//! A ladder of conditions of rising difficulty, climbed by bisection.

use super::{TrialConditions, Variant};
use crate::hand::effort::MotorLaw;

/// Level of difficulty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrialLevel {
    /// Friction higher by half, and half the mass.
    Easy,
    /// The job's conditions.
    Nominal,
    /// [`Variant::Adverse`].
    Adverse,
    /// MuJoCo's default solver settings, and twice the mass.
    Hard,
}

impl TrialLevel {
    /// Every level, the easiest first.
    pub const ALL: [Self; 4] = [Self::Easy, Self::Nominal, Self::Adverse, Self::Hard];
}

/// The conditions of a level, from those of the job; with a motor law.
///
/// The levels change what labels turned out to depend on: friction and mass, which are uncertain for real objects, and the
/// contact model, which differs most between simulations.
#[must_use]
pub fn conditions_at(level: TrialLevel, nominal: &TrialConditions, motors: MotorLaw) -> TrialConditions {
    let level = match level {
        TrialLevel::Easy => Variant::HalfMass.apply_to(&Variant::MoreFriction.apply_to(nominal)),
        TrialLevel::Nominal => *nominal,
        TrialLevel::Adverse => Variant::Adverse.apply_to(nominal),
        TrialLevel::Hard => Variant::DoubleMass.apply_to(&Variant::MujocoDefaults.apply_to(nominal)),
    };
    TrialConditions { motors, has_margins: true, ..level }
}

/// Result of a level.
#[derive(Clone, Debug, PartialEq)]
pub enum Rung<T> {
    /// A trial was made.
    Tried(T),
    /// No trial was made: whether it holds follows from another level.
    Inferred(bool),
    /// No trial was made, and nothing follows: the trial at [`TrialLevel::Nominal`] was inconclusive.
    Unknown,
}

/// Results of all levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Climb<T> {
    /// In the order of [`TrialLevel::ALL`].
    pub levels: [Rung<T>; 4],
    /// The trial at [`TrialLevel::Easy`] under the other motor law, of a grasp that lost that level.
    pub second_law: Option<T>,
}

/// Climbs the ladder: tries [`TrialLevel::Nominal`]; after a hold `Hard`, and `Adverse` if that is lost; after a loss `Easy`,
/// and that level again by the other motor law if it is lost, too. Levels below one that holds are inferred to hold, levels
/// above one that is lost to be lost: in replays, a harder level held where an easier one was lost in at most 3 of 100 grasps.
///
/// `attempt` makes a trial; `holds` is whether its result holds, `None` if it is inconclusive.
///
/// # Errors
/// The first error of a trial.
pub fn climb<T, E>(
    mut attempt: impl FnMut(TrialLevel, MotorLaw) -> Result<T, E>,
    holds: impl Fn(&T) -> Option<bool>,
) -> Result<Climb<T>, E> {
    let nominal = attempt(TrialLevel::Nominal, MotorLaw::Position)?;
    let known = holds(&nominal);
    let nominal = Rung::Tried(nominal);
    let Some(held) = known else {
        let levels = [Rung::Unknown, nominal, Rung::Unknown, Rung::Unknown];
        return Ok(Climb { levels, second_law: None });
    };
    if held {
        let hard = attempt(TrialLevel::Hard, MotorLaw::Position)?;
        let adverse = match holds(&hard) {
            Some(true) => Rung::Inferred(true),
            _ => Rung::Tried(attempt(TrialLevel::Adverse, MotorLaw::Position)?),
        };
        return Ok(Climb { levels: [Rung::Inferred(true), nominal, adverse, Rung::Tried(hard)], second_law: None });
    }
    let easy = attempt(TrialLevel::Easy, MotorLaw::Position)?;
    let second_law = match holds(&easy) {
        Some(true) => None,
        _ => Some(attempt(TrialLevel::Easy, MotorLaw::Torque)?),
    };
    Ok(Climb { levels: [Rung::Tried(easy), nominal, Rung::Inferred(false), Rung::Inferred(false)], second_law })
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::physics::Numerics;

    #[test]
    fn levels_are_tried_by_bisection() {
        use MotorLaw::{Position, Torque};
        use Rung::{Inferred, Tried, Unknown};
        use TrialLevel::{Adverse, Easy, Hard, Nominal};
        type Case<'a> = (&'a [(TrialLevel, MotorLaw, Option<bool>)], [Rung<Option<bool>>; 4], Option<Option<bool>>);
        let [held, lost] = [Some(true), Some(false)];
        let cases: [Case<'_>; 7] = [
            (
                &[(Nominal, Position, held), (Hard, Position, held)],
                [Inferred(true), Tried(held), Inferred(true), Tried(held)],
                None,
            ),
            (
                &[(Nominal, Position, held), (Hard, Position, lost), (Adverse, Position, held)],
                [Inferred(true), Tried(held), Tried(held), Tried(lost)],
                None,
            ),
            (
                &[(Nominal, Position, held), (Hard, Position, None), (Adverse, Position, lost)],
                [Inferred(true), Tried(held), Tried(lost), Tried(None)],
                None,
            ),
            (
                &[(Nominal, Position, lost), (Easy, Position, held)],
                [Tried(held), Tried(lost), Inferred(false), Inferred(false)],
                None,
            ),
            (
                &[(Nominal, Position, lost), (Easy, Position, lost), (Easy, Torque, held)],
                [Tried(lost), Tried(lost), Inferred(false), Inferred(false)],
                Some(held),
            ),
            (
                &[(Nominal, Position, lost), (Easy, Position, lost), (Easy, Torque, lost)],
                [Tried(lost), Tried(lost), Inferred(false), Inferred(false)],
                Some(lost),
            ),
            (&[(Nominal, Position, None)], [Unknown, Tried(None), Unknown, Unknown], None),
        ];
        for (results, levels, second_law) in cases {
            let mut left = results.iter();
            let attempt = |level, law| {
                let (expected, with, result) = left.next().expect("no further trial");
                assert_eq!((level, law), (*expected, *with));
                Ok::<_, Infallible>(*result)
            };
            let Ok(found) = climb(attempt, |result| *result);
            assert_eq!(found, Climb { levels, second_law });
            assert!(left.next().is_none(), "{results:?}");
        }
    }

    #[test]
    fn levels_rise() {
        let nominal = TrialConditions::new(0.25);
        let [easy, same, adverse, hard] =
            TrialLevel::ALL.map(|level| conditions_at(level, &nominal, MotorLaw::Position));
        assert_eq!((easy.friction, easy.mass), (0.75, 0.125));
        assert_eq!(same, TrialConditions { has_margins: true, ..nominal });
        assert_eq!((adverse.friction, adverse.is_free, adverse.numerics), (0.4, true, Numerics::PlainElliptic));
        assert_eq!((hard.friction, hard.mass, hard.numerics), (0.5, 0.5, Numerics::MujocoDefaults));
        assert_eq!(conditions_at(TrialLevel::Easy, &nominal, MotorLaw::Torque).motors, MotorLaw::Torque);
    }
}
