//! Documents of invented releases, for the tests of their templates.

use std::collections::BTreeMap;

use minijinja::{Value, value::Serde};

use super::{
    About, Documents, LeftOutFile,
    assets::{Allowed, Asset, Known, LicenceSource},
    checksums::FileDigests,
    material::Release,
};
use crate::{
    asset::{AssetKind, AssetUse},
    numbers::{Numbers, SplitCounts},
    tally::{Spread, SpreadRow},
};
use format::{
    FORMAT_VERSION, Product,
    dataset::{Counts, Manifest},
};
use kernel::{
    ids::{Digest, JobDigest, ObjectId},
    words::{NumberClass, Split},
};

/// A release with every part, or with none that can be missing.
pub(crate) struct Example<'a> {
    pub product: Product,
    /// Text of third parties, wherever they can put any.
    pub name: &'a str,
    pub is_full: bool,
    /// Licence of the release.
    pub licence: &'a str,
    /// Whether the job names a scene beside meshes.
    pub has_setting: bool,
    /// Whether splits count objects.
    pub counts_objects: bool,
}

impl Example<'_> {
    /// The view of its documents.
    pub fn view(&self) -> Value {
        let (about, manifest, numbers) = (self.about(), self.manifest(), self.numbers());
        let (assets, files, left_out) = (self.assets(), self.files(), self.left_out());
        let pictures = self.only_full(("pictures/1.png".to_owned(), format!("{}, view 4", self.name)));
        let release = Release {
            about: &about,
            manifest: &manifest,
            assets: &assets,
            numbers: &numbers,
            files: &files,
            left_out: &left_out,
            pictures: &pictures,
            outside: self.outside(),
        };
        let documents = Documents::of(&release);
        Value::from(Serde(&documents))
    }

    fn only_full<T>(&self, value: T) -> Vec<T> {
        if self.is_full { vec![value] } else { Vec::new() }
    }

    fn about(&self) -> About {
        let name = self.name;
        let more = serde_json::json!({
            "url": "https://example.org/a_b", "doi": "10.1234/a_b", "keywords": [name], "funding": "us", "contact": "we",
            "maintenance": "they", "intended_uses": ["tests", "more tests"], "out_of_scope_uses": ["all else"],
        });
        let mut about = serde_json::json!({
            "title": name, "version": name, "date": "2026-11-22", "description": "Some.", "licence": self.licence,
            "authors": [{ "name": format!("{name}, Ada"), "orcid": "0000-0002-1825-0097", "affiliation": name }, { "name": name }],
        });
        if self.is_full {
            let fields = about.as_object_mut().expect("a table");
            fields.extend(more.as_object().expect("a table").clone());
        }
        serde_json::from_value(about).expect("an about file")
    }

    fn manifest(&self) -> Manifest {
        let exact = (NumberClass::Exact, Digest::hash(b"exact"));
        let physics = self.only_full((NumberClass::Physics, Digest::hash(b"physics")));
        Manifest {
            format_version: FORMAT_VERSION,
            generator: "graspmill 0.1.0".to_owned(),
            product: self.product,
            root: Digest::hash(b"root"),
            classes: [exact].into_iter().chain(physics).collect(),
            class_topics: BTreeMap::new(),
            platform: self.only_full(("libmujoco".to_owned(), self.name.to_owned())).into_iter().collect(),
            job: JobDigest(Digest::hash(b"job")),
            topics: vec![self.product.leading().topic.to_owned()],
            counts: Counts {
                samples: 720,
                kept: 700,
                rejected: self.only_full(("too_few".to_owned(), 20)).into_iter().collect(),
                refused_meshes: u64::from(self.is_full),
                ..Counts::default()
            },
            shards: Vec::new(),
            files: BTreeMap::new(),
            warnings: self.only_full(format!("refused: {}: state `unit`", self.name)),
        }
    }

    fn numbers(&self) -> Numbers {
        let objects = self.counts_objects.then_some(3);
        Numbers {
            job_name: self.name.to_owned(),
            headline: "5 of 7 samples".to_owned(),
            rows: Numbers::example_rows(self.name),
            spreads: self.only_full(SpreadRow::new("epsilon", 3, &Spread::default())),
            splits: self.only_full(SplitCounts { split: Split::Holdout, samples: 84, objects }),
            leaks: self.only_full(format!("{0} = {0}", self.name)),
        }
    }

    fn assets(&self) -> Vec<Asset> {
        let name = self.name;
        let free = Asset {
            name: name.to_owned(),
            kind: AssetKind::Object,
            content: ObjectId(Digest::hash(b"object")),
            file_blake3: None,
            source: format!("package {name}"),
            licence: Some("CC-BY-SA-4.0".to_owned()),
            licence_source: LicenceSource::Dataset,
            attribution: self.is_full.then(|| name.to_owned()),
            replaces: None,
            passed_over: None,
            used: AssetUse::Derived,
            may_be_shipped: Allowed::Everything,
            because: None,
        };
        let with_source = |licence_source| Asset { licence_source, ..free.clone() };
        let barred = Asset {
            source: "file".to_owned(),
            licence: self.is_full.then(|| name.to_owned()),
            used: AssetUse::Copied,
            may_be_shipped: Allowed::Derived,
            because: Some(format!("{name} is not a licence; state `derived = true`")),
            ..with_source(LicenceSource::Nobody)
        };
        let replaces = Known {
            licence: name.to_owned(),
            licence_source: LicenceSource::Dataset,
            attribution: Some(name.to_owned()),
        };
        let replaced = Asset { replaces: Some(replaces), ..with_source(LicenceSource::About) };
        let hand = Asset { kind: AssetKind::Hand, used: AssetUse::Measured, ..barred.clone() };
        if self.is_full {
            vec![free.clone(), replaced, with_source(LicenceSource::Graspmill), barred, hand]
        } else {
            vec![barred]
        }
    }

    fn files(&self) -> BTreeMap<String, FileDigests> {
        let digests = FileDigests { sha256: "0".repeat(64), blake3: Digest::hash(b""), bytes: 0 };
        let names = ["report.html", "preview.mcap"].into_iter().filter(|_| self.is_full);
        names.map(|name| (name.to_owned(), digests.clone())).collect()
    }

    /// A release that lacks everything else is a recipe.
    fn left_out(&self) -> Vec<LeftOutFile> {
        let file = LeftOutFile { path: "shards/1.mcap".to_owned(), blake3: Digest::hash(b""), bytes: 12_000 };
        if self.is_full { Vec::new() } else { vec![file] }
    }

    fn outside(&self) -> BTreeMap<String, (String, usize)> {
        let path = |key: &str, more| (key.to_owned(), (format!("../{}", self.name), more));
        let scene = self.has_setting.then(|| path("hand.model", 0));
        if self.is_full { [path("objects.list", 4)].into_iter().chain(scene).collect() } else { BTreeMap::new() }
    }
}
