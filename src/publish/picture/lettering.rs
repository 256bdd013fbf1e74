//! Captions: words and panels over them.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster};

use super::Picture;

/// Height of a line of words [px].
const LINE: RasterHeight = RasterHeight::Size32;
/// Ink of the words, at full coverage.
const INK: [u8; 3] = [0x33, 0x33, 0x33];

/// A picture over a caption of a few words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Panel {
    /// Caption, in printable ASCII.
    pub caption: String,
    /// The picture.
    pub picture: Picture,
}

impl Panel {
    /// Panels from left to right on white, `gap` pixels apart, all as wide and as high as the largest picture.
    ///
    /// # Panics
    /// If a caption holds a letter that is not printable ASCII.
    pub fn row(panels: &[Self], gap: u32) -> Picture {
        let sides = panels.iter().map(|panel| panel.picture.width.max(panel.picture.height));
        let side = sides.max().unwrap_or(1);
        let columns: Vec<Picture> = panels
            .iter()
            .map(|panel| Picture::column(&[panel.picture.clone().in_square(side), words(&panel.caption)], gap / 3))
            .collect();
        Picture::row(&columns, gap)
    }
}

/// One line of words, dark on a clear ground.
fn words(text: &str) -> Picture {
    let rasters: Vec<_> = text
        .chars()
        .map(|letter| get_raster(letter, FontWeight::Regular, LINE).expect("printable ASCII has glyphs"))
        .collect();
    let width: usize = rasters.iter().map(|raster| raster.width()).sum();
    let mut line = Picture::filled((width as u32).max(1), LINE.val() as u32, [0; 4]);
    let mut left = 0;
    for raster in rasters {
        for (row, cover) in (0u32..).zip(raster.rows()) {
            for (column, alpha) in (left..).zip(cover) {
                let [r, g, b] = INK;
                line.fill(column..column + 1, row..row + 1, [r, g, b, *alpha]);
            }
        }
        left += raster.width() as u32;
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A panel is its picture in a square as large as the largest, and its words in the middle below.
    #[test]
    fn words_stand_below_their_picture() {
        let panel = |side, caption: &str| Panel {
            caption: caption.to_owned(),
            picture: Picture::filled(side, side, [255, 0, 0, 255]),
        };
        let row = Panel::row(&[panel(100, "lid"), panel(60, "I")], 30);
        assert_eq!((row.width, row.height), (230, 142));
        let dark = |columns: std::ops::Range<u32>| {
            let below = columns.flat_map(|column| (110..142).map(move |line| (column, line)));
            below.filter(|(column, line)| row.at(*column, *line)[0] < 128).map(|(column, _)| column).collect::<Vec<_>>()
        };
        let (first, second) = (dark(0..100), dark(130..230));
        assert!(!first.is_empty() && !second.is_empty());
        let middle = |columns: &[u32]| (columns.iter().min().unwrap() + columns.iter().max().unwrap()) / 2;
        assert!(middle(&first).abs_diff(50) <= 4 && middle(&second).abs_diff(180) <= 4);
        // The smaller picture has white around it.
        assert_eq!([row.at(140, 50), row.at(180, 50), row.at(115, 50)], [[255; 4], [255, 0, 0, 255], [255; 4]]);
    }
}
