//! Inputs that a user writes or finds: jobs, hands, robots, meshes, grids.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
};

use graspmill::{
    assets::{MeshSource, Repair, built_in_names, prepare, read_triangles},
    description::{Description, DescriptionText},
    factory::{
        job::{JobContext, JobDraft, JobSet, JobText},
        plan::Plan,
    },
    hand::HandTable,
    voxel::Binvox,
};

/// Endings of mesh files.
pub const MESHES: [&str; 4] = ["stl", "obj", "ply", "off"];

/// Files of the arrangements of others: poses and cameras of BOP, and a table.
pub const ARRANGEMENTS: [&str; 3] = ["scene_gt.json", "scene_camera.json", "poses.csv"];

/// A folder of this process alone, in memory where the machine has such a place.
pub fn scratch() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let parent = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    tempfile::tempdir_in(parent).expect("a scratch folder")
}

/// A folder of the repository, whose own manifest or the fuzzer's this crate is built by.
pub fn repository_folder(name: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let found = [here.join(name), here.join("..").join(name)].into_iter().find(|folder| folder.is_dir());
    found.unwrap_or_else(|| panic!("no {name} in the repository"))
}

/// A job file, or one of a set: read, checked, its mistakes rendered; what needs no mesh is resolved, written back and read
/// again.
pub fn job(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let folder = scratch();
        fs::write(folder.path().join("robot.xml"), "<mujoco model='robot'/>").expect("a robot");
        fs::write(folder.path().join("hand.xml"), "<mujoco model='hand'/>").expect("a hand");
        fs::write(folder.path().join("hand.toml"), "").expect("a table");
        fs::write(folder.path().join("part.off"), "OFF\n").expect("a mesh");
        fs::write(folder.path().join("masses.csv"), "name,mass\npart,0.1\n").expect("a table");
        folder
    });
    let Ok(text) = std::str::from_utf8(input) else { return };
    // The other folders of this machine are none of the input.
    if ["..", "/", "\\u"].iter().any(|word| text.contains(word)) {
        return;
    }
    let named = |text: String| JobText {
        label: "job.toml".to_owned(),
        folder: SCRATCH.path().to_owned(),
        text,
        overrides: vec![],
    };
    let read = |text: &JobText| {
        let context = JobContext { packages: SCRATCH.path().join("packages"), built_in: built_in_names(24).collect() };
        JobDraft::read(text, &context)
    };
    let written = named(text.to_owned());
    if JobSet::is_one(&written) {
        match JobSet::read(&written) {
            Ok(_) => {}
            Err(errors) => assert!(!errors.render().is_empty()),
        }
        return;
    }
    let draft = match read(&written) {
        Ok(draft) => draft,
        Err(errors) => return assert!(!errors.render().is_empty()),
    };
    if draft.sources().next().is_some() {
        return;
    }
    let Ok(job) = draft.resolve(Vec::new()) else { return };
    let _ = Plan::new(&job.work.subjects(), job.shard_samples);
    let again = named(job.to_toml(SCRATCH.path()));
    let again = read(&again).map_err(|errors| errors.render()).expect("a resolved job reads back");
    let again = again.resolve(Vec::new()).map_err(|errors| errors.render()).expect("and resolves");
    assert_eq!(again.digest(), job.digest(), "a resolved job is the same job");
}

/// A file of the arrangements that a job names, of the kind that the first byte selects, with valid other files.
pub fn arrangement(input: &[u8]) {
    const POSES: &str = r#"{"1":[{"obj_id":1,"cam_R_m2c":[1,0,0,0,1,0,0,0,1],"cam_t_m2c":[0,0,700]}]}"#;
    const CAMERA: &str =
        r#"{"1":{"cam_K":[600,0,320,0,600,240,0,0,1],"cam_R_w2c":[1,0,0,0,1,0,0,0,1],"cam_t_w2c":[0,0,0]}}"#;
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(scratch);
    let Some((choice, bytes)) = input.split_first() else { return };
    let name = ARRANGEMENTS[usize::from(*choice) % ARRANGEMENTS.len()];
    fs::write(SCRATCH.path().join(ARRANGEMENTS[0]), POSES).expect("a file");
    fs::write(SCRATCH.path().join(ARRANGEMENTS[1]), CAMERA).expect("a file");
    fs::write(SCRATCH.path().join(name), bytes).expect("a file");
    let source =
        if name == ARRANGEMENTS[2] { "csv = \"poses.csv\"" } else { "bop = [\".\"]\nobjects = { 1 = \"box-01\" }" };
    let text = JobText {
        label: "job.toml".to_owned(),
        folder: SCRATCH.path().to_owned(),
        text: format!("product = \"scenes\"\n[[objects]]\nbuilt_in = [\"box-01\", \"can-01\"]\n[import]\n{source}\n"),
        overrides: vec![],
    };
    let context = JobContext { packages: SCRATCH.path().join("packages"), built_in: built_in_names(24).collect() };
    if let Err(errors) = JobDraft::read(&text, &context) {
        assert!(!errors.render().is_empty());
    }
}

/// A hand's table.
pub fn hand(input: &[u8]) {
    let Ok(text) = std::str::from_utf8(input) else { return };
    match HandTable::parse(Path::new("hand.toml"), text) {
        Ok(_) => {}
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// A description, as far as the program itself reads it: its elements and the files that it names.
pub fn description(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(scratch);
    // Devices of this machine are none of the input.
    if input.contains(&b'/') && input.windows(2).any(|pair| pair == b"\"/" || pair == b"'/" || pair == b"..") {
        return;
    }
    let path = SCRATCH.path().join("robot.xml");
    fs::write(&path, input).expect("a file");
    for error in [Description::read(&path).err(), DescriptionText::read(&path).err()].into_iter().flatten() {
        assert!(!error.to_string().is_empty() && !error.remedy().is_empty());
    }
}

/// A mesh file of the format that the first byte names: read, repaired, checked.
pub fn mesh(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(scratch);
    let Some((format, bytes)) = input.split_first() else { return };
    let path = SCRATCH.path().join(format!("mesh.{}", MESHES[usize::from(*format) % MESHES.len()]));
    fs::write(&path, bytes).expect("a file");
    let raw = read_triangles(&path);
    match prepare(&MeshSource::of_file("mesh", &path)) {
        Ok(prepared) => {
            // A corner that no face uses may be anything, and is dropped.
            let unused = prepared.record.repairs.iter().any(|repair| matches!(repair, Repair::UnusedVertices { .. }));
            assert!(raw.is_ok() || unused, "what is prepared can be read");
            let corners = prepared.mesh.vertices.len() as u32;
            assert!(prepared.mesh.triangles.iter().flatten().all(|corner| *corner < corners));
            assert!(prepared.mesh.vertices.iter().all(|vertex| vertex.iter().all(|x| x.is_finite())));
        }
        Err(refusal) => assert!(!refusal.to_string().is_empty()),
    }
}

/// A binvox file; one that is read is written and read again.
pub fn binvox(input: &[u8]) {
    match Binvox::from_bytes(input) {
        Ok(grid) => {
            let again = Binvox::from_bytes(&grid.to_bytes()).expect("what was written reads back");
            assert_eq!(again.grid, grid.grid);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}
