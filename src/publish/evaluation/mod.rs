//! Page of a comparison of completions: the table, and pictures of the best, median and worst sample of each method.

mod templates;

use std::path::Path;

use serde::Serialize;

use crate::{
    page::ImageView,
    picture::{Eye, VoxelPainter},
    templates::page_values,
};
use format::dataset::DatasetError;
use kernel::{files, geom::OccupancyGrid};

#[cfg(test)]
pub(super) use templates::PAGE_TEMPLATE;
pub(super) use templates::TEMPLATES;

/// Side of each picture [px].
const SIDE: u32 = 200;

/// A comparison of completions on the samples of one dataset, as text.
pub struct Evaluation {
    /// Name of the dataset.
    pub dataset: String,
    /// Root digest of the dataset.
    pub root: String,
    /// Sentence with samples, objects and split.
    pub lead: String,
    /// Heads of the table's columns.
    pub head: Vec<String>,
    /// One row per completion method and meshing method, with one text per column.
    pub rows: Vec<Vec<String>>,
    /// Sentences about the table.
    pub notes: Vec<String>,
    /// Samples to show, by method.
    pub methods: Vec<EvaluatedMethod>,
}

/// A method with some of its samples.
pub struct EvaluatedMethod {
    /// Name of the method.
    pub name: String,
    /// The samples, the best first.
    pub samples: Vec<EvaluatedSample>,
}

/// A sample completed by a method. All grids share one resolution and one frame.
pub struct EvaluatedSample {
    /// Sentence that names the sample and its scores.
    pub caption: String,
    /// Cells that the camera observed.
    pub partial: OccupancyGrid,
    /// Cells that the method predicts.
    pub completed: OccupancyGrid,
    /// The true grid.
    pub truth: OccupancyGrid,
}

/// Input of the page's template.
#[derive(Serialize)]
pub(super) struct EvaluationPage<'a> {
    dataset: &'a str,
    root: &'a str,
    lead: &'a str,
    head: &'a [String],
    rows: &'a [Vec<String>],
    notes: &'a [String],
    methods: Vec<MethodView<'a>>,
}

#[derive(Serialize)]
struct MethodView<'a> {
    name: &'a str,
    samples: Vec<SampleView<'a>>,
}

#[derive(Serialize)]
struct SampleView<'a> {
    caption: &'a str,
    /// Completed and true cells from the camera's side, then both from behind.
    images: [ImageView; 4],
}

impl EvaluatedSample {
    fn view(&self) -> SampleView<'_> {
        let Self { caption, partial, completed, truth } = self;
        let draw = |eye: Eye| {
            let painter = VoxelPainter::new(SIDE, eye, &[partial, completed, truth]);
            [completed, truth]
                .map(|grid| ImageView::of(&painter.draw(Some(partial), Some(grid)).with_few_colours(), SIDE, SIDE))
        };
        let ([front, true_front], [back, true_back]) = (draw(Eye::CameraSide), draw(Eye::Behind));
        SampleView { caption, images: [front, true_front, back, true_back] }
    }
}

impl Evaluation {
    pub(super) fn page(&self) -> EvaluationPage<'_> {
        let Self { dataset, root, lead, head, rows, notes, methods } = self;
        let methods = methods.iter().map(|method| MethodView {
            name: &method.name,
            samples: method.samples.iter().map(EvaluatedSample::view).collect(),
        });
        EvaluationPage { dataset, root, lead, head, rows, notes, methods: methods.collect() }
    }

    /// Writes the page. The bytes depend only on the comparison, not on time, machine or path.
    ///
    /// # Errors
    /// When the file can't be written.
    ///
    /// # Panics
    /// When the grids of a sample differ in resolution.
    pub fn write(&self, path: &Path) -> Result<(), DatasetError> {
        let html = TEMPLATES.render_page(&page_values(&self.page()));
        files::replace(path, html.as_bytes()).map_err(DatasetError::io("writing", path))
    }

    /// A comparison of one method with this name, with or without a sample and sentences.
    #[cfg(test)]
    pub(super) fn example(name: &str, is_full: bool) -> Self {
        let grid = OccupancyGrid::new(2);
        let sample =
            EvaluatedSample { caption: name.to_owned(), partial: grid.clone(), completed: grid.clone(), truth: grid };
        Self {
            dataset: name.to_owned(),
            root: "0123".to_owned(),
            lead: name.to_owned(),
            head: vec![String::new(), name.to_owned()],
            rows: vec![vec![name.to_owned(), "0.5".to_owned()]],
            notes: is_full.then(|| name.to_owned()).into_iter().collect(),
            methods: vec![EvaluatedMethod {
                name: name.to_owned(),
                samples: is_full.then_some(sample).into_iter().collect(),
            }],
        }
    }
}
