//! Record of a scene: bodies, poses, contacts, checks.

use prost::Message;

use super::{SceneContainer, SceneFacts};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, named, pose, ranged},
    proto, sample_from_proto, wire,
};
use kernel::{
    geom::{Object, Pose, SourceWorld, World},
    ids::{Digest, ObjectId, SampleId},
};

const MESSAGE: &str = "Scene";

/// Number of the container among the bodies of contacts and supports; bodies are counted from 1.
pub const CONTAINER: u32 = 0;

/// Bodies of a scene, at most.
const MAX_BODIES: usize = 1000;

/// Mode of a scene: how its bodies came to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SceneMode {
    /// Put on a plane in resting poses, all at once.
    Table,
    /// Dropped on a plane in any rotation, one after another.
    Heap,
    /// Dropped into an open box in any rotation, one after another.
    Bin,
    /// Put on a plane upright, each as close to the middle as it can, all at once.
    Packed,
    /// Dropped between walls on a plane in any rotation, one after another; the walls were lifted away.
    Pile,
    /// Read from files of other programs: nothing was simulated, and no check was applied.
    Imported,
}

impl SceneMode {
    /// Every mode.
    pub const ALL: [Self; 6] = [Self::Table, Self::Heap, Self::Bin, Self::Packed, Self::Pile, Self::Imported];

    /// The name on disk and in jobs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Heap => "heap",
            Self::Bin => "bin",
            Self::Packed => "packed",
            Self::Pile => "pile",
            Self::Imported => "imported",
        }
    }
}

/// A body of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneBody {
    /// The body's object.
    pub object: ObjectId,
    /// Pose of the object in the scene.
    pub world_from_object: Pose<World, Object>,
    /// [kg].
    pub mass: f64,
    /// Centre of mass, in the world [m].
    pub centre_of_mass: [f64; 3],
    /// Coefficient of sliding friction.
    pub friction: f64,
    /// Time at which it was released [s].
    pub released_at: f64,
    /// Index of the resting pose of its object with the nearest upward direction, and the angle between the two [rad].
    pub resting: Option<(u32, f64)>,
    /// Motion of its centre of mass when the scene is stepped again from rest [m].
    pub drift: f64,
    /// Rotation then [rad].
    pub turn: f64,
}

/// A point at which two bodies touch.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneContact {
    /// Numbers of the bodies, the lower first; [`CONTAINER`], or from 1.
    pub pair: [u32; 2],
    /// Half way between the two surfaces, in the world [m].
    pub point: [f64; 3],
    /// Outward from the first, in the world.
    pub normal: [f64; 3],
    /// Negative where they overlap [m].
    pub distance: f64,
    /// Force of the first on the second, in the world [N].
    pub force: [f64; 3],
    /// Torque of the first on the second about the point, by torsion and rolling friction, in the world [N m].
    pub torque: [f64; 3],
}

/// A body that carries another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSupport {
    /// Number of the supporting body: [`CONTAINER`], or from 1.
    pub by: u32,
    /// Number of the carried body, from 1.
    pub body: u32,
    /// Share of its weight.
    pub share: f64,
}

/// Source of a scene that was not settled.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneImport {
    /// The scene among its files: name or number.
    pub source: String,
    /// The world of those files in the scene's.
    pub world_from_source: Pose<World, SourceWorld>,
    /// Pairs of bodies, or of a body and the container, that intersect.
    pub crossed: u32,
}

/// Bodies at rest in a container.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Which sample.
    pub sample: SampleId,
    /// Mode: how the bodies came to it.
    pub mode: SceneMode,
    /// Container.
    pub container: SceneContainer,
    /// The bodies, in the order of their first release.
    pub bodies: Vec<SceneBody>,
    /// Contacts at these poses.
    pub contacts: Vec<SceneContact>,
    /// Bodies that rest on others.
    pub supports: Vec<SceneSupport>,
    /// From the last release to rest [s].
    pub rest_time: f64,
    /// Steps until rest.
    pub steps: u32,
    /// Largest speed at rest [m/s].
    pub top_speed: f64,
    /// Largest overlap of two bodies, and of a body and the container [m].
    pub depths: [f64; 2],
    /// Bodies that left the container.
    pub gone: u32,
    /// Source of a scene of [`SceneMode::Imported`]; its time to rest, steps and speed are 0.
    pub import: Option<SceneImport>,
}

impl Scene {
    /// Digest of the scene: container, objects and poses.
    pub fn id(&self) -> ObjectId {
        let mut bytes = Vec::new();
        bytes.extend(self.container.identity());
        for body in &self.bodies {
            bytes.extend(body.object.0.0);
            body.world_from_object.to_rows().iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        }
        ObjectId(Digest::hash_parts([b"scene 1".as_slice(), self.container.name().as_bytes(), &bytes]))
    }

    /// Numbers of the scene.
    pub fn facts(&self) -> SceneFacts {
        let largest = |of: fn(&SceneBody) -> f64| self.bodies.iter().map(of).fold(0.0, f64::max);
        SceneFacts {
            bodies: self.bodies.len() as u32,
            contacts: self.contacts.len() as u32,
            gone: self.gone,
            steps: self.steps,
            rest_time: self.rest_time,
            top_speed: self.top_speed,
            depths: self.depths,
            drift: [largest(|body| body.drift), largest(|body| body.turn)],
        }
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        let bodies = || self.bodies.iter();
        let contacts = || self.contacts.iter();
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, &self.id().0.0);
        wire::bytes(out, 3, self.mode.name().as_bytes());
        wire::bytes(out, 4, self.container.name().as_bytes());
        wire::doubles(out, 5, &self.container.sizes());
        let objects: Vec<u8> = bodies().flat_map(|body| body.object.0.0).collect();
        wire::bytes(out, 6, &objects);
        wire::doubles_of(out, 7, bodies().flat_map(|body| body.world_from_object.to_rows()));
        wire::doubles_of(out, 8, bodies().map(|body| body.mass));
        wire::doubles_of(out, 9, bodies().map(|body| body.friction));
        wire::doubles_of(out, 10, bodies().map(|body| body.released_at));
        wire::uint32s(out, 11, bodies().map(|body| body.resting.map_or(0, |(index, _)| index + 1)));
        wire::doubles_of(out, 12, bodies().map(|body| body.resting.map_or(0.0, |(_, angle)| angle)));
        wire::doubles_of(out, 13, bodies().map(|body| body.drift));
        wire::doubles_of(out, 14, bodies().map(|body| body.turn));
        wire::uint32s(out, 15, contacts().map(|contact| contact.pair[0]));
        wire::uint32s(out, 16, contacts().map(|contact| contact.pair[1]));
        wire::doubles_of(out, 17, contacts().flat_map(|contact| contact.point));
        wire::doubles_of(out, 18, contacts().flat_map(|contact| contact.normal));
        wire::doubles_of(out, 19, contacts().map(|contact| contact.distance));
        wire::doubles_of(out, 20, contacts().flat_map(|contact| contact.force));
        wire::uint32s(out, 21, self.supports.iter().map(|support| support.by));
        wire::uint32s(out, 22, self.supports.iter().map(|support| support.body));
        wire::doubles_of(out, 23, self.supports.iter().map(|support| support.share));
        wire::double(out, 24, self.rest_time);
        wire::uint32(out, 25, self.steps);
        wire::double(out, 26, self.top_speed);
        wire::double(out, 27, self.depths[0]);
        wire::double(out, 28, self.depths[1]);
        wire::uint32(out, 29, self.gone);
        if let Some(SceneImport { source, world_from_source, crossed }) = &self.import {
            wire::bytes(out, 30, source.as_bytes());
            wire::doubles(out, 31, &world_from_source.to_rows());
            wire::uint32(out, 32, *crossed);
        }
        self.container.encode_mesh(out, [33, 34]);
        wire::doubles_of(out, 35, contacts().flat_map(|contact| contact.torque));
        wire::doubles_of(out, 36, bodies().flat_map(|body| body.centre_of_mass));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length, a range or a rotation does not hold, or the scene's own digest is not that of its content.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::Scene::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample.clone())?;
        let names = SceneMode::ALL.map(SceneMode::name);
        named(MESSAGE, "mode", &raw.mode, &names)?;
        let mode = SceneMode::ALL[names.iter().position(|name| *name == raw.mode).unwrap_or_default()];
        let container = SceneContainer::of(
            MESSAGE,
            &raw.container,
            &raw.container_size,
            [&raw.container_vertices, &raw.container_triangles],
        )?;
        for (field, value) in [
            ("rest_time", raw.rest_time),
            ("top_speed", raw.top_speed),
            ("depth_bodies", raw.depth_bodies),
            ("depth_container", raw.depth_container),
        ] {
            not_below_zero(field, value)?;
        }
        let bodies = bodies(&raw)?;
        let count = bodies.len() as u32;
        let scene = Self {
            sample,
            mode,
            container,
            contacts: contacts(&raw, count)?,
            supports: supports(&raw, count)?,
            bodies,
            rest_time: raw.rest_time,
            steps: raw.steps,
            top_speed: raw.top_speed,
            depths: [raw.depth_bodies, raw.depth_container],
            gone: raw.gone,
            import: import(&raw, mode)?,
        };
        lengthy(MESSAGE, "scene", 32, raw.scene.len())?;
        let is_own = raw.scene == scene.id().0.0;
        ranged(MESSAGE, "scene", 0.0, is_own, "the digest of container, objects and poses")?;
        Ok(scene)
    }
}

fn import(raw: &proto::Scene, mode: SceneMode) -> Result<Option<SceneImport>, RecordError> {
    if mode != SceneMode::Imported {
        lengthy(MESSAGE, "world_from_source", 0, raw.world_from_source.len())?;
        return Ok(None);
    }
    Ok(Some(SceneImport {
        source: raw.source.clone(),
        world_from_source: pose(MESSAGE, "world_from_source", &raw.world_from_source)?,
        crossed: raw.crossed,
    }))
}

fn bodies(raw: &proto::Scene) -> Result<Vec<SceneBody>, RecordError> {
    let count = raw.masses.len();
    ranged(MESSAGE, "masses", count as f64, (1..=MAX_BODIES).contains(&count), "1 to 1000 bodies")?;
    lengthy(MESSAGE, "objects", 32 * count, raw.objects.len())?;
    lengthy(MESSAGE, "world_from_object", 12 * count, raw.world_from_object.len())?;
    lengthy(MESSAGE, "resting_poses", count, raw.resting_poses.len())?;
    lengthy(MESSAGE, "centres_of_mass", 3 * count, raw.centres_of_mass.len())?;
    finite("centres_of_mass", &raw.centres_of_mass)?;
    for (field, values) in [
        ("masses", &raw.masses),
        ("frictions", &raw.frictions),
        ("released_at", &raw.released_at),
        ("resting_angles", &raw.resting_angles),
        ("drifts", &raw.drifts),
        ("turns", &raw.turns),
    ] {
        lengthy(MESSAGE, field, count, values.len())?;
        values.iter().try_for_each(|value| not_below_zero(field, *value))?;
    }
    (0..count)
        .map(|index| {
            let object = raw.objects[32 * index..][..32].try_into().expect("32 bytes");
            let resting = raw.resting_poses[index].checked_sub(1);
            Ok(SceneBody {
                object: ObjectId(Digest(object)),
                world_from_object: pose(MESSAGE, "world_from_object", &raw.world_from_object[12 * index..][..12])?,
                mass: raw.masses[index],
                centre_of_mass: triple(&raw.centres_of_mass, index),
                friction: raw.frictions[index],
                released_at: raw.released_at[index],
                resting: resting.map(|pose| (pose, raw.resting_angles[index])),
                drift: raw.drifts[index],
                turn: raw.turns[index],
            })
        })
        .collect()
}

fn contacts(raw: &proto::Scene, bodies: u32) -> Result<Vec<SceneContact>, RecordError> {
    let count = raw.touch_first.len();
    lengthy(MESSAGE, "touch_second", count, raw.touch_second.len())?;
    for (field, expected, values) in [
        ("touch_points", 3 * count, &raw.touch_points),
        ("touch_normals", 3 * count, &raw.touch_normals),
        ("touch_distances", count, &raw.touch_distances),
        ("touch_forces", 3 * count, &raw.touch_forces),
        ("touch_torques", 3 * count, &raw.touch_torques),
    ] {
        lengthy(MESSAGE, field, expected, values.len())?;
        finite(field, values)?;
    }
    (0..count)
        .map(|index| {
            let pair = [raw.touch_first[index], raw.touch_second[index]];
            let fits = pair[0] < pair[1] && pair[1] <= bodies;
            ranged(MESSAGE, "touch_second", f64::from(pair[1]), fits, "a body of the scene above the first")?;
            let normal = triple(&raw.touch_normals, index);
            let length = normal.iter().map(|part| part * part).sum::<f64>().sqrt();
            ranged(MESSAGE, "touch_normals", length, (length - 1.0).abs() < 1e-6, "of unit length")?;
            Ok(SceneContact {
                pair,
                point: triple(&raw.touch_points, index),
                normal,
                distance: raw.touch_distances[index],
                force: triple(&raw.touch_forces, index),
                torque: triple(&raw.touch_torques, index),
            })
        })
        .collect()
}

fn supports(raw: &proto::Scene, bodies: u32) -> Result<Vec<SceneSupport>, RecordError> {
    lengthy(MESSAGE, "supported", raw.supporters.len(), raw.supported.len())?;
    lengthy(MESSAGE, "shares", raw.supporters.len(), raw.shares.len())?;
    let support = |((by, body), share): ((&u32, &u32), &f64)| {
        let fits = by != body && *by <= bodies && (1..=bodies).contains(body);
        ranged(MESSAGE, "supported", f64::from(*body), fits, "two bodies of the scene")?;
        not_below_zero("shares", *share)?;
        Ok(SceneSupport { by: *by, body: *body, share: *share })
    };
    raw.supporters.iter().zip(&raw.supported).zip(&raw.shares).map(support).collect()
}

/// Three numbers of an array of triples.
fn triple(values: &[f64], index: usize) -> [f64; 3] {
    [values[3 * index], values[3 * index + 1], values[3 * index + 2]]
}

fn finite(field: &'static str, values: &[f64]) -> Result<(), RecordError> {
    let wild = values.iter().find(|value| !value.is_finite());
    ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "finite")
}

fn not_below_zero(field: &'static str, value: f64) -> Result<(), RecordError> {
    ranged(MESSAGE, field, value, value >= 0.0 && value.is_finite(), "0 or positive, and finite")
}
