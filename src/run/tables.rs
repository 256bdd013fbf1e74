//! What a dataset's tables say of a job: plain data, since the dataset knows no job.

use std::{collections::BTreeMap, path::Path};

use serde_json::Value;

#[cfg(feature = "sim")]
use crate::sim::{gl_facts, sim_facts};
use crate::{
    assets::MeshRefusal,
    dataset::{DatasetHeader, NumberClass, ObjectSplit, ProductTables, Split, SplitTable as StoredSplits, TypeCounts},
    geom::{RestingPose, RestingPoses},
    ids::{Digest, ObjectId, ViewId},
    job::{
        Collisions, Completion, Divided, FoundGrasps, Job, JobHand, JobObject, ObjectSide, ReachabilityJob, Renderer,
        TypeChoice, Work,
    },
    plan::{LeakReport, ModelRole, SampleRole, Sides, SplitTable},
    produce::completion::channels_of,
    record::{Channel, FieldHeader},
};

/// The tables of the dataset that `job` makes in `folder`; `sides` are those of a job about objects.
pub fn dataset_header(job: &Job, sides: Option<&Sides>, folder: &Path) -> DatasetHeader {
    let mut warnings = job.notes.clone();
    let (mut hands, mut channel_classes) = (Vec::new(), BTreeMap::new());
    let (class, platform, assets, tables) = match &job.work {
        Work::Completion(work) => {
            let class = match work.settings.renderer {
                Renderer::Raster => NumberClass::Exact,
                Renderer::MujocoRay => NumberClass::Physics,
                Renderer::MujocoGl => NumberClass::Colour,
            };
            if let Some(touch) = &work.settings.touch.by_hand {
                hands.push(hand_row(&touch.hand));
                // Contacts are placed on the grid of the pair: they are no more equal than that is.
                let of_hands = class.max(NumberClass::Physics);
                let channels = channels_of(&work.settings).into_iter().filter(|channel| channel.is_touch_by_hand());
                channel_classes.extend(channels.map(|channel| (channel, of_hands)));
            }
            let assets = work.objects.iter().map(|object| json(&object.asset)).collect();
            let splits = sides.map(|sides| stored_splits(&work.divided(), &sides.splits)).unwrap_or_default();
            add_warnings(&work.objects, &work.refused, sides, &mut warnings);
            (class, platform(&work.settings), assets, ProductTables::Completion { splits })
        }
        Work::Grasps(work) => {
            hands.push(hand_row(&work.hand));
            let assets = work.objects.iter().map(|object| json(&object.asset)).collect();
            let splits = sides.map(|sides| stored_splits(&work.divided(), &sides.splits)).unwrap_or_default();
            add_warnings(&work.objects, &work.refused, sides, &mut warnings);
            let platform = match work.settings.physics {
                Some(_) => {
                    channel_classes.insert(Channel::GraspTrials, NumberClass::Physics);
                    physics()
                }
                None => BTreeMap::new(),
            };
            (NumberClass::Exact, platform, assets, ProductTables::Grasps { splits })
        }
        Work::Patches(work) => {
            hands.push(hand_row(&work.hand));
            let assets = work.grasps.objects.iter().map(|object| object.asset.clone()).collect();
            let TypeChoice { counts, without, chosen } = work.grasps.types.clone();
            let types = TypeCounts { counts, without, chosen };
            let splits = splits_of_grasps(&work.grasps);
            let mut platform = BTreeMap::new();
            if work.settings.colour.is_some() {
                channel_classes.insert(Channel::PatchColour, NumberClass::Colour);
                if work.settings.image {
                    channel_classes.insert(Channel::PatchImageColour, NumberClass::Colour);
                }
                platform = colour_platform();
            }
            (NumberClass::Exact, platform, assets, ProductTables::Patches { splits, types })
        }
        Work::Reachability(work) => {
            let field = Box::new(field_header(work));
            let (class, platform) = match work.collisions {
                Collisions::Exact | Collisions::None => (NumberClass::Exact, BTreeMap::new()),
                Collisions::Mujoco => (NumberClass::Physics, physics()),
            };
            (class, platform, vec![robot_row(work)], ProductTables::Reachability { field })
        }
    };
    DatasetHeader {
        generator: concat!("graspmill ", env!("CARGO_PKG_VERSION")).to_owned(),
        job: job.digest(),
        job_text: job.to_toml(folder),
        class,
        channel_classes,
        platform,
        assets,
        hands,
        refused: job.refused().iter().map(json).collect(),
        tables,
        warnings,
    }
}

/// Says in an object's row of the asset table how it rests on a table.
pub(super) fn add_resting(row: &mut Value, resting: &BTreeMap<ObjectId, RestingPoses>) {
    let object = row["object"].as_str().and_then(Digest::from_hex).map(ObjectId);
    let Some(RestingPoses { poses, left_out }) = object.and_then(|object| resting.get(&object)) else { return };
    let pose = |pose: &RestingPose| {
        serde_json::json!({
            "world_from_object": pose.world_from_object.to_rows(),
            "probability": pose.probability,
            "height": pose.height,
        })
    };
    row["resting"] = poses.iter().map(pose).collect();
    row["resting_left_out"] = (*left_out).into();
}

/// A hand as a row of the asset table.
fn hand_row(hand: &JobHand) -> Value {
    serde_json::json!({ "object": hand.id, "name": hand.name })
}

/// The robot as a row of the asset table.
fn robot_row(job: &ReachabilityJob) -> Value {
    let robot = &job.robot;
    serde_json::json!({
        "object": robot.id,
        "name": robot.name,
        "joints": robot.joints,
        "target": robot.target,
        "fixed": robot.fixed,
    })
}

fn field_header(job: &ReachabilityJob) -> FieldHeader {
    FieldHeader {
        grid: job.poses.clone(),
        metric: job.metric,
        robot: job.robot.name.clone(),
        robot_id: job.robot.id,
        joints: job.robot.joints.clone(),
        target: job.robot.target.clone(),
        frame: job.robot.frame.clone(),
    }
}

/// What numbers of MuJoCo's depend on, and whose verdict it is.
#[cfg(feature = "sim")]
fn physics() -> BTreeMap<String, String> {
    let facts = sim_facts();
    let mut platform = facts.platform(None);
    platform.insert("mujoco".to_owned(), facts.version);
    platform
}

/// What colours depend on.
#[cfg(feature = "sim")]
fn colour_platform() -> BTreeMap<String, String> {
    sim_facts().platform(gl_facts().ok().as_ref())
}

/// Such a job is refused before it is run.
#[cfg(not(feature = "sim"))]
fn colour_platform() -> BTreeMap<String, String> {
    BTreeMap::new()
}

/// Such a job is refused before it is run.
#[cfg(not(feature = "sim"))]
fn physics() -> BTreeMap<String, String> {
    BTreeMap::new()
}

/// What the numbers depend on beside our own code; empty for class `exact`.
fn platform(settings: &Completion) -> BTreeMap<String, String> {
    match settings.renderer {
        Renderer::Raster if settings.touch.by_hand.is_none() => BTreeMap::new(),
        #[cfg(feature = "sim")]
        Renderer::Raster | Renderer::MujocoRay => sim_facts().platform(None),
        #[cfg(feature = "sim")]
        Renderer::MujocoGl => sim_facts().platform(gl_facts().ok().as_ref()),
        // Such a job is refused before it is run.
        #[cfg(not(feature = "sim"))]
        _ => BTreeMap::new(),
    }
}

fn json(value: &impl serde::Serialize) -> Value {
    serde_json::to_value(value).expect("tables are plain data with string keys")
}

fn stored_splits(job: &Divided<'_>, splits: &SplitTable) -> StoredSplits {
    let views = job.views();
    let objects = job.objects.iter().enumerate().map(|(place, object)| {
        let models = match splits.models[place] {
            ModelRole::Training => Split::Training,
            ModelRole::Validation => Split::ValidationModels,
            ModelRole::Test => Split::TestModels,
        };
        let held_out = |view: &u32| splits.role(place, ViewId(*view)) == SampleRole::HoldoutView;
        ObjectSplit {
            object: object.id(),
            models,
            holdout_views: (0..views).filter(held_out).collect(),
            subset: splits.subsets.iter().position(|subset| subset.contains(&place)).map(|subset| subset as u32),
        }
    });
    let mut objects: Vec<_> = objects.collect();
    objects.sort_by_key(|row| row.object);
    let training_subsets = splits.subsets.iter().map(|subset| subset.len() as u32).collect();
    StoredSplits { training_subsets, objects }
}

/// The sides of the grasps, their held out runs turned into held out patches.
fn splits_of_grasps(grasps: &FoundGrasps) -> StoredSplits {
    let objects = grasps.objects.iter().map(|object| ObjectSplit {
        object: object.id,
        models: match object.side {
            ObjectSide::Training => Split::Training,
            ObjectSide::Validation => Split::ValidationModels,
            ObjectSide::Test => Split::TestModels,
        },
        holdout_views: (0..)
            .zip(&object.grasps)
            .filter_map(|(view, grasp)| object.holdout_runs.contains(&grasp.run).then_some(view))
            .collect(),
        subset: object.subset,
    });
    StoredSplits { training_subsets: grasps.training_subsets.clone(), objects: objects.collect() }
}

/// Things a user should know, in words; numbers only from the job and its meshes.
fn add_warnings(objects: &[JobObject], refused: &[MeshRefusal], sides: Option<&Sides>, warnings: &mut Vec<String>) {
    warnings.extend(refused.iter().map(|refusal| format!("refused: {refusal}")));
    for object in objects {
        let name = &object.source.name;
        warnings.extend(object.asset.warnings.iter().map(|warning| format!("{name}: {warning}")));
    }
    let Some(Sides { splits, leaks }) = sides else { return };
    warnings.extend(splits.notes.iter().cloned());
    add_leaks(leaks, warnings);
}

fn add_leaks(leaks: &LeakReport, warnings: &mut Vec<String>) {
    let mut leak = |count: u64, what: &str| {
        if count > 0 {
            warnings.push(format!("leak: {count} {what}"));
        }
    };
    leak(leaks.straddling_views, "holdout views have the rotation of a training view of the same object");
    leak(leaks.objects_straddling.into(), "objects stand on more than one side of the split");
    leak(leaks.geometries_straddling.into(), "geometries stand on more than one side of the split");
    leak(leaks.twin_groups_straddling.into(), "groups of objects of the same shape stand on more than one side");
}
