//! The row of suction in the table of products.

use super::{
    inspection::{SuctionInspection, SuctionSurvey, headline},
    page::{SuctionPage, cards, suction_words},
    painting::Drawn,
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_suction_preview,
    product::{GraspFunnel, PICTURES, Page, ProductAssets, ProductPages, ProductWords, SampleParts, Survey},
    templates::page_values,
};
use format::{
    Noun, Product, SuctionPoses,
    dataset::{DatasetError, DatasetReader, Manifest, Sample},
    products::grasps::SHAPES,
};
use kernel::files::Folder;

/// Pages, texts and pictures of suction.
pub static PAGES: ProductPages = ProductPages {
    product: Product::SUCTION,
    words: ProductWords {
        lead: "Poses of a suction cup on the bodies of settled scenes: where it seals, holds the body, and gets there without touching anything else.",
        sample: "one body of one settled scene, with poses of a suction cup on it",
        labels: "for each pose the margins of seal and hold with the limit that is used most, the obstacle on the path, its stage and its distance, the scores of SuctionNet-1Billion and, for free poses, the robustness against errors of the pose",
        acquisition: "Poses were drawn on the surface of each body. Rays along the axis of the cup measured the true mesh under its lip, the wrench constraints of Dex-Net 3.0 compared the weight with the strengths of the cup, and the straight path of cup and tube was checked against the true meshes.",
        reading: "`shapes.mcap` contains the objects' meshes, so that poses can be drawn.",
        legend: "From left to right: the suction cup (blue) on the body (orange) among the others (grey), and the stored poses, green if free, red if the cup leaks, blue if it is too weak or blocked.",
        regenerated: 64,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(SuctionSurvey::of(reader)?)),
    parts: Some(SampleParts {
        noun: Noun { one: "pose", many: "poses" },
        count: |manifest| manifest.counts.fact("stored"),
    }),
    headline,
    counts_in_words,
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_suction_preview(reader)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Copied,
        descriptions: AssetUse::Measured,
        shape_files: &[SHAPES],
        data_files: &[],
    },
};

/// Drawn poses by result.
fn counts_in_words(_: &Folder, manifest: &Manifest) -> Result<Vec<String>, DatasetError> {
    let counts = &manifest.counts;
    let sum = |prefix: &str| -> u64 {
        let facts = Product::SUCTION.facts.iter().filter(|fact| fact.name.starts_with(prefix));
        facts.map(|fact| counts.fact(fact.name)).sum()
    };
    let [leaking, weak, blocked] = ["leaking_", "weak_", "blocked_by_"].map(|prefix| grouped(sum(prefix)));
    let [poses, free] = ["poses", "free"].map(|fact| grouped(counts.fact(fact)));
    Ok(vec![format!("{poses} poses drawn: {free} free, {leaking} leaking, {weak} too weak, {blocked} blocked")])
}

/// Side of each part of a sample's picture in a release [px].
const SIDE: u32 = 240;

impl Survey for SuctionSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&SuctionPage::of(self, cards, &job)), shown })
    }

    fn funnel(&self) -> Option<GraspFunnel> {
        let SuctionInspection { kept, bodies_with_free, poses, free, .. } = &self.facts;
        Some(GraspFunnel {
            hand: "suction cup".to_owned(),
            bodies: *kept,
            bodies_with_free: *bodies_with_free,
            candidates: *poses,
            free: *free,
            trials: None,
        })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        for (name, count) in [
            ("bodies with a free pose", facts.bodies_with_free),
            ("scenes", facts.scenes),
            ("poses drawn", facts.poses),
            ("free poses", facts.free),
            ("robust free poses", facts.robust),
        ] {
            numbers.rows.push(NumberRow::new(name.to_owned(), grouped(count)));
        }
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Drawn::of(reader)?;
        let mut pictures = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            let poses = sample.read::<SuctionPoses>()?;
            let found = drawn.pictures(&poses, SIDE)?;
            let row: Vec<Picture> = found.cup.into_iter().chain([found.poses]).collect();
            pictures.push((suction_words(&poses), Picture::row(&row, SIDE / 20).with_few_colours()));
        }
        Ok(pictures)
    }

    fn panels(&self, reader: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        let found = Drawn::of(reader)?.pictures(&sample.read::<SuctionPoses>()?, side)?;
        let panel = |caption: &str, picture| Panel { caption: caption.to_owned(), picture };
        let cup = found.cup.map(|picture| panel("suction cup", picture));
        Ok(cup.into_iter().chain([panel("free and leaking", found.poses)]).collect())
    }
}
