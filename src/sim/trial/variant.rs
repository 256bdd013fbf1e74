//! Variants of a trial: how far a label depends on choices that another laboratory would make otherwise.

use super::{Numerics, TrialConditions};
use kernel::contact::EDGE_RADIUS;

/// A change of the conditions of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Variant {
    /// Friction lower by 20 %.
    LessFriction,
    /// Friction lower by 40 %.
    LittleFriction,
    /// Twice the mass.
    DoubleMass,
    /// Nothing supports the object while the hand closes.
    FreeObject,
    /// Half the step.
    HalfStep,
    /// Elliptic friction cones as ours, otherwise MuJoCo's defaults.
    PlainElliptic,
    /// MuJoCo's defaults: pyramidal friction cones, `impratio` 1, no iterations against slip.
    MujocoDefaults,
    /// All conditions that make holding harder, at once: friction lower by 20 %, elliptic friction cones and otherwise
    /// MuJoCo's defaults, nothing that supports the object while the hand closes.
    Adverse,
    /// Faces of the hand's boxes that reach to their edges, as those of MuJoCo's own boxes do.
    SharpEdges,
    /// Friction higher by half.
    MoreFriction,
    /// Half the mass.
    HalfMass,
    /// The hand is 2 mm nearer to the object, along its approach.
    AdvancedHand,
    /// MuJoCo's own contacts of the mesh's triangles, in a [separate simulation](super::TrialSim::with_native_mesh):
    /// the conditions do not change.
    NativeContacts,
}

/// Additional motion of [`Variant::AdvancedHand`] [m]: twice the radius by which the edges of pads are rounded.
const ADVANCE: f64 = 2.0 * EDGE_RADIUS;

impl Variant {
    /// Every variant under which a robust grasp holds, in the order of its verdict in a record.
    pub const ALL: [Self; 7] = [
        Self::LessFriction,
        Self::LittleFriction,
        Self::DoubleMass,
        Self::FreeObject,
        Self::HalfStep,
        Self::PlainElliptic,
        Self::MujocoDefaults,
    ];

    /// Harder conditions, under which a grasp that held is tried again before it is a positive: a solver that lets
    /// loaded contacts creep, less friction, and an object that nothing brakes. All at once: of 690 grasps of Panda's
    /// hand, separate trials for each condition left 516, and one trial under all of them leaves 515. Then with
    /// MuJoCo's default settings, as in an independent simulation: friction pyramids hold less where a contact is
    /// pulled between their edges.
    pub const HARDER: [Self; 2] = [Self::Adverse, Self::MujocoDefaults];

    /// Easier conditions, under which a grasp that failed is tried again before it is a negative: mass and friction,
    /// with the uncertainty of real objects, and pads that hold by more than their edges, from which thin objects slip
    /// or not, depending on how round the edges are; finally as any other laboratory would simulate it. One after
    /// another, up to the first under which it holds: under all of them at once nearly everything holds.
    pub const EASIER: [Self; 5] =
        [Self::SharpEdges, Self::AdvancedHand, Self::MoreFriction, Self::HalfMass, Self::NativeContacts];

    /// The name in records.
    pub fn name(self) -> &'static str {
        match self {
            Self::LessFriction => "friction_80_percent",
            Self::LittleFriction => "friction_60_percent",
            Self::DoubleMass => "mass_200_percent",
            Self::FreeObject => "free_object",
            Self::HalfStep => "half_step",
            Self::PlainElliptic => "plain_elliptic",
            Self::MujocoDefaults => "mujoco_defaults",
            Self::Adverse => "adverse",
            Self::SharpEdges => "sharp_edges",
            Self::MoreFriction => "friction_150_percent",
            Self::HalfMass => "mass_50_percent",
            Self::AdvancedHand => "advanced_2_mm",
            Self::NativeContacts => "mujoco_contacts",
        }
    }

    /// The conditions with this change.
    #[must_use]
    pub fn apply_to(self, conditions: &TrialConditions) -> TrialConditions {
        let same = *conditions;
        match self {
            Self::LessFriction => TrialConditions { friction: 0.8 * same.friction, ..same },
            Self::LittleFriction => TrialConditions { friction: 0.6 * same.friction, ..same },
            Self::DoubleMass => TrialConditions { mass: 2.0 * same.mass, ..same },
            Self::FreeObject => TrialConditions { is_free: true, ..same },
            Self::HalfStep => TrialConditions { numerics: Numerics::HalfStep, ..same },
            Self::PlainElliptic => TrialConditions { numerics: Numerics::PlainElliptic, ..same },
            Self::Adverse => {
                let numerics = Numerics::PlainElliptic;
                TrialConditions { friction: 0.8 * same.friction, is_free: true, numerics, ..same }
            }
            Self::SharpEdges => TrialConditions { has_sharp_edges: true, ..same },
            Self::MoreFriction => TrialConditions { friction: 1.5 * same.friction, ..same },
            Self::HalfMass => TrialConditions { mass: 0.5 * same.mass, ..same },
            Self::AdvancedHand => TrialConditions { advance: same.advance + ADVANCE, ..same },
            Self::MujocoDefaults => TrialConditions { numerics: Numerics::MujocoDefaults, ..same },
            Self::NativeContacts => same,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_variant_changes_what_it_says_and_has_a_name_of_its_own() {
        let plain = TrialConditions::new(0.25);
        let changed = Variant::ALL.map(|variant| variant.apply_to(&plain));
        assert!(changed.iter().all(|conditions| *conditions != plain && conditions.check().is_ok()));
        assert_eq!([0, 1].map(|index| changed[index].friction), [0.4, 0.3]);
        assert_eq!((changed[2].mass, changed[3].is_free), (0.5, true));
        let easier = Variant::EASIER.map(|variant| variant.apply_to(&plain));
        let one = |change: fn(&mut TrialConditions)| {
            let mut changed = plain;
            change(&mut changed);
            changed
        };
        let wanted = [
            one(|changed| changed.has_sharp_edges = true),
            one(|changed| changed.advance = 0.002),
            one(|changed| changed.friction = 0.75),
            one(|changed| changed.mass = 0.125),
            plain,
        ];
        assert_eq!(easier, wanted);
        let adverse = TrialConditions { friction: 0.4, is_free: true, numerics: Numerics::PlainElliptic, ..plain };
        assert_eq!(Variant::HARDER.map(|variant| variant.apply_to(&plain)), [adverse, changed[6]]);
        let all = || Variant::ALL.into_iter().chain([Variant::Adverse]).chain(Variant::EASIER);
        assert_eq!(all().map(Variant::name).collect::<BTreeSet<_>>().len(), all().count());
    }
}
