//! The built-in shapes that an entry names.

use std::collections::BTreeSet;

use super::spec::{BuiltInSpec, HalfShapesSpec, ObjectsSpec, OnlyHalfShapes};
use assets::{HalfShape, NoHalfShape};
use form::{Checker, Path, did_you_mean, fits_name};

/// The names that an entry requests, in its order, with its `triangles`; each shape can be made.
pub(super) fn shapes(checker: &mut Checker, entry: &ObjectsSpec, path: &Path, default_set: &[String]) -> Vec<String> {
    let names = match &entry.built_in {
        None => Vec::new(),
        Some(BuiltInSpec::Count(count)) => assets::built_in_names(*count as usize).collect(),
        Some(BuiltInSpec::Names(wanted)) => named(checker, wanted, path, default_set),
        Some(BuiltInSpec::HalfShapes(HalfShapesSpec { half_shapes_mm, only })) => {
            let all = half_shapes_mm.iter().flat_map(|millimetres| HalfShape::all(Some(*millimetres)));
            let wanted = all.filter(|shape| *only != Some(OnlyHalfShapes::Ambiguous) || shape.is_ambiguous());
            wanted.map(|shape| shape.to_string()).collect()
        }
    };
    let mut taken = BTreeSet::new();
    let names = names.into_iter().map(|name| match entry.triangles {
        Some(count) if !name.contains('@') && count % 1000 == 0 => format!("{name}@{}k", count / 1000),
        Some(count) if !name.contains('@') => format!("{name}@{count}"),
        _ => name,
    });
    names.filter(|name| taken.insert(name.clone())).collect()
}

fn named(checker: &mut Checker, wanted: &[String], path: &Path, default_set: &[String]) -> Vec<String> {
    let half_shapes = HalfShape::all(None).map(|shape| shape.to_string());
    let default: Vec<String> = default_set.iter().cloned().chain(half_shapes).collect();
    let mut names = Vec::new();
    for (index, wanted) in wanted.iter().enumerate() {
        let before = names.len();
        if wanted.contains(['*', '?']) {
            names.extend(default.iter().filter(|name| fits_name(wanted, name)).cloned());
        } else if is_shape(wanted) {
            names.push(wanted.clone());
        }
        if names.len() == before {
            let report = checker.not_found(path.key("built_in").index(index), "built-in shape", format!("`{wanted}`"));
            report.help(help(wanted, &default));
        }
    }
    names
}

/// Help for a name that no shape has: what to write in its place.
fn help(wanted: &str, default: &[String]) -> String {
    if let Err(error @ NoHalfShape::Size) = without_triangles(wanted).parse::<HalfShape>() {
        return error.to_string();
    }
    // A pattern with a size fits nothing: sizes are endless.
    if wanted.starts_with("half-") && wanted.contains(['*', '?']) {
        return "patterns fit the half-shapes of 100 mm; `built_in = { half_shapes_mm = [80] }` selects others"
            .to_owned();
    }
    did_you_mean(wanted, default.iter().map(String::as_str))
        .unwrap_or_else(|| format!("the families are {}, each with shapes -01, -02, ...", families().join(", ")))
}

/// The families of the endless series, in its order.
fn families() -> Vec<String> {
    let mut families: Vec<String> = Vec::new();
    for name in assets::built_in_names(assets::DEFAULT_BUILT_INS) {
        let family = name.split('-').next().unwrap_or(&name);
        if !families.iter().any(|known| known == family) {
            families.push(family.to_owned());
        }
    }
    families
}

/// Whether a name, but for the triangles behind `@`, is a shape's; preparing it checks those.
fn is_shape(name: &str) -> bool {
    let shape = without_triangles(name);
    let in_series = shape.rsplit_once('-').is_some_and(|(family, number)| {
        let number: Option<u32> = number.parse().ok().filter(|parsed| *parsed > 0 && format!("{parsed:02}") == number);
        number.is_some() && families().iter().any(|known| known == family)
    });
    in_series || shape.parse::<HalfShape>().is_ok()
}

fn without_triangles(name: &str) -> &str {
    name.split('@').next().unwrap_or(name)
}
