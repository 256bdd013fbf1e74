//! Arrangements from folders of the BOP challenge: `scene_gt.json` with the poses of models in the frames of cameras,
//! and `scene_camera.json` with the cameras in the world. Fields by the format description of BOP (bop.felk.cvut.cz,
//! "BOP format"): rotations by rows, translations in millimetres.

use std::{collections::BTreeMap, fmt, marker::PhantomData};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, Error, MapAccess, Visitor},
};

use form::{FormError, Mistakes, Source};
use kernel::geom::{CameraCv, Object, Pose, SourceWorld};

use super::{
    ImportedBody,
    found::{FoundBody, FoundScene, mistake},
};

/// Key that names the folders.
pub(super) const KEY: &str = "import.bop";

/// The files of a folder.
pub(super) const FILES: [&str; 2] = ["scene_gt.json", "scene_camera.json"];

/// Deviation of a rotation from one that is orthonormal that is rounding: files have six digits or more.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Millimetres per metre.
const MM: f64 = 1e3;

/// A folder as it was read.
pub(super) struct BopFolder<'a> {
    /// Name of the folder, for people.
    pub name: &'a str,
    /// Names of its files, for messages.
    pub labels: [&'a str; 2],
    /// Their texts.
    pub texts: [&'a str; 2],
}

/// Choice of the images of a folder that are scenes.
pub(super) enum ImageChoice<'a> {
    First,
    All,
    Numbers(&'a [u32]),
}

/// The pose of a model in an image.
#[derive(Deserialize)]
struct ModelPose {
    obj_id: u32,
    #[serde(rename = "cam_R_m2c")]
    rotation: [f64; 9],
    #[serde(rename = "cam_t_m2c")]
    translation: [f64; 3],
}

/// The pose of a camera, if its file has one.
#[derive(Clone, Copy, Deserialize)]
struct CameraPose {
    #[serde(rename = "cam_R_w2c")]
    rotation: Option<[f64; 9]>,
    #[serde(rename = "cam_t_w2c")]
    translation: Option<[f64; 3]>,
}

/// Entries of a file by the number of the image, each once.
struct ByImage<T>(BTreeMap<u32, T>);

impl<'de, T: DeserializeOwned> Deserialize<'de> for ByImage<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: DeserializeOwned> Visitor<'de> for Entries<T> {
            type Value = ByImage<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object whose keys are numbers of images")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = BTreeMap::new();
                while let Some((image, entry)) = map.next_entry::<u32, T>()? {
                    if entries.insert(image, entry).is_some() {
                        return Err(A::Error::custom(format!("image {image} is listed twice")));
                    }
                }
                Ok(ByImage(entries))
            }
        }
        deserializer.deserialize_map(Entries(PhantomData))
    }
}

impl BopFolder<'_> {
    /// The arrangements of a folder, and every mistake. `objects` are the names of objects by `obj_id`; without `has_up` the
    /// cameras must have poses in the world.
    pub fn scenes(
        &self,
        images: &ImageChoice<'_>,
        objects: &BTreeMap<u32, String>,
        has_up: bool,
    ) -> (Vec<FoundScene>, Mistakes) {
        let (mut scenes, mut errors) = (Vec::new(), Mistakes::default());
        let poses = self.entries::<Vec<ModelPose>>(0, "per image a list of obj_id, cam_R_m2c and cam_t_m2c");
        let cameras = self.entries::<CameraPose>(1, "per image its camera");
        let (poses, cameras) = match (poses, cameras) {
            (Ok(poses), Ok(cameras)) => (poses, cameras),
            (poses, cameras) => {
                for error in poses.err().into_iter().chain(cameras.err()) {
                    errors.push(*error);
                }
                return (scenes, errors);
            }
        };
        let sources = [0, 1].map(|file| Source::new(self.labels[file], self.texts[file]));
        let chosen: Vec<u32> = match images {
            ImageChoice::First => poses.keys().copied().take(1).collect(),
            ImageChoice::All => poses.keys().copied().collect(),
            ImageChoice::Numbers(numbers) => numbers.to_vec(),
        };
        if chosen.is_empty() {
            errors.push(mistake(sources[0].location(&(0..0)), KEY, "at least one image", "none", None));
        }
        let places = self.texts.map(Places::of);
        for image in chosen {
            let at = |file: usize, entry: usize| sources[file].location(&places[file].range(image, entry));
            let Some(entries) = poses.get(&image) else {
                let found = format!("no image {image}");
                let help = Some("name others in `import.images`".to_owned());
                errors.push(mistake(sources[0].location(&(0..0)), KEY, "an image of this folder", found, help));
                continue;
            };
            let world_from_camera = match cameras.get(&image).map(|camera| camera.world_from_camera(has_up)) {
                Some(Ok(pose)) => pose,
                Some(Err([expected, found, help])) => {
                    errors.push(mistake(at(1, 0), KEY, expected, found, Some(help)));
                    continue;
                }
                None => {
                    let found = format!("no entry \"{image}\"");
                    let help = Some("every image of scene_gt.json has a camera".to_owned());
                    let expected = format!("the camera of image {image}");
                    errors.push(mistake(sources[1].location(&(0..0)), KEY, expected, found, help));
                    continue;
                }
            };
            let mut bodies = Vec::new();
            for (index, entry) in entries.iter().enumerate() {
                match entry.pose(&world_from_camera) {
                    Ok(pose) => {
                        let named = objects.get(&entry.obj_id).cloned();
                        let object = named.unwrap_or_else(|| format!("obj_{:06}", entry.obj_id));
                        let body = ImportedBody { object, pose };
                        bodies.push(FoundBody { body, obj_id: Some(entry.obj_id), location: at(0, index) });
                    }
                    Err([expected, found, help]) => {
                        errors.push(mistake(at(0, index), KEY, expected, found, Some(help)));
                    }
                }
            }
            let source = format!("{}, image {image}", self.name);
            scenes.push(FoundScene { source, bodies, location: at(0, 0) });
        }
        (scenes, errors)
    }

    /// Entries of a file by image.
    fn entries<T: DeserializeOwned>(&self, file: usize, content: &str) -> Result<BTreeMap<u32, T>, Box<FormError>> {
        let text = self.texts[file];
        let read: Result<ByImage<T>, serde_json::Error> = serde_json::from_str(text);
        read.map(|ByImage(entries)| entries).map_err(|error| {
            let before: usize = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
            let at = before + error.column().saturating_sub(1);
            let expected = format!("a {} of BOP: {content}", FILES[file]);
            let location = Source::new(self.labels[file], text).location(&(at..at + 1));
            Box::new(mistake(location, KEY, expected, error.to_string(), None))
        })
    }
}

/// Positions of the entries of a file, found in one pass.
struct Places {
    /// First byte of the first key of each number of an image.
    images: BTreeMap<u32, usize>,
    /// First byte of each `"obj_id"`.
    objects: Vec<usize>,
}

impl Places {
    const OBJECT: &'static str = "\"obj_id\"";

    fn of(text: &str) -> Self {
        let objects = text.match_indices(Self::OBJECT).map(|(at, _)| at).collect();
        let mut images = BTreeMap::new();
        for (at, _) in text.match_indices('"') {
            let digits =
                text[at + 1..].split('"').next().filter(|key| key.len() <= 10).and_then(|key| key.parse().ok());
            if let Some(image) = digits {
                images.entry(image).or_insert(at);
            }
        }
        Self { images, objects }
    }

    /// Bytes of the key of an image, or of one of the objects in it.
    fn range(&self, image: u32, entry: usize) -> std::ops::Range<usize> {
        let start = self.images.get(&image).copied().unwrap_or(0);
        let first = self.objects.partition_point(|at| *at < start);
        match self.objects.get(first + entry) {
            Some(at) => *at..at + Self::OBJECT.len(),
            None => start..start + format!("\"{image}\"").len(),
        }
    }
}

impl CameraPose {
    /// Pose of the camera in the world: the world is the camera's own frame where its file has none.
    fn world_from_camera(&self, has_up: bool) -> Result<Pose<SourceWorld, CameraCv>, [String; 3]> {
        let wrong = |found: &str, help: &str| {
            let expected = "cam_R_w2c and cam_t_w2c of the camera";
            [expected.to_owned(), found.to_owned(), help.to_owned()]
        };
        match (self.rotation, self.translation) {
            (Some(rotation), Some(translation)) => {
                let camera_from_world: Pose<CameraCv, SourceWorld> = pose_of("cam_R_w2c", &rotation, &translation)?;
                Ok(camera_from_world.inverse())
            }
            (None, None) if has_up => Ok(Pose::identity()),
            (None, None) => Err(wrong(
                "neither",
                "without them the world is the camera's frame: give `import.up` or `import.container_pose` in it",
            )),
            _ => Err(wrong("one of the two", "write both or neither")),
        }
    }
}

impl ModelPose {
    /// Pose of the model in the world, as numbers; or what was expected, what was found, and the remedy.
    fn pose(&self, world_from_camera: &Pose<SourceWorld, CameraCv>) -> Result<[f64; 7], [String; 3]> {
        let camera_from_object: Pose<CameraCv, Object> = pose_of("cam_R_m2c", &self.rotation, &self.translation)?;
        let pose = *world_from_camera * camera_from_object;
        let [x, y, z] = (*pose.translation()).into();
        let quaternion = UnitQuaternion::from_rotation_matrix(pose.rotation());
        Ok([x, y, z, quaternion.i, quaternion.j, quaternion.k, quaternion.w])
    }
}

/// A pose from nine numbers by rows and three in millimetres.
fn pose_of<To: kernel::geom::Frame, From: kernel::geom::Frame>(
    field: &str,
    rows: &[f64; 9],
    millimetres: &[f64; 3],
) -> Result<Pose<To, From>, [String; 3]> {
    let wrong = |found: String, help: &str| [format!("a rotation in {field}"), found, help.to_owned()];
    let matrix = Matrix3::from_row_slice(rows);
    let error = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    if !error.is_finite() || !millimetres.iter().all(|part| part.is_finite()) {
        return Err(wrong("numbers that are not finite".to_owned(), "leave the body out"));
    }
    if error > ROTATION_TOLERANCE {
        let help =
            "lengths are scaled in [[objects]] (`unit`, `scale`), not in poses; write rows of length 1 at right angles";
        return Err(wrong(format!("a matrix that differs from one by {error:.3}"), help));
    }
    if matrix.determinant() < 0.0 {
        let help = "a pose cannot contain a reflection: mirror the axis in the file or in the model";
        return Err(wrong("left-handed axes (determinant -1)".to_owned(), help));
    }
    // Rounded numbers become a rotation to the last digit.
    let rounded = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let rotation = UnitQuaternion::new_normalize(rounded.into_inner()).to_rotation_matrix();
    Ok(Pose::new(rotation, Vector3::from(*millimetres) / MM))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: &str = r#"{"3": {"cam_K": [1,0,0,0,1,0,0,0,1], "cam_R_w2c": [1,0,0,0,-1,0,0,0,-1], "cam_t_w2c":
                            [0,0,700]},
        "12": {"cam_K": [1,0,0,0,1,0,0,0,1], "cam_R_w2c": [1,0,0,0,-1,0,0,0,-1], "cam_t_w2c": [0,0,700]}}"#;

    const POSES: &str = r#"{
  "12": [{"cam_R_m2c": [1,0,0,0,1,0,0,0,1], "cam_t_m2c": [1,2,3], "obj_id": 5}],
  "3": [{"cam_R_m2c": [1,0,0,0,-1,0,0,0,-1], "cam_t_m2c": [100,0,650], "obj_id": 5},
        {"cam_R_m2c": [0,-1,0,-1,0,0,0,0,-1], "cam_t_m2c": [0,50,680], "obj_id": 7}]
}"#;

    fn read(poses: &str, camera: &str, images: &ImageChoice<'_>, has_up: bool) -> (Vec<FoundScene>, Vec<String>) {
        let folder = BopFolder { name: "000048", labels: ["gt.json", "camera.json"], texts: [poses, camera] };
        let objects = BTreeMap::from([(5, "mug".to_owned())]);
        let (scenes, errors) = folder.scenes(images, &objects, has_up);
        (scenes, errors.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn poses_are_those_of_models_in_the_world() {
        let (scenes, errors) = read(POSES, CAMERA, &ImageChoice::First, false);
        assert_eq!((scenes.len(), errors), (1, Vec::new()));
        assert_eq!(scenes[0].source, "000048, image 3");
        let bodies: Vec<&ImportedBody> = scenes[0].bodies.iter().map(|found| &found.body).collect();
        assert_eq!((bodies[0].object.as_str(), bodies[1].object.as_str()), ("mug", "obj_000007"));
        // A camera 70 cm above the world's origin looks down: both models stand upright, the second rotated about the vertical.
        for (pose, expected) in bodies
            .iter()
            .map(|body| body.pose)
            .zip([[0.1, 0.0, 0.05, 0.0, 0.0, 0.0, 1.0], [0.0, -0.05, 0.02, 0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()]])
        {
            assert!(pose.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{pose:?} {expected:?}");
        }
        assert_eq!((scenes[0].bodies[1].location.line, scenes[0].bodies[1].obj_id), (4, Some(7)));
        // All images, by number; and some.
        let sources = |images: &ImageChoice<'_>| -> Vec<String> {
            read(POSES, CAMERA, images, false).0.into_iter().map(|scene| scene.source).collect()
        };
        assert_eq!(sources(&ImageChoice::All), ["000048, image 3", "000048, image 12"]);
        assert_eq!(sources(&ImageChoice::Numbers(&[12])), ["000048, image 12"]);
    }

    #[test]
    fn every_mistake_is_said_with_its_line_and_remedy() {
        let first = &ImageChoice::First;
        let without = r#"{"3": {"depth_scale": 0.1}, "12": {}}"#;
        let half = r#"{"3": {"cam_t_w2c": [0,0,1]}, "12": {}}"#;
        let mirrored = POSES.replace("[1,0,0,0,-1,0,0,0,-1]", "[1,0,0,0,-1,0,0,0,1]");
        let scaled = POSES.replace("[1,0,0,0,-1,0,0,0,-1]", "[2,0,0,0,-2,0,0,0,-2]");
        let twice = POSES.replace("\"12\"", "\"3\"");
        let short = POSES.replace("[100,0,650]", "[100,0]");
        for (poses, camera, images, expected) in [
            (POSES, without, first, ["camera.json:1:", "import.up"]),
            (POSES, half, first, ["camera.json:1:", "write both or neither"]),
            (POSES, "{\"12\": {}}", first, ["camera.json:1:", "the camera of image 3"]),
            (&mirrored, CAMERA, first, ["gt.json:3:", "left-handed"]),
            (&scaled, CAMERA, first, ["gt.json:3:", "differs from one by 3.000"]),
            (&twice, CAMERA, first, ["gt.json:5:", "image 3 is listed twice"]),
            (&short, CAMERA, first, ["gt.json:3:", "invalid length 2"]),
            ("[]", CAMERA, first, ["gt.json:1:", "scene_gt.json of BOP"]),
            ("{}", CAMERA, first, ["gt.json:1:", "at least one image"]),
            (POSES, CAMERA, &ImageChoice::Numbers(&[4]), ["gt.json:1:", "no image 4"]),
        ] {
            let (_, errors) = read(poses, camera, images, false);
            assert_eq!(errors.len(), 1, "{expected:?}: {errors:?}");
            assert!(expected.iter().all(|words| errors[0].contains(words)), "{expected:?}: {errors:?}");
        }
        assert_eq!(read(POSES, without, first, true).1, Vec::<String>::new());
    }
}
