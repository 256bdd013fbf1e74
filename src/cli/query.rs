//! `graspmill query`: queries a finished dataset.

use std::{fmt::Write as _, path::Path};

use serde::Serialize;

use super::{
    args::ReachArgs,
    exit::{Exit, Failure},
    folder::{refuse_other_products, refuse_set},
    printer::Printer,
};
use kernel::{
    files::{self, Bound, Folder},
    geom::{FieldMetric, PoseLabel},
    words::Show,
};
use runtime::ReachabilityMap;

const AXES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];
const FORM: &str = "six numbers x,y,z,roll,pitch,yaw, metres and radians";

/// Results of a map for some poses.
#[derive(Serialize)]
struct Answers<'a> {
    robot: &'a str,
    joints: &'a [String],
    target: &'a str,
    frame: &'a str,
    /// Unit of the distances; gradients are per metre (x, y, z) and per radian (roll, pitch, yaw).
    unit: &'static str,
    sign: &'static str,
    poses: Vec<Answer>,
}

/// Result of a map for one pose.
#[derive(Serialize)]
struct Answer {
    pose: [f64; 6],
    /// `null` where all poses have the same label, because JSON has no infinity.
    distance: f64,
    gradient: [f64; 6],
    inside_grid: bool,
    nearest: Cell,
}

/// The cell nearest to a pose.
#[derive(Serialize)]
struct Cell {
    cell: usize,
    pose: [f64; 6],
    label: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    witness: Option<Vec<f64>>,
}

/// `graspmill query reach`.
pub fn reach(arguments: &ReachArgs, printer: &Printer) -> Result<Exit, Failure> {
    let poses = poses(arguments)?;
    let mut map = open_map(&arguments.dir)?;
    let reachable = |pose| map.nearest_cell(pose).is_some_and(|nearest| nearest.label == PoseLabel::Reachable);
    if poses.iter().any(reachable) {
        map.read_witnesses(&arguments.dir)?;
    }
    let robot = map.robot();
    let answers = Answers {
        robot: &robot.robot,
        joints: &robot.joints,
        target: &robot.target,
        frame: &robot.frame,
        unit: match map.metric() {
            FieldMetric::Metres { .. } => "metres",
            FieldMetric::Cells => "cells",
        },
        sign: "negative inside the reachable set",
        poses: poses.iter().filter_map(|pose| answer(&map, pose)).collect(),
    };
    if arguments.json {
        printer.json(&answers)?;
    } else {
        printer.result(&text(&answers));
    }
    Ok(Exit::Complete)
}

/// Opens the map of a folder. Requires only its field; without a field, the folder is not a reachability dataset.
fn open_map(folder: &Folder) -> Result<ReachabilityMap, Failure> {
    if !ReachabilityMap::is_in(folder) {
        refuse_set(folder)?;
        refuse_other_products(folder, "query reach", &[ReachabilityMap::PRODUCT])?;
    }
    Ok(ReachabilityMap::open(folder)?)
}

fn answer(map: &ReachabilityMap, pose: &[f64; 6]) -> Option<Answer> {
    let nearest = map.nearest_cell(pose)?;
    let (distance, gradient) = map.distance_and_gradient(pose);
    let (cell, label) = (nearest.cell, nearest.label.name());
    let nearest = Cell { cell, pose: nearest.pose, label, witness: nearest.witness.map(<[f64]>::to_vec) };
    Some(Answer { pose: *pose, distance, gradient, inside_grid: map.is_in_grid(pose), nearest })
}

fn text(answers: &Answers) -> String {
    let Answers { robot, target, frame, unit, .. } = answers;
    let mut text = format!("{robot}: {target} in {frame}; metres, radians, distances in {unit}, negative inside\n");
    for Answer { pose, distance, gradient, inside_grid, nearest } in &answers.poses {
        let _ = writeln!(text, "\npose      {}", numbers(pose));
        let side = if *distance < 0.0 { "inside the reachable set" } else { "outside the reachable set" };
        let _ = writeln!(text, "  distance  {distance:.4} {unit}, {side}");
        if !inside_grid {
            text.push_str("  OUTSIDE THE GRID: value at its border plus the distance to the border\n");
        }
        let _ = writeln!(text, "  gradient  {}", numbers(gradient));
        let (cell, label) = (nearest.cell, nearest.label.replace('_', " "));
        let _ = writeln!(text, "  nearest   {}: {label} (cell {cell})", numbers(&nearest.pose));
        if let Some(witness) = &nearest.witness {
            let values: Vec<String> =
                answers.joints.iter().zip(witness).map(|(joint, value)| format!("{joint} {value:.6}")).collect();
            let _ = writeln!(text, "  witness   {}", values.join(", "));
        }
    }
    text
}

fn numbers(values: &[f64; 6]) -> String {
    values.map(|value| format!("{value:.4}")).join(" ")
}

/// Poses of the command line, followed by those of the file.
fn poses(arguments: &ReachArgs) -> Result<Vec<[f64; 6]>, Failure> {
    let wrong = |problem: String| Failure::message(Exit::BadSpec, problem);
    let mut poses = Vec::new();
    for (number, text) in (1..).zip(&arguments.pose) {
        let fields: Vec<&str> = text.split(',').collect();
        let pose =
            numbers_of(&fields).map_err(|problem| wrong(format!("--pose {text} (number {number}): {problem}")))?;
        poses.push(pose);
    }
    if let Some(path) = &arguments.csv {
        let text = files::read_text(path, Bound::POSES)
            .map_err(|error| wrong(format!("{}: {error}; give a text file of poses, {FORM} per line", path.shown())))?;
        poses.append(&mut poses_of_file(&text, path).map_err(wrong)?);
    }
    Ok(poses)
}

/// Reads six numbers per line. A first line without numbers names the columns; other columns may be between them.
fn poses_of_file(text: &str, path: &Path) -> Result<Vec<[f64; 6]>, String> {
    let text = text.trim_start_matches('\u{feff}');
    let lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let mut columns: Option<[usize; 6]> = None;
    let mut poses = Vec::new();
    for (number, (line, content)) in lines.enumerate() {
        let fields: Vec<&str> = content.split(',').map(str::trim).collect();
        let at = |problem: String| format!("{}:{line}: {problem}", path.shown());
        if number == 0 && fields.iter().all(|field| field.parse::<f64>().is_err()) {
            columns = Some(columns_of(&fields).map_err(at)?);
            continue;
        }
        let picked: Option<Vec<&str>> =
            columns.map_or(Some(fields.clone()), |columns| columns.iter().map(|k| fields.get(*k).copied()).collect());
        let picked = picked.ok_or_else(|| at(format!("{} columns, fewer than in the first line", fields.len())))?;
        poses.push(numbers_of(&picked).map_err(at)?);
    }
    if poses.is_empty() { Err(format!("{}: contains no pose; give {FORM} per line", path.shown())) } else { Ok(poses) }
}

fn columns_of(names: &[&str]) -> Result<[usize; 6], String> {
    let mut columns = [0; 6];
    for (column, axis) in columns.iter_mut().zip(AXES) {
        let named = |name: &&str| name.trim_matches('"').eq_ignore_ascii_case(axis);
        *column = names.iter().position(named).ok_or_else(|| {
            format!("no column is named {axis}; name x, y, z, roll, pitch and yaw, or omit the first line")
        })?;
    }
    Ok(columns)
}

fn numbers_of(fields: &[&str]) -> Result<[f64; 6], String> {
    if fields.len() != 6 {
        return Err(format!("{} values; give {FORM}", fields.len()));
    }
    let mut pose = [0.0; 6];
    for ((value, field), axis) in pose.iter_mut().zip(fields).zip(AXES) {
        let number = field.trim().parse().ok().filter(|number: &f64| number.is_finite());
        *value = number.ok_or_else(|| format!("{axis} = '{}' is not a finite number; give {FORM}", field.trim()))?;
    }
    Ok(pose)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<[f64; 6]>, String> {
        poses_of_file(text, Path::new("poses.csv"))
    }

    #[test]
    fn columns_stand_in_any_order_or_in_ours() {
        let poses = [[1.0, 2.0, 3.0, 0.1, 0.2, 0.3], [-1.0, 0.0, 0.0, 0.0, 0.0, 1e-3]];
        assert_eq!(read("1,2,3,.1,.2,.3\r\n\n-1, 0,0,0, 0,1e-3\n").unwrap(), poses);
        assert_eq!(read("\u{feff}x,y,z,roll,pitch,yaw\n1,2,3,.1,.2,.3\n-1,0,0,0,0,1e-3").unwrap(), poses);
        assert_eq!(
            read("# of today\nYaw,pitch,roll,name,z,y,x\n.3,.2,.1,a,3,2,1\n1e-3,0,0,b,0,0,-1\n").unwrap(),
            poses
        );
    }

    #[test]
    fn mistakes_name_their_line() {
        for (text, says) in [
            ("1,2,3,0,0,0\n1,2,3,0,0\n", "poses.csv:2: 5 values; give six numbers"),
            ("1,2,3,0,0,0\n1,2,3,0,0,0deg\n", "poses.csv:2: yaw = '0deg' is not a finite number"),
            ("1,2,3,0,nan,0\n", "poses.csv:1: pitch = 'nan'"),
            ("x,y,z,roll,pitch\n", "no column is named yaw"),
            ("x,y,z,roll,pitch,yaw\n1,2,3,0,0\n", "poses.csv:2: 5 columns, fewer"),
            ("x,y,z,roll,pitch,yaw\n", "contains no pose"),
            ("", "contains no pose"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
