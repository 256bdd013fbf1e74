//! Physical facts of an object, as listed in its row of the asset table.

use nalgebra::{Matrix3, Point3};
use serde_json::{Map, Value, json};

use super::AssetRow;
use kernel::geom::{MassProperties, Symmetries};

/// Weight and kind of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectFacts {
    /// Kind of object, if the job gives it.
    pub category: Option<String>,
    /// Class of material, if the job gives it.
    pub material: Option<String>,
    /// Mass [kg].
    pub mass: f64,
    /// Origin of the mass: `job`, `table`, `material` or `hull`.
    pub mass_from: String,
    /// Source of the figure in words; may be empty.
    pub mass_source: String,
    /// Coefficient of friction against hands in trials, where there are some.
    pub friction: Option<f64>,
    /// Volume, centre of mass and inertia of the solid; `None` when no cell is solid.
    pub solid: Option<MassProperties>,
}

/// A row with invalid facts.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the mass of {name} is invalid: it must be a mass above 0 with its source, and with a centre and an inertia of finite numbers"
)]
pub struct InvalidObjectFacts {
    /// Name of the object.
    pub name: String,
}

impl ObjectFacts {
    /// Inertia about the centre of mass [kg m^2]; `None` when no cell is solid.
    pub fn inertia(&self) -> Option<Matrix3<f64>> {
        self.solid.map(|solid| solid.inertia * self.mass)
    }

    /// Adds the facts to the row of the object.
    pub fn add_to(&self, row: &mut Map<String, Value>) {
        let Self { category, material, mass, mass_from, mass_source, friction, solid } = self;
        let mut add = |key: &str, value: Value| drop(row.insert(key.to_owned(), value));
        for (key, word) in [("category", category), ("material", material)] {
            word.iter().for_each(|word| add(key, word.as_str().into()));
        }
        add("mass", (*mass).into());
        add("mass_from", mass_from.as_str().into());
        add("mass_source", mass_source.as_str().into());
        friction.iter().for_each(|friction| add("friction", (*friction).into()));
        if let (Some(MassProperties { volume, centre, inertia }), Some(whole)) = (solid, self.inertia()) {
            add("solid_volume", (*volume).into());
            add("centre_of_mass", json!(centre.coords.as_slice()));
            add("inertia_per_kilogram", rows_of(inertia));
            add("inertia", rows_of(&whole));
        }
    }
}

impl AssetRow {
    /// Weight and kind of the object; `None` when the row does not list them.
    ///
    /// # Errors
    /// When the row has invalid values under these keys.
    pub fn object_facts(&self) -> Result<Option<ObjectFacts>, InvalidObjectFacts> {
        let facts = &self.facts;
        if !facts.contains_key("mass") {
            return Ok(None);
        }
        let word = |key: &str| facts.get(key).and_then(Value::as_str).map(str::to_owned);
        let read = || {
            let solid = match facts.get("solid_volume") {
                None => None,
                Some(volume) => {
                    let [x, y, z] = numbers(facts.get("centre_of_mass")?)?;
                    let inertia: [f64; 9] = numbers(facts.get("inertia_per_kilogram")?)?;
                    let volume = volume.as_f64().filter(|volume| *volume > 0.0)?;
                    Some(MassProperties {
                        volume,
                        centre: Point3::new(x, y, z),
                        inertia: Matrix3::from_row_slice(&inertia),
                    })
                }
            };
            Some(ObjectFacts {
                category: word("category"),
                material: word("material"),
                mass: facts.get("mass")?.as_f64().filter(|mass| *mass > 0.0)?,
                mass_from: word("mass_from")?,
                mass_source: word("mass_source")?,
                friction: facts.get("friction").and_then(Value::as_f64),
                solid,
            })
        };
        read().map(Some).ok_or_else(|| InvalidObjectFacts { name: self.name.clone() })
    }
}

/// The symmetries of an object, as its row lists them: `symmetries_discrete` and `symmetries_continuous` as in the
/// `models_info.json` of BOP, but in metres.
pub fn add_symmetries(row: &mut Map<String, Value>, symmetries: &Symmetries) {
    let centre = symmetries.centre.coords;
    let discrete = symmetries.rotations().into_iter().map(|rotation| {
        let shift = centre - rotation * centre;
        let mut numbers: Vec<f64> =
            (0..3).flat_map(|row| [rotation[(row, 0)], rotation[(row, 1)], rotation[(row, 2)], shift[row]]).collect();
        numbers.extend([0.0, 0.0, 0.0, 1.0]);
        json!(numbers)
    });
    let continuous =
        symmetries.continuous.iter().map(|axis| json!({ "axis": axis.as_slice(), "offset": centre.as_slice() }));
    let listed = json!({
        "group": symmetries.group(),
        "tolerance": symmetries.tolerance,
        "symmetries_discrete": discrete.collect::<Vec<_>>(),
        "symmetries_continuous": continuous.collect::<Vec<_>>(),
        "mirror_normals": symmetries.mirrors.iter().map(|normal| json!(normal.as_slice())).collect::<Vec<_>>(),
    });
    row.insert("symmetry".to_owned(), listed);
}

/// Nine numbers, row by row.
fn rows_of(matrix: &Matrix3<f64>) -> Value {
    json!(matrix.transpose().as_slice())
}

/// A list of `N` finite numbers.
fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let read: Vec<f64> = value.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    read.try_into().ok()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use kernel::{
        geom::SymmetryAxis,
        ids::{Digest, ObjectId},
    };

    fn facts() -> ObjectFacts {
        ObjectFacts {
            category: Some("mug".to_owned()),
            material: None,
            mass: 0.118,
            mass_from: "table".to_owned(),
            mass_source: "scales".to_owned(),
            friction: Some(0.6),
            solid: Some(MassProperties {
                volume: 1e-4,
                centre: Point3::new(0.01, 0.02, 0.03),
                inertia: Matrix3::new(1e-3, 1e-5, 2e-5, 1e-5, 2e-3, 3e-5, 2e-5, 3e-5, 3e-3),
            }),
        }
    }

    #[test]
    fn facts_come_back_from_a_row() {
        let mut row = AssetRow { object: ObjectId(Digest([1; 32])), name: "mug".to_owned(), facts: Map::new() };
        assert_eq!(row.object_facts(), Ok(None));
        facts().add_to(&mut row.facts);
        assert_eq!(row.object_facts(), Ok(Some(facts())));
        assert!(!row.facts.contains_key("material"));
        let inertia = row.facts["inertia"].as_array().expect("a list");
        assert_eq!((inertia.len(), inertia[1].as_f64()), (9, Some(0.118 * 1e-5)));
        for (key, wrong) in [("mass", json!(0)), ("mass_from", json!(1)), ("centre_of_mass", json!([1.0]))] {
            let mut broken = row.clone();
            broken.facts.insert(key.to_owned(), wrong);
            assert_eq!(broken.object_facts(), Err(InvalidObjectFacts { name: "mug".to_owned() }), "{key}");
        }
    }

    #[test]
    fn symmetries_are_listed_as_bop_lists_them() {
        let symmetries = Symmetries {
            centre: Point3::new(0.0, 0.0, 0.1),
            tolerance: 0.001,
            continuous: vec![Vector3::z_axis()],
            axes: vec![SymmetryAxis { direction: Vector3::x_axis(), order: 2 }],
            mirrors: vec![Vector3::z_axis()],
        };
        let mut row = Map::new();
        add_symmetries(&mut row, &symmetries);
        let listed = &row["symmetry"];
        assert_eq!(listed["group"], "Dinf");
        assert_eq!(listed["symmetries_continuous"], json!([{ "axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.1] }]));
        let flip: Vec<f64> = serde_json::from_value(listed["symmetries_discrete"][0].clone()).expect("16 numbers");
        let wanted = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.2, 0.0, 0.0, 0.0, 1.0];
        assert!(flip.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-12), "{flip:?}");
    }
}
