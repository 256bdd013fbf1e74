//! A job for picks as the factory runs it.

use std::path::Path;

use super::{
    loaded::LoadedObjects,
    settings::{PickJob, PickSource},
    worker::{PickWorker, Shared},
};
use crate::{
    ProduceError, RunError,
    plan::{JobSplits, SubjectItems},
    products::{
        grasps::{GraspHand, hand_shape},
        settled::{SettledScene, add_meshes, by_content, cost_of_meshes},
        surroundings::settled_container,
    },
    sections::{JobObject, JobObjects, shards_section},
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::{Channel, Product, SceneContainer, dataset::DatasetReader, extras::ShapesWriter};
use kernel::{
    files::Folder,
    ids::{Digest, JobDigest},
    words::NumberClass,
};
use sim::{Container, HandModel, sim_facts};

impl Work for PickJob {
    fn product(&self) -> Product {
        Product::PICKS
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
        let tried = (self.settings.trials > 0).then_some((Channel::PICK_TRIALS, NumberClass::Physics));
        let platform = tried.map(|_| sim_facts().platform(None)).unwrap_or_default();
        let tables = self.scenes.tables(bodies);
        WorkTables { channel_classes: tried.into_iter().collect(), platform, hands: vec![self.hand.row()], ..tables }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let objects = self.scenes.indices_of(&self.objects)?;
        let hand = GraspHand::open(&self.hand, HandModel::check_grasping)?;
        let mut containers: Vec<(SceneContainer, Container)> = Vec::new();
        for scene in &self.scenes.list {
            if containers.iter().all(|(known, _)| *known != scene.container) {
                containers.push((scene.container.clone(), settled_container(&scene.container)?));
            }
        }
        let scenes = DatasetReader::open(&Folder::at(&self.scenes_folder))?;
        let loaded = LoadedObjects::default();
        let Opening { seed, level, .. } = opening;
        Ok(Box::new(OpenPicks(Shared { job: self, seed, level, scenes, hand, containers, objects, loaded })))
    }

    fn remarks(&self) -> Vec<String> {
        let bodies: u32 = self.scenes.list.iter().map(bodies).sum();
        let mut remarks = vec![format!("{bodies} bodies of {} scenes", self.scenes.list.len())];
        let of_scenes = format!("root of the scenes {}", self.scenes.root);
        match &self.source {
            PickSource::Transferred { grasps, .. } => {
                let stored: usize = grasps.objects.values().map(Vec::len).sum();
                let (take, rolls) = (grasps.take.name(), self.settings.rolls);
                remarks.push(format!("{stored} stored grasps that are {take}, each in {rolls} directions"));
                remarks.extend([of_scenes, format!("root of the grasps {}", grasps.root)]);
                remarks.extend(grasps.trials.map(|root| format!("root of their trials {root}")));
            }
            PickSource::Scene(scene) => {
                remarks.push(format!("grasps sampled in the scene, from {} poses of each body at most", scene.poses));
                remarks.push(of_scenes);
            }
        }
        remarks
    }
}

fn bodies(scene: &SettledScene) -> u32 {
    scene.bodies.len() as u32
}

/// A job for picks whose hand and datasets are open.
struct OpenPicks<'j>(Shared<'j>);

impl OpenWork for OpenPicks<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(PickWorker::new(&self.0)?))
    }

    /// Cost of hand and meshes, by those of a few.
    fn side_cost(&self, _: &[usize], folder: &Folder) -> Result<SideCost, ProduceError> {
        let write = |few: &[&JobObject]| self.write_shapes(few, folder, &JobDigest(Digest([0; 32])));
        cost_of_meshes(&self.0.job.objects, write)
    }

    /// Writes the shapes of the hand and the meshes.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        if closing.cancel.is_cancelled() {
            return Err(RunError::Interrupted);
        }
        self.write_shapes(&by_content(&self.0.job.objects), closing.folder, &closing.job)?;
        Ok(())
    }
}

impl OpenPicks<'_> {
    /// Writes the hand and objects that are sorted by content; the size of the file [bytes].
    fn write_shapes(&self, objects: &[&JobObject], folder: &Folder, job: &JobDigest) -> Result<u64, ProduceError> {
        let hand = hand_shape(&self.0.hand, self.0.job.hand.id);
        let mut writer = ShapesWriter::create(folder, job, Product::PICKS, &hand)?;
        add_meshes(&mut writer, objects)?;
        Ok(writer.finish(None)?)
    }
}
