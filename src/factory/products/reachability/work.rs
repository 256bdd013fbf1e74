//! A reachability job as the factory runs it.

use std::{collections::BTreeMap, path::Path};

use super::{
    labeller::PoseLabeller,
    settings::{CollisionTest, ReachabilityJob},
    worker::ReachabilityWorker,
};
use crate::{
    ProduceError, RunError,
    plan::{JobSplits, SubjectItems},
    sections::shards_section,
    work::{Closing, OpenWork, Opening, Producer, SideCost, Work, WorkTables},
};
use format::{FieldHeader, Product, dataset::scan_shards, extras::write_field};
use kernel::{files::Folder, words::NumberClass};
use sim::sim_facts;

impl Work for ReachabilityJob {
    fn product(&self) -> Product {
        Product::REACHABILITY
    }

    fn subjects(&self) -> Vec<SubjectItems> {
        vec![SubjectItems { id: self.robot.id, items: self.positions(), samples_per_item: 1 }]
    }

    fn resolved(&self, folder: &Path, shard_samples: u32) -> toml::Table {
        let mut keys = self.keys(Some(folder));
        keys.extend([shards_section("positions", shard_samples)]);
        keys
    }

    fn sample_keys(&self) -> toml::Table {
        self.keys(None)
    }

    fn subject_keys(&self) -> toml::Table {
        toml::Table::from_iter([("robot".to_owned(), self.robot.id.0.hex().into())])
    }

    fn tables(&self, _: Option<&JobSplits>) -> WorkTables {
        let (class, platform) = match self.collisions {
            CollisionTest::Exact | CollisionTest::None => (NumberClass::Exact, BTreeMap::new()),
            CollisionTest::Mujoco => (NumberClass::Physics, sim_facts().platform(None)),
        };
        let robot = &self.robot;
        let row = serde_json::json!({
            "object": robot.id,
            "name": robot.name,
            "joints": robot.joints,
            "target": robot.target,
            "fixed": robot.fixed,
        });
        WorkTables {
            class,
            channel_classes: BTreeMap::new(),
            platform,
            assets: vec![row],
            subjects: Vec::new(),
            hands: Vec::new(),
            containers: Vec::new(),
            splits: None,
        }
    }

    fn open(&self, opening: Opening<'_>) -> Result<Box<dyn OpenWork + '_>, ProduceError> {
        let Opening { seed, level, .. } = opening;
        Ok(Box::new(OpenReachability { job: self, labeller: PoseLabeller::new(self, seed, level)? }))
    }

    /// `covering_radius`: the largest angle between any rotation and the nearest orientation of the grid [rad].
    fn figures(&self) -> BTreeMap<&'static str, f64> {
        BTreeMap::from([("covering_radius", self.poses.covering().radius)])
    }

    fn remarks(&self) -> Vec<String> {
        let (orientations, poses) = (self.orientations(), self.poses.cells());
        vec![format!("{orientations} orientations per position: {poses} poses"), self.poses.covering().to_string()]
    }
}

/// A reachability job whose robot is open.
struct OpenReachability<'j> {
    job: &'j ReachabilityJob,
    labeller: PoseLabeller,
}

impl OpenWork for OpenReachability<'_> {
    fn producer(&self) -> Result<Box<dyn Producer + '_>, ProduceError> {
        Ok(Box::new(ReachabilityWorker::new(self.job, &self.labeller)))
    }

    /// Bytes of `field.mcap`, which no few positions tell.
    fn side_cost(&self, _: &[usize], _: &Folder) -> Result<SideCost, ProduceError> {
        // Measured on the Fetch and the TX60L: 0.40 and 0.48 bytes per cell of the field.
        Ok(SideCost { bytes: 0.45 * self.job.poses.cells() as f64, seconds: 0.0 })
    }

    /// Writes `field.mcap`.
    fn finish(&self, closing: &mut Closing<'_>) -> Result<(), RunError> {
        let robot = &self.job.robot;
        let header = FieldHeader {
            grid: self.job.poses.clone(),
            metric: self.job.metric,
            robot: robot.name.clone(),
            robot_id: robot.id,
            joints: robot.joints.clone(),
            target: robot.target.clone(),
            frame: robot.frame.clone(),
        };
        let scan = scan_shards(closing.folder, closing.mark)?;
        let shards: Vec<String> = scan.done.into_values().map(|shard| shard.name).collect();
        Ok(write_field(closing.folder, &closing.job, &header, &shards)?)
    }
}
