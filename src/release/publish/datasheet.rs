//! `DATASHEET.md`: what Gebru et al., "Datasheets for Datasets" (2021), ask of a dataset, by their seven sections; numbers
//! are measured, and what only the authors know is theirs.

use std::fmt::Write as _;

use super::{Release, licences, numbers::sample_in_words};
use crate::{
    dataset::NumberClass,
    ids::Product,
    release::{chart::grouped, page::bytes_in_words},
};

/// What stands where the authors say nothing.
const UNSAID: &str = "The authors do not say.";

/// The datasheet.
pub(super) fn datasheet(release: &Release) -> String {
    let mut text = format!(
        "# Datasheet: {} {}\n\nAfter T. Gebru et al., *Datasheets for Datasets*, Communications of the ACM 64(12), 2021. Numbers were \
         counted in the data; what stands behind a bar is in the authors' words.\n",
        release.about.title, release.about.version
    );
    for section in [motivation, composition, collection, preprocessing, uses, distribution, maintenance] {
        text.push_str(&section(release));
    }
    text
}

/// A question and its answer.
fn answer(text: &mut String, question: &str, answer: &str) {
    let _ = writeln!(text, "\n**{question}** {}", answer.trim());
}

/// A question that only the authors can answer.
fn ask(text: &mut String, question: &str, said: Option<&str>) {
    match said {
        Some(said) => _ = writeln!(text, "\n**{question}**\n\n> {}", said.trim().replace('\n', "\n> ")),
        None => answer(text, question, UNSAID),
    }
}

fn list(items: &[String]) -> Option<String> {
    (!items.is_empty()).then(|| items.iter().map(|item| format!("- {item}")).collect::<Vec<_>>().join("\n"))
}

fn motivation(release: &Release) -> String {
    let about = release.about;
    let mut text = String::from("\n## Motivation\n");
    ask(&mut text, "Why was it made?", Some(&about.description));
    answer(&mut text, "By whom?", &format!("{}.", about.spoken_authors()));
    ask(&mut text, "Who paid for it?", about.funding.as_deref());
    text
}

fn composition(release: &Release) -> String {
    let (manifest, numbers) = (release.manifest, release.numbers);
    let counts = &manifest.counts;
    let mut text = String::from("\n## Composition\n");
    answer(
        &mut text,
        "What is an instance?",
        &format!("{}. {}", capital(sample_in_words(manifest.product)), numbers.lead),
    );
    let rejected: u64 = counts.rejected.values().sum();
    let bytes = manifest.shards.iter().map(|shard| shard.bytes).sum();
    let count = format!(
        "{} {} were planned; {} are stored in {}, {} were rejected.",
        grouped(counts.samples),
        numbers.samples,
        grouped(counts.kept),
        bytes_in_words(bytes),
        grouped(rejected)
    );
    answer(&mut text, "How many are there?", &count);
    answer(
        &mut text,
        "Is it a sample of something larger?",
        "It holds all that its job plans: every subject with every view, seed or position that `job.toml` names. The subjects are \
         those of the asset table; they stand for no wider population by themselves.",
    );
    let channels: Vec<&str> = manifest.channels().into_iter().map(|channel| channel.name()).collect();
    answer(&mut text, "What data does each have?", &format!("The channels {}.", channels.join(", ")));
    let label = match manifest.product {
        Product::Completion => "Yes: the whole solid beside what was seen, computed from the mesh.",
        Product::Reachability => "Yes: for each pose whether it is reached, and how that is known.",
        Product::Grasps => {
            "Yes: quality and a verdict for each grasp; outcomes of physical trials where the job asks for them."
        }
        Product::Patches => "Yes: the type of the grasp and its quality, at each of four points.",
    };
    answer(&mut text, "Is there a label or target?", label);
    let missing = match counts.rejected.len() {
        0 => "Nothing: every planned one is stored.".to_owned(),
        _ => {
            let reasons: Vec<String> =
                counts.rejected.iter().map(|(reason, count)| format!("{} ({reason})", grouped(*count))).collect();
            format!("Rejected ones are not stored, by reason: {}. `rejects.jsonl` names each.", reasons.join(", "))
        }
    };
    answer(&mut text, "Is anything missing?", &missing);
    let splits = match numbers.splits.is_empty() {
        true => "No.".to_owned(),
        false => {
            let rows: Vec<String> = numbers
                .splits
                .iter()
                .map(|(split, samples, _)| format!("{} {}", split.name(), grouped(*samples)))
                .collect();
            format!("Yes, in stored ones: {}. `splits.json` says who stands where.", rows.join(", "))
        }
    };
    answer(&mut text, "Are there recommended splits?", &splits);
    let mut errors: Vec<String> = manifest.warnings.clone();
    errors.extend(numbers.leaks.iter().map(|names| format!("equal shapes on different sides of the split: {names}")));
    let errors = list(&errors).map_or_else(|| "None is known.".to_owned(), |errors| format!("Known:\n\n{errors}"));
    answer(&mut text, "Are there errors, noise or repetitions?", &errors);
    let whole = match release.outside.is_empty() {
        true => "To use it: yes. To make it again the assets are needed; they are named by digest.",
        false => {
            "To use it: yes. To make it again the assets are needed, and the descriptions that `job.toml` names by path."
        }
    };
    answer(&mut text, "Does it stand alone?", whole);
    answer(
        &mut text,
        "Does it hold anything about people, or anything confidential or offensive?",
        "It holds geometry and numbers of a simulation. Names of objects are those of the job; nothing else in it is text by people.",
    );
    text
}

fn collection(release: &Release) -> String {
    let manifest = release.manifest;
    let mut text = String::from("\n## Collection process\n");
    let how = match manifest.product {
        Product::Completion => {
            "Depth of each object was rendered or cast from its mesh, and grids were computed from depth and mesh."
        }
        Product::Reachability => {
            "For each pose inverse kinematics was solved or shown to have no solution, and collisions were checked."
        }
        Product::Grasps => {
            "Grasps were searched on the objects' meshes, the hand was closed in simulation, and quality computed."
        }
        Product::Patches => {
            "Grasps of another dataset were projected into rendered images of their objects, and patches cut out."
        }
    };
    answer(
        &mut text,
        "How was it acquired?",
        &format!("By simulation with {}: no sensor was used. {how}", manifest.generator),
    );
    let classes: Vec<&str> = manifest.classes.keys().map(|class| class.name()).collect();
    let promise = match manifest.classes.keys().max() {
        Some(NumberClass::Exact) | None => "the same bits on any x86-64 machine",
        Some(_) => "the same bits where library, processor level or graphics driver are those of the manifest",
    };
    answer(&mut text, "How exact is that?", &format!("Numbers are of class {}: {promise}.", classes.join(" and ")));
    answer(
        &mut text,
        "How were instances chosen?",
        "By the plan, a pure function of the job. All randomness follows from the job's seed, keyed by sample.",
    );
    answer(
        &mut text,
        "Who was involved, and over what time?",
        "No people were observed or employed. The data has no time of collection.",
    );
    text
}

fn preprocessing(release: &Release) -> String {
    let mut text = String::from("\n## Preprocessing, cleaning, labelling\n");
    answer(
        &mut text,
        "Was anything done to the raw data?",
        "Meshes were scaled to metres, equal corners merged, faces turned outward where that could be told. `assets.json` lists the \
         repairs of each. Labels were computed, none was given by hand.",
    );
    let refused = release.manifest.counts.refused_meshes;
    if refused > 0 {
        let words = format!("{} meshes could not be used; `assets.json` says which and why.", grouped(refused));
        answer(&mut text, "Was anything thrown away?", &words);
    }
    answer(
        &mut text,
        "Is the software there?",
        &format!(
            "{}; `job.toml` is the whole setting, `provenance.intoto.json` names what went in.",
            release.manifest.generator
        ),
    );
    text
}

fn uses(release: &Release) -> String {
    let about = release.about;
    let mut text = String::from("\n## Uses\n");
    ask(&mut text, "What is it meant for?", list(&about.intended_uses).as_deref());
    ask(&mut text, "What should it not be used for?", list(&about.out_of_scope_uses).as_deref());
    answer(
        &mut text,
        "What may surprise a user?",
        "It is simulated: what a model learns from it holds for real sensors, hands and objects only as far as the simulation does.",
    );
    text
}

fn distribution(release: &Release) -> String {
    let about = release.about;
    let mut text = String::from("\n## Distribution\n");
    let place = [about.url.clone(), about.doi.as_ref().map(|doi| format!("https://doi.org/{doi}"))];
    let place: Vec<String> = place.into_iter().flatten().collect();
    answer(&mut text, "Where is it?", &if place.is_empty() { UNSAID.to_owned() } else { place.join(", ") });
    answer(&mut text, "Since when?", &format!("{}, version {}.", about.date, about.version));
    let made_of: Vec<String> = licences::counts(release.assets)
        .into_iter()
        .map(|(licence, count)| format!("{count} under {licence}"))
        .collect();
    let licence = format!(
        "{}. Of the assets that it was made of, {}; `LICENCES.md` says which.",
        about.licence,
        made_of.join(", ")
    );
    answer(&mut text, "Under which licence?", &licence);
    let left_out = match release.left_out.len() {
        0 => "Nothing.".to_owned(),
        count => format!(
            "{} files, which may not be shipped; `recipe.json` says how to make them again.",
            grouped(count as u64)
        ),
    };
    answer(&mut text, "Is anything left out?", &left_out);
    answer(&mut text, "How is it known to be whole?", &format!("By its root digest `{}`.", release.manifest.root));
    text
}

fn maintenance(release: &Release) -> String {
    let about = release.about;
    let mut text = String::from("\n## Maintenance\n");
    ask(&mut text, "Who keeps it, and how are errors mended?", about.maintenance.as_deref());
    ask(&mut text, "Whom to ask?", about.contact.as_deref());
    answer(
        &mut text,
        "Can others extend it?",
        "Yes: add objects or channels to `job.toml` and run it. Samples that stay the same keep their bytes.",
    );
    text
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
