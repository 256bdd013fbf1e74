//! The page of a dataset of patches: which types were chosen, what was left out, and sheets of patches.

mod sheets;

pub(super) use sheets::picture_of;

use std::fmt::Write as _;

use super::{
    ChosenType, LookedAtObject, PatchesInspection,
    chart::{Ink, grouped, percent},
    grasp_report::histogram,
    page::{bytes_in_words, escaped, numbers_and_warnings, shell},
    patches::PatchSurvey,
    sections,
};
use crate::dataset::{DatasetError, DatasetReader};

/// The page, and how many grasps it shows in pictures.
pub(super) fn page(reader: &DatasetReader, survey: &PatchSurvey) -> Result<(String, usize), DatasetError> {
    let facts = &survey.facts;
    let (pictures, shown) = sheets::sheets(reader, survey)?;
    let body = [
        header(facts),
        how_to_check(facts),
        types(facts),
        pictures,
        distribution(survey),
        rejects(facts),
        objects(facts),
        sections::job(&reader.job_text()?),
    ];
    Ok((shell(&facts.name, &body.join("\n")), shown))
}

fn header(facts: &PatchesInspection) -> String {
    let mut html = format!(
        concat!(
            "<header><p class=\"over\">graspmill patches</p><h1>{}</h1>",
            "<p class=\"lead\">What a camera sees around the palm and the fingertips of {} grasps of {} objects.</p>",
            "<p class=\"digest\"><span class=\"quiet\">root digest</span> <code>{}</code></p><dl class=\"numbers\">"
        ),
        escaped(&facts.name),
        grouped(facts.kept),
        grouped(facts.objects.iter().filter(|object| object.kept > 0).count() as u64),
        facts.root,
    );
    let share = facts.samples as f64 / facts.kept_grasps.max(1) as f64;
    let numbers = [
        ("kept grasps", grouped(facts.kept_grasps)),
        ("of the chosen types", format!("{} · {}", grouped(facts.samples), percent(share))),
        ("rejected", grouped(facts.samples - facts.kept)),
        ("patches", grouped(4 * facts.kept)),
        ("shards", format!("{} · {}", grouped(facts.shards), bytes_in_words(facts.shard_bytes))),
    ];
    html.push_str(&numbers_and_warnings(&numbers, &facts.warnings));
    html.push_str(concat!(
        "<nav><a href=\"#check\">Check</a> <a href=\"#types\">Types</a> <a href=\"#gallery\">Patches</a> ",
        "<a href=\"#distributions\">Distribution</a> <a href=\"#rejects\">Rejects</a> <a href=\"#objects\">Objects</a> ",
        "<a href=\"#job\">Job</a></nav></header>"
    ));
    html
}

fn how_to_check(facts: &PatchesInspection) -> String {
    let grasps = facts.grasps.map_or_else(String::new, |root| {
        format!("<p>The grasps are those of the dataset whose exact numbers have the root <code>{root}</code>.</p>")
    });
    format!(
        concat!(
            "<section id=\"check\"><h2>Check it, make it again</h2>",
            "<p>In this folder. The job, its grasps and the hand alone decide the root digest; threads, shards, paths and clock do ",
            "not enter it.</p><pre><code>",
            "graspmill verify .                         # every byte against its digest\n",
            "graspmill verify . --regenerate 8 --seed 1 # looks at 8 random grasps again and compares\n",
            "graspmill run job.toml --out ../again      # makes all of it again\n",
            "graspmill digest ../again                  # {}</code></pre>{}",
            "<p class=\"quiet\">Made by {}, format {}. Job <code>{}</code>.</p></section>"
        ),
        facts.root,
        grasps,
        escaped(&facts.generator),
        facts.format_version,
        facts.job,
    )
}

fn distribution(survey: &PatchSurvey) -> String {
    if survey.epsilons.is_empty() {
        return String::new();
    }
    let spread = &survey.facts.epsilon;
    let chart = histogram(&survey.epsilons, spread, "Epsilon of the stored grasps", "epsilon", Ink::Partial);
    format!(
        concat!(
            "<section id=\"distributions\"><h2>Distribution</h2><div class=\"charts\"><figure>{}<figcaption>Epsilon of the ",
            "stored grasps</figcaption></figure></div></section>"
        ),
        chart.svg(),
    )
}

fn objects(facts: &PatchesInspection) -> String {
    let mut html = String::from(concat!(
        "<section id=\"objects\"><h2>Objects</h2><div class=\"wide\"><table class=\"figures\"><thead><tr><th>object</th>",
        "<th>grasps of the chosen types</th><th>stored</th></tr></thead><tbody>"
    ));
    for LookedAtObject { name, object, samples, kept } in &facts.objects {
        let [samples, kept] = [*samples, *kept].map(grouped);
        let _ = write!(html, "<tr><td title=\"{object}\">{}</td><td>{samples}</td><td>{kept}</td></tr>", escaped(name));
    }
    html.push_str("</tbody></table></div></section>");
    html
}

fn types(facts: &PatchesInspection) -> String {
    let mut html = format!(
        concat!(
            "<section id=\"types\"><h2>Types</h2><p>The {} most common of {} types among {} kept grasps. A type is eight digits ",
            "from 0 to 4, each a closed joint's place in its range: the spread, the proximal and the distal joints of fingers 1, ",
            "2 and 3, and the roll of the wrist. Coverage counts all types up to this one.</p>",
            "<table class=\"figures\"><thead><tr><th>place</th><th>type</th><th>grasps</th><th>share</th><th>coverage</th>",
            "<th>stored</th><th>spread</th><th>proximal</th><th>distal</th><th>roll</th></tr></thead><tbody>"
        ),
        facts.types.len(),
        grouped(facts.different_types),
        grouped(facts.kept_grasps),
    );
    let mut covered = 0;
    for (place, ChosenType { facts: row, kept }) in facts.types.iter().enumerate() {
        covered += row.grasps;
        let all = facts.kept_grasps.max(1) as f64;
        let [spread, a, b, c, d, e, f, roll] = row.digits;
        let _ = write!(
            html,
            concat!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{} {} {}</td>",
                "<td>{} {} {}</td><td>{}</td></tr>"
            ),
            place,
            row.kind,
            grouped(row.grasps),
            percent(row.grasps as f64 / all),
            percent(covered as f64 / all),
            grouped(*kept),
            spread,
            a,
            b,
            c,
            d,
            e,
            f,
            roll,
        );
    }
    html.push_str("</tbody></table></section>");
    html
}

fn rejects(facts: &PatchesInspection) -> String {
    let mut html = String::from("<section id=\"rejects\"><h2>Rejects</h2>");
    if facts.rejected.is_empty() {
        html.push_str("<p>None: every patch of every grasp lies inside the image.</p></section>");
        return html;
    }
    html.push_str(concat!(
        "<p>A grasp is left out when one of its four patches reaches out of the image.</p>",
        "<table class=\"figures\"><thead><tr><th>reason</th><th>grasps</th><th>share</th></tr></thead><tbody>"
    ));
    for (reason, count) in &facts.rejected {
        let share = percent(*count as f64 / facts.samples.max(1) as f64);
        let _ = write!(html, "<tr><td>{}</td><td>{}</td><td>{share}</td></tr>", escaped(reason), grouped(*count));
    }
    html.push_str("</tbody></table></section>");
    html
}
