//! Root digests: two datasets with equal roots are the same, regardless of shards, threads, paths or clocks.
//!
//! `parts(a, b, ...)` is BLAKE3 over the parts, each prefixed by its length as a little-endian u64. A tree's node is
//! `parts("node", left, right)`; levels pair from the left and an odd last one moves up unchanged; a tree of one leaf is
//! that leaf, an empty one is `parts("empty")`. Leaves begin with another word than "node", so no leaf is a node.

use kernel::ids::{Digest, JobDigest, SampleId};

/// A Merkle tree that does not keep its leaves: one digest per level.
#[derive(Default)]
pub(super) struct Tree {
    /// Complete subtrees, largest first, with their count of leaves (a power of two).
    subtrees: Vec<(u64, Digest)>,
}

impl Tree {
    /// Adds the next leaf; leaves come sorted.
    pub fn push(&mut self, leaf: Digest) {
        let mut subtree = (1, leaf);
        while let Some((_, left)) = self.subtrees.pop_if(|(leaves, _)| *leaves == subtree.0) {
            subtree = (2 * subtree.0, node(&left, &subtree.1));
        }
        self.subtrees.push(subtree);
    }

    /// The tree's digest.
    pub fn root(self) -> Digest {
        let folded =
            self.subtrees.into_iter().rev().map(|(_, digest)| digest).reduce(|right, left| node(&left, &right));
        folded.unwrap_or_else(|| Digest::hash_parts([b"empty".as_slice()]))
    }
}

fn node(left: &Digest, right: &Digest) -> Digest {
    Digest::hash_parts([b"node".as_slice(), &left.0, &right.0])
}

/// Leaf of a kept sample; `payloads` are (topic, digest of the payload), sorted by topic.
pub(super) fn sample_leaf<'a>(sample: &SampleId, payloads: impl IntoIterator<Item = (&'a str, &'a Digest)>) -> Digest {
    let id = sample.to_bytes();
    let head = [b"sample".as_slice(), &id];
    Digest::hash_parts(
        head.into_iter().chain(payloads.into_iter().flat_map(|(topic, digest)| [topic.as_bytes(), &digest.0])),
    )
}

/// Leaf of a rejected sample.
pub(super) fn reject_leaf(sample: &SampleId, reason: &str, detail: &str) -> Digest {
    Digest::hash_parts([b"reject".as_slice(), &sample.to_bytes(), reason.as_bytes(), detail.as_bytes()])
}

/// Leaf of a row of the asset table, as canonical JSON.
pub(super) fn asset_leaf(canonical: &str) -> Digest {
    Digest::hash_parts([b"asset".as_slice(), canonical.as_bytes()])
}

/// The digest of a dataset from its parts; classes by name, sorted.
/// `files` are the words and digests of files that only its product has.
pub(super) fn dataset_root(
    classes: &[(&str, Digest)],
    rejects: &Digest,
    assets: &Digest,
    files: &[(&str, Digest)],
    job: &JobDigest,
) -> Digest {
    let mut parts: Vec<&[u8]> = vec![b"graspmill dataset 2"];
    for (name, root) in classes {
        parts.extend([name.as_bytes(), &root.0]);
    }
    parts.extend([b"rejects".as_slice(), &rejects.0, b"assets", &assets.0]);
    for (word, digest) in files {
        parts.extend([word.as_bytes(), &digest.0]);
    }
    parts.extend([b"job".as_slice(), &job.0.0]);
    Digest::hash_parts(parts)
}

/// JSON in one spelling: keys sorted by bytes, no white space, numbers as `serde_json` writes them.
pub(super) fn canonical_json(value: &serde_json::Value) -> String {
    use serde_json::Value;
    match value {
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(canonical_json).collect();
            format!("[{}]", items.join(","))
        }
        Value::Object(fields) => {
            let sorted: std::collections::BTreeMap<_, _> = fields.iter().collect();
            let fields: Vec<String> = (sorted.into_iter())
                .map(|(key, value)| format!("{}:{}", Value::from(key.as_str()), canonical_json(value)))
                .collect();
            format!("{{{}}}", fields.join(","))
        }
        plain => plain.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Level by level, as the definition reads.
    fn by_levels(mut level: Vec<Digest>) -> Digest {
        if level.is_empty() {
            return Digest::hash_parts([b"empty".as_slice()]);
        }
        while level.len() > 1 {
            level = (level.chunks(2))
                .map(|pair| if let [left, right] = pair { node(left, right) } else { pair[0] })
                .collect();
        }
        level[0]
    }

    #[test]
    fn the_streamed_tree_is_the_tree_built_by_levels() {
        for count in 0..70u64 {
            let leaves: Vec<_> = (0..count).map(|leaf| Digest::hash(&leaf.to_le_bytes())).collect();
            let mut tree = Tree::default();
            leaves.iter().for_each(|leaf| tree.push(*leaf));
            assert_eq!(tree.root(), by_levels(leaves), "{count} leaves");
        }
    }

    #[test]
    fn a_tree_knows_order_and_count_of_its_leaves() {
        let leaves = [Digest::hash(b"a"), Digest::hash(b"b"), Digest::hash(b"c")];
        let root = |order: &[usize]| {
            let mut tree = Tree::default();
            order.iter().for_each(|index| tree.push(leaves[*index]));
            tree.root()
        };
        assert_ne!(root(&[0, 1, 2]), root(&[1, 0, 2]));
        // The classic fault: a doubled last leaf must not pass for an odd one.
        assert_ne!(root(&[0, 1, 2]), root(&[0, 1, 2, 2]));
    }

    #[test]
    fn canonical_json_has_sorted_keys_and_exact_numbers() {
        let value: serde_json::Value =
            serde_json::from_str(r#"{ "b": [1, 0.1, null], "a": {"z": "\"", "y": -2.5e-9} }"#).unwrap();
        assert_eq!(canonical_json(&value), r#"{"a":{"y":-2.5e-9,"z":"\""},"b":[1,0.1,null]}"#);
    }
}
