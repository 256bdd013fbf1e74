//! Every verb on a dataset of every product: it does what it is for, or ends with 2, names the product that it was given and the
//! verbs that take it, and never advises to delete anything.

use std::path::{Path, PathBuf};

use graspmill::{
    files::Folder,
    format::{Product, Scene, VoxelPair},
    publish::export::FORMATS,
};

use super::heatmaps::{heatmaps_job, with_inputs};
use crate::support::{
    jobs::{ABOUT, NO_SPLIT, small_datasets},
    program::Program,
    workspace::Workspace,
};

/// Datasets of scenes and all datasets derived from them.
fn make_clutter(workspace: &Workspace) -> Vec<(&'static str, PathBuf)> {
    let amodal = "product = \"amodal\"\nseed = 3\n[views]\ndataset = \"views\"\n";
    let volumes = "product = \"volumes\"\nseed = 3\n[views]\ndataset = \"views\"\n[fusion]\nsize = 0.4\nresolution = 16\n\
                   views = [1, 2]\nper_scene = 1\n";
    let suction = "product = \"suction\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[suction]\nposes = 200\nfree = 3\n";
    let heatmaps = heatmaps_job("");
    for (name, job) in [("amodal", amodal), ("volumes", volumes), ("heatmaps", heatmaps.as_str()), ("suction", suction)]
    {
        workspace.make_dataset(name, job, &[]);
    }
    let names = ["scenes", "views", "amodal", "volumes", "picks", "heatmaps", "suction"];
    names.map(|name| (name, workspace.path(name))).to_vec()
}

/// A set of one small dataset.
fn make_set(workspace: &Workspace) -> PathBuf {
    let pairs = format!(
        "views = {{ even = 2 }}\nobjects = [{{ built_in = [\"box-01\"] }}]\n[gate]\nmin_partial_cells = 1\n{NO_SPLIT}"
    );
    workspace.write("pairs.toml", pairs);
    workspace
        .write("set.toml", "product = \"set\"\nname = \"one\"\n[[jobs]]\nname = \"pairs\"\njob = \"pairs.toml\"\n");
    workspace.run_job("set", "set").succeed();
    workspace.path("set")
}

/// A verb with its options; `{out}` is replaced by a new path, `{about}` by an about file.
struct Verb {
    words: Vec<String>,
    /// Options behind the folder.
    options: Vec<String>,
    /// Products that it takes; `None` for all.
    takes: Option<Vec<&'static str>>,
}

fn verbs() -> Vec<Verb> {
    let verb = |words: &str, options: &str, takes: Option<&[&'static str]>| Verb {
        words: words.split(' ').map(str::to_owned).collect(),
        options: options.split_whitespace().map(str::to_owned).collect(),
        takes: takes.map(<[_]>::to_vec),
    };
    let mut verbs = vec![
        verb("status", "", None),
        verb("inspect", "", None),
        verb("report", "--out {out}.html", None),
        verb("verify", "", None),
        verb("digest", "", None),
        verb("merge", "", None),
        verb("release", "--about {about} --out {out}", None),
        verb("complete", "--method hull --limit 1 --out {out}", Some(&["completion", "amodal"])),
        verb("evaluate completion", "--method hull --limit 1 --split training", Some(&["completion", "amodal"])),
        verb("query reach", "--pose 0.6,0.1,0.8,0,0.5,0.2", Some(&["reachability"])),
        verb("submit --retry --out", "", Some(&[])),
        verb("model check", "", Some(&[])),
        verb("segment", "--out {out}", Some(&[])),
        verb("run --out {out}", "", Some(&[])),
        verb("estimate", "", Some(&[])),
        verb("hand check", "", Some(&[])),
    ];
    for format in FORMATS {
        let takes: Vec<&'static str> = format.forms.iter().map(|form| form.product.name).collect();
        verbs.push(Verb {
            takes: Some(takes),
            ..verb("export", &format!("--to {} --out {{out}} --limit 1", format.name), None)
        });
    }
    verbs
}

#[test]
#[ignore = "slow: every verb on every product"]
fn every_verb_takes_a_dataset_or_names_the_product_and_its_verbs() {
    let workspace = with_inputs();
    let set = make_set(&workspace);
    let about = workspace.write("about.toml", ABOUT);
    let clutter = make_clutter(&workspace);
    let small = small_datasets().iter().map(|(name, folder)| (*name, folder.clone()));
    let datasets: Vec<(&str, PathBuf)> = small.chain(clutter).collect();
    let mut products: Vec<&str> = datasets.iter().map(|(name, _)| *name).collect();
    products.sort_unstable();
    let mut all: Vec<&str> = Product::all().map(|product| product.name).collect();
    all.sort_unstable();
    assert_eq!(products, all, "a dataset of each product");
    let mut outs = 0;
    let mut run = |verb: &Verb, folder: &Path| {
        outs += 1;
        let out = workspace.path(format!("out-{outs}")).display().to_string();
        let fill = |word: &String| word.replace("{out}", &out).replace("{about}", &about.display().to_string());
        let words: Vec<String> = verb.words.iter().map(fill).collect();
        Program::new(&words[0]).args(&words[1..]).arg(folder).args(verb.options.iter().map(fill)).finish()
    };
    let (mut taken, mut refused) = (0, 0);
    for verb in verbs() {
        let line = format!("{} {}", verb.words.join(" "), verb.options.join(" "));
        // The hand's path in the job of the picks has no target from this copy of them.
        let is_copied = |product: &str| verb.words[0] == "merge" && product == "picks";
        for (product, folder) in datasets.iter().filter(|(product, _)| !is_copied(product)) {
            let outcome = run(&verb, folder);
            let label = format!("{line} on {product}: {:?} {}", outcome.code, outcome.text());
            assert!(!outcome.text().contains("deleting this shard"), "{label}");
            if verb.takes.as_ref().is_none_or(|takes| takes.contains(product)) {
                // 3 if a sample has no mesh; if a dataset has no data of a format's kind, 2 with that reason.
                let is_fine = [Some(0), Some(3)].contains(&outcome.code);
                let is_unfit = verb.words[0] == "export" && outcome.code == Some(2);
                assert!(is_fine || is_unfit, "{label}");
                taken += usize::from(is_fine);
                continue;
            }
            refused += 1;
            assert_eq!(outcome.code, Some(2), "{label}");
            let is_of_datasets = ["complete", "evaluate", "query", "export"].contains(&verb.words[0].as_str());
            if is_of_datasets {
                assert!(outcome.stderr.contains(product), "{label}");
            }
            if ["complete", "evaluate", "query"].contains(&verb.words[0].as_str()) {
                // The verbs that are named take it.
                let said = &outcome.stderr;
                let (_, named) = said.split_once(&format!("for {product} use ")).unwrap_or_else(|| panic!("{label}"));
                let named: Vec<&str> = named.trim().split(", ").collect();
                assert!(named.contains(&"inspect") && named.contains(&"verify"), "{label}");
                let formats = named.iter().find_map(|verb| verb.strip_prefix("export --to "));
                for format in FORMATS {
                    let is_named = formats.is_some_and(|names| names.split('|').any(|name| name == format.name));
                    assert_eq!(is_named, format.forms.iter().any(|form| form.product.name == *product), "{label}");
                }
            }
        }
        // A folder without a dataset, one that is not there, and a set, are wrong arguments as well.
        let empty = workspace.make_folder("empty");
        let is_of_folders = !["run", "estimate", "hand", "segment"].contains(&verb.words[0].as_str());
        for folder in [empty, workspace.path("nowhere")] {
            let outcome = run(&verb, &folder);
            assert_eq!(outcome.code, Some(2), "{line} on {}: {}", folder.display(), outcome.text());
        }
        let takes_sets = ["status", "report", "verify", "digest"].contains(&verb.words[0].as_str());
        if is_of_folders && !takes_sets {
            let outcome = run(&verb, &set);
            assert_eq!(outcome.code, Some(2), "{line} on a set: {}", outcome.text());
        }
    }
    println!("{taken} taken, {refused} refused");
    assert!(taken > 80 && refused > 100, "{taken} taken, {refused} refused");
    // Two datasets of different products differ, and those of one are compared.
    let diff = |a: &Path, b: &Path| Program::new("diff").arg(a).arg(b).finish().code;
    for (product, folder) in &datasets {
        assert_eq!(diff(folder, folder), Some(0), "{product}");
        assert!([Some(2), Some(4)].contains(&diff(folder, &datasets[0].1)) || *product == "completion", "{product}");
        assert_eq!(diff(folder, &workspace.path("nowhere")), Some(2));
    }
}

/// The library's own error, for who reads a record of another product.
#[test]
fn a_record_of_another_product_is_an_error_that_names_both() {
    use graspmill::format::dataset::{DatasetReader, Selection};

    let (_, completion) = small_datasets().iter().find(|(name, _)| *name == "completion").expect("a dataset");
    let (_, grasps) = small_datasets().iter().find(|(name, _)| *name == "grasps").expect("a dataset");
    let first = |folder: &Path| {
        let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
        reader.iter(Selection::default()).next().expect("a sample").expect("readable")
    };
    let error = first(grasps).read::<VoxelPair>().expect_err("no pair");
    assert!(error.is_foreign(), "{error}");
    let words = error.to_string();
    assert!(words.contains("is of a dataset of grasps, whose samples have no pair"), "{words}");
    assert!(words.contains("give a dataset of completion or amodal"), "{words}");
    let words = first(completion).read::<Scene>().expect_err("no scene").to_string();
    assert!(words.contains("give a dataset of scenes"), "{words}");
}
