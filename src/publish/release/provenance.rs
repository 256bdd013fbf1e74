//! `provenance.intoto.json`: an in-toto statement with SLSA's provenance predicate: products, inputs and builder.
//!
//! The statement is not signed and names no machine; to verify it, make the dataset again.

use serde_json::{Map, Value, json};

use super::material::Release;
use format::dataset::layout;

/// The statement. Digests that are not plain digests of bytes have their own names: `graspmillRoot`, `graspmillJob`,
/// `graspmillContent` (defined in docs/format.md).
pub(super) fn provenance(release: &Release) -> Value {
    let manifest = release.manifest;
    let shards = manifest.shards.iter().map(|shard| {
        let path = shard.path();
        let mut digest = json!({ "blake3": shard.digest });
        if let Some(file) = release.files.get(&path) {
            digest["sha256"] = json!(file.sha256);
        }
        json!({ "name": path, "digest": digest })
    });
    let root = json!({ "name": "dataset", "digest": { "graspmillRoot": manifest.root } });
    let (name, version) = manifest.generator.split_once(' ').unwrap_or((&manifest.generator, "unknown"));
    let job = release.files.get(layout::JOB).map(|file| file.sha256.as_str()).unwrap_or_default();
    json!({
        "_type": "https://in-toto.io/Statement/v1",
        "subject": std::iter::once(root).chain(shards).collect::<Vec<_>>(),
        "predicateType": "https://slsa.dev/provenance/v1",
        "predicate": {
            "buildDefinition": {
                "buildType": "urn:graspmill:job:2",
                "externalParameters": {
                    "product": manifest.product,
                    "job": { "name": layout::JOB, "digest": { "graspmillJob": manifest.job, "sha256": job } },
                },
                "internalParameters": { "formatVersion": manifest.format_version, "platform": manifest.platform },
                "resolvedDependencies": dependencies(release, name, version),
            },
            "runDetails": {
                "builder": { "id": "urn:graspmill:run", "version": { name: version } },
                "byproducts": byproducts(release),
            },
        },
    })
}

/// Program, physics library and assets.
fn dependencies(release: &Release, name: &str, version: &str) -> Vec<Value> {
    let mut found = vec![json!({ "name": name, "uri": format!("pkg:cargo/{name}@{version}") })];
    if let Some(library) = release.manifest.platform.get("libmujoco") {
        let mut row = json!({ "name": "libmujoco" });
        // Any other text is the version of an unknown file.
        match library.len() == 64 && library.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            true => row["digest"] = json!({ "blake3": library }),
            false => row["annotations"] = json!({ "version": library }),
        }
        found.push(row);
    }
    found.extend(release.assets.iter().map(|asset| {
        let mut digest = Map::from_iter([("graspmillContent".to_owned(), json!(asset.content))]);
        digest.extend(asset.file_blake3.as_ref().map(|file| ("blake3".to_owned(), json!(file))));
        json!({
            "name": asset.name,
            "digest": digest,
            "annotations": { "kind": asset.kind, "source": asset.source, "licence": asset.licence },
        })
    }));
    found
}

/// The other shipped files of the dataset.
fn byproducts(release: &Release) -> Vec<Value> {
    let others = release.manifest.files.keys().filter(|path| *path != layout::JOB);
    let file = |path: &String| {
        let file = release.files.get(path)?;
        Some(json!({ "name": path, "digest": { "blake3": file.blake3, "sha256": file.sha256 } }))
    };
    others.filter_map(file).collect()
}
