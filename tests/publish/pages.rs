//! Pages of reports as strangers meet them: the first screen, legends, captions and commands.

use std::{collections::BTreeSet, path::Path};

use graspmill::{
    files::Folder,
    format::extras::read_field,
    geom::PoseLabel,
    ids::ItemId,
    publish::{
        draw_panels,
        picture::{Colour, Picture},
    },
};
use serde_json::Value;

use crate::support::{
    files::{read_text, repository_path},
    first_words::{between, check_first_words},
    jobs::{ABOUT, NO_SPLIT, copy_small_datasets, small_job},
    meshes::{block, centred_block, write_stl},
    program::{Program, print_root},
    robots::GRIPPER,
    shelf::Shelf,
    workspace::Workspace,
};

/// The page of a dataset.
#[track_caller]
fn page_of(data: &Path) -> String {
    Program::on("report", data).succeed();
    read_text(data.join("report.html"))
}

#[test]
fn the_first_screen_shows_samples_and_every_link_leads_somewhere() {
    let workspace = Workspace::new();
    for (product, data) in copy_small_datasets(&workspace) {
        let page = page_of(&data);
        let at = |part: &str| page.find(part).unwrap_or_else(|| panic!("{product}: {part} is missing"));
        let (strip, numbers, check) =
            (at("<div class=\"strip\">"), at("<dl class=\"numbers\">"), at("<section id=\"check\">"));
        assert!(strip < numbers && numbers < check, "{product}");
        assert!(at(&print_root(&data)) > check && at("graspmill verify .") > check, "{product}: the digest is above");
        // A few pictures, whole, each a link to its card; no strip is without a word on its colours.
        let strip = &page[strip..numbers];
        let links = between(strip, "<a href=\"#", "\"");
        assert!((1..=6).contains(&links.len()), "{product}: {links:?}");
        assert_eq!(strip.matches("src=\"data:image/png;base64,").count(), links.len(), "{product}");
        assert!(links.iter().all(|link| link.starts_with("card-")), "{product}: {links:?}");
        assert!(strip.contains("Each picture links to its card below."), "{product}");
        let ids: BTreeSet<&str> = between(&page, "id=\"", "\"").into_iter().collect();
        let lost: Vec<&str> = between(&page, "href=\"#", "\"").into_iter().filter(|link| !ids.contains(link)).collect();
        assert!(lost.is_empty(), "{product}: {lost:?}");
        // The speed of one machine is no headline.
        assert!(!page[..check].contains("per second") && !page.contains("a second"), "{product}");
    }
}

/// Notes on sound meshes are not alarms: an open list on a page about the objects. Warnings keep their colour, and `run` names both.
#[test]
fn notes_on_sound_meshes_are_apart_from_warnings() {
    let workspace = Workspace::new();
    // Two blocks 0.5 mm apart are one part of two bodies; 30 mm apart they are loose parts.
    for (name, gap) in [("pair", 0.0005), ("loose", 0.03)] {
        let mut mesh = block([0.0; 3], [0.05, 0.04, 0.04]);
        let above = block([0.0, 0.0, 0.04 + gap], [0.05, 0.04, 0.08 + gap]);
        mesh.triangles.extend(above.triangles.iter().map(|face| face.map(|vertex| vertex + 8)));
        mesh.vertices.extend(above.vertices);
        write_stl(&workspace.path(format!("{name}.stl")), &mesh);
    }
    let job = format!("views = {{ even = 2 }}\n[[objects]]\nfolder = \".\"\nunit = \"m\"\n{NO_SPLIT}");
    workspace.write("job.toml", job);
    let said = workspace.run_job("job", "data").succeed().stdout;
    assert!(said.contains("\nnote: pair: 2 separate bodies\n"), "{said}");
    assert!(said.contains("\nwarning: loose: 2 loose parts that nothing joins"), "{said}");
    let page = page_of(&workspace.path("data"));
    // At the head, and in the row of the object.
    let alarms = between(&page, " class=\"alarm\">", "</");
    let words = ["loose: 2 loose parts that nothing joins", "2 loose parts that nothing joins"];
    assert_eq!(alarms.len(), words.len(), "{alarms:?}");
    assert!(alarms.iter().zip(words).all(|(alarm, words)| alarm.starts_with(words)), "{alarms:?}");
    let notes = between(&page, "<details class=\"notes\" open>", "</details>");
    assert!(notes.len() == 1 && notes[0].contains("<li>pair: 2 separate bodies</li>"), "{notes:?}");
}

/// The first words are the same wherever a user meets a dataset, and no number of a card has the same label twice.
#[test]
fn run_inspect_report_and_card_begin_with_the_same_words() {
    let workspace = Workspace::beside_fixtures("publish-words");
    let about = workspace.write("about.toml", ABOUT);
    let expected = [
        ("completion", "samples of 1 object"),
        ("reachability", "poses are reachable"),
        ("grasps", "grasps held in trials; "),
        ("patches", "grasps of 1 object"),
    ];
    for (product, data) in copy_small_datasets(&workspace) {
        let (_, words) = expected.iter().find(|(name, _)| *name == product).expect("a product");
        let headline = check_first_words(&data, &about);
        assert!(headline.contains(words), "{product}: {headline}");
    }
}

/// Runs that found nothing are rejected and not given up, in sum and per object; without trials quality comes first.
#[test]
fn counts_of_runs_are_the_sums_of_their_rows() {
    let workspace = Workspace::new();
    write_stl(&workspace.path("wide.stl"), &centred_block([0.15; 3]));
    let job = format!(
        "product = \"grasps\"\nname = \"wide\"\nseed = 1\n[hand]\nmodel = {:?}\n[[objects]]\nbuilt_in = [\"box-01\"]\n[[objects]]\n\
         folder = \".\"\ninclude = [\"wide.stl\"]\nunit = \"m\"\n[grasps]\nseeds = 3\nsampler = \"antipodal\"\n\
         [antipodal]\nbest = 4\n[keep]\ntorsion = 0.002\n{NO_SPLIT}",
        repository_path(GRIPPER)
    );
    let data = workspace.make_dataset("data", &job, &[]);
    let inspection = Program::on("inspect", &data).arg("--json").succeed().json::<Value>();
    let rows = inspection["objects"].as_array().expect("rows");
    let sum = |key: &str| -> u64 { rows.iter().map(|row| row[key].as_u64().expect("a count")).sum() };
    let rejected: u64 = inspection["rejected"].as_object().expect("reasons").values().filter_map(Value::as_u64).sum();
    assert_eq!((sum("runs"), sum("rejected"), rejected), (6, 3, 3), "{inspection}");
    assert_eq!(Some(sum("given_up")), inspection["given_up"].as_u64());
    let headline = inspection["headline"].as_str().expect("a headline");
    assert!(headline.ends_with("grasps found have force closure and are kept"), "{headline}");
}

#[test]
fn noise_that_a_job_orders_is_no_error() {
    let workspace = Workspace::new();
    let job = format!("objects = [{{ built_in = [\"box-01\"] }}]\nviews = {{ even = 3 }}\n{NO_SPLIT}");
    let noise = "observed outside the solid: noise of the sensor (d435)";
    let error = "observed outside the solid (an error in standard data)";
    for (name, setting, says, facts) in [
        ("perfect", "name=perfect", error, Value::Null),
        ("noisy", "sensor.profile=d435", noise, "d435".into()),
        ("centres", "truth.rule=centre", "allowed by the truth rule centre", Value::Null),
    ] {
        let data = workspace.make_dataset(name, &job, &[setting]);
        let page = page_of(&data);
        assert!(page.contains(says), "{name}: {says} is missing");
        assert_eq!(page.contains(error), says == error, "{name}");
        assert_eq!(Program::on("inspect", &data).read_json()["sensor"], facts, "{name}");
    }
}

/// The command of a map's page, run without changes.
#[test]
fn the_page_of_a_map_asks_for_its_deepest_pose() {
    let workspace = Workspace::new();
    // From behind the robot's back to before it, so that the middle of the grid is inside the robot.
    let job = small_job("reachability")
        .replace("x = { from = 0.4, to = 0.8", "x = { from = -0.8, to = 0.8")
        .replace("y = { from = 0.0, to = 0.2", "y = { from = -0.4, to = 0.6");
    let data = workspace.make_dataset("map", &job, &[]);
    let page = page_of(&data);
    let [pose] = between(&page, "graspmill query reach . --pose ", " #")[..] else { panic!("no one command") };
    assert!(!pose.split(',').any(|number| number == "-0"), "{pose}");
    let answers: Value = Program::new("query").args(["reach", ".", "--pose", pose]).current_dir(&data).read_json();
    let answer = &answers["poses"][0];
    assert_eq!(answer["nearest"]["label"], "reachable", "{pose}: {answer}");
    let field = read_field(&Folder::at(&data)).expect("a field");
    let labelled = field.labels.iter().zip(&field.distances);
    let reachable = labelled.filter(|(label, _)| **label == PoseLabel::Reachable).map(|(_, distance)| *distance);
    let deepest = f64::from(reachable.fold(f32::INFINITY, f32::min));
    let distance = answer["distance"].as_f64().expect("a distance");
    assert!(deepest < 0.0 && (distance - deepest).abs() < 1e-3, "{pose}: {distance} is not {deepest}");
}

#[test]
fn dots_at_contacts_are_seen() {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("grasps", &small_job("grasps"), &["grasps.seeds=4"]);
    let page = page_of(&data);
    assert!(page.contains("a black dot, never hidden, marks each contact"), "the page speaks of dots");
    let mut drawn = 0;
    for item in (0..4).map(ItemId) {
        // The same size as on the page.
        let panels =
            draw_panels(&Folder::at(&data), "box-01", item, 200).expect("an intact dataset").unwrap_or_default();
        for panel in panels {
            let is_dot = |pixel: &&[u8; 4]| **pixel == Colour::CONTACT.opaque();
            let dots = panel.picture.pixels.iter().filter(is_dot).count();
            assert!(dots >= 12, "{dots} pixels of dots in the picture of run {}", item.0);
            drawn += 1;
        }
    }
    assert!(drawn > 0, "a run that was kept");
    // A dot is round, has a rim, and ends at the picture's border.
    let mut picture = Picture::filled(9, 9, [9, 9, 9, 255]);
    picture.dot([4.5, 4.5], 3.0, Colour::CONTACT);
    assert_eq!([(4, 4), (4, 1), (0, 0)].map(|(x, y)| picture.at(x, y)[0]), [0, 250, 9]);
    picture.dot([-2.0, 40.0], 3.0, Colour::CONTACT);
    assert_eq!(picture.at(0, 8)[0], 9);
}

#[test]
fn captions_name_colours_and_measures_in_words() {
    let workspace = Workspace::new();
    for (product, data) in copy_small_datasets(&workspace) {
        let page = page_of(&data);
        let captions: String = between(&page, "<figcaption>", "</figcaption>").concat();
        let in_hex = captions
            .split('#')
            .skip(1)
            .any(|rest| rest.len() >= 6 && rest.as_bytes()[..6].iter().all(u8::is_ascii_hexdigit));
        assert!(!in_hex, "{product}: a colour in hexadecimal digits in a caption");
        let says: &[&str] = match product {
            "completion" => &["by exploration (light blue)", "by the grasp (red)", "by rays (green)"],
            "grasps" => &["epsilon "],
            _ => &[],
        };
        for words in says {
            assert!(captions.contains(words), "{product}: no caption contains {words}");
        }
        // The text names which of two measures it means.
        for bare in ["best", "worst", "the only "] {
            assert!(!captions.contains(&format!("<figcaption>{bare} <")), "{product}: {bare}");
        }
    }
}

/// Text next to the colour bar of depth ends inside the drawing, whose width is 200.
#[test]
fn numbers_beside_a_colour_bar_are_not_clipped() {
    /// Widths of a digit and of a point in DejaVu Sans, the widest of the page's fonts, at its 11 px.
    const DIGIT: f64 = 7.0;
    const POINT: f64 = 3.5;
    let workspace = Workspace::new();
    let folder = workspace.path("shelf");
    Shelf { views: 6, with_depth: true }.write(&folder);
    let page = page_of(&folder);
    let mut longest = 0;
    for drawing in between(&page, "<svg class=\"depth\" viewBox=\"0 0 200 200\"", "</svg>") {
        for text in between(drawing, "<text x=\"", "</text>") {
            let (x, rest) = text.split_once('"').expect("an attribute");
            let (attributes, number) = rest.split_once('>').expect("a text");
            if attributes.contains("text-anchor") {
                continue;
            }
            let wide = number.chars().map(|letter| if letter == '.' { POINT } else { DIGIT }).sum::<f64>();
            let end = x.parse::<f64>().expect("a number") + wide;
            assert!(end <= 200.0, "{number} ends at {end:.1}");
            longest = longest.max(number.len());
        }
    }
    assert!(longest >= 6, "numbers with four digits after the point occur: {longest}");
}
