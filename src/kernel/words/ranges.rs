//! Ascending numbers in words.

/// Ascending numbers as ranges, `3` and `17-19`: joined by commas, as schedulers write arrays.
pub fn number_ranges(numbers: &[u32]) -> Vec<String> {
    let mut ranges: Vec<(u32, u32)> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if last.checked_add(1) == Some(*number) => *last = *number,
            _ => ranges.push((*number, *number)),
        }
    }
    let text = |(first, last): &(u32, u32)| if first == last { first.to_string() } else { format!("{first}-{last}") };
    ranges.iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_numbers_are_ranges() {
        assert_eq!(number_ranges(&[3, 17, 18, 19, u32::MAX]), ["3", "17-19", "4294967295"]);
        assert!(number_ranges(&[]).is_empty());
    }
}
