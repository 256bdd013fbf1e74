//! The first picture of a set: one scene from its datasets, or the first picture of each dataset if they have no scenes.

use std::collections::{BTreeMap, BTreeSet};

use super::surveyed::SurveyedDataset;
use crate::scene_samples::{ScenePanel, SceneSample};
use format::dataset::DatasetError;
use kernel::ids::{ItemId, ObjectId};

/// A dataset with scenes, and its samples to show.
struct Source<'a> {
    dataset: &'a SurveyedDataset,
    samples: Vec<SceneSample>,
}

/// Matching samples of one scene, at most one per source, by the index of the source.
type SceneChoice = BTreeMap<usize, SceneSample>;

/// Draws the first picture of a set, panel by panel.
///
/// # Errors
/// When a file of a dataset is missing or damaged.
pub(super) fn draw(datasets: &[SurveyedDataset]) -> Result<Vec<ScenePanel>, DatasetError> {
    let sources = sources(datasets)?;
    let mut panels = Vec::new();
    for (source, sample) in choose(sources.iter().map(|source| source.samples.as_slice())) {
        let SurveyedDataset { reader, survey, .. } = sources[source].dataset;
        if let Some(sample) = reader.sample(sample.index)? {
            panels.extend(survey.scene_panels(reader, &sample)?);
        }
    }
    if panels.is_empty() { first_pictures(datasets) } else { Ok(panels) }
}

/// The first picture of each dataset.
fn first_pictures(datasets: &[SurveyedDataset]) -> Result<Vec<ScenePanel>, DatasetError> {
    let mut panels = Vec::new();
    for SurveyedDataset { name, reader, survey } in datasets {
        let first = survey.pictures(reader)?.into_iter().next();
        panels.extend(first.map(|(caption, picture)| ScenePanel {
            caption: format!("The first picture of {name}: {caption}."),
            pictures: vec![picture],
        }));
    }
    Ok(panels)
}

/// Datasets with scenes, in the order of the set: the first one of each product.
fn sources(datasets: &[SurveyedDataset]) -> Result<Vec<Source<'_>>, DatasetError> {
    let mut sources: Vec<Source<'_>> = Vec::new();
    let mut left_out = BTreeSet::new();
    for dataset in datasets {
        let samples = dataset.survey.scene_samples(&dataset.reader)?;
        if samples.is_empty() {
            continue;
        }
        // Views are identified by number, so samples made from the views of another dataset do not match.
        let is_of_others = dataset.inputs()?.iter().any(|input| left_out.contains(input));
        if is_of_others || sources.iter().any(|source| source.dataset.product() == dataset.product()) {
            left_out.insert(dataset.name.clone());
        } else {
            sources.push(Source { dataset, samples });
        }
    }
    Ok(sources)
}

/// Samples of the scene that the most sources can show and, among these, of the one with the smallest ratings; ties go to the
/// first, in the order of the first source.
fn choose<'a>(sources: impl Iterator<Item = &'a [SceneSample]>) -> SceneChoice {
    let mut scenes: Vec<ObjectId> = Vec::new();
    let mut samples: BTreeMap<ObjectId, Vec<(usize, SceneSample)>> = BTreeMap::new();
    for (source, of_source) in sources.enumerate() {
        for sample in of_source {
            let of_scene = samples.entry(sample.scene).or_default();
            if of_scene.is_empty() {
                scenes.push(sample.scene);
            }
            of_scene.push((source, *sample));
        }
    }
    let mut chosen = SceneChoice::new();
    for scene in scenes {
        let found = choose_of_scene(&samples[&scene]);
        if shows_more(&found, &chosen) {
            chosen = found;
        }
    }
    chosen
}

/// Whether matching samples are better than others: more sources, or equally many with smaller ratings.
fn shows_more(these: &SceneChoice, others: &SceneChoice) -> bool {
    let distance = |choice: &SceneChoice| choice.values().map(|sample| sample.distance).sum::<f64>();
    these.len() > others.len() || (these.len() == others.len() && distance(these) < distance(others))
}

/// The matching samples of one scene: those of one view and of the whole scene. The view is the one with samples of the most
/// sources and, among these, the smallest ratings; ties go to the first.
fn choose_of_scene(samples: &[(usize, SceneSample)]) -> SceneChoice {
    let views: BTreeSet<Option<ItemId>> = samples.iter().map(|(_, sample)| sample.view).collect();
    let mut best = SceneChoice::new();
    for view in views {
        let mut found = SceneChoice::new();
        for (source, sample) in samples.iter().filter(|(_, sample)| sample.view.is_none() || sample.view == view) {
            let nearest = found.entry(*source).or_insert(*sample);
            if sample.distance < nearest.distance {
                *nearest = *sample;
            }
        }
        if shows_more(&found, &best) {
            best = found;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::ids::{Digest, SampleIndex};

    fn sample(index: u64, scene: &str, view: Option<u32>, distance: f64) -> SceneSample {
        let scene = ObjectId(Digest::hash(scene.as_bytes()));
        SceneSample { index: SampleIndex(index), scene, view: view.map(ItemId), distance }
    }

    /// Indices of the chosen samples, by source.
    fn chosen(sources: &[&[SceneSample]]) -> Vec<(usize, u64)> {
        choose(sources.iter().copied()).into_iter().map(|(source, sample)| (source, sample.index.0)).collect()
    }

    #[test]
    fn a_scene_that_all_sources_know_is_shown() {
        let views = [sample(0, "a", Some(0), 0.0), sample(1, "b", Some(0), 0.0), sample(2, "c", Some(0), 0.0)];
        let picks = [sample(4, "b", None, 0.0), sample(5, "b", None, 0.0), sample(6, "c", None, 0.0)];
        assert_eq!(chosen(&[&views, &picks]), [(0, 1), (1, 4)]);
        // If no scene has everything, the first that has the most.
        assert_eq!(chosen(&[&views[..1], &picks[2..]]), [(0, 0)]);
        assert_eq!(chosen(&[]), []);
        // Among the scenes of all sources, the one that shows the most: here, more bodies.
        let views = [(0, "a", 0.5), (1, "b", 0.1), (2, "c", 0.2), (3, "d", 0.05)];
        let views = views.map(|(index, scene, distance)| sample(index, scene, Some(0), distance));
        let picks = ["a", "b", "c"].map(|scene| sample(9, scene, None, 0.0));
        assert_eq!(chosen(&[&views, &picks]), [(0, 1), (1, 9)]);
    }

    #[test]
    fn the_view_is_that_of_the_nearest_sample() {
        let views = [0, 1, 2].map(|view| sample(view.into(), "a", Some(view), 0.0));
        let pairs = [(0, 0.4), (1, 0.1), (1, 0.05), (1, 0.05), (2, 0.05)];
        let pairs: Vec<SceneSample> =
            (0..).zip(pairs).map(|(index, (view, distance))| sample(index, "a", Some(view), distance)).collect();
        let picks = [sample(9, "a", None, 0.0)];
        assert_eq!(chosen(&[&views, &pairs, &picks]), [(0, 1), (1, 2), (2, 9)]);
        // A view without a pair shows less than one with a bad pair.
        assert_eq!(chosen(&[&views, &pairs[..1], &picks]), [(0, 0), (1, 0), (2, 9)]);
        assert_eq!(chosen(&[&picks]), [(0, 9)]);
    }
}
