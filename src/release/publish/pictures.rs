//! A few pictures of a dataset as PNG files, from the report's own drawing code.

use std::collections::BTreeSet;

use crate::{
    dataset::{DatasetError, DatasetReader},
    ids::ObjectId,
    release::{card, grasp_report, patch_report, picture::Picture, reach_report},
};

use super::numbers::Surveyed;

/// Pictures of a release.
const MOST: usize = 4;
/// Side of a sample's or grasp's picture [px].
const SIDE: u32 = 240;
/// Side of a position in a cross-section [px].
const CELL: u32 = 16;

/// A picture and what it shows.
pub(super) struct Shown {
    /// Path in the release's folder.
    pub path: String,
    /// What it is of, plain text.
    pub caption: String,
    /// The picture.
    pub picture: Picture,
}

/// What the parts of each picture are, from left to right, and what the colours mean.
pub(super) fn legend(surveyed: &Surveyed) -> &'static str {
    match surveyed {
        Surveyed::Completion(_) => {
            "From left to right: depth (near is light), what the camera saw (blue cells), the whole solid (orange), and both \
             from behind."
        }
        Surveyed::Grasps(_) => {
            "The closed hand (blue) on the object (orange), a dot at each contact, from two sides; of each object the kept \
             grasp of the highest epsilon, or the state of lowest energy where none was kept."
        }
        Surveyed::Patches(_) => {
            "From left to right: the patches around the palm and the three fingertips of one grasp."
        }
        Surveyed::Reachability(..) => {
            "Each square is a position: the greener, the more directions of approach are reachable, the more orange, the more end \
             in a collision, white where none leads there. Cuts at y are seen from the robot's right, cuts at z from above with x \
             up."
        }
    }
}

/// The pictures of a dataset.
pub(super) fn pictures(reader: &DatasetReader, surveyed: &Surveyed) -> Result<Vec<Shown>, DatasetError> {
    let drawn = match surveyed {
        Surveyed::Completion(survey) => {
            let mut drawn: Vec<(String, Picture)> = Vec::new();
            let mut seen: BTreeSet<ObjectId> = BTreeSet::new();
            for pick in &survey.picks {
                let Some(sample) = reader.sample(pick.index)? else { continue };
                if drawn.len() < MOST && seen.insert(sample.id.subject) {
                    let object = survey.facts.objects.iter().find(|object| object.object == sample.id.subject);
                    let name = object.map_or("?", |object| object.name.as_str());
                    let caption = format!("{name}, view {}", sample.id.view);
                    drawn.push((caption, card::picture_of(&sample, SIDE)?));
                }
            }
            drawn
        }
        Surveyed::Grasps(survey) => grasp_report::pictures(reader, survey, MOST, SIDE)?,
        Surveyed::Patches(survey) => {
            let mut drawn = Vec::new();
            for index in survey.picks.iter().filter_map(|picks| picks.first()).take(MOST) {
                let Some(sample) = reader.sample(*index)? else { continue };
                let patch = sample.heatmap_patch()?;
                let object = survey.facts.objects.iter().find(|object| object.object == sample.id.subject);
                let name = object.map_or("?", |object| object.name.as_str());
                let caption = format!("{name}, grasp of type {}", patch.kind());
                drawn.push((caption, patch_report::picture_of(&patch, sample.patch_colour()?.as_ref())));
            }
            drawn
        }
        Surveyed::Reachability(_, field) => reach_report::pictures(field, CELL),
    };
    let named = drawn.into_iter().enumerate().map(|(place, (caption, picture))| {
        let path = format!("pictures/{}.png", place + 1);
        Shown { path, caption, picture }
    });
    Ok(named.collect())
}
