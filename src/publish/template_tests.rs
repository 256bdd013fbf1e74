//! Every branch of every template is rendered, and no text of third parties changes its surroundings.

use std::collections::{BTreeMap, BTreeSet};

use minijinja::{Environment, Value, value::Serde};
use serde_json::json;

use crate::{
    escape,
    evaluation::{self, Evaluation},
    grasp_types::TypeFacts,
    inspection::InspectionHeader,
    notes::{RunNotes, Speed},
    page::DatasetView,
    products::{
        PRODUCTS,
        amodal::{self, AmodalInspection, AmodalSurvey},
        completion::{self, CompletionInspection, CompletionSurvey},
        grasps::{
            self, Calibration, GraspObjectFacts, GraspSurvey, GraspsInspection, ReliabilityBin, ReplayView, TableFacts,
            TrialsInspection, VariantsInspection, WayFacts,
        },
        heatmaps::{self, HeatmapSurvey, HeatmapsInspection},
        patches::{self, PatchSurvey, PatchesInspection},
        picks::{self, PickSurvey, PicksInspection},
        reachability::{self, ReachabilityFacts},
        scenes::{self, SceneSurvey, ScenesInspection},
        suction::{self, SuctionInspection, SuctionSurvey},
        views::{self, ViewSurvey, ViewsInspection},
        volumes::{self, VolumeSurvey, VolumesInspection},
    },
    release::{DOCUMENT_TEMPLATES, Example},
    set::{self, SetPage},
    tally::{Spread, Tally},
    templates::{SHARED, Template, environment},
    touch::{HandFacts, TouchFacts, TouchKind},
};
use format::{FORMAT_VERSION, FieldHeader, GraspMethod, HandNames, Product, ReachabilityField};
use kernel::{
    geom::{Axis, AxisUnit, FieldMetric, HealPix, PoseGrid, PoseLabel},
    ids::{Digest, JobDigest, ObjectId},
    words::{GraspVerdict, NumberClass, STRETCHES, Split},
};

/// A template's name and the values for it.
type Page = (&'static str, Value);

const SPREAD: Spread = Spread { min: 0.1, p05: 0.2, median: 0.5, p95: 0.8, max: 0.9, mean: 0.5 };

fn page(template: &'static str, view: &impl serde::Serialize) -> Page {
    (template, Value::from(Serde(view)))
}

fn object() -> ObjectId {
    ObjectId(Digest::hash(b"object"))
}

fn header(name: &str, product: Product, warnings: usize, is_full: bool) -> InspectionHeader {
    let speed = Speed { samples: 12_000, seconds: 2.0, threads: 4, peak_memory: Some(1 << 30) };
    let slow = Speed { peak_memory: None, ..speed };
    InspectionHeader {
        name: name.to_owned(),
        headline: name.to_owned(),
        generator: name.to_owned(),
        product,
        format_version: FORMAT_VERSION,
        root: Digest::hash(b"root"),
        classes: [(NumberClass::Exact, Digest::hash(b"exact"))].into(),
        job: JobDigest(Digest::hash(b"job")),
        shards: 3,
        shard_bytes: 12_400_000,
        warnings: vec![name.to_owned(); warnings]
            .into_iter()
            .chain(is_full.then(|| format!("{name}: parts may overlap")))
            .collect(),
        notes: RunNotes {
            speed: is_full.then_some(if warnings > 4 { speed } else { slow }),
            leaks: [("straddling_views".to_owned(), u64::from(is_full)), (name.to_owned(), 3)].into(),
            intended: is_full.then(|| name.to_owned()).into_iter().collect(),
        },
    }
}

/// The facts of a dataset: those that all products share, and the others.
fn inspection<T: serde::de::DeserializeOwned>(header: &InspectionHeader, rest: &serde_json::Value) -> T {
    let mut facts = serde_json::to_value(header).expect("plain data");
    facts.as_object_mut().expect("a table").extend(rest.as_object().expect("a table").clone());
    serde_json::from_value(facts).expect("the facts of a dataset")
}

fn completion_page(name: &str, warnings: usize, is_full: bool) -> Page {
    let only_full = |text: &str| if is_full { vec![text.to_owned()] } else { Vec::new() };
    let objects = json!([{
        "name": name, "object": object(), "split": is_full.then_some("training"), "repairs": only_full(name),
        "warnings": only_full(name), "licence": is_full.then_some(name), "citation": is_full.then_some(name),
        "planned": 9, "kept": 5, "rejected": { name: 4 }, "mean_partial_cells": 3.5, "mean_seen_ratio": 0.25,
        "triangles": is_full.then_some(12), "extents": is_full.then_some([0.1, 0.2, 0.3]), "watertight": is_full.then_some(true),
    }]);
    let touch = TouchFacts {
        samples: 3,
        kinds: vec![TouchKind {
            channel: "touch_grasp".to_owned(),
            contacts: 7,
            hand: Some(HandFacts { hand: name.to_owned(), ..HandFacts::default() }),
            ..TouchKind::default()
        }],
        ..TouchFacts::default()
    };
    let setup =
        json!({ "resolution": 40, "width": 640, "height": 480, "fx": 550.0, "fy": 550.0, "cx": 320.0, "cy": 240.0 });
    let rest = json!({
        "channels": ["pair", "visibility", "touch_grasp"], "setup": is_full.then_some(setup),
        "sensor": (warnings > 1).then_some(name), "truth": is_full.then_some(name),
        "planned": 9, "kept": if is_full { 5 } else { 0 }, "rejected": if is_full { json!({ name: 4 }) } else { json!({}) },
        "partial_cells": SPREAD, "complete_cells": SPREAD, "seen_ratio": SPREAD, "solid_share": SPREAD, "cut_off": 1,
        "splits": [{ "split": "training", "samples": 5, "objects": 1, "seen_ratio": SPREAD }],
        "training_subsets": if is_full { vec![4, 8] } else { Vec::new() },
        "leaking_geometry": if is_full { vec![vec![name, name]] } else { Vec::new() },
        "objects": objects, "refused": only_full(name), "touch": is_full.then_some(touch),
    });
    let mut facts = serde_json::to_value(header(name, Product::COMPLETION, warnings, is_full)).expect("plain data");
    facts.as_object_mut().expect("a table").extend(rest.as_object().expect("a table").clone());
    let facts: CompletionInspection = serde_json::from_value(facts).expect("the facts of a dataset");
    let mut tally = Tally::with_step(1e-3);
    tally.add(0.5);
    let survey = CompletionSurvey {
        facts,
        partial: tally.clone(),
        complete: tally.clone(),
        ratio: tally.clone(),
        solid: tally.clone(),
        ratio_of_split: [(Split::Training, tally)].into(),
        picks: Vec::new(),
    };
    let cards = [true, false].map(|returned| completion::CardView::example(name, returned));
    page(completion::PAGE_TEMPLATE, &completion::CompletionPage::of(&survey, cards.into(), name))
}

fn grasp_method(sampler: &str, name: &str) -> (GraspMethod, HandNames) {
    let method = GraspMethod {
        sampler: sampler.to_owned(),
        energy: "contact_and_potential".to_owned(),
        energy_space: "force".to_owned(),
        energy_friction: 1.0,
        potential_scale: 1.0,
        contact_model: if sampler == "antipodal" { "soft_finger" } else { "hard_point" }.to_owned(),
        friction: 0.5,
        edges: 8,
        torsion: 0.002,
        space: "wrench".to_owned(),
        min_epsilon: 0.05,
        max_penetration: 0.001,
        max_advance: 0.1,
        stand_off: 0.1,
    };
    let joints = vec!["a".to_owned(), "b".to_owned()];
    let links = Vec::new();
    (method, HandNames { name: name.to_owned(), id: object(), links, driven: joints.clone(), joints })
}

fn trials(name: &str, is_full: bool) -> TrialsInspection {
    let bins = vec![ReliabilityBin { estimate: 0.5, runs: 4, held: 2 }];
    let calibration =
        Calibration { grasps: 2, runs: 4, brier: 0.25, brier_of_share: 0.25, brier_of_verdict: 0.5, bins };
    TrialsInspection {
        tried: 4,
        verdicts: [("held".to_owned(), 3)].into(),
        by_quality: [("kept".to_owned(), [2, 2]), ("low_quality".to_owned(), [2, 1])].into(),
        on_table: is_full.then(|| [("held".to_owned(), 1)].into()),
        labels: [("held".to_owned(), 2), ("borderline".to_owned(), 1)].into(),
        variants: is_full.then(|| VariantsInspection { grasps: 2, robust: 1, held: vec![(name.to_owned(), 1)] }),
        perturbed: if is_full { 8 } else { 0 },
        turned: 1,
        closed_penetration: SPREAD,
        shaken_penetration: SPREAD,
        slip: SPREAD,
        series: if is_full { [2, 1] } else { [0; 2] },
        not_at_rest: 0,
        success: is_full.then_some(SPREAD),
        calibration: is_full.then_some(calibration),
        conditions: name.to_owned(),
    }
}

fn grasps_page(name: &str, sampler: Option<&str>, tried: Option<bool>, is_full: bool) -> Page {
    let object = GraspObjectFacts {
        name: name.to_owned(),
        object: object(),
        runs: 3,
        rejected: 1,
        given_up: 1,
        verdicts: [1; GraspVerdict::ALL.len()],
        trials: if is_full { [1, 1] } else { [0, 0] },
        resting: 2,
        likely: is_full.then_some(0.7),
        table: TableFacts::default(),
        best_energy: is_full.then_some(-1.0),
        best_epsilon: is_full.then_some(0.2),
    };
    let facts = GraspsInspection {
        header: header(name, Product::GRASPS, usize::from(is_full), is_full),
        hand: is_full.then(|| name.to_owned()),
        runs: 3,
        kept_runs: 3,
        rejected: if is_full { [(name.to_owned(), 1)].into() } else { BTreeMap::new() },
        given_up: 1,
        budget_spent: 1,
        verdicts: GraspVerdict::ALL.map(|verdict| (verdict.name().to_owned(), 1)).into(),
        energy: SPREAD,
        epsilon: SPREAD,
        types: (12..if is_full { 24 } else { 12 }).map(|kind| TypeFacts::new(kind, [2, 1])).collect(),
        table: TableFacts::default(),
        ways: WayFacts::default(),
        trials: tried.map(|is_full| trials(name, is_full)),
        acceptance: [0.5; STRETCHES],
        course: [is_full.then_some(1.0); STRETCHES],
        objects: vec![object; if is_full { 2 } else { 1 }],
    };
    let survey = GraspSurvey {
        facts,
        energies: vec![0.1, 0.9],
        epsilons: if is_full { vec![0.1, 0.9] } else { Vec::new() },
        method: sampler.map(|sampler| grasp_method(sampler, name)),
        picks: BTreeMap::new(),
    };
    let cards = is_full.then(|| Vec::from([0, 2].map(|tried| grasps::CardView::example(name, tried))));
    let replay = match tried {
        Some(true) => Some(ReplayView::example(name, 21, "sdf")),
        Some(false) => Some(ReplayView::example(name, if is_full { 2 } else { 0 }, "flex")),
        None => None,
    };
    page(grasps::PAGE_TEMPLATE, &grasps::GraspsPage::of(&survey, cards, replay, name))
}

fn patches_page(name: &str, is_full: bool) -> Page {
    let rest = json!({
        "grasps": is_full.then_some(Digest::hash(b"grasps")), "hand": name, "kept_grasps": 9, "different_types": 2,
        "without_type": 0, "samples": 5, "kept": 4, "rejected": if is_full { json!({ name: 1 }) } else { json!({}) },
        "colour": false, "types": [{ "kind": 12, "grasps": 5, "held": 0, "digits": [0, 0, 0, 0, 0, 0, 2, 2], "kept": 4 }],
        "epsilon": SPREAD, "energy": SPREAD,
        "outcomes": is_full.then(|| json!({ "held": 3, "failed": 1 })), "visible_points": is_full.then_some(12),
        "objects": [{ "name": name, "object": object(), "samples": 5, "kept": 4 }],
    });
    let warnings = usize::from(is_full);
    let mut facts = serde_json::to_value(header(name, Product::PATCHES, warnings, is_full)).expect("plain data");
    facts.as_object_mut().expect("a table").extend(rest.as_object().expect("a table").clone());
    let facts: PatchesInspection = serde_json::from_value(facts).expect("the facts of a dataset");
    let epsilons = if is_full { vec![0.1, 0.9] } else { Vec::new() };
    let survey = PatchSurvey { facts, epsilons, picks: Vec::new() };
    let cards = vec![patches::CardView::example(name, name)];
    page(patches::PAGE_TEMPLATE, &patches::PatchesPage::of(&survey, cards, name))
}

fn views_page(name: &str, is_full: bool) -> Page {
    let rest = json!({
        "scenes": 3, "samples": 5, "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "rejected": if is_full { json!({ name: 1 }) } else { json!({}) },
        "bodies": if is_full { 20 } else { 0 }, "strata": [[name, 20]], "truncated": 1, "near_draws": 2, "unseen_draws": 3,
        "too_near": u64::from(is_full),
        "objects": [{ "name": name, "object": object(), "split": "training" }],
    });
    let facts: ViewsInspection = inspection(&header(name, Product::VIEWS, usize::from(is_full), is_full), &rest);
    let survey = ViewSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![views::CardView::example(name)] } else { Vec::new() };
    page(views::PAGE_TEMPLATE, &views::ViewsPage::of(&survey, cards, name))
}

fn amodal_page(name: &str, is_full: bool) -> Page {
    let kind = TouchKind { channel: "touch_rays".to_owned(), blocked: Some(2), ..TouchKind::default() };
    let touch = TouchFacts { samples: 1, kinds: vec![kind], ..TouchFacts::default() };
    let rest = json!({
        "scenes": 3, "samples": 5, "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "rejected": if is_full { json!({ name: 1 }) } else { json!({}) },
        "strata": [[name, 5, 4]], "truncated": 1,
        "partial_cells": SPREAD, "complete_cells": SPREAD, "visible_share": SPREAD, "solid_share": SPREAD, "purity": SPREAD,
        "others_solid_cells": SPREAD, "touch": is_full.then_some(touch),
        "objects": [{ "name": name, "object": object(), "split": "training" }],
    });
    let facts: AmodalInspection = inspection(&header(name, Product::AMODAL, usize::from(is_full), is_full), &rest);
    let survey = AmodalSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![amodal::CardView::example(name)] } else { Vec::new() };
    page(amodal::PAGE_TEMPLATE, &amodal::AmodalPage::of(&survey, cards, name))
}

fn volumes_page(name: &str, is_full: bool) -> Page {
    let rest = json!({
        "scenes": 3, "samples": 5, "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "rejected": if is_full { json!({ name: 1 }) } else { json!({}) },
        "images": 9, "by_images": if is_full { json!({ "1": 3, "6": 1 }) } else { json!({}) },
        "bodies": 20, "bodies_inside": 19,
        "observed_voxels": SPREAD, "near_voxels": SPREAD, "occupied_voxels": SPREAD,
        "grasps": is_full.then(|| json!({ "states": [5, 3, 1], "forbidden": 81, "outside": 2 })),
        "objects": [{ "name": name, "object": object(), "split": "training" }],
    });
    let facts: VolumesInspection = inspection(&header(name, Product::VOLUMES, usize::from(is_full), is_full), &rest);
    let survey = VolumeSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![volumes::CardView::example(name)] } else { Vec::new() };
    page(volumes::PAGE_TEMPLATE, &volumes::VolumesPage::of(&survey, cards, name))
}

fn heatmaps_page(name: &str, is_full: bool) -> Page {
    let rest = json!({
        "hand": name, "picks": is_full.then(|| Digest::hash(b"picks")), "scenes": 3, "samples": 5,
        "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "rejected": if is_full { json!({ name: 1 }) } else { json!({}) },
        "points": [name], "types": if is_full { json!([12, 78_137]) } else { json!([]) },
        "images_with_grasps": 3, "states": [5, 3, 1], "forbidden": [40, 20, 1, 20], "other_types": u64::from(is_full),
        "points_in_images": 24, "visible_points": 20, "patches": 7,
        "objects": [{ "name": name, "object": object(), "split": "training" }],
    });
    let facts: HeatmapsInspection = inspection(&header(name, Product::HEATMAPS, usize::from(is_full), is_full), &rest);
    let survey = HeatmapSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![heatmaps::CardView::example(name)] } else { Vec::new() };
    page(heatmaps::PAGE_TEMPLATE, &heatmaps::HeatmapsPage::of(&survey, cards, name))
}

fn picks_page(name: &str, is_full: bool) -> Page {
    let trials = json!({
        "tried": 8, "verdicts": { "held": 5, "let_go": 3 }, "held": 5, "held_touching": 2, "held_moving": 1, "held_carrying": 1,
    });
    let poses = json!({
        "poses": 900, "lost": [["without an opposite point", 500], ["rejected by container", 300]], "alike": 91, "free": 9,
        "too_wide": 1, "palm_only": 1, "blocked_by": [0, 1, 0, 0],
    });
    let rest = json!({
        "hand": name, "scenes": 3, "samples": 5, "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "rejected": if is_full { json!({ name: 1 }) } else { json!({}) }, "poses": is_full.then_some(poses),
        "bodies_with_free": 3, "candidates": if is_full { 90 } else { 0 }, "free": 9, "lost": [40, 20, 1, 20],
        "free_opened": [3, 10], "trials": is_full.then_some(trials),
        "objects": [{
            "name": name, "object": object(), "split": "training", "bodies": 4, "candidates": 90, "free": 9,
            "lost": [40, 20, 1, 20], "trials": [8, 5],
        }],
    });
    let facts: PicksInspection = inspection(&header(name, Product::PICKS, usize::from(is_full), is_full), &rest);
    let survey = PickSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![picks::CardView::example(name)] } else { Vec::new() };
    page(picks::PAGE_TEMPLATE, &picks::PicksPage::of(&survey, cards, name))
}

fn suction_page(name: &str, is_full: bool) -> Page {
    let rest = json!({
        "scenes": 3, "samples": 5, "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "bodies_with_free": 3, "poses": if is_full { 900 } else { 0 }, "lost": [["leaking: hole", 500], ["too weak: tilt", 300]],
        "alike": 90, "free": 10, "robust": 8,
        "objects": [{
            "name": name, "object": object(), "split": "training", "bodies": [4, 3], "poses": 900, "results": [500, 300, 0, 10],
        }],
    });
    let facts: SuctionInspection = inspection(&header(name, Product::SUCTION, usize::from(is_full), is_full), &rest);
    let survey = SuctionSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![suction::CardView::example(name)] } else { Vec::new() };
    page(suction::PAGE_TEMPLATE, &suction::SuctionPage::of(&survey, cards, name))
}

fn scenes_page(name: &str, is_full: bool) -> Page {
    let rest = json!({
        "samples": 5, "kept": if is_full { 4 } else { 0 }, "splits": { "training": 4 },
        "rejected": if is_full { json!({ name: 1 }) } else { json!({}) },
        "bodies": 20, "gone": 1, "by_bodies": if is_full { json!({ "5": 4 }) } else { json!({}) },
        "contacts": SPREAD, "rest_time": SPREAD, "depth_bodies": SPREAD, "depth_container": SPREAD, "drift": SPREAD,
        "objects": [{ "name": name, "object": object(), "split": "training", "mass": 0.3 }],
        "imported": is_full.then(|| json!({ "too_deep": 1, "moved": 2 })),
    });
    let facts: ScenesInspection = inspection(&header(name, Product::SCENES, usize::from(is_full), is_full), &rest);
    let survey = SceneSurvey { facts, shown: Vec::new() };
    let cards = if is_full { vec![scenes::CardView::example(name)] } else { Vec::new() };
    page(scenes::PAGE_TEMPLATE, &scenes::ScenesPage::of(&survey, cards, name))
}

fn reachability_page(name: &str, is_directed: bool, is_full: bool) -> Page {
    let axis = |name, unit, count, periodic| {
        let step = if periodic { std::f64::consts::TAU / count as f64 } else { 0.1 };
        Axis { name, unit, first: 0.0, step, count, periodic }
    };
    // Number of positions along x for which every second one has a mark.
    let columns = if is_directed { 2 } else { 31 };
    let position_axes =
        [("x", columns), ("y", 2), ("z", 2)].map(|(name, count)| axis(name, AxisUnit::Metre, count, false));
    let angles = ["roll", "pitch", "yaw"].map(|name| axis(name, AxisUnit::Radian, 2, true));
    let grid = match is_directed {
        true => PoseGrid::on_sphere(position_axes, HealPix::new(1).expect("a power of two"), 2),
        false => PoseGrid::new([position_axes[0], position_axes[1], position_axes[2], angles[0], angles[1], angles[2]]),
    };
    let grid = grid.expect("a grid");
    let directions = axis("direction", AxisUnit::HealPix, 12, false);
    let axes: Vec<Axis> = position_axes
        .into_iter()
        .chain(if is_directed { vec![directions, angles[0]] } else { angles.into() })
        .collect();
    let labels: Vec<PoseLabel> =
        (0..grid.cells()).map(|cell| if is_full { PoseLabel::ALL[cell % 3] } else { PoseLabel::ALL[0] }).collect();
    let field_header = FieldHeader {
        grid,
        metric: if is_full { FieldMetric::Metres { rho: 0.1 } } else { FieldMetric::Cells },
        robot: name.to_owned(),
        robot_id: object(),
        joints: vec![name.to_owned()],
        target: name.to_owned(),
        frame: name.to_owned(),
    };
    let profile = field_header.profile();
    let distances = vec![if is_full { 0.5 } else { f32::INFINITY }; labels.len()];
    let field = ReachabilityField { header: field_header, labels, distances };
    let rest = json!({
        "robot": {
            "name": name, "id": object(), "joints": [name, name], "target": name, "frame": name,
            "fixed": if is_full { json!({ name: 0.5 }) } else { json!({}) },
        },
        "axes": axes.iter().map(|axis| json!({
            "name": axis.name, "first": axis.first, "step": axis.step, "count": axis.count, "unit": axis.unit.name(),
            "periodic": axis.periodic,
        })).collect::<Vec<_>>(),
        "covering": { "radius": 0.5, "directions": null, "method": "m", "words": name },
        "solver": name, "collisions": if is_full { name } else { "none" }, "positions": 8, "poses": 64,
        "labels": { "reachable": 20 }, "proofs": { "bound": 64 },
        "field": {
            "profile": profile, "unit": name, "radian_weight": is_full.then_some(0.1), "min": is_full.then_some(-0.5),
            "max": is_full.then_some(0.5), "mean": is_full.then_some(0.0),
        },
    });
    let warnings = usize::from(is_full);
    let mut facts = serde_json::to_value(header(name, Product::REACHABILITY, warnings, is_full)).expect("plain data");
    facts.as_object_mut().expect("a table").extend(rest.as_object().expect("a table").clone());
    let facts: ReachabilityFacts = serde_json::from_value(facts).expect("the facts of a map");
    page(reachability::PAGE_TEMPLATE, &reachability::ReachabilityPage::of(&facts, &field, name))
}

/// Documents of a release.
const DOCUMENTS: [&str; 5] = [
    "release/README.md",
    "release/DATASHEET.md",
    "release/LICENCES.md",
    "release/CITATION.cff",
    "release/citation.bib",
];

/// Every page and document with and without optional parts; `name` is at every position of third-party text.
fn pages(name: &str) -> Vec<Page> {
    let mut pages =
        vec![completion_page(name, 5, true), completion_page(name, 1, true), completion_page(name, 0, false)];
    for (sampler, tried, is_full) in [
        (Some("annealing"), Some(true), true),
        (Some("uniform"), Some(false), true),
        (Some("antipodal"), Some(false), false),
        (Some("approach"), Some(false), true),
        (Some("annealing"), None, true),
        (None, None, false),
    ] {
        pages.push(grasps_page(name, sampler, tried, is_full));
    }
    pages.extend([true, false].map(|is_full| patches_page(name, is_full)));
    pages.extend([true, false].map(|is_full| scenes_page(name, is_full)));
    pages.extend([true, false].map(|is_full| views_page(name, is_full)));
    pages.extend([true, false].map(|is_full| amodal_page(name, is_full)));
    pages.extend([true, false].map(|is_full| volumes_page(name, is_full)));
    pages.extend([true, false].map(|is_full| picks_page(name, is_full)));
    pages.extend([true, false].map(|is_full| heatmaps_page(name, is_full)));
    pages.extend([true, false].map(|is_full| suction_page(name, is_full)));
    pages.extend([true, false].map(|is_full| page(set::PAGE_TEMPLATE, &SetPage::example(name, is_full))));
    let compared = |is_full| page(evaluation::PAGE_TEMPLATE, &Evaluation::example(name, is_full).page());
    pages.extend([true, false].map(compared));
    for (is_directed, is_full) in [(true, true), (false, true), (false, false)] {
        pages.push(reachability_page(name, is_directed, is_full));
    }
    let releases = [
        (Product::COMPLETION, "CC-BY-4.0", true, true, true),
        (Product::GRASPS, "MIT OR Apache-2.0", true, true, false),
        (Product::REACHABILITY, "CC-BY-4.0 AND MIT", true, false, false),
        (Product::PATCHES, "CC0-1.0", true, false, false),
        (Product::COMPLETION, "CC0-1.0", false, false, false),
    ];
    for (product, licence, is_full, has_setting, counts_objects) in releases {
        let view = Example { product, name, is_full, licence, has_setting, counts_objects }.view();
        pages.extend(DOCUMENTS.map(|template| (template, view.clone())));
    }
    pages
}

/// All templates with a mark at the beginning of each branch, and the marks.
fn marked() -> (Environment<'static>, Vec<String>) {
    let mut marks = Vec::new();
    let marked = |(name, text): Template| {
        let pieces = text.split_inclusive("%}").map(|piece| {
            let tag = piece.rsplit_once("{%").map_or("", |(_, tag)| tag).trim_start_matches('-').trim_start();
            if !["if ", "elif ", "else", "for "].iter().any(|word| tag.starts_with(word)) {
                return piece.to_owned();
            }
            marks.push(format!("\u{e000}{name} {}\u{e001}", marks.len()));
            format!("{piece}{}", marks[marks.len() - 1])
        });
        let text: &'static str = Box::leak(pieces.collect::<String>().into_boxed_str());
        (name, text)
    };
    let others = [&DOCUMENT_TEMPLATES, &set::TEMPLATES, &evaluation::TEMPLATES];
    let own = PRODUCTS.iter().map(|pages| pages.templates).chain(others).flat_map(|templates| templates.own);
    let templates: Vec<Template> = SHARED.iter().chain(own).copied().map(marked).collect();
    (environment(templates), marks)
}

/// Fills a template of any environment.
fn fill_of(environment: &Environment, name: &str, view: &Value) -> String {
    let filled = environment.get_template(name).and_then(|template| template.render(view.clone()));
    filled.unwrap_or_else(|error| panic!("the template {name}: {error}"))
}

#[test]
fn every_branch_of_every_template_is_rendered() {
    let (environment, marks) = marked();
    let mut missing: BTreeSet<&str> = marks.iter().map(String::as_str).collect();
    assert!(missing.len() > 100, "{} branches", missing.len());
    for (template, view) in pages("mug-01") {
        let text = fill_of(&environment, template, &view);
        missing.retain(|mark| !text.contains(mark));
    }
    assert!(missing.is_empty(), "no page shows {missing:#?}");
}

/// Only the escaped text differs, at every position.
#[test]
fn hostile_names_change_nothing_around_them() {
    let hostile = "mug<script>alert(1)</script><!-- \" ' & &lt; | [a](javascript:b) ![c](d) *e* _f_ ~~g~~ $h$ # {{ i }} {% j %} \\ \
        ]]> =cmd|' /C calc'!A0";
    let inner = |text: String| text[1..text.len() - 1].to_owned();
    // An escaped text inside a longer one comes before its own parts.
    let forms = [
        escape::html(hostile),
        // Reasons and the like are shown with spaces.
        escape::html(&hostile.replace('_', " ")),
        escape::markdown(hostile),
        inner(escape::quoted(hostile)),
        inner(escape::code(hostile)),
        escape::bibtex(hostile),
    ];
    let key: String = hostile.chars().filter(char::is_ascii_alphanumeric).take(24).collect();
    for ((template, plain), (_, view)) in pages("mug").into_iter().zip(pages(hostile)) {
        let (environment, _) = marked();
        let plain = fill_of(&environment, template, &plain);
        let mut text = fill_of(&environment, template, &view);
        assert!(forms.iter().any(|form| text.contains(form)), "{template} shows no name");
        for form in &forms {
            text = text.replace(form.as_str(), "mug");
        }
        let text = text.replace(&key, "mug");
        let first = text.lines().zip(plain.lines()).find(|(a, b)| a != b);
        assert!(text == plain, "{template}: {first:#?}");
    }
}

/// Templates of HTML pages show names as text: no name begins a tag or an entity.
#[test]
fn names_are_text_in_pages() {
    for (name, escaped) in [("<b>x</b>", "&lt;b&gt;x&lt;/b&gt;"), ("a&b", "a&amp;b"), ("\"'", "&quot;&#39;")] {
        let of_pages = pages(name);
        let html: Vec<&Page> = of_pages.iter().filter(|(template, _)| template.ends_with(".html")).collect();
        let templates: BTreeSet<&str> = html.iter().map(|(template, _)| *template).collect();
        assert!(
            templates.len() > PRODUCTS.len(),
            "every product, the set and the comparison have a page: {templates:?}"
        );
        for (template, view) in html {
            let text = fill_of(&marked().0, template, view);
            assert!(text.contains(escaped), "{template} does not show {name}");
            assert!(!text.contains(name) || name == "\"'", "{template} shows {name} as markup");
        }
    }
}

/// Templates of Markdown documents show names as text: no name begins a tag, an entity, a link or a cell.
#[test]
fn names_are_text_in_documents() {
    for (name, escaped) in [("<b>x</b>", "&lt;b>x&lt;/b>"), ("a&b;c", "a&amp;b;c"), ("[a](b)|c", "\\[a\\](b)\\|c")] {
        for (template, view) in pages(name).iter().filter(|(template, _)| template.ends_with(".md")) {
            let text = fill_of(&marked().0, template, view);
            assert!(text.contains(escaped), "{template} does not show {name}");
            // Code takes names as they are, and front matter quotes them.
            let mut is_code = false;
            let prose = text.lines().filter(|line| {
                is_code ^= line.starts_with("```");
                !is_code && !line.contains('`')
            });
            let front_matter = |line: &str| line.starts_with("pretty_name") || line.starts_with("- \"");
            for line in prose.filter(|line| !front_matter(line)) {
                assert!(!line.contains(name), "{template}: {line}");
            }
        }
    }
}

#[test]
fn notes_on_meshes_are_folded_on_pages_about_other_things() {
    for (product, opens) in [(Product::COMPLETION, true), (Product::GRASPS, true), (Product::VIEWS, false)] {
        let header = header("name", product, 1, true);
        let view = serde_json::to_value(DatasetView::of(&header)).expect("plain data");
        assert_eq!(view["warnings"], json!(["name"]), "{product}");
        assert_eq!(view["notes"], json!(["name: parts may overlap"]), "{product}");
        assert_eq!(view["notes_counted"], "1 note", "{product}");
        assert_eq!(view["opens_notes"], opens, "{product}");
    }
}
