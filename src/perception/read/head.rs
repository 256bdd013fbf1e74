//! Size of a picture by its head, before the rest is read.

use super::raw::{FrameProblem, pixel_count};

/// Bytes of a file beside its pixels: heads, palettes, comments.
const BESIDE: u64 = 16 << 20;
/// Largest number of a point or pixel in text, with what separates it [bytes].
const TEXT_NUMBER: u64 = 64;
/// Most bytes of a pixel of a PNG, by rows of red, green, blue and alpha of 16 bits; deflate that packs nothing adds little.
const PNG_PIXEL: u64 = 9;

/// Most bytes that a file with this head can use; `None` if its format's mark is missing, so that no more than the head is worth
/// reading.
///
/// # Errors
/// When the header states more pixels than a picture may have.
pub(super) fn most_bytes(kind: &str, head: &[u8]) -> Result<Option<u64>, FrameProblem> {
    let bytes_of = |sides: Option<[usize; 2]>, per_pixel: u64, place: &str| {
        let Some([width, height]) = sides else { return Ok(None) };
        let pixels = pixel_count(width, height, place)? as u64;
        Ok(Some(BESIDE + pixels * per_pixel))
    };
    match kind {
        "png" => bytes_of(png_sides(head), PNG_PIXEL, "the PNG's head"),
        "npy" => bytes_of(npy_sides(head), 8, "the NPY's head"),
        "pcd" => bytes_of(sides_of_words(head, ["WIDTH", "HEIGHT"]), point_bytes(head), "WIDTH and HEIGHT"),
        "ply" if head.starts_with(b"ply") => {
            bytes_of(sides_of_words(head, ["num_cols", "num_rows"]), point_bytes(head), "num_cols and num_rows")
        }
        _ => Ok(None),
    }
}

/// Width and height of the first chunk (PNG, ISO 15948, 11.2.2).
fn png_sides(head: &[u8]) -> Option<[usize; 2]> {
    let rest = head.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    let side = |at: usize| Some(u32::from_be_bytes(*rest.get(at..)?.first_chunk()?) as usize);
    Some([side(8)?, side(12)?])
}

fn npy_sides(head: &[u8]) -> Option<[usize; 2]> {
    let array = kernel::npy::NpyArray::parse(head).ok()?;
    let [height, width] = array.shape[..] else { return None };
    Some([width, height])
}

/// The numbers behind two words of a head of text.
fn sides_of_words(head: &[u8], words: [&str; 2]) -> Option<[usize; 2]> {
    let text = String::from_utf8_lossy(head);
    let number = |wanted: &str| {
        let mut found = text.split_whitespace().skip_while(|word| *word != wanted).skip(1);
        found.next()?.parse().ok()
    };
    let [width, height] = words.map(number);
    Some([width?, height?])
}

/// Most bytes of a point: numbers in text are the longest form. A head names a property or field a word each.
fn point_bytes(head: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(head);
    let properties = text.lines().filter(|line| line.starts_with("property ")).count();
    let counts = text.lines().filter_map(|line| line.strip_prefix("COUNT ").or_else(|| line.strip_prefix("SIZE ")));
    let fields =
        counts.map(|line| line.split_whitespace().map(|word| word.parse::<u64>().unwrap_or(1)).sum::<u64>()).max();
    TEXT_NUMBER * (properties as u64).max(fields.unwrap_or(0)).clamp(3, 4096)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_tell_how_much_is_worth_reading() {
        let npy = |shape: &str| {
            let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
            [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat()
        };
        let png = [&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], &640_u32.to_be_bytes(), &480_u32.to_be_bytes()].concat();
        let pcd =
            b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 640\nHEIGHT 480\nDATA binary\n";
        let ply = b"ply\nformat ascii 1.0\nobj_info num_cols 640\nobj_info num_rows 480\nelement vertex 307200\n\
                    property float x\nproperty float y\nproperty float z\nend_header\n";
        for (kind, head) in [("npy", npy("(480, 640)")), ("png", png), ("pcd", pcd.to_vec()), ("ply", ply.to_vec())] {
            let most = most_bytes(kind, &head).expect("a size").expect("a head");
            let pixels = 640 * 480;
            assert!((BESIDE + 4 * pixels..BESIDE + 4096 * pixels).contains(&most), "{kind}: {most}");
            assert_eq!(most_bytes(kind, &[0; 4096]).expect("no head"), None, "{kind}");
        }
        let error = most_bytes("npy", &npy("(100000, 100000)")).expect_err("too many");
        assert!(error.to_string().contains("100000 x 100000"), "{error}");
    }
}
