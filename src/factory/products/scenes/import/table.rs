//! Arrangements out of a CSV table of poses.

use form::{FormError, Source};

use super::{
    ImportedBody,
    found::{FoundBody, FoundScene, mistake},
};
use crate::{job::csv_records, products::listed_pose::check_pose};

/// Columns of the table.
const COLUMNS: [&str; 9] = ["scene", "object", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// Key that names the table.
pub(super) const KEY: &str = "import.csv";

/// The arrangements of a table, in the order in which their first bodies stand there, and every mistake.
pub(super) fn scenes_of_table(file: &str, text: &str) -> (Vec<FoundScene>, Vec<FormError>) {
    let (source, mut scenes, mut errors) = (Source::new(file, text), Vec::<FoundScene>::new(), Vec::new());
    let mut records = csv_records(text).into_iter();
    let header = records.next().unwrap_or_default();
    let heading: Vec<&str> = header.iter().map(|field| field.text.as_str()).collect();
    if heading != COLUMNS {
        let expected = format!("a first line `{}`", COLUMNS.join(","));
        let found = if heading.is_empty() { "an empty table".to_owned() } else { format!("`{}`", heading.join(",")) };
        let whole = header.first().map_or(0..0, |first| first.range.clone());
        errors.push(mistake(source.location(&whole), KEY, expected, found, None));
        return (scenes, errors);
    }
    for record in records {
        let location = source.location(&(record[0].range.start..record[record.len() - 1].range.end));
        let body = match body_of(&record.iter().map(|field| field.text.as_str()).collect::<Vec<_>>()) {
            Ok(body) => FoundBody { body, obj_id: None, location },
            Err([expected, found, help]) => {
                errors.push(mistake(location, KEY, expected, found, Some(help)));
                continue;
            }
        };
        let name = &record[0].text;
        match scenes.iter_mut().find(|scene| scene.source == *name) {
            Some(scene) => scene.bodies.push(body),
            None => {
                let location = body.location.clone();
                scenes.push(FoundScene { source: name.clone(), bodies: vec![body], location });
            }
        }
    }
    if scenes.is_empty() && errors.is_empty() {
        let help = Some("write a line per body below the first".to_owned());
        errors.push(mistake(source.location(&(0..text.len())), KEY, "at least one body", "none", help));
    }
    (scenes, errors)
}

/// The body of a row: or what was expected, what was found, and the remedy.
fn body_of(fields: &[&str]) -> Result<ImportedBody, [String; 3]> {
    let wrong = |expected: &str, found: String, help: &str| [expected.to_owned(), found, help.to_owned()];
    let [_, object, numbers @ ..] = fields else {
        return Err(wrong("nine fields, as in the first line", fields.len().to_string(), "separate them by commas"));
    };
    let pose: Vec<f64> = numbers.iter().filter_map(|number| number.parse().ok()).collect();
    let Ok(pose) = <[f64; 7]>::try_from(pose) else {
        let found = format!("`{}`", numbers.join(","));
        return Err(wrong("seven numbers after scene and object", found, "write x,y,z,qx,qy,qz,qw"));
    };
    check_pose(&pose).map_err(|problem| {
        let help =
            "positions are in metres, and a quaternion has its real part last and length 1: divide it by its length";
        wrong("a pose", problem, help)
    })?;
    Ok(ImportedBody { object: (*object).to_owned(), pose })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_scene_may_stand_anywhere() {
        let text = "scene,object,x,y,z,qx,qy,qz,qw\n# left, right\nb,mug,0.1,0,0,0,0,0,1\na,\"cup, blue\",0,0,0,0,0,0.6,0.8\n\
                    b,mug,-0.1,0,0,0,0,0,1\n";
        let (scenes, errors) = scenes_of_table("p.csv", text);
        assert_eq!(errors, []);
        let found: Vec<(&str, usize, u32)> =
            scenes.iter().map(|scene| (scene.source.as_str(), scene.bodies.len(), scene.location.line)).collect();
        assert_eq!(found, [("b", 2, 3), ("a", 1, 4)]);
        assert_eq!(scenes[1].bodies[0].body.object, "cup, blue");
        assert_eq!(scenes[1].bodies[0].body.pose, [0.0, 0.0, 0.0, 0.0, 0.0, 0.6, 0.8]);
    }

    #[test]
    fn every_mistake_is_said_with_its_line() {
        let text =
            "scene,object,x,y,z,qx,qy,qz,qw\na,mug,0.1,0,0,0,0,0\na,mug,0.1,0,0,0,0,0,2\na\na,mug,nan,0,0,0,0,0,1\n";
        let (_, errors) = scenes_of_table("p.csv", text);
        let lines: Vec<u32> = errors.iter().map(|error| error.location.line).collect();
        assert_eq!(lines, [2, 3, 4, 5]);
        let said: Vec<String> = errors.iter().map(ToString::to_string).collect();
        for (said, words) in said.iter().zip(["seven numbers", "length 2", "nine fields", "NaN is not finite"]) {
            assert!(said.contains(words) && said.contains("import.csv"), "{said}: {words}");
        }
        for (text, words) in [
            ("", "an empty table"),
            ("scene,object,x,y,z,qw,qx,qy,qz\n", "first line"),
            ("scene,object,x,y,z,qx,qy,qz,qw\n", "none"),
        ] {
            let (scenes, errors) = scenes_of_table("p.csv", text);
            assert!(scenes.is_empty() && errors.len() == 1 && errors[0].to_string().contains(words), "{errors:?}");
        }
    }
}
