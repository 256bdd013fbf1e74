//! The Fetch's maps in full: every witness by MuJoCo and coal, the rest by another solver, primitives compared with
//! meshes.

use std::{
    collections::BTreeMap,
    sync::{LazyLock, Mutex},
    thread,
};

use graspmill::{
    collision::{Bodies, CollisionChecker, CollisionVerdict},
    files::Folder,
    format::{
        ReachabilityBlock,
        dataset::{DatasetReader, Selection},
        extras::read_field,
    },
    geom::{AxisGrid, EndEffector, Pose, PoseGrid, PoseLabel, Proof, World, rotation_from_rpy},
    kinematics::{PlanningGroup, SolverSettings, solve_numeric},
    seed::Stream,
};
use nalgebra::{IsometryMatrix3, Matrix3, Vector3};

use super::coal::ask_coal;
use crate::support::{
    program::Program,
    robots::{FETCH_ARM, FETCH_MESHES, FETCH_SITE, open_robot, random_values},
    workspace::Workspace,
};

/// A map as its dataset has it, cell by cell.
struct Map {
    grid: AxisGrid,
    labels: Vec<PoseLabel>,
    proofs: Vec<Proof>,
    witnesses: Vec<Option<[f64; 7]>>,
}

static MESHES: LazyLock<Map> = LazyLock::new(|| Map::make("jobs/fetch-reachability-meshes.toml"));
static PRIMITIVES: LazyLock<Map> = LazyLock::new(|| Map::make("jobs/fetch-reachability.toml"));

impl Map {
    fn make(job: &str) -> Self {
        let folder = Workspace::new();
        let data = folder.path("map");
        Program::run_job(job, &data).succeed();
        let PoseGrid::Axes(grid) = read_field(&Folder::at(&data)).expect("a field").header.grid else {
            panic!("six axes")
        };
        let mut map = Self { grid, labels: Vec::new(), proofs: Vec::new(), witnesses: Vec::new() };
        for sample in DatasetReader::open(&Folder::at(&data)).expect("a dataset").iter(Selection::default()) {
            let block = sample.expect("a sample").read::<ReachabilityBlock>().expect("a block");
            let witness = |index| block.witness(index).map(|q| q.try_into().expect("seven joints"));
            map.witnesses.extend((0..block.labels.len()).map(witness));
            map.labels.extend_from_slice(&block.labels);
            map.proofs.extend_from_slice(&block.proofs);
        }
        assert_eq!(map.labels.len(), map.grid.cells());
        map
    }

    fn target(&self, cell: usize) -> Pose<World, EndEffector> {
        let [x, y, z, roll, pitch, yaw] = self.grid.pose(cell);
        Pose::new(rotation_from_rpy(roll, pitch, yaw), Vector3::new(x, y, z))
    }

    /// The other cell with the same pose.
    fn twin(&self, cell: usize) -> usize {
        let [x, y, z, roll, pitch, yaw] = self.grid.coordinates(cell);
        self.grid.index([x, y, z, (roll + 1) % 2, (12 - pitch) % 8, (yaw + 4) % 8])
    }

    fn count(&self, label: PoseLabel) -> usize {
        self.labels.iter().filter(|other| **other == label).count()
    }
}

fn open_mesh_fetch() -> (PlanningGroup, Bodies) {
    let (model, none) = (open_robot(FETCH_MESHES), BTreeMap::new());
    let group = model.planning_group(&FETCH_ARM, FETCH_SITE, &none).expect("the arm");
    (group, model.bodies(&FETCH_ARM, &none).expect("bodies"))
}

/// Zero false "reachable": every witness, by programs that are not ours.
#[test]
#[ignore = "slow: make test-all"]
fn every_witness_of_the_mesh_fetch_holds() {
    let map = &*MESHES;
    let (group, bodies) = open_mesh_fetch();
    let counts = PoseLabel::ALL.map(|label| map.count(label));
    println!("{counts:?} cells without a solution, colliding, reachable");
    println!(
        "reachable: {} more than the thesis's 102,692; the recount: about 103,300. With a solution: {}; the recount: \
         about 119,100",
        counts[2] - 102_692,
        counts[1] + counts[2]
    );
    let mut proofs = BTreeMap::<_, usize>::new();
    map.labels.iter().zip(&map.proofs).for_each(|known| *proofs.entry(known).or_default() += 1);
    println!("{proofs:?}");
    for cell in 0..map.grid.cells() {
        let twin = map.twin(cell);
        let apart = map.target(cell).rotation().matrix() - map.target(twin).rotation().matrix();
        assert!(twin != cell && apart.amax() < 1e-12);
        assert_eq!((map.labels[cell], map.proofs[cell]), (map.labels[twin], map.proofs[twin]), "{cell} and {twin}");
    }
    let cells: Vec<usize> = (0..map.grid.cells()).filter(|cell| map.witnesses[*cell].is_some()).collect();
    assert!(cells.iter().all(|cell| map.labels[*cell] == PoseLabel::Reachable) && cells.len() == counts[2]);
    let witnesses: Vec<[f64; 7]> = cells.iter().filter_map(|cell| map.witnesses[*cell]).collect();
    let answer = ask_coal(&bodies, &witnesses);
    let (mut off, mut angle) = (0.0f64, 0.0f64);
    for ((cell, q), pose) in cells.iter().zip(&witnesses).zip(&answer.poses) {
        assert!(group.within_limits(q), "{cell}: {q:?}");
        let target = map.target(*cell);
        off = off.max((target.translation() - Vector3::from_row_slice(&pose[..3])).norm());
        // |R - S| = 2 sqrt 2 sin(angle / 2)
        let apart = target.rotation().matrix() - Matrix3::from_row_slice(&pose[3..]);
        angle = angle.max(2.0 * (apart.norm() / 8f64.sqrt()).asin());
    }
    let collide = answer.collides.iter().filter(|collides| **collides).count();
    println!("{} witnesses: at most {off:.1e} m and {angle:.1e} rad off; {collide} collide", witnesses.len());
    println!("coal: {}", answer.facts);
    assert!(off < 1e-6 && angle < 1e-6 && collide == 0);
    assert!((103_000..103_700).contains(&counts[2]) && (119_050..119_150).contains(&(counts[1] + counts[2])));
}

/// No false "not reachable" that another solver finds, 200 random starts each: of 20,000 random cells those that no bound
/// decides, and more of these.
#[test]
#[ignore = "slow: make test-all"]
fn a_numeric_solver_upgrades_no_cell_of_the_mesh_fetch() {
    const CELLS: usize = 20_000;
    const SEARCHED: usize = 4_000;
    let map = &*MESHES;
    let (group, bodies) = open_mesh_fetch();
    let checker = CollisionChecker::new(&bodies).expect("shapes");
    let mut refused: Vec<usize> =
        (0..map.grid.cells()).filter(|cell| map.labels[*cell] != PoseLabel::Reachable).collect();
    Stream::of_job(1, b"fetch", "cells").shuffle(&mut refused);
    // A bound needs no search: the wrist is farther from the shoulder's circle than the arm is long.
    let far = |cell: &usize| {
        let target = map.target(*cell);
        let wrist = target.translation() - target.rotation() * Vector3::x() * 0.1385;
        let middle = Vector3::new(0.119525 - 0.086875, 0.0, 0.37743 + 0.34858 + 0.06);
        let apart = wrist - middle;
        (apart.xy().norm() - 0.117).hypot(apart.z) > 0.219 + 0.133 + 0.197 + 0.1245
    };
    let bounded: Vec<usize> = refused.iter().copied().filter(|cell| map.proofs[*cell] == Proof::Bound).collect();
    assert!(bounded.iter().all(far));
    let open = |cell: &usize| map.proofs[*cell] != Proof::Bound;
    let of_the_first = refused[..CELLS].iter().copied().filter(open).count();
    let searched: Vec<usize> = refused.into_iter().filter(open).take(SEARCHED.max(of_the_first)).collect();
    let colliding = searched.iter().filter(|cell| map.labels[**cell] == PoseLabel::Colliding).count();
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let (solved, upgraded) = (Mutex::new(0usize), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for first in 0..threads {
            let (map, group, bodies, checker) = (&map, &group, &bodies, &checker);
            let (searched, solved, upgraded) = (&searched, &solved, &upgraded);
            scope.spawn(move || {
                for cell in searched.iter().skip(first).step_by(threads) {
                    let found = find_solutions(group, &map.target(*cell), *cell);
                    let free = found.iter().find(|q| {
                        let mut links = [IsometryMatrix3::identity(); 8];
                        group.link_frames(&q[..], &mut links[1..]);
                        checker.check(0..bodies.pairs.len(), &links) == CollisionVerdict::Free
                    });
                    let kinematic = map.labels[*cell] == PoseLabel::NoSolution;
                    *solved.lock().expect("a count") += usize::from(!found.is_empty());
                    if free.is_some() || kinematic && !found.is_empty() {
                        let entry = (*cell, map.labels[*cell], map.proofs[*cell], free.or(found.first()).copied());
                        upgraded.lock().expect("a list").push(entry);
                    }
                }
            });
        }
    });
    let (solved, mut upgraded) = (solved.into_inner().expect("a count"), upgraded.into_inner().expect("a list"));
    upgraded.sort_by_key(|entry| entry.0);
    println!(
        "of {CELLS} cells {} are too far away; of {} others, {colliding} labelled colliding, the solver has ways to {solved}; \
         {} upgraded",
        CELLS - of_the_first,
        searched.len(),
        upgraded.len()
    );
    upgraded.iter().for_each(|entry| println!("{entry:?} {:?}", map.grid.pose(entry.0)));
    assert!(upgraded.is_empty());
}

/// Solutions to which 200 random starts lead.
fn find_solutions(group: &PlanningGroup, target: &Pose<World, EndEffector>, cell: usize) -> Vec<[f64; 7]> {
    let settings = SolverSettings { steps: 60, ..SolverSettings::default() };
    let mut stream = Stream::of_job(1, &cell.to_le_bytes(), "starts");
    let mut found = Vec::new();
    for _ in 0..200 {
        let start = random_values(group, &mut stream);
        if let Some(solution) = solve_numeric(group, target, &start, &settings) {
            found.push(solution.q.try_into().expect("seven joints"));
        }
    }
    found
}

/// The two models of one robot, cell by cell.
#[test]
#[ignore = "slow: make test-all"]
fn the_primitive_fetch_reaches_what_the_mesh_fetch_does() {
    let (meshes, primitives) = (&*MESHES, &*PRIMITIVES);
    let mut table = [[0usize; 3]; 3];
    for (mesh, primitive) in meshes.labels.iter().zip(&primitives.labels) {
        table[*mesh as usize][*primitive as usize] += 1;
    }
    let cells = meshes.grid.cells() as f64;
    let agree = (table[0][0] + table[1][1] + table[2][2]) as f64 / cells;
    let more = table[0][2] + table[1][2];
    println!("meshes down, primitives across: {table:?}");
    println!("{:.3} % agree; {more} cells ({:.4} %) by primitives alone", 100.0 * agree, 100.0 * more as f64 / cells);
    assert!(agree >= 0.97 && more as f64 <= 0.002 * cells);
}
