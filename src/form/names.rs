//! Suggestions for misspelt names.

/// Returns `did you mean ...?` with the known name nearest to `found`, if one is similar enough.
///
/// ```
/// use graspmill_form::did_you_mean;
///
/// assert_eq!(did_you_mean("color", ["colour", "depth"]).as_deref(), Some("did you mean `colour`?"));
/// assert_eq!(did_you_mean("resolution", ["colour", "depth"]), None);
/// ```
pub fn did_you_mean<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(found, known).map(|name| format!("did you mean `{name}`?"))
}

/// The known name nearest to `found`, if one is similar enough: a third of its letters may differ, and case is ignored.
pub fn nearest<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace(['-', ' '], "_");
    let wanted = plain(found);
    let length = wanted.chars().count();
    let max_distance = (length / 3).max(1);
    let distance = |name: &str| {
        let name = plain(name);
        if wanted.len() >= 3 && name.split('_').any(|word| word == wanted) {
            return Some(1);
        }
        // The distance of two names is at least the difference of their lengths.
        let is_far = name.chars().count().abs_diff(length) > max_distance;
        (!is_far).then(|| strsim::damerau_levenshtein(&wanted, &name)).filter(|distance| *distance <= max_distance)
    };
    known.into_iter().filter_map(|name| Some((distance(name)?, name))).min().map(|(_, name)| name)
}

/// Index of the first item that repeats an earlier one.
pub fn first_repeated<T: PartialEq>(items: &[T]) -> Option<usize> {
    (1..items.len()).find(|index| items[..*index].contains(&items[*index]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_near_by_letters_or_by_a_word_of_theirs() {
        let known = ["horizontal_fov", "near", "width"];
        for (found, name) in [
            ("widht", Some("width")),
            ("WIDTH", Some("width")),
            ("fov", Some("horizontal_fov")),
            ("Horizontal-FOV", Some("horizontal_fov")),
            ("no", None),
            ("", None),
            ("farther", None),
        ] {
            assert_eq!(nearest(found, known), name, "{found}");
        }
        // A key of megabytes is not compared.
        assert_eq!(nearest(&"x".repeat(2_000_000), known), None);
        // Of two equally near names, the alphabetically first.
        assert_eq!(nearest("bag", ["bat", "bad"]), Some("bad"));
    }
}
