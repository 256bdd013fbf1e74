//! Squares of a colour image, resampled to the pixels of a patch.

/// Pixel of a patch of `side` x `side` pixels that shows a square of `window` x `window` pixels: the mean over the area
/// that it covers, in which each pixel of the square has the weight of its covered area. In whole numbers, halves
/// rounded up. `pixel` gives the colour at a column and a row of the square.
pub fn area_mean([column, row]: [u32; 2], window: u32, side: u32, pixel: impl Fn(u32, u32) -> [u8; 3]) -> [u8; 3] {
    let mut sums = [0_u64; 3];
    for (y, high) in covered(row, window, side) {
        for (x, wide) in covered(column, window, side) {
            for (sum, level) in sums.iter_mut().zip(pixel(x, y)) {
                *sum += high * wide * u64::from(level);
            }
        }
    }
    let all = u64::from(window) * u64::from(window);
    sums.map(|sum| ((2 * sum + all) / (2 * all)) as u8)
}

/// Pixels along an axis of the square that a pixel of the patch covers, and how much of each: shares of a pixel, times `side`.
fn covered(index: u32, window: u32, side: u32) -> impl Iterator<Item = (u32, u64)> {
    let [index, window, side] = [index, window, side].map(u64::from);
    let (begin, end) = (index * window, (index + 1) * window);
    (begin / side..end.div_ceil(side)).map(move |pixel| {
        let covered = end.min((pixel + 1) * side) - begin.max(pixel * side);
        (pixel as u32, covered)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn whole_pixels_stay_and_halves_mix() {
        let pixel = |column: u32, row: u32| [(10 * column) as u8, (20 * row) as u8, 7];
        assert_eq!(area_mean([2, 3], 8, 8, pixel), [20, 60, 7]);
        // Two by two pixels in one.
        assert_eq!(area_mean([1, 0], 8, 4, pixel), [25, 10, 7]);
        // Each pixel in two by two.
        assert_eq!([area_mean([2, 0], 4, 8, pixel), area_mean([3, 1], 4, 8, pixel)], [[10, 0, 7]; 2]);
        // Three pixels in two: the middle one is shared, (0 * 2 + 10) / 3 and (10 + 20 * 2) / 3.
        assert_eq!([area_mean([0, 0], 3, 2, pixel)[0], area_mean([1, 0], 3, 2, pixel)[0]], [3, 17]);
    }

    proptest! {
        /// The areas of all pixels of a patch are those of the square, each counted once.
        #[test]
        fn areas_add_up(window in 1..200_u32, side in 1..200_u32) {
            let mut sums = vec![0; window as usize];
            for index in 0..side {
                let mut all = 0;
                for (pixel, share) in covered(index, window, side) {
                    sums[pixel as usize] += share;
                    all += share;
                }
                prop_assert_eq!(all, u64::from(window));
            }
            prop_assert!(sums.iter().all(|sum| *sum == u64::from(side)));
        }
    }
}
