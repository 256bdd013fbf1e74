//! Solids in every format that is read, whole and with polygons where the format has them.

use std::fmt::Write;

use graspmill::seed::Stream;

use crate::support::solid::Solid;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    BinaryStl,
    TextStl,
    Obj,
    TextPly,
    LittlePly,
    BigPly,
    Off,
}

impl Format {
    pub const ALL: [Self; 7] =
        [Self::BinaryStl, Self::TextStl, Self::Obj, Self::TextPly, Self::LittlePly, Self::BigPly, Self::Off];

    pub fn extension(self) -> &'static str {
        match self {
            Self::BinaryStl | Self::TextStl => "stl",
            Self::Obj => "obj",
            Self::TextPly | Self::LittlePly | Self::BigPly => "ply",
            Self::Off => "off",
        }
    }

    /// Whether faces may have more than three corners.
    pub fn has_polygons(self) -> bool {
        self.extension() != "stl"
    }

    /// The content of a file of a solid.
    pub fn write(self, solid: &Solid) -> Vec<u8> {
        match self {
            Self::BinaryStl => binary_stl(solid),
            Self::TextStl => text_stl(solid).into_bytes(),
            Self::Obj => obj(solid).into_bytes(),
            Self::TextPly => text_ply(solid).into_bytes(),
            Self::LittlePly => binary_ply(solid, false),
            Self::BigPly => binary_ply(solid, true),
            Self::Off => off(solid).into_bytes(),
        }
    }
}

/// With its faces in another order, each from another corner on.
pub fn shuffled(mut solid: Solid, draw: &mut Stream) -> Solid {
    for index in (1..solid.faces.len()).rev() {
        solid.faces.swap(index, draw.below(index as u64 + 1) as usize);
    }
    for face in &mut solid.faces {
        let corners = face.len() as u64;
        face.rotate_left(draw.below(corners) as usize);
    }
    solid
}

/// Corners of its triangles, polygons as fans.
fn triangles(solid: &Solid) -> impl Iterator<Item = [[f32; 3]; 3]> {
    let mesh = solid.mesh();
    mesh.triangles.into_iter().map(move |corners| corners.map(|corner| mesh.vertices[corner as usize]))
}

fn binary_stl(solid: &Solid) -> Vec<u8> {
    let mut file = vec![b' '; 80];
    file.extend((triangles(solid).count() as u32).to_le_bytes());
    for corners in triangles(solid) {
        file.extend([0; 12]);
        file.extend(corners.iter().flatten().flat_map(|part| part.to_le_bytes()));
        file.extend([0; 2]);
    }
    file
}

fn text_stl(solid: &Solid) -> String {
    let mut text = "solid part\n".to_owned();
    for corners in triangles(solid) {
        text += " facet normal 0 0 0\n  outer loop\n";
        for [x, y, z] in corners {
            writeln!(text, "   vertex {x:e} {y:e} {z:e}").expect("text");
        }
        text += "  endloop\n endfacet\n";
    }
    text + "endsolid part\n"
}

fn obj(solid: &Solid) -> String {
    let mut text = "# written by a test\no part\n".to_owned();
    solid.points.iter().for_each(|point| writeln!(text, "v {} {} {}", point.x, point.y, point.z).expect("text"));
    text += "vn 0 0 1\ns off\n";
    for face in &solid.faces {
        let corners: String = face.iter().map(|corner| format!(" {}//1", corner + 1)).collect();
        writeln!(text, "f{corners}").expect("text");
    }
    text
}

fn counted_faces(solid: &Solid) -> String {
    let line = |face: &Vec<u32>| {
        let corners: String = face.iter().map(|corner| format!(" {corner}")).collect();
        format!("{}{corners}\n", face.len())
    };
    solid.faces.iter().map(line).collect()
}

fn positions(solid: &Solid) -> String {
    solid.points.iter().map(|point| format!("{} {} {}\n", point.x, point.y, point.z)).collect()
}

fn ply_header(solid: &Solid, format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list ushort int vertex_indices\nend_header\n",
        solid.points.len(),
        solid.faces.len()
    )
}

fn text_ply(solid: &Solid) -> String {
    ply_header(solid, "ascii") + &positions(solid) + &counted_faces(solid)
}

fn binary_ply(solid: &Solid, is_big: bool) -> Vec<u8> {
    let format = if is_big { "binary_big_endian" } else { "binary_little_endian" };
    let mut file = ply_header(solid, format).into_bytes();
    let mut put = |little: &[u8]| {
        let mut bytes = little.to_vec();
        if is_big {
            bytes.reverse();
        }
        file.extend(bytes);
    };
    solid.points.iter().flat_map(|point| point.iter()).for_each(|part| put(&part.to_le_bytes()));
    for face in &solid.faces {
        put(&(face.len() as u16).to_le_bytes());
        face.iter().for_each(|corner| put(&corner.to_le_bytes()));
    }
    file
}

fn off(solid: &Solid) -> String {
    let counts = format!("OFF\n{} {} 0\n", solid.points.len(), solid.faces.len());
    counts + &positions(solid) + &counted_faces(solid)
}
