//! The producer of scenes for one thread.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    draw::{body_count, drawn},
    import::{Import, place},
    loaded::{LoadedObject, LoadedObjects, fits},
    outcome::{contacts, reject_facts, reject_words, supports},
    overview::Painter,
    placement::{dropped, packed, standing},
    settings::SceneJob,
};
use crate::{ProduceError, SampleWriter, work::Producer};
use format::{Channel, Scene, SceneBody as RecordedBody, SceneFacts, SceneImport, SceneMode};
use kernel::{
    cancel::Cancel,
    geom::{Pose, SimdLevel},
    ids::{ItemId, ObjectId, SampleId},
    seed::Stream,
    words::Split,
};
use sim::{Container, Placement, SettleOutcome, SettleWorker, SimBody, Walls};

/// [m/s^2].
const GRAVITY: f64 = 9.81;

/// Reason of a scene that draws an object which is larger than the container.
const TOO_LARGE: &str = "too_large";

/// Reason of a scene whose bodies do not find room on the table.
const NO_ROOM: &str = "no_room";

/// Parts that all threads share.
pub(super) struct Shared<'j> {
    pub job: &'j SceneJob,
    pub seed: u64,
    pub level: SimdLevel,
    pub container: Container,
    pub walls: Option<Walls>,
    /// Objects of each split in use, by index and id.
    pub sides: Vec<(Split, Vec<(usize, ObjectId)>)>,
    /// Objects of each imported scene, by index.
    pub imported: Vec<Vec<usize>>,
    pub objects: LoadedObjects,
}

/// The producer of one thread.
pub struct SceneWorker<'s> {
    shared: &'s Shared<'s>,
    settler: SettleWorker,
    painter: Painter,
    /// Index of the split whose scenes are made.
    side: Option<usize>,
}

/// An object of a scene.
struct Drawn {
    id: ObjectId,
    /// Number of the same object's bodies before it.
    copy: usize,
    object: Arc<LoadedObject>,
    friction: f64,
}

impl<'s> SceneWorker<'s> {
    /// A producer for one thread.
    pub(super) fn new(shared: &'s Shared<'s>) -> Self {
        let mut settler = SettleWorker::new(shared.container.clone(), shared.job.settings.settle, shared.level);
        if let Some(walls) = &shared.walls {
            settler = settler.with_walls(walls.clone());
        }
        let painter = Painter::new(&shared.job.settings.container, shared.level);
        Self { shared, settler, painter, side: None }
    }

    /// Starts of the bodies; `Err` with the number of the body that finds no room.
    fn placements(&self, sample: &SampleId, bodies: &[Drawn]) -> Result<Vec<Placement>, usize> {
        let settings = &self.shared.job.settings;
        let floor = settings.container.floor();
        if settings.mode == SceneMode::Packed {
            let objects: Vec<&LoadedObject> = bodies.iter().map(|body| body.object.as_ref()).collect();
            let stream = |index: usize| self.stream(sample, "start", bodies[index].id, bodies[index].copy);
            return packed(&objects, floor, stream).map_err(|index| index + 1);
        }
        let mut taken = Vec::new();
        let start = |(number, body): (usize, &Drawn)| {
            let mut stream = self.stream(sample, "start", body.id, body.copy);
            let start = match settings.mode {
                SceneMode::Table => standing(&body.object, floor, settings.region.as_ref(), &mut taken, &mut stream),
                _ => Some(dropped(&mut stream)),
            };
            start.ok_or(number + 1)
        };
        bodies.iter().enumerate().map(start).collect()
    }

    /// Random numbers of an object in a scene, a separate stream for each copy from 0.
    fn stream(&self, sample: &SampleId, purpose: &str, id: ObjectId, copy: usize) -> Stream {
        let name = if copy == 0 { format!("scene {purpose} {id}") } else { format!("scene {purpose} {id} {copy}") };
        Stream::of_sample(self.shared.seed, sample, &name)
    }

    /// Objects of a scene, by their indices.
    fn bodies(&self, sample: &SampleId, indices: &[usize]) -> Result<Vec<Drawn>, ProduceError> {
        let Shared { job, objects, .. } = self.shared;
        let [low, high] = job.settings.friction;
        let body = |(position, index): (usize, &usize)| {
            let id = job.objects.list[*index].id();
            let copy = indices[..position].iter().filter(|other| *other == index).count();
            let friction = self.stream(sample, "friction", id, copy).uniform(low, high);
            Ok(Drawn { id, copy, object: objects.get(&job.objects, *index)?, friction })
        };
        indices.iter().enumerate().map(body).collect()
    }

    /// Keeps an imported scene as it is.
    fn import(
        &mut self,
        import: &Import,
        sample: SampleId,
        number: usize,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        let arrangement = &import.scenes[number];
        let bodies = self.bodies(&sample, &self.shared.imported[number])?;
        let corners: Vec<&[Point3<f64>]> = bodies.iter().map(|body| body.object.corners()).collect();
        let (world_from_source, poses) = place(import, arrangement, &corners);
        let poses: Vec<IsometryMatrix3<f64>> = poses.iter().map(|pose| *pose.isometry()).collect();
        let scene = self.settler.examine(&scene_bodies(&bodies), &poses);
        let source = arrangement.source.clone();
        self.store(
            sample,
            &bodies,
            &scene,
            Some(SceneImport { source, world_from_source, crossed: scene.crossed }),
            out,
        )
    }

    /// Stores a scene, or its rejection.
    fn store(
        &mut self,
        sample: SampleId,
        bodies: &[Drawn],
        scene: &SettleOutcome,
        import: Option<SceneImport>,
        out: &mut SampleWriter<'_>,
    ) -> Result<(), ProduceError> {
        if let Some(fault) = &scene.fault {
            let (reason, detail) = reject_words(fault);
            return out.reject(sample, reject_facts(scene), reason, &detail);
        }
        let record = Scene { import, ..self.record(sample, bodies, scene) };
        if let Some(payload) = out.payload(Channel::SCENE) {
            record.encode(payload);
        }
        if let Some(payload) = out.payload(Channel::SCENE_OVERVIEW) {
            let meshes = scene.bodies.iter().map(|settled| &bodies[settled.index].object.render);
            let poses = record.bodies.iter().map(|body| &body.world_from_object);
            self.painter.paint(sample, meshes.zip(poses)).encode(payload);
        }
        out.keep(sample, record.facts())
    }

    /// The record of a settled scene.
    fn record(&self, sample: SampleId, bodies: &[Drawn], scene: &SettleOutcome) -> Scene {
        let settings = &self.shared.job.settings;
        let recorded = scene.bodies.iter().map(|settled| {
            let Drawn { id, object, friction, .. } = &bodies[settled.index];
            let up = settled.world_from_object.rotation.inverse() * Vector3::z();
            RecordedBody {
                object: *id,
                world_from_object: Pose::from_isometry(settled.world_from_object),
                mass: object.mass,
                centre_of_mass: (settled.world_from_object * object.solid.centre).coords.into(),
                friction: *friction,
                released_at: settled.released_at,
                resting: object.nearest_resting(&up),
                drift: settled.drift,
                turn: settled.turn,
            }
        });
        let recorded: Vec<RecordedBody> = recorded.collect();
        let weights: Vec<f64> = recorded.iter().map(|body| body.mass * GRAVITY).collect();
        Scene {
            sample,
            mode: settings.mode,
            container: settings.container.clone(),
            contacts: contacts(&scene.touches),
            supports: supports(&scene.touches, &weights),
            bodies: recorded,
            rest_time: scene.rest_time,
            steps: scene.steps,
            top_speed: scene.top_speed,
            depths: scene.depths,
            gone: scene.gone.len() as u32,
            import: None,
        }
    }
}

/// Bodies as they are settled.
fn scene_bodies(bodies: &[Drawn]) -> Vec<SimBody> {
    let body = |Drawn { object, friction, .. }: &Drawn| SimBody {
        body: Arc::clone(&object.body),
        solid: object.solid,
        mass: object.mass,
        friction: *friction,
    };
    bodies.iter().map(body).collect()
}

impl Producer for SceneWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        vec![Channel::SCENE, Channel::SCENE_OVERVIEW]
    }

    /// Objects are loaded when a scene draws them.
    fn load(&mut self, subject: usize, _: &Cancel) -> Result<(), ProduceError> {
        self.side = Some(subject);
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let Shared { job, seed, sides, .. } = self.shared;
        let settings = &job.settings;
        let (split, side) = &sides[self.side.expect("a split is loaded before its scenes are made")];
        let sample = SampleId::of_object(settings.subject(*split), item);
        if let Some(import) = &settings.import {
            return self.import(import, sample, item.0 as usize, out);
        }
        // The objects, and what is drawn for each.
        let count = body_count(*seed, &sample, settings.count);
        let indices = drawn(*seed, *split, item.0, side, settings.repeats, count);
        for (number, index) in (1..).zip(&indices) {
            let extents = job.objects.list[*index].asset.extents;
            if !fits(extents, settings.floor()) {
                let [x, y, z] = extents;
                let detail = format!("body {number}: {x:.3} x {y:.3} x {z:.3} m");
                return out.reject(sample, SceneFacts::default(), TOO_LARGE, &detail);
            }
        }
        let bodies = self.bodies(&sample, &indices)?;
        let placements = match self.placements(&sample, &bodies) {
            Ok(placements) => placements,
            Err(number) => {
                let detail = format!("no free position for body {number} of {count}");
                return out.reject(sample, SceneFacts::default(), NO_ROOM, &detail);
            }
        };
        // Physics, and the outcome.
        let scene = self.settler.settle(&scene_bodies(&bodies), &placements, settings.count[0] as usize);
        self.store(sample, &bodies, &scene, None, out)
    }
}
