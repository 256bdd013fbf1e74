//! Signed distance over pose grids against scipy's exact Euclidean transform and scikit-fmm.

use std::{
    f64::consts::{PI, TAU},
    fs,
};

use graspmill::{
    geom::{Axis, AxisGrid, AxisUnit, HealPix, METRES_PER_RADIAN, signed_distance_standard, signed_distance_thesis},
    seed::Stream,
};
use serde_json::json;

use crate::support::{program::Program, workspace::Workspace};

const NAMES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

/// Steps of 0.1 m; angles cover a full turn where `periodic` is true, else a quarter.
fn grid(count: [usize; 6], periodic: [bool; 3]) -> AxisGrid {
    let axis = |k: usize| {
        let (unit, periodic) = if k < 3 { (AxisUnit::Metre, false) } else { (AxisUnit::Radian, periodic[k - 3]) };
        let span = if periodic { TAU } else { TAU / 4.0 };
        let (first, step) = if k < 3 { (0.0, 0.1) } else { (-PI, span / count[k] as f64) };
        Axis { name: NAMES[k], unit, first, step, count: count[k], periodic }
    };
    AxisGrid::new(std::array::from_fn(axis)).unwrap()
}

/// Steps in the metric of the standard profile [m].
fn steps(grid: &AxisGrid) -> [f64; 6] {
    grid.axes().map(|axis| axis.step * if axis.unit == AxisUnit::Radian { METRES_PER_RADIAN } else { 1.0 })
}

struct Case {
    grid: AxisGrid,
    inside: Vec<bool>,
}

/// Cases with these shares of cells inside, cell by cell, and cases of balls.
fn cases(grids: &[AxisGrid], shares: &[f64]) -> Vec<Case> {
    let mut draw = Stream::of_job(1, b"", "labels");
    let mut cases = Vec::new();
    for grid in grids {
        for share in shares {
            let inside = (0..grid.cells()).map(|_| draw.unit() < *share).collect();
            cases.push(Case { grid: grid.clone(), inside });
        }
        for (balls, radius) in [(1, 1.5), (3, 2.5), (2, 4.5)] {
            let mut inside = vec![false; grid.cells()];
            for _ in 0..balls {
                let centre = grid.coordinates(draw.below(grid.cells() as u64) as usize);
                for (cell, inside) in inside.iter_mut().enumerate() {
                    let cell = grid.coordinates(cell);
                    let steps = (0..6).map(|k| grid.axes()[k].steps_between(cell[k], centre[k]) as f64);
                    *inside |= steps.map(|steps| steps * steps).sum::<f64>() <= radius * radius;
                }
            }
            cases.push(Case { grid: grid.clone(), inside });
        }
    }
    // scikit-fmm refuses a set without a contour.
    cases.retain(|case| case.inside.contains(&true) && case.inside.contains(&false));
    cases
}

/// The answers of tests/peers/field.py, a field per case.
fn ask_peer(what: &str, cases: &[Case]) -> Vec<Vec<f64>> {
    let folder = Workspace::new();
    let file = |case: usize, ending: &str| folder.path(format!("{case}.{ending}"));
    let mut listed = Vec::new();
    for (case, Case { grid, inside }) in cases.iter().enumerate() {
        fs::write(file(case, "labels"), inside.iter().map(|label| u8::from(*label)).collect::<Vec<_>>()).unwrap();
        let periodic = grid.axes().map(|axis| axis.periodic);
        let (name, shape, steps) = (case.to_string(), grid.shape(), steps(grid));
        listed.push(json!({ "name": name, "shape": shape, "steps": steps, "periodic": periodic }));
    }
    folder.write("cases.json", serde_json::to_vec(&listed).unwrap());
    let python = if what == "thesis" { Program::peer("peers/bin/python") } else { Program::python() };
    python.args(["tests/peers/field.py", what]).arg(folder.folder()).succeed();
    let fields = (0..cases.len()).map(|case| fs::read(file(case, "peer")).unwrap());
    fields.map(|bytes| bytes.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()).collect()
}

#[test]
fn the_standard_distance_is_within_half_a_cell_of_scipy_centres() {
    let grids = [
        grid([5, 4, 6, 2, 4, 5], [true, true, true]),
        grid([7, 3, 2, 4, 3, 6], [true, false, true]),
        grid([1, 9, 8, 1, 7, 8], [true, true, true]),
    ];
    let cases = cases(&grids, &[0.002, 0.1, 0.5, 0.99]);
    let mut least_slack = f64::INFINITY;
    for (case, centres) in cases.iter().zip(ask_peer("centres", &cases)) {
        let field = signed_distance_standard(&case.inside, &case.grid, METRES_PER_RADIAN);
        // The nearest box is no farther than its centre, and at most half its diagonal nearer; half a step at least.
        let diagonal = steps(&case.grid).iter().map(|step| step * step).sum::<f64>().sqrt();
        for (value, centre) in field.iter().zip(&centres) {
            let distance = f64::from(value.abs());
            assert!(distance < *centre && distance >= centre - diagonal / 2.0 - 1e-6, "{distance} {centre}");
            least_slack = least_slack.min(centre - distance);
        }
    }
    println!("{} cases; at least {least_slack:.4} m nearer than the centres", cases.len());
}

/// No direction is farther from the pixel centres than the farthest vertex of their Voronoi cells.
#[test]
fn directions_cover_the_sphere_as_their_voronoi_vertices_say() {
    let script = r#"
import sys, numpy as np
from scipy.spatial import SphericalVoronoi
for line in sys.argv[1:]:
    points = np.array(line.split(), float).reshape(-1, 3)
    vertices = SphericalVoronoi(points, threshold=1e-9).vertices
    print(np.arccos(np.clip(vertices @ points.T, -1, 1).max(1).min()))
"#;
    let healpixes: Vec<HealPix> = (1..=HealPix::MAX_NSIDE.min(10)).filter_map(HealPix::new).collect();
    let text = |healpix: &HealPix| {
        let numbers = healpix.directions().into_iter().flat_map(|direction| [direction.x, direction.y, direction.z]);
        numbers.map(|number| number.to_string()).collect::<Vec<_>>().join(" ")
    };
    let lines: Vec<String> = healpixes.iter().map(text).collect();
    let answer = Program::python_lines(script).args(&lines).succeed().stdout;
    for (healpix, radius) in healpixes.iter().zip(answer.lines()) {
        let radius: f64 = radius.parse().expect("a number");
        assert!((healpix.covering_radius() - radius).abs() < 1e-6, "{healpix:?}: {radius}");
    }
    assert_eq!(answer.lines().count(), healpixes.len());
}

/// scikit-fmm is available only as source, so it is installed with the peers of the benchmarks.
#[test]
#[ignore = "slow: needs the packages of the benchmarks' peers"]
fn the_thesis_distance_is_that_of_scikit_fmm() {
    let grids = [
        grid([5, 4, 6, 2, 4, 5], [true, true, true]),
        grid([4, 4, 3, 2, 8, 8], [true, true, true]),
        grid([7, 3, 2, 4, 3, 6], [true, false, true]),
        grid([1, 9, 8, 1, 7, 8], [true, true, true]),
        grid([12, 1, 20, 2, 3, 1], [true, true, false]),
    ];
    let mut cases = cases(&grids, &[0.0005, 0.002, 0.01, 0.1, 0.5, 0.9, 0.995]);
    // The thesis's own grid, as balls.
    cases.push(self::cases(&[grid([12, 22, 20, 2, 8, 8], [true, true, true])], &[]).pop().unwrap());
    let (mut greatest, mut deepest, mut farthest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (case, exact) in cases.iter().zip(ask_peer("thesis", &cases)) {
        let field = signed_distance_thesis(&case.inside, &case.grid);
        for (value, exact) in field.iter().zip(exact) {
            let value = f64::from(*value);
            greatest = greatest.max((value - f64::from(exact as f32)).abs());
            (deepest, farthest) = (deepest.min(value), farthest.max(value));
            assert!((value - exact).abs() <= 1e-6, "{:?}: {value} {exact}", case.grid.shape());
        }
    }
    println!("{} cases, {deepest:.3} to {farthest:.3} cells: greatest difference {greatest:e}", cases.len());
}
