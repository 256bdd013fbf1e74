//! Views in colour, drawn by MuJoCo.

use std::sync::Arc;

use super::image::SceneMeshes;
use crate::{
    ProduceError,
    products::{
        appearance::{Colours, no_renderer, random_appearance, random_paint},
        settled::SettledScene,
    },
};
use format::{SceneColour, SceneContainer, SceneImage};
use kernel::{
    geom::{Object, Pose, World},
    ids::ObjectId,
    seed::Stream,
};
use sim::{Appearance, SimModel, SimWorker};

/// Paint of a bin, in shares of full brightness: red, green, blue.
const CONTAINER: [f32; 3] = [0.45, 0.50, 0.56];

/// Paint of the table: light wood.
const TABLE: [f32; 3] = [0.62, 0.51, 0.39];

/// Distance of shadows from the world's origin, as a multiple of the farthest extent of a body.
const SHADOWED: f64 = 2.0;

/// Colour renderer of one thread.
pub(super) struct ColourView {
    settings: Colours,
    /// The scene and its renderer: made with the first scene, reused for the others.
    worker: Option<Box<SimWorker>>,
}

impl ColourView {
    /// A renderer of one thread.
    pub fn new(settings: Colours) -> Self {
        Self { settings, worker: None }
    }

    /// Switches to a scene.
    pub fn use_scene(&mut self, scene: &SettledScene, meshes: &SceneMeshes) -> Result<(), ProduceError> {
        let bodies = meshes.bodies.iter().zip(&scene.bodies).map(|(mesh, (_, pose))| (mesh.drawn(), *pose));
        let fixed = meshes.container.iter().chain([&meshes.table]);
        let fixed = fixed.map(|mesh| (mesh.drawn(), Pose::<World, Object>::identity()));
        let reach = meshes.bodies.iter().zip(&scene.bodies).map(|(mesh, (_, pose))| {
            pose.point(&mesh.render.centre()).coords.norm() + mesh.render.half_extents().norm()
        });
        let reach = SHADOWED * reach.fold(0.0, f64::max);
        let model = Arc::new(SimModel::of_scene(bodies.chain(fixed), reach).map_err(no_renderer)?);
        self.worker.get_or_insert_with(|| Box::new(SimWorker::new(&model))).use_model(&model);
        Ok(())
    }

    /// Draws the scene as an image of it sees it. Where colours are drawn at random they are those of `stream`; else a body has one
    /// of its object's own.
    pub fn render(&mut self, image: &SceneImage, stream: &mut Stream) -> Result<SceneColour, ProduceError> {
        let worker = self.worker.as_mut().expect("a scene is loaded before it is rendered");
        let bodies = image.bodies.iter().map(|body| body.object);
        let has_container = !matches!(image.container, SceneContainer::Plane { .. });
        let (appearance, paints) = match self.settings.randomise {
            true => {
                let appearance = random_appearance(stream);
                let count = image.bodies.len() + usize::from(has_container) + 1;
                (appearance, (0..count).map(|_| random_paint(stream)).collect::<Vec<_>>())
            }
            false => {
                let fixed = has_container.then_some(CONTAINER).into_iter().chain([TABLE]);
                (Appearance::default(), bodies.map(own_paint).chain(fixed).collect())
            }
        };
        let camera_from_world = image.world_from_camera.inverse();
        let mut rgb = Vec::new();
        worker
            .gl_scene_colours(&image.camera, &camera_from_world, &appearance, &paints, &mut rgb)
            .map_err(no_renderer)?;
        Ok(SceneColour { sample: image.sample, width: image.camera.width, height: image.camera.height, rgb })
    }
}

/// Paint of an object, the same in every scene.
fn own_paint(object: ObjectId) -> [f32; 3] {
    [0, 1, 2].map(|channel| 0.2 + 0.7 * f32::from(object.0.0[channel]) / 255.0)
}
