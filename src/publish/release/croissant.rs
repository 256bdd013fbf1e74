//! `croissant.json`: Croissant 1.1, machine-readable metadata of the files and of the sample index.

use serde_json::{Value, json};

use super::{About, material::Release, rights};
use crate::products::pages_of;
use format::{
    Product,
    dataset::{ColumnKind, IndexColumn, index_columns, layout},
};

/// Terms of the format, from its specification.
const CONTEXT: &str = include_str!("croissant_context.json");

/// The document; `cite_as` is a BibTeX entry.
pub(super) fn croissant(release: &Release, cite_as: &str) -> Value {
    let (about, manifest) = (release.about, release.manifest);
    let context: Value = serde_json::from_str(CONTEXT).expect("croissant_context.json is JSON (a test reads it)");
    let mut identifiers = vec![format!("graspmill-root:{}", manifest.root)];
    identifiers.extend(about.doi.as_ref().map(|doi| format!("https://doi.org/{doi}")));
    let mut document = json!({
        "@context": context,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "name": about.title,
        "description": about.description.trim(),
        "version": about.version,
        "datePublished": about.date,
        "license": licence(&about.licence),
        "creator": creators(about),
        "citeAs": cite_as,
        "identifier": identifiers,
        "isLiveDataset": false,
        "distribution": distribution(release),
        "recordSet": record_sets(release),
    });
    if let Some(url) = &about.url {
        document["url"] = json!(url);
    }
    if !about.keywords.is_empty() {
        document["keywords"] = json!(about.keywords);
    }
    document
}

/// The URL of the licence if SPDX has one, else the expression.
fn licence(expression: &str) -> Value {
    match rights::names(expression).as_slice() {
        [name] if expression == *name => json!(format!("https://spdx.org/licenses/{name}.html")),
        _ => json!(expression),
    }
}

fn creators(about: &About) -> Vec<Value> {
    let creator = |author: &super::Author| {
        let kind = if author.person().is_some() { "sc:Person" } else { "sc:Organization" };
        let mut creator = json!({ "@type": kind, "name": author.spoken() });
        if let Some(orcid) = &author.orcid {
            creator["identifier"] = json!(format!("https://orcid.org/{orcid}"));
        }
        if let Some(affiliation) = &author.affiliation {
            creator["affiliation"] = json!({ "@type": "sc:Organization", "name": affiliation });
        }
        creator
    };
    about.authors.iter().map(creator).collect()
}

/// The dataset's own files, and its shards as one set.
fn distribution(release: &Release) -> Vec<Value> {
    let file = |path: &String| {
        let digests = release.files.get(path)?;
        Some(json!({
            "@type": "cr:FileObject",
            "@id": path,
            "name": path,
            "description": description(release.manifest.product, path),
            "contentUrl": path,
            "contentSize": format!("{} B", digests.bytes),
            "encodingFormat": format_of(path),
            "sha256": digests.sha256,
        }))
    };
    let paths = release.manifest.paths();
    let mut files: Vec<Value> = paths.iter().filter_map(file).collect();
    if release.manifest.shards.iter().any(|shard| release.files.contains_key(&shard.path())) {
        files.push(json!({
            "@type": "cr:FileSet",
            "@id": "shards",
            "name": "shards",
            "description": "The samples: MCAP files of protobuf messages with their schema.",
            "encodingFormat": "application/x-mcap",
            "includes": "shards/*.mcap",
        }));
    }
    files
}

/// Content of a file of the dataset, one sentence.
fn description(product: Product, path: &str) -> &'static str {
    match path {
        layout::ASSETS => "One row per object, robot or hand, identified by content.",
        layout::INDEX => "One row per sample, stored or rejected.",
        layout::JOB => "The job that makes the dataset again.",
        layout::MANIFEST => "Digests of all files, counts, the root digest.",
        layout::REJECTS => "One line per rejected sample.",
        layout::RUN => "The job for which the folder was created.",
        layout::SPLITS => "Splits of the objects and of their held-out items.",
        _ => product.files.iter().find(|file| file.name == path).map_or("Samples.", |file| file.meaning),
    }
}

fn format_of(path: &str) -> &'static str {
    match path.rsplit('.').next() {
        Some("json") => "application/json",
        Some("jsonl") => "application/jsonlines",
        Some("mcap") => "application/x-mcap",
        Some("parquet") => "application/x-parquet",
        Some("toml") => "application/toml",
        _ => "text/plain",
    }
}

/// The index, and the names of the splits that it refers to.
fn record_sets(release: &Release) -> Vec<Value> {
    let manifest = release.manifest;
    let columns = index_columns(manifest.product, &manifest.channels());
    let samples = json!({
        "@type": "cr:RecordSet",
        "@id": "samples",
        "name": "samples",
        "description": format!(
            "The sample index: a row is {}, stored or rejected.",
            pages_of(manifest.product).words.sample
        ),
        "key": { "@id": "samples/sample_index" },
        "field": columns.iter().map(field).collect::<Vec<_>>(),
    });
    if release.numbers.splits.is_empty() {
        return vec![samples];
    }
    let names: Vec<&str> = release.numbers.splits.iter().map(|row| row.split.name()).collect();
    let splits = json!({
        "@type": "cr:RecordSet",
        "@id": "splits",
        "name": "splits",
        "description": "Splits of the samples.",
        "dataType": "cr:Split",
        "key": { "@id": "splits/name" },
        "field": [{
            "@type": "cr:Field",
            "@id": "splits/name",
            "name": "name",
            "description": "Name of the split.",
            "dataType": "sc:Text",
        }],
        "data": names.iter().map(|name| json!({ "splits/name": name })).collect::<Vec<_>>(),
    });
    vec![splits, samples]
}

fn field(column: &IndexColumn) -> Value {
    let IndexColumn { name, kind, meaning, .. } = column;
    let data_type = match kind {
        ColumnKind::Text => "sc:Text",
        ColumnKind::Boolean => "sc:Boolean",
        ColumnKind::U32 => "cr:UInt32",
        ColumnKind::U64 => "cr:UInt64",
        ColumnKind::F64 => "cr:Float64",
        // The 32 raw bytes; the format has no type for bytes.
        ColumnKind::Digest => "sc:Text",
    };
    let mut field = json!({
        "@type": "cr:Field",
        "@id": format!("samples/{name}"),
        "name": name,
        "description": meaning,
        "dataType": data_type,
        "source": { "fileObject": { "@id": "index.parquet" }, "extract": { "column": name } },
    });
    if name == "split" {
        field["references"] = json!({ "field": { "@id": "splits/name" } });
    }
    field
}
