//! Materials of objects, and how the mass of one is known.

/// A class of materials, or of filled packages, with its density.
#[derive(Debug, PartialEq)]
pub struct Material {
    /// Name in job files and tables of objects.
    pub name: &'static str,
    /// Density [kg/m^3].
    pub density: f64,
    /// Content of the class, with the source of the density.
    pub meaning: &'static str,
}

/// Materials by name. Handbook values: CRC Handbook of Chemistry and Physics, "Density of various solids"; Callister and
/// Rethwisch, "Materials Science and Engineering", appendix B. Where goods and air or several materials are mixed, the masses
/// that Calli et al. 2015 publish of the YCB set over the volumes of its scans.
static MATERIALS: [Material; 14] = [
    Material { name: "aluminium", density: 2700.0, meaning: "Aluminium and its alloys (handbook)." },
    Material {
        name: "cardboard",
        density: 690.0,
        meaning: "Cardboard and paper, without what is packed in it (handbook).",
    },
    Material { name: "ceramic", density: 2400.0, meaning: "Porcelain and stoneware, 2,300 to 2,500 (handbook)." },
    Material {
        name: "dry_filled",
        density: 550.0,
        meaning: "A package full of dry goods: median of the four filled boxes of the YCB set, 190 to 810.",
    },
    Material {
        name: "foam",
        density: 50.0,
        meaning: "Soft foam and sponge: upholstery foam has 20 to 80, the sponge of the YCB set 54.",
    },
    Material {
        name: "fruit",
        density: 900.0,
        meaning: "Real fruit and vegetables, which mostly float: 800 to 1,050. Fruit out of plastic is `plastic` with a `wall`.",
    },
    Material { name: "glass", density: 2500.0, meaning: "Soda-lime glass (handbook)." },
    Material {
        name: "liquid_filled",
        density: 1000.0,
        meaning: "A bottle or can full of something watery: water; full cans and bottles of the YCB set, 980 to 1,390.",
    },
    Material {
        name: "plastic",
        density: 1000.0,
        meaning: "Household plastics: polypropylene 905, polystyrene 1,050 (handbook).",
    },
    Material { name: "rubber", density: 1100.0, meaning: "Soft rubber (handbook)." },
    Material { name: "steel", density: 7850.0, meaning: "Steel; brass has some 8 % more (handbook)." },
    Material {
        name: "textile",
        density: 300.0,
        meaning: "Cloth with the air in it: half of what felt and leather have (handbook).",
    },
    Material {
        name: "tool",
        density: 1600.0,
        meaning: "Steel with a handle or housing out of plastic: median of the eight tools and clamps of the YCB set that mix \
                  them, 1,260 to 2,640.",
    },
    Material { name: "wood", density: 600.0, meaning: "Wood, 400 (pine) to 800 (beech) (handbook)." },
];

impl Material {
    /// Every material, by name.
    pub fn all() -> &'static [Self] {
        &MATERIALS
    }

    /// The material of a name; `None` for any other text.
    pub fn named(name: &str) -> Option<&'static Self> {
        MATERIALS.iter().find(|material| material.name == name)
    }
}

/// Way in which the mass of an object is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MassSource {
    /// The job gives one mass to all objects.
    Job,
    /// The job, or its table of objects, gives the object's own mass.
    Table,
    /// By the material that the job, or its table of objects, names.
    Material,
    /// Nothing is known: by the area of its convex hull.
    Hull,
}

impl MassSource {
    /// Name in records and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Job => "job",
            Self::Table => "table",
            Self::Material => "material",
            Self::Hull => "hull",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_are_sorted_and_found_by_name() {
        assert!(Material::all().is_sorted_by(|one, other| one.name < other.name));
        for material in Material::all() {
            assert_eq!(Material::named(material.name), Some(material));
            assert!(material.density > 0.0 && material.meaning.ends_with('.'), "{}", material.name);
        }
        assert_eq!(Material::named("unobtainium"), None);
    }
}
