//! The CSV table of settings of single meshes.

use std::{collections::BTreeMap, ops::Range};

use super::{
    csv::csv_records,
    spec::{BodiesSpec, MAX_WALL, MaterialSpec, MeshRow, UnitSpec},
};
use form::{Bounds, Finding, FormError, FormProblem, Location, Mistakes, Source, did_you_mean};
use kernel::words::{LengthUnit, Material};

const COLUMNS: [&str; 14] = [
    "name",
    "unit",
    "scale",
    "size",
    "group",
    "category",
    "licence",
    "citation",
    "mass",
    "mass_source",
    "material",
    "wall",
    "bodies",
    "object",
];

/// Heaviest object [kg].
pub(super) const MAX_MASS: f64 = 100.0;

/// Reads a table: the first line names the columns, `name` among them; empty fields are ignored.
///
/// Every mistake is in the list, with its location in the table.
pub(super) fn read(file: &str, text: &str) -> (BTreeMap<String, (MeshRow, Location)>, Mistakes) {
    let mut rows = BTreeMap::new();
    let mut errors = Mistakes::default();
    let source = Source::new(file, text);
    let mut report = |range: &Range<usize>, key: &str, problem: FormProblem, help: Option<String>| {
        errors.push(FormError { location: source.location(range), key: key.to_owned(), problem, help });
    };
    let mut lines = csv_records(text);
    let header = lines.next().unwrap_or_default();
    for field in &header {
        if !COLUMNS.contains(&field.text.as_str()) {
            let known = COLUMNS.map(str::to_owned).into();
            let help = did_you_mean(&field.text, COLUMNS);
            report(&field.range, "", FormProblem::UnknownKey { found: field.text.clone(), known }, help);
        }
    }
    let Some(name_column) = header.iter().position(|field| field.text == "name") else {
        let expected = "a first line that names the columns, `name` among them".into();
        report(&(0..0), "", FormProblem::Missing { expected }, None);
        return (rows, errors);
    };
    for record in lines {
        let whole = record[0].range.start..record[record.len() - 1].range.end;
        if record.len() != header.len() {
            let (expected, found) =
                (format!("{} fields, as in the first line", header.len()), record.len().to_string());
            report(&whole, "", FormProblem::Invalid { expected, found }, None);
            continue;
        }
        let name = record[name_column].text.clone();
        let mut row = MeshRow::default();
        for (column, field) in header.iter().zip(&record).filter(|(_, field)| !field.text.is_empty()) {
            if let Err(problem) = set(&mut row, &column.text, &field.text) {
                report(&field.range, &column.text, problem, None);
            }
        }
        let location = source.location(&record[name_column].range);
        if rows.insert(name.clone(), (row, location)).is_some() {
            let found = format!("a second row for `{name}`");
            report(&whole, "name", FormProblem::Invalid { expected: "each mesh has one row".to_owned(), found }, None);
        }
    }
    (rows, errors)
}

fn set(row: &mut MeshRow, column: &str, text: &str) -> Result<(), FormProblem> {
    let number = || match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(Some(number)),
        _ => Err(out_of_range(Bounds { above: Some(0.0), unit: Some("m".to_owned()), ..Bounds::default() }, text)),
    };
    match column {
        "unit" => {
            let unknown = || {
                let choices = LengthUnit::names().map(str::to_owned).collect();
                FormProblem::NotAChoice { found: text.to_owned(), choices }
            };
            row.unit = Some(UnitSpec(LengthUnit::named(text).ok_or_else(unknown)?));
        }
        "scale" => row.scale = number()?,
        "size" => row.size = number()?,
        "group" => row.group = Some(text.to_owned()),
        "category" => row.category = Some(text.to_owned()),
        "licence" => row.licence = Some(text.to_owned()),
        "citation" => row.citation = Some(text.to_owned()),
        "mass" => match text.parse::<f64>() {
            Ok(mass) if mass > 0.0 && mass <= MAX_MASS => row.mass = Some(mass),
            _ => {
                let unit = Some("kg".to_owned());
                let bounds = Bounds { above: Some(0.0), max: Some(MAX_MASS), unit, ..Bounds::default() };
                return Err(out_of_range(bounds, text));
            }
        },
        "material" => {
            let unknown = || {
                let choices = Material::all().iter().map(|material| material.name.to_owned()).collect();
                FormProblem::NotAChoice { found: text.to_owned(), choices }
            };
            row.material = Some(MaterialSpec(Material::named(text).ok_or_else(unknown)?));
        }
        "wall" => match number() {
            Ok(Some(wall)) if wall <= MAX_WALL => row.wall = Some(wall),
            _ => {
                let unit = Some("m".to_owned());
                let bounds = Bounds { above: Some(0.0), max: Some(MAX_WALL), unit, ..Bounds::default() };
                return Err(out_of_range(bounds, text));
            }
        },
        "bodies" => {
            let unknown = || {
                let choices = BodiesSpec::ALL.map(|bodies| bodies.name().to_owned()).into();
                FormProblem::NotAChoice { found: text.to_owned(), choices }
            };
            row.bodies = Some(BodiesSpec::named(text).ok_or_else(unknown)?);
        }
        "mass_source" => row.mass_source = Some(text.to_owned()),
        "object" if kernel::ids::Digest::from_hex(text).is_some() => row.object = Some(text.to_owned()),
        "object" => {
            let expected = "64 hexadecimal digits".to_owned();
            return Err(FormProblem::Invalid { expected, found: text.to_owned() });
        }
        _ => {}
    }
    Ok(())
}

fn out_of_range(bounds: Bounds, found: &str) -> FormProblem {
    FormProblem::OutOfRange { expected: bounds.into(), found: Finding::Written(found.to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_quotes_comments_and_empty_fields() {
        let text = "name,group,scale\r\n# a comment\nmug,\"cups, mugs\",\n\"a \"\"b\"\"\",,0.001\n\n";
        let (rows, errors) = read("t.csv", text);
        assert!(errors.is_empty());
        assert_eq!(rows.len(), 2);
        assert_eq!(rows["mug"].0.group.as_deref(), Some("cups, mugs"));
        assert_eq!((rows["a \"b\""].0.scale, rows["a \"b\""].0.group.clone()), (Some(0.001), None));
    }

    #[test]
    fn masses_are_checked() {
        let text = "name,mass,mass_source\nmug,0.118,scales\nbowl,,\n";
        let (rows, errors) = read("t.csv", text);
        assert!(errors.is_empty());
        assert_eq!((rows["mug"].0.mass, rows["mug"].0.mass_source.as_deref()), (Some(0.118), Some("scales")));
        assert_eq!((rows["bowl"].0.mass, &rows["bowl"].0.mass_source), (None, &None));
        for wrong in ["0", "-0.1", "nan", "inf", "100.5", "118 g"] {
            let (_, errors) = read("t.csv", &format!("name,mass\nmug,{wrong}\n"));
            let found: Vec<(u32, u32, &str)> =
                errors.iter().map(|error| (error.location.line, error.location.column, error.problem.code())).collect();
            assert_eq!(found, [(2, 5, "out_of_range")], "{wrong}");
        }
    }

    #[test]
    fn materials_walls_and_bodies_are_read() {
        let text = "name,category,material,wall,bodies\nlid,lid,glass,0.005,join\ncup,,plastic,,one\n";
        let (rows, errors) = read("t.csv", text);
        assert!(errors.is_empty());
        let lid = &rows["lid"].0;
        assert_eq!((lid.category.as_deref(), lid.wall, lid.bodies), (Some("lid"), Some(0.005), Some(BodiesSpec::Join)));
        assert_eq!(lid.material.map(|material| material.0.density), Some(2500.0));
        assert_eq!((rows["cup"].0.wall, rows["cup"].0.bodies), (None, Some(BodiesSpec::One)));
        let (_, errors) = read("t.csv", "name,material,wall,bodies\nlid,gold,0,two\n");
        let found: Vec<&str> = errors.iter().map(|error| error.problem.code()).collect();
        assert_eq!(found, ["not_a_choice", "out_of_range", "not_a_choice"]);
    }

    #[test]
    fn reports_every_mistake_with_its_place() {
        let text = "name,gruop,unit,scale\nmug,x,metre,0\nmug,x,mm,1\nshort,x\n";
        let (_, errors) = read("t.csv", text);
        let places: Vec<(u32, u32, &str)> =
            errors.iter().map(|error| (error.location.line, error.location.column, error.problem.code())).collect();
        let expected = [
            (1, 6, "unknown_key"),
            (2, 7, "not_a_choice"),
            (2, 13, "out_of_range"),
            (3, 1, "invalid"),
            (4, 1, "invalid"),
        ];
        assert_eq!(places, expected);
        assert_eq!(errors.iter().next().and_then(|error| error.help.as_deref()), Some("did you mean `group`?"));
        assert_eq!(read("t.csv", "").1.count(), 1);
    }
}
