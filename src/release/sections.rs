//! The sections of the report around its gallery.

use std::fmt::Write as _;

use super::{
    Inspection, ObjectFacts, Spread, TouchFacts,
    chart::{Bar, Column, Histogram, Ink, bar_chart, columns, grouped, percent, round_step, short},
    page::{bytes_in_words, escaped},
    picture::{Colour, SLICE_COLOURS},
    survey::Survey,
    tally::Tally,
};

/// Title, digest and the numbers that matter most.
pub(super) fn header(facts: &Inspection) -> String {
    let rejected = facts.rejected.values().sum::<u64>();
    let mut html = format!(
        concat!(
            "<header><p class=\"over\">graspmill dataset</p><h1>{}</h1>",
            "<p class=\"lead\">{} pairs of what one camera sees of an object and the whole solid, on the same grid.</p>",
            "<p class=\"digest\"><span class=\"quiet\">root digest</span> <code>{}</code></p><dl class=\"numbers\">"
        ),
        escaped(&facts.name),
        grouped(facts.kept),
        facts.root,
    );
    let sum = format!("{} + {} = {}", grouped(facts.kept), grouped(rejected), grouped(facts.planned));
    let mut numbers = vec![
        ("kept + rejected = planned", sum),
        ("objects", grouped(facts.objects.len() as u64)),
        ("shards", format!("{} · {}", grouped(facts.shards), bytes_in_words(facts.shard_bytes))),
    ];
    if let Some(bytes) = facts.shard_bytes.checked_div(facts.kept) {
        numbers.push(("bytes a kept sample", grouped(bytes)));
    }
    if let Some(setup) = &facts.setup {
        numbers.push(("cells of a grid", format!("{}³", setup.resolution)));
    }
    if let Some(speed) = &facts.notes.speed {
        numbers.push(("samples a second", grouped(speed.rate().round() as u64)));
    }
    if let Some(touch) = &facts.touch {
        numbers.push(("contacts a sample", format!("{:.1}", TouchFacts::share(touch.contacts(), touch.samples))));
    }
    for (name, value) in numbers {
        let _ = write!(html, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    html.push_str("</dl>");
    if facts.kept + rejected != facts.planned {
        html.push_str("<p class=\"alarm\">Kept and rejected samples do not add up to the plan.</p>");
    }
    let warnings: String =
        facts.warnings.iter().map(|warning| format!("<li class=\"alarm\">{}</li>", escaped(warning))).collect();
    match facts.warnings.len() {
        0 => {}
        1..=4 => {
            let _ = write!(html, "<ul>{warnings}</ul>");
        }
        count => {
            let _ = write!(
                html,
                "<details><summary class=\"alarm\">{} warnings</summary><ul>{warnings}</ul></details>",
                grouped(count as u64)
            );
        }
    }
    html.push_str(concat!(
        "<nav><a href=\"#check\">Check</a> <a href=\"#meaning\">Meaning</a> <a href=\"#gallery\">Samples</a> ",
        "<a href=\"#distributions\">Distributions</a> <a href=\"#splits\">Splits</a> <a href=\"#objects\">Objects</a> ",
        "<a href=\"#speed\">Speed</a> <a href=\"#job\">Job</a></nav></header>"
    ));
    html
}

/// How to prove that the data is what it claims, and how to make it again.
pub(super) fn how_to_check(facts: &Inspection) -> String {
    format!(
        concat!(
            "<section id=\"check\"><h2>Check it, make it again</h2>",
            "<p>In this folder. The job and the objects alone decide the root digest; threads, shards, paths and clock ",
            "do not enter it.</p><pre><code>",
            "graspmill verify .                          # every byte against its digest\n",
            "graspmill verify . --regenerate 64 --seed 1 # makes 64 random samples again and compares them\n",
            "graspmill run job.toml --out ../again       # makes all of it again\n",
            "graspmill digest ../again                   # {}\n",
            "graspmill export . --to npy --out ../arrays # arrays for numpy</code></pre>",
            "<p class=\"quiet\">Made by {}, format {}. Job <code>{}</code>.{}</p></section>"
        ),
        facts.root,
        escaped(&facts.generator),
        facts.format_version,
        facts.job,
        facts.classes.iter().fold(String::new(), |mut text, (class, digest)| {
            let _ = write!(text, " Class {}: <code>{}</code>.", class.name(), digest.short());
            text
        }),
    )
}

/// What the channels mean: axes, frames, units.
pub(super) fn sample_in_words(facts: &Inspection) -> String {
    let n = facts.setup.map_or(40, |setup| setup.resolution);
    let anchor = [0.5, 0.5, 0.45].map(|share| short(share * f64::from(n))).join(", ");
    let mut html = String::from("<section id=\"meaning\"><h2>What a sample is</h2><div class=\"meaning\">");
    html.push_str(&axes_diagram(n));
    let _ = write!(
        html,
        concat!(
            "<div><p>Everything stands in the camera's axes: x to the right, y down, z away from the camera, metres. ",
            "The grid has {0} cells along each axis. Its cell size r is the longest side of the seen points' box over {1}; ",
            "the centre c of that box lies at grid coordinate ({2}), so that the unseen back has more room.</p>",
            "<p><code>cell = floor((point - c) / r + ({2}))</code></p><p>c, r, the camera and all poses stand in every ",
            "sample. In memory x is the slowest axis, z the fastest.</p><ul class=\"legend\">"
        ),
        n,
        short(0.8 * f64::from(n)),
        anchor,
    );
    let colours = SLICE_COLOURS;
    let has = |name: &str| facts.channels.iter().any(|channel| channel == name);
    let (stored, touched) = (has("visibility"), facts.touch.is_some());
    for (colour, name) in [
        (Some(colours.partial), "partial: seen by the camera"),
        (Some(colours.complete), "complete: solid, not seen"),
        (touched.then_some(Colour::TOUCHED), "touched (in the pictures from behind)"),
        (stored.then_some(colours.free), "seen to be free"),
        (Some(colours.unseen), if stored { "not solid, not seen" } else { "not solid (what is free is not stored)" }),
        (Some(colours.wrong), "seen outside the solid (an error in standard data)"),
    ] {
        let Some(colour) = colour else { continue };
        let _ = write!(html, "<li><span class=\"swatch\" style=\"background:{}\"></span>{name}</li>", colour.hex());
    }
    html.push_str("</ul></div></div>");
    html.push_str("<table><thead><tr><th>channel</th><th>shape</th><th>meaning</th></tr></thead><tbody>");
    for channel in &facts.channels {
        for (name, shape, meaning) in channel_rows(channel, n) {
            let _ = write!(html, "<tr><td>{name}</td><td>{shape}</td><td>{meaning}</td></tr>");
        }
    }
    html.push_str("</tbody></table></section>");
    html
}

fn channel_rows(channel: &str, n: u32) -> Vec<(&'static str, String, &'static str)> {
    let grid = |kind: &str| format!("({n}, {n}, {n}) {kind}");
    match channel {
        "pair" => vec![
            ("partial", grid("bits"), "cells that hold a point the camera saw"),
            ("complete", grid("bits"), "cells of the solid object, same grid, same pose"),
        ],
        "visibility" => {
            vec![("free", grid("bits"), "cells that the camera sees to be free; what is neither is unseen")]
        }
        "depth" => {
            vec![(
                "depth",
                "(height, width)".to_owned(),
                "depth along the optical axis [m], no return = NaN; crop of the image",
            )]
        }
        "cloud" => vec![("cloud", "(n, 3) f32".to_owned(), "the seen points [m]")],
        "tsdf" => vec![("tsdf", grid("i16"), "signed distance to the seen surface, cut off, positive in front")],
        "coverage" => vec![("coverage", grid("u8"), "share of each cell that is solid, times 255")],
        "implicit" => {
            vec![("implicit", "points, normals, distances".to_owned(), "samples of the surface and of space [m]")]
        }
        "touch_rays" => vec![
            (
                "contacts",
                "(contacts, ...)".to_owned(),
                "where rays from behind met the object: point [m], outward normal, distance [m], which ray, seen or not",
            ),
            ("tactile", grid("bits"), "cells that hold a contact, same grid"),
        ],
        "touch_exploration" => vec![
            (
                "contacts",
                "(contacts, ...)".to_owned(),
                "where a hand that felt its way over the hidden side touched: point [m], outward normal, which approach, seen or not; link, force [N], gap [m]",
            ),
            (
                "approaches",
                "(approaches, ...)".to_owned(),
                "where each ended: pose of the hand, joint values, why it ended",
            ),
        ],
        "touch_grasp" => vec![
            ("contacts", "(contacts, ...)".to_owned(), "where a hand that took hold once touched; as of exploration"),
            ("approaches", "(1, ...)".to_owned(), "where it ended: pose of the hand, joint values, why it ended"),
        ],
        _ => Vec::new(),
    }
}

/// The camera from behind, its axes and the grid in front of it, in oblique projection: z goes up to the right.
fn axes_diagram(n: u32) -> String {
    format!(
        concat!(
            r#"<svg class="chart axes" viewBox="0 0 400 235" role="img" aria-label="camera axes and grid">"#,
            r#"<path class="grid" d="M82 150L222 62M82 150L222 152M82 150L312 152M82 150L346 40"/>"#,
            r#"<path class="cube faint" d="M256 42v90h90 M256 132l-34 20"/>"#,
            r#"<circle class="ink-complete" cx="285" cy="97" r="31"/>"#,
            r#"<path class="ink-partial" d="M301 124A31 31 0 0 1 262 76A46 46 0 0 0 301 124z"/>"#,
            r#"<path class="cube" d="M222 62h90v90h-90zM222 62l34-20h90l-34 20M346 42v90l-34 20"/>"#,
            r#"<path class="camera" d="M42 136h44v32h-44zM42 136l12-7h44l-12 7M98 129v32l-12 7"/>"#,
            r#"<path class="mark" d="M82 150h84m-7-4l7 4-7 4M82 150v62m-4-7l4 7 4-7M82 150l58-34m-8 .5l8-.5-4 7"/>"#,
            r#"<text x="170" y="164">x, right</text><text x="90" y="212">y, down</text>"#,
            r#"<text x="98" y="104">z, away: depth [m]</text><text x="20" y="186">camera</text>"#,
            r#"<text x="222" y="172">{0} x {0} x {0} cells</text>"#,
            r#"<text class="quiet" x="222" y="188">blue: seen, orange: hidden</text></svg>"#
        ),
        n
    )
}

/// Histograms and rejects.
pub(super) fn distributions(survey: &Survey) -> String {
    let facts = &survey.facts;
    let mut html = String::from("<section id=\"distributions\"><h2>Distributions</h2>");
    if facts.kept == 0 {
        html.push_str("<p>No sample was kept.</p>");
    } else {
        html.push_str("<div class=\"charts\">");
        let cells = [
            (&survey.partial, &facts.partial_cells, Ink::Partial, "Partial: occupied cells"),
            (&survey.complete, &facts.complete_cells, Ink::Complete, "Complete: occupied cells"),
        ];
        for (tally, spread, ink, title) in cells {
            html.push_str(&chart(title, &cell_histogram(tally, spread, ink, title).svg()));
        }
        let ratio = ratio_histogram(&survey.ratio, "Partial cells over complete cells", facts.seen_ratio.max);
        html.push_str(&chart("How much of the shape's cells the camera saw", &ratio.svg()));
        html.push_str(&chart(
            &format!(
                "Share of the solid inside the grid ({} of the kept samples have less than 99 %)",
                percent(facts.cut_off as f64 / facts.kept as f64)
            ),
            &bar_chart("share of the solid inside the grid", &solid_bars(&survey.solid)),
        ));
        html.push_str("</div>");
        html.push_str(&spreads(facts));
    }
    if let Some(touch) = &facts.touch {
        let _ = write!(html, "<h3>Touch</h3><pre><code>{}</code></pre>", escaped(touch.to_string().trim_start()));
    }
    html.push_str("<h3>Rejected samples</h3>");
    if facts.rejected.is_empty() {
        html.push_str("<p>None.</p>");
    } else {
        let bar =
            |(reason, count): (&String, &u64)| Bar { label: reason.replace('_', " "), value: *count, ink: Ink::Reject };
        let bars: Vec<Bar> = facts.rejected.iter().map(bar).collect();
        html.push_str("<div class=\"charts\">");
        html.push_str(&chart("Rejects by reason", &bar_chart("rejects by reason", &bars)));
        html.push_str("</div>");
    }
    let mut bars: Vec<&ObjectFacts> = facts.objects.iter().collect();
    bars.sort_by_key(|object| (object.kept, object.planned));
    let bars: Vec<Column> = bars
        .into_iter()
        .map(|object| Column { name: object.name.clone(), kept: object.kept, rejected: object.planned - object.kept })
        .collect();
    html.push_str("<h3>Kept views of each object</h3><figure>");
    html.push_str(&columns("kept views of each object", "objects, fewest kept views first", "views", &bars));
    html.push_str("<figcaption class=\"quiet\">blue: kept, pink: rejected; point at a column for its name</figcaption></figure></section>");
    html
}

fn chart(caption: &str, svg: &str) -> String {
    format!("<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption))
}

fn cell_histogram(tally: &Tally, spread: &Spread, ink: Ink, title: &str) -> Histogram {
    let width = round_step(((spread.max - spread.min) / 40.0).max(1.0));
    let start = (spread.min / width).floor() * width;
    let bins = (((spread.max - start) / width).floor() as usize + 1).min(64);
    Histogram {
        title: title.to_owned(),
        x_label: "occupied cells".to_owned(),
        y_label: "samples".to_owned(),
        start,
        width,
        counts: tally.bins(start, width, bins),
        y_end: None,
        ink,
        mark: Some((spread.median, "median".to_owned())),
    }
}

fn ratio_histogram(tally: &Tally, title: &str, end: f64) -> Histogram {
    let spread = tally.spread();
    let width = round_step((end / 40.0).max(0.001));
    Histogram {
        title: title.to_owned(),
        x_label: "partial cells / complete cells".to_owned(),
        y_label: "samples".to_owned(),
        start: 0.0,
        width,
        counts: tally.bins(0.0, width, (end / width).floor() as usize + 1),
        y_end: None,
        ink: Ink::Neutral,
        mark: Some((spread.median, "median".to_owned())),
    }
}

fn solid_bars(tally: &Tally) -> Vec<Bar> {
    [
        ("all of it", 1.0, 2.0),
        ("99 % to 100 %", 0.99, 1.0),
        ("95 % to 99 %", 0.95, 0.99),
        ("90 % to 95 %", 0.9, 0.95),
        ("75 % to 90 %", 0.75, 0.9),
        ("less than 75 %", 0.0, 0.75),
    ]
    .into_iter()
    .map(|(label, low, high)| Bar {
        label: label.to_owned(),
        value: tally.count_between(low, high),
        ink: if low >= 0.99 { Ink::Neutral } else { Ink::Reject },
    })
    .collect()
}

fn spreads(facts: &Inspection) -> String {
    let mut html = String::from(concat!(
        "<table class=\"figures\"><thead><tr><th>kept samples</th><th>min</th><th>5 %</th><th>median</th><th>95 %</th>",
        "<th>max</th><th>mean</th></tr></thead><tbody>"
    ));
    for (name, spread, digits) in [
        ("partial cells", &facts.partial_cells, 0),
        ("complete cells", &facts.complete_cells, 0),
        ("partial / complete", &facts.seen_ratio, 3),
        ("share of the solid inside the grid", &facts.solid_share, 3),
    ] {
        let Spread { min, p05, median, p95, max, mean } = spread;
        let _ = write!(html, "<tr><td>{name}</td>");
        for value in [min, p05, median, p95, max, mean] {
            let _ = write!(html, "<td>{value:.digits$}</td>");
        }
        html.push_str("</tr>");
    }
    html.push_str("</tbody></table>");
    html
}

/// Who trains and who tests, and what leaks between them.
pub(super) fn splits(survey: &Survey) -> String {
    let facts = &survey.facts;
    let mut html = String::from(concat!(
        "<section id=\"splits\"><h2>Splits</h2><table class=\"figures\"><thead><tr><th>split</th><th>samples</th><th></th>",
        "<th>objects</th><th>median partial / complete</th></tr></thead><tbody>"
    ));
    for row in &facts.splits {
        let share = row.samples as f64 / facts.kept.max(1) as f64;
        let _ = write!(
            html,
            "<tr><td>{}</td><td>{}</td><td><span class=\"share\"><span style=\"width:{:.1}%\"></span></span> {}</td><td>{}</td><td>{:.3}</td></tr>",
            row.split.name().replace('_', " "),
            grouped(row.samples),
            share * 100.0,
            percent(share),
            row.objects,
            row.seen_ratio.median,
        );
    }
    html.push_str("</tbody></table><div class=\"charts small\">");
    for (split, tally) in &survey.ratio_of_split {
        let name = split.name().replace('_', " ");
        html.push_str(&chart(&name, &ratio_histogram(tally, &name, facts.seen_ratio.max).svg()));
    }
    html.push_str("</div>");
    if !facts.training_subsets.is_empty() {
        let sizes: Vec<String> = facts.training_subsets.iter().map(u32::to_string).collect();
        let _ = write!(html, "<p>Nested training subsets of {} models.</p>", sizes.join(", "));
    }
    html.push_str("<h3>Leaks</h3><ul>");
    if facts.leaking_geometry.is_empty() {
        html.push_str("<li>No two objects of equal content or equal geometry stand on different sides.</li>");
    }
    for names in &facts.leaking_geometry {
        let _ =
            write!(html, "<li class=\"alarm\">Equal geometry on different sides: {}</li>", escaped(&names.join(", ")));
    }
    for (what, count) in &facts.notes.leaks {
        let alarm = if what.contains("straddling") && *count > 0 { " class=\"alarm\"" } else { "" };
        let _ = write!(html, "<li{alarm}>{} {}</li>", grouped(*count), escaped(&what.replace('_', " ")));
    }
    html.push_str("</ul></section>");
    html
}

/// The asset table.
pub(super) fn objects(facts: &Inspection) -> String {
    let mut html = format!(
        concat!(
            "<section id=\"objects\"><h2>Objects</h2><div class=\"wide\"><table><thead><tr><th>object</th><th>triangles</th>",
            "<th>longest side</th><th>closed</th><th>kept of planned</th><th>mean partial cells</th><th>least inside grid</th>",
            "<th>split</th><th>licence</th><th>repairs and warnings</th></tr></thead><tbody>{}</tbody></table></div>"
        ),
        facts.objects.iter().map(object_row).collect::<String>(),
    );
    if !facts.refused.is_empty() {
        let _ = write!(html, "<h3>Refused meshes ({})</h3><ul>", facts.refused.len());
        for line in &facts.refused {
            let _ = write!(html, "<li>{}</li>", escaped(line));
        }
        html.push_str("</ul>");
    }
    let mut citations: Vec<&str> = facts.objects.iter().filter_map(|object| object.citation.as_deref()).collect();
    citations.sort_unstable();
    citations.dedup();
    if !citations.is_empty() {
        html.push_str("<h3>Please cite</h3><ul>");
        for citation in citations {
            let _ = write!(html, "<li>{}</li>", escaped(citation));
        }
        html.push_str("</ul>");
    }
    html.push_str("</section>");
    html
}

fn object_row(object: &ObjectFacts) -> String {
    let unknown = || "?".to_owned();
    let mut remarks: Vec<String> = object.repairs.iter().map(|repair| escaped(&format!("mended: {repair}"))).collect();
    remarks.extend(object.warnings.iter().map(|warning| format!("<span class=\"alarm\">{}</span>", escaped(warning))));
    remarks.extend(object.rejected.iter().map(|(reason, count)| {
        format!("<span class=\"quiet\">{} rejected: {}</span>", grouped(*count), escaped(&reason.replace('_', " ")))
    }));
    format!(
        "<tr><td title=\"{}\">{}</td><td>{}</td><td>{}</td><td>{}</td><td>{} of {}</td><td>{:.0}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        object.object,
        escaped(&object.name),
        object.triangles.map_or_else(unknown, grouped),
        object.longest_side().map_or_else(unknown, |side| format!("{:.1} mm", side * 1e3)),
        object.watertight.map_or("?", |closed| if closed { "yes" } else { "no" }),
        grouped(object.kept),
        grouped(object.planned),
        object.mean_partial_cells,
        object.least_solid_share.map_or_else(unknown, percent),
        object.models.map_or_else(unknown, |split| split.name().replace('_', " ")),
        object.licence.as_deref().map_or_else(unknown, escaped),
        remarks.join("<br>"),
    )
}

/// How fast it was made.
pub(super) fn speed(facts: &Inspection) -> String {
    let mut html = String::from("<section id=\"speed\"><h2>Speed</h2>");
    match &facts.notes.speed {
        Some(speed) => {
            let _ = write!(
                html,
                "<p>{} samples in {:.1} s on {} threads: <strong>{} samples a second</strong>{}. Part of no digest.</p>",
                grouped(speed.samples),
                speed.seconds,
                speed.threads,
                grouped(speed.rate().round() as u64),
                speed.peak_memory.map_or_else(String::new, |bytes| format!(", peak memory {}", bytes_in_words(bytes))),
            );
        }
        None => html.push_str("<p>The run left no figures.</p>"),
    }
    html.push_str("</section>");
    html
}

/// The resolved job as it stands in the dataset.
pub(super) fn job(text: &str) -> String {
    format!(
        "<section id=\"job\"><h2>Job</h2><details><summary>The resolved job</summary><pre><code>{}</code></pre></details></section>",
        escaped(text)
    )
}
