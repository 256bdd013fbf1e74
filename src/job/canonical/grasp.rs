//! A resolved job for grasps as text.

use std::path::Path;

use toml::Value;

use super::{Text, relative_to};
use crate::{
    grasp::{AmplitudeRange, Annealing, Antipodal, EnergyKind, Keeping, Sampler, SearchFrame, Uniform, WrenchSpace},
    job::{
        checked::{GraspSettings, JobHand, JobObject, KnownMass, Physics},
        discover,
    },
};

impl Text {
    pub(super) fn grasps(&mut self, settings: &GraspSettings) {
        let GraspSettings { seeds, sampler, annealing, keeping, physics } = settings;
        self.section("grasps");
        self.key("seeds", i64::from(*seeds));
        self.sampler(sampler);
        self.annealing(annealing, *sampler == Sampler::Annealing);
        let Keeping { friction, edges, torsion, space, min_epsilon, advance, most_penetration, table } = keeping;
        self.section("keep");
        self.key("friction", *friction);
        self.key("edges", i64::from(*edges));
        if let Some(torsion) = torsion {
            self.key("torsion", *torsion);
        }
        self.key("space", space_name(*space));
        self.key("min_epsilon", *min_epsilon);
        self.key("advance", *advance);
        self.key("most_penetration", *most_penetration);
        self.key("table", *table);
        physics.iter().for_each(|physics| self.physics(physics));
    }

    /// What objects weigh by themselves.
    pub(super) fn masses(&mut self, objects: &[JobObject]) {
        for object in objects {
            if let Some(KnownMass { kilograms, source }) = &object.mass {
                let of = Value::from(object.source.name.as_str());
                self.list("mass", [of, Value::from(*kilograms), Value::from(source.as_str())]);
            }
        }
    }

    fn physics(&mut self, physics: &Physics) {
        let Physics { friction, mass, perturbed, roll_out_share, roll_outs, six_directions } = physics;
        self.section("physics");
        self.key("friction", *friction);
        self.key("mass", mass.map_or_else(|| Value::from("auto"), Value::from));
        self.key("perturbed", i64::from(*perturbed));
        self.key("roll_out_share", *roll_out_share);
        // How many runs nothing has changes nothing.
        if *roll_out_share > 0.0 {
            self.key("roll_outs", i64::from(*roll_outs));
        }
        self.key("gravity", if *six_directions { "six" } else { "lifted" });
    }

    /// Nothing where annealing searches: jobs of before other samplers were keep their names.
    fn sampler(&mut self, sampler: &Sampler) {
        match sampler {
            Sampler::Annealing => {}
            Sampler::Uniform(Uniform { grasps, rolls, upright }) => {
                self.key("sampler", "uniform");
                self.section("uniform");
                self.key("grasps", i64::from(*grasps));
                self.key("poses", if *upright { "upright" } else { "any" });
                self.key("rolls", Value::Array(rolls.0.iter().copied().map(Value::from).collect()));
            }
            Sampler::Antipodal(Antipodal { pairs, friction, best }) => {
                self.key("sampler", "antipodal");
                self.section("antipodal");
                self.key("pairs", i64::from(*pairs));
                self.key("friction", *friction);
                self.key("best", i64::from(*best));
            }
        }
    }

    /// What of it counts: the energy alone where nothing is searched for.
    fn annealing(&mut self, annealing: &Annealing, searches: bool) {
        let Annealing {
            steps,
            energy,
            space,
            friction,
            potential_scale,
            whole_schedule,
            descent,
            frame,
            amplitudes,
            best,
            most_failures,
        } = annealing;
        self.section("annealing");
        if searches {
            self.key("steps", i64::from(*steps));
        }
        self.key(
            "energy",
            match energy {
                EnergyKind::Contact => "contact",
                EnergyKind::ContactAndPotential => "contact_and_potential",
            },
        );
        self.key("space", space_name(*space));
        self.key("friction", *friction);
        // What scales nothing changes nothing.
        if *energy == EnergyKind::ContactAndPotential {
            self.key("potential_scale", *potential_scale);
        }
        if !searches {
            return;
        }
        self.key("whole_schedule", *whole_schedule);
        self.key("descent", *descent);
        self.key(
            "frame",
            match frame {
                SearchFrame::Seed => "seed",
                SearchFrame::Object => "object",
            },
        );
        self.key(
            "amplitudes",
            match amplitudes {
                AmplitudeRange::Joints => Value::from("joints"),
                AmplitudeRange::Clamped(most) => {
                    Value::Table([("clamped".to_owned(), Value::from(*most))].into_iter().collect())
                }
            },
        );
        self.key("best", i64::from(*best));
        self.key("most_failures", i64::from(*most_failures));
    }

    /// The hand, with its file where there is a folder to see it from.
    pub(super) fn hand_at(&mut self, section: &str, hand: &JobHand, folder: Option<&Path>) {
        let JobHand { scene, name: _, id } = hand;
        self.section(section);
        if let Some(folder) = folder {
            self.key("scene", discover::with_slashes(&relative_to(scene, folder)));
        }
        self.key("content", id.0.hex());
    }
}

fn space_name(space: WrenchSpace) -> &'static str {
    match space {
        WrenchSpace::Force => "force",
        WrenchSpace::Wrench => "wrench",
    }
}
