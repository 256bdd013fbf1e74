//! The row of volumes in the table of products.

use super::{
    headline::headline,
    inspection::{VolumeSurvey, images_in_words},
    page::{VolumesPage, cards, volume_words},
    painting::VolumePictures,
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::grouped,
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_volume_preview,
    product::{PICTURES, Page, ProductAssets, ProductPages, ProductWords, Survey},
    templates::page_values,
};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader, Sample},
};

/// Pages, texts and pictures of volumes.
pub static PAGES: ProductPages = ProductPages {
    product: Product::VOLUMES,
    words: ProductWords {
        lead: "Volumes of truncated signed distances, each fused from depth images of a settled scene, and the body at each voxel.",
        sample: "one fusion of several images of one settled scene",
        labels: "the content at the centre of every voxel (free, a body by its number, or the container), computed from meshes and poses, with the pose of every body",
        acquisition: "Depth images of settled scenes were fused into a cube of voxels over the middle of the container's floor; the images and their number were drawn at random.",
        reading: "",
        legend: "From left to right: the voxels at the fused surface, the true bodies (orange, without the container), a cut through \
                 the distances from the side (white free, blue in front of the observed surface, orange behind it, grey in no image), and the \
                 truth in the same cut.",
        regenerated: 64,
        tasks: &["robotics", "image-to-3d"],
    },
    templates: &TEMPLATES,
    survey: |reader| Ok(Box::new(VolumeSurvey::of(reader)?)),
    parts: None,
    headline,
    counts_in_words: |_, _| Ok(Vec::new()),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_volume_preview(reader)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Object,
        objects: AssetUse::Derived,
        descriptions: AssetUse::Measured,
        shape_files: &[],
        data_files: &[],
    },
};

/// Side of each part of a sample's picture in a release [px].
const SIDE: u32 = 240;

impl Survey for VolumeSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let (cards, job) = (cards(reader, self)?, reader.job_text()?);
        let shown = cards.len();
        Ok(Page { values: page_values(&VolumesPage::of(self, cards, &job)), shown })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let facts = &self.facts;
        numbers.rows.push(NumberRow::new("scenes", grouped(facts.scenes)));
        for (images, count) in &facts.by_images {
            numbers.rows.push(NumberRow::new(format!("volumes of {}", images_in_words(*images)), grouped(*count)));
        }
        numbers.rows.push(NumberRow::new("bodies that contain the centre of a voxel", grouped(facts.bodies_inside)));
        for (name, count) in facts.grasps.iter().flat_map(|grasps| grasps.rows()) {
            numbers.rows.push(NumberRow::new(format!("grasps {name}"), grouped(count)));
        }
        numbers.spreads = facts.spread_rows();
    }

    fn pictures(&self, reader: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        let mut drawn = Vec::new();
        for index in self.shown.iter().take(PICTURES) {
            let Some(sample) = reader.sample(*index)? else { continue };
            let (pictures, volume, truth) = VolumePictures::of(&sample, SIDE)?;
            drawn.push((volume_words(&volume, &truth), pictures.row(SIDE)));
        }
        Ok(drawn)
    }

    fn panels(&self, _: &DatasetReader, sample: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        Ok(VolumePictures::of(sample, side)?.0.panels())
    }
}
