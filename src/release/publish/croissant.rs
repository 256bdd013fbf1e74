//! `croissant.json`: Croissant 1.1, metadata of the files and of the sample index that programs read.

use serde_json::{Value, json};

use super::{About, Release, citation, rights};
use crate::{
    dataset::{ColumnKind, IndexColumn, index_columns, layout},
    ids::Product,
};

/// Terms of the format, as its specification gives them.
const CONTEXT: &str = include_str!("croissant_context.json");

/// The document.
pub(super) fn croissant(release: &Release) -> Value {
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
        "citeAs": citation::bibtex(release),
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

/// An address where SPDX has one, else the expression.
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
            "description": description(path),
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
            "description": "The samples: MCAP files of protobuf messages, their schema inside.",
            "encodingFormat": "application/x-mcap",
            "includes": "shards/*.mcap",
        }));
    }
    files
}

fn description(path: &str) -> &'static str {
    match path {
        layout::ASSETS => "One row an object, robot or hand: what it is, by content.",
        layout::FIELD => "Labels and signed distances of the whole grid of poses.",
        layout::INDEX => "One row a sample, stored or rejected.",
        layout::JOB => "The job that makes the dataset again.",
        layout::MANIFEST => "Digests of all files, counts, the root digest.",
        layout::REJECTS => "One line a rejected sample.",
        layout::RUN => "What the folder was begun for.",
        layout::SHAPES => "The hand's shapes and the objects' meshes.",
        layout::SPLITS => "Which objects and views train and which test.",
        _ => "Samples.",
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
            super::numbers::sample_in_words(manifest.product)
        ),
        "key": { "@id": "samples/sample_index" },
        "field": columns.iter().map(|column| field(column, manifest.product)).collect::<Vec<_>>(),
    });
    if release.numbers.splits.is_empty() {
        return vec![samples];
    }
    let names: Vec<&str> = release.numbers.splits.iter().map(|(split, ..)| split.name()).collect();
    let splits = json!({
        "@type": "cr:RecordSet",
        "@id": "splits",
        "name": "splits",
        "description": "Who trains and who tests.",
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

fn field(column: &IndexColumn, product: Product) -> Value {
    let IndexColumn { name, kind, .. } = column;
    let data_type = match kind {
        ColumnKind::Text => "sc:Text",
        ColumnKind::Boolean => "sc:Boolean",
        ColumnKind::U32 => "cr:UInt32",
        ColumnKind::U64 => "cr:UInt64",
        ColumnKind::F64 => "cr:Float64",
        // The 32 bytes as they are; the format has no type for bytes.
        ColumnKind::Digest => "sc:Text",
    };
    let mut field = json!({
        "@type": "cr:Field",
        "@id": format!("samples/{name}"),
        "name": name,
        "description": meaning(name, product),
        "dataType": data_type,
        "source": { "fileObject": { "@id": "index.parquet" }, "extract": { "column": name } },
    });
    if name == "split" {
        field["references"] = json!({ "field": { "@id": "splits/name" } });
    }
    field
}

/// What a column of the index says (docs/format.md).
pub(super) fn meaning(name: &str, product: Product) -> String {
    let known = match name {
        "sample_index" => "Place of the sample in the plan, from 0.",
        "subject" if product == Product::Reachability => "The robot by content, 64 hexadecimal digits.",
        "subject" => "The object by content, 64 hexadecimal digits.",
        "object" => "Its name.",
        "instance" => "Instance of the subject.",
        "view" => match product {
            Product::Completion => "Which view of the object.",
            Product::Reachability => "Which position, in C order over x, y, z.",
            Product::Grasps => "Number of the seed.",
            Product::Patches => "Which grasp of the object.",
        },
        "camera" => "Which camera.",
        "split" => "Which part of the dataset the sample belongs to.",
        "shard" => "Which shard holds it.",
        "kept" => "Whether the sample is stored.",
        "reason" => "Of a rejected sample: why.",
        "detail" => "Of a rejected sample: the numbers behind it.",
        "partial_cells" => "Occupied cells of the partial grid.",
        "complete_cells" => "Occupied cells of the complete grid.",
        "both_cells" => "Cells that are occupied in both.",
        "solid_share" => "Share of the solid's volume inside the grid.",
        "no_solution" => "Poses that no joint values reach.",
        "colliding" => "Poses that are reached with a collision alone.",
        "reachable" => "Poses that are reached without a collision.",
        "given_up" => "1 where the seed was given up before the run was over, else 0.",
        "best_energy" => "Lowest energy of any state; infinite without one.",
        "best_epsilon" => "Highest epsilon of a kept grasp; 0 without one.",
        "type" => "Type of the grasp.",
        "type_index" => "Place of that type among the chosen ones.",
        "energy" => "Energy of the grasp.",
        "epsilon" => "Epsilon of the grasp.",
        _ => "",
    };
    let words = |name: &str| name.replace('_', " ");
    match (known, name) {
        ("", name) if name.starts_with("digest_") => {
            format!("BLAKE3 of the stored {} message, 32 bytes.", words(&name["digest_".len()..]))
        }
        ("", name) if name.starts_with("by_") => format!("Poses whose label is known by {}.", words(&name[3..])),
        ("", name) if name.starts_with("grasps_") => format!("Grasps that are {}.", words(&name[7..])),
        ("", name) => words(name),
        (known, _) => known.to_owned(),
    }
}
