//! Built-in shapes: a household set made by formula, so that a job needs no download.
//!
//! The name defines the shape: `can-03` is the third can, `can-03@16k` the same can in at least 16,000 triangles. Every
//! shape is a single watertight surface in metres, z up, resting on z = 0 with its main axis on z; half-shapes
//! ([`HalfShape`]) are around the origin instead. The numbers of a shape are drawn from its own stream, so that using
//! more shapes changes none.

mod halves;
mod lathe;
mod solids;
mod surface;
mod tools;
mod tube;

pub use halves::{HalfShape, NoHalfShape};

use self::surface::Surface;
use crate::{MeshOrigin, MeshSource, Refuse, ScaleRule, SizeRule, read::RawMesh, repair::mend};
use kernel::seed::Stream;

/// Default for the least number of triangles.
const DEFAULT_TRIANGLES: usize = 6_000;

/// Fewest and most triangles that a name may request.
const TRIANGLES: std::ops::RangeInclusive<usize> = 500..=4_000_000;

/// Names of the first `count` household shapes: one family after another, so that any number is a mixture.
///
/// The half-shapes ([`HalfShape`]) are apart.
pub fn built_in_names(count: usize) -> impl Iterator<Item = String> {
    (0..count).map(|index| {
        let (number, family) = (index / FAMILIES.len(), &FAMILIES[index % FAMILIES.len()]);
        format!("{}-{:02}", family.name, number + 1)
    })
}

/// Number of household shapes in a job that states none.
pub const DEFAULT_BUILT_INS: usize = 24;

/// The source of a built-in shape; whether the name is known shows when it is prepared.
pub fn built_in_source(name: &str) -> MeshSource {
    MeshSource {
        name: name.to_owned(),
        origin: MeshOrigin::BuiltIn(name.to_owned()),
        scale: ScaleRule::MetresPerUnit(1.0),
        size: SizeRule::default(),
        licence: Some("CC0-1.0".to_owned()),
        citation: None,
        group: Some(name.split(['-', '@']).next().unwrap_or(name).to_owned()),
    }
}

/// One family of shapes.
struct Family {
    name: &'static str,
    /// Draws the numbers of one shape and makes it with at least this many triangles.
    make: fn(&mut Stream, usize) -> Surface,
}

const FAMILIES: [Family; 16] = [
    Family { name: "can", make: lathe::can },
    Family { name: "box", make: solids::cuboid },
    Family { name: "mug", make: tools::mug },
    Family { name: "bottle", make: lathe::bottle },
    Family { name: "superquadric", make: solids::superquadric },
    Family { name: "bowl", make: lathe::bowl },
    Family { name: "hammer", make: tools::hammer },
    Family { name: "cup", make: lathe::cup },
    Family { name: "fruit", make: lathe::fruit },
    Family { name: "pan", make: tools::pan },
    Family { name: "vase", make: lathe::vase },
    Family { name: "screwdriver", make: lathe::screwdriver },
    Family { name: "kettle", make: tools::kettle },
    Family { name: "goblet", make: lathe::goblet },
    Family { name: "banana", make: tools::banana },
    Family { name: "ladle", make: tools::ladle },
];

/// Makes a shape by name.
pub(super) fn make(name: &str) -> Result<RawMesh, Refuse> {
    let unknown = |problem: String| {
        let families: Vec<&str> = FAMILIES.iter().map(|family| family.name).collect();
        let remedy = format!(
            "write FAMILY-NN or FAMILY-NN@16k with a family of {}; or half-FRONT-BACK or half-FRONT-BACK-80mm",
            families.join(", "),
        );
        Refuse::new("unknown_built_in", problem, remedy)
    };
    let (shape, triangles) = match name.split_once('@') {
        None => (name, DEFAULT_TRIANGLES),
        Some((shape, count)) => {
            let thousands = count.strip_suffix('k').map(|count| (count, 1000)).unwrap_or((count, 1));
            let count = thousands.0.parse::<usize>().ok().and_then(|count| count.checked_mul(thousands.1));
            match count.filter(|count| TRIANGLES.contains(count)) {
                Some(count) => (shape, count),
                None => {
                    let (low, high) = (TRIANGLES.start(), TRIANGLES.end());
                    return Err(unknown(format!("{name}: the triangles after @ are {low} to {high}, like 16k")));
                }
            }
        }
    };
    let no_such = || unknown(format!("no built-in shape is called {shape}"));
    let (family, rest) = shape.split_once('-').ok_or_else(no_such)?;
    let surface = if family == "half" {
        let half: HalfShape = shape.parse().map_err(|error| unknown(format!("{shape}: {error}")))?;
        half.surface(triangles)
    } else {
        let family = FAMILIES.iter().find(|known| known.name == family).ok_or_else(no_such)?;
        let number = rest.parse::<u32>().ok().filter(|&number| number > 0 && format!("{number:02}") == rest);
        let number = number.ok_or_else(|| unknown(format!("{shape}: shapes count -01, -02, ...")))?;
        // The key's 1 is the version of the formulas: another number makes other shapes.
        let mut draw = Stream::of_job(1, format!("{}-{number}", family.name).as_bytes(), "built-in shape");
        (family.make)(&mut draw, triangles)
    };
    let Surface { mut positions, mut faces } = surface;
    // Where a handle grows out of a wall, the vertices inside the opening are left over.
    mend::drop_unused(&mut positions, &mut faces);
    Ok(RawMesh { positions, faces, ..RawMesh::default() })
}
