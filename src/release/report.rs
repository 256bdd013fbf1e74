//! `report.html`: one file that shows a dataset, with no link to anything outside it.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{
    card::card,
    grasp_report,
    grasps::GraspSurvey,
    notes::write_in_place,
    page::shell,
    patch_report,
    patches::PatchSurvey,
    reach_report, reachability,
    sections::{distributions, header, how_to_check, job, objects, sample_in_words, speed, splits},
    survey::Survey,
};
use crate::{
    dataset::{DatasetError, DatasetReader, read_field},
    ids::{ObjectId, Product},
};

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportSummary {
    /// The page.
    pub path: PathBuf,
    /// Its size [bytes].
    pub bytes: u64,
    /// Samples with pictures; of a reachability dataset, cross-sections; of grasps,
    /// objects; of patches, grasps.
    pub shown: usize,
}

/// Writes the page of the finished dataset in `folder` to `out` (`report.html` in the folder when `None`).
///
/// Reads the tables and the shards' ledgers, one at a time, and decodes the shown samples alone; of a reachability dataset,
/// tables and field. The page depends on
/// the dataset and on `notes.json`, not on clock, machine or path (but for a job without a name).
///
/// # Errors
/// When the dataset is not finished, a file is missing or damaged, or the page can't be written.
pub fn report(folder: &Path, out: Option<&Path>) -> Result<ReportSummary, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let (page, shown) = match reader.manifest().product {
        Product::Completion => {
            let survey = Survey::of(&reader)?;
            let gallery = gallery(&reader, &survey)?;
            (page(&survey, &gallery, &reader.job_text()?), survey.picks.len())
        }
        Product::Grasps => grasp_report::page(&reader, &GraspSurvey::of(&reader)?)?,
        Product::Patches => patch_report::page(&reader, &PatchSurvey::of(&reader)?)?,
        Product::Reachability => {
            let field = read_field(folder)?;
            let facts = reachability::facts_of(&reader, &field)?;
            reach_report::page(&facts, &field, &reader.job_text()?)
        }
    };
    let path = out.map_or_else(|| folder.join("report.html"), Path::to_owned);
    write_in_place(&path, page.as_bytes())?;
    Ok(ReportSummary { path, bytes: page.len() as u64, shown })
}

fn gallery(reader: &DatasetReader, survey: &Survey) -> Result<String, DatasetError> {
    let names: BTreeMap<ObjectId, &str> =
        survey.facts.objects.iter().map(|object| (object.object, object.name.as_str())).collect();
    let mut html = String::new();
    for pick in &survey.picks {
        if let Some(sample) = reader.sample(pick.index)? {
            let name = names.get(&sample.id.subject).copied().unwrap_or("?");
            html.push_str(&card(&sample, pick, name, reader.split(pick.index))?);
        }
    }
    Ok(html)
}

fn page(survey: &Survey, gallery: &str, job_text: &str) -> String {
    let facts = &survey.facts;
    let sections = [
        header(facts),
        how_to_check(facts),
        sample_in_words(facts),
        format!(
            concat!(
                "<section id=\"gallery\"><h2>Samples</h2><p>Extremes first, then one drawn sample for each split and for ",
                "objects at even steps through their names. Pictures of one sample share their scale; slices go through ",
                "the middle of the solid's cells, and the marks at their rims show where the other two cut.</p>{}</section>"
            ),
            gallery
        ),
        distributions(survey),
        splits(survey),
        objects(facts),
        speed(facts),
        job(job_text),
    ];
    shell(&facts.name, &sections.join("\n"))
}
