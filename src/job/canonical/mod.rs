//! The resolved job as text, and its digests.

mod completion;
mod grasp;
mod patches;
mod reachability;

use std::{
    fmt::Write as _,
    path::{Component, Path, PathBuf, absolute},
};

use toml::Value;

use super::{
    checked::{Job, JobObject, Profile, SplitSettings, Work},
    discover,
};
use crate::ids::{Digest, JobDigest, Product};

/// Changes when the canonical text changes without the job changing.
const CANONICAL_FORM: &str = "graspmill job 1";

impl Job {
    /// The job as a job file: every default filled in, every mesh or robot pinned by content, overrides listed. Reading
    /// it back where they are gives a job of the same digest.
    ///
    /// Paths are written relative to `folder`, in which the file will stand; meshes of packages by package and name.
    pub fn to_toml(&self, folder: &Path) -> String {
        let mut text = Text::default();
        let pinned = match self.product() {
            Product::Completion => "every mesh pinned by its content",
            Product::Reachability => "the robot pinned by its content",
            Product::Grasps => "every mesh and the hand pinned by their content",
            Product::Patches => "the grasps and the hand pinned by their content",
        };
        let _ = writeln!(text.0, "# A resolved job: every default filled in, {pinned}.");
        let _ = writeln!(text.0, "# Job digest {}", self.digest());
        // Completion is the default; its resolved jobs keep the text that they had when it was the only product.
        if self.product() != Product::Completion {
            text.key("product", self.product().name());
        }
        text.key("name", self.name.as_str());
        text.key("seed", self.seed as i64);
        text.key("profile", if self.profile == Profile::Thesis { "thesis" } else { "standard" });
        text.list("overrides", self.overrides.iter().map(|text| Value::from(text.as_str())));
        match &self.work {
            Work::Completion(job) => {
                text.completion(&job.settings);
                text.hand(&job.settings.touch, Some(folder));
                text.split(&job.split);
                text.section("shards");
                text.key("samples", i64::from(self.shard_samples));
                text.objects(&job.objects, folder);
            }
            Work::Reachability(job) => {
                text.reachability(job);
                text.section("shards");
                text.key("positions", i64::from(self.shard_samples));
                text.robot(&job.robot, folder);
            }
            Work::Grasps(job) => {
                text.grasps(&job.settings);
                text.hand_at("hand", &job.hand, Some(folder));
                text.split(&job.split);
                text.section("shards");
                text.key("runs", i64::from(self.shard_samples));
                text.objects(&job.objects, folder);
            }
            Work::Patches(job) => {
                text.patches(job, Some(folder));
                text.hand_at("hand", &job.hand, Some(folder));
                text.section("shards");
                text.key("samples", i64::from(self.shard_samples));
            }
        }
        text.0
    }

    /// Names the job by everything that data or split depend on: settings, seed, objects by name and content, or the
    /// robot by content, and the hand that touches by content. Not by its name, paths, profile (every switch is a setting), shard size, threads or clock.
    pub fn digest(&self) -> JobDigest {
        let mut text = Text(format!("{CANONICAL_FORM}\n"));
        self.settings(&mut text);
        match &self.work {
            Work::Completion(job) => text.divided(&job.split, &job.objects),
            Work::Grasps(job) => {
                text.divided(&job.split, &job.objects);
                text.masses(&job.objects);
            }
            Work::Patches(job) => text.grasped(&job.grasps),
            Work::Reachability(job) => text.key("robot", job.robot.id.0.hex()),
        }
        JobDigest(Digest::of(text.0.as_bytes()))
    }

    /// Names what a sample depends on beside its subject, with what the job knows of that, and its view: seed and settings of the
    /// product. Equal in two jobs whose common subjects make the same samples.
    pub fn sample_settings(&self) -> Digest {
        let mut text = Text(format!("{CANONICAL_FORM}, samples\n"));
        self.settings(&mut text);
        Digest::of(text.0.as_bytes())
    }

    fn settings(&self, text: &mut Text) {
        if self.product() != Product::Completion {
            text.key("product", self.product().name());
        }
        text.key("seed", self.seed as i64);
        match &self.work {
            Work::Completion(job) => {
                text.completion(&job.settings);
                text.hand(&job.settings.touch, None);
            }
            Work::Reachability(job) => {
                text.reachability(job);
                text.group(&job.robot);
            }
            Work::Grasps(job) => {
                text.grasps(&job.settings);
                text.hand_at("hand", &job.hand, None);
            }
            Work::Patches(job) => {
                text.patches(job, None);
                text.hand_at("hand", &job.hand, None);
            }
        }
    }
}

/// TOML, line by line.
#[derive(Default)]
struct Text(String);

impl Text {
    fn section(&mut self, name: &str) {
        let _ = write!(self.0, "\n[{name}]\n");
    }

    fn key(&mut self, key: &str, value: impl Into<Value>) {
        let _ = writeln!(self.0, "{key} = {}", value.into());
    }

    /// The split and what is split, by content.
    fn divided(&mut self, split: &SplitSettings, objects: &[JobObject]) {
        self.split(split);
        for object in objects {
            let group = object.source.group.as_deref().unwrap_or_default();
            let parts = [object.source.name.as_str(), &object.id().0.hex(), group].map(Value::from);
            self.list("object", parts);
        }
    }

    /// An array, broken into lines of a few values when it is long.
    fn list(&mut self, key: &str, values: impl IntoIterator<Item = Value>) {
        let values: Vec<String> = values.into_iter().map(|value| value.to_string()).collect();
        let line = values.join(", ");
        if line.len() <= 100 {
            let _ = writeln!(self.0, "{key} = [{line}]");
        } else {
            let _ = writeln!(self.0, "{key} = [\n    {},\n]", values.join(",\n    "));
        }
    }
}

/// `path` as seen from `folder`, without asking the file system what is a link.
fn relative_to(path: &Path, folder: &Path) -> PathBuf {
    let whole = |path: &Path| absolute(path).map_or_else(|_| path.to_owned(), |path| discover::tidy(&path));
    let (path, folder) = (whole(path), whole(folder));
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(path.components().skip(common)).collect()
}
