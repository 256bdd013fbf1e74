//! A job for suction as the factory runs it.

use std::path::Path;

use super::{
    loaded::{LoadedObjects, walls},
    settings::SuctionJob,
    worker::{Shared, SuctionWorker},
};
use crate::{
    ProduceError, RunError,
    plan::{JobSplits, SubjectItems},
    products::settled::{SettledScene, by_content, cost_of_meshes, write_meshes},
    sections::{JobObject, JobObjects, shards_section},
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::{Product, SceneContainer, dataset::DatasetReader};
use kernel::{
    files::Folder,
    ids::{Digest, JobDigest},
};
use robot::grasp::SceneObstacle;

impl Work for SuctionJob {
    fn product(&self) -> Product {
        Product::SUCTION
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        let items = |scene: &SettledScene| SubjectItems { id: scene.id, items: bodies(scene), samples_per_item: 1 };
        self.scenes.list.iter().map(items).collect()
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend([shards_section("samples", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    fn subject_keys(&self) -> toml::Table {
        self.scenes.subject_keys(bodies)
    }

    fn objects(&self) -> Option<&JobObjects> {
        Some(&self.objects)
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        self.scenes.tables(bodies)
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        let objects = self.scenes.indices_of(&self.objects)?;
        let mut containers: Vec<(SceneContainer, Option<SceneObstacle>)> = Vec::new();
        for scene in &self.scenes.list {
            if containers.iter().all(|(known, _)| *known != scene.container) {
                containers.push((scene.container.clone(), walls(&scene.container)?));
            }
        }
        let scenes = DatasetReader::open(&Folder::at(&self.scenes_folder))?;
        let loaded = LoadedObjects::default();
        Ok(Box::new(OpenSuction(Shared { job: self, seed, level, scenes, containers, objects, loaded })))
    }

    fn remarks(&self) -> Vec<String> {
        let bodies: u32 = self.scenes.list.iter().map(bodies).sum();
        vec![
            format!(
                "{bodies} bodies of {} scenes, {} poses of each at most",
                self.scenes.list.len(),
                self.settings.poses
            ),
            format!(
                "a cup of {:.1} mm that holds up to {:.1} N",
                2000.0 * self.cup.settings().radius,
                self.cup.force(0.0)
            ),
            format!("root of the scenes {}", self.scenes.root),
        ]
    }
}

fn bodies(scene: &SettledScene) -> u32 {
    scene.bodies.len() as u32
}

/// A job for suction whose dataset is open.
struct OpenSuction<'j>(Shared<'j>);

impl OpenWork for OpenSuction<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(SuctionWorker::new(&self.0)))
    }

    /// Cost of the meshes, by those of a few.
    fn side_cost(&self, _: &[usize], folder: &Folder) -> Result<SideCost, ProduceError> {
        let write = |few: &[&JobObject]| write_meshes(few, folder, &JobDigest(Digest([0; 32])), Product::SUCTION);
        cost_of_meshes(&self.0.job.objects, write)
    }

    /// Writes the meshes.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        if closing.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        write_meshes(&by_content(&self.0.job.objects), closing.folder, &closing.job, Product::SUCTION)?;
        Ok(())
    }
}
