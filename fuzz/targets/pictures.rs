//! Files that `complete` reads: depth pictures and masks, cameras, models.

use std::{collections::BTreeMap, fs, path::PathBuf, sync::LazyLock};

use graspmill::{
    infer::CompletionModel,
    perception::{
        CameraDescription, CameraRule, Distortion, FrameRule, Refusal, RosImage, SceneRule, SegmentedScene, read_frame,
        read_mask,
    },
};
use serde_json::Value;

use super::inputs::{repository_folder, scratch};

/// Files that show one scene, by the first byte of an input of the target `picture`.
pub const PICTURES: [&str; 5] = ["picture.png", "picture.npy", "picture.pcd", "picture.ply", "mask.png"];
/// Files of a camera, by the first byte of an input of the target `camera`.
pub const CAMERAS: [&str; 2] = ["camera.json", "camera.yaml"];
/// Files of a model, by the first byte of an input of the target `model`.
pub const MODELS: [&str; 3] = ["model.json", "golden.npz", "model.onnx"];

/// Folder of the small model of the tests.
static THICKEN: LazyLock<PathBuf> = LazyLock::new(|| repository_folder("tests/models/thicken"));

/// Largest picture that is also taken apart [px]: a larger one takes as long as it is large.
const MAX_SEGMENTED: usize = 128 * 128;

/// A depth picture of the kind that the first byte names, read by the camera that its upper bits choose, and taken apart; or a
/// mask of an 11 x 7 px picture.
pub fn picture(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let folder = scratch();
        fs::write(folder.path().join("whole.npy"), whole_picture()).expect("a file");
        folder
    });
    let Some((choice, bytes)) = input.split_first() else { return };
    let name = PICTURES[usize::from(*choice) % PICTURES.len()];
    let is_cloud = name.ends_with("pcd") || name.ends_with("ply");
    let path = SCRATCH.path().join(name);
    fs::write(&path, bytes).expect("a file");
    let lens = if choice & 64 == 0 { [0.0; 8] } else { [0.1, -0.2, 0.001, 0.002, 0.03, 0.2, -0.1, 0.05] };
    let distortion = Distortion::from_opencv(lens);
    let camera = CameraDescription { distortion, ..CameraDescription::pinhole([20.0, 21.0, 5.2, 3.9]) };
    // The upper bit: distances in place of depths of images, mirrored axes of clouds.
    let (is_range, is_flipped) = (choice & 128 != 0 && !is_cloud, choice & 128 != 0 && is_cloud);
    let rule = FrameRule { camera: (!is_cloud).then_some(camera), is_range, is_flipped, ..FrameRule::default() };
    if name == "mask.png" {
        let whole = read_frame(&SCRATCH.path().join("whole.npy"), &rule).expect("a picture").frame;
        match read_mask(&path, &whole) {
            Ok(pixels) => {
                assert!(pixels.is_sorted() && pixels.iter().all(|pixel| (*pixel as usize) < whole.depth.len()))
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
        return;
    }
    let read = match read_frame(&path, &rule) {
        Ok(read) => read,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let pixels = read.frame.depth.len();
    assert_eq!(pixels, read.frame.camera.width as usize * read.frame.camera.height as usize);
    assert!(read.labels.is_none_or(|labels| labels.len() == pixels));
    assert!(read.frame.depth.iter().all(|depth| depth.is_nan() || (*depth > 0.0 && depth.is_finite())));
    if pixels <= MAX_SEGMENTED {
        let scene = SegmentedScene::segment(read.frame, &SceneRule::default());
        assert_eq!(scene.labels(0.008).labels.len(), pixels);
        for (cluster, sheet) in scene.clusters.iter().zip(scene.sheets()) {
            assert!(cluster.pixels.is_sorted() && cluster.pixels.iter().all(|pixel| (*pixel as usize) < pixels));
            let corners = sheet.vertices.len() as u32;
            assert!(sheet.triangles.iter().flatten().all(|corner| *corner < corners));
            let _ = Refusal::from_cluster(cluster, &sheet);
        }
    }
}

/// A camera of the kind of file that the first byte names.
pub fn camera(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(scratch);
    let Some((choice, bytes)) = input.split_first() else { return };
    let path = SCRATCH.path().join(CAMERAS[usize::from(*choice) % CAMERAS.len()]);
    fs::write(&path, bytes).expect("a file");
    let entry = |name: &str| CameraRule { entry: Some(name.to_owned()), ..CameraRule::default() };
    let rectified = CameraRule { image: Some(RosImage::Rectified), ..CameraRule::default() };
    for rule in [CameraRule::default(), entry("0"), entry("cam0"), rectified] {
        match rule.read(&path) {
            Ok(camera) => assert!(camera.with_centres_at_half().iter().all(|number| number.is_finite())),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

/// A model's folder, one file of which is the input, with the expected digest: opened, and compared with its samples.
pub fn model(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let folder = scratch();
        for name in MODELS.into_iter().chain(["card.md"]) {
            fs::copy(THICKEN.join(name), folder.path().join(name)).expect("a copy");
        }
        folder
    });
    let Some((choice, bytes)) = input.split_first() else { return };
    let name = MODELS[usize::from(*choice) % MODELS.len()];
    let (path, stated) = (SCRATCH.path().join(name), SCRATCH.path().join("model.json"));
    fs::write(&path, bytes).expect("a file");
    if name != "model.json" {
        fs::write(&stated, stating(name, bytes)).expect("a file");
    }
    match CompletionModel::open(SCRATCH.path()).and_then(|model| model.check_golden()) {
        Ok(check) => assert!(check.samples > 0),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    for name in [name, "model.json"] {
        fs::copy(THICKEN.join(name), SCRATCH.path().join(name)).expect("a copy");
    }
}

/// `model.json` with the digest of a changed file.
fn stating(name: &str, bytes: &[u8]) -> Vec<u8> {
    static FACTS: LazyLock<BTreeMap<String, Value>> = LazyLock::new(|| {
        let text = fs::read(THICKEN.join("model.json")).expect("a file");
        serde_json::from_slice(&text).expect("JSON")
    });
    let mut facts = FACTS.clone();
    facts.get_mut("files").expect("a table")[name] = sha256(bytes).into();
    serde_json::to_vec(&facts).expect("JSON")
}

fn sha256(bytes: &[u8]) -> String {
    use sha2::Digest;
    sha2::Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A picture of 11 x 7 px with a return in each.
fn whole_picture() -> Vec<u8> {
    let head = "{'descr': '<f4', 'fortran_order': False, 'shape': (7, 11), }\n";
    let depth: Vec<u8> = (0..77).flat_map(|pixel| (0.7f32 + 0.001 * pixel as f32).to_le_bytes()).collect();
    [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes(), &depth].concat()
}
