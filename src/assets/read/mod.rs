//! Mesh files: STL, OBJ, PLY and OFF, with the byte or line of every error. Seams are joined and polygons cut into
//! triangles, nothing else is changed.

mod cut;
mod delaunay;
mod disguise;
mod obj;
mod off;
mod outline;
mod ply;
mod polygons;
mod raw;
mod stl;
mod text;

use std::path::Path;

pub(super) use self::raw::RawMesh;

use self::raw::CONVERT;
use crate::{MeshRefusal, Refuse};
use kernel::{
    files::{self, Bound, FileRefusal},
    geom::Triangles,
    remedy,
    words::Show,
};

/// Reads a mesh file: its bytes (for the digest) and its triangles.
pub(super) fn read(path: &Path) -> Result<(Vec<u8>, RawMesh), MeshRefusal> {
    let bytes = load(path).map_err(|refuse| refuse.about(path.display().to_string()))?;
    let raw = parse(path, &bytes).map_err(|refuse| refuse.about(path.display().to_string()))?;
    Ok((bytes, raw))
}

/// The triangles of a mesh file in the file's unit, seams joined and nothing else repaired; corners that share a
/// position may be one.
///
/// # Errors
/// When the file can't be read, or holds a position that is not finite or a face whose outline crosses itself.
pub fn read_triangles(path: &Path) -> Result<Triangles, MeshRefusal> {
    let (_, raw) = read(path)?;
    if let Some((vertex, location)) = raw.not_finite.first() {
        return Err(Refuse::not_finite(raw.positions[*vertex as usize]).at(location).about(path.display().to_string()));
    }
    if let Some(left_out) = &raw.left_out {
        return Err(left_out.refusal().about(path.shown()));
    }
    Ok(Triangles { corners: raw.positions.into_iter().map(Into::into).collect(), triangles: raw.faces })
}

fn load(path: &Path) -> Result<Vec<u8>, Refuse> {
    let unreadable = |error: std::io::Error| match (error.kind(), FileRefusal::find_in(&error)) {
        (std::io::ErrorKind::NotFound, _) => {
            Refuse::new("not_found", "no such file", "check the path, which starts at the job file's folder")
        }
        (_, Some(FileRefusal::NotRegular { found: "a folder" })) => {
            Refuse::new("unreadable", "is a folder", "name a mesh file, or list the folder as `folder = ...`")
        }
        (_, Some(FileRefusal::TooLarge { size, bound })) => {
            let problem = format!("holds {size} bytes; at most {} are read", bound.bytes);
            Refuse::new("too_big_file", problem, "simplify the mesh: a million triangles are plenty")
        }
        _ => Refuse::new("unreadable", format!("cannot be read: {error}"), remedy::for_reading(&error)),
    };
    let mut file = files::open_bounded(path, Bound::MESH).map_err(unreadable)?;
    // A file without the header of its format is refused by its first bytes.
    let head = files::peek(&file).map_err(unreadable)?;
    if let (Some(refuse), true) = (judged(path, &head), head.len() as u64 == files::HEAD_BYTES) {
        return Err(refuse);
    }
    files::read_open(&mut file, Bound::MESH).map_err(unreadable)
}

/// Refusal of a file by its first bytes, if a reader needs no others for it.
fn judged(path: &Path, head: &[u8]) -> Option<Refuse> {
    let has_head = match extension_of(path).as_deref() {
        Some("ply") => text::without_mark(head).starts_with(b"ply"),
        // Text has no zero byte.
        Some("obj" | "off") => !head.contains(&0),
        Some("stl") => return None,
        _ => false,
    };
    if has_head { None } else { parse(path, head).err() }
}

fn extension_of(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase())
}

fn parse(path: &Path, bytes: &[u8]) -> Result<RawMesh, Refuse> {
    if bytes.is_empty() {
        return Err(Refuse::new("empty_file", "the file is empty", "export or copy it again"));
    }
    if bytes.starts_with(b"version https://git-lfs") {
        return Err(Refuse::new("lfs_pointer", "the file is a Git LFS pointer instead of a mesh", "run git lfs pull"));
    }
    let extension = extension_of(path);
    let reader: fn(&[u8]) -> Result<RawMesh, Refuse> = match extension.as_deref() {
        Some("stl") => stl::read,
        Some("obj") => obj::read,
        Some("ply") => ply::read,
        Some("off") => off::read,
        Some(other) => {
            return Err(Refuse::new("format", format!("the format .{other} is not read"), CONVERT));
        }
        None => return Err(Refuse::new("format", "the file has no extension that names its format", CONVERT)),
    };
    // A file that cannot be read as its extension may have another format that its first bytes identify.
    read_faces(reader, bytes).map_err(|refuse| disguise::refusal(bytes, extension.as_deref()).unwrap_or(refuse))
}

fn read_faces(reader: fn(&[u8]) -> Result<RawMesh, Refuse>, bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let raw = reader(bytes)?;
    if raw.faces.is_empty() {
        return Err(Refuse::new(
            "no_faces",
            format!("{} points, but no faces", raw.positions.len()),
            "export a surface of triangles, not points or lines",
        ));
    }
    Ok(raw)
}

/// Whether the name of a file ends like a mesh: a format that is read here, or one that is refused with a remedy.
pub(super) fn is_mesh_name(path: &Path) -> bool {
    matches!(extension_of(path).as_deref(), Some("stl" | "obj" | "ply" | "off" | "glb" | "gltf" | "dae" | "3mf"))
}
