//! `graspmill init`: a commented job for a folder of meshes.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    path::{Component, Path, PathBuf},
};

use super::{
    args::{InitArgs, InitProduct},
    exit::{Exit, Failure},
    jobs,
    local_path::{absolute, in_shell},
    meshes::{longest_side, metres_per_unit},
    printer::Printer,
};
use assets::{MeshCheckReport, ScaleRule, SizeRule, check_report};
use factory::job::JobText;
use kernel::{
    files,
    words::{Show, counted},
};

/// Units that are tried where none is given, the first of those that refuse the fewest meshes and whose median mesh is nearest to
/// [`TYPICAL`].
const UNITS: [&str; 4] = ["m", "mm", "cm", "in"];

/// Longest side of an object that hands grasp [m].
const TYPICAL: f64 = 0.15;

/// Within this factor of [`TYPICAL`] the first unit is taken.
const LIKELY: f64 = 4.0;

/// Objects for each one that is held out for tests.
const PER_TEST_OBJECT: u32 = 5;

/// Bodies in a scene, at most.
const MOST_BODIES: u32 = 8;

/// Size of the meshes in a job file: its key with the value, and what the meshes are with it.
struct Size {
    line: String,
    report: MeshCheckReport,
}

/// Writes a job for the meshes of a folder, once they have been checked and the job reads without a mistake.
pub fn init(arguments: &InitArgs, printer: &Printer) -> Result<Exit, Failure> {
    let InitArgs { meshes, out, .. } = arguments;
    if files::is_present(out) {
        let message = format!("{} exists; give another --out, or remove it", out.shown());
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let size = size_of(arguments)?;
    let usable = size.report.counts.total - size.report.counts.refused;
    if usable == 0 {
        let message = format!("{}: no mesh is usable\n{}", meshes.shown(), size.report);
        return Err(Failure::message(Exit::Refused, message));
    }
    let target = absolute(out)?;
    let folder = target.parent().unwrap_or(Path::new("/")).to_owned();
    let text = job(arguments, &folder, &size.line, usable)?;
    let job = JobText { label: out.shown().to_string(), folder, text, overrides: Vec::new() };
    jobs::read(&job, &BTreeMap::new())?;
    files::replace(out, job.text.as_bytes()).map_err(|error| {
        let what = format!("cannot write {}", out.shown());
        Failure::new(Exit::BadSpec, anyhow::Error::new(error).context(what))
    })?;
    let (shown, refused) = (in_shell(out), size.report.counts.refused);
    let mut lines = format!("{}: {} usable, {}", out.shown(), counted(u64::from(usable), "mesh"), size.line);
    if refused > 0 {
        let _ = write!(lines, "; {refused} refused: graspmill meshes check {} names the remedies", in_shell(meshes));
    }
    let _ = write!(lines, "\nnext: graspmill estimate {shown}");
    printer.result(&lines);
    Ok(if refused > 0 { Exit::Refused } else { Exit::Complete })
}

/// The size that the arguments give, or the most likely unit.
fn size_of(arguments: &InitArgs) -> Result<Size, Failure> {
    let InitArgs { meshes, unit, size, .. } = arguments;
    let check = |scale| check_report(std::slice::from_ref(meshes), scale, SizeRule::default());
    if let Some(size) = size {
        return Ok(Size { line: format!("size = {size:?}"), report: check(longest_side(*size)?) });
    }
    let given = unit.as_deref().map(|unit| vec![unit]);
    let mut found: Option<(u32, f64, Size)> = None;
    for unit in given.unwrap_or(UNITS.to_vec()) {
        let report = check(ScaleRule::MetresPerUnit(metres_per_unit(unit)?));
        let (wrong, off) = (wrong_sizes(&report), off_typical(&report));
        let line =
            if unit.parse::<f64>().is_ok() { format!("unit = {unit}") } else { format!("unit = {}", quoted(unit)) };
        let is_better =
            found.as_ref().is_none_or(|(least, nearest, _)| wrong < *least || wrong == *least && off < *nearest);
        if is_better {
            found = Some((wrong, off, Size { line, report }));
        }
        // Likely enough, and the others take as long to check.
        if found.as_ref().is_some_and(|(least, off, _)| *least == 0 && *off < LIKELY) {
            break;
        }
    }
    Ok(found.expect("at least one unit").2)
}

/// Meshes that are refused for their size.
fn wrong_sizes(report: &MeshCheckReport) -> u32 {
    let is_wrong = |reason: &str| matches!(reason, "too_small" | "too_large");
    report.meshes.iter().filter(|mesh| mesh.refusal.as_ref().is_some_and(|refusal| is_wrong(&refusal.reason))).count()
        as u32
}

/// Factor between the median of the longest sides and a typical one, at least 1.
fn off_typical(report: &MeshCheckReport) -> f64 {
    let mut longest: Vec<f64> = report
        .meshes
        .iter()
        .filter_map(|mesh| mesh.record.as_ref())
        .map(|record| record.extents.into_iter().fold(0.0, f64::max))
        .collect();
    longest.sort_by(f64::total_cmp);
    longest.get(longest.len() / 2).map_or(f64::INFINITY, |median| (median / TYPICAL).max(TYPICAL / median))
}

/// Text of the job, with paths from the folder that will contain it.
fn job(arguments: &InitArgs, folder: &Path, size: &str, usable: u32) -> Result<String, Failure> {
    let InitArgs { meshes, product, hand, out, .. } = arguments;
    let name = out.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (shown, dataset) = (in_shell(out), in_shell(&Path::new("datasets").join(&name)));
    let (title, page) = match product {
        InitProduct::Completion => {
            ("Completion pairs of your meshes: what a depth camera sees of each, and the whole object", "completion")
        }
        InitProduct::Grasps => ("Grasps of your meshes on a table, tried in physics", "grasps"),
        InitProduct::Scenes => ("Cluttered scenes of your meshes on a table", "scenes"),
    };
    let held_out = usable / PER_TEST_OBJECT;
    let own = match product {
        InitProduct::Completion => COMPLETION.to_owned(),
        InitProduct::Grasps => {
            let hand = hand.as_deref().ok_or_else(|| {
                let message = "a job of grasps needs a hand: give --hand HAND, an MJCF file with its table beside it (docs/hands.md)";
                Failure::message(Exit::BadSpec, message)
            })?;
            GRASPS.replace("HAND", &quoted(&path_from(folder, hand)?))
        }
        // No object is twice in a scene.
        InitProduct::Scenes => SCENES.replace("MAX", &(usable - 2 * held_out).min(MOST_BODIES).to_string()),
    };
    Ok(format!(
        "# {title}.\n#\n#   graspmill estimate {shown}\n#   graspmill run {shown} --out {dataset}\n#   graspmill report {dataset}\n#\n\
         # docs/jobs/{page}.md lists all keys; `graspmill schema` prints them for editors.\n\n\
         product = \"{page}\"\nname = {}\nseed = 1\n{own}\n\
         # Files in STL, OBJ, PLY or OFF of this folder and those below it. `graspmill meshes check` describes each.\n\
         [[objects]]\nfolder = {}\n{size}\n\n\
         # Objects that no training sample shows.\n[split]\nvalidation_objects = {held_out}\ntest_objects = {held_out}\n",
        quoted(&name),
        quoted(&path_from(folder, meshes)?),
    ))
}

const COMPLETION: &str = "\
# Camera directions around each object: a number of even ones, or \"standard\" for the 726 of the thesis.
views = { even = 60 }
";

const GRASPS: &str = "
# Its table is the TOML file beside it. `graspmill hand check` describes both.
[hand]
model = HAND

# Runs per object, each of at most twenty states in a resting pose drawn by its probability.
[grasps]
seeds = 5
sampler = \"antipodal\"

[antipodal]
support = \"table\"

# Graded labels: the share of four levels of difficulty at which a grasp holds, and the reason of each failure.
[physics]
labels = \"ladder\"
";

const SCENES: &str = "\
# Bodies per scene, on a table of this size [m]. With `mode = \"bin\"`, give `container` instead.
mode = \"table\"
count = { min = 1, max = MAX }
table = { size = [0.8, 0.6] }
scenes = { training = 20 }
";

/// Text as a TOML string.
fn quoted(text: &str) -> String {
    // The escapes of JSON, and the one character that JSON does not escape and TOML forbids.
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007F")
}

/// Path that leads from a folder to another path: relative where they share a folder below the root.
fn path_from(folder: &Path, path: &Path) -> Result<String, Failure> {
    let (path, shown) = (absolute(path)?, path.shown());
    let (from, to): (Vec<Component>, Vec<Component>) = (folder.components().collect(), path.components().collect());
    let shared = from.iter().zip(&to).take_while(|(one, other)| one == other).count();
    let relative = || {
        let up = from[shared..].iter().map(|_| Component::ParentDir);
        up.chain(to[shared..].iter().copied()).collect::<PathBuf>()
    };
    // The root and no more: a path from there is clearer.
    let found = if shared <= 1 { path.clone() } else { relative() };
    let found = if found.as_os_str().is_empty() { PathBuf::from(".") } else { found };
    found.to_str().map(str::to_owned).ok_or_else(|| {
        let message =
            format!("{shown}: a job file is UTF-8 text, and this path is not; rename it, or make a link to it");
        Failure::message(Exit::BadSpec, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_the_jobs_folder() {
        let from = |folder: &str, path: &str| path_from(Path::new(folder), Path::new(path)).expect("UTF-8");
        assert_eq!(from("/home/me/jobs", "/home/me/meshes"), "../meshes");
        assert_eq!(from("/home/me", "/home/me/meshes/cups"), "meshes/cups");
        assert_eq!(from("/home/me", "/home/me"), ".");
        assert_eq!(from("/home/me", "/data/meshes"), "/data/meshes");
    }

    #[test]
    fn strings_are_those_of_toml() {
        assert_eq!(quoted("a \"b\"\\\n\u{7f}"), r#""a \"b\"\\\n\u007F""#);
    }
}
