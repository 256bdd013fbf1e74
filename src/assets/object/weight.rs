//! Mass of an object without a measured one: by its material, or by the area of its convex hull.

use nalgebra::Point3;

use super::PreparedObject;
use kernel::{
    geom::{TriMesh, convex_hull_area},
    words::Material,
};

/// Default mass over the area of an object's convex hull [kg/m^2]: the median of the 47 scans of the YCB set whose
/// masses Calli et al. 2015 publish. Objects that people handle are mostly skins, walls and frames, so that their mass
/// scales with the area around them rather than with the volume of a scan: half of the 47 are within a factor of 1.5 of
/// this rule, and within 2.3 of 400 kg/m^3 (docs/benchmarks.md has the table; a test computes it again).
pub const AREAL_DENSITY: f64 = 3.7;

/// Smallest and largest default mass of an object [kg].
pub const MASSES: [f64; 2] = [0.005, 5.0];

/// Material and walls of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MadeOf {
    /// The material.
    pub material: &'static Material,
    /// Thickness of the walls of a hollow object, below every face of its mesh [m]; `None` if the mesh shows the solid
    /// itself.
    pub wall: Option<f64>,
}

impl MadeOf {
    /// Source of the mass, in words.
    pub fn in_words(&self) -> String {
        let Material { name, density, .. } = self.material;
        let walls =
            self.wall.map_or_else(|| "as solid as its mesh".to_owned(), |wall| format!("walls of {} mm", 1e3 * wall));
        format!("{name}, {density} kg/m^3, {walls}")
    }
}

impl PreparedObject {
    /// Mass of the object for a material [kg]: of its solid, or of its walls if it is hollow; `None` when no cell is
    /// solid.
    pub fn mass_of_material(&self, made_of: &MadeOf) -> Option<f64> {
        let solid = self.mass()?.volume;
        // Walls fill no more than the solid, so that those which a mesh shows are not made thicker.
        let volume = made_of.wall.map_or(solid, |wall| solid.min(area(&self.mesh) * wall));
        Some(made_of.material.density * volume)
    }

    /// Default mass of an object [kg]: [`AREAL_DENSITY`] times the area of its convex hull, within [`MASSES`].
    pub fn mass_of_hull(&self) -> f64 {
        let corners: Vec<Point3<f64>> =
            self.mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
        (AREAL_DENSITY * convex_hull_area(&corners)).clamp(MASSES[0], MASSES[1])
    }
}

/// Area of all faces [m^2].
fn area(mesh: &TriMesh) -> f64 {
    let of_face = |face| {
        let [a, b, c] = mesh.corners(face);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    (0..mesh.triangles.len()).map(of_face).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MeshSource, built_in_source};

    fn object(name: &str) -> PreparedObject {
        PreparedObject::prepare(&MeshSource { name: name.to_owned(), ..built_in_source(name) })
            .expect("a built-in shape")
    }

    #[test]
    fn a_hollow_object_weighs_its_walls_and_never_more_than_its_solid() {
        let object = object("box-01");
        let plastic = Material::named("plastic").expect("a material");
        let mass = |wall| object.mass_of_material(&MadeOf { material: plastic, wall }).expect("a solid");
        let [x, y, z] = object.record().extents;
        let area = 2.0 * (x * y + y * z + z * x);
        // The built-in box is a little rounded.
        let solid = mass(None);
        assert!((solid / (1000.0 * x * y * z) - 1.0).abs() < 0.05, "{solid}");
        assert!((mass(Some(1e-3)) / area - 1.0).abs() < 0.05, "{} {area}", mass(Some(1e-3)));
        assert_eq!(mass(Some(0.5)), solid);
        let hull = object.mass_of_hull();
        assert!((hull / (AREAL_DENSITY * area) - 1.0).abs() < 0.05, "{hull}");
    }

    #[test]
    fn an_open_cup_weighs_more_than_its_walls_at_400_and_less_than_a_block() {
        let cup = object("cup-01");
        let walls = cup.mass().expect("a solid").volume;
        let plastic = MadeOf { material: Material::named("plastic").expect("a material"), wall: None };
        assert_eq!(cup.mass_of_material(&plastic), Some(1000.0 * walls));
        assert!(plastic.in_words().contains("as solid as its mesh"));
    }
}
