//! Generated files are those that `proto/` and the table of products make.

use std::{fmt::Write as _, fs, path::Path};

use graspmill::format::{FactKind, FactRange, Product};

use crate::support::{files::repository_path, schemas::generate};

/// The ranges of facts for the Python package.
const RANGES: &str = "python/graspmill/fact_ranges.py";

/// `make schemas` writes them again; then this test finds them equal.
#[test]
fn generated_files_are_those_of_the_schemas() {
    let root = repository_path("");
    let files = generate(&root);
    let folders = files.keys().map(|path| path.parent().expect("a folder").to_owned());
    for folder in folders.collect::<std::collections::BTreeSet<_>>() {
        for entry in fs::read_dir(root.join(&folder)).expect("a folder of generated files") {
            let path = folder.join(entry.expect("an entry").file_name());
            assert!(files.contains_key(&path), "{} belongs to no schema: delete it", path.display());
        }
    }
    for (path, content) in &files {
        write_if_asked(&root.join(path), content);
        let found = fs::read(root.join(path)).unwrap_or_default();
        assert!(found == *content, "{} is not what proto/ makes: run `make schemas`", path.display());
    }
}

/// The Python package refuses the numbers that the readers of ledgers refuse.
#[test]
fn ranges_of_facts_are_those_of_the_table_of_products() {
    let path = repository_path(RANGES);
    let wanted = ranges_in_python();
    write_if_asked(&path, wanted.as_bytes());
    let found = fs::read_to_string(&path).expect("the ranges");
    assert!(found == wanted, "{RANGES} is not what the table of products makes: run `make schemas`");
}

/// The module of ranges: each product with the facts whose range is not that of all finite numbers.
fn ranges_in_python() -> String {
    let head = "\"\"\"Ranges of the facts that are numbers, both ends included; `make schemas` writes them from the table of \
                products.\"\"\"\n\nfrom __future__ import annotations\n\nfrom math import inf\nfrom sys import float_info\n\n\
                FINITE = (-float_info.max, float_info.max)\n\"\"\"The range of any other fact.\"\"\"\n\n\
                FACT_RANGES: dict[str, dict[str, tuple[float, float]]] = {\n";
    let mut text = head.to_owned();
    for product in Product::all() {
        let ranges = product.facts.iter().filter_map(|fact| match fact.kind {
            FactKind::Number(range) if range != FactRange::Finite => Some((fact.name, range)),
            _ => None,
        });
        let lines: String = ranges.fold(String::new(), |mut lines, (name, range)| {
            let [low, high] = range.ends().map(number_in_python);
            _ = writeln!(lines, "        \"{name}\": ({low}, {high}),");
            lines
        });
        if !lines.is_empty() {
            _ = write!(text, "    \"{product}\": {{\n{lines}    }},\n");
        }
    }
    text + "}\n"
}

fn number_in_python(value: f64) -> String {
    match value {
        f64::MIN => "-float_info.max".to_owned(),
        f64::MAX => "float_info.max".to_owned(),
        f64::INFINITY => "inf".to_owned(),
        finite => format!("{finite:?}"),
    }
}

fn write_if_asked(path: &Path, content: &[u8]) {
    if std::env::var_os("GRASPMILL_WRITE_SCHEMAS").is_some() {
        fs::write(path, content).expect("a file of the checkout");
    }
}
