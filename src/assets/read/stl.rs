//! STL, binary and ASCII (3D Systems, "StereoLithography Interface Specification", 1989).
//!
//! Stored normals and attribute words are ignored: the winding of the corners says which side is out.

use super::RawMesh;
use crate::assets::{Refuse, weld::Welder};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads either form. The length decides first, because many binary files start with the word "solid" too.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let declared = bytes.get(80..HEADER).map(|count| u64::from(u32::from_le_bytes(count.try_into().expect("4 bytes"))));
    let fits = declared.is_some_and(|count| HEADER as u64 + RECORD as u64 * count == bytes.len() as u64);
    if !fits && looks_ascii(bytes) {
        return Err(Refuse::new("format", "ASCII STL is not read yet", super::CONVERT));
    }
    match declared {
        Some(declared) => binary(bytes, declared),
        None => Err(Refuse::new(
            "truncated",
            format!("{} bytes; a binary STL starts with a header of {HEADER}", bytes.len()),
            "copy or export it again",
        )),
    }
}

/// ASCII files start with "solid" and soon say "facet" or "endsolid"; nothing binary does both.
fn looks_ascii(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let start = &start[..start.len().min(4096)];
    let says = |word: &[u8]| start.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word));
    start.len() >= 5 && start[..5].eq_ignore_ascii_case(b"solid") && (says(b"facet") || says(b"endsolid"))
}

fn binary(bytes: &[u8], declared: u64) -> Result<RawMesh, Refuse> {
    let mut notes = Vec::new();
    let body = &bytes[HEADER..];
    let present = body.len() / RECORD;
    if declared > present as u64 {
        let problem = format!(
            "the header declares {declared} triangles ({} bytes), the file has {} bytes: {present} whole triangles",
            HEADER as u64 + RECORD as u64 * declared,
            bytes.len(),
        );
        return Err(Refuse::new("truncated", problem, "copy or export it again").at(format!("byte {}", bytes.len())));
    }
    let mut count = declared as usize;
    if count < present {
        if count == 0 && body.len().is_multiple_of(RECORD) {
            count = present;
            notes.push(format!("the header declares 0 triangles; all {present} in the file are used"));
        } else {
            let extra = body.len() - RECORD * count;
            notes.push(format!("{extra} bytes after the declared {count} triangles are ignored"));
        }
    }

    // A closed mesh has about half as many vertices as triangles.
    let mut welder = Welder::new(count / 2 + 2);
    let mut faces = Vec::with_capacity(count);
    for (triangle, record) in body.chunks_exact(RECORD).take(count).enumerate() {
        let number = |place: usize| f32::from_le_bytes(record[place..place + 4].try_into().expect("4 bytes"));
        let corners: [[f32; 3]; 3] =
            std::array::from_fn(|k| std::array::from_fn(|axis| number(12 + 12 * k + 4 * axis)));
        // 0 for finite numbers, NaN otherwise.
        let poison: f32 = corners.iter().flatten().map(|coordinate| coordinate * 0.0).sum();
        if poison.is_nan() {
            return Err(not_finite(triangle, &corners));
        }
        faces.push(corners.map(|corner| welder.index(corner)));
    }
    let positions = welder.into_positions().into_iter().map(|position| position.map(f64::from)).collect();
    Ok(RawMesh { positions, faces, welded: true, notes, ..RawMesh::default() })
}

#[cold]
fn not_finite(triangle: usize, corners: &[[f32; 3]; 3]) -> Refuse {
    let corner = corners.iter().position(|corner| !corner.iter().all(|x| x.is_finite())).unwrap_or(0);
    let byte = HEADER + RECORD * triangle + 12 + 12 * corner;
    Refuse::not_finite(corners[corner].map(f64::from)).at(format!(
        "triangle {}, corner {}, byte {byte}",
        triangle + 1,
        corner + 1
    ))
}
