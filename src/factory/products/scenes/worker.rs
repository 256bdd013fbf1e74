//! The producer of scenes for one thread.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{
    draw::{body_count, drawn},
    loaded::{LoadedObject, LoadedObjects, fits},
    outcome::{contacts, reject_facts, reject_words, supports},
    overview::Painter,
    placement::{dropped, standing},
    settings::SceneJob,
};
use crate::{ProduceError, SampleWriter, work::Producer};
use format::{Channel, Scene, SceneBody as RecordedBody, SceneContainer, SceneFacts, SceneMode};
use kernel::{
    cancel::Cancel,
    geom::{Pose, SimdLevel},
    ids::{ItemId, ObjectId, SampleId},
    seed::Stream,
    words::Split,
};
use sim::{Container, Placement, SceneBody, SettleWorker, SettledScene};

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
    /// Objects of each split in use, by index and id.
    pub sides: Vec<(Split, Vec<(usize, ObjectId)>)>,
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
    object: Arc<LoadedObject>,
    friction: f64,
}

impl<'s> SceneWorker<'s> {
    /// A producer for one thread.
    pub(super) fn new(shared: &'s Shared<'s>) -> Self {
        let settler = SettleWorker::new(shared.container.clone(), shared.job.settings.settle, shared.level);
        let painter = Painter::new(&shared.job.settings.container, shared.level);
        Self { shared, settler, painter, side: None }
    }

    /// Starts of the bodies; `Err` with the number of the body that finds no room.
    fn placements(&self, sample: &SampleId, bodies: &[Drawn]) -> Result<Vec<Placement>, usize> {
        let settings = &self.shared.job.settings;
        let mut taken = Vec::new();
        let start = |(number, body): (usize, &Drawn)| {
            let mut stream = Stream::of_sample(self.shared.seed, sample, &format!("scene start {}", body.id));
            match (settings.mode, settings.container) {
                (SceneMode::Table, SceneContainer::Plane { size }) => {
                    standing(&body.object, size, &mut taken, &mut stream).ok_or(number + 1)
                }
                _ => Ok(dropped(&mut stream)),
            }
        };
        bodies.iter().enumerate().map(start).collect()
    }

    /// The record of a settled scene.
    fn record(&self, sample: SampleId, bodies: &[Drawn], scene: &SettledScene) -> Scene {
        let settings = &self.shared.job.settings;
        let recorded = scene.bodies.iter().map(|settled| {
            let Drawn { id, object, friction } = &bodies[settled.index];
            let up = settled.world_from_object.rotation.inverse() * Vector3::z();
            RecordedBody {
                object: *id,
                world_from_object: Pose::from_isometry(settled.world_from_object),
                mass: object.mass,
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
            container: settings.container,
            contacts: contacts(&scene.touches),
            supports: supports(&scene.touches, &weights),
            bodies: recorded,
            rest_time: scene.rest_time,
            steps: scene.steps,
            top_speed: scene.top_speed,
            depths: scene.depths,
            gone: scene.gone.len() as u32,
        }
    }
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
        let Shared { job, seed, sides, objects, .. } = self.shared;
        let settings = &job.settings;
        let (split, side) = &sides[self.side.expect("a split is loaded before its scenes are made")];
        let sample = SampleId::of_object(settings.subject(*split), item);
        // The objects, and what is drawn for each.
        let count = body_count(*seed, &sample, settings.count);
        let mut bodies = Vec::with_capacity(count);
        for index in drawn(*seed, *split, item.0, side, count) {
            let of_job = &job.objects.list[index];
            if !fits(of_job.asset.extents, &settings.container) {
                let [x, y, z] = of_job.asset.extents;
                let detail = format!("body {}: {x:.3} x {y:.3} x {z:.3} m", bodies.len() + 1);
                return out.reject(sample, SceneFacts::default(), TOO_LARGE, &detail);
            }
            let id = of_job.id();
            let [low, high] = settings.friction;
            let friction = Stream::of_sample(*seed, &sample, &format!("scene friction {id}")).uniform(low, high);
            bodies.push(Drawn { id, object: objects.get(&job.objects, index)?, friction });
        }
        let placements = match self.placements(&sample, &bodies) {
            Ok(placements) => placements,
            Err(number) => {
                let detail = format!("no free position for body {number} of {count}");
                return out.reject(sample, SceneFacts::default(), NO_ROOM, &detail);
            }
        };
        // Physics, and what came of it.
        let settled: Vec<SceneBody> = bodies
            .iter()
            .map(|Drawn { object, friction, .. }| SceneBody {
                body: Arc::clone(&object.body),
                solid: object.solid,
                mass: object.mass,
                friction: *friction,
            })
            .collect();
        let scene = self.settler.settle(&settled, &placements, settings.count[0] as usize);
        if let Some(fault) = &scene.fault {
            let (reason, detail) = reject_words(fault);
            return out.reject(sample, reject_facts(&scene), reason, &detail);
        }
        let record = self.record(sample, &bodies, &scene);
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
}
