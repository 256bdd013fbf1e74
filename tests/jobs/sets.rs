//! Sets: several datasets of the same objects in one folder, made by one command.

use std::{fs, path::Path};

use graspmill::{
    files::Folder,
    format::dataset::{DatasetReader, Manifest, Selection, SetTable},
    geom::TriMesh,
    surface::write_ply,
};
use nalgebra::{Point3, Rotation3};

use crate::support::{
    files::{read_text, repository_path},
    jobs::SHORT_SEARCH,
    meshes::{built_in_mesh, tetrahedron_off},
    program::{Program, print_root},
    robots::GRIPPER,
    small_dataset::unseal,
    workspace::Workspace,
};

/// The quick set with short searches.
fn run(out: &Path) -> Program {
    Program::run_job("jobs/everything-quick.toml", out).set(SHORT_SEARCH.map(|setting| format!("grasps:{setting}")))
}

fn make(out: &Path, arguments: &[&str]) -> SetTable {
    run(out).args(arguments).succeed();
    SetTable::read(&Folder::at(out)).expect("readable").expect("a set")
}

#[test]
#[ignore = "slow: a set of datasets"]
fn one_command_makes_datasets_that_share_their_objects() {
    let workspace = Workspace::new();
    let out = workspace.path("all");
    let table = make(&out, &[]);
    let content = table.made.clone().expect("a finished set");
    let names: Vec<&str> = table.jobs.iter().map(|job| job.name.as_str()).collect();
    assert_eq!(names, ["completion", "touch", "grasps", "patches"]);
    assert_eq!(
        content.objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(),
        ["bottle-01", "box-01", "mug-01"]
    );
    assert!(content.differing.is_empty());
    // The ids are those of the samples themselves.
    for name in names {
        let reader = DatasetReader::open(&Folder::at(out.join(name))).expect("a dataset");
        assert_eq!(content.roots[name], reader.manifest().root);
        for object in &content.objects {
            let kept = reader.indices(Selection::default()).filter_map(|index| reader.id(index));
            let kept = kept.filter(|id| id.subject == object.object).count() as u64;
            assert_eq!(object.samples[name], kept, "{name}: {}", object.name);
        }
    }
    // Patches take their grasps from the neighbouring dataset, by a path that moves with the folder.
    let job = read_text(out.join("patches/job.toml"));
    assert!(job.contains("dataset = \"../grasps\"") && !job.contains("grasps.dataset"), "{job}");
    let moved = workspace.path("moved");
    fs::rename(&out, &moved).expect("a move");
    let verified = Program::on("verify", &moved).option("--regenerate", "2").succeed();
    assert_eq!(verified.stdout.matches("is intact").count(), 4);
    assert_eq!(print_root(&moved), content.root.hex());
    // Each dataset is the one that its job alone makes.
    let alone = workspace.path("alone");
    Program::run_job("jobs/grasps-quick.toml", &alone).set(SHORT_SEARCH).succeed();
    assert_eq!(Manifest::read(&Folder::at(&alone)).expect("a dataset").root, content.roots["grasps"]);
    assert_reports(&moved, &table);
    assert_resumes(&moved, &table);
    assert_finds_damage(&moved);
}

/// Without scenes the page of a set shows a picture of each dataset.
fn assert_reports(out: &Path, table: &SetTable) {
    Program::on("report", out).succeed();
    let page = read_text(out.join("report.html"));
    for name in table.jobs.iter().map(|job| &job.name) {
        assert!(page.contains(&format!("<a href=\"{name}/report.html\">")), "no link to {name}");
        assert!(page.contains(&format!("The first picture of {name}: ")), "no picture of {name}");
    }
    assert_eq!(page.matches("<figure>").count(), 4);
}

/// A run makes lost files again, keeps the others, and calls nothing whole before it is.
fn assert_resumes(out: &Path, whole: &SetTable) {
    fs::remove_dir_all(out.join("patches")).expect("a lost dataset");
    fs::remove_file(out.join("touch/manifest.json")).expect("a lost file");
    fs::remove_file(out.join("set.json")).expect("a lost file");
    assert_eq!(make(out, &[]), *whole);
    fs::remove_dir_all(out.join("patches")).expect("a lost dataset");
    let status = Program::on("status", out).finish().stdout;
    assert_eq!((status.matches(": complete").count(), status.matches(": not started").count()), (3, 1), "{status}");
    assert_eq!(make(out, &["--json"]), *whole);
    let status = Program::on("status", out).read_json();
    assert_eq!(status["datasets"]["patches"]["state"], "complete");
    assert_eq!(status["made"]["root"].as_str(), whole.made.as_ref().map(|made| made.root.hex()).as_deref());
}

/// A flipped byte anywhere, or other datasets under this name, mean 4; another set is refused.
fn assert_finds_damage(out: &Path) {
    run(out).set(["seed=9"]).expect_code(2);
    let other = out.with_file_name("other.toml");
    let job = repository_path("jobs/grasps-quick.toml");
    fs::write(&other, format!("product = \"set\"\n[[jobs]]\nname = \"grasps\"\njob = \"{}\"\n", job.display()))
        .expect("a set");
    let said = Program::run_job(&other, out).expect_code(2).stderr;
    assert!(said.contains("this is grasps (grasps)"), "{said}");
    let said = Program::on("inspect", out).finish().stderr;
    assert!(said.contains("give one of its datasets: completion, touch, grasps, patches"), "{said}");
    let set = read_text(out.join("set.json"));
    let lie = set.replacen("\"bottle-01\"", "\"bottle-02\"", 1);
    fs::write(out.join("set.json"), &lie).expect("a lie");
    let said = Program::on("verify", out).expect_code(4).stderr;
    assert!(said.contains("its seal has"), "{said}");
    fs::write(out.join("set.json"), unseal(&lie)).expect("a lie");
    let said = Program::on("verify", out).expect_code(4).stdout;
    assert!(said.contains("set.json does not match"), "{said}");
    // Reports are written into the folders that it names: none elsewhere.
    let elsewhere = set.replacen("\"name\": \"grasps\"", "\"name\": \"../grasps\"", 1);
    fs::write(out.join("set.json"), unseal(&elsewhere)).expect("a lie");
    let said = Program::on("report", out).expect_code(1).stderr;
    assert!(said.contains("'../grasps' is not the name of a dataset in it"), "{said}");
}

#[test]
fn one_name_for_two_objects_is_said() {
    let workspace = Workspace::new();
    let job = |name: &str, side: f64| {
        workspace.write(format!("{name}/tetra.off"), tetrahedron_off(side));
        let text = format!("views = {{ even = 4 }}\n[gate]\nmin_partial_cells = 1\n[[objects]]\nfolder = \"{name}\"\n");
        workspace.write(format!("{name}.toml"), text);
        format!("[[jobs]]\nname = \"{name}\"\njob = \"{name}.toml\"\n")
    };
    let set = format!("product = \"set\"\n{}{}", job("small", 0.1), job("large", 0.15));
    let (file, out) = (workspace.write("set.toml", set), workspace.path("out"));
    let said = Program::run_job(&file, &out).succeed().stdout;
    assert!(said.contains("`tetra` is not the same object"), "{said}");
    let content =
        SetTable::read(&Folder::at(&out)).expect("readable").and_then(|table| table.made).expect("a finished set");
    assert_eq!((content.objects.len(), content.differing.len()), (2, 1));
    // Only `run` takes a set.
    let said = Program::on("estimate", &file).expect_code(2).stderr;
    assert!(said.contains("which only `run` accepts"), "{said}");
}

/// Two jobs that divide their objects apart: one object trains in the one and tests in the other, and a bottle of the one is in
/// the other, larger, turned, and under another name.
#[test]
fn objects_on_both_sides_of_a_split_are_found_across_datasets() {
    let workspace = Workspace::new();
    let write = |name: &str, mesh: &TriMesh| workspace.write(format!("{name}.ply"), write_ply(mesh, &[]));
    let bottle = built_in_mesh("bottle-01@1k");
    let turn = Rotation3::from_euler_angles(0.3, -0.8, 1.1);
    let grown = |vertex: &[f32; 3]| (turn * Point3::from(*vertex).cast::<f64>() * 1.02).cast::<f32>().into();
    let flask = TriMesh { vertices: bottle.vertices.iter().map(grown).collect(), ..bottle.clone() };
    for (name, mesh) in [("flask", &flask), ("bottle", &bottle), ("can", &built_in_mesh("can-01@1k"))] {
        write(&format!("meshes/{name}"), mesh);
    }
    let job = |name: &str, objects: &[&str], split: &str| {
        let files: Vec<String> = objects.iter().map(|object| format!("\"{object}.ply\"")).collect();
        let text = format!(
            "product = \"grasps\"\n[hand]\nmodel = {:?}\n[grasps]\nseeds = 1\nsampler = \"antipodal\"\n\
             [antipodal]\npairs = 100\nbest = 1\n[split]\n{split}\n[[objects]]\nfolder = \"meshes\"\ninclude = [{}]\n",
            repository_path(GRIPPER),
            files.join(", ")
        );
        workspace.write(format!("{name}.toml"), text);
        format!("[[jobs]]\nname = \"{name}\"\njob = \"{name}.toml\"\n")
    };
    let (none, tests) =
        ("validation_objects = 0\ntest_objects = 0", "validation_objects = 0\ntest_objects = [\"flask\", \"can\"]");
    let made = |name: &str, jobs: [String; 2]| {
        let file = workspace.write(format!("{name}.toml"), format!("product = \"set\"\n{}{}", jobs[0], jobs[1]));
        let out = workspace.path(name);
        (Program::run_job(&file, &out).succeed().stdout, out)
    };
    let (said, out) = made("leaky", [job("first", &["bottle", "can"], none), job("second", &["can", "flask"], tests)]);
    let verified = Program::on("verify", &out).succeed().stdout;
    for said in [said, verified] {
        assert!(
            said.contains("can is in split training of first, and the same object in split test of second"),
            "{said}"
        );
        assert!(
            said.contains("bottle is in split training of first, and flask, which has the same shape, in split test"),
            "{said}"
        );
    }
    let leaks = Program::on("verify", &out).read_json()["leaks"].as_array().map_or(0, Vec::len);
    assert!(leaks >= 2, "{leaks}");
    let (said, _) = made("clean", [job("first", &["bottle", "can"], none), job("second", &["bottle", "can"], none)]);
    assert!(!said.contains("sees it twice"), "{said}");
}
