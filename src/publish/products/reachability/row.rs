//! The row of reachability in the table of products.

use super::{
    inspection::{PoseCounts, ReachabilityFacts, facts_of, headline},
    page::{ReachabilityPage, pictures, upright_picture},
    templates::TEMPLATES,
};
use crate::{
    asset::{AssetKind, AssetUse},
    chart::{grouped, percent},
    inspection::Inspection,
    numbers::{NumberRow, Numbers},
    picture::{Panel, Picture},
    preview::write_map_preview,
    product::{Page, ProductAssets, ProductPages, ProductWords, SampleParts, Survey},
    templates::page_values,
};
use format::{
    Noun, Product, ReachabilityField,
    dataset::{DatasetError, DatasetReader, Sample},
    extras::read_field,
    products::reachability::FIELD,
};
use kernel::geom::PoseLabel;

/// Pages, texts and pictures of reachability maps.
pub static PAGES: ProductPages = ProductPages {
    product: Product::REACHABILITY,
    words: ProductWords {
        lead: "For each pose of a grid, whether a robot's end effector reaches it without a collision, the evidence for this, and the signed distance to the border of the reachable set.",
        sample: "one position of the robot's end effector, with all its orientations",
        labels: "for each pose whether it is reachable, and the evidence for this",
        acquisition: "For each pose, inverse kinematics was solved or shown to have no solution, and collisions were checked.",
        reading: "`field.mcap` contains labels and signed distances of the whole grid. `graspmill query reach . --pose x,y,z,roll,pitch,yaw` queries it.",
        legend: "Each square is a position: the greener, the more approach directions are reachable; the more orange, the more end in a collision; white is unreachable. Cuts at y are viewed from the robot's right, cuts at z from above with x up.",
        regenerated: 64,
        tasks: &["robotics"],
    },
    templates: &TEMPLATES,
    survey: |reader| {
        let field = read_field(reader.folder())?;
        Ok(Box::new(MapSurvey { facts: facts_of(reader, &field)?, field }))
    },
    parts: Some(SampleParts {
        noun: Noun { one: "pose", many: "poses" },
        count: |manifest| PoseCounts::of(manifest).poses(),
    }),
    headline,
    counts_in_words: |_, manifest| Ok(PoseCounts::of(manifest).in_words()),
    warnings: |_| Ok(Vec::new()),
    write_preview: |reader, _| Ok(write_map_preview(reader.folder(), &read_field(reader.folder())?)?),
    preview_shows_more: false,
    assets: ProductAssets {
        subjects: AssetKind::Robot,
        objects: AssetUse::Derived,
        descriptions: AssetUse::Measured,
        shape_files: &[],
        data_files: &[FIELD],
    },
};

/// Side of a position in a cross-section [px].
const CELL: u32 = 16;

/// Facts and field of a map.
struct MapSurvey {
    facts: ReachabilityFacts,
    field: ReachabilityField,
}

impl Survey for MapSurvey {
    fn inspection(&self) -> Inspection {
        Inspection::of(&self.facts)
    }

    fn page(&self, reader: &DatasetReader) -> Result<Page, DatasetError> {
        let job = reader.job_text()?;
        let page = ReachabilityPage::of(&self.facts, &self.field, &job);
        Ok(Page { values: page_values(&page), shown: page.shown() })
    }

    fn add_numbers(&self, numbers: &mut Numbers) {
        let (facts, rows) = (&self.facts, &mut numbers.rows);
        let robot = &facts.robot;
        rows.push(NumberRow::with_code("robot", format!("{}, content", robot.name), robot.id));
        rows.push(NumberRow::new("planning group", robot.joints.join(", ")));
        rows.push(NumberRow::new("target", format!("site {}", robot.target)));
        rows.push(NumberRow::new("poses", grouped(facts.poses)));
        for label in PoseLabel::ALL.into_iter().rev() {
            let count = facts.labels.get(label.name()).copied().unwrap_or(0);
            let share = percent(count as f64 / facts.poses.max(1) as f64);
            let what = format!("poses: {}", label.name().replace('_', " "));
            rows.push(NumberRow::new(what, format!("{} ({share})", grouped(count))));
        }
        for (proof, count) in facts.proofs.iter().filter(|(_, count)| **count > 0) {
            rows.push(NumberRow::new(format!("known by {}", proof.replace('_', " ")), grouped(*count)));
        }
        rows.push(NumberRow::new("collisions", &facts.collisions));
        rows.push(NumberRow::new("orientations", &facts.covering.words));
        if let (Some(min), Some(max)) = (facts.field.min, facts.field.max) {
            let range = format!("{min:.4} to {max:.4} {}, negative inside", facts.field.unit);
            rows.push(NumberRow::new("signed distance", range));
        }
    }

    fn pictures(&self, _: &DatasetReader) -> Result<Vec<(String, Picture)>, DatasetError> {
        Ok(pictures(&self.field, CELL))
    }

    fn panels(&self, _: &DatasetReader, _: &Sample, side: u32) -> Result<Vec<Panel>, DatasetError> {
        Ok(vec![Panel { caption: "reachable poses".to_owned(), picture: upright_picture(&self.field, side) }])
    }
}
