//! The page of a reachability dataset: counts, cross-sections with approach directions over the field, directions.

mod census;
mod contour;
mod section;

use std::fmt::Write as _;

use self::{
    census::{Census, LabelCounts},
    section::{Cut, band_key, class, legend},
};
use super::{
    ReachabilityFacts,
    chart::{Bar, Ink, StackedRow, bar_chart, grouped, percent, short, stacked_rows},
    page::{bytes_in_words, escaped, numbers_and_warnings, shell, speed},
    picture::Picture,
    sections,
};
use crate::{
    geom::{AxisUnit, FieldMetric, PoseGrid, PoseLabel, Proof, approach_directions},
    record::ReachabilityField,
};

/// Level cross-sections.
const LEVELS: usize = 4;
/// Labels, the best first.
const ORDER: [PoseLabel; 3] = [PoseLabel::Reachable, PoseLabel::Colliding, PoseLabel::NoSolution];

/// The page, and how many cross-sections it shows.
pub(super) fn page(facts: &ReachabilityFacts, field: &ReachabilityField, job_text: &str) -> (String, usize) {
    let census = Census::of(field);
    let cuts = cuts(field, &census);
    let body = [
        header(facts),
        how_to_check(facts),
        meaning(facts),
        sections_of(facts, field, &census, &cuts),
        counts(facts, field, &census),
        directions(&census),
        speed(facts.notes.speed.as_ref(), "positions"),
        sections::job(job_text),
    ];
    (shell(&facts.name, &body.join("\n")), cuts.len())
}

/// The upright cross-section and one level one as pictures, with where they are; `cell` pixels a position.
pub(super) fn pictures(field: &ReachabilityField, cell: u32) -> Vec<(String, Picture)> {
    let census = Census::of(field);
    let cuts = cuts(field, &census);
    let grid = &field.header.grid;
    let shown = [0, cuts.len().div_ceil(2)];
    let pictures = shown.iter().filter_map(|place| cuts.get(*place));
    pictures.map(|cut| (cut.name(grid), cut.picture(grid, &census, cell).with_few_colours().framed())).collect()
}

fn cuts(field: &ReachabilityField, census: &Census) -> Vec<Cut> {
    let grid = &field.header.grid;
    let upright = Cut::Upright(grid.places()[1].nearest(0.0));
    let mut cuts = vec![upright];
    cuts.extend(census.middle_heights(LEVELS).into_iter().rev().map(Cut::Level));
    cuts
}

fn header(facts: &ReachabilityFacts) -> String {
    let of = |label: PoseLabel| facts.labels.get(label.name()).copied().unwrap_or(0);
    let mut html = format!(
        concat!(
            "<header><p class=\"over\">graspmill reachability map</p><h1>{}</h1>",
            "<p class=\"lead\">Which of {} poses the {} of {} reaches{}, and how far each is from the ",
            "border.</p><p class=\"digest\"><span class=\"quiet\">root digest</span> <code>{}</code></p><dl class=\"numbers\">"
        ),
        escaped(&facts.name),
        grouped(facts.poses),
        escaped(&facts.robot.target),
        escaped(&facts.robot.name),
        if facts.collisions == "none" { " (collisions not looked at)" } else { " without a collision" },
        facts.root,
    );
    let share = |count: u64| percent(count as f64 / facts.poses.max(1) as f64);
    let mut numbers: Vec<(String, String)> = ORDER
        .map(|label| {
            (in_words(label).to_owned(), format!("{} <small>{}</small>", grouped(of(label)), share(of(label))))
        })
        .into();
    numbers.push(("positions".to_owned(), grouped(facts.positions)));
    numbers.push(("shards".to_owned(), format!("{} · {}", facts.shards, bytes_in_words(facts.shard_bytes))));
    if let Some(speed) = &facts.notes.speed {
        let poses = speed.rate() * facts.poses as f64 / facts.positions.max(1) as f64;
        numbers.push(("poses a second".to_owned(), grouped(poses.round() as u64)));
    }
    html.push_str(&numbers_and_warnings(&numbers, &facts.warnings));
    html.push_str(concat!(
        "<nav><a href=\"#check\">Check</a> <a href=\"#meaning\">Meaning</a> <a href=\"#sections\">Cross-sections</a> ",
        "<a href=\"#counts\">Counts</a> <a href=\"#directions\">Directions</a> <a href=\"#speed\">Speed</a> ",
        "<a href=\"#job\">Job</a></nav></header>"
    ));
    html
}

fn in_words(label: PoseLabel) -> &'static str {
    match label {
        PoseLabel::Reachable => "reachable",
        PoseLabel::Colliding => "colliding",
        PoseLabel::NoSolution => "no solution",
    }
}

fn how_to_check(facts: &ReachabilityFacts) -> String {
    // The thesis's files have six axes.
    let export = if facts.axes.iter().any(|axis| axis.name == "direction") {
        ""
    } else {
        "\ngraspmill export . --to graspit --out ../g  # raw float64, csv"
    };
    format!(
        concat!(
            "<section id=\"check\"><h2>Check it, ask it, make it again</h2><pre><code>",
            "graspmill verify .                          # every byte against its digest\n",
            "graspmill verify . --regenerate 64 --seed 1 # labels 64 random positions again and compares them\n",
            "graspmill query reach . --pose {pose}  # x,y,z [m], roll,pitch,yaw [rad]\n",
            "graspmill run job.toml --out ../again       # makes all of it again\n",
            "graspmill digest ../again                   # {root}{export}</code></pre>",
            "<p class=\"quiet\">Made by {generator}, format {format}. Job <code>{job}</code>.</p></section>"
        ),
        pose = facts.axes[..3].iter().map(middle).chain(["0,0,0".to_owned()]).collect::<Vec<_>>().join(","),
        root = facts.root,
        export = export,
        generator = escaped(&facts.generator),
        format = facts.format_version,
        job = facts.job,
    )
}

/// The centre in the middle of an axis.
fn middle(axis: &super::AxisFacts) -> String {
    short(axis.first + (axis.count / 2) as f64 * axis.step)
}

/// Robot, group, grid and metric.
fn meaning(facts: &ReachabilityFacts) -> String {
    let robot = &facts.robot;
    let fixed: Vec<String> = robot.fixed.iter().map(|(joint, value)| format!("{} = {value}", escaped(joint))).collect();
    let rows = [
        ("robot", format!("{}, content <code>{}</code>", escaped(&robot.name), robot.id.0.short())),
        ("planning group", escaped(&robot.joints.join(", "))),
        (
            "other joints held at",
            if fixed.is_empty() { "what the robot's file says".to_owned() } else { fixed.join(", ") },
        ),
        ("solver", escaped(&facts.solver)),
        (
            "collisions",
            if facts.collisions == "none" {
                "<strong>not looked at</strong>".to_owned()
            } else {
                escaped(&facts.collisions)
            },
        ),
        ("brought to the poses", format!("site {}; its x axis is the approach direction", escaped(&robot.target))),
        ("frame of the poses", escaped(&robot.frame)),
        ("rotation", "Rz(yaw) Ry(pitch) Rx(roll)".to_owned()),
        ("covering", escaped(&facts.covering.words)),
        ("field", field_in_words(facts)),
    ];
    let mut html = String::from("<section id=\"meaning\"><h2>What it maps</h2><table><tbody>");
    for (name, value) in rows {
        let _ = write!(html, "<tr><th>{name}</th><td>{value}</td></tr>");
    }
    html.push_str(
        "</tbody></table><table class=\"figures\"><thead><tr><th>axis</th><th>cells</th><th>first</th><th>last</th>",
    );
    html.push_str("<th>step</th></tr></thead><tbody>");
    for axis in &facts.axes {
        if axis.unit == AxisUnit::HealPix.name() {
            let (name, count) = (escaped(&axis.name), axis.count);
            let _ = write!(
                html,
                "<tr><td>{name}</td><td>{count}</td><td colspan=\"3\">of the x axis: HEALPix centres in ring order</td></tr>"
            );
            continue;
        }
        let angle = axis.unit == "rad";
        let value = |value: f64| match angle {
            true => format!("{}°", short((value.to_degrees() * 1e6).round() / 1e6)),
            false => format!("{} m", short((value * 1e6).round() / 1e6)),
        };
        let last = axis.first + axis.count.saturating_sub(1) as f64 * axis.step;
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&axis.name),
            axis.count,
            value(axis.first),
            value(last),
            value(axis.step)
        );
    }
    html.push_str("</tbody></table></section>");
    html
}

fn field_in_words(facts: &ReachabilityFacts) -> String {
    let field = &facts.field;
    let directed = facts.axes.iter().any(|axis| axis.unit == AxisUnit::HealPix.name());
    let what = match field.profile.as_str() {
        _ if directed => "exact distance between cells, by metres and the angle between rotations",
        "standard" => "exact Euclidean distance between cell boxes, angles wrapping",
        _ => "second-order fast marching, all axes equal, angles wrapping",
    };
    let weight = field.radian_weight.map_or_else(String::new, |rho| format!("; a radian counts as {} m", short(rho)));
    let range = match (field.least, field.most, field.mean) {
        (Some(least), Some(most), Some(mean)) => format!("{least:.3} to {most:.3} {}, mean {mean:.3}", field.unit),
        _ => "infinite, since all labels are alike".to_owned(),
    };
    format!(
        "signed distance to the border of the reachable set, negative inside: {range}. Profile {}: {what}{weight}.",
        field.profile
    )
}

fn sections_of(facts: &ReachabilityFacts, field: &ReachabilityField, census: &Census, cuts: &[Cut]) -> String {
    let grid = &field.header.grid;
    let band = match field.header.metric {
        FieldMetric::Metres { .. } => (grid.places()[0].step / 2.0).max(0.025),
        FieldMetric::Cells => 0.5,
    };
    let mut figures = cuts.iter().map(|cut| {
        let eye = match cut {
            Cut::Level(_) => "from above",
            Cut::Upright(_) => "from the right-hand side (-y)",
        };
        let (svg, name) = (cut.svg(grid, census, band), cut.name(grid));
        let kind = if matches!(cut, Cut::Level(_)) { "level" } else { "upright" };
        format!(
            "<figure class=\"section {kind}\"><figcaption><strong>{name}</strong>, {eye}</figcaption>{svg}</figure>"
        )
    });
    let upright = figures.next().unwrap_or_default();
    let finite = || census.positions.iter().map(|position| position.distance).filter(|distance| distance.is_finite());
    let (least, most) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
    let swatches: String = ORDER
        .iter()
        .filter(|label| facts.collisions != "none" || **label != PoseLabel::Colliding)
        .map(|label| format!("<li><span class=\"swatch {}\"></span>{}</li>", class(*label), label_line(*label)))
        .collect();
    format!(
        concat!(
            "<section id=\"sections\"><h2>Cross-sections</h2><div class=\"sections\">{upright}<div>",
            "<p>Each cell has one mark for each direction from which the end effector can come: the arrow points the way ",
            "the target's x axis does. A mark is coloured by its best pose, of all rolls about that direction.{fewer}</p>",
            "<ul class=\"legend tall\">{swatches}</ul>{legend}",
            "<p>Beneath: the signed distance of the best orientation at each position (the least of all), ",
            "interpolated between positions, in bands of {band} {unit}. The dark line is its zero: inside it some orientation is ",
            "reachable. A swatch bears the lower end of its band.</p>{key}",
            "<p class=\"quiet\">A cross marks the origin of the frame of the poses.</p></div></div>{rest}</section>"
        ),
        upright = upright,
        swatches = swatches,
        legend = legend(),
        band = short(band),
        unit = escaped(&facts.field.unit),
        key = band_key(band, least, most),
        fewer = {
            let directed = match grid {
                PoseGrid::Axes(_) => String::new(),
                PoseGrid::Sphere(grid) => {
                    let count = grid.directions().count();
                    format!(" The {count} directions of this map count for the nearest of these 26.")
                }
            };
            match stride_of(grid, cuts) {
                1 => directed,
                stride => format!("{directed} Marks stand at one position of {stride} along each axis."),
            }
        },
        rest = figures.collect::<String>(),
    )
}

fn stride_of(grid: &PoseGrid, cuts: &[Cut]) -> usize {
    cuts.iter().map(|cut| cut.stride(grid)).max().unwrap_or(1)
}

fn label_line(label: PoseLabel) -> &'static str {
    match label {
        PoseLabel::Reachable => "reachable: joint values are known",
        PoseLabel::Colliding => "colliding: joint values exist, but something touches with all of them",
        PoseLabel::NoSolution => "no solution: no joint values within their limits",
    }
}

fn counts(facts: &ReachabilityFacts, field: &ReachabilityField, census: &Census) -> String {
    let labels: Vec<StackedRow> = (ORDER.iter())
        .map(|label| {
            let count = facts.labels.get(label.name()).copied().unwrap_or(0);
            StackedRow { name: in_words(*label).to_owned(), parts: vec![(class(*label), count)] }
        })
        .collect();
    let proofs: Vec<Bar> = (Proof::ALL.iter())
        .map(|proof| Bar {
            label: proof_in_words(*proof).to_owned(),
            value: facts.proofs.get(proof.name()).copied().unwrap_or(0),
            ink: if *proof == Proof::Searched { Ink::Reject } else { Ink::Neutral },
        })
        .collect();
    let axis = &field.header.grid.places()[2];
    let heights: Vec<StackedRow> = (census.heights.iter().enumerate().rev())
        .map(|(cell, counts)| StackedRow {
            name: format!("{:.2} m", axis.centre(cell) + 0.0),
            parts: ORDER[..2].iter().map(|label| (class(*label), counts[*label as usize])).collect(),
        })
        .collect();
    let figure = |svg: String, caption: &str| format!("<figure>{svg}<figcaption>{caption}</figcaption></figure>");
    format!(
        concat!(
            "<section id=\"counts\"><h2>Counts</h2><div class=\"charts\"><div>{}{}</div>{}</div>",
            "<p>\"Searched only\" means that nothing was found by a search that is no proof. All other labels are proven.</p></section>"
        ),
        figure(stacked_rows("poses by label", &labels, facts.poses), "Poses by label"),
        figure(bar_chart("poses by proof", &proofs), "Poses by how their label is known"),
        figure(
            stacked_rows("poses by height", &heights, (facts.poses / axis.count.max(1) as u64).max(1)),
            "Reachable (green, with counts) and colliding (orange) poses by height; shares of all poses of that height",
        ),
    )
}

fn proof_in_words(proof: Proof) -> &'static str {
    match proof {
        Proof::Bound => "a bound",
        Proof::IntervalEnds => "ends of all intervals",
        Proof::Swept => "certificate over a sweep",
        Proof::Searched => "searched only",
        Proof::Witness => "joint values (witness)",
    }
}

/// A map of the sphere, and all numbers.
fn directions(census: &Census) -> String {
    let share = |counts: &LabelCounts| {
        let all: u64 = counts.iter().sum();
        (all > 0).then(|| counts[PoseLabel::Reachable as usize] as f64 / all as f64)
    };
    let most = census.directions.iter().filter_map(share).fold(0.0, f64::max);
    let cell = |place: usize, columns: usize| match share(&census.directions[place]) {
        None => format!("<td colspan=\"{columns}\">-</td>"),
        Some(share) => {
            let strength = if most > 0.0 { share / most * 75.0 } else { 0.0 };
            let style = format!("background:color-mix(in srgb, var(--pose-free) {strength:.0}%, transparent)");
            format!("<td colspan=\"{columns}\" style=\"{style}\">{}</td>", percent(share))
        }
    };
    let mut html = String::from(concat!(
        "<section id=\"directions\"><h2>Approach directions</h2><p>Share of the poses that are reachable, by the direction ",
        "in which the target's x axis points (every pose counts for the nearest of these). Azimuth turns about z from +x ",
        "(forward, 0°) to +y (left, 90°).</p><table class=\"sphere\"><thead><tr><th></th>"
    ));
    for azimuth in 0..8 {
        let at = -180 + 45 * azimuth;
        let _ = write!(
            html,
            "<th>{at}°{}</th>",
            [" back", "", " right", "", " forward", "", " left", ""][azimuth as usize]
        );
    }
    html.push_str("</tr></thead><tbody>");
    let _ = write!(html, "<tr><th>straight up</th>{}</tr>", cell(25, 8));
    for (ring, name) in [(2, "45° up"), (1, "level"), (0, "45° down")] {
        let cells: String = (0..8).map(|azimuth| cell(1 + 8 * ring + azimuth, 1)).collect();
        let _ = write!(html, "<tr><th>{name}</th>{cells}</tr>");
    }
    let _ = write!(html, "<tr><th>straight down</th>{}</tr></tbody></table>", cell(0, 8));
    html.push_str(concat!(
        "<details><summary>All counts</summary><table class=\"figures\"><thead><tr><th>x, y, z of the direction</th>",
        "<th>reachable</th><th>colliding</th><th>no solution</th><th>share reachable</th></tr></thead><tbody>"
    ));
    for (direction, counts) in approach_directions().iter().zip(&census.directions) {
        let vector = direction.iter().map(|part| format!("{:.2}", part + 0.0)).collect::<Vec<_>>().join(", ");
        let _ = write!(html, "<tr><td>{}</td>", vector.replace("-0.00", "0.00"));
        for label in ORDER {
            let _ = write!(html, "<td>{}</td>", grouped(counts[label as usize]));
        }
        let _ = write!(html, "<td>{}</td></tr>", share(counts).map_or_else(|| "-".to_owned(), percent));
    }
    html.push_str("</tbody></table></details></section>");
    html
}
