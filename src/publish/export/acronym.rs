//! ACRONYM's layout: one HDF5 file per object, with the grasps of a parallel-jaw gripper on it.
//!
//! Source: C. Eppner, A. Mousavian, D. Fox, "ACRONYM: A Large-Scale Grasp Dataset Based on Simulation", 2021, and the files
//! that its authors publish.

use std::collections::BTreeMap;

use hdf5_pure::{AttrValue, FileBuilder, GroupBuilder};
use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};
use serde_json::json;

use super::{
    error::ExportError,
    form::{ExportForm, ExportFormat, ExportSelection, Written},
    names::object_folders,
    object_mesh::{mass_properties, write_mesh},
    selected::SelectedSamples,
    target::Target,
};
use format::{
    Channel, Grasp, GraspLadder, GraspLadders, GraspRun, GraspTrial, GraspTrials, HandShape, LadderLabel, LadderLevel,
    Noun, Product,
    dataset::{AssetRow, DatasetReader, Sample},
    extras::Shapes,
};
use kernel::{
    geom::{HandBase, MassProperties, Object, Pose},
    ids::SampleIndex,
    words::GraspVerdict,
};

/// `grasps/<object>.h5` and `meshes/<object>.obj`.
pub(super) static FORMAT: ExportFormat = ExportFormat {
    name: "acronym",
    summary: "Grasps of a parallel-jaw gripper in ACRONYM's layout: one HDF5 file per object, and its mesh.",
    has_unpacked: false,
    forms: &[ExportForm {
        product: Product::GRASPS,
        counted: Noun { one: "grasp", many: "grasps" },
        keys: &[],
        layout: |_| {
            "grasps/<object>.h5: grasps/transforms (N, 4, 4), the gripper in the object's frame [m], its origin that of the hand's \
             base, z the approach, x the line along which the pads close; grasps/qualities/flex/object_in_gripper (N), 1 if the grasp holds; its attribute `from` is trial (in MuJoCo), ladder (the graded label is held; quality `success` has the share of levels) or verdict (kept for its force closure, if the dataset has no trials); grasps/qualities/graspmill: further numbers; object, gripper: as in ACRONYM; \
             meshes/<object>.obj: object/file [m], object/scale 1"
        },
        write,
    }],
};

/// Largest cosine of a right angle, and sine of equal directions, among the axes of a gripper.
const TOLERANCE: f64 = 1e-6;

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?.objects;
    let shapes = Shapes::open(reader.folder())?;
    let hand = shapes.hand()?;
    let samples = SelectedSamples::of(reader, &assets, selection)?.by_object();
    let channels = reader.manifest().channels();
    let source = match () {
        () if channels.contains(&Channel::GRASP_TRIALS) => LabelSource::Trial,
        () if channels.contains(&Channel::GRASP_LADDERS) => LabelSource::Ladder,
        () => LabelSource::Verdict,
    };
    let (folders, mut count) = (object_folders(&assets), 0);
    for (index, row) in assets.iter().enumerate() {
        let Some(samples) = samples.get(&row.object) else { continue };
        let Some(grasps) = LabelledGrasps::read(reader, &hand, samples, source)? else { continue };
        let name = folders.get(&row.object).map_or("object", String::as_str);
        let mesh = shapes.object(index)?.mesh;
        let file = grasps.file(row, name, &mass_properties(row, &mesh)?).finish();
        let file = file.map_err(|source| ExportError::Hdf5 { name: row.name.clone(), source: Box::new(source) })?;
        target.write(&format!("grasps/{name}.h5"), &file)?;
        write_mesh(target, &format!("meshes/{name}.obj"), &mesh)?;
        count += grasps.in_gripper.len() as u64;
    }
    if count == 0 {
        return Err(ExportError::NothingSelected { kept: reader.manifest().counts.kept });
    }
    let mut written = Written::selection(count, "grasps", selection);
    written.facts.insert("object_in_gripper".to_owned(), json!(source.name()));
    Ok(written)
}

/// Source of the labels of a dataset.
#[derive(Clone, Copy)]
enum LabelSource {
    /// One trial.
    Trial,
    /// Trials of rising difficulty.
    Ladder,
    /// The verdict of the search.
    Verdict,
}

impl LabelSource {
    fn name(self) -> &'static str {
        match self {
            Self::Trial => "trial",
            Self::Ladder => "ladder",
            Self::Verdict => "verdict",
        }
    }
}

/// Label of a grasp, with the numbers of its trials.
struct Label {
    held: bool,
    numbers: Vec<(&'static str, f64)>,
}

impl Label {
    fn from_trial(trial: &GraspTrial) -> Self {
        Self { held: trial.outcome.verdict.is_held(), numbers: vec![("farthest", trial.outcome.farthest)] }
    }

    /// Numbers are NaN where the ladder has none: a blocked grasp has no trial, an untested one no share.
    fn from_ladder(ladder: &GraspLadder) -> Self {
        let nominal = ladder.level(LadderLevel::Nominal).and_then(|level| level.trial());
        Self {
            held: ladder.label() == LadderLabel::Held,
            numbers: vec![
                ("farthest", nominal.map_or(f64::NAN, |trial| trial.outcome.farthest)),
                ("success", ladder.success().unwrap_or(f64::NAN)),
            ],
        }
    }

    fn from_verdict(grasp: &Grasp) -> Self {
        Self { held: grasp.verdict == GraspVerdict::Kept, numbers: Vec::new() }
    }
}

/// Labels of the tried grasps of a sample by rank.
type RankedLabels = Vec<(u32, Label)>;

/// Tried grasps of a sample by rank with their labels, and friction and mass [kg] of their trials.
fn tried_grasps(sample: &Sample, source: LabelSource) -> Result<(RankedLabels, [f64; 2]), ExportError> {
    if let LabelSource::Ladder = source {
        let stored = sample.find::<GraspLadders>()?.ok_or(ExportError::NoTrials)?;
        let labels = stored.ladders.iter().map(|ladder| (ladder.grasp, Label::from_ladder(ladder)));
        return Ok((labels.collect(), [stored.method.friction, stored.method.mass]));
    }
    let stored = sample.find::<GraspTrials>()?.ok_or(ExportError::NoTrials)?;
    let labels = stored.trials.iter().map(|trial| (trial.grasp, Label::from_trial(trial)));
    Ok((labels.collect(), [stored.method.friction, stored.method.mass]))
}

/// Grasps of an object with their labels, column by column.
struct LabelledGrasps {
    source: LabelSource,
    hand: String,
    /// Driven joint of the pregrasp.
    opening: Vec<f64>,
    /// Conditions of the trials, if there are any: friction and mass [kg].
    conditions: Option<[f64; 2]>,
    /// Coefficient of friction of the quality measure.
    friction: f64,
    /// Pose of each grasp, 4 x 4, row-major.
    transforms: Vec<f64>,
    in_gripper: Vec<i64>,
    /// Item of the run, and rank in it.
    names: [Vec<i64>; 2],
    qualities: BTreeMap<&'static str, Vec<f64>>,
}

impl LabelledGrasps {
    /// Grasps of an object: those that were tried, or all if the labels are verdicts; `None` without grasps.
    fn read(
        reader: &DatasetReader,
        hand: &HandShape,
        samples: &[SampleIndex],
        source: LabelSource,
    ) -> Result<Option<Self>, ExportError> {
        let mut found: Option<Self> = None;
        for index in samples {
            let Some(sample) = reader.sample(*index)? else { continue };
            let run = sample.read::<GraspRun>()?;
            let (labelled, conditions) = match source {
                LabelSource::Verdict => ((0..).zip(run.grasps.iter().map(Label::from_verdict)).collect(), None),
                _ => tried_grasps(&sample, source).map(|(labelled, conditions)| (labelled, Some(conditions)))?,
            };
            for (rank, label) in labelled {
                let Some(grasp) = run.grasps.get(rank as usize) else { continue };
                let base_from_gripper = base_from_gripper(hand, &run, grasp)
                    .ok_or_else(|| ExportError::NoParallelGripper { hand: hand.name.clone() })?;
                let grasps = found.get_or_insert_with(|| Self::none_yet(&run, grasp, source, conditions));
                grasps.push((sample.id.item.0, rank), grasp, &label, &base_from_gripper);
            }
        }
        Ok(found)
    }

    fn none_yet(run: &GraspRun, grasp: &Grasp, source: LabelSource, conditions: Option<[f64; 2]>) -> Self {
        Self {
            source,
            hand: run.hand.name.clone(),
            opening: grasp.opening.clone(),
            conditions,
            friction: run.method.friction,
            transforms: Vec::new(),
            in_gripper: Vec::new(),
            names: [Vec::new(), Vec::new()],
            qualities: BTreeMap::new(),
        }
    }

    fn push(
        &mut self,
        (item, rank): (u32, u32),
        grasp: &Grasp,
        label: &Label,
        base_from_gripper: &IsometryMatrix3<f64>,
    ) {
        let object_from_gripper = grasp.object_from_base.isometry() * base_from_gripper;
        self.transforms.extend(Pose::<Object, HandBase>::from_isometry(object_from_gripper).to_rows());
        self.transforms.extend([0.0, 0.0, 0.0, 1.0]);
        self.in_gripper.push(label.held.into());
        self.names[0].push(item.into());
        self.names[1].push(rank.into());
        let numbers = [
            ("energy", grasp.energy),
            ("epsilon_force", grasp.epsilon_force),
            ("epsilon_wrench", grasp.epsilon_wrench),
            ("volume", grasp.volume),
            ("width", grasp.width.unwrap_or(f64::NAN)),
        ];
        for (name, value) in numbers.into_iter().chain(label.numbers.iter().copied()) {
            self.qualities.entry(name).or_default().push(value);
        }
    }

    /// The file of the object.
    fn file(&self, row: &AssetRow, name: &str, solid: &MassProperties) -> FileBuilder {
        let count = self.in_gripper.len() as u64;
        let mut file = FileBuilder::new();
        let mut grasps = file.create_group("grasps");
        grasps.create_dataset("transforms").with_f64_data(&self.transforms).with_shape(&[count, 4, 4]);
        let mut qualities = grasps.create_group("qualities");
        let mut labels = qualities.create_group("flex");
        labels
            .create_dataset("object_in_gripper")
            .with_i64_data(&self.in_gripper)
            .set_attr("from", AttrValue::String(self.source.name().to_owned()));
        qualities.add_group(labels.finish());
        let mut own = qualities.create_group("graspmill");
        for (name, numbers) in ["item", "rank"].iter().zip(&self.names) {
            own.create_dataset(name).with_i64_data(numbers);
        }
        for (name, numbers) in &self.qualities {
            own.create_dataset(name).with_f64_data(numbers);
        }
        qualities.add_group(own.finish());
        grasps.add_group(qualities.finish());
        file.add_group(grasps.finish());

        let mut object = file.create_group("object");
        text(&mut object, "file", &format!("meshes/{name}.obj"));
        text(&mut object, "name", &row.name);
        text(&mut object, "id", &row.object.to_string());
        number(&mut object, "scale", 1.0);
        number(&mut object, "volume", solid.volume);
        let centre: [f64; 3] = solid.centre.coords.into();
        object.create_dataset("com").with_f64_data(&centre);
        // An object without trials has no mass.
        if let Some([_, mass]) = self.conditions {
            number(&mut object, "mass", mass);
            number(&mut object, "density", mass / solid.volume);
            let inertia: Matrix3<f64> = mass * solid.inertia;
            object.create_dataset("inertia").with_f64_data(inertia.as_slice()).with_shape(&[3, 3]);
        }
        number(&mut object, "friction", self.conditions.map_or(self.friction, |[friction, _]| friction));
        file.add_group(object.finish());

        let mut gripper = file.create_group("gripper");
        text(&mut gripper, "type", &self.hand);
        gripper.create_dataset("configuration").with_f64_data(&self.opening);
        file.add_group(gripper.finish());
        file
    }
}

/// Adds a single number.
fn number(group: &mut GroupBuilder, name: &str, value: f64) {
    group.create_dataset(name).with_f64_data(&[value]).with_shape(&[]);
}

/// Adds a single text.
fn text(group: &mut GroupBuilder, name: &str, value: &str) {
    group.create_dataset(name).with_vlen_strings(&[value]).with_shape(&[]);
}

/// ACRONYM's frame of a parallel-jaw gripper, expressed in its base frame: the same origin, z along the approach, x along the
/// closing line of the pads. `None` unless the hand is one motor that slides pads of the base along one line at right angles to
/// the approach.
fn base_from_gripper(hand: &HandShape, run: &GraspRun, grasp: &Grasp) -> Option<IsometryMatrix3<f64>> {
    let axes: Vec<Vector3<f64>> = (hand.joints.iter())
        .map(|joint| (joint.slides && joint.carried_by == 0).then(|| joint.link_from_joint.rotation * *joint.axis))
        .collect::<Option<_>>()?;
    let base_from_approach = grasp.object_from_base.isometry().inverse() * grasp.object_from_approach.isometry();
    let approach = base_from_approach.rotation * Vector3::z();
    let (closing, others) = axes.split_first()?;
    let is_parallel = run.hand.driven.len() == 1
        && others.iter().all(|axis| axis.cross(closing).norm() < TOLERANCE)
        && closing.dot(&approach).abs() < TOLERANCE;
    let rotation = Matrix3::from_columns(&[*closing, approach.cross(closing), approach]);
    let gripper = IsometryMatrix3::from_parts(Translation3::identity(), Rotation3::from_matrix_unchecked(rotation));
    is_parallel.then_some(gripper)
}
