use std::{fs, path::Path};

use super::*;

const MAIN: &str = "<!-- file=\"no.xml\" --><mujoco model='arm'>\n<compiler meshdir=\"parts\" angle='radian'/>\
    <include file=\"arm.xml\"/><asset><mesh name='a > b' file='a.stl'/></asset></mujoco>";

fn write(folder: &Path, main: &str, mesh: &[u8]) {
    fs::create_dir_all(folder.join("parts")).unwrap();
    fs::write(folder.join("robot.xml"), main).unwrap();
    fs::write(folder.join("arm.xml"), "<mujoco><asset><mesh file=\"b.stl\"/></asset></mujoco>").unwrap();
    fs::write(folder.join("parts/a.stl"), mesh).unwrap();
    fs::write(folder.join("parts/b.stl"), "b").unwrap();
}

/// Writes files into a folder and reads the first.
fn read_files(files: &[(&str, &str)]) -> Result<DescriptionText, DescriptionError> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    DescriptionText::read(&folder.path().join(files[0].0))
}

fn read_text(text: &str) -> Result<DescriptionText, DescriptionError> {
    read_files(&[("scene.xml", text)])
}

#[test]
fn a_description_is_named_by_its_text_and_all_files_that_it_names() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let digest = |index: usize| Description::read(&folders[index].path().join("robot.xml"));
    write(folders[0].path(), MAIN, b"a");
    write(folders[1].path(), MAIN, b"a");
    let first = digest(0).unwrap();
    assert_eq!(first.name, "arm");
    assert_eq!(digest(1).unwrap(), first, "another folder");
    // The digest is part of sample names: it must not change.
    let texts = [MAIN, "<mujoco><asset><mesh file=\"b.stl\"/></asset></mujoco>", "b", "a"];
    let parts = texts.map(|text| Digest::hash(text.as_bytes()));
    let parts = [b"graspmill description".as_slice()].into_iter().chain(parts.iter().map(|digest| digest.0.as_slice()));
    assert_eq!(first.digest, Digest::hash_parts(parts));
    write(folders[1].path(), MAIN, b"A");
    assert_ne!(digest(1).unwrap(), first, "another mesh");
    write(folders[1].path(), &MAIN.replace("radian", "degree"), b"a");
    assert_ne!(digest(1).unwrap(), first, "another text");
    write(folders[1].path(), MAIN, b"a");
    fs::write(folders[1].path().join("parts/b.stl"), "B").unwrap();
    assert_ne!(digest(1).unwrap(), first, "another mesh of an included file");
    fs::write(folders[1].path().join("parts/b.stl"), "b").unwrap();
    let hand = |index: usize| Description::of_hand(&folders[index].path().join("robot.xml"));
    let error = hand(1).unwrap_err();
    assert!(error.to_string().contains("robot.toml") && error.remedy().contains("docs/hands.md"), "{error}");
    folders.iter().for_each(|folder| fs::write(folder.path().join("robot.toml"), "x = 1").unwrap());
    let with_table = hand(0).unwrap();
    assert_eq!((&with_table.name, hand(1).unwrap()), (&first.name, with_table.clone()), "another folder");
    assert_ne!(with_table.digest, first.digest);
    fs::write(folders[1].path().join("robot.toml"), "x = 2").unwrap();
    assert_ne!(hand(1).unwrap(), with_table, "another table");
    fs::write(folders[1].path().join("parts/b.stl"), "B").unwrap();
    fs::write(folders[1].path().join("robot.toml"), "x = 1").unwrap();
    assert_ne!(hand(1).unwrap(), with_table, "another mesh of a hand");
    fs::remove_file(folders[1].path().join("parts/b.stl")).unwrap();
    let error = digest(1).unwrap_err().to_string();
    assert!(error.contains("b.stl") && error.contains("arm.xml:1"), "{error}");
}

#[test]
fn included_elements_stand_in_the_place_of_their_include() {
    let text = read_files(&[
        ("a.xml", "<mujoco>\n<worldbody><body name='b'>\n<include file='parts/b.xml'/></body></worldbody></mujoco>"),
        ("parts/b.xml", "<mujocoinclude>\n<geom/><frame><site/></frame></mujocoinclude>"),
    ])
    .unwrap();
    let shown = |statement: &Statement| format!("{}/{} {}", statement.within, statement.element, statement.place.line);
    let shown: Vec<String> = text.statements.iter().map(shown).collect();
    let expected = [
        "/mujoco 1",
        "mujoco/worldbody 2",
        "body/body 2",
        "body/include 3",
        "body/geom 2",
        "body/frame 2",
        "body/site 2",
    ];
    assert_eq!(shown, expected);
    let parents: Vec<Option<usize>> = text.statements.iter().map(|statement| statement.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(1), Some(2), Some(2), Some(2), Some(5)]);
    assert!(text.statements[4].place.to_string().ends_with("parts/b.xml:2"), "{}", text.statements[4].place);
}

#[test]
fn files_that_lead_back_to_themselves_are_refused_at_any_length() {
    let attach = |file: &str| {
        format!(
            "<mujoco><asset>\n<model name='m' file='{file}'/></asset><worldbody><attach model='m' prefix='p'/></worldbody></mujoco>"
        )
    };
    let include = |file: &str| format!("<mujoco>\n<include file='{file}'/></mujoco>");
    for (files, line) in [
        (vec![("a.xml", attach("a.xml"))], "a.xml:2"),
        (vec![("a.xml", attach("./a.xml"))], "a.xml:2"),
        (vec![("a.xml", include("a.xml"))], "a.xml:2"),
        (vec![("a.xml", attach("b.xml")), ("b.xml", attach("a.xml"))], "b.xml:2"),
        (vec![("a.xml", attach("b.xml")), ("b.xml", include("a.xml"))], "b.xml:2"),
        (vec![("a.xml", include("b.xml")), ("b.xml", attach("b.xml"))], "b.xml:2"),
        (vec![("a.xml", include("b.xml")), ("b.xml", include("c.xml")), ("c.xml", attach("a.xml"))], "c.xml:2"),
        (vec![("a.xml", attach("b.xml")), ("b.xml", attach("c.xml")), ("c.xml", attach("b.xml"))], "c.xml:2"),
    ] {
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let error = read_files(&files).unwrap_err();
        let told = error.to_string();
        assert!(matches!(error, DescriptionError::Cycle { .. }), "{files:?}: {told}");
        assert!(told.contains(&format!("{line}: ")) && told.contains("leads back to itself"), "{files:?}: {told}");
    }
    // Twice the same model is no cycle.
    let twice = "<mujoco><asset><model name='m' file='b.xml'/><model name='n' file='b.xml'/></asset></mujoco>";
    let text = read_files(&[("a.xml", twice), ("b.xml", "<mujoco><worldbody/></mujoco>")]).unwrap();
    assert_eq!(text.statements.len(), 4 + 2);
}

#[test]
fn chains_of_files_are_bounded() {
    let include =
        |index: usize| (format!("{index}.xml"), format!("<mujoco><include file='{}.xml'/></mujoco>", index + 1));
    for (count, is_fine) in [(MAX_FILES_DEEP - 1, true), (MAX_FILES_DEEP, false)] {
        let mut files: Vec<_> = (0..count).map(include).collect();
        files.push((format!("{count}.xml"), "<mujoco/>".to_owned()));
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
        assert_eq!(read_files(&files).is_ok(), is_fine, "{count}");
    }
}

/// A description with `count` elements of the kind that a bound limits, with these attributes.
fn description_of(element: &str, attributes: &str, count: usize) -> String {
    let (section, name) = element.split_once('/').expect("a section and an element");
    let name = match (section, name) {
        ("*", _) => return description_of("body/geom", attributes, count),
        ("equality", "*") => "connect",
        ("sensor", "*") => "touch",
        ("actuator", "*") => "motor",
        (_, name) => name,
    };
    let all = format!("<{name} {attributes}/>").repeat(count);
    match section {
        "body" => format!("<mujoco><worldbody>{all}</worldbody></mujoco>"),
        "mujoco" => format!("<mujoco>{all}</mujoco>"),
        "composite" => format!("<mujoco><worldbody><composite>{all}</composite></worldbody></mujoco>"),
        _ => format!("<mujoco><{section}>{all}</{section}></mujoco>"),
    }
}

/// A row's own attribute, in full.
fn attribute(name: &str) -> String {
    name.replace("nuser_*", "nuser_geom")
}

#[test]
fn every_bound_holds() {
    for ElementBound { element, rule } in BOUNDS {
        let told = |attributes: &str, count: usize| {
            read_text(&description_of(element, attributes, count)).map(drop).map_err(|error| error.to_string())
        };
        match *rule {
            Rule::Count { most } => {
                assert_eq!(told("", most as usize), Ok(()), "{element}");
                let error = told("", most as usize + 1).unwrap_err();
                assert!(error.contains(&format!("{} elements {element}", most + 1.0)), "{error}");
            }
            Rule::Value { attribute: name, range: [least, most] } => {
                let name = attribute(name);
                // Attributes that share its memory bound are small.
                let beside: String = BOUNDS
                    .iter()
                    .filter(|other| other.element == *element)
                    .filter_map(
                        |other| if let Rule::Memory { attributes, .. } = other.rule { Some(attributes) } else { None },
                    )
                    .flatten()
                    .filter(|other| **other != name)
                    .map(|other| format!(" {other}=\"1\""))
                    .collect();
                let written = |value: f64| format!("{name}=\"{value}\"{beside}");
                assert_eq!(told(&written(most), 1), Ok(()), "{element} {name}");
                assert_eq!(told(&written(least.max(-1.0)), 1), Ok(()), "{element} {name}");
                for value in [
                    (most + 1.0).to_string(),
                    "1e300".to_owned(),
                    "inf".to_owned(),
                    "nan".to_owned(),
                    format!("1 {}", most + 1.0),
                ] {
                    let error = told(&format!("{name}=\"{value}\""), 1).unwrap_err();
                    assert!(error.contains(&format!("`{name}` of <")) && error.contains(&value), "{value}: {error}");
                }
                if least.is_finite() {
                    assert!(
                        told(&written(least - 1.0), 1).unwrap_err().contains(&format!("{least} to {most}")),
                        "{element}"
                    );
                }
            }
            Rule::Copies { attribute: name, most } => {
                assert_eq!(told(&format!("{name}=\"1 {most} 1\""), 1), Ok(()), "{element}");
                let error = told(&format!("{name}=\"2 {most}\""), 1).unwrap_err();
                assert!(error.contains(&format!("makes {} copies", 2.0 * most)), "{error}");
            }
            Rule::Numbers { attribute: name, most } => {
                assert_eq!(told(&format!("{name}=\"{}\"", "1 ".repeat(most)), 1), Ok(()), "{element}");
                let error = told(&format!("{name}=\"{}\"", "1\n".repeat(most + 1)), 1).unwrap_err();
                assert!(error.contains(&format!("has {} numbers", most + 1)), "{error}");
            }
            Rule::Memory { attributes, unit } => {
                // Each attribute at its own bound: enough elements that all rows together are too much.
                let most = |name: &&str| {
                    let rows = BOUNDS.iter().filter(|other| other.element == *element);
                    let mut most = rows.filter_map(|other| match other.rule {
                        Rule::Value { attribute, range } if attribute == *name => Some(range[1]),
                        _ => None,
                    });
                    most.next().expect("each attribute that takes memory also has a bound")
                };
                let values: Vec<(&str, f64)> = attributes.iter().map(|name| (*name, most(name))).collect();
                let each = values.iter().fold(unit, |product, (_, value)| product * value);
                let written: String = values.iter().map(|(name, value)| format!("{name}=\"{value}\" ")).collect();
                let fine = (MAX_BYTES / each) as usize;
                if fine > 0 {
                    assert_eq!(told(&written, fine), Ok(()), "{element}");
                }
                let error = told(&written, fine + 1).unwrap_err();
                assert!(error.contains("MiB of memory"), "{error}");
            }
        }
    }
}

/// A default counts as much as its target.
#[test]
fn defaults_are_bounded_as_elements_are() {
    let default = |content: &str, assets: usize| {
        let assets = "<texture builtin='flat'/>".repeat(assets);
        read_text(&format!("<mujoco><default>{content}</default><asset>{assets}</asset></mujoco>")).map(drop)
    };
    default("<texture width='512' height='512'/>", 3).unwrap();
    assert!(default("<texture width='99999'/>", 0).is_err());
    assert!(default("<motor nsample='99999'/>", 0).is_err());
    assert!(default(&format!("<geom user='{}'/>", "1 ".repeat(101)), 0).is_err());
    let error = default("<texture width='512' height='512'/>", 100).unwrap_err().to_string();
    assert!(error.contains("MiB of memory"), "{error}");
}

#[test]
fn copies_are_counted_through_replicates_includes_and_models() {
    let nested = |count: u32, content: &str| format!("<replicate count=\"{count}\">{content}</replicate>");
    let check = |body: &str| {
        let main =
            format!("<mujoco><asset><model name='m' file='model.xml'/></asset><worldbody>{body}</worldbody></mujoco>");
        read_files(&[
            ("scene.xml", &main),
            ("part.xml", "<mujoco><replicate count='1000'><site/></replicate></mujoco>"),
            ("model.xml", "<mujoco><worldbody><replicate count='1000'><site/></replicate></worldbody></mujoco>"),
        ])
        .map(drop)
        .map_err(|error| error.to_string())
    };
    for fine in [
        nested(130, &nested(130, "<site/>")),
        // One after the other they add up, they do not multiply.
        nested(1000, "<site/>").repeat(4),
        "<replicate count='9'/>".repeat(1000),
        nested(10, "<include file='part.xml'/>"),
        "<attach model='m' prefix='a'/>".repeat(19),
        // Attaches nothing.
        "<attach model='n' prefix='a'/>".repeat(190),
    ] {
        assert_eq!(check(&fine), Ok(()), "{fine}");
    }
    for bomb in [
        nested(1000, &nested(1000, "<site/>")),
        nested(1000, "<site/>").repeat(20),
        nested(20, "<include file='part.xml'/>"),
        nested(20, "<attach model='m' prefix='a'/>"),
        "<attach model='m' prefix='a'/>".repeat(20),
    ] {
        let error = check(&bomb).unwrap_err();
        assert!(error.contains("elements with all copies"), "{error}");
    }
    // Ten models: each attaches the next one ten times, or names it ten times without attaching it.
    for (assets, attaches) in [(1, 10), (10, 0)] {
        let model = |index: u32| {
            let attach = "<attach model='m0' prefix='a'/>".repeat(attaches);
            let name = |asset: u32| format!("<model name='m{asset}' file='{}.xml'/>", index + 1);
            let assets: String = (0..assets).map(name).collect();
            let text = format!("<mujoco><asset>{assets}</asset><worldbody><site/>{attach}</worldbody></mujoco>");
            (format!("{index}.xml"), text)
        };
        let mut files: Vec<_> = (0..10).map(model).collect();
        files.push(("10.xml".to_owned(), "<mujoco><worldbody><site/></worldbody></mujoco>".to_owned()));
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
        let error = read_files(&files).unwrap_err().to_string();
        assert!(error.contains("elements with all copies"), "{error}");
    }
}

#[test]
fn nesting_and_elements_are_bounded() {
    let nested = |count: usize| format!("<mujoco>{}{}</mujoco>", "<body>".repeat(count), "</body>".repeat(count));
    read_text(&nested(MAX_DEPTH - 1)).unwrap();
    for count in [MAX_DEPTH, 1_000_000] {
        let error = read_text(&nested(count)).unwrap_err().to_string();
        assert!(error.contains("more than 200 elements within each other"), "{error}");
    }
    // Through files as well.
    let bodies = |inside: &str| format!("<mujoco>{}{inside}{}</mujoco>", "<body>".repeat(120), "</body>".repeat(120));
    let attach = "<asset><model name='m' file='b.xml'/></asset><attach model='m' prefix='p'/>";
    for outer in ["<include file='b.xml'/>", attach] {
        let error = read_files(&[("a.xml", &bodies(outer)), ("b.xml", &bodies(""))]).unwrap_err().to_string();
        assert!(error.contains("more than 200 elements within each other"), "{error}");
    }
    let many = format!("<mujoco>{}</mujoco>", "<text/>".repeat(20_000));
    assert!(read_text(&many).unwrap_err().to_string().contains("20001 elements with all copies"));
}

#[test]
fn files_of_packages_are_found_where_urdfs_name_them() {
    let urdf = |uri: &str| {
        format!(
            "<robot name='arm'><link name='a'><visual><geometry><mesh filename='package://gone/seen.dae'/></geometry></visual>\
             <collision><geometry><mesh filename='{uri}'/></geometry></collision></link><gazebo><mesh filename='x'/></gazebo></robot>"
        )
    };
    let read = |uri: &str| {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("ws/src/my_arm/urdf/arm.urdf", urdf(uri).as_str()),
            ("ws/src/my_arm/urdf/beside.stl", ""),
            ("ws/src/my_arm/meshes/link.stl", ""),
            ("ws/src/my_arm/package.xml", "<package><depend>other</depend><name> declared </name></package>"),
            ("ws/src/other/meshes/tool.stl", ""),
        ] {
            fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
            fs::write(folder.path().join(name), text).unwrap();
        }
        let text = DescriptionText::read(&folder.path().join("ws/src/my_arm/urdf/arm.urdf"))?;
        assert_eq!(text.format, Format::Urdf);
        let found: Vec<String> = text
            .files
            .iter()
            .map(|(_, path)| path.strip_prefix(folder.path()).unwrap().display().to_string())
            .collect();
        Ok::<_, DescriptionError>(found.join(" "))
    };
    assert_eq!(read("package://my_arm/meshes/link.stl").unwrap(), "ws/src/my_arm/meshes/link.stl");
    assert_eq!(read("package://declared/meshes/link.stl").unwrap(), "ws/src/my_arm/meshes/link.stl");
    assert_eq!(read("model://other/meshes/tool.stl").unwrap(), "ws/src/other/meshes/tool.stl");
    assert_eq!(read("beside.stl").unwrap(), "ws/src/my_arm/urdf/beside.stl");
    assert_eq!(read("../meshes/link.stl").unwrap(), "ws/src/my_arm/urdf/../meshes/link.stl");
    let error = read("package://none/link.stl").unwrap_err();
    let told = error.to_string();
    assert!(
        told.contains("arm.urdf:1") && told.contains("the package \"none\"") && told.contains("ws/src/my_arm/urdf"),
        "{told}"
    );
    assert!(error.remedy().contains("relative to the description's folder"));
    assert!(matches!(read("package://../etc/x"), Err(DescriptionError::NoPackage { .. })));
    assert!(matches!(read("package://my_arm/gone.stl"), Err(DescriptionError::Unreadable { by: Some(_), .. })));
}

#[test]
fn packages_are_found_from_a_bare_file_name() {
    let here = std::env::current_dir().unwrap();
    let package = here.file_name().and_then(|name| name.to_str()).expect("a folder with a name");
    let written = format!("package://{package}/meshes/link.stl");
    let found =
        packages::uri(&written).expect("a package").find(Path::new(""), &Place::start_of(Path::new("arm.urdf")));
    assert_eq!(found.unwrap(), here.join("meshes/link.stl"));
}

#[test]
fn what_is_no_xml_is_told_with_its_line() {
    let error = read_text("<mujoco>\n<worldbody>\n</mujoco>").unwrap_err().to_string();
    assert!(error.ends_with("scene.xml:3: </mujoco> closes <worldbody>"), "{error}");
}
