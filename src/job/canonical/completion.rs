//! A resolved completion job as text.

use std::{collections::BTreeMap, fmt::Write as _, path::Path};

use toml::Value;

use super::{Text, relative_to};
use crate::{
    assets::{MeshOrigin, ScaleRule},
    geom::ViewSet,
    job::{
        checked::{
            Channels, Completion, DepthFormat, Distance, JobObject, KnownMass, ModelChoice, Pivot, RandomRays,
            RayTarget, Renderer, SplitSettings, SubsetSize, Touch, TouchByHand, Truth,
        },
        discover, pattern,
    },
};

impl Text {
    pub(super) fn completion(&mut self, completion: &Completion) {
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
            touch,
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
        self.touch(touch);
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

    /// Nothing without touch: such jobs keep the text, and the digest, that they had before there was any.
    fn touch(&mut self, touch: &Touch) {
        let Touch { random_rays, by_hand } = touch;
        if random_rays.is_some() || by_hand.is_some() {
            self.section("touch");
        }
        if let Some(RandomRays { count, target }) = random_rays {
            self.key("random_rays", true);
            self.key("rays", i64::from(*count));
            self.key(
                "ray_target",
                match target {
                    RayTarget::Mesh => "mesh",
                    RayTarget::Cells => "cells",
                },
            );
        }
        if let Some(TouchByHand { hand: _, exploration, grasp }) = by_hand {
            self.key("exploration", exploration.is_some());
            if let Some(approaches) = exploration {
                self.key("approaches", i64::from(*approaches));
            }
            self.key("grasp", *grasp);
        }
    }

    /// The hand that touches, with its file where there is a folder to see it from.
    pub(super) fn hand(&mut self, touch: &Touch, folder: Option<&Path>) {
        if let Some(TouchByHand { hand, .. }) = &touch.by_hand {
            self.hand_at("touch.hand", hand, folder);
        }
    }

    pub(super) fn split(&mut self, split: &SplitSettings) {
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
    pub(super) fn objects(&mut self, objects: &[JobObject], folder: &Path) {
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
        if let Some(KnownMass { kilograms, source }) = &object.mass {
            row.push(("mass", Value::from(*kilograms)));
            row.extend((!source.is_empty()).then(|| ("mass_source", Value::from(source.as_str()))));
        }
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
        (None, MeshOrigin::File(path)) => discover::with_slashes(&relative_to(path, folder)),
        (None, MeshOrigin::BuiltIn(name)) => name.clone(),
    }
}
