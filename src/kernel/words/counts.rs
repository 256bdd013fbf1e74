//! Counts and sizes in sentences.

/// A count with its noun, `1 shard` or `2 cavities`.
pub fn counted(count: u64, noun: &str) -> String {
    match (count, noun.strip_suffix("y")) {
        (1, _) => format!("1 {noun}"),
        (_, Some(stem)) => format!("{count} {stem}ies"),
        (_, None) if noun.ends_with("sh") => format!("{count} {noun}es"),
        (_, None) => format!("{count} {noun}s"),
    }
}

/// A size of files: `812 bytes`, `23.4 kB`, `1.5 MB` or `2.3 GB`, in powers of 1000.
pub fn size_in_words(bytes: u64) -> String {
    match bytes {
        0..1_000 => counted(bytes, "byte"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_sizes_read_as_words() {
        let counts = [(1, "shard"), (0, "shard"), (2, "cavity"), (3, "mesh")].map(|(count, noun)| counted(count, noun));
        assert_eq!(counts, ["1 shard", "0 shards", "2 cavities", "3 meshes"]);
        let sizes = [1, 999, 1_000, 23_449, 1_500_000, 2_340_000_000].map(size_in_words);
        assert_eq!(sizes, ["1 byte", "999 bytes", "1.0 kB", "23.4 kB", "1.5 MB", "2.3 GB"]);
    }
}
