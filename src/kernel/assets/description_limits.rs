//! Sizes that an MJCF description may ask for. MuJoCo takes whatever memory and time a few letters of XML ask for, so they are
//! looked at before it compiles anything.

/// Most copies of elements by `replicate`, `composite` and `flexcomp`, in a description with all that it includes. Robots and
/// hands have some hundred elements, the largest scenes some thousand.
pub(super) const MAX_COPIES: f64 = 100_000.0;

/// Attributes that ask for memory, with the largest value of each number in them.
const LIMITS: [(&str, &str, f64); 9] = [
    ("hfield", "ncol", 8192.0),
    ("hfield", "nrow", 8192.0),
    ("numeric", "size", 1e6),
    ("size", "memory", GIGABYTES_16),
    ("size", "nkey", 10_000.0),
    ("size", "nstack", 1e9),
    ("size", "nuserdata", 1e6),
    ("texture", "height", 16_384.0),
    ("texture", "width", 16_384.0),
];

const GIGABYTES_16: f64 = 16.0 * 1024.0 * 1024.0 * 1024.0;

/// A description that asks for more than any robot, hand or scene needs, inside an [`io::Error`](std::io::Error).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DescriptionTooLarge {
    /// Too many copies of elements.
    #[error(
        "it asks for {copies:.0} copies of elements, {MAX_COPIES:.0} at most are taken; lower the counts of `{element}`"
    )]
    Copies {
        /// Copies so far.
        copies: f64,
        /// Element that asks for the last of them.
        element: String,
    },
    /// A number that asks for too much memory.
    #[error("`{attribute}` of `{element}` is {value}, {limit} at most is taken")]
    Value {
        /// The element.
        element: &'static str,
        /// The attribute.
        attribute: &'static str,
        /// Text of the attribute.
        value: String,
        /// The limit.
        limit: f64,
    },
}

/// Refuses an element whose attributes ask for too much memory.
pub(super) fn check_values(element: &str, attributes: &[(&str, &str)]) -> Result<(), DescriptionTooLarge> {
    for (name, value) in attributes {
        let Some((element, attribute, limit)) = LIMITS.iter().find(|row| (row.0, row.1) == (element, *name)) else {
            continue;
        };
        if value.split_whitespace().any(|word| number(word) > *limit) {
            let value = (*value).to_owned();
            return Err(DescriptionTooLarge::Value { element, attribute, value, limit: *limit });
        }
    }
    Ok(())
}

/// Copies that one element of this kind makes: the product of its counts, or of none that is a number, one.
pub(super) fn copies(element: &str, count: Option<&str>) -> Option<f64> {
    let makes_copies = matches!(element, "replicate" | "composite" | "flexcomp");
    makes_copies.then(|| count.unwrap_or("1").split_whitespace().map(number).map(|count| count.max(1.0)).product())
}

/// A number with MuJoCo's suffix of a size (`K`, `M`, `G`, `T`, `P`, `E`); what is none is 0: MuJoCo refuses it itself.
fn number(word: &str) -> f64 {
    let (digits, suffix) =
        word.split_at(word.len() - word.chars().last().filter(char::is_ascii_alphabetic).map_or(0, |_| 1));
    let power = match suffix.to_ascii_uppercase().as_str() {
        "K" => 1,
        "M" => 2,
        "G" => 3,
        "T" => 4,
        "P" => 5,
        "E" => 6,
        _ => 0,
    };
    digits.parse::<f64>().unwrap_or(0.0) * 1024f64.powi(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_with_their_suffix() {
        for (word, expected) in
            [("12", 12.0), ("-1", -1.0), ("2K", 2048.0), ("900G", 900.0 * 1024f64.powi(3)), ("é", 0.0)]
        {
            assert_eq!(number(word), expected, "{word}");
        }
        assert_eq!(copies("replicate", Some("1000000000")), Some(1e9));
        assert_eq!(copies("flexcomp", Some("10 20 30")), Some(6000.0));
        assert_eq!((copies("composite", None), copies("geom", Some("9"))), (Some(1.0), None));
    }

    #[test]
    fn what_asks_for_much_memory_is_refused() {
        assert_eq!(check_values("texture", &[("width", "512"), ("height", "512")]), Ok(()));
        assert_eq!(check_values("size", &[("memory", "-1")]), Ok(()));
        assert!(check_values("texture", &[("width", "1000000")]).is_err());
        let error = check_values("size", &[("memory", "900G")]).unwrap_err().to_string();
        assert!(error.contains("`memory` of `size` is 900G"), "{error}");
    }
}
