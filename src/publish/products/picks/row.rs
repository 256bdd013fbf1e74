//! The row of picks in the table of products.

use super::{
    headline::headline,
    inspection::{PickSurvey, PicksInspection},
    page::{PicksPage, cards, pick_words},
    painting::{Drawn, pick_panel},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_pick_preview,
    product::{GraspFunnel, PICTURES, Page, ProductAssets, ProductPages, ProductWords, SampleParts, Survey},
    scene_samples::{ScenePanel, SceneSample},
    templates::page_values,
};
use format::{
    Noun, PickCandidates, PickFacts, PickTrials, Product,
    dataset::{DatasetError, DatasetReader, Manifest, Sample},
    products::grasps::SHAPES,
};
use kernel::files::Folder;

/// Pages, texts and pictures of picks.
pub static PAGES: ProductPages = ProductPages {
    product: Product::PICKS,
    words: ProductWords {
        lead: "Grasps of a hand on the bodies of settled scenes: which are reachable without touching anything else, and the outcomes of trials among the neighbours.",
        sample: "one body of one settled scene, with the grasps that were evaluated",
        labels: "for each grasp the obstacle, its stage and its distance; if the job has trials, for some of the free grasps whether the body was lifted and kept, and which things were touched, moved and carried along",
        acquisition: "Grasps were sampled on each body in its scene, or stored grasps of its object were transferred there, those of a gripper also rotated about its closing line; the job names which. The motion of the hand along its approach and while closing was checked against the true meshes.",
        reading: "`shapes.mcap` contains the hand's shapes and the objects' meshes, so that grasps can be drawn.",
        legend: "From left to right: the closed hand (blue) on the body (orange) among the others (grey), and the base of each hand, green if free and red if blocked.",
        regenerated: 16,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(PickSurvey::of(reader)?)),
    parts: Some(SampleParts {
        noun: Noun { one: "grasp", many: "grasps" },
        count: |manifest| manifest.counts.fact("candidates"),
    }),
    headline,
    counts_in_words,
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_pick_preview(reader)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Copied,
        descriptions: AssetUse::Copied,
        shape_files: &[SHAPES],
        data_files: &[],
    },
};

/// Evaluated grasps by result.
fn counts_in_words(_: &Folder, manifest: &Manifest) -> Result<Vec<String>, DatasetError> {
    let counts = &manifest.counts;
    let lost = ["ground", "container", "own_object", "neighbour"].map(|to| (to, counts.fact(&format!("lost_to_{to}"))));
    let lost = lost.iter().filter(|(_, count)| *count > 0);
    let lost: Vec<String> =
        lost.map(|(to, count)| format!("{} by {}", grouped(*count), to.replace('_', " "))).collect();
    let [candidates, free] = ["candidates", "free"].map(|fact| grouped(counts.fact(fact)));
    let lost = if lost.is_empty() { String::new() } else { format!(", blocked: {}", lost.join(", ")) };
    Ok(vec![format!("{candidates} grasps evaluated: {free} free{lost}")])
}

/// Side of each part of a sample's picture in a release [px].
const SIDE: u32 = 240;

impl Survey for PickSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&PicksPage::of(self, cards, &job)), shown })
    }

    fn funnel(&self) -> Option<GraspFunnel> {
        let PicksInspection { hand, kept, bodies_with_free, candidates, free, poses, trials, .. } = &self.facts;
        Some(GraspFunnel {
            hand: hand.clone(),
            bodies: *kept,
            bodies_with_free: *bodies_with_free,
            candidates: poses.as_ref().map_or(*candidates, |poses| poses.poses),
            free: *free,
            trials: trials.as_ref().map(|trials| [trials.tried, trials.lifted(), trials.held]),
        })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        let mut add = |name: String, count: u64| numbers.rows.push(NumberRow::new(name, grouped(count)));
        add("bodies with a free grasp".to_owned(), facts.bodies_with_free);
        if let Some(trials) = &facts.trials {
            add("grasps tried among neighbours".to_owned(), trials.tried);
            add("trials that held".to_owned(), trials.held);
        }
        add("scenes".to_owned(), facts.scenes);
        for (name, count) in facts.ends() {
            add(if name == "free" { "free grasps".to_owned() } else { format!("grasps blocked by {name}") }, count);
        }
        if let Some(trials) = &facts.trials {
            add("trials that held and moved a neighbour".to_owned(), trials.held_moving);
            add("trials that held and carried a neighbour along".to_owned(), trials.held_carrying);
        }
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let Some(mut drawn) = Drawn::of(reader)? else { return Ok(Vec::new()) };
        let mut pictures = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            let (candidates, trials) = (sample.read::<PickCandidates>()?, sample.find::<PickTrials>()?);
            let found = drawn.pictures(&candidates, trials.as_ref(), SIDE)?;
            let row: Vec<Picture> = found.held.into_iter().chain([found.ways]).collect();
            let picture = Picture::row(&row, SIDE / 20).with_few_colours();
            pictures.push((pick_words(&candidates, trials.as_ref()), picture));
        }
        Ok(pictures)
    }

    fn panels(&self, reader: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        let Some(mut drawn) = Drawn::of(reader)? else { return Ok(Vec::new()) };
        let (candidates, trials) = (sample.read::<PickCandidates>()?, sample.find::<PickTrials>()?);
        let found = drawn.pictures(&candidates, trials.as_ref(), side)?;
        let panel = |caption: &str, picture| Panel { caption: caption.to_owned(), picture };
        let held = found.held.map(|picture| panel("closed hand", picture));
        Ok(held.into_iter().chain([panel("free and blocked", found.ways)]).collect())
    }

    /// Bodies that a grasp held.
    fn scene_samples(&self, reader: &DatasetReader) -> Result<Vec<SceneSample>, DatasetError> {
        SceneSample::all(reader, |row| (PickFacts::from(&row.facts).trials.held() > 0).then_some((None, 0.0)))
    }

    fn scene_panels(&self, reader: &DatasetReader, sample: &Sample) -> Result<Vec<ScenePanel>, DatasetError> {
        let object = sample.read::<PickCandidates>()?.object();
        let row = self.facts.objects.iter().find(|row| row.object == object);
        Ok(pick_panel(reader, sample, row.map_or("?", |row| row.name.as_str()))?.into_iter().collect())
    }
}
