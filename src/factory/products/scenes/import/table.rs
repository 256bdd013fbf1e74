//! Arrangements from a CSV table of poses.

use std::collections::BTreeMap;

use form::{Mistakes, Source};

use super::{
    ImportedBody,
    found::{FoundBody, FoundScene, MAX_BODIES, mistake},
};
use crate::{products::listed_pose::check_pose, sections::csv_records};

/// Columns of the table.
const COLUMNS: [&str; 9] = ["scene", "object", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// Key that names the table.
pub(super) const KEY: &str = "import.csv";

/// The arrangements of a table, in the order of their first bodies there, and every mistake.
pub(super) fn scenes_of_table(file: &str, text: &str) -> (Vec<FoundScene>, Mistakes) {
    let (source, mut scenes, mut errors) = (Source::new(file, text), Vec::<FoundScene>::new(), Mistakes::default());
    let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
    let mut records = csv_records(text);
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
        match numbers.get(name) {
            Some(number) => {
                let bodies = &mut scenes[*number].bodies;
                bodies.push(body);
                // A scene with too many bodies stays wrong, so the rest is skipped.
                if bodies.len() > MAX_BODIES {
                    break;
                }
            }
            None => {
                let location = body.location.clone();
                numbers.insert(name.clone(), scenes.len());
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
        assert!(errors.is_empty());
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
            assert!(
                scenes.is_empty()
                    && errors.count() == 1
                    && errors.iter().all(|error| error.to_string().contains(words)),
                "{errors:?}"
            );
        }
    }

    /// A scene of two million bodies, of which twenty are allowed: reading ends at the first too many.
    #[test]
    fn a_scene_of_too_many_bodies_is_read_no_further() {
        let row = "k,can,0.1,0.2,0.06,0,0,0,1\n";
        let text = format!("scene,object,x,y,z,qx,qy,qz,qw\n{}{}", row.repeat(100_000), "k,can\n".repeat(100_000));
        let (scenes, mut errors) = scenes_of_table("p.csv", &text);
        assert_eq!((scenes.len(), scenes[0].bodies.len(), errors.count()), (1, MAX_BODIES + 1, 0));
        scenes[0].check(KEY, &["can"], &mut errors);
        let said = errors.iter().next().expect("a mistake").to_string();
        assert!(said.contains("1 to 20 bodies in scene `k`, found more than 20"), "{said}");
        assert_eq!(errors.count(), 1);
    }

    /// Each row is found in its scene at once, also among many scenes.
    #[test]
    fn many_scenes_take_linear_time() {
        let rows: String = (0..100_000).map(|scene| format!("{scene},can,0.1,0.2,0.06,0,0,0,1\n")).collect();
        let began = std::time::Instant::now();
        let (scenes, errors) = scenes_of_table("p.csv", &format!("scene,object,x,y,z,qx,qy,qz,qw\n{rows}{rows}"));
        assert!(errors.is_empty() && scenes.len() == 100_000 && scenes.iter().all(|scene| scene.bodies.len() == 2));
        assert!(began.elapsed().as_secs() < 30, "{:?}", began.elapsed());
    }
}
