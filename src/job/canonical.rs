//! The resolved job as text, and its digests.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    path::{Component, Path, PathBuf, absolute},
};

use toml::Value;

use super::{
    checked::{
        Channels, Completion, DepthFormat, Distance, Job, JobObject, ModelChoice, Pivot, Profile, Renderer,
        SplitSettings, SubsetSize, Truth,
    },
    pattern,
};
use crate::{
    assets::{MeshOrigin, ScaleRule},
    geom::ViewSet,
    ids::{Digest, JobDigest},
};

/// Changes when the canonical text changes without the job changing.
const CANONICAL_FORM: &str = "graspmill job 1";

impl Job {
    /// The job as a job file: every default filled in, every mesh pinned by content, overrides listed. Reading it back
    /// where the meshes are gives a job of the same digest.
    ///
    /// Paths are written relative to `folder`, in which the file will stand; meshes of packages by package and name.
    pub fn to_toml(&self, folder: &Path) -> String {
        let mut text = Text::default();
        text.0.push_str("# A resolved job: every default filled in, every mesh pinned by its content.\n");
        let _ = writeln!(text.0, "# Job digest {}", self.digest());
        text.key("name", self.name.as_str());
        text.key("seed", self.seed as i64);
        text.key("profile", if self.profile == Profile::Thesis { "thesis" } else { "standard" });
        text.list("overrides", self.overrides.iter().map(|text| Value::from(text.as_str())));
        text.completion(&self.completion);
        text.split(&self.split);
        text.section("shards");
        text.key("samples", i64::from(self.shard_samples));
        text.objects(&self.objects, folder);
        text.0
    }

    /// Names the job by everything that data or split depend on: settings, seed, objects by name and content. Not by
    /// its name, paths, profile (every switch is a setting), shard size, threads or clock.
    pub fn digest(&self) -> JobDigest {
        let mut text = Text(format!("{CANONICAL_FORM}\n"));
        text.key("seed", self.seed as i64);
        text.completion(&self.completion);
        text.split(&self.split);
        for object in &self.objects {
            let group = object.source.group.as_deref().unwrap_or_default();
            let parts = [object.source.name.as_str(), &object.id().0.hex(), group].map(Value::from);
            text.list("object", parts);
        }
        JobDigest(Digest::of(text.0.as_bytes()))
    }

    /// Names what a sample depends on beside its object and view: seed and settings of the product. Equal in two jobs
    /// whose common objects make the same samples.
    pub fn sample_settings(&self) -> Digest {
        let mut text = Text(format!("{CANONICAL_FORM}, samples\n"));
        text.key("seed", self.seed as i64);
        text.completion(&self.completion);
        Digest::of(text.0.as_bytes())
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

    fn completion(&mut self, completion: &Completion) {
        let Completion {
            views,
            pivot,
            camera,
            scene: _,
            distance,
            renderer,
            sensor,
            resolution,
            drop_index_zero,
            solid_with_surface,
            truth,
            gate,
            channels,
        } = completion;
        self.key(
            "pivot",
            match pivot {
                Pivot::BoxCentre => "box_centre",
                Pivot::MeshOrigin => "mesh_origin",
            },
        );
        self.key(
            "renderer",
            match renderer {
                Renderer::Raster => "raster",
                Renderer::MujocoRay => "mujoco-ray",
                Renderer::MujocoGl => "mujoco-gl",
            },
        );
        let table = |pairs: &[(&str, f64)]| {
            Value::Table(pairs.iter().map(|(key, value)| ((*key).to_owned(), Value::from(*value))).collect())
        };
        self.key(
            "distance",
            match distance {
                Distance::Fixed(distance) => Value::from(*distance),
                Distance::Range { min, max } => table(&[("min", *min), ("max", *max)]),
                Distance::Fit { share } => table(&[("fit", *share)]),
            },
        );
        self.views(views);
        self.section("camera");
        self.key("width", i64::from(camera.width));
        self.key("height", i64::from(camera.height));
        for (key, value) in
            [("fx", camera.fx), ("fy", camera.fy), ("cx", camera.cx), ("cy", camera.cy), ("near", camera.near)]
        {
            self.key(key, value);
        }
        self.section("sensor");
        self.key("profile", sensor.as_ref().map_or("none", |sensor| sensor.profile_name()));
        if let Some(sensor) = sensor {
            self.section("sensor.constants");
            sensor.canonical().into_iter().for_each(|(key, value)| self.key(key, value));
        }
        self.section("grid");
        self.key("resolution", i64::from(*resolution));
        self.key("drop_index_zero", *drop_index_zero);
        self.truth(*truth, *solid_with_surface);
        self.section("gate");
        self.key("min_partial_cells", i64::from(gate.min_partial_cells));
        self.key("min_overlap", gate.min_overlap);
        self.channels(channels);
    }

    fn views(&mut self, views: &ViewSet) {
        self.section("views");
        let row = |row: &[f64]| Value::Array(row.iter().map(|value| Value::from(*value)).collect());
        match views {
            ViewSet::RollPitchYaw { roll, pitch, yaw } => {
                for (key, angles) in [("roll", roll), ("pitch", pitch), ("yaw", yaw)] {
                    self.list(key, angles.iter().map(|angle| Value::from(*angle)));
                }
            }
            ViewSet::Even { count } => self.key("even", i64::from(*count)),
            ViewSet::List(rotations) => self.list(
                "matrices",
                rotations.iter().map(|rotation| {
                    let rows = rotation.matrix().row_iter().map(|entries| row(&[entries[0], entries[1], entries[2]]));
                    Value::Array(rows.collect())
                }),
            ),
        }
    }

    fn truth(&mut self, truth: Truth, solid_with_surface: bool) {
        self.section("truth");
        let rule = match truth {
            Truth::AnyOverlap => "any_overlap",
            Truth::Centre => "centre",
            Truth::Fraction(_) => "fraction",
            Truth::LowerCorners => "lower_corners",
        };
        self.key("rule", rule);
        if let Truth::Fraction(fraction) = truth {
            self.key("fraction", fraction);
        }
        self.key("solid_with_surface", solid_with_surface);
    }

    fn channels(&mut self, channels: &Channels) {
        let Channels { visibility, depth, cloud, tsdf, coverage, implicit } = channels;
        self.section("channels");
        self.key("visibility", *visibility);
        let (format, step) = match depth {
            None => ("none", None),
            Some(DepthFormat::F32) => ("f32", None),
            Some(DepthFormat::U16 { step }) => ("u16", Some(*step)),
        };
        self.key("depth", format);
        if let Some(step) = step {
            self.key("depth_step", step);
        }
        self.key("cloud", *cloud);
        self.key("tsdf", tsdf.is_some());
        if let Some(truncation) = tsdf {
            self.key("tsdf_truncation", *truncation);
        }
        self.key("coverage", *coverage);
        self.key("implicit", implicit.is_some());
        if let Some(implicit) = implicit {
            self.key("implicit_surface", i64::from(implicit.surface));
            self.key("implicit_space", i64::from(implicit.space));
        }
    }

    fn split(&mut self, split: &SplitSettings) {
        let SplitSettings {
            holdout_views,
            validation_models,
            test_models,
            by_group,
            keep_twins_together,
            keep_equal_views_together,
            training_subsets,
        } = split;
        self.section("split");
        self.key("holdout_views", *holdout_views);
        for (key, choice) in [("validation_models", validation_models), ("test_models", test_models)] {
            match choice {
                ModelChoice::Share(share) => self.key(key, *share),
                ModelChoice::Count(count) => self.key(key, i64::from(*count)),
                ModelChoice::Named(names) => {
                    self.list(key, names.iter().map(|name| Value::from(pattern::literal(name))));
                }
            }
        }
        self.key("by_group", *by_group);
        self.key("keep_twins_together", *keep_twins_together);
        self.key("keep_equal_views_together", *keep_equal_views_together);
        self.list(
            "training_subsets",
            training_subsets.iter().map(|size| match size {
                SubsetSize::Models(count) => Value::from(i64::from(*count)),
                SubsetSize::Share(share) => Value::from(*share),
            }),
        );
    }

    /// One entry for each package, one for files, one for built-in shapes; several where size limits differ.
    fn objects(&mut self, objects: &[JobObject], folder: &Path) {
        let mut entries: BTreeMap<(String, [u64; 2]), Vec<&JobObject>> = BTreeMap::new();
        for object in objects {
            let kind = match (&object.package, &object.source.origin) {
                (Some(file), _) => format!("package {}", file.package),
                (None, MeshOrigin::File(_)) => "list".to_owned(),
                (None, MeshOrigin::BuiltIn(_)) => "built_in".to_owned(),
            };
            let limits = [object.source.size.min.to_bits(), object.source.size.max.to_bits()];
            entries.entry((kind, limits)).or_default().push(object);
        }
        for ((kind, _), objects) in entries {
            self.0.push_str("\n[[objects]]\n");
            let files: Vec<String> = objects.iter().map(|object| file_of(object, folder)).collect();
            let names = files.iter().map(|file| Value::from(file.as_str()));
            match kind.split_once(' ') {
                Some((_, package)) => {
                    self.key("package", package);
                    // A leading `./` keeps a bare name from fitting files in folders below.
                    self.list("include", files.iter().map(|file| format!("./{}", pattern::literal(file)).into()));
                }
                None => self.list(&kind, names),
            }
            let limits = objects[0].source.size;
            let _ =
                writeln!(self.0, "limits = {{ min = {}, max = {} }}", Value::from(limits.min), Value::from(limits.max));
            self.0.push_str("\n[objects.meshes]\n");
            for (object, file) in objects.iter().zip(&files) {
                self.mesh(object, file);
            }
        }
    }

    fn mesh(&mut self, object: &JobObject, file: &str) {
        let source = &object.source;
        let mut row = vec![("name", Value::from(source.name.as_str()))];
        match (&source.origin, source.scale) {
            (MeshOrigin::BuiltIn(_), _) => {}
            (_, ScaleRule::MetresPerUnit(scale)) => row.push(("scale", Value::from(scale))),
            (_, ScaleRule::LongestSide(size)) => row.push(("size", Value::from(size))),
        }
        let words = [("group", &source.group), ("licence", &source.licence), ("citation", &source.citation)];
        row.extend(words.into_iter().filter_map(|(key, word)| Some((key, Value::from(word.as_deref()?)))));
        row.push(("object", Value::from(object.id().0.hex())));
        let row: Vec<String> = row.into_iter().map(|(key, value)| format!("{key} = {value}")).collect();
        // A JSON string is a TOML string on one line, which a key must be.
        let _ = writeln!(self.0, "{} = {{ {} }}", serde_json::Value::from(file), row.join(", "));
    }
}

/// What names an object's file in its entry.
fn file_of(object: &JobObject, folder: &Path) -> String {
    match (&object.package, &object.source.origin) {
        (Some(file), _) => file.file.clone(),
        (None, MeshOrigin::File(path)) => super::discover::with_slashes(&relative_to(path, folder)),
        (None, MeshOrigin::BuiltIn(name)) => name.clone(),
    }
}

/// `path` as seen from `folder`, without asking the file system what is a link.
fn relative_to(path: &Path, folder: &Path) -> PathBuf {
    let whole = |path: &Path| absolute(path).map_or_else(|_| path.to_owned(), |path| super::discover::tidy(&path));
    let (path, folder) = (whole(path), whole(folder));
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(path.components().skip(common)).collect()
}
