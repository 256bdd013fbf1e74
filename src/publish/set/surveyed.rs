//! The datasets of a set, each surveyed once for its own page and for that of the set.

use crate::{inspection::job_table, product::Survey, products::pages_of};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, SetTable},
};
use kernel::files::Folder;

/// A dataset of a set, surveyed.
pub(crate) struct SurveyedDataset {
    /// Name of the dataset, and of its folder in the set's.
    pub name: String,
    pub reader: DatasetReader,
    pub survey: Box<dyn Survey>,
}

impl SurveyedDataset {
    /// Surveys the datasets of a finished set, in their order.
    ///
    /// # Errors
    /// When one is not finished, or a file is missing or damaged.
    pub fn all(folder: &Folder, table: &SetTable) -> Result<Vec<Self>, DatasetError> {
        let surveyed = |name: &String| {
            let reader = DatasetReader::open(&folder.subfolder(name))?;
            let survey = (pages_of(reader.manifest().product).survey)(&reader)?;
            Ok(Self { name: name.clone(), reader, survey })
        };
        table.jobs.iter().map(|job| surveyed(&job.name)).collect()
    }

    /// Product of the dataset.
    pub fn product(&self) -> Product {
        self.reader.manifest().product
    }

    /// Names of the neighbouring folders from which its job reads datasets.
    ///
    /// # Errors
    /// When the job is missing or damaged.
    pub fn inputs(&self) -> Result<Vec<String>, DatasetError> {
        let job = job_table(&self.reader)?;
        let input = |section: &toml::Value| Some(section.get("dataset")?.as_str()?.strip_prefix("../")?.to_owned());
        Ok(job.values().filter_map(input).collect())
    }
}
