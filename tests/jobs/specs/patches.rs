//! Jobs for patches: defaults of both profiles, mistakes with their locations, and digests.

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use graspmill::{
    description::Description,
    factory::{
        job::{Job, JobDraft},
        plan::Plan,
        products::patches::{GraspTrialEnd, PatchJob, PatchLabel},
    },
    files::Folder,
    form::FormErrors,
    format::{
        Channel, Grasp, GraspLabel, GraspMethod, GraspRun, GraspTrial, GraspTrials, HandNames, Product, RunInterval,
        TrialMethod, TrialOutcome, TrialVerdict, TriedStates, WRENCH,
        dataset::{DatasetHeader, Manifest, RunMark, ShardHeader, ShardWriter, begin_run, finish_dataset},
        products::grasps::SHAPES,
    },
    geom::{Object, Pose, World},
    ids::{Digest, ItemId, JobDigest, ObjectId, SampleId, SampleIndex, ShardId},
    tables::ParquetIndex,
    words::{BothWays, GraspVerdict, NumberClass, ObjectSplit, STRETCHES, Split, SplitTable},
};

use super::{items, read, tables, work_of};
use crate::support::{files::repository_path, robots, workspace::Workspace};

const BARRETT: &str = "../scenes/barrett_bh8_280.xml";

fn hand() -> ObjectId {
    ObjectId(Description::of_hand(&repository_path(robots::BARRETT)).expect("the Barrett hand").digest)
}

/// A dataset of made-up grasps of three objects, the second without any of the two most common types: five runs each.
#[derive(Clone, Copy)]
struct MadeUpGrasps {
    energy: f64,
    first_split: Split,
    with_types: bool,
    /// Verdict of the trials of all states; `None` without trials.
    trials: Option<TrialVerdict>,
    hand: ObjectId,
}

/// Number of an object, run, rank and type of each kept grasp.
const KEPT: [(u8, u32, usize, Option<u32>); 7] = [
    (1, 0, 1, Some(12)),
    (1, 4, 0, Some(40)),
    (1, 4, 2, Some(12)),
    (2, 0, 0, Some(99)),
    (2, 0, 1, None),
    (3, 1, 0, Some(12)),
    (3, 4, 0, Some(40)),
];
const RUNS: u32 = 5;

impl MadeUpGrasps {
    fn new() -> Self {
        Self {
            energy: 1.0,
            first_split: Split::Training,
            with_types: true,
            trials: Some(TrialVerdict::Held),
            hand: hand(),
        }
    }

    fn grasp(&self, verdict: GraspVerdict, kind: Option<u32>) -> Grasp {
        Grasp {
            object_from_approach: Pose::identity(),
            object_from_base: Pose::identity(),
            opening: vec![0.0],
            posture: vec![0.0],
            amplitudes: vec![0.0],
            joints_before: vec![0.0],
            joints: vec![0.0],
            advance: 0.0,
            shift: None,
            turn: None,
            penetration: 0.0,
            energy: self.energy,
            contact_energy: self.energy,
            potential: 1.0,
            contacts: Vec::new(),
            epsilon_force: 0.1,
            epsilon_wrench: 0.1,
            volume: 0.1,
            kind: kind.filter(|_| self.with_types),
            width: None,
            verdict,
            clearances: vec![[0.1, 0.1]],
            object_in_way: Some(BothWays::default()),
            point_scheme: None,
        }
    }

    fn run(&self, object: u8, run: u32) -> GraspRun {
        let kept = KEPT.into_iter().filter(|(of, number, ..)| (*of, *number) == (object, run));
        let mut grasps = Vec::new();
        for (_, _, rank, kind) in kept {
            grasps.resize(rank, self.grasp(GraspVerdict::LowQuality, Some(12)));
            grasps.push(self.grasp(GraspVerdict::Kept, kind));
        }
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        GraspRun {
            sample: SampleId::of_object(ObjectId(Digest([object; 32])), ItemId(run)),
            hand: HandNames {
                name: "hand".to_owned(),
                id: self.hand,
                links: names(&["palm", "finger"]),
                joints: names(&["hinge"]),
                driven: names(&["hinge"]),
            },
            object_from_seed: Pose::identity(),
            asked_steps: 10,
            steps: 10,
            failed: 0,
            tries: 10,
            potentials: 10,
            course: [RunInterval::default(); STRETCHES],
            method: GraspMethod {
                sampler: "annealing".to_owned(),
                energy: "contact".to_owned(),
                energy_space: WRENCH.to_owned(),
                energy_friction: 0.2,
                potential_scale: 100.0,
                contact_model: "hard_point".to_owned(),
                friction: 0.5,
                edges: 16,
                torsion: 0.0,
                space: WRENCH.to_owned(),
                min_epsilon: 0.01,
                max_penetration: 5e-4,
                max_advance: 0.03,
                stand_off: 0.1,
            },
            grasps,
            resting_poses: 1,
            budget_spent: false,
        }
    }

    /// Trials of all states of a run.
    fn trials(&self, run: &GraspRun, verdict: TrialVerdict) -> GraspTrials {
        let outcome = TrialOutcome {
            verdict,
            time: 1.0,
            closing_time: 0.5,
            closed_at_rest: true,
            penetration: [0.0; 3],
            farthest: 0.0,
            slips: Vec::new(),
            force: 1.0,
            links: 2,
            opened_by: 0.0,
            drawn_back: 0.0,
            warnings: 0,
        };
        let trial = |grasp: usize| GraspTrial {
            grasp: grasp as u32,
            outcome: outcome.clone(),
            closed: None,
            perturbed: Vec::new(),
            roll_outs: [0; 2],
            variants: Vec::new(),
            table: None,
            confirmed: Vec::new(),
            is_unconfirmed: false,
            series: None,
        };
        GraspTrials {
            sample: run.sample,
            hand: run.hand.name.clone(),
            links: run.hand.links.clone(),
            joints: 1,
            method: TrialMethod {
                friction: 0.5,
                torsion: 0.0,
                mass: 0.1,
                mass_from: "hull".to_owned(),
                mass_source: String::new(),
                gravity: "lifted".to_owned(),
                spreads: [0.0; 4],
                tried: TriedStates::Closed,
                variants: Vec::new(),
                table_friction: None,
                confirm_held: Vec::new(),
                confirm_failed: Vec::new(),
                failed_per_held: None,
                series_interval: None,
            },
            trials: (0..run.grasps.len()).map(trial).collect(),
        }
    }

    fn write(&self, folder: &Path) {
        let job = JobDigest(Digest::hash(b"made-up grasps"));
        let samples = u64::from(3 * RUNS);
        let mark = RunMark::new(Product::GRASPS, job, samples, 1, 3 * RUNS);
        begin_run(&Folder::at(folder), &mark).expect("a folder");
        let header = ShardHeader {
            product: Product::GRASPS,
            job,
            shard: ShardId(0),
            shards: 1,
            samples: 0..samples,
            channels: [Channel::GRASP_RUN].into_iter().chain(self.trials.map(|_| Channel::GRASP_TRIALS)).collect(),
        };
        let mut writer = ShardWriter::create(&Folder::at(folder.join("shards")), &header).expect("a shard");
        let all = (1..=3).flat_map(|object| (0..RUNS).map(move |run| (object, run)));
        for (index, (object, run)) in (0..).map(SampleIndex).zip(all) {
            let (run, mut payload) = (self.run(object, run), Vec::new());
            run.encode(&mut payload);
            writer.write(index, &run.sample, Channel::GRASP_RUN, &payload).expect("written");
            let mut facts = run.facts();
            if let Some(verdict) = self.trials {
                let trials = self.trials(&run, verdict);
                payload.clear();
                trials.encode(&mut payload);
                writer.write(index, &run.sample, Channel::GRASP_TRIALS, &payload).expect("written");
                facts.trials = trials.facts();
            }
            writer.keep(index, &run.sample, facts).expect("kept");
        }
        writer.finish().expect("a shard");
        // Nothing that is tested here reads shapes.
        std::fs::write(folder.join(SHAPES), "").expect("a file");
        let splits = [self.first_split, Split::Test, Split::Validation];
        let row = |(object, split): (u8, Split)| ObjectSplit {
            object: ObjectId(Digest([object; 32])),
            split,
            holdout_items: if split == Split::Training { vec![4] } else { Vec::new() },
            subset: None,
        };
        let upright = serde_json::json!({
            "world_from_object": Pose::<World, Object>::identity().to_rows(), "probability": 0.5, "height": 0.1
        });
        let asset = |object: u8| {
            let (id, name) = (ObjectId(Digest([object; 32])), format!("object {object}"));
            serde_json::json!({ "object": id, "name": name, "resting": [upright.clone()], "resting_left_out": 0 })
        };
        let header = DatasetHeader {
            product: Product::GRASPS,
            generator: "graspmill test".to_owned(),
            job,
            job_text: "seed = 1\n".to_owned(),
            class: NumberClass::Exact,
            channel_classes: self.trials.map(|_| (Channel::GRASP_TRIALS, NumberClass::Physics)).into_iter().collect(),
            platform: Default::default(),
            assets: (1..=3).map(asset).collect(),
            subjects: Vec::new(),
            hands: vec![serde_json::json!({ "object": self.hand, "name": "hand" })],
            containers: Vec::new(),
            refused: Vec::new(),
            splits: Some(SplitTable { training_subsets: Vec::new(), objects: (1..).zip(splits).map(row).collect() }),
            warnings: Vec::new(),
        };
        finish_dataset(&Folder::at(folder), &header, &ParquetIndex).expect("a dataset");
    }
}

/// The folder of [`MadeUpGrasps`], written once.
pub fn made_up_grasps() -> &'static Path {
    static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
        let workspace = Workspace::kept("made_up_grasps");
        MadeUpGrasps::new().write(workspace.folder());
        workspace.folder().to_owned()
    });
    &FOLDER
}

fn root_of(grasps: &Path) -> Digest {
    Manifest::read(&Folder::at(grasps)).expect("a dataset").classes[&NumberClass::Exact]
}

fn text(grasps: &Path) -> String {
    format!("product = \"patches\"\n[hand]\nmodel = \"{BARRETT}\"\n[grasps]\ndataset = {grasps:?}\n")
}

fn read_patches(overrides: &[&str]) -> Result<JobDraft, FormErrors> {
    read(&text(made_up_grasps()), overrides)
}

/// The job for the grasps in a folder.
fn job_of(grasps: &Path, overrides: &[&str]) -> Job {
    let draft = read(&text(grasps), overrides);
    draft.and_then(|draft| draft.resolve(Vec::new())).unwrap_or_else(|errors| panic!("{}", errors.render()))
}

fn job(overrides: &[&str]) -> Job {
    job_of(made_up_grasps(), overrides)
}

fn work(job: &Job) -> &PatchJob {
    work_of(job)
}

fn mistakes(overrides: &[&str]) -> String {
    read_patches(overrides).expect_err("a mistake").render()
}

#[test]
fn the_smallest_job_has_the_standard_defaults_and_the_thesis_its_own() {
    let standard = job(&["grasps.types=2"]);
    // All that was tried: a state of the first object that is not kept lies before a kept one in a run, another in the other.
    assert_eq!((standard.product(), items(&standard)), (Product::PATCHES, vec![5, 0, 2]));
    assert_eq!(standard.shard_samples, 200);
    let settings = &work(&standard).settings;
    assert_eq!((settings.side, settings.label, settings.distance), (72, PatchLabel::Trial, 1.0));
    assert_eq!((settings.metric, settings.visibility, settings.table), (Some(0.12), true, false));
    assert!(work(&standard).grasps.objects[0].grasps.iter().all(|grasp| settings.label_of(grasp) == -1.0));
    assert_eq!((settings.camera.width, settings.camera.height, settings.camera.near), (640, 480, 0.1));
    // The camera of the completion jobs.
    assert!((settings.camera.fx - 554.382_712_8).abs() < 1e-6 && settings.camera.fx == settings.camera.fy);
    assert_eq!(settings.tips, ["distal_1_outer", "distal_2_outer", "distal_3_outer"]);
    assert!(settings.colour.is_some_and(|colour| !colour.randomise));
    assert_eq!(work(&standard).grasps.types.chosen, [12, 40]);
    let plan = Plan::new(&standard.work.subjects(), standard.shard_samples);
    assert_eq!((plan.samples, plan.shards.len(), plan.units().count()), (7, 1, 2));
    let thesis = job(&["profile=thesis"]);
    assert_eq!(work(&thesis).settings.label, PatchLabel::Energy);
    let quirks = &work(&thesis).settings;
    assert_eq!((quirks.metric, quirks.visibility, quirks.table, quirks.distance), (None, false, false, 2.0));
    assert_eq!(items(&job(&["profile=thesis", "grasps.types=2"])), [3, 0, 2], "the kept ones");
    // On a table the roll is that against the camera over it, here of the second digit, -pi / 2.
    let on_table = job(&["grasps.types=2", "scene.table=true"]);
    assert_eq!(work(&on_table).grasps.types.chosen, [12 + 78_125, 40 + 78_125]);
    assert!(work(&on_table).grasps.objects[0].grasps.iter().all(|grasp| grasp.table.is_some()));
    assert!(work(&standard).grasps.objects[0].grasps.iter().all(|grasp| grasp.table.is_none()));
    // Without quirks the points are where the images show them.
    assert_eq!((settings.point_focal_length, settings.image, settings.heatmap_angle), (None, false, None));
    assert_eq!(work(&thesis).settings.point_focal_length, Some(589.366_454));
    assert_eq!(work(&job(&["images.heatmaps=true"])).settings.heatmap_angle, Some(0.349));
}

#[test]
fn the_tables_are_those_of_the_grasps() {
    let job = job(&["grasps.types=2", "render.colour=false", "patches.label=epsilon"]);
    let header = tables(&job);
    assert_eq!((header.class, header.channel_classes.len(), header.platform.len()), (NumberClass::Exact, 0, 0));
    assert_eq!((header.assets.len(), header.hands.len()), (3, 1));
    let (types, splits) = (&work(&job).grasps.types, header.splits.expect("splits"));
    assert_eq!((types.grasps(), types.covered(), types.without), (7, 5, 1));
    // Runs that were held out are patches that are.
    assert_eq!(splits.objects.iter().map(|row| row.holdout_items.clone()).collect::<Vec<_>>()[0], [1, 2]);
    assert_eq!(splits.objects[2].split, Split::Validation);
}

#[test]
fn what_names_a_job_is_what_its_samples_depend_on() {
    let first = job(&[]);
    for same in [["shards.samples=7"], ["name=another"]] {
        assert_eq!(job(&same).digest(), first.digest(), "{same:?}");
    }
    // The same grasps in another folder are the same grasps.
    let elsewhere = |grasps: MadeUpGrasps| {
        let workspace = Workspace::new();
        grasps.write(workspace.folder());
        job_of(workspace.folder(), &[]).digest()
    };
    assert_eq!(elsewhere(MadeUpGrasps::new()), first.digest());
    for other in [
        "seed=3",
        "grasps.types=2",
        "patches.side=64",
        "patches.label=energy",
        "patches.visibility=false",
        "patches.metric=false",
        "patches.size=0.1",
        "scene.table=true",
        "render.colour=false",
        "images.full=true",
        "images.heatmaps=true",
        "camera.point_focal_length=589.0",
    ] {
        assert_ne!(job(&[other]).digest(), first.digest(), "{other}");
    }
    assert_ne!(elsewhere(MadeUpGrasps { energy: 0.5, ..MadeUpGrasps::new() }), first.digest());
    assert_ne!(elsewhere(MadeUpGrasps { first_split: Split::Test, ..MadeUpGrasps::new() }), first.digest());
    // The resolved job reads back as itself, its grasps pinned.
    let resolved = first.to_toml(Path::new("jobs"));
    let root = root_of(made_up_grasps());
    assert!(resolved.contains("dataset = ") && resolved.contains(&root.hex()), "{resolved}");
    let again = read(&resolved, &[]).and_then(|draft| draft.resolve(Vec::new()));
    assert_eq!(again.unwrap_or_else(|errors| panic!("{}", errors.render())).digest(), first.digest());
}

/// Nothing that came after it enters the name of a job that does without: datasets of the profile `thesis` keep their bytes.
#[test]
fn a_job_of_the_thesis_is_named_as_ever() {
    let job = job(&["profile=thesis"]);
    let keys = job.work.sample_keys();
    let names =
        |section: &str| keys[section].as_table().expect("a section").keys().map(String::as_str).collect::<Vec<_>>();
    assert_eq!(keys.keys().collect::<Vec<_>>(), ["camera", "grasps", "hand", "images", "patches", "render"]);
    assert_eq!(names("grasps"), ["root", "types"]);
    assert_eq!(names("patches"), ["label", "side", "tips"]);
    assert_eq!(tables(&job).channel_classes.keys().copied().collect::<Vec<_>>(), [Channel::PATCH_COLOUR]);
    // The written job is complete.
    let written = job.to_toml(Path::new("jobs"));
    assert!(written.contains("metric = false") && written.contains("table = false"), "{written}");
}

#[test]
fn labels_by_trials_are_those_of_the_trials_that_the_job_pins() {
    let first = job(&[]);
    let root = |grasps: &Path| Manifest::read(&Folder::at(grasps)).expect("a dataset").classes[&NumberClass::Physics];
    let trials = root(made_up_grasps());
    assert_eq!(work(&first).grasps.trials, Some(trials));
    assert!(first.to_toml(Path::new("jobs")).contains(&format!("trials_root = \"{}\"", trials.hex())));
    assert_eq!(job(&[&format!("grasps.trials_root=\"{}\"", trials.hex())]).digest(), first.digest());
    // The same grasps with other trials are other labels; without labels by trials the same job.
    let elsewhere = |trials: Option<TrialVerdict>| {
        let workspace = Workspace::new();
        MadeUpGrasps { trials, ..MadeUpGrasps::new() }.write(workspace.folder());
        workspace
    };
    let lost = elsewhere(Some(TrialVerdict::LostShaking));
    let pinned = format!("grasps.trials_root=\"{}\"", trials.hex());
    let said = read(&text(lost.folder()), &[&pinned]).expect_err("other trials").render();
    assert!(said.contains("grasps.trials_root") && said.contains(&root(lost.folder()).short()), "{said}");
    let by_epsilon = ["patches.label=epsilon"];
    assert_eq!(job_of(lost.folder(), &by_epsilon).digest(), job(&by_epsilon).digest());
    assert_eq!(work(&job(&by_epsilon)).grasps.trials, None);
    // None held: there is no type to choose.
    let said = read(&text(lost.folder()), &[]).expect_err("no grasp that held").render();
    assert!(said.contains("at least one grasp that held and has a type"), "{said}");
    let untried = elsewhere(None);
    let said = read(&text(untried.folder()), &[]).expect_err("no trials").render();
    assert!(said.contains("patches.label") && said.contains("[physics]"), "{said}");
    assert!(read(&text(untried.folder()), &by_epsilon).is_ok());
    let settings = &work(&first).settings;
    let mut grasp = work(&first).grasps.objects[0].grasps[0].clone();
    for (outcome, label) in [
        (GraspLabel::Held, -1.0),
        (GraspLabel::Failed, 1.0),
        (GraspLabel::Borderline, 0.0),
        (GraspLabel::Untested, 0.0),
        (GraspLabel::Unconfirmed, 0.0),
    ] {
        grasp.trial = grasp.trial.map(|trial| GraspTrialEnd { outcome, ..trial });
        assert_eq!(settings.label_of(&grasp), label);
    }
}

#[test]
fn mistakes_are_told_with_their_places() {
    let (pinned, other) = (root_of(made_up_grasps()).hex(), Digest([1; 32]).hex());
    assert_eq!(job(&[&format!("grasps.root=\"{pinned}\"")]).digest(), job(&[]).digest());
    for (overrides, key, words) in [
        (&[format!("grasps.root=\"{other}\"")][..], "grasps.root", "grasps of root 0101"),
        (&["patches.tips=[\"a\", \"b\", \"a\"]".to_owned()], "patches.tips", "twice"),
        (&["patches.side=500".to_owned()], "patches.side", "480 px"),
        (&["camera.near=3.0".to_owned()], "camera.near", "nothing would be visible"),
        (&["camera.horizontal_fov=1e-9".to_owned()], "camera.horizontal_fov", "must lie between 6.4 and 64000 px"),
        (
            &["camera.point_focal_length=1e9".to_owned()],
            "camera.point_focal_length",
            "must lie between 6.4 and 64000 px",
        ),
        (&["render.colour=false".to_owned(), "render.randomise=true".to_owned()], "render.randomise", "lights"),
        (&["patches.tip=3".to_owned()], "patches.tip", "did you mean `tips`"),
        (&["objects=[]".to_owned()], "objects", "unknown key"),
    ] {
        let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
        let said = mistakes(&overrides);
        assert!(said.contains(key) && said.contains(words), "{said}");
    }
    let said = read("product = \"patches\"\n", &[]).expect_err("grasps and hand are missing").render();
    assert!(said.contains("dataset") && said.contains("hand"), "{said}");
    let workspace = Workspace::new();
    let said = read(&text(workspace.folder()), &[]).expect_err("no dataset").render();
    assert!(said.contains("grasps.dataset") && said.contains("holds no dataset"), "{said}");
    let said = |grasps: MadeUpGrasps| {
        let workspace = Workspace::new();
        grasps.write(workspace.folder());
        read(&text(workspace.folder()), &[]).expect_err("a mistake").render()
    };
    let untyped = said(MadeUpGrasps { with_types: false, ..MadeUpGrasps::new() });
    assert!(
        untyped.contains("grasp that held and has a type") && untyped.contains("tried grasps without"),
        "{untyped}"
    );
    let stranger = said(MadeUpGrasps { hand: ObjectId(Digest([1; 32])), ..MadeUpGrasps::new() });
    assert!(stranger.contains("hand of the grasps"), "{stranger}");
}
