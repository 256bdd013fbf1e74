//! Pictures as PNG bytes and as `data:` addresses.

use std::collections::BTreeMap;

use super::Picture;

impl Picture {
    /// The picture as a PNG file, with a palette when at most 256 different pixels occur; the same bytes every time.
    ///
    /// # Panics
    /// If `pixels` does not hold `width * height` pixels or a side is 0.
    pub fn to_png(&self) -> Vec<u8> {
        assert_eq!(self.pixels.len(), self.width as usize * self.height as usize, "pixels of a whole picture");
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let data = match self.palette() {
            Some(palette) => {
                encoder.set_color(png::ColorType::Indexed);
                encoder.set_filter(png::Filter::NoFilter);
                encoder.set_palette(palette.keys().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect::<Vec<_>>());
                encoder.set_trns(palette.keys().map(|pixel| pixel[3]).collect::<Vec<_>>());
                let runs = self.pixels.chunk_by(|a, b| a == b);
                runs.flat_map(|run| std::iter::repeat_n(palette[&run[0]], run.len())).collect()
            }
            None => {
                encoder.set_color(png::ColorType::Rgba);
                encoder.set_filter(png::Filter::Adaptive);
                self.pixels.concat()
            }
        };
        encoder
            .write_header()
            .and_then(|mut writer| {
                writer.write_image_data(&data)?;
                writer.finish()
            })
            .expect("memory takes every byte, and the image is complete");
        bytes
    }

    /// The PNG as a `data:` address for an `<img>` of a self-contained page.
    pub fn to_data_uri(&self) -> String {
        data_uri(&self.to_png())
    }

    /// Each different pixel with its index, in order; `None` for more than 256.
    fn palette(&self) -> Option<BTreeMap<[u8; 4], u8>> {
        let mut palette = BTreeMap::new();
        for run in self.pixels.chunk_by(|a, b| a == b) {
            palette.insert(run[0], 0);
            if palette.len() > 256 {
                return None;
            }
        }
        for (entry, index) in palette.values_mut().zip(0..=255) {
            *entry = index;
        }
        Some(palette)
    }
}

/// RFC 4648, section 4: the standard alphabet with padding.
/// A PNG as a `data:` address.
pub(crate) fn data_uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", base64(png))
}

fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, entry| bits << 8 | u32::from(group.get(entry).copied().unwrap_or(0)));
        for entry in 0..4 {
            let letter = ALPHABET[(bits >> (18 - 6 * entry) & 63) as usize];
            text.push(if entry <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vectors of RFC 4648, section 10.
    #[test]
    fn base64_vectors() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    fn decoded(png: &[u8]) -> Vec<u8> {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(png));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::ALPHA);
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!(info.color_type, png::ColorType::Rgba);
        pixels
    }

    #[test]
    fn png_comes_back_with_and_without_a_palette() {
        let mut few = Picture::filled(7, 5, [1, 2, 3, 0]);
        few.fill(2..4, 1..9, [200, 100, 50, 255]);
        let many = Picture {
            width: 40,
            height: 30,
            pixels: (0..1200u32).map(|i| [(i % 251) as u8, (i / 7) as u8, 9, (i % 256) as u8]).collect(),
        };
        for picture in [few, many] {
            let png = picture.to_png();
            assert_eq!(decoded(&png), picture.pixels.concat());
            assert_eq!(png, picture.to_png(), "same bytes again");
        }
    }
}
