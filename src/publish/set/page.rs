//! The page of a set: one picture of the datasets' joint content, and a summary of each dataset.

use std::collections::BTreeSet;

use serde::Serialize;

use super::{Cover, surveyed::SurveyedDataset};
use crate::{
    asset::AssetKind,
    chart::{grouped, percent},
    counts::counts_in_words,
    page::ImageView,
    product::GraspFunnel,
    products::pages_of,
    scene_samples::ScenePanel,
};
use format::dataset::{DatasetError, SetContent, SetTable, layout::REPORT};
use kernel::{ids::ObjectId, words::size_in_words};

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct SetPage<'a> {
    name: &'a str,
    root: String,
    format: u32,
    numbers: HeaderNumbers,
    panels: Vec<PanelView>,
    rows: Vec<DatasetRow<'a>>,
    /// Grasps in scenes by hand; empty if no dataset has some.
    funnels: Vec<FunnelRow<'a>>,
    /// Names shared by several objects.
    differing: Vec<&'a str>,
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    datasets: String,
    samples: String,
    objects: String,
    size: String,
}

/// A panel of the first picture.
#[derive(Serialize)]
struct PanelView {
    caption: String,
    images: Vec<ImageView>,
}

/// A dataset of the set.
#[derive(Serialize)]
struct DatasetRow<'a> {
    name: &'a str,
    product: &'static str,
    /// Sentence about the product.
    lead: &'static str,
    /// Stored samples with their noun.
    samples: String,
    /// Objects, or robots.
    objects: String,
    size: String,
    /// The first digits of its root digest.
    root: String,
    /// Path of the report from the set's folder; `None` if the page is elsewhere.
    report: Option<String>,
    /// Counts as text.
    counts: Vec<String>,
}

/// Grasps of one hand in the scenes of one dataset.
#[derive(Serialize)]
struct FunnelRow<'a> {
    dataset: &'a str,
    hand: String,
    bodies: String,
    with_free: String,
    candidates: String,
    free: String,
    tried: String,
    lifted: String,
    held: String,
}

impl<'a> FunnelRow<'a> {
    fn of(dataset: &'a str, funnel: GraspFunnel) -> Self {
        let GraspFunnel { hand, bodies, bodies_with_free, candidates, free, trials } = funnel;
        let with_share =
            |count: u64, of: u64| format!("{} ({})", grouped(count), percent(count as f64 / of.max(1) as f64));
        let tried = |index: usize| trials.map_or(String::new(), |counts| with_share(counts[index], counts[0]));
        Self {
            dataset,
            hand,
            bodies: grouped(bodies),
            with_free: with_share(bodies_with_free, bodies),
            candidates: grouped(candidates),
            free: with_share(free, candidates),
            tried: trials.map_or(String::new(), |[tried, ..]| grouped(tried)),
            lifted: tried(1),
            held: tried(2),
        }
    }
}

impl<'a> SetPage<'a> {
    /// The page of a set with these datasets, cover and panels; with links to the reports of the datasets if `has_links`.
    ///
    /// # Errors
    /// When a table of a dataset is missing or damaged.
    pub fn of(
        table: &'a SetTable,
        content: &'a SetContent,
        datasets: &'a [SurveyedDataset],
        (cover, panels): (Option<&Cover>, &[ScenePanel]),
        has_links: bool,
    ) -> Result<Self, DatasetError> {
        let (mut rows, mut objects) = (Vec::new(), BTreeSet::<ObjectId>::new());
        let (mut samples, mut size) = (0, 0);
        for SurveyedDataset { name, reader, .. } in datasets {
            let manifest = reader.manifest();
            let pages = pages_of(manifest.product);
            let assets = reader.assets()?;
            let count = grouped(assets.objects.len() as u64);
            let (kept, bytes) = (manifest.counts.kept, manifest.entries().values().map(|file| file.bytes).sum());
            samples += kept;
            size += bytes;
            let are_objects = pages.assets.subjects == AssetKind::Object;
            objects.extend(assets.objects.iter().filter(|_| are_objects).map(|row| row.object));
            rows.push(DatasetRow {
                name,
                product: manifest.product.name,
                lead: pages.words.lead,
                samples: format!("{} {}", grouped(kept), manifest.product.samples.for_count(kept)),
                objects: if are_objects { count } else { format!("{count} {}", pages.assets.subjects.name()) },
                size: size_in_words(bytes),
                root: manifest.root.short().to_string(),
                report: has_links.then(|| format!("{name}/{REPORT}")),
                counts: counts_in_words(reader.folder())?,
            });
        }
        let panel = |panel: &ScenePanel| PanelView {
            caption: panel.caption.clone(),
            images: panel
                .pictures
                .iter()
                .map(|picture| ImageView::of(picture, picture.width, picture.height))
                .collect(),
        };
        let funnel = |dataset: &'a SurveyedDataset| Some(FunnelRow::of(&dataset.name, dataset.survey.funnel()?));
        let funnels = datasets.iter().filter_map(funnel).collect();
        let of_cover = |cover: &Cover| PanelView {
            caption: cover.caption.clone(),
            images: vec![ImageView::of_png(cover.png(), cover.size())],
        };
        Ok(Self {
            name: &table.name,
            root: content.root.to_string(),
            format: table.format_version,
            numbers: HeaderNumbers {
                datasets: grouped(rows.len() as u64),
                samples: grouped(samples),
                objects: grouped(objects.len() as u64),
                size: size_in_words(size),
            },
            panels: cover.map(of_cover).into_iter().chain(panels.iter().map(panel)).collect(),
            rows,
            funnels,
            differing: content.differing.iter().map(String::as_str).collect(),
        })
    }
}

#[cfg(test)]
impl<'a> SetPage<'a> {
    /// A page of one dataset of this name, with a picture and links or without.
    pub fn example(name: &'a str, is_full: bool) -> Self {
        let image = ImageView::of(&crate::picture::Picture::filled(1, 1, [0; 4]), 1, 1);
        let [datasets, samples, objects, size] = ["1", "5", "1", "7 bytes"].map(str::to_owned);
        Self {
            name,
            root: "0123".to_owned(),
            format: format::FORMAT_VERSION,
            numbers: HeaderNumbers { datasets, samples, objects, size },
            panels: is_full.then(|| PanelView { caption: name.to_owned(), images: vec![image] }).into_iter().collect(),
            rows: vec![DatasetRow {
                name,
                product: "pairs",
                lead: "Pairs.",
                samples: "5 pairs".to_owned(),
                objects: "1".to_owned(),
                size: "7 bytes".to_owned(),
                root: "0123".to_owned(),
                report: is_full.then(|| format!("{name}/{REPORT}")),
                counts: vec![name.to_owned()],
            }],
            funnels: is_full
                .then(|| {
                    let hand = name.to_owned();
                    let trials = Some([4, 3, 2]);
                    let funnel =
                        GraspFunnel { hand, bodies: 9, bodies_with_free: 8, candidates: 700, free: 60, trials };
                    FunnelRow::of(name, funnel)
                })
                .into_iter()
                .collect(),
            differing: is_full.then_some(name).into_iter().collect(),
        }
    }
}
