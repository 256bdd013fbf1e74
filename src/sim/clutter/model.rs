//! The compiled model of a hand, a scene and the body of it to grasp.

use std::{collections::BTreeMap, sync::Arc};

use mujoco_rs::wrappers::{
    mj_editing::{MjSpec, MjsBody, MjsGeom, MjtLimited, SpecItem},
    mj_model::{MjModel, MjtGeomBase, MjtJoint, MjtObjBase},
};
use nalgebra::{IsometryMatrix3, Point3};

use crate::{
    convert::{index, isometry, quaternion},
    error::{HandError, RobotError},
    hand::{
        model::HandModel,
        sim::{
            GeomOwner, HandSim, Held, Hold, SLIDE_MASS, SLIDES, add_free_object, check_mass, free_object, hand_spec,
            is_finite, object_body, refused_by,
        },
    },
    objects::{
        added_geom::drop_defaults,
        container::{Container, Vessel},
        patch::BodyPatch,
        scene_body::SimBody,
        true_mesh::{self, TrueMesh},
    },
};
use kernel::{contact::ContactSurface, geom::Aabb};

/// The body that the scene's container is.
const CONTAINER: &str = "graspmill container";

/// The geom that represents the mesh of a container without boxes.
const WALLS: &str = "graspmill walls";

/// Kind of contact that bodies of a scene and its container have among themselves.
const AMONG_BODIES: i32 = 1 << 29;

/// Kind of contact that the hand has with a scene.
const WITH_HAND: i32 = 1 << 28;

/// Memory of a model [bytes]: as much as a scene has that settles.
const MEMORY: usize = 64 << 20;

/// Distance at which everything waits until a trial puts it in its place [m].
const PARKED: f64 = 50.0;

/// Half the sides of the table beneath a hand, and its thickness [m].
const TABLE: [f64; 3] = [3.0, 3.0, 1.0];

/// Friction of the container under a hand.
const CONTAINER_FRICTION: f64 = 0.5;

/// A settled scene.
#[derive(Clone)]
pub struct ClutterScene {
    /// The container.
    pub container: Container,
    /// The bodies.
    pub bodies: Vec<SimBody>,
    /// Poses of the bodies.
    pub scene_from_objects: Vec<IsometryMatrix3<f64>>,
    /// Rolling friction among bodies [m].
    pub rolling: f64,
    /// Torsional friction of a contact of the hand about its normal [m], as in [`TrialConditions`](crate::TrialConditions).
    pub torsion: f64,
}

impl ClutterScene {
    fn check(&self, target: usize, awake: &[bool]) -> Result<(), HandError> {
        let wrong = |reason: String| Err(HandError::Object { reason });
        let count = self.bodies.len();
        if self.scene_from_objects.len() != count || awake.len() != count || target >= count {
            return wrong(format!(
                "a scene of {count} bodies with {} poses, {} states of being awake, and body {target} to grasp",
                self.scene_from_objects.len(),
                awake.len()
            ));
        }
        if let Some(body) = self.scene_from_objects.iter().position(|pose| !is_finite(pose)) {
            return wrong(format!("the pose of body {body} is not finite"));
        }
        self.bodies.iter().try_for_each(|body| check_mass(&body.solid))
    }
}

/// A body other than the target that moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Neighbour {
    /// Index in the scene.
    pub(super) body: usize,
    /// Address of its pose among MuJoCo's coordinates.
    pub(super) address: usize,
}

/// A slide of the hand's base along an axis of its frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct BaseSlide {
    pub(super) axis: usize,
    /// Addresses of its coordinate and of its velocity.
    pub(super) address: usize,
    pub(super) dof: usize,
    /// Inertia that slides, and the part of it that gravity pulls at [kg].
    pub(super) mass: f64,
    pub(super) weight: f64,
}

/// A compiled hand in a scene, about to grasp one body. Shared by threads; each makes its own [`super::ClutterWorker`].
pub struct ClutterSim {
    pub(super) sim: Arc<HandSim>,
    pub(super) scene: ClutterScene,
    /// Index of the body to grasp.
    pub(super) target: usize,
    /// Other bodies that move.
    pub(super) neighbours: Vec<Neighbour>,
    /// Bodies in MuJoCo's order after the container.
    pub(super) order: Vec<usize>,
    /// MuJoCo's number of the container's body.
    pub(super) container: usize,
    /// Slides of the hand's base, three for each body that is in the world of its description.
    pub(super) slides: Vec<BaseSlide>,
}

impl ClutterSim {
    /// Compiles a hand with a scene and the body of it to grasp. Bodies that are not `awake` are fixed in the
    /// container; the target is always awake.
    ///
    /// # Errors
    /// When there is not one pose and one word per body, a pose is not finite, no solid has the mass properties of a body, a geom
    /// of the hand that would touch is no box, ball, capsule or cylinder, or MuJoCo refuses the hand.
    pub fn new(model: &HandModel, scene: &ClutterScene, target: usize, awake: &[bool]) -> Result<Self, HandError> {
        scene.check(target, awake)?;
        model.check_solids()?;
        let moves = |body: &usize| *body == target || awake[*body];
        let (awake, asleep): (Vec<usize>, Vec<usize>) = (0..scene.bodies.len()).partition(moves);
        // Description: the hand on slides, then the container with fixed bodies, then moving bodies.
        let refused = refused_by(model);
        let (mut spec, gains) = hand_spec(model)?;
        spec.set_memory(MEMORY as _);
        for geom in spec.geom_iter_mut().filter(|geom| (geom.contype() | geom.conaffinity()) & 1 != 0) {
            geom.set_contype(geom.contype() | WITH_HAND);
        }
        let roots = add_slides(&mut spec, model)?;
        add_container(&mut spec, scene, &asleep);
        for (parked, body) in awake.iter().enumerate() {
            add_awake(&mut spec, scene, *body, target, parked);
        }
        let mut compiled = spec.compile().map_err(refused)?;
        // Numbers of the added parts in the compiled model.
        let number = |name: &str| compiled.name_to_id(MjtObjBase::mjOBJ_BODY, name).expect("the body was added");
        let container = number(CONTAINER);
        let slide = |(root, axis): (usize, usize)| {
            let joint =
                compiled.name_to_id(MjtObjBase::mjOBJ_JOINT, &slide_name(root, axis)).expect("the slide was added");
            let [address, dof] = [compiled.jnt_qposadr()[joint], compiled.jnt_dofadr()[joint]].map(index);
            let mass = compiled.dof_m0()[dof];
            BaseSlide { axis, address, dof, mass, weight: mass - SLIDE_MASS }
        };
        let slides = (0..roots).flat_map(|root| (0..3).map(move |axis| (root, axis))).map(slide).collect();
        let order: Vec<usize> = asleep.into_iter().chain(awake).collect();
        let numbers: BTreeMap<usize, usize> =
            order.iter().enumerate().map(|(at, body)| (*body, container + 1 + at)).collect();
        let is_neighbour = |(_, body): &(usize, &usize)| **body != target;
        let moving = order.iter().enumerate().filter(is_neighbour).filter_map(|(at, body)| {
            let joint = usize::try_from(compiled.body_jntadr()[container + 1 + at]).ok()?;
            Some(Neighbour { body: *body, address: index(compiled.jnt_qposadr()[joint]) })
        });
        let mut neighbours: Vec<Neighbour> = moving.collect();
        neighbours.sort_unstable_by_key(|neighbour| neighbour.body);
        // The target is the free object of the simulation; all other bodies are its neighbours.
        let solid = &scene.bodies[target].solid;
        let object = free_object(&mut compiled, numbers[&target], solid);
        let held = Held {
            hold: Hold::Free(object),
            true_mesh: Some(mesh_of(&compiled, scene, target)),
            neighbours: order
                .iter()
                .filter(|body| **body != target)
                .map(|body| mesh_of(&compiled, scene, *body))
                .chain(wall_mesh(&scene.container).map(|surface| TrueMesh::named(&compiled, WALLS, surface)))
                .collect(),
            table: None,
        };
        let owner = |body: usize| match body {
            body if body == container => Some(GeomOwner::Scene(0)),
            body if body == numbers[&target] => Some(GeomOwner::Object),
            body => Some(GeomOwner::Scene(1 + order.get(body.checked_sub(container + 1)?)?)),
        };
        let sim = Arc::new(HandSim::assembled(model, compiled, &gains, held, owner)?);
        let scene = scene.clone();
        Ok(Self { sim, scene, target, neighbours, order, container, slides })
    }
}

impl std::fmt::Debug for ClutterSim {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { sim, target, order, .. } = self;
        f.debug_struct("ClutterSim")
            .field("sim", sim)
            .field("target", target)
            .field("order", order)
            .finish_non_exhaustive()
    }
}

/// Name of the geom that represents a body's true mesh.
fn mesh_name(body: usize) -> String {
    format!("graspmill true mesh {body}")
}

fn mesh_of(model: &MjModel, scene: &ClutterScene, body: usize) -> TrueMesh {
    TrueMesh::named(model, &mesh_name(body), scene.bodies[body].body.surface())
}

/// Masses and the box of a body.
fn patch_of(scene: &ClutterScene, body: usize) -> BodyPatch {
    BodyPatch::new(&scene.bodies[body], scene.rolling)
}

/// Lets the bodies in the world of the hand's description slide along its axes; returns their number.
fn add_slides(spec: &mut MjSpec, model: &HandModel) -> Result<usize, HandError> {
    let refused = |message: &str| {
        let message = format!(
            "{message}: a hand that moves through a scene needs a body in the world that carries all the others"
        );
        Err(HandError::from(RobotError::Refused { path: model.robot.path.clone(), message }))
    };
    let world = spec.world_body_mut();
    if world.geom_iter_mut(false).any(|geom| geom.contype() != 0 || geom.conaffinity() != 0) {
        return refused("a geom that can touch is part of the world itself");
    }
    let known = &model.robot.model;
    let in_world = (1..known.body_parentid().len()).filter(|body| known.body_parentid()[*body] == 0);
    let mut roots = 0;
    for (body, number) in world.body_iter_mut().zip(in_world) {
        if body.joint_iter_mut(false).next().is_some() {
            return refused("a body in the world has a joint");
        }
        // Axes of slides are expressed in the body's frame, which may be rotated in the world.
        let body_from_base = isometry(&[0.0; 3], &known.body_quat()[number]).rotation.matrix().transpose();
        for axis in 0..3 {
            let along = body_from_base.column(axis).into_owned();
            let slide = body.add_joint();
            slide.with_name(&slide_name(roots, axis));
            slide.set_type(MjtJoint::mjJNT_SLIDE);
            *slide.axis_mut() = along.into();
            // The hand's description may set its own defaults.
            slide.set_limited(MjtLimited::mjLIMITED_FALSE);
            slide.set_armature(SLIDE_MASS);
            slide.set_frictionloss(0.0);
            slide.damping_mut().fill(0.0);
            slide.stiffness_mut().fill(0.0);
        }
        roots += 1;
    }
    Ok(roots)
}

fn slide_name(root: usize, axis: usize) -> String {
    format!("{} {root}", SLIDES[axis])
}

/// The container, far away, with the bodies that sleep in it.
fn add_container(spec: &mut MjSpec, scene: &ClutterScene, asleep: &[usize]) {
    let container = spec.world_body_mut().add_body();
    container.with_name(CONTAINER).set_mocap(true);
    *container.pos_mut() = [0.0, 0.0, -20.0 * PARKED];
    let stand_in = add_box(container, &scene.container.bounds());
    // The larger of two frictions applies: the container has none for bodies.
    *stand_in.friction_mut() = [0.0; 3];
    stand_in.set_condim(6);
    touch_bodies(stand_in);
    for (part, scene_from_part) in boxes_of(&scene.container) {
        let part = add_box(container, &part);
        let middle = scene_from_part * Point3::from(*part.pos());
        *part.pos_mut() = middle.coords.into();
        *part.quat_mut() = quaternion(&scene_from_part);
        touch_hand_as_container(part);
    }
    if let Some(surface) = wall_mesh(&scene.container) {
        let on_container = |spec| body_named(spec, CONTAINER);
        touch_hand_as_container(true_mesh::add_named_geom(spec, WALLS, surface, on_container));
    }
    for body in asleep {
        let pose = &scene.scene_from_objects[*body];
        let sleeper = body_named(spec, CONTAINER).add_body();
        sleeper.with_name(&name_of(*body));
        *sleeper.pos_mut() = pose.translation.vector.into();
        *sleeper.quat_mut() = quaternion(pose);
        let patch = patch_of(scene, *body);
        patch.add_mass_to(sleeper);
        touch_bodies(patch.add_box_to(sleeper));
        add_mesh(spec, scene, *body);
    }
}

/// A body that moves, waiting far away; `parked` are before it.
fn add_awake(spec: &mut MjSpec, scene: &ClutterScene, body: usize, target: usize, parked: usize) {
    let patch = patch_of(scene, body);
    let aside = [PARKED + 2.0 * parked as f64, PARKED, -PARKED];
    if body == target {
        add_free_object(spec, &scene.bodies[body].solid);
        *object_body(spec).pos_mut() = aside;
        // The mesh comes first: the friction of a free object is that of its first geom.
        let surface = scene.bodies[body].body.surface();
        touch_hand(true_mesh::add_named_geom(spec, &mesh_name(body), surface, object_body));
        touch_bodies(patch.add_box_to(object_body(spec)));
    } else {
        let added = spec.world_body_mut().add_body();
        added.with_name(&name_of(body));
        *added.pos_mut() = aside;
        touch_bodies(patch.add_to(added));
        add_mesh(spec, scene, body);
    }
}

/// Puts the true mesh on a body other than the target.
fn add_mesh(spec: &mut MjSpec, scene: &ClutterScene, body: usize) {
    let SimBody { body: mesh, friction, .. } = &scene.bodies[body];
    let on_body = |spec| body_named(spec, &name_of(body));
    let geom = true_mesh::add_named_geom(spec, &mesh_name(body), mesh.surface(), on_body);
    touch_hand(geom);
    // Its friction applies to every contact, as the target's does.
    geom.set_priority(1);
    geom.set_condim(if scene.torsion > 0.0 { 4 } else { 3 });
    *geom.friction_mut() = [*friction, friction * scene.torsion, 1e-4];
}

fn add_box<'b>(body: &'b mut MjsBody, bounds: &Aabb) -> &'b mut MjsGeom {
    let geom = body.add_geom();
    geom.set_type(MjtGeomBase::mjGEOM_BOX);
    *geom.pos_mut() = bounds.centre().into();
    *geom.size_mut() = ((bounds.max - bounds.min) / 2.0).into();
    geom
}

/// Lets a geom touch bodies of the scene and its container.
fn touch_bodies(geom: &mut MjsGeom) {
    set_kinds(geom, AMONG_BODIES, AMONG_BODIES);
}

/// Lets a geom touch the hand.
fn touch_hand(geom: &mut MjsGeom) {
    set_kinds(geom, 0, WITH_HAND);
}

/// Sets the groups that a geom touches, and removes the defaults of the hand's description from it.
fn set_kinds(geom: &mut MjsGeom, contype: i32, conaffinity: i32) {
    drop_defaults(geom);
    geom.set_contype(contype);
    geom.set_conaffinity(conaffinity);
}

fn name_of(body: usize) -> String {
    format!("graspmill body {body}")
}

fn body_named<'s>(spec: &'s mut MjSpec, name: &str) -> &'s mut MjsBody {
    spec.body_mut(name).expect("the body was added")
}

/// Boxes that the hand touches a container with [m], and the poses of their frames in the scene: a table, and on it the boxes of a
/// bin.
fn boxes_of(container: &Container) -> Vec<(Aabb, IsometryMatrix3<f64>)> {
    let [wide, deep, thick] = TABLE;
    let ground = if matches!(container, Container::Plane { .. }) { 0.0 } else { container.bounds().min.z };
    let table = Aabb { min: Point3::new(-wide, -deep, ground - thick), max: Point3::new(wide, deep, ground) };
    let mut boxes = vec![(table, IsometryMatrix3::identity())];
    if let Container::Bin(Vessel { boxes: of_bin, world_from_vessel, .. }) = container {
        boxes.extend(of_bin.iter().map(|part| (*part, *world_from_vessel)));
    }
    boxes
}

/// The mesh that the hand touches a container with, which has no boxes.
fn wall_mesh(container: &Container) -> Option<&Arc<ContactSurface>> {
    match container {
        Container::Bin(Vessel { body, boxes, .. }) if boxes.is_empty() => Some(body.surface()),
        _ => None,
    }
}

/// Lets the hand touch a part of the container, whose friction applies to every contact.
fn touch_hand_as_container(geom: &mut MjsGeom) {
    touch_hand(geom);
    geom.set_priority(2);
    geom.set_condim(3);
    *geom.friction_mut() = [CONTAINER_FRICTION, 0.0, 0.0];
}
