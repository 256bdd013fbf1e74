//! A compiled MuJoCo model of a hand with a fixed or a free object.
//!
//! The hand's base is the world. A fixed object hangs on stiff slides: MuJoCo searches no contacts between two
//! bodies without a joint, and with slides the hand's base feels the object.
//!
//! MuJoCo moves every joint by a position servo; the coupling is in the servos' commands ([`crate::hand::closing`]), not in
//! equality constraints, so that a clutch can open while the simulation runs and the same controls replay in plain MuJoCo.
//! The description's own actuators are switched off, its couplings taken out.

use std::sync::Arc;

use mujoco_rs::{
    mujoco_c::{mjtDisableBit, mjtIntegrator},
    wrappers::{
        mj_editing::{MjSpec, MjsBody, MjtLimited, PositionConfig, SpecElement, SpecItem},
        mj_model::{MjModel, MjtEq, MjtGeomBase, MjtJoint, MjtObjBase, MjtSensor, MjtTrn},
        mj_option::MjOption,
    },
};
use nalgebra::{IsometryMatrix3, Point3};

use crate::{
    convert::{index, isometry, quaternion},
    description::open::{OpenedSpec, open_spec, refused_by_mujoco},
    error::HandError,
    ffi::drop_free_joints,
    hand::model::HandModel,
    objects::{
        added_geom::drop_defaults,
        free_object::{FreeObject, Touched},
        native_mesh::NativeContacts,
        table::{self, Table},
        thing::StillThing,
        true_mesh::{self, TrueMesh},
    },
    physics::{CONTACT_SOLIMP, CONTACT_SOLREF, Numerics, STEP},
    statements::Usage,
};
use kernel::{
    contact::{ContactSurface, Probe},
    geom::{MassProperties, Shape, TriMesh},
};
use robot::{
    collision::Geometry,
    hand::{Hand, Mount},
    kinematics::JointKind,
};

/// Error of a servo at its joint's torque [rad].
const SAG: f64 = 0.0025;

/// Error of a slide's servo at its force [m].
const SLIDE_SAG: f64 = 0.000_25;

/// Natural frequency of a servo times the step. Its stiffness acts one step late: above 1 it would oscillate.
const STIFFNESS_OF_A_STEP: f64 = 0.3;

/// The group that the description's own actuators are put into, to be switched off.
const OWN_ACTUATORS: i32 = 30;

/// Names of the mount, of the object that the hand closes on, and of the three slides between them.
pub(crate) const MOUNT: &str = "graspmill place";
pub(crate) const OBJECT: &str = "graspmill object";
pub(crate) const SLIDES: [&str; 3] = ["graspmill x", "graspmill y", "graspmill z"];

/// Mass that a slide moves [kg]: large enough for a slide that is stiff against the forces of fingers.
pub(crate) const SLIDE_MASS: f64 = 100.0;

/// The free object's joint.
const FREE: &str = "graspmill free";

/// Servo that moves one joint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Servo {
    /// Index among MuJoCo's controls.
    pub(crate) control: usize,
    /// Index among its coordinates.
    pub(crate) address: usize,
    /// Index among its velocities.
    pub(crate) dof: usize,
    /// Torque per unit of error.
    pub(crate) stiffness: f64,
    /// Torque per unit of speed.
    pub(crate) damping: f64,
    /// Approximate inertia that it has to move [kg m^2 or kg].
    pub(crate) inertia: f64,
}

/// Support of the object.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Hold {
    /// Stiff slides under the mount.
    Slides([Servo; 3]),
    /// A free joint.
    Free(FreeObject),
}

/// Owner of a geom of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GeomOwner {
    /// A link of the hand; 0 is the base.
    Link(usize),
    Object,
    Table,
    /// Something of a scene other than the object: 0 for the container, or the number of a body.
    Scene(usize),
}

/// Object in a hand's model, and its surroundings.
pub(crate) struct Held {
    /// Support of the object.
    pub(crate) hold: Hold,
    /// The object, where it is a true mesh.
    pub(crate) true_mesh: Option<TrueMesh>,
    /// True meshes around it.
    pub(crate) neighbours: Vec<TrueMesh>,
    /// The table, if the object may rest on one.
    pub(crate) table: Option<Table>,
}

/// A compiled model of a hand and an object. Shared by threads; each makes its own [`crate::HandWorker`].
pub struct HandSim {
    pub(crate) hand: Arc<Hand>,
    pub(crate) model: Arc<MjModel>,
    /// Servo of each joint of the hand's tree.
    pub(crate) servos: Vec<Servo>,
    /// Support of the object.
    pub(crate) hold: Hold,
    /// The object, where it is a true mesh.
    pub(crate) true_mesh: Option<TrueMesh>,
    /// True meshes around it, in a scene.
    pub(crate) neighbours: Vec<TrueMesh>,
    /// Solids of the hand that may touch the true mesh, and where each sits.
    pub(crate) solids: Vec<(Mount, Probe)>,
    /// Whether each motor of the hand moves each link.
    pub(crate) links_moved: Vec<Vec<bool>>,
    /// Owner of each geom of the model.
    pub(crate) owners: Vec<GeomOwner>,
    /// The table, if the object may rest on one.
    pub(crate) table: Option<Table>,
    /// Fixed things around a fixed object.
    pub(crate) still: Vec<StillThing>,
    /// Names of the description's touch sensors, and where their values are.
    pub(crate) touch_sensors: Vec<(String, usize)>,
}

impl HandSim {
    /// Compiles the hand with an object out of shapes, placed in the object's frame.
    ///
    /// # Errors
    /// When the object has no shape, a mesh, or a number that is not finite, or MuJoCo refuses it.
    pub fn new(model: &HandModel, object: &[Geometry]) -> Result<Self, HandError> {
        check(object)?;
        Self::compile(model, None, |spec| add_shapes(object_body(spec), object), None, None)
    }

    /// Compiles the hand with an object that is a true mesh; of the hand's own geoms only boxes, balls, capsules and
    /// cylinders can touch it.
    ///
    /// # Errors
    /// When another geom of the hand can touch, or MuJoCo refuses the hand.
    pub fn with_mesh(model: &HandModel, object: &Arc<ContactSurface>) -> Result<Self, HandError> {
        model.check_solids()?;
        Self::compile(model, None, |spec| true_mesh::add_geom(spec, object, object_body), Some(object), None)
    }

    /// Compiles the hand with a mesh as MuJoCo itself touches it: slow and right, or its convex hull. For comparison.
    ///
    /// # Errors
    /// When MuJoCo refuses the mesh or the hand, or the mesh has more triangles than it has memory for their contacts.
    pub fn with_native_mesh(model: &HandModel, object: &TriMesh, contacts: NativeContacts) -> Result<Self, HandError> {
        contacts.check(model.max_geoms_per_body(), object)?;
        Self::compile(model, None, |spec| contacts.add(spec, OBJECT, model.max_geoms_per_body(), object), None, None)
    }

    /// Compiles as [`HandSim::with_mesh`], with the object free to move and with its mass.
    pub(crate) fn with_free_mesh(
        model: &HandModel,
        object: &Arc<ContactSurface>,
        mass: &MassProperties,
    ) -> Result<Self, HandError> {
        Self::with_free_mesh_over(model, object, mass, None)
    }

    /// Compiles as [`HandSim::with_free_mesh`], with a table on which the object can rest.
    pub(crate) fn with_free_mesh_on_table(
        model: &HandModel,
        object: &Arc<ContactSurface>,
        mass: &MassProperties,
    ) -> Result<Self, HandError> {
        let flat = || HandError::Object { reason: "it lies in a plane: it has no side to rest on".into() };
        let corners = object.hull_corners().ok_or_else(flat)?;
        Self::with_free_mesh_over(model, object, mass, Some(corners))
    }

    /// Compiles with a table where the corners of the object's convex hull are given.
    fn with_free_mesh_over(
        model: &HandModel,
        object: &Arc<ContactSurface>,
        mass: &MassProperties,
        corners: Option<Vec<Point3<f64>>>,
    ) -> Result<Self, HandError> {
        model.check_solids()?;
        check_mass(mass)?;
        let add_geoms = |spec: &mut MjSpec| true_mesh::add_geom(spec, object, object_body);
        Self::compile(model, Some(mass), add_geoms, Some(object), corners)
    }

    /// Compiles as [`HandSim::with_native_mesh`], the object free to move.
    pub(crate) fn with_free_native_mesh(
        model: &HandModel,
        object: &TriMesh,
        mass: &MassProperties,
        contacts: NativeContacts,
    ) -> Result<Self, HandError> {
        check_mass(mass)?;
        contacts.check(model.max_geoms_per_body(), object)?;
        let add_geoms = |spec: &mut MjSpec| contacts.add(spec, OBJECT, model.max_geoms_per_body(), object);
        Self::compile(model, Some(mass), add_geoms, None, None)
    }

    /// Compiles with a free object where `mass` is given, else with one on slides; with a table where the corners of the
    /// object's convex hull are given.
    fn compile(
        model: &HandModel,
        mass: Option<&MassProperties>,
        add_geoms: impl FnOnce(&mut MjSpec),
        surface: Option<&Arc<ContactSurface>>,
        corners: Option<Vec<Point3<f64>>>,
    ) -> Result<Self, HandError> {
        let refused = refused_by(model);
        let (mut spec, gains) = hand_spec(model)?;
        match mass {
            Some(mass) => add_free_object(&mut spec, mass),
            None => add_object(&mut spec).map_err(refused)?,
        }
        add_geoms(&mut spec);
        if corners.is_some() {
            table::add(&mut spec, object_body);
        }
        let mut compiled = spec.compile().map_err(refused)?;
        let object = compiled.name_to_id(MjtObjBase::mjOBJ_BODY, OBJECT).expect("the object was added");
        let table = corners.is_some().then(|| Table::of(&compiled, object));
        let true_mesh = surface.map(|surface| TrueMesh::of_model(&compiled, surface, corners.unwrap_or_default()));
        let hold = match mass {
            Some(mass) => Hold::Free(free_object(&mut compiled, object, mass)),
            None => Hold::Slides(SLIDES.map(|name| servo(&compiled, name, slide_stiffness()))),
        };
        let table_body = table.as_ref().map(|table| table.body);
        let owner = |body: usize| match body {
            body if body == object => Some(GeomOwner::Object),
            body => (Some(body) == table_body).then_some(GeomOwner::Table),
        };
        Self::assembled(model, compiled, &gains, Held { hold, true_mesh, neighbours: Vec::new(), table }, owner)
    }

    /// Assembles a simulation of a compiled model, in which the hand comes first; `owner` gives the owner of each body
    /// after it.
    pub(crate) fn assembled(
        model: &HandModel,
        mut compiled: MjModel,
        gains: &[f64],
        held: Held,
        owner: impl Fn(usize) -> Option<GeomOwner>,
    ) -> Result<Self, HandError> {
        // Solver options, and the same contact parameters for all geoms and flexes.
        set_option(compiled.opt_mut());
        compiled.geom_solref_mut().fill(CONTACT_SOLREF);
        compiled.geom_solimp_mut().fill(CONTACT_SOLIMP);
        compiled.flex_solref_mut().fill(CONTACT_SOLREF);
        compiled.flex_solimp_mut().fill(CONTACT_SOLIMP);
        let hand = Arc::clone(&model.hand);
        // Servos of the joints, owners of the geoms, touch sensors.
        let servos = servos(&compiled, &hand, gains);
        let links = model.robot.all_links()?;
        // Added bodies come last: the description's bodies keep their numbers.
        let owner = |body: &i32| owner(index(*body)).unwrap_or_else(|| GeomOwner::Link(links.of_body[index(*body)].0));
        let owners = compiled.geom_bodyid().iter().map(owner).collect();
        let touch_sensors = (0..compiled.sensor_type().len())
            .filter(|sensor| compiled.sensor_type()[*sensor] == MjtSensor::mjSENS_TOUCH)
            .map(|sensor| {
                let name = compiled.id_to_name(MjtObjBase::mjOBJ_SENSOR, sensor).unwrap_or_default().to_owned();
                (name, index(compiled.sensor_adr()[sensor]))
            })
            .collect();
        // Solids of the hand that touch the true mesh, on their links.
        let solid = |(geom, probe): (usize, &Option<Probe>)| {
            let (link, link_from_body) = links.of_body.get(index(compiled.geom_bodyid()[geom]))?;
            let body_from_geom = isometry(&compiled.geom_pos()[geom], &compiled.geom_quat()[geom]);
            Some((Mount { link: *link, link_from_frame: link_from_body * body_from_geom }, (*probe)?))
        };
        let Held { hold, true_mesh, neighbours, table } = held;
        let probes = true_mesh.iter().flat_map(|mesh| mesh.probes.iter().enumerate());
        let solids = probes.filter_map(solid).collect();
        let model = Arc::new(compiled);
        let links_moved = hand.driven().iter().map(|driven| hand.links_moved(driven)).collect();
        let still = Vec::new();
        Ok(Self {
            hand,
            model,
            servos,
            hold,
            true_mesh,
            neighbours,
            solids,
            links_moved,
            owners,
            table,
            still,
            touch_sensors,
        })
    }

    /// The hand.
    pub fn hand(&self) -> &Hand {
        &self.hand
    }

    /// Names of the description's touch sensors, whose values trials record.
    pub fn touch_sensors(&self) -> impl Iterator<Item = &str> {
        self.touch_sensors.iter().map(|(name, _)| name.as_str())
    }
}

impl std::fmt::Debug for HandSim {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HandSim").field("hand", &self.hand).finish_non_exhaustive()
    }
}

/// Error for a hand's description that MuJoCo refuses.
pub(crate) fn refused_by(model: &HandModel) -> impl Fn(mujoco_rs::error::MjEditError) -> HandError + Copy {
    |error| HandError::from(refused_by_mujoco(&model.robot.path, &error))
}

/// The hand alone, its own actuators and couplings switched off, with a servo for each joint; their stiffness, by joint.
pub(crate) fn hand_spec(model: &HandModel) -> Result<(MjSpec, Vec<f64>), HandError> {
    let refused = refused_by(model);
    let OpenedSpec { mut spec, .. } = open_spec(&model.robot.path, Usage::Hand)?;
    drop_free_joints(&mut spec).map_err(refused)?;
    for actuator in spec.actuator_iter_mut() {
        actuator.set_group(OWN_ACTUATORS);
    }
    // The object's friction applies.
    for geom in spec.geom_iter_mut() {
        geom.set_priority(geom.priority().min(0));
    }
    for equality in spec.equality_iter_mut().filter(|equality| equality.type_() == MjtEq::mjEQ_JOINT) {
        equality.set_active(false);
    }
    // Only the object's mount is placed from outside.
    for body in spec.world_body_mut().body_iter_mut() {
        body.set_mocap(false);
    }
    // Their controls and places would be of the wrong length.
    for key in spec.key_iter_mut() {
        key.set_ctrl(&[]);
        key.set_mpos(&[]);
        key.set_mquat(&[]);
    }
    let gains = add_servos(&mut spec, &model.hand).map_err(refused)?;
    Ok((spec, gains))
}

fn check(object: &[Geometry]) -> Result<(), HandError> {
    let wrong = |reason: String| Err(HandError::Object { reason });
    if object.is_empty() {
        return wrong("it has no shape".into());
    }
    for geometry in object {
        let sizes = match &geometry.shape {
            Shape::Box { half } => half.to_vec(),
            Shape::Sphere { radius } => vec![*radius],
            Shape::Capsule { radius, half } | Shape::Cylinder { radius, half } => vec![*radius, *half],
            Shape::Mesh(_) => return wrong("a mesh is a separate object: give it to HandSim::with_mesh".into()),
        };
        if !sizes.iter().all(|size| size.is_finite() && *size > 0.0) {
            return wrong(format!("{:?} has a size that is not above 0", geometry.shape));
        }
        if !is_finite(&geometry.link_from_shape) {
            return wrong("the pose of a shape is not finite".into());
        }
    }
    Ok(())
}

pub(crate) fn is_finite(pose: &IsometryMatrix3<f64>) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.matrix().iter()).all(|number| number.is_finite())
}

/// Stiffness of each joint's servo, and the joint's inertia at least.
fn add_servos(spec: &mut MjSpec, hand: &Hand) -> Result<Vec<f64>, mujoco_rs::error::MjEditError> {
    let mut gains = vec![0.0; hand.tree().len()];
    for driven in hand.driven() {
        let alone = driven.breakaway.map(|breakaway| (driven.followers[breakaway.follower].joint, breakaway.torque));
        for joint in driven.followers.iter().map(|follower| follower.joint).chain([driven.joint]) {
            let torque = alone.filter(|(follower, _)| *follower == joint).map_or(driven.torque, |(_, torque)| torque);
            let slides = hand.tree().joints()[joint].joint.kind == JointKind::Prismatic;
            gains[joint] = torque / if slides { SLIDE_SAG } else { SAG };
        }
    }
    // A gear multiplies its motor's inertia: the inertia that makes a stiff servo stable is realistic.
    let inertia = |stiffness: f64| stiffness * (STEP / STIFFNESS_OF_A_STEP).powi(2);
    for joint in spec.joint_iter_mut() {
        if let Some(index) = hand.tree().joint_named(joint.name()) {
            joint.set_armature(joint.armature().max(inertia(gains[index])));
        }
    }
    for (joint, stiffness) in hand.tree().joints().iter().zip(&gains) {
        add_servo(spec, &joint.joint.name, *stiffness)?;
    }
    Ok(gains)
}

/// A position servo, critically damped.
fn add_servo(spec: &mut MjSpec, joint: &str, stiffness: f64) -> Result<(), mujoco_rs::error::MjEditError> {
    let servo = spec.add_actuator();
    servo.with_name(&servo_of(joint));
    servo.set_trntype(MjtTrn::mjTRN_JOINT);
    servo.set_target(joint);
    servo.set_to_position(PositionConfig { kp: stiffness, dampratio: Some(1.0), ..PositionConfig::default() })?;
    servo.set_ctrllimited(MjtLimited::mjLIMITED_FALSE);
    servo.set_forcelimited(MjtLimited::mjLIMITED_FALSE);
    servo.set_group(0);
    Ok(())
}

/// Name of a joint's servo.
pub(crate) fn servo_of(joint: &str) -> String {
    format!("graspmill {joint}")
}

/// The mount, the object without geoms, and its slides.
pub(crate) fn add_object(spec: &mut MjSpec) -> Result<(), mujoco_rs::error::MjEditError> {
    let mount = spec.world_body_mut().add_body();
    mount.with_name(MOUNT).set_mocap(true);
    let object = mount.add_body();
    object.with_name(OBJECT);
    // As a mass, not as armature: from this MuJoCo takes how hard contacts are.
    object.set_mass(SLIDE_MASS);
    *object.inertia_mut() = [SLIDE_MASS * 1e-3; 3];
    object.set_explicitinertial(true);
    for (axis, name) in SLIDES.into_iter().enumerate() {
        let slide = object.add_joint();
        slide.with_name(name);
        slide.set_type(MjtJoint::mjJNT_SLIDE);
        // The hand's description may limit its joints by default.
        slide.set_limited(MjtLimited::mjLIMITED_FALSE);
        *slide.axis_mut() = std::array::from_fn(|part| f64::from(u8::from(part == axis)));
    }
    for name in SLIDES {
        add_servo(spec, name, slide_stiffness())?;
    }
    Ok(())
}

/// Stiffness of a slide [N/m], as large as the mass on it allows: 50 N push the object off by 20 micrometres.
pub(crate) fn slide_stiffness() -> f64 {
    SLIDE_MASS * (STIFFNESS_OF_A_STEP / STEP).powi(2)
}

/// The object without geoms, free to move.
pub(crate) fn add_free_object(spec: &mut MjSpec, mass: &MassProperties) {
    let object = spec.world_body_mut().add_body();
    object.with_name(OBJECT);
    object.set_mass(1.0);
    *object.ipos_mut() = mass.centre.into();
    let at = |row, column| mass.inertia[(row, column)];
    *object.fullinertia_mut() = [at(0, 0), at(1, 1), at(2, 2), at(0, 1), at(0, 2), at(1, 2)];
    object.set_explicitinertial(true);
    object.add_free_joint().with_name(FREE);
}

/// Finds the free object in the compiled model, and gives its friction priority over the hand's.
pub(crate) fn free_object(model: &mut MjModel, body: usize, mass: &MassProperties) -> FreeObject {
    let touched = if model.body_geomnum()[body] > 0 {
        let geom = index(model.body_geomadr()[body]);
        model.geom_priority_mut()[geom] = 1;
        Touched::Geom(geom)
    } else {
        Touched::Flex(model.name_to_id(MjtObjBase::mjOBJ_FLEX, OBJECT).expect("the object was added"))
    };
    let joint = model.name_to_id(MjtObjBase::mjOBJ_JOINT, FREE).expect("the object was added");
    let [address, dof] = [model.jnt_qposadr()[joint], model.jnt_dofadr()[joint]].map(index);
    FreeObject { body, touched, address, dof, inertia: model.body_inertia()[body], centre: mass.centre }
}

/// Refuses sizes, and moments of inertia that no solid has, before the compiler would.
pub(crate) fn check_mass(mass: &MassProperties) -> Result<(), HandError> {
    let wrong = |reason: String| Err(HandError::Object { reason });
    let moments = mass.inertia.symmetric_eigenvalues();
    let fits = mass.volume > 0.0 && mass.volume.is_finite() && mass.centre.iter().all(|part| part.is_finite());
    if !fits {
        return wrong(format!("a volume of {} m^3 with its centre at {}", mass.volume, mass.centre));
    }
    if !moments.iter().all(|moment| moment.is_finite() && *moment > 1e-12)
        || 2.0 * moments.max() > moments.sum() * 1.001
    {
        return wrong(format!("no solid has moments of inertia of {moments:?} m^2 per kilogram"));
    }
    Ok(())
}

pub(crate) fn object_body(spec: &mut MjSpec) -> &mut MjsBody {
    spec.body_mut(OBJECT).expect("the object was added")
}

fn add_shapes(body: &mut MjsBody, object: &[Geometry]) {
    for Geometry { shape, link_from_shape } in object {
        let geom = body.add_geom();
        drop_defaults(geom);
        let (kind, size) = match shape {
            Shape::Box { half } => (MjtGeomBase::mjGEOM_BOX, *half),
            Shape::Sphere { radius } => (MjtGeomBase::mjGEOM_SPHERE, [*radius, 0.0, 0.0]),
            Shape::Capsule { radius, half } => (MjtGeomBase::mjGEOM_CAPSULE, [*radius, *half, 0.0]),
            Shape::Cylinder { radius, half } => (MjtGeomBase::mjGEOM_CYLINDER, [*radius, *half, 0.0]),
            Shape::Mesh(_) => unreachable!("checked"),
        };
        geom.set_type(kind);
        *geom.size_mut() = size;
        *geom.pos_mut() = link_from_shape.translation.vector.into();
        *geom.quat_mut() = quaternion(link_from_shape);
    }
}

/// Options that every simulation of a hand has.
pub(crate) fn set_option(option: &mut MjOption) {
    Numerics::Standard.set(option);
    option.integrator = mjtIntegrator::mjINT_IMPLICITFAST as i32;
    option.gravity = [0.0; 3];
    option.disableactuator = 1 << OWN_ACTUATORS;
    let needed = mjtDisableBit::mjDSBL_CONTACT as i32
        | mjtDisableBit::mjDSBL_ACTUATION as i32
        | mjtDisableBit::mjDSBL_LIMIT as i32
        | mjtDisableBit::mjDSBL_SENSOR as i32;
    option.disableflags &= !needed;
}

fn servos(model: &MjModel, hand: &Hand, gains: &[f64]) -> Vec<Servo> {
    let joints = hand.tree().joints().iter();
    joints.zip(gains).map(|(joint, stiffness)| servo(model, &joint.joint.name, *stiffness)).collect()
}

pub(crate) fn servo(model: &MjModel, joint: &str, stiffness: f64) -> Servo {
    let id = model.name_to_id(MjtObjBase::mjOBJ_JOINT, joint).expect("the joint is the model's");
    let control = model.name_to_id(MjtObjBase::mjOBJ_ACTUATOR, &servo_of(joint)).expect("added");
    // MuJoCo has converted the ratio of damping to a gain.
    let damping = -model.actuator_biasprm()[control][2];
    let [address, dof] = [model.jnt_qposadr()[id], model.jnt_dofadr()[id]].map(index);
    Servo { control, address, dof, stiffness, damping, inertia: model.dof_m0()[dof] }
}
