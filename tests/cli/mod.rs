//! The command line as a contract: verbs, exit codes, what is printed where, and that nothing is lost.

use std::{
    fs,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

use crate::support::{
    files::{flip_bit, list_shards, read_text, read_tree, repository_path},
    meshes::tetrahedron_off,
    program::{Program, print_root},
    workspace::Workspace,
};
use serde_json::Value;

const JOB: &str = r#"
name = "cli"
seed = 5
views = { even = 12 }

[[objects]]
built_in = ["can-01", "bowl-01"]

[shards]
samples = 8
"#;

/// A workspace with a finished dataset of [`JOB`].
fn make_data() -> (Workspace, PathBuf) {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("data", JOB, &[]);
    (workspace, data)
}

#[test]
fn a_dataset_goes_through_every_verb() {
    let (workspace, data) = make_data();
    let status = Program::on("status", &data).read_json();
    assert_eq!((status["state"].as_str(), status["shards_done"].as_u64()), (Some("complete"), Some(3)));
    let verified = Program::on("verify", &data).read_json();
    assert_eq!(verified["intact"], true);
    // 1 - 0.05^(1/2) of all, at most.
    let again = Program::on("verify", &data).option("--regenerate", "2").succeed().stdout;
    assert!(again.contains("0 of 2 samples made again differ: with 95 % confidence less than 77.7 %"), "{again}");
    Program::on("inspect", &data).read_json();
    assert_eq!(print_root(&data), verified["root"].as_str().expect("a root"));
    Program::on("report", &data).succeed();
    assert!(read_text(data.join("report.html")).starts_with("<!"));
    assert_eq!(Program::on("verify", &data).read_json()["intact"], true, "the report is no foreign file");
    for format in ["npy", "binvox", "pcd"] {
        Program::on("export", &data)
            .args(["--to", format, "--limit", "3"])
            .option("--out", workspace.path(format))
            .succeed();
    }
    assert_eq!(Program::on("estimate", workspace.path("data.toml")).read_json()["samples"], 24);
    Program::new("doctor").read_json();
    assert!(Program::new("schema").succeed().json::<Value>()["oneOf"][0]["properties"]["objects"].is_object());
}

#[test]
fn a_second_run_does_nothing_and_says_so() {
    let (workspace, data) = make_data();
    let again = Program::on("run", workspace.path("data.toml")).option("--out", &data).succeed().stdout;
    assert!(again.contains("nothing to do"), "{again}");
}

#[test]
fn wrong_arguments_and_jobs_mean_two() {
    let workspace = Workspace::new();
    Program::new("fly").expect_code(2);
    Program::run_job("nowhere.toml", workspace.path("x")).expect_code(2);
    workspace.write("bad.toml", "sede = 1\n[grid]\nresolution = 400\n[[objects]]\nbuilt_in = [\"cann-01\"]\n");
    let said = workspace.run_job("bad", "x").expect_code(2).stderr;
    for word in ["bad.toml:1", "seed", "resolution", "can-01", "3 errors"] {
        assert!(said.contains(word), "'{word}' is not in:\n{said}");
    }
    assert!(!workspace.path("x").exists(), "nothing is begun for a bad job");
}

#[test]
fn the_folder_of_another_job_is_left_alone() {
    let (workspace, data) = make_data();
    let before = print_root(&data);
    let said = workspace.run_job("data", "data").set(["seed=6"]).expect_code(2).stderr;
    assert!(said.contains("another --out"), "{said}");
    workspace.write("full/thesis.tex", "my only copy");
    workspace.run_job("data", "full").expect_code(2);
    assert_eq!(workspace.read("full/thesis.tex"), "my only copy");
    assert_eq!(print_root(&data), before);
}

#[test]
fn one_flipped_byte_is_found_and_mended_by_running_again() {
    let (workspace, data) = make_data();
    let root = print_root(&data);
    flip_bit(&list_shards(&data)[0]);
    let said = Program::on("verify", &data).expect_code(4).stdout;
    assert!(said.contains("completion-00000") && said.contains("2 of 3 shards intact"), "{said}");
    workspace.run_job("data", "data").succeed();
    Program::on("verify", &data).succeed();
    assert_eq!(print_root(&data), root);
}

#[test]
fn a_truncated_shard_is_found() {
    let (_workspace, data) = make_data();
    let shard = &list_shards(&data)[0];
    let bytes = fs::read(shard).expect("a shard");
    fs::write(shard, &bytes[..bytes.len() * 6 / 10]).expect("a truncated shard");
    Program::on("verify", &data).expect_code(4);
    let status = Program::on("status", &data).finish().stdout;
    assert!(status.contains("unfinished"), "{status}");
}

#[test]
fn refused_meshes_mean_three_and_the_others_are_made() {
    let workspace = Workspace::new();
    workspace.write("meshes with spaces ü/empty.stl", "");
    workspace.write("meshes with spaces ü/tetra.off", tetrahedron_off(0.1));
    workspace.write(
        "folder.toml",
        "seed = 1\nviews = { even = 6 }\n[gate]\nmin_partial_cells = 20\n[[objects]]\nfolder = \"meshes with spaces ü\"\n",
    );
    let said = workspace.run_job("folder", "data").expect_code(3).stdout;
    assert!(said.contains("empty.stl") && said.starts_with("6 samples of 1 object\n"), "{said}");
}

#[test]
fn results_go_to_stdout_and_talk_to_stderr() {
    let workspace = Workspace::new();
    let run = Program::on("run", workspace.write("job.toml", JOB)).option("--out", workspace.path("data"));
    let done = run.args(["--progress", "json", "--json"]).succeed();
    let summary: Value = done.json();
    assert_eq!(summary["kept"].as_u64().zip(summary["rejected"].as_u64()).map(|(a, b)| a + b), Some(24));
    for line in done.stderr.lines() {
        let event: Value = serde_json::from_str(line).expect("one JSON object per line on stderr");
        assert!(event["event"].is_string(), "{line}");
    }
}

#[test]
fn shells_and_manuals_know_every_verb() {
    let workspace = Workspace::new();
    for shell in ["bash", "zsh", "fish"] {
        let script = Program::new("completions").arg(shell).succeed().stdout;
        assert!(["submit", "--task", "verify"].iter().all(|word| script.contains(word)), "{shell}");
    }
    Program::new("man").option("--out", workspace.path("man1")).succeed();
    for page in ["graspmill.1", "graspmill-run.1", "graspmill-query-reach.1"] {
        let page = workspace.read(Path::new("man1").join(page));
        assert!(page.contains(".TH") && page.contains(".SH"), "{page}");
    }
}

#[test]
fn an_address_of_object_storage_is_no_folder() {
    let workspace = Workspace::new();
    let job = workspace.write("job.toml", JOB);
    let said = Program::on("run", &job)
        .option("--out", "s3://bucket/data")
        .current_dir(workspace.folder())
        .expect_code(2)
        .stderr;
    assert!(said.contains("not to s3") && said.contains("give a folder"), "{said}");
    assert!(!workspace.path("s3:").exists());
}

#[test]
fn a_path_that_holds_no_dataset_is_named_for_what_it_is() {
    let workspace = Workspace::new();
    let job = workspace.write("job.toml", JOB);
    Program::run_job(&job, workspace.path("data")).succeed();
    fs::create_dir(workspace.path("empty")).expect("a folder");
    for verb in ["status", "verify", "inspect", "report", "digest"] {
        let said = |folder: &str| Program::on(verb, workspace.path(folder)).expect_code(2).stderr;
        assert!(said("nowhere").contains("no such folder"), "{verb}: {}", said("nowhere"));
        assert!(said("empty").contains("holds no dataset"), "{verb}: {}", said("empty"));
        // The folder above a dataset names it.
        assert!(said("").contains("one of those in it: data"), "{verb}: {}", said(""));
    }
}

#[test]
fn units_have_one_list_and_remedies_are_of_it() {
    let workspace = Workspace::new();
    // A cube of 42 units, and one normalised to 1.
    let cube = |side: f64| {
        let mut text = "OFF\n8 12 0\n".to_owned();
        for corner in 0..8 {
            let at = |axis: u32| side * f64::from(corner >> axis & 1);
            text += &format!("{} {} {}\n", at(0), at(1), at(2));
        }
        text + "3 0 2 1\n3 1 2 3\n3 4 5 6\n3 5 7 6\n3 0 1 4\n3 1 5 4\n3 2 6 3\n3 3 6 7\n3 0 4 2\n3 2 4 6\n3 1 3 5\n3 3 7 5\n"
    };
    let (large, normalised) = (workspace.write("large.off", cube(42.0)), workspace.write("unit.off", cube(1.0)));
    let check = |mesh: &Path, unit: &str| Program::new("meshes").arg("check").arg(mesh).option("--unit", unit).finish();
    let said = check(&large, "m").text();
    assert!(said.contains("unit = \"cm\"") && said.contains("unit = \"mm\""), "{said}");
    let said = check(&normalised, "mm").text();
    assert!(said.contains("normalised") && said.contains("size = 0.25"), "{said}");
    Program::new("meshes").arg("check").arg(&normalised).option("--size", "0.25").succeed();
    // Every unit that a remedy or the command line names is one of jobs.
    for unit in ["m", "dm", "cm", "mm", "in", "inch", "ft", "foot"] {
        assert!(check(&large, unit).code != Some(2), "{unit}");
        let text = format!("objects = [{{ list = [\"unit.off\"], unit = \"{unit}\" }}]\n");
        let outcome = Program::on("estimate", workspace.write("job.toml", text)).finish();
        assert!(!outcome.text().contains("one of"), "{unit}: {}", outcome.text());
    }
}

/// Bytes are measured on shards, tables and shapes that a pilot writes, so they hold for any job.
#[test]
fn an_estimate_tells_the_bytes_that_a_run_writes() {
    let objects = "objects = [{ built_in = [\"bottle-01\", \"box-01\", \"mug-01\"] }]\n";
    let hand = repository_path("scenes/barrett_bh8_280.xml");
    let grasps =
        format!("product = \"grasps\"\nhand.model = \"{}\"\ngrasps.seeds = 2\nannealing.steps = 500\n", hand.display());
    for (name, text) in [("pairs", "views = { even = 120 }\n"), ("grasps", &grasps)] {
        let workspace = Workspace::new();
        let job = workspace.write(format!("{name}.toml"), format!("{objects}{text}"));
        let told = Program::on("estimate", &job).read_json()["bytes"].as_f64().expect("bytes");
        let data = workspace.path("data");
        Program::run_job(&job, &data).succeed();
        // Without what no estimate counts: the preview, and notes about the run itself.
        let counted = read_tree(&data)
            .into_iter()
            .filter(|(path, _)| !["preview.mcap", "notes.json"].iter().any(|other| path == Path::new(other)));
        let written = counted.map(|(_, content)| content.len() as f64).sum::<f64>();
        assert!((told / written - 1.0).abs() < 0.1, "{name}: told {told}, written {written}");
    }
}

#[test]
fn an_estimate_names_refused_meshes_and_an_empty_training_split() {
    let workspace = Workspace::new();
    workspace.write("flat.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let text = "views = { even = 3 }\n[[objects]]\nbuilt_in = [\"can-01\"]\n[[objects]]\nlist = [\"flat.off\"]\n                unit = \"m\"\n[split]\nvalidation_objects = 0\ntest_objects = 1\n";
    let job = workspace.write("job.toml", text);
    let said = Program::on("estimate", &job).expect_code(3).stdout;
    assert!(said.contains("warning: refused: ") && said.contains("flat"), "{said}");
    assert!(said.contains("warning: no object is left for training"), "{said}");
}

#[test]
fn short_forms_mean_what_the_long_ones_do() {
    let (workspace, data) = make_data();
    let said = Program::on("run", workspace.path("data.toml")).option("-o", &data).args(["-q"]).succeed();
    assert!(said.stdout.ends_with(&format!("next: graspmill report {}\n", data.display())), "{}", said.stdout);
    assert_eq!(said.stderr, "");
    assert_eq!(Program::new("version").succeed().stdout, Program::new("--version").succeed().stdout);
}

/// A program that writes its first argument into a file, as an opener or a browser that tells what it was given.
fn write_opener(workspace: &Workspace, name: &str, told: &Path) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;

    let script = format!("#!/bin/sh\nprintf %s \"$1\" > '{0}.part' && /bin/mv '{0}.part' '{0}'\n", told.display());
    let path = workspace.write(name, script);
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a program");
    path
}

#[test]
fn a_report_is_opened_by_the_desktop_or_by_the_browser_that_is_named() {
    let (workspace, data) = make_data();
    let page = data.join("report.html");
    let report = |browser: &str| {
        let report = Program::on("report", &data).arg("--open").env("BROWSER", browser);
        // No other programs, as on a machine without a desktop.
        report.env("PATH", workspace.make_folder("bin"))
    };
    // A machine without a desktop: the report is written, and the message has the remedy.
    let said = report("").expect_code(1);
    let expected = format!("{}: no program found to open it", page.display());
    assert!(said.stderr.contains(&expected) && said.stderr.contains("open it in a browser"), "{}", said.text());
    assert!(said.stdout.starts_with(&page.display().to_string()) && page.exists(), "{}", said.text());
    // A browser that is named takes precedence; one that cannot be started is passed over.
    let (by_desktop, by_browser) = (workspace.path("by_desktop"), workspace.path("by_browser"));
    write_opener(&workspace, "bin/xdg-open", &by_desktop);
    let browser = write_opener(&workspace, "bin/fox", &by_browser);
    report(&format!("none:{}", browser.display())).succeed();
    wait_for(&by_browser);
    assert_eq!(read_text(&by_browser), page.display().to_string());
    assert!(!by_desktop.exists());
    report("none").succeed();
    wait_for(&by_desktop);
    assert_eq!(read_text(&by_desktop), page.display().to_string());
}

/// Waits for a file that another process writes; after a minute it hangs.
#[track_caller]
fn wait_for(file: &Path) {
    let began = Instant::now();
    while !file.exists() {
        assert!(began.elapsed() < Duration::from_secs(60), "{} is not written", file.display());
        thread::sleep(Duration::from_millis(20));
    }
}

/// The lines of a log without their times, which are checked: level and text.
fn read_log(path: &Path) -> Vec<(String, String)> {
    let line = |line: &str| {
        let (time, rest) = line.split_once(' ').expect("a time");
        // Such as 2026-11-23T12:31:23.456Z.
        assert!(time.len() == 24 && time.ends_with('Z') && time.contains('T'), "{line}");
        let (level, text) = rest.split_at(7);
        (level.trim_end().to_owned(), text.trim_start().to_owned())
    };
    read_text(path).lines().map(line).collect()
}

#[test]
fn a_log_holds_what_a_command_says_whatever_is_shown() {
    let workspace = Workspace::new();
    let (job, data, log) = (workspace.write("job.toml", JOB), workspace.path("data"), workspace.path("run.log"));
    let run = || Program::on("run", &job).option("--out", &data).option("--log", &log);
    let done = run().arg("--quiet").succeed();
    assert_eq!(done.stderr, "", "a log is no progress on stderr");
    let lines = read_log(&log);
    assert!(lines[0].1.starts_with("graspmill ") && lines[0].1.ends_with("--quiet"), "{lines:?}");
    let has = |lines: &[(String, String)], level: &str, text: &str| {
        assert!(lines.iter().any(|line| line.0 == level && line.1.contains(text)), "{level} {text}: {lines:#?}");
    };
    for text in
        ["24 samples in 3 shards", "finished completion-00002-of-00003-", "writing index and manifest", "exit code 0"]
    {
        has(&lines, "info", text);
    }
    // Every line of the result, too, and warnings as such.
    for line in done.stdout.lines() {
        has(&lines, if line.starts_with("warning: ") { "warning" } else { "info" }, line);
    }
    // The same file grows; faults are errors.
    flip_bit(&list_shards(&data)[1]);
    Program::on("verify", &data).option("--log", &log).expect_code(4);
    let grown = read_log(&log);
    assert_eq!(grown[..lines.len()], lines);
    has(&grown, "error", "problem: ");
    has(&grown, "info", "exit code 4");
    // A failure comes with its remedy; JSON is one line.
    Program::on("run", &job).option("--out", &data).set(["seed=6"]).option("--log", &log).expect_code(2);
    has(&read_log(&log), "error", "another --out");
    run().args(["--json", "--quiet"]).succeed();
    has(&read_log(&log), "info", "\"finished_before\":false");
    let submit =
        Program::on("submit", &job).args(["--backend", "local", "--print"]).option("--out", workspace.path("far"));
    submit.option("--log", workspace.path("submit.log")).succeed();
    has(&read_log(&workspace.path("submit.log")), "info", "at this machine's speed");
}

#[test]
fn a_log_stands_outside_of_the_dataset_in_a_file() {
    let (workspace, data) = make_data();
    let verify = |log: PathBuf| Program::on("verify", &data).option("--log", log);
    let said = verify(data.join("verify.log")).expect_code(2).stderr;
    assert!(said.contains("must not be in the dataset folder"), "{said}");
    let said = verify(workspace.make_folder("logs")).expect_code(2).stderr;
    assert!(said.contains("--log") && said.contains("a folder, not a regular file"), "{said}");
    verify(workspace.path("verify.log")).succeed();
}

#[test]
fn a_key_by_another_word_is_named() {
    let workspace = Workspace::new();
    let said = |text: &str| Program::on("estimate", workspace.write("job.toml", text)).expect_code(2).stderr;
    let grasps = said("product = \"grasps\"\n[grasps]\nruns = 4\n");
    assert!(grasps.contains("`grasps.seeds` sets the number of runs"), "{grasps}");
    assert!(said("[camera]\nfovy = 0.8\n").contains("camera.horizontal_fov"));
}

/// Meshes of 120 mm in millimetres: `init` finds the unit and writes a job that runs.
#[test]
fn a_job_for_a_folder_of_meshes_is_written_and_runs() {
    let workspace = Workspace::new();
    for name in ["a", "b"] {
        workspace.write(format!("meshes/{name}.off"), tetrahedron_off(if name == "a" { 120.0 } else { 80.0 }));
    }
    let init = |product: &str, out: &str| {
        let init = Program::on("init", workspace.path("meshes")).option("--product", product);
        init.option("--out", workspace.path(out))
    };
    let said = init("completion", "pairs.toml").succeed().stdout;
    assert!(said.contains("2 meshes usable, unit = \"mm\"") && said.contains("next: graspmill estimate"), "{said}");
    let text = workspace.read("pairs.toml");
    assert!(text.contains("folder = \"meshes\"\nunit = \"mm\"") && text.contains("# Completion pairs"), "{text}");
    Program::run_job(workspace.path("pairs.toml"), workspace.path("pairs")).set(["views={ even = 2 }"]).succeed();
    let said = init("completion", "pairs.toml").expect_code(2).stderr;
    assert!(said.contains("give another --out"), "{said}");
    // Every product has a job without mistakes.
    init("scenes", "scenes.toml").succeed();
    init("grasps", "none.toml").expect_code(2);
    init("grasps", "grasps.toml").option("--hand", repository_path("scenes/panda_hand.xml")).succeed();
    for job in ["scenes.toml", "grasps.toml"] {
        Program::on("estimate", workspace.path(job)).succeed();
    }
    // A mesh that no unit saves leaves the job to the others.
    workspace.write("meshes/c.off", "OFF\n");
    let said = init("completion", "others.toml").expect_code(3).stdout;
    assert!(said.contains("1 refused: graspmill meshes check"), "{said}");
}
