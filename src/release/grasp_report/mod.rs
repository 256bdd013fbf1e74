//! The page of a dataset of grasps: counts, distributions, types, the course of the annealing, and pictures of grasps.

mod gallery;

pub(super) use gallery::pictures;

use std::fmt::Write as _;

use super::{
    GraspedObject, GraspsInspection, Spread, TableFacts,
    chart::{Bar, Histogram, Ink, bar_chart, grouped, percent, round_step},
    grasps::{GraspSurvey, grasp_counts_in_words},
    page::{bytes_in_words, escaped, numbers_and_warnings, shell, speed},
    replayed, sections, trials,
};
use crate::{
    dataset::{DatasetError, DatasetReader, GraspCounts},
    record::{GraspMethod, GraspVerdict, HandNames, STRETCHES},
};

/// Types that a page lists.
const TYPES: usize = 24;

/// The page, and how many objects it shows in pictures.
pub(super) fn page(reader: &DatasetReader, survey: &GraspSurvey) -> Result<(String, usize), DatasetError> {
    let facts = &survey.facts;
    let (pictures, shown) = gallery::gallery(reader, survey)?;
    let body = [
        header(survey),
        how_to_check(facts),
        meaning(survey),
        pictures,
        distributions(survey),
        table(facts),
        trials::section(facts.trials.as_ref(), &replayed::paragraph(reader.folder(), reader.manifest())?),
        if sampler(survey) == "annealing" { course(facts) } else { String::new() },
        types(facts),
        objects(facts),
        speed(facts.notes.speed.as_ref(), "runs"),
        sections::job(&reader.job_text()?),
    ];
    Ok((shell(&facts.name, &body.join("\n")), shown))
}

fn counts(facts: &GraspsInspection) -> GraspCounts {
    GraspCounts { verdicts: facts.verdicts.clone(), given_up: facts.given_up, trials: None }
}

fn header(survey: &GraspSurvey) -> String {
    let facts = &survey.facts;
    let counts = counts(facts);
    let hand = facts.hand.as_deref().unwrap_or("a hand");
    let mut html = format!(
        concat!(
            "<header><p class=\"over\">graspmill grasps</p><h1>{}</h1>",
            "<p class=\"lead\">{} grasps of {} by {}, {}, and {} states that are none, with the reason.</p>",
            "<p class=\"digest\"><span class=\"quiet\">root digest</span> <code>{}</code></p><dl class=\"numbers\">"
        ),
        escaped(&facts.name),
        grouped(counts.of_verdict(GraspVerdict::Kept)),
        if facts.objects.len() == 1 { "one object".to_owned() } else { format!("{} objects", facts.objects.len()) },
        escaped(hand),
        match sampler(survey) {
            "uniform" => "approached from all round",
            "antipodal" => "its pads on opposite sides",
            _ => "found by annealing",
        },
        grouped(counts.found() - counts.of_verdict(GraspVerdict::Kept)),
        facts.root,
    );
    let numbers = [
        ("runs", grouped(facts.runs)),
        ("given up", grouped(facts.given_up)),
        ("kept of found", percent(counts.of_verdict(GraspVerdict::Kept) as f64 / counts.found().max(1) as f64)),
        ("types", grouped(facts.types.len() as u64)),
        ("shards", format!("{} · {}", grouped(facts.shards), bytes_in_words(facts.shard_bytes))),
    ];
    html.push_str(&numbers_and_warnings(&numbers, &facts.warnings));
    html.push_str(concat!(
        "<nav><a href=\"#check\">Check</a> <a href=\"#meaning\">Meaning</a> <a href=\"#gallery\">Grasps</a> ",
        "<a href=\"#distributions\">Distributions</a> <a href=\"#table\">Table</a> <a href=\"#types\">Types</a> ",
        "<a href=\"#objects\">Objects</a> <a href=\"#speed\">Speed</a> <a href=\"#job\">Job</a></nav></header>"
    ));
    html
}

fn how_to_check(facts: &GraspsInspection) -> String {
    format!(
        concat!(
            "<section id=\"check\"><h2>Check it, make it again</h2>",
            "<p>In this folder. The job, the hand and the objects alone decide the root digest; threads, shards, paths and ",
            "clock do not enter it.</p><pre><code>",
            "graspmill verify .                         # every byte against its digest\n",
            "graspmill verify . --regenerate 8 --seed 1 # makes 8 random runs again and compares them\n",
            "graspmill run job.toml --out ../again      # makes all of it again\n",
            "graspmill digest ../again                  # {}</code></pre>",
            "<p class=\"quiet\">Made by {}, format {}. Job <code>{}</code>.</p></section>"
        ),
        facts.root,
        escaped(&facts.generator),
        facts.format_version,
        facts.job,
    )
}

/// How the states were come by.
fn sampler(survey: &GraspSurvey) -> &str {
    survey.method.as_ref().map_or("annealing", |(method, _)| &method.sampler)
}

fn meaning(survey: &GraspSurvey) -> String {
    let run = match sampler(survey) {
        "uniform" => {
            "A run comes with the opened hand from all round an axis of the object; no state is searched for. The states"
        }
        "antipodal" => {
            "A run puts the pads on pairs of points whose line lies within the friction cones of both; no state is searched \
             for. The best states"
        }
        _ => {
            "A run of annealing begins at a seed on the object's surface and searches place, turn and posture of the hand. The \
             best states"
        }
    };
    let mut html = format!(
        concat!(
            "<section id=\"meaning\"><h2>What a grasp is</h2><p>{} that it came by are closed, joint by joint, until each ",
            "link touches or is at its limit. Energies are of the state before closing, lower is better; epsilon is of the contacts ",
            "after it: the largest disturbance, in any direction, that they resist with a unit of force.</p>"
        ),
        run
    );
    if let Some((method, hand)) = &survey.method {
        html.push_str(&method_in_words(method, hand));
    }
    html.push_str("<table><thead><tr><th>verdict</th><th>meaning</th></tr></thead><tbody>");
    for verdict in GraspVerdict::ALL {
        let _ = write!(html, "<tr><td>{}</td><td>{}</td></tr>", in_words(verdict), why(verdict));
    }
    html.push_str("</tbody></table></section>");
    html
}

fn method_in_words(method: &GraspMethod, hand: &HandNames) -> String {
    let GraspMethod { energy, energy_space, energy_friction, friction, edges, space, min_epsilon, .. } = method;
    let model = match method.contact_model.as_str() {
        "soft_finger" => format!("soft fingers, torsion {}", method.torsion),
        _ => "hard points".to_owned(),
    };
    format!(
        concat!(
            "<p>Hand: {} with {} joints, {} of them with motors. {}: {} (friction {}, epsilon in the space of {}). ",
            "Quality: {} with friction {} and cones of {} edges; kept: epsilon of at least {} in the space of {}.</p>"
        ),
        escaped(&hand.name),
        hand.joints.len(),
        hand.driven.len(),
        if method.sampler == "annealing" { "Minimised" } else { "Energy that states are rated by" },
        energy.replace('_', " "),
        energy_friction,
        space_in_words(energy_space),
        model,
        friction,
        edges,
        min_epsilon,
        space_in_words(space),
    )
}

fn space_in_words(space: &str) -> &'static str {
    if space == crate::record::FORCE { "forces" } else { "forces and torques" }
}

fn in_words(verdict: GraspVerdict) -> String {
    verdict.name().replace('_', " ")
}

fn why(verdict: GraspVerdict) -> &'static str {
    match verdict {
        GraspVerdict::Kept => "the contacts resist every disturbance, well enough",
        GraspVerdict::Penetrates => "the hand is in the true mesh before it closes",
        GraspVerdict::OpenHand => "the closed hand touches with one link or none",
        GraspVerdict::NoForceClosure => "some disturbance meets no resistance",
        GraspVerdict::LowQuality => "every disturbance is resisted, but some hardly",
        GraspVerdict::BelowTable => "on a table the hand would come below it, however the object rests",
    }
}

fn figure(svg: &str, caption: &str) -> String {
    format!("<figure>{svg}<figcaption>{}</figcaption></figure>", escaped(caption))
}

fn distributions(survey: &GraspSurvey) -> String {
    let facts = &survey.facts;
    let counts = counts(facts);
    let bars: Vec<Bar> = (GraspVerdict::ALL.iter())
        .map(|verdict| Bar {
            label: in_words(*verdict),
            value: counts.of_verdict(*verdict),
            ink: if *verdict == GraspVerdict::Kept { Ink::Partial } else { Ink::Reject },
        })
        .collect();
    let energy = histogram(&survey.energies, &facts.energy, "Energy of all states", "energy", Ink::Neutral);
    let mut charts = figure(&bar_chart("states by verdict", &bars), "States that were closed, by verdict");
    charts.push_str(&figure(&energy.svg(), "Energy of all states, before closing"));
    if !survey.epsilons.is_empty() {
        let epsilon = histogram(&survey.epsilons, &facts.epsilon, "Epsilon of kept grasps", "epsilon", Ink::Partial);
        charts.push_str(&figure(&epsilon.svg(), "Epsilon of the kept grasps, in the space that the job asks for"));
    }
    format!(
        concat!(
            "<section id=\"distributions\"><h2>Distributions</h2><p>{}.</p>",
            "<div class=\"charts\">{}</div></section>"
        ),
        grasp_counts_in_words(&counts),
        charts,
    )
}

/// From the least value to where 95 of a hundred lie, and half as far again.
pub(super) fn histogram(values: &[f64], spread: &Spread, title: &str, x_label: &str, ink: Ink) -> Histogram {
    let end = spread.max.min(spread.p95 + 0.5 * (spread.p95 - spread.min));
    let width = round_step(((end - spread.min) / 40.0).max(1e-6));
    let start = (spread.min / width).floor() * width;
    let bins = (((end - start) / width).floor() as usize + 1).min(64);
    let mut counts = vec![0; bins];
    for value in values {
        if let Some(count) = counts.get_mut(((value - start) / width).max(0.0) as usize) {
            *count += 1;
        }
    }
    Histogram {
        title: title.to_owned(),
        x_label: x_label.to_owned(),
        y_label: "grasps".to_owned(),
        start,
        width,
        counts,
        y_end: None,
        ink,
        mark: Some((spread.median, "median".to_owned())),
    }
}

/// What can be done on a table.
fn table(facts: &GraspsInspection) -> String {
    let TableFacts { grasps, somewhere, likely, opened } = facts.table;
    let row = |what: &str, count: u64| {
        let share = percent(count as f64 / grasps.max(1) as f64);
        format!("<tr><td>{what}</td><td>{}</td><td>{share}</td></tr>", grouped(count))
    };
    format!(
        concat!(
            "<section id=\"table\"><h2>On a table</h2><p>Each object rests on a table in a few poses, as likely as random drops ",
            "end in them. For each of them a grasp says how far the hand stays above the table while it comes over 10 cm along its ",
            "approach, takes hold and closes.</p><table class=\"figures\"><thead><tr><th>the hand stays above the table</th>",
            "<th>kept grasps</th><th></th></tr></thead><tbody>{}{}{}</tbody></table></section>"
        ),
        row("in some pose of the object, coming in the posture of the grasp", somewhere),
        row("in some pose of the object, coming opened", opened),
        row("in its most likely pose, coming in the posture of the grasp", likely),
    )
}

/// How the search cooled down.
fn course(facts: &GraspsInspection) -> String {
    let mut html = String::from(concat!(
        "<section id=\"course\"><h2>Course of the annealing</h2><p>Means over all runs, by tenths of their steps: a search that ",
        "is well set accepts much at first and little in the end.</p><table class=\"figures\"><thead><tr><th>steps</th>",
        "<th>accepted</th><th></th><th>mean energy</th></tr></thead><tbody>"
    ));
    for place in 0..STRETCHES {
        let (from, to) = (place * 100 / STRETCHES, (place + 1) * 100 / STRETCHES);
        let share = facts.acceptance[place];
        let energy = facts.course[place].map_or_else(|| "-".to_owned(), |energy| format!("{energy:.3}"));
        let _ = write!(
            html,
            concat!(
                "<tr><td>{} to {} %</td><td>{}</td><td><span class=\"share\"><span style=\"width:{:.1}%\"></span></span></td>",
                "<td>{}</td></tr>"
            ),
            from,
            to,
            percent(share),
            share * 100.0,
            energy,
        );
    }
    html.push_str("</tbody></table></section>");
    html
}

fn types(facts: &GraspsInspection) -> String {
    if facts.types.is_empty() {
        return "<section id=\"types\"><h2>Types</h2><p>No kept grasp has a type.</p></section>".to_owned();
    }
    let all: u64 = facts.types.iter().map(|row| row.grasps).sum();
    let mut html = format!(
        concat!(
            "<section id=\"types\"><h2>Types</h2><p>{} types among {} kept grasps. A type is eight digits from 0 to 4, each a ",
            "closed joint's place in its range: the spread, the proximal and the distal joints of fingers 1, 2 and 3, and the ",
            "roll of the wrist.</p><table class=\"figures\"><thead><tr><th>type</th><th>grasps</th><th></th><th>spread</th>",
            "<th>proximal</th><th>distal</th><th>roll</th>{}</tr></thead><tbody>"
        ),
        grouped(facts.types.len() as u64),
        grouped(all),
        if facts.trials.is_some() { "<th>held</th>" } else { "" },
    );
    for row in facts.types.iter().take(TYPES) {
        let [spread, a, b, c, d, e, f, roll] = row.digits;
        let _ = write!(
            html,
            concat!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{} {} {}</td><td>{} {} {}</td><td>{}</td>{}</tr>"
            ),
            row.kind,
            grouped(row.grasps),
            percent(row.grasps as f64 / all as f64),
            spread,
            a,
            b,
            c,
            d,
            e,
            f,
            roll,
            held_cell(facts, row.held, row.grasps),
        );
    }
    html.push_str("</tbody></table></section>");
    html
}

/// How many of the tried held; nothing without trials.
fn held_cell(facts: &GraspsInspection, held: u64, tried: u64) -> String {
    match facts.trials {
        Some(_) if tried > 0 => format!("<td>{} ({})</td>", grouped(held), percent(held as f64 / tried as f64)),
        Some(_) => "<td>-</td>".to_owned(),
        None => String::new(),
    }
}

fn objects(facts: &GraspsInspection) -> String {
    let mut html = String::from(concat!(
        "<section id=\"objects\"><h2>Objects</h2><div class=\"wide\"><table class=\"figures\"><thead><tr><th>object</th>",
        "<th>runs</th><th>given up</th><th>found</th>"
    ));
    for verdict in GraspVerdict::ALL {
        let _ = write!(html, "<th>{}</th>", in_words(verdict));
    }
    if facts.trials.is_some() {
        html.push_str("<th>held</th>");
    }
    html.push_str(concat!(
        "<th>resting poses</th><th>likeliest</th><th>on a table</th><th>in the likeliest pose</th>",
        "<th>best energy</th><th>best epsilon</th></tr></thead><tbody>"
    ));
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.4}"));
    for object in &facts.objects {
        let GraspedObject { name, object: id, runs, given_up, verdicts, trials, resting, likely, table, .. } = object;
        let counts: String = verdicts.iter().map(|count| format!("<td>{}</td>", grouped(*count))).collect();
        let held = held_cell(facts, trials[1], trials[0]);
        let _ = write!(
            html,
            concat!(
                "<tr><td title=\"{}\">{}</td><td>{}</td><td>{}</td><td>{}</td>{}{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                "<td>{}</td><td>{}</td></tr>"
            ),
            id,
            escaped(name),
            grouped(*runs),
            grouped(*given_up),
            grouped(object.found()),
            counts,
            held,
            resting,
            likely.map_or_else(|| "-".to_owned(), percent),
            grouped(table.somewhere),
            grouped(table.likely),
            number(object.best_energy),
            number(object.best_epsilon),
        );
    }
    html.push_str("</tbody></table></div></section>");
    html
}
