//! The row of grasps in the table of products.

use super::{
    gallery::{best_grasp, cards, pictures},
    inspection::{GraspSurvey, counted_verdicts, grasp_counts_in_words, headline},
    page::GraspsPage,
    replayed::replay,
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::{PREVIEWED, write_grasp_preview},
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, Survey},
    tally::SpreadRow,
    templates::page_values,
};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, Sample},
    products::grasps::SHAPES,
};
use kernel::words::GraspVerdict;

/// Pages, texts and pictures of grasps.
pub static PAGES: ProductPages = ProductPages {
    product: Product::GRASPS,
    words: ProductWords {
        lead: "Grasps of objects by a hand: pose, joints, contacts, quality and verdict of every grasp that was found.",
        sample: "one search from one seed on an object, with all grasps that it found",
        labels: "analytic quality of each state and, if the job has simulated trials, whether it held; a state without a trial is untested, not bad",
        acquisition: "Grasps were searched on the objects' meshes, the hand was closed in simulation, and the quality was computed.",
        reading: "`shapes.mcap` contains the hand's shapes and the objects' meshes, so that grasps can be drawn and replayed.",
        legend: "The closed hand (blue) on the object (orange) from two sides, with a black dot at each contact: for each object a grasp that held in a trial, or without trials the kept grasp with the highest epsilon, or the state with the lowest energy if none was kept.",
        regenerated: 8,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(GraspSurvey::of(reader)?)),
    parts: None,
    headline: |reader| Ok(headline(reader.manifest())),
    counts_in_words: |_, manifest| Ok(vec![grasp_counts_in_words(&counted_verdicts(manifest))]),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_grasp_preview(reader, PREVIEWED)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Copied,
        descriptions: AssetUse::Copied,
        shape_files: &[SHAPES],
        data_files: &[],
    },
};

/// Side of each picture of a grasp [px].
const SIDE: u32 = 240;

impl Survey for GraspSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let cards = cards(reader, self)?;
        let shown = cards.as_ref().map_or(0, Vec::len);
        let (replay, job) = (replay(reader.folder(), reader.manifest())?, reader.job_text()?);
        Ok(Page { values: page_values(&GraspsPage::of(self, cards, replay, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        let rows = &mut numbers.rows;
        rows.extend(facts.hand.iter().map(|hand| NumberRow::new("hand", hand)));
        if let Some(trials) = &facts.trials {
            rows.push(NumberRow::new("physical trials", trials.in_words()));
            rows.push(NumberRow::new("conditions of trials", &trials.conditions));
        }
        rows.extend(GraspVerdict::ALL.map(|verdict| {
            let count = facts.verdicts.get(verdict.name()).copied().unwrap_or(0);
            NumberRow::new(format!("grasps: {}", verdict.name().replace('_', " ")), grouped(count))
        }));
        rows.push(NumberRow::new("runs given up early", grouped(facts.given_up)));
        rows.push(NumberRow::new("different types of kept grasps", grouped(facts.types.len() as u64)));
        numbers.spreads = vec![
            SpreadRow::new("energy of all states", 3, &facts.energy),
            SpreadRow::new("epsilon of kept grasps", 4, &facts.epsilon),
        ];
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        pictures(reader, self, PICTURES, SIDE)
    }

    fn panels(&self, reader: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        let picture = best_grasp(reader, self, sample.id.subject, side)?;
        Ok(picture.map(|picture| Panel { caption: "a grasp".to_owned(), picture }).into_iter().collect())
    }
}
