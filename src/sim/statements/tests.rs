use std::{collections::BTreeMap, path::Path};

use kernel::description::{Format, Place, Statement};

use super::{Row, row, rows};
use crate::ffi::{prepare_library, schema};

/// Elements whose attributes need not be named one by one: a row for the element covers them all.
const AS_ELEMENTS: &[&str] =
    &["asset/mesh", "visual/map", "mujoco/statistic", "keyframe/key", "actuator/*", "sensor/rangefinder"];

/// Elements of the linked MuJoCo's schema as `section/element`, with their attributes.
fn linked_schema() -> BTreeMap<String, Vec<String>> {
    prepare_library();
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut path: Vec<String> = Vec::new();
    let mut key = String::new();
    for line in schema().lines().filter(|line| !line.trim().is_empty()) {
        let indent = line.len() - line.trim_start().len();
        // Attributes continue in a separate column.
        let rest = match line.trim_start().split_once(" (") {
            Some((name, rest)) if indent < 24 => {
                path.truncate(indent / 3);
                path.push(name.replace("(world)", ""));
                let within = path.iter().rev().nth(1).map_or("", String::as_str);
                let within = if name == "(world)body" { "body" } else { within };
                key = format!("{within}/{}", path.last().expect("a name"));
                rest.split_once(')').expect("a mark").1
            }
            _ => line,
        };
        found.entry(key.clone()).or_default().extend(rest.split_whitespace().map(str::to_owned));
    }
    found
}

fn statement(key: &str) -> Statement {
    let (within, element) = key.split_once('/').expect("a section and an element");
    Statement {
        place: Place::start_of(Path::new("schema.xml")),
        parent: None,
        within: within.to_owned(),
        element: element.to_owned(),
        attributes: Vec::new(),
    }
}

#[test]
fn every_element_and_attribute_of_the_linked_mujoco_has_a_row() {
    let schema = linked_schema();
    assert!(schema.len() > 150 && schema["body/geom"].iter().any(|name| name == "contype"), "{schema:?}");
    let mut missing = Vec::new();
    for (key, attributes) in &schema {
        let statement = statement(key);
        if row(Format::Mjcf, &statement, None).is_none() {
            missing.push(key.clone());
        }
        let named: Vec<&Row> = rows(Format::Mjcf).iter().filter(|row| statement.is_or_defaults(row.element)).collect();
        let is_named_one_by_one =
            named.iter().any(|row| !row.attributes.is_empty() && !AS_ELEMENTS.contains(&row.element));
        for attribute in attributes.iter().filter(|_| is_named_one_by_one) {
            if !named.iter().any(|row| row.values().any(|(name, _)| name == attribute)) {
                missing.push(format!("{key} {attribute}"));
            }
        }
    }
    assert!(missing.is_empty(), "no row is about\n{}", missing.join("\n"));
}

#[test]
fn no_row_is_about_what_the_linked_mujoco_does_not_have() {
    let schema = linked_schema();
    // The schema prints no root, no copies, no includes, and an element within itself once.
    const BESIDE: [&str; 6] =
        ["/mujoco", "*/include", "mujoco/worldbody", "body/frame", "body/replicate", "default/default"];
    for row in rows(Format::Mjcf).iter().filter(|row| !BESIDE.contains(&row.element)) {
        let elements: Vec<&Vec<String>> =
            schema.iter().filter(|(key, _)| statement(key).is(row.element)).map(|(_, attributes)| attributes).collect();
        assert!(!elements.is_empty(), "{}", row.element);
        for (name, _) in row.values() {
            assert!(
                elements.iter().any(|attributes| attributes.iter().any(|known| known == name)),
                "{} {name}",
                row.element
            );
        }
    }
}
