//! Meshes that are not solids, and solids with defects: which of them are refused, and that no sound mesh is.

use std::{
    f64::consts::{PI, TAU},
    path::Path,
};

use graspmill::{
    assets::{MeshCheckReport, ScaleRule, SizeRule, check_report},
    files::Folder,
    format::dataset::DatasetReader,
    geom::TriMesh,
    seed::Stream,
};

use crate::kernel::meshes::{join, reversed, scaled, sheet, shrunk};
use crate::support::{
    files::{FULL_CHECK, assert_intact},
    jobs::NO_SPLIT,
    meshes::{block, bumpy, round, write_stl},
    program::Program,
    workspace::Workspace,
};

/// Radius or half width of most meshes here [m].
const RADIUS: f64 = 0.05;

fn random(name: &str) -> Stream {
    Stream::of_job(1, b"defects", name)
}

/// Loose triangles whose corners lie within `spread` of a point anywhere in a cube of 0.1 m.
fn soup(count: u32, spread: f64, seed: u64) -> TriMesh {
    let mut stream = Stream::of_job(seed, b"soup", "corners");
    let mut mesh = TriMesh::default();
    for face in 0..count {
        let middle = [(); 3].map(|()| stream.uniform(0.0, 0.1));
        for _ in 0..3 {
            mesh.vertices.push(middle.map(|part| (part + stream.uniform(-spread, spread)) as f32));
        }
        mesh.triangles.push([3 * face, 3 * face + 1, 3 * face + 2]);
    }
    mesh
}

/// Where a surface over a square of parameters meets itself.
#[derive(Clone, Copy)]
enum Closed {
    /// Along u: the last column is the first.
    Along,
    /// Along u, with v the other way round.
    AlongTwisted,
    /// Along u, and along v.
    Both,
    /// Along u with v the other way round, and along v.
    BothTwisted,
}

/// A surface over parameters u and v from 0 to 1, of `columns` x `rows` quadrangles.
fn surface(columns: u32, rows: u32, closed: Closed, point: impl Fn(f64, f64) -> [f64; 3]) -> TriMesh {
    let vertex = |column: u32, row: u32| {
        let wraps = column == columns;
        let row = match closed {
            Closed::AlongTwisted | Closed::BothTwisted if wraps => rows - row,
            _ => row,
        };
        let row = if matches!(closed, Closed::Both | Closed::BothTwisted) { row % rows } else { row };
        (if wraps { 0 } else { column }) * (rows + 1) + row
    };
    let at = |index: u32| {
        let [column, row] = [index / (rows + 1), index % (rows + 1)];
        point(f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows)).map(|part| part as f32)
    };
    let squares = (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row)));
    let triangles = squares.flat_map(|(column, row)| {
        let [a, b] = [vertex(column, row), vertex(column + 1, row)];
        let [c, d] = [vertex(column + 1, row + 1), vertex(column, row + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices: (0..(columns + 1) * (rows + 1)).map(at).collect(), triangles: triangles.collect() }
}

/// A strip of this width round a circle, with `half_twists` half twists.
fn strip(width: f64, half_twists: u32) -> TriMesh {
    let closed = if half_twists % 2 == 1 { Closed::AlongTwisted } else { Closed::Along };
    surface(96, 8, closed, |u, v| {
        let (turn, tilt, across) = (TAU * u, PI * f64::from(half_twists) * u, width * (v - 0.5));
        let radius = RADIUS + across * tilt.cos();
        [radius * turn.cos(), radius * turn.sin(), across * tilt.sin()]
    })
}

/// The immersion of the Klein bottle as a figure of eight that turns by a half along a circle.
fn klein_eight() -> TriMesh {
    surface(96, 48, Closed::BothTwisted, |u, v| {
        // The figure of eight is run through the other way round after half a turn.
        let (turn, along) = (TAU * u, TAU * v + PI / 2.0);
        let (x, y) = (0.4 * along.cos(), 0.4 * (2.0 * along).sin() / 2.0);
        let (half_cos, half_sin) = ((turn / 2.0).cos(), (turn / 2.0).sin());
        let radius = 1.0 + x * half_cos - y * half_sin;
        [radius * turn.cos(), radius * turn.sin(), x * half_sin + y * half_cos].map(|part| RADIUS * part)
    })
}

/// The bottle whose neck runs through its wall and opens into its foot, 0.1 m high.
fn klein_bottle() -> TriMesh {
    surface(96, 48, Closed::BothTwisted, |u, v| {
        let (along, round) = (TAU * u, TAU * v + PI / 2.0);
        let radius = 4.0 * (1.0 - along.cos() / 2.0);
        let (x, y) = (6.0 * along.cos() * (1.0 + along.sin()), 16.0 * along.sin());
        let (x, y) = if along < PI {
            (x + radius * along.cos() * round.cos(), y + radius * along.sin() * round.cos())
        } else {
            (x - radius * round.cos(), y)
        };
        [x, y, radius * round.sin()].map(|part| part / 340.0)
    })
}

/// A part of a ball's surface, from the polar angle whose cap has the share `missing` of the area.
fn cut_ball(missing: f64) -> TriMesh {
    let start = (1.0 - 2.0 * missing).acos();
    surface(96, 64, Closed::Along, |u, v| {
        let (azimuth, polar) = (TAU * u, start + (PI - start) * v);
        // Exactly 0 at the pole, where the last row is one point.
        let across = if v == 1.0 { 0.0 } else { polar.sin() };
        [across * azimuth.cos(), across * azimuth.sin(), polar.cos()].map(|part| RADIUS * part)
    })
}

/// A round tube, open at both ends.
fn tube(length: f64) -> TriMesh {
    surface(64, 64, Closed::Along, |u, v| [RADIUS * (TAU * u).cos(), RADIUS * (TAU * u).sin(), length * v])
}

/// A round disc at this height, facing up.
fn disc(radius: f64, height: f64) -> TriMesh {
    surface(64, 16, Closed::Along, |u, v| [radius * v * (TAU * u).cos(), radius * v * (TAU * u).sin(), height])
}

fn ball() -> TriMesh {
    round(24, |_, _| RADIUS)
}

/// Without this share of the faces, drawn at random.
fn thinned(mut mesh: TriMesh, share: f64) -> TriMesh {
    let mut stream = random("thinned");
    mesh.triangles.retain(|_| stream.unit() >= share);
    mesh
}

/// With this share of the faces reversed, drawn at random.
fn flipped(mesh: TriMesh, share: f64) -> TriMesh {
    let mut stream = random("flipped");
    let chosen: Vec<bool> = mesh.triangles.iter().map(|_| stream.unit() < share).collect();
    reversed(mesh, |face| chosen[face])
}

/// With the corners of every face moved by up to `shift` [m], each on its own.
fn cracked(mesh: &TriMesh, shift: f64) -> TriMesh {
    let mut stream = random("cracked");
    let corners = mesh.triangles.iter().flatten().map(|&vertex| mesh.vertices[vertex as usize]);
    let moved = corners.map(|corner| corner.map(|part| (f64::from(part) + stream.uniform(-shift, shift)) as f32));
    let vertices: Vec<[f32; 3]> = moved.collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    TriMesh { vertices, triangles }
}

fn moved(mut mesh: TriMesh, by: [f32; 3]) -> TriMesh {
    mesh.vertices.iter_mut().for_each(|vertex| (0..3).for_each(|axis| vertex[axis] += by[axis]));
    mesh
}

/// Faces split at the middle of their first edge, where their neighbours are not: every third one.
fn with_t_junctions(mut mesh: TriMesh) -> TriMesh {
    for face in (0..mesh.triangles.len()).step_by(3) {
        let [a, b, c] = mesh.triangles[face];
        let [p, q] = [a, b].map(|corner| mesh.vertices[corner as usize]);
        let middle = mesh.vertices.len() as u32;
        mesh.vertices.push(std::array::from_fn(|axis| (p[axis] + q[axis]) / 2.0));
        mesh.triangles[face] = [a, middle, c];
        mesh.triangles.push([middle, b, c]);
    }
    mesh
}

/// Verdict that a kind must get.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wanted {
    /// Usable, repaired or not.
    Accepted,
    /// Refused, with one of these reasons.
    Refused(&'static [&'static str]),
    /// A matter of degree: the table has the result.
    Either,
}

const NO_SOLID: Wanted = Wanted::Refused(&["no_inside", "no_volume", "open_sheet", "flat"]);
const ONE_SIDED: Wanted = Wanted::Refused(&["one_sided"]);

/// Surfaces that have no inside.
fn surfaces_without_inside() -> Vec<(String, TriMesh, Wanted)> {
    let mut kinds: Vec<(String, TriMesh, Wanted)> = Vec::new();
    for count in [4, 10, 30, 100, 1_000, 10_000] {
        kinds.push((format!("soup of {count} large triangles"), soup(count, 0.05, 7), NO_SOLID));
    }
    for count in [100, 10_000] {
        kinds.push((format!("soup of {count} small triangles"), soup(count, 0.002, 7), NO_SOLID));
    }
    let mut add = |kind: &str, mesh: TriMesh, wanted| kinds.push((kind.to_owned(), mesh, wanted));
    add("Moebius strip, narrow", strip(0.02, 1), ONE_SIDED);
    add("Moebius strip, wide", strip(0.08, 1), ONE_SIDED);
    add("strip of 3 half twists", strip(0.03, 3), ONE_SIDED);
    add("Klein bottle, figure of eight", klein_eight(), ONE_SIDED);
    add("Klein bottle", klein_bottle(), ONE_SIDED);
    add("strip of 2 half twists", strip(0.03, 2), NO_SOLID);
    add("plane", sheet(|_, _| 0.0), NO_SOLID);
    add("bent sheet", sheet(|x, _| 0.5 * x * x), NO_SOLID);
    add("disc", disc(RADIUS, 0.0), NO_SOLID);
    add("plane of two sides", join(&[sheet(|x, _| x), reversed(sheet(|x, _| x), |_| true)]), NO_SOLID);
    let standing = |mesh: TriMesh| {
        let turn = |[x, y, z]: [f32; 3]| [x, z + 0.05, y - 0.05];
        TriMesh { vertices: mesh.vertices.into_iter().map(turn).collect(), ..mesh }
    };
    add("two planes that cross", join(&[sheet(|_, _| 0.0), standing(sheet(|_, _| 0.0))]), NO_SOLID);
    add("ring of a tube", tube(0.01), NO_SOLID);
    add("ball with random faces reversed, loose", shrunk(&flipped(ball(), 0.5)), NO_SOLID);
    kinds
}

/// Surfaces with one large opening.
fn open_surfaces() -> Vec<(String, TriMesh, Wanted)> {
    let mut kinds: Vec<(String, TriMesh, Wanted)> = Vec::new();
    for percent in [1, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90] {
        let wanted = match percent {
            0..=50 => Wanted::Accepted,
            51..=80 => Wanted::Either,
            _ => NO_SOLID,
        };
        kinds.push((format!("ball with a hole of {percent} %"), cut_ball(f64::from(percent) / 100.0), wanted));
    }
    for percent in [1, 10, 30, 50, 60] {
        let wanted = if percent <= 30 { Wanted::Accepted } else { Wanted::Either };
        let mesh = thinned(ball(), f64::from(percent) / 100.0);
        kinds.push((format!("ball without {percent} % of its faces"), mesh, wanted));
    }
    let mut add = |kind: &str, mesh: TriMesh, wanted| kinds.push((kind.to_owned(), mesh, wanted));
    add("long tube, open", tube(0.4), Wanted::Accepted);
    add("tube as long as wide, open", tube(0.1), Wanted::Accepted);
    add("tube half as long as wide, open", tube(0.05), Wanted::Either);
    add("bowl of no thickness", cut_ball(0.5), Wanted::Accepted);
    add("shallow bowl of no thickness", cut_ball(0.8), Wanted::Either);
    add("two-sided bowl", join(&[cut_ball(0.5), reversed(cut_ball(0.5), |_| true)]), Wanted::Accepted);
    let bottom = reversed(disc(RADIUS, 0.0), |_| true);
    add("cup of no thickness", join(&[tube(0.1), bottom]), Wanted::Accepted);
    let mut crate_of_sheets = block([0.0; 3], [0.1, 0.08, 0.06]);
    crate_of_sheets.triangles.drain(2..4);
    add("box without a lid", crate_of_sheets, Wanted::Accepted);
    let slab = |gap: f64| join(&[disc(RADIUS, gap), reversed(disc(RADIUS, 0.0), |_| true)]);
    add("two discs 2 mm apart, no rim", slab(0.002), Wanted::Accepted);
    add("two discs 50 mm apart, no rim", slab(0.05), NO_SOLID);
    kinds
}

/// Solids with defects.
fn defective_solids() -> Vec<(String, TriMesh, Wanted)> {
    let mut kinds: Vec<(String, TriMesh, Wanted)> = Vec::new();
    let mut add = |kind: &str, mesh: TriMesh| kinds.push((kind.to_owned(), mesh, Wanted::Accepted));
    add("10 % of the faces reversed", flipped(bumpy(20), 0.1));
    add("half of the faces reversed", flipped(bumpy(20), 0.5));
    add("inside out", reversed(bumpy(20), |_| true));
    let mut doubled = bumpy(20);
    doubled.triangles.extend_from_within(100..200);
    add("100 faces twice", doubled);
    add("all faces twice", join(&[ball(), ball()]));
    add("all faces twice, back to back", join(&[bumpy(20), reversed(bumpy(20), |_| true)]));
    add("T-junctions at every third face", with_t_junctions(bumpy(20)));
    add("seams cracked by 1 um", cracked(&bumpy(20), 1e-6));
    add("seams cracked by 0.1 mm", cracked(&bumpy(20), 1e-4));
    add("near soup", shrunk(&bumpy(20)));
    let upper = moved(reversed(scaled(cut_ball(0.5), -1.0), |_| true), [0.0, 0.0, 1e-3]);
    add("halves 1 mm apart", join(&[cut_ball(0.5), upper]));
    add("two balls that overlap", join(&[ball(), moved(ball(), [0.03, 0.0, 0.0])]));
    let spindle = surface(64, 64, Closed::Both, |u, v| {
        let (turn, round) = (TAU * u, TAU * v);
        let radius = 0.02 + 0.03 * round.cos();
        [radius * turn.cos(), radius * turn.sin(), 0.03 * round.sin()]
    });
    add("ring that runs through itself", spindle);
    add("cavity", join(&[ball(), reversed(scaled(ball(), 0.5), |_| true)]));
    add("three solids in one another", join(&[ball(), scaled(ball(), 0.7), scaled(ball(), 0.4)]));
    add("two boxes at one edge", join(&[block([0.0; 3], [0.05; 3]), block([0.05, 0.05, 0.0], [0.1, 0.1, 0.05])]));
    add("two boxes at one corner", join(&[block([0.0; 3], [0.05; 3]), block([0.05; 3], [0.1; 3])]));
    let mut walled = block([0.0; 3], [0.1; 3]);
    walled.triangles.extend([[0, 3, 7], [0, 7, 4]]);
    add("box with a wall across", walled);
    let corners = vec![[0.05, 0.0, 0.0], [0.08, 0.0, 0.0], [0.05, 0.0, 0.03]];
    let fin = TriMesh { vertices: corners, triangles: vec![[0, 1, 2]] };
    add("ball with a fin", join(&[ball(), fin]));
    let mut slivers = bumpy(20);
    let [a, b, _] = slivers.triangles[50];
    slivers.triangles.extend([[a, b, a], [b, b, a]]);
    add("faces without area", slivers);
    add("needles: 1 mm thick, 1 m long", block([0.0; 3], [1.0, 1e-3, 1e-3]));
    add("sheet of metal 0.05 mm thick", block([0.0; 3], [0.1, 0.07, 5e-5]));
    kinds
}

fn kinds() -> Vec<(String, TriMesh, Wanted)> {
    [surfaces_without_inside(), open_surfaces(), defective_solids()].into_iter().flatten().collect()
}

fn check_file(path: &Path, scale: ScaleRule) -> MeshCheckReport {
    check_report(&[path.to_owned()], scale, SizeRule::default())
}

/// The flaw in the verdict on a kind, if anything, and its row of the table.
fn judge(folder: &Workspace, kind: &str, mesh: &TriMesh, wanted: Wanted) -> (Option<String>, String) {
    let path = folder.path("mesh.stl");
    write_stl(&path, mesh);
    let report = check_file(&path, ScaleRule::MetresPerUnit(1.0));
    let row = &report.meshes[0];
    let (reason, figures) = match (&row.record, &row.refusal) {
        (Some(record), _) => {
            let share = 100.0 * row.undecided.expect("a share");
            ("accepted", format!("{share:.0} % undecided, {:.1} cm3", 1e6 * record.volume))
        }
        (None, Some(refusal)) => (refusal.reason.as_str(), refusal.problem.clone()),
        (None, None) => panic!("{kind}: neither record nor refusal"),
    };
    let is_right = match wanted {
        Wanted::Accepted => reason == "accepted",
        Wanted::Refused(reasons) => reasons.contains(&reason),
        Wanted::Either => true,
    };
    let table_row = format!("| {kind} | {reason} | {figures} |");
    ((!is_right).then(|| format!("{table_row}: wanted {wanted:?}")), table_row)
}

#[test]
fn surfaces_without_an_inside_are_refused_and_solids_with_defects_are_not() {
    let folder = Workspace::new();
    let mut wrong = Vec::new();
    println!("| mesh | verdict | figures |\n| --- | --- | --- |");
    for (kind, mesh, wanted) in kinds() {
        let (problem, row) = judge(&folder, &kind, &mesh, wanted);
        println!("{row}");
        wrong.extend(problem);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Whether loose triangles enclose some volume is a matter of chance, so several draws are tried.
#[test]
fn no_draw_of_loose_triangles_is_a_solid() {
    let folder = Workspace::new();
    for (count, spread) in [(10, 0.05), (10, 0.1), (100, 0.05), (100, 0.1), (1_000, 0.03)] {
        for seed in 0..20 {
            let kind = format!("{count} triangles of {spread} m, draw {seed}");
            let (problem, _) = judge(&folder, &kind, &soup(count, spread, seed), NO_SOLID);
            assert_eq!(problem, None);
        }
    }
}

/// Bodies of a scene may be any accepted mesh, with all its defects: a scene of them is kept, or rejected with its
/// reason.
#[test]
#[ignore = "slow: make test-all"]
fn scenes_of_meshes_with_defects_are_kept_or_rejected() {
    const SCENES: u64 = 120;
    let workspace = Workspace::new();
    std::fs::create_dir(workspace.path("meshes")).expect("a folder");
    let kinds = kinds();
    for (number, (_, mesh, _)) in kinds.iter().enumerate() {
        write_stl(&workspace.path(format!("meshes/{number:03}.stl")), mesh);
    }
    let job = format!(
        "product = \"scenes\"\nseed = 3\nmode = \"bin\"\ncount = {{ min = 1, max = 4 }}\nscenes = {{ training = {SCENES} }}\n\
         [[objects]]\nfolder = \"meshes\"\nsizes = [0.5, 1.0]\nbodies = \"join\"\n{NO_SPLIT}"
    );
    let (file, out) = (workspace.write("job.toml", job), workspace.path("scenes"));
    // Some of the meshes are refused, and the scenes made of the others.
    Program::run_job(file, &out).expect_code(3);
    assert_intact(&out, FULL_CHECK);
    let counts = DatasetReader::open(&Folder::at(&out)).expect("a dataset").manifest().counts.clone();
    println!("{} meshes, {} scenes kept, rejected {:?}", 2 * kinds.len(), counts.kept, counts.rejected);
    assert_eq!(counts.kept + counts.rejected.values().sum::<u64>(), SCENES);
    assert!(counts.kept > SCENES / 4, "{counts:?}");
}

/// The union is counted in cells of 1/256 of the longest side, so it may be wrong by their share of the surface.
#[test]
fn parts_that_overlap_are_told_with_the_volume_of_their_union() {
    let folder = Workspace::new();
    let path = folder.path("mesh.stl");
    let nested: Vec<TriMesh> = (1..=10).map(|side| block([0.0; 3], [0.01 * side as f32; 3])).collect();
    let by = |shift: f32| moved(block([0.0; 3], [0.05; 3]), [shift, 0.0, 0.0]);
    for (parts, sum, union) in [
        (vec![by(0.0), by(0.01)], 250e-6, Some(150e-6)),
        (nested, 3025e-6, Some(1000e-6)),
        (vec![by(0.0), by(0.06)], 250e-6, None),
        (vec![by(0.0)], 125e-6, None),
    ] {
        write_stl(&path, &join(&parts));
        let report = check_file(&path, ScaleRule::MetresPerUnit(1.0));
        let row = &report.meshes[0];
        let record = row.record.as_ref().expect("a usable mesh");
        assert!((record.volume - sum).abs() < 1e-6 * sum, "{}", record.volume);
        assert_eq!(row.union.is_some(), union.is_some(), "{row:?}");
        let text = report.to_string();
        assert_eq!(text.contains("as one solid"), union.is_some(), "{text}");
        if let (Some(found), Some(union)) = (row.union, union) {
            assert!((found.volume / union - 1.0).abs() < 0.01, "{found:?}, not {union}");
            assert_eq!(found.cell, record.extents.into_iter().fold(0.0, f64::max) / 256.0);
            let words =
                format!("{:.2} cm3 is a sum over parts; as one solid: {:.2} cm3", 1e6 * sum, 1e6 * found.volume);
            assert!(text.contains(&words), "{text}");
        }
    }
}

#[test]
fn a_mesh_that_single_precision_distorts_is_refused_with_the_figures() {
    let folder = Workspace::new();
    let path = folder.path("mesh.stl");
    let far = |distance: f32| {
        write_stl(&path, &moved(block([0.0; 3], [0.1; 3]), [distance, 0.0, 0.0]));
        check_file(&path, ScaleRule::MetresPerUnit(1.0)).meshes.remove(0)
    };
    assert!(far(100.0).record.is_some_and(|record| record.warnings.len() == 1));
    let refusal = far(1e6).refusal.expect("a refusal");
    assert_eq!(refusal.reason, "far_from_origin");
    // The corner at 1,000,000.1 m is rounded to the next sixteenth.
    let wanted = "reaches 1000000.125 m from its origin, where positions in single precision are 62.500 mm apart: 50 % of its \
                  longest side, 125.000 mm";
    assert_eq!(refusal.problem, wanted);
    assert!(refusal.remedy.starts_with("move the mesh to its origin"), "{}", refusal.remedy);
    // In text the file holds all digits, and the limit is met in the same units.
    let text = folder.path("mesh.off");
    let [low, high] = [1e6, 1e6 + 0.1];
    let corners = format!("{low} 0 0\n{high} 0 0\n{low} 0.1 0\n{low} 0 0.1");
    std::fs::write(&text, format!("OFF\n4 4 6\n{corners}\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")).expect("a file");
    for scale in [ScaleRule::MetresPerUnit(1.0), ScaleRule::LongestSide(0.2)] {
        let refusal = check_file(&text, scale).meshes.remove(0).refusal.expect("a refusal");
        assert!(refusal.problem.contains("apart: 62 % of its longest side"), "{}", refusal.problem);
    }
}
