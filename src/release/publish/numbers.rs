//! The measured numbers of a release's documents: out of the same surveys as the report and `inspect`.

use crate::{
    dataset::{DatasetError, DatasetReader, Split, read_field},
    geom::PoseLabel,
    ids::Product,
    record::{GraspVerdict, ReachabilityField},
    release::{
        ReachabilityFacts, Spread, TouchFacts,
        chart::{grouped, percent},
        grasps::GraspSurvey,
        page::bytes_in_words,
        patches::PatchSurvey,
        reachability,
        survey::Survey,
    },
};

/// What one pass over a dataset found.
pub(super) enum Surveyed {
    /// Of completion.
    Completion(Box<Survey>),
    /// Of grasps.
    Grasps(Box<GraspSurvey>),
    /// Of patches.
    Patches(Box<PatchSurvey>),
    /// Of reachability, with its field.
    Reachability(Box<ReachabilityFacts>, Box<ReachabilityField>),
}

impl Surveyed {
    /// Passes over a finished dataset.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        Ok(match reader.manifest().product {
            Product::Completion => Self::Completion(Box::new(Survey::of(reader)?)),
            Product::Grasps => Self::Grasps(Box::new(GraspSurvey::of(reader)?)),
            Product::Patches => Self::Patches(Box::new(PatchSurvey::of(reader)?)),
            Product::Reachability => {
                let field = read_field(reader.folder())?;
                Self::Reachability(Box::new(reachability::facts_of(reader, &field)?), Box::new(field))
            }
        })
    }
}

/// Numbers as documents show them; none depends on clock, machine or path.
pub(super) struct Numbers {
    /// Name of the job.
    pub job_name: String,
    /// What a sample is, in the plural.
    pub samples: &'static str,
    /// One line on what the dataset holds.
    pub lead: String,
    /// What was counted or measured, and how much.
    pub rows: Vec<(String, String)>,
    /// Distributions over the stored samples: what, digits after the point, values.
    pub spreads: Vec<(&'static str, usize, Spread)>,
    /// Stored samples and objects of each split; empty where nothing is split.
    pub splits: Vec<(Split, u64, Option<u64>)>,
    /// Names of objects that share their geometry across the split.
    pub leaks: Vec<String>,
}

impl Numbers {
    /// The numbers of a dataset; `surveyed` is absent where its samples may not be shown: then those of the manifest.
    pub fn of(reader: &DatasetReader, surveyed: Option<&Surveyed>) -> Result<Self, DatasetError> {
        let manifest = reader.manifest();
        let counts = &manifest.counts;
        let samples = samples_of(manifest.product);
        let rejected: u64 = counts.rejected.values().sum();
        let bytes = manifest.shards.iter().map(|shard| shard.bytes).sum();
        let mut rows = vec![
            row(format!("{samples} planned"), grouped(counts.samples)),
            row("stored", grouped(counts.kept)),
            row("rejected", grouped(rejected)),
        ];
        rows.extend(counts.rejected.iter().map(|(reason, count)| row(format!("rejected: {reason}"), grouped(*count))));
        let subjects = if manifest.product == Product::Reachability { "robots" } else { "objects" };
        rows.push(row(subjects, grouped(counts.objects)));
        if counts.refused_meshes > 0 {
            rows.push(row("meshes that could not be used", grouped(counts.refused_meshes)));
        }
        rows.push(row("shards", format!("{}, {}", grouped(manifest.shards.len() as u64), bytes_in_words(bytes))));
        let channels: Vec<&str> = manifest.channels().into_iter().map(|channel| channel.name()).collect();
        rows.push(row("channels", channels.join(", ")));
        let split = |split: Split| (split, counts.splits.get(&split).copied().unwrap_or(0), None);
        let splits = if counts.splits.is_empty() { Vec::new() } else { Split::ALL.map(split).to_vec() };
        let mut numbers = Self {
            job_name: crate::release::survey::name_of(reader)?,
            samples,
            lead: lead(manifest.product).to_owned(),
            rows,
            spreads: Vec::new(),
            splits,
            leaks: Vec::new(),
        };
        match surveyed {
            None => {}
            Some(Surveyed::Completion(survey)) => numbers.add_completion(survey),
            Some(Surveyed::Grasps(survey)) => numbers.add_grasps(survey),
            Some(Surveyed::Patches(survey)) => numbers.add_patches(survey),
            Some(Surveyed::Reachability(facts, _)) => numbers.add_reachability(facts),
        }
        Ok(numbers)
    }

    fn add_completion(&mut self, survey: &Survey) {
        let facts = &survey.facts;
        if let Some(setup) = &facts.setup {
            let n = setup.resolution;
            self.rows.push(row("grid", format!("{n} x {n} x {n} cells")));
            let camera = format!("{} x {} px, focal length {:.2} px", setup.width, setup.height, setup.fx);
            self.rows.push(row("camera", camera));
        }
        if facts.kept > 0 {
            let share = percent(facts.cut_off as f64 / facts.kept as f64);
            self.rows.push(row("stored with less than 99 % of the solid inside the grid", share));
        }
        if let Some(touch) = &facts.touch {
            for kind in &touch.kinds {
                let each = TouchFacts::share(kind.contacts, touch.samples);
                self.rows
                    .push(row(format!("contacts a sample, {}", kind.channel.replace('_', " ")), format!("{each:.1}")));
            }
        }
        self.spreads = vec![
            ("partial cells", 0, facts.partial_cells),
            ("complete cells", 0, facts.complete_cells),
            ("partial / complete", 3, facts.seen_ratio),
            ("share of the solid inside the grid", 3, facts.solid_share),
        ];
        self.splits = facts.splits.iter().map(|row| (row.split, row.samples, Some(row.objects))).collect();
        self.leaks = facts.leaking_geometry.iter().map(|names| names.join(" = ")).collect();
    }

    fn add_grasps(&mut self, survey: &GraspSurvey) {
        let facts = &survey.facts;
        self.rows.extend(facts.hand.iter().map(|hand| row("hand", hand)));
        for verdict in GraspVerdict::ALL {
            let count = facts.verdicts.get(verdict.name()).copied().unwrap_or(0);
            self.rows.push(row(format!("grasps: {}", verdict.name().replace('_', " ")), grouped(count)));
        }
        self.rows.push(row("runs given up before they were over", grouped(facts.given_up)));
        self.rows.push(row("different types of kept grasps", grouped(facts.types.len() as u64)));
        if let Some(trials) = &facts.trials {
            self.rows.push(row("physical trials", trials.in_words()));
            self.rows.push(row("conditions of trials", &trials.conditions));
        }
        self.spreads = vec![("energy of all states", 3, facts.energy), ("epsilon of kept grasps", 4, facts.epsilon)];
    }

    fn add_patches(&mut self, survey: &PatchSurvey) {
        let facts = &survey.facts;
        self.rows.extend(facts.hand.iter().map(|hand| row("hand", hand)));
        self.rows.push(row("kept grasps of the dataset of grasps", grouped(facts.kept_grasps)));
        self.rows.push(row("different types of them", grouped(facts.different_types)));
        self.rows.push(row("types chosen", grouped(facts.types.len() as u64)));
        self.rows.push(row("patches in colour", if facts.colour { "yes" } else { "no" }));
        if let Some(grasps) = &facts.grasps {
            self.rows.push(row("exact digest of the dataset of grasps", format!("`{grasps}`")));
        }
        self.spreads = vec![("epsilon", 4, facts.epsilon), ("energy", 3, facts.energy)];
    }

    fn add_reachability(&mut self, facts: &ReachabilityFacts) {
        self.rows.push(row("robot", format!("{}, content `{}`", facts.robot.name, facts.robot.id)));
        self.rows.push(row("planning group", facts.robot.joints.join(", ")));
        self.rows.push(row("brought to the poses", format!("site {}", facts.robot.target)));
        self.rows.push(row("poses", grouped(facts.poses)));
        for label in PoseLabel::ALL.into_iter().rev() {
            let count = facts.labels.get(label.name()).copied().unwrap_or(0);
            let share = percent(count as f64 / facts.poses.max(1) as f64);
            self.rows.push(row(
                format!("poses: {}", label.name().replace('_', " ")),
                format!("{} ({share})", grouped(count)),
            ));
        }
        for (proof, count) in facts.proofs.iter().filter(|(_, count)| **count > 0) {
            self.rows.push(row(format!("known by {}", proof.replace('_', " ")), grouped(*count)));
        }
        self.rows.push(row("collisions", &facts.collisions));
        self.rows.push(row("orientations", &facts.covering.words));
        if let (Some(least), Some(most)) = (facts.field.least, facts.field.most) {
            let range = format!("{least:.4} to {most:.4} {}, negative inside", facts.field.unit);
            self.rows.push(row("signed distance", range));
        }
    }
}

fn row(what: impl Into<String>, value: impl Into<String>) -> (String, String) {
    (what.into(), value.into())
}

/// What people call the samples of a product.
fn samples_of(product: Product) -> &'static str {
    match product {
        Product::Completion => "samples",
        Product::Reachability => "positions",
        Product::Grasps => "runs",
        Product::Patches => "grasps",
    }
}

fn lead(product: Product) -> &'static str {
    match product {
        Product::Completion => {
            "Pairs of occupancy grids: what one depth camera sees of an object, and the whole solid, on the same grid."
        }
        Product::Reachability => {
            "For each pose of a grid whether a robot's end effector reaches it without a collision, how that is known, and the \
             signed distance to the border of the reachable set."
        }
        Product::Grasps => {
            "How a hand can hold objects: poses, joints, contacts, quality and a verdict for every grasp that was found."
        }
        Product::Patches => {
            "What a camera sees around the palm and the fingertips of grasps: square patches of depth, with the labels of \
             heatmaps by grasp type."
        }
    }
}

/// What a row of the index is: one sample of the plan.
pub(super) fn sample_in_words(product: Product) -> &'static str {
    match product {
        Product::Completion => "one object seen from one side",
        Product::Reachability => "one position of the robot's end effector, with all its orientations",
        Product::Grasps => "one search from one seed on an object, with all grasps that it found",
        Product::Patches => "one grasp, seen by one camera",
    }
}
