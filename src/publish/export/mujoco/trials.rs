//! Trials of grasps as models of plain MuJoCo.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::{
    super::{
        error::ExportError,
        form::{ExportForm, ExportSelection, Written},
        names::object_folders,
        object_mesh::{mass_properties, write_touched_mesh},
        objects::{OBJECT, wanted_objects},
        target::Target,
    },
    parts::{CONTACT, inertial},
};
use format::{
    Channel, GraspLadder, GraspLadders, GraspRun, GraspTrial, GraspTrials, LadderLevel, Noun, Product,
    dataset::{AssetRow, DatasetReader, Sample},
    extras::Shapes,
};
use kernel::{
    geom::{MassProperties, TriMesh},
    ids::{ObjectId, SampleIndex},
};

/// Script that runs the trials again; it requires only MuJoCo and NumPy.
const REPLAY: &str = include_str!("replay_trials.py");

/// `<object>/scene.xml` and `grasps.json` of a dataset of tried grasps, by either method of labels, with `hand.xml`, `drive.json` and
/// `replay.py`, which repeats the trials in plain MuJoCo.
pub(super) const FORM: ExportForm = ExportForm {
    product: Product::GRASPS,
    counted: Noun { one: "grasp", many: "grasps" },
    keys: &[],
    layout: |_| {
        "hand.xml: the hand with a servo for each joint; drive.json: the actuation, and the phases of a trial; \
         <object>/scene.xml, scene_sdf.xml: that hand and the object for MuJoCo 3.17, by triangles and by distances; \
         <object>/grasps.json: postures, object_from_base (3, 4) row-major [m], the same for the pregrasp with its driven joints, and the stored outcome (of graded labels that at the level nominal, with success and label); replay.py repeats the trials and writes agreement.json"
    },
    write,
};

/// A tried grasp: its sample, and its index among the tried grasps of the sample.
type TriedGrasp = (SampleIndex, usize);

/// Gravity of trials that become graded labels: all of them lift and shake.
const LIFTED: &str = "lifted";

/// Tried grasps of a sample.
enum Tried {
    Agreement(GraspTrials),
    Ladder(GraspLadders),
}

/// Conditions that all trials of an object share: at the level `nominal` of graded labels.
struct Conditions {
    friction: f64,
    torsion: f64,
    mass: f64,
    mass_from: String,
    gravity: String,
}

impl Tried {
    fn read(sample: &Sample) -> Result<Self, ExportError> {
        if let Some(trials) = sample.find::<GraspTrials>()? {
            return Ok(Self::Agreement(trials));
        }
        sample.find::<GraspLadders>()?.map(Self::Ladder).ok_or(ExportError::NoTrials)
    }

    fn len(&self) -> usize {
        match self {
            Self::Agreement(trials) => trials.trials.len(),
            Self::Ladder(ladders) => ladders.ladders.len(),
        }
    }

    fn conditions(&self) -> Conditions {
        match self {
            Self::Agreement(GraspTrials { method, .. }) => Conditions {
                friction: method.friction,
                torsion: method.torsion,
                mass: method.mass,
                mass_from: method.mass_from.clone(),
                gravity: method.gravity.clone(),
            },
            Self::Ladder(GraspLadders { method, .. }) => Conditions {
                friction: method.friction,
                torsion: method.torsion,
                mass: method.mass,
                mass_from: method.mass_from.clone(),
                gravity: LIFTED.to_owned(),
            },
        }
    }

    /// Resting pose whose table carried the object in the trials; `None` in the air.
    fn resting_pose(&self, tried: usize) -> Option<usize> {
        match self {
            Self::Agreement(_) => None,
            Self::Ladder(ladders) => ladders.ladders[tried].resting_pose.map(|pose| pose as usize),
        }
    }

    /// Index of a tried grasp in its run, and its stored outcome.
    fn expected(&self, tried: usize) -> (u32, Value) {
        match self {
            Self::Agreement(trials) => (trials.trials[tried].grasp, expected_of_trial(&trials.trials[tried])),
            Self::Ladder(ladders) => (ladders.ladders[tried].grasp, expected_of_ladder(&ladders.ladders[tried])),
        }
    }
}

fn expected_of_trial(trial: &GraspTrial) -> Value {
    json!({
        "verdict": trial.outcome.verdict.name(),
        "label": trial.label().name(),
        "time": trial.outcome.time,
        "closing_time": trial.outcome.closing_time,
        "farthest": trial.outcome.farthest,
        "perturbed": trial.perturbed.iter().map(|run| run.outcome.verdict.name()).collect::<Vec<_>>(),
        "closed_joints": trial.closed.as_ref().map(|closed| &closed.joints),
    })
}

/// The outcome at the level `nominal`; a blocked grasp has no trial, and the verdict `blocked`.
fn expected_of_ladder(ladder: &GraspLadder) -> Value {
    let nominal = ladder.level(LadderLevel::Nominal).and_then(|level| level.trial()).map(|trial| &trial.outcome);
    json!({
        "verdict": nominal.map_or("blocked", |outcome| outcome.verdict.name()),
        "label": ladder.label().name(),
        "success": ladder.success(),
        "resting_pose": ladder.resting_pose,
        "time": nominal.map(|outcome| outcome.time),
        "closing_time": nominal.map(|outcome| outcome.closing_time),
        "farthest": nominal.map(|outcome| outcome.farthest),
        "perturbed": [],
        "closed_joints": ladder.closed.as_ref().map(|closed| &closed.joints),
    })
}

/// Writes `hand.xml`, `drive.json`, `replay.py`, and a folder per object with `object.obj`, `scene.xml`, `scene_sdf.xml` and
/// `grasps.json`.
fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let channels = reader.manifest().channels();
    if ![Channel::GRASP_TRIALS, Channel::GRASP_LADDERS].iter().any(|channel| channels.contains(channel)) {
        return Err(ExportError::NoTrials);
    }
    let shapes = Shapes::open(reader.folder())?;
    let hand = shapes.trial_hand()?.ok_or(ExportError::NoPlainHand)?;
    let assets = reader.assets()?.objects;
    let chosen = chosen(reader, &assets, selection)?;
    target.write("hand.xml", hand.mjcf.as_bytes())?;
    target.write("drive.json", hand.drive.as_bytes())?;
    target.write("replay.py", REPLAY.as_bytes())?;
    let (folders, mut grasps) = (object_folders(&assets), 0);
    for (index, row) in assets.iter().enumerate() {
        if let Some(tried) = chosen.get(&row.object) {
            let mesh = shapes.object(index)?.mesh;
            let folder = folders.get(&row.object).map_or("object", String::as_str);
            object(reader, row, &mesh, tried, (folder, &mut *target))?;
            grasps += tried.len() as u64;
        }
    }
    Ok(Written::selection(grasps, "grasps", selection))
}

/// Tried grasps by object: the whole selection, or the requested number spread evenly over it.
fn chosen(
    reader: &DatasetReader,
    assets: &[AssetRow],
    selection: &ExportSelection,
) -> Result<BTreeMap<ObjectId, Vec<TriedGrasp>>, ExportError> {
    let wanted = wanted_objects(assets, &selection.objects, OBJECT)?;
    let mut all = Vec::new();
    for sample in reader.iter(selection.samples) {
        let sample = sample?;
        if wanted.is_empty() || wanted.contains(&sample.id.subject) {
            let tried = Tried::read(&sample)?.len();
            all.extend((0..tried).map(|tried| (sample.id.subject, (sample.index, tried))));
        }
    }
    if all.is_empty() {
        return Err(ExportError::NothingSelected { kept: reader.manifest().counts.kept });
    }
    let count = selection.limit.map_or(all.len(), |limit| usize::try_from(limit).unwrap_or(usize::MAX).min(all.len()));
    let mut chosen = BTreeMap::<_, Vec<_>>::new();
    for index in 0..count {
        let (object, tried) = all[(index as u128 * all.len() as u128 / count as u128) as usize];
        chosen.entry(object).or_default().push(tried);
    }
    Ok(chosen)
}

/// One object's folder.
fn object(
    reader: &DatasetReader,
    row: &AssetRow,
    mesh: &TriMesh,
    tried: &[TriedGrasp],
    (folder, target): (&str, &mut Target),
) -> Result<(), ExportError> {
    let unit = mass_properties(row, mesh)?;
    let (mut grasps, mut conditions) = (Vec::new(), None);
    for (index, tried) in tried {
        let sample = reader.sample(*index)?.ok_or(ExportError::NoTrials)?;
        let (run, stored) = (sample.read::<GraspRun>()?, Tried::read(&sample)?);
        let (rank, expected) = stored.expected(*tried);
        let (grasp, pose) = (&run.grasps[rank as usize], stored.resting_pose(*tried));
        grasps.push(json!({
            "item": sample.id.item.0,
            "grasp": rank,
            "posture": grasp.posture,
            "object_from_base": grasp.object_from_base.to_rows(),
            "opening": grasp.opening,
            "object_from_base_pregrasp": grasp.object_from_base_back(run.method.stand_off).to_rows(),
            "pregrasp": grasp.pregrasp(pose),
            "free_ways": grasp.free_ways(pose).name(),
            "expected": expected,
        }));
        conditions = Some(stored.conditions());
    }
    let Some(conditions) = conditions else { return Ok(()) };
    let facts = json!({
        "name": row.name,
        "object": row.object.to_string(),
        "mass": conditions.mass,
        "mass_from": conditions.mass_from,
        "friction": conditions.friction,
        "torsion": conditions.torsion,
        "gravity": conditions.gravity,
        "grasps": grasps,
    });
    target.write_json(&format!("{folder}/grasps.json"), &facts)?;
    write_touched_mesh(target, &format!("{folder}/object.obj"), mesh)?;
    let [triangles, distances] = scenes(&conditions, &unit);
    target.write(&format!("{folder}/scene.xml"), triangles.as_bytes())?;
    target.write(&format!("{folder}/scene_sdf.xml"), distances.as_bytes())
}

/// The object with the hand, touched by its triangles and by distances; `unit` is of a kilogram. Small objects have thousands of
/// triangles near a hand, so MuJoCo's default memory would be too small for the contacts.
fn scenes(conditions: &Conditions, unit: &MassProperties) -> [String; 2] {
    let body = |assets: &str, geometry: &str| {
        format!(
            concat!(
                "<mujoco model=\"trials\">\n  <include file=\"../hand.xml\"/>\n  <size memory=\"256M\"/>\n{}  <worldbody>\n    <body name=\"object\">\n",
                "      <freejoint name=\"object\"/>\n",
                "      {}\n{}",
                "    </body>\n  </worldbody>\n</mujoco>\n"
            ),
            assets,
            inertial(conditions.mass, unit),
            geometry
        )
    };
    // The object's friction counts for all contacts.
    let contact = format!(
        "priority=\"1\" condim=\"{}\" friction=\"{} {} 0.0001\" {CONTACT}",
        if conditions.torsion > 0.0 { 4 } else { 3 },
        conditions.friction,
        conditions.friction * conditions.torsion,
    );
    let triangles = format!(
        concat!(
            "      <flexcomp name=\"object\" type=\"mesh\" file=\"object.obj\" dim=\"2\" rigid=\"true\" radius=\"0.00001\" ",
            "rgba=\"0.8 0.6 0.3 1\">\n        <contact {} selfcollide=\"none\"/>\n      </flexcomp>\n"
        ),
        contact
    );
    let asset = "  <asset>\n    <mesh name=\"object\" file=\"object.obj\" inertia=\"shell\"/>\n  </asset>\n";
    let distances = format!("      <geom type=\"sdf\" mesh=\"object\" mass=\"0\" {contact}/>\n");
    [body("", &triangles), body(asset, &distances)]
}
