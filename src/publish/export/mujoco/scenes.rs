//! Settled scenes as models of plain MuJoCo: bodies are rigid flexes of their meshes' own triangles, or octrees of their distances.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

use super::{
    super::{
        error::ExportError,
        form::{ExportForm, ExportSelection, Written},
        names::object_folders,
        object_mesh::write_mesh,
        objects::{OBJECT, wanted_objects},
        selected::{SelectedSample, SelectedSamples},
        target::Target,
    },
    parts::{CONTACT, inertial, joined},
};
use crate::inspection::job_table;
use format::{
    ContainerMesh, Noun, Product, Scene, SceneBody, SceneContainer,
    dataset::{AssetRow, DatasetError, DatasetReader, layout::JOB},
    extras::Shapes,
};
use kernel::{geom::MassProperties, ids::ObjectId};

/// Script that simulates the scenes; it requires only MuJoCo and NumPy.
const REPLAY: &str = include_str!("replay_scenes.py");

/// Torsional friction with which the bodies settled [m].
const TORSION: f64 = 0.005;

/// Colours of bodies, by number: red, green, blue.
const COLOURS: [&str; 8] = [
    "0.84 0.37 0.30",
    "0.30 0.55 0.80",
    "0.47 0.69 0.34",
    "0.90 0.67 0.25",
    "0.58 0.44 0.72",
    "0.33 0.68 0.66",
    "0.87 0.52 0.65",
    "0.60 0.55 0.45",
];

/// Shape of a body, or of a mesh container, for MuJoCo's own contacts.
#[derive(Clone, Copy)]
enum Contacts {
    /// A rigid flex of the mesh's triangles.
    Triangles,
    /// A geom with an octree of distances to the mesh.
    Distances,
}

/// `scenes/<index>.xml` and `scenes_sdf/<index>.xml` of a dataset of scenes, with the meshes, a table of bodies and poses, and
/// `replay.py`, which simulates them in plain MuJoCo.
pub(super) const FORM: ExportForm = ExportForm {
    product: Product::SCENES,
    counted: Noun { one: "scene", many: "scenes" },
    keys: &[],
    layout: |_| {
        "scenes/<index>.xml: a scene for MuJoCo 3.17, each body at its stored pose, at rest, a rigid flex of the object's triangles; \
         scenes_sdf/<index>.xml: the same with an octree of distances; objects/<name>.obj: meshes [m], and those of containers in containers; scenes.json: bodies of each scene with object, mass [kg], \
         friction and world_from_object (3, 4) row-major [m]; replay.py simulates the scenes, reports how far each body moves, and writes agreement.json"
    },
    write,
};

/// Facts that all scenes of a dataset share.
struct Shared {
    /// Solids of the objects, of a kilogram each.
    solids: BTreeMap<ObjectId, MassProperties>,
    folders: BTreeMap<ObjectId, String>,
    /// Rolling friction with which the bodies settled [m].
    rolling: f64,
}

fn write(reader: &DatasetReader, selection: &ExportSelection, target: &mut Target) -> Result<Written, ExportError> {
    let assets = reader.assets()?;
    let wanted = wanted_objects(&assets.objects, &selection.objects, OBJECT)?;
    // Subjects are not objects: the bodies of a scene are known after reading it.
    let limit = selection.limit.filter(|_| wanted.is_empty());
    let of_any_object = ExportSelection { objects: Vec::new(), limit, ..selection.clone() };
    let selected = SelectedSamples::of(reader, &assets.subjects, &of_any_object)?;
    let shared = Shared {
        solids: assets.objects.iter().filter_map(solid_of).collect(),
        folders: object_folders(&assets.objects),
        rolling: rolling_friction(reader)?,
    };
    let limit = selection.limit.unwrap_or(u64::MAX);
    let (mut scenes, mut used, mut containers) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
    selected.each(|sample, names| {
        let scene = sample.read::<Scene>()?;
        let has_wanted = || scene.bodies.iter().any(|body| wanted.contains(&body.object));
        if scenes.len() as u64 >= limit || !(wanted.is_empty() || has_wanted()) {
            return Ok(());
        }
        if let SceneContainer::Mesh { shape, .. } = &scene.container {
            let file = container_file(shape);
            if containers.insert(file.clone()) {
                write_mesh(target, &format!("{file}.obj"), shape.mesh())?;
            }
        }
        let file = format!("scenes/{:06}.xml", names.index.0);
        target.write(&file, shared.model(&scene, Contacts::Triangles)?.as_bytes())?;
        let file_sdf = format!("scenes_sdf/{:06}.xml", names.index.0);
        target.write(&file_sdf, shared.model(&scene, Contacts::Distances)?.as_bytes())?;
        used.extend(scene.bodies.iter().map(|body| body.object));
        scenes.push(shared.row(&scene, names, [&file, &file_sdf]));
        Ok(())
    })?;
    if scenes.is_empty() {
        return Err(ExportError::NothingSelected { kept: reader.manifest().counts.kept });
    }
    let shapes = Shapes::open(reader.folder())?;
    for (index, row) in assets.objects.iter().enumerate() {
        if used.contains(&row.object) {
            write_mesh(target, &format!("objects/{}.obj", shared.folder(&row.object)), &shapes.object(index)?.mesh)?;
        }
    }
    let count = scenes.len() as u64;
    target.write_json("scenes.json", &scenes.into())?;
    target.write("replay.py", REPLAY.as_bytes())?;
    Ok(Written::selection(count, "scenes", selection))
}

impl Shared {
    fn folder(&self, object: &ObjectId) -> &str {
        self.folders.get(object).map_or("object", String::as_str)
    }

    /// A name for each body: that of its object, with `#` and a number from the second body of an object on. No folder name
    /// contains `#`.
    fn names(&self, scene: &Scene) -> Vec<String> {
        let mut counts = BTreeMap::<ObjectId, u32>::new();
        let mut name = |body: &SceneBody| {
            let count = counts.entry(body.object).or_default();
            *count += 1;
            let folder = self.folder(&body.object);
            if *count == 1 { folder.to_owned() } else { format!("{folder}#{count}") }
        };
        scene.bodies.iter().map(&mut name).collect()
    }

    /// The scene in the table of all.
    fn row(&self, scene: &Scene, names: &SelectedSample<'_>, [file, file_sdf]: [&str; 2]) -> Value {
        let body = |(name, body): (String, &SceneBody)| {
            json!({
                "name": name,
                "object": body.object.to_string(),
                "mass": body.mass,
                "friction": body.friction,
                "world_from_object": body.world_from_object.to_rows(),
            })
        };
        let bodies: Vec<Value> = self.names(scene).into_iter().zip(&scene.bodies).map(body).collect();
        json!({
            "file": file,
            "file_sdf": file_sdf,
            "index": names.index.0,
            "item": names.id.item.0,
            "mode": scene.mode.name(),
            "split": names.split,
            "bodies": bodies,
        })
    }

    /// The scene as MJCF.
    fn model(&self, scene: &Scene, contacts: Contacts) -> Result<String, ExportError> {
        let mut text = format!(
            concat!(
                "<mujoco model=\"scene {}\">\n",
                "  <compiler meshdir=\"..\"/>\n",
                "  <option timestep=\"0.002\" integrator=\"implicitfast\" cone=\"elliptic\" impratio=\"100\"/>\n",
                "  <size memory=\"512M\"/>\n",
                // The larger of two frictions counts, so the container has none.
                "  <default>\n    <geom condim=\"6\" friction=\"0 0 0\" {} rgba=\"0.75 0.75 0.75 1\"/>\n  </default>\n",
                "  <statistic center=\"0 0 0.05\" extent=\"0.6\"/>\n",
                "{}  <worldbody>\n",
                "    <light pos=\"0 0 2\" dir=\"0 0 -1\" directional=\"true\"/>\n{}"
            ),
            scene.sample.item.0,
            CONTACT,
            self.assets(scene, contacts),
            container(&scene.container, contacts)
        );
        for ((name, body), colour) in self.names(scene).iter().zip(&scene.bodies).zip(COLOURS.iter().cycle()) {
            text += &self.body(name, body, colour, contacts)?;
        }
        Ok(text + "  </worldbody>\n</mujoco>\n")
    }

    /// Meshes that geoms of a scene share; a flex refers to its file itself.
    fn assets(&self, scene: &Scene, contacts: Contacts) -> String {
        let Contacts::Distances = contacts else { return String::new() };
        let mut files: BTreeSet<String> =
            scene.bodies.iter().map(|body| format!("objects/{}", self.folder(&body.object))).collect();
        if let SceneContainer::Mesh { shape, .. } = &scene.container {
            files.insert(container_file(shape));
        }
        let mesh = |file: String| format!("    <mesh name=\"{file}\" file=\"{file}.obj\" inertia=\"shell\"/>\n");
        format!("  <asset>\n{}  </asset>\n", files.into_iter().map(mesh).collect::<String>())
    }

    fn body(&self, name: &str, body: &SceneBody, colour: &str, contacts: Contacts) -> Result<String, ExportError> {
        let folder = self.folder(&body.object);
        let unit = self.solids.get(&body.object).ok_or_else(|| ExportError::NoSolid { name: folder.to_owned() })?;
        let at = body.world_from_object.isometry();
        let turn = UnitQuaternion::from_rotation_matrix(&at.rotation);
        Ok(format!(
            concat!(
                "    <body name=\"{}\" pos=\"{}\" quat=\"{} {}\">\n",
                "      <freejoint/>\n",
                "      {}\n",
                "{}    </body>\n"
            ),
            name,
            joined(at.translation.vector.as_slice()),
            turn.w,
            joined(turn.imag().as_slice()),
            inertial(body.mass, unit),
            contacts.shape(name, &format!("objects/{folder}"), colour, [body.friction, TORSION, self.rolling]),
        ))
    }
}

impl Contacts {
    /// The element for a mesh in `file` (without extension); frictions are those of sliding, and of torsion and rolling [m].
    fn shape(self, name: &str, file: &str, colour: &str, friction: [f64; 3]) -> String {
        let contact = format!("condim=\"6\" friction=\"{}\" {CONTACT}", joined(&friction));
        match self {
            Contacts::Triangles => format!(
                concat!(
                    "      <flexcomp name=\"{}\" type=\"mesh\" file=\"{}.obj\" dim=\"2\" rigid=\"true\" radius=\"0.00001\" ",
                    "rgba=\"{} 1\">\n        <contact {} selfcollide=\"none\"/>\n      </flexcomp>\n"
                ),
                name, file, colour, contact
            ),
            Contacts::Distances => {
                format!("      <geom type=\"sdf\" mesh=\"{file}\" mass=\"0\" {contact} rgba=\"{colour} 1\"/>\n")
            }
        }
    }
}

/// Path of a container's mesh, without extension.
fn container_file(shape: &ContainerMesh) -> String {
    format!("containers/{}", shape.digest().short())
}

/// The container made of MuJoCo's primitives; a mesh container becomes a fixed body.
fn container(container: &SceneContainer, contacts: Contacts) -> String {
    let turn = UnitQuaternion::from_rotation_matrix(&container.world_from_container().rotation);
    let quaternion = format!("{} {}", turn.w, joined(turn.imag().as_slice()));
    match container {
        SceneContainer::Plane { .. } => "    <geom type=\"plane\" size=\"5 5 1\"/>\n".to_owned(),
        SceneContainer::Bin { inner: [x, y, z], wall, .. } => {
            let floor = ([x / 2.0 + wall, y / 2.0 + wall, wall / 2.0], [0.0, 0.0, -wall / 2.0]);
            let sides = [-1.0, 1.0].into_iter().flat_map(|sign| {
                [
                    ([wall / 2.0, y / 2.0 + wall, z / 2.0], [sign * (x + wall) / 2.0, 0.0, z / 2.0]),
                    ([x / 2.0, wall / 2.0, z / 2.0], [0.0, sign * (y + wall) / 2.0, z / 2.0]),
                ]
            });
            let boxes = [floor].into_iter().chain(sides).map(|(half, centre)| {
                let centre = turn * Vector3::from(centre);
                let (half, centre) = (joined(&half), joined(centre.as_slice()));
                format!("    <geom type=\"box\" size=\"{half}\" pos=\"{centre}\" quat=\"{quaternion}\"/>\n")
            });
            boxes.collect()
        }
        SceneContainer::Mesh { shape, .. } => format!(
            "    <body name=\"container\" quat=\"{quaternion}\">\n{}    </body>\n",
            contacts.shape("container", &container_file(shape), "0.75 0.75 0.75", [0.0; 3])
        ),
    }
}

/// Solid of an object, from its row of the asset table.
fn solid_of(row: &AssetRow) -> Option<(ObjectId, MassProperties)> {
    Some((row.object, row.object_facts().ok()??.solid?))
}

/// Rolling friction with which the bodies settled [m], from their job.
fn rolling_friction(reader: &DatasetReader) -> Result<f64, ExportError> {
    let job = job_table(reader)?;
    let rolling = job.get("physics").and_then(|physics| physics.get("rolling")?.as_float());
    rolling.ok_or_else(|| {
        ExportError::Dataset(DatasetError::Invalid {
            path: reader.folder().path_of(JOB),
            problem: "it has no `physics.rolling`".to_owned(),
            remedy: "`verify` the dataset, and make it again",
        })
    })
}
