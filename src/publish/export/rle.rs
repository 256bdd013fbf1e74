//! Masks as COCO's run lengths.

use serde_json::{Value, json};

/// Lengths of the runs of a mask column by column, beginning with pixels that are not set: COCO's uncompressed form.
pub(super) fn run_lengths(mask: &[bool], width: u32, height: u32) -> Value {
    let pixels = (0..width as usize).flat_map(|column| (0..height as usize).map(move |row| (column, row)));
    let (mut counts, mut current, mut length) = (Vec::new(), false, 0u32);
    for (column, row) in pixels {
        let own = mask[row * width as usize + column];
        if own != current {
            counts.push(length);
            (current, length) = (own, 0);
        }
        length += 1;
    }
    counts.push(length);
    json!({ "size": [height, width], "counts": counts })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_go_down_the_columns_and_begin_with_what_is_not_set() {
        let mask = [true, false, true, true, false, false];
        // Columns: (true, true), (false, false), (true, false).
        assert_eq!(run_lengths(&mask, 3, 2), json!({ "size": [2, 3], "counts": [0, 2, 2, 1, 1] }));
        assert_eq!(run_lengths(&[false; 6], 3, 2), json!({ "size": [2, 3], "counts": [6] }));
    }
}
