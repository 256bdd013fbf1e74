//! Trials in scenes, one after another.

use std::sync::Arc;

use mujoco_rs::wrappers::mj_auxiliary::MjContact;
use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    ClutterOutcome, ClutterPhase, ClutterSim, ClutterTouch, ClutterVerdict, NeighbourMotion,
    glide::Glide,
    model::{BaseSlide, Neighbour},
};
use crate::{
    convert::{angle_between, isometry, quaternion},
    error::HandError,
    ffi,
    hand::{
        closing::HandWorker,
        effort::{Effort, MotorCommand},
        sim::{GeomOwner, Hold, is_finite},
    },
    objects::{
        collider::{SceneCollider, SceneLoan},
        free_object::FreeObject,
    },
    physics::{GRAVITY, Instability, STEP, Unstable},
    trial::{PUSHED_AWAY, deepest, deepest_start, pressing_links, steps_in},
};
use kernel::contact::EDGE_RADIUS;

/// Protocol of a trial in a scene. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClutterProtocol {
    /// Distance along its approach at which the hand starts [m], and the time of the approach by minimum jerk [s].
    pub stand_off: f64,
    /// See [`ClutterProtocol::stand_off`].
    pub approach_time: f64,
    /// Deepest start [m].
    pub start_depth: f64,
    /// Longest closing [s]; it ends before, when the hand is at rest.
    pub closing: f64,
    /// Effort with which the hand closes, and keeps closing to the end.
    pub effort: Effort,
    /// Height of the lift [m], by minimum jerk in `lift_time`.
    pub lift: f64,
    /// See [`ClutterProtocol::lift`].
    pub lift_time: f64,
    /// Time for which the hand holds the lifted target [s].
    pub hold_time: f64,
    /// Height by which the target's centre of mass has to be up in the end [m].
    pub raised: f64,
    /// Largest distance of the target's centre of mass from where it was in the closed hand [m].
    pub lost_distance: f64,
    /// Largest rotation of the target in the hand [rad].
    pub lost_angle: f64,
}

impl ClutterProtocol {
    /// 10 cm in half a second; 1 mm; 1 s with all effort; 10 cm in 1 s, kept for half a second; 8 cm; 30 mm, 30 degrees.
    pub const STANDARD: Self = Self {
        stand_off: 0.1,
        approach_time: 0.5,
        start_depth: 0.001,
        closing: 1.0,
        effort: Effort::GRASP,
        lift: 0.1,
        lift_time: 1.0,
        hold_time: 0.5,
        raised: 0.08,
        lost_distance: 0.03,
        lost_angle: std::f64::consts::PI / 6.0,
    };
}

/// Working memory of one thread that makes trials in a scene; it has its own state.
pub struct ClutterWorker {
    sim: Arc<ClutterSim>,
    hand: HandWorker,
    object: FreeObject,
    collider: Option<SceneCollider>,
    protocol: ClutterProtocol,
    /// The scene's frame in MuJoCo's world, which is the hand's base frame where it grasps.
    world_from_scene: IsometryMatrix3<f64>,
    /// Centres of mass of the neighbours where they lay, in the scene [m].
    lay: Vec<Point3<f64>>,
}

/// Ends a trial early.
type Decided<T> = Result<T, ClutterVerdict>;

impl ClutterWorker {
    /// A worker with its own model.
    pub fn new(sim: &Arc<ClutterSim>, protocol: ClutterProtocol) -> Self {
        let Hold::Free(object) = sim.sim.hold else { unreachable!("trials are compiled with a free object") };
        let mut hand = HandWorker::new(&sim.sim);
        let target = &sim.scene.bodies[sim.target];
        ffi::set_object(&mut hand.data, &object, [target.mass, target.friction, sim.scene.torsion]);
        let bodies = sim.order.iter().map(|body| Arc::clone(&sim.scene.bodies[*body].body)).collect();
        let collider = Some(SceneCollider::new(sim.container, sim.scene.container.clone(), bodies));
        let sim = Arc::clone(sim);
        let world_from_scene = IsometryMatrix3::identity();
        Self { sim, hand, object, collider, protocol, world_from_scene, lay: Vec::new() }
    }

    /// Tries one grasp: the hand's posture before it closes, one value per driven joint, and the scene expressed in its base frame
    /// when it grasps. The trials before leave no trace.
    ///
    /// # Errors
    /// When the posture does not fit the hand, or the pose is not finite. Failures in the trial itself are in its
    /// verdict.
    pub fn run(
        &mut self,
        posture: &[f64],
        base_from_scene: &IsometryMatrix3<f64>,
    ) -> Result<ClutterOutcome, HandError> {
        let mut outcome = ClutterOutcome {
            verdict: ClutterVerdict::Held,
            touched: Vec::new(),
            neighbours: Vec::new(),
            closed: None,
            touches: Vec::new(),
            raised: 0.0,
            penetration: 0.0,
            steps: 0,
        };
        let approach = self.seat(posture, base_from_scene)?;
        let of = |neighbour: &Neighbour| NeighbourMotion { body: neighbour.body, moved: 0.0, raised: 0.0 };
        outcome.neighbours = self.sim.neighbours.iter().map(of).collect();
        let from = self.target_centre();
        outcome.verdict = self.decide(&mut outcome, &approach).err().unwrap_or(ClutterVerdict::Held);
        outcome.steps = self.hand.steps();
        outcome.raised = self.target_centre().z - from.z;
        if !matches!(outcome.verdict, ClutterVerdict::Unstable { .. } | ClutterVerdict::Refused { .. }) {
            for (motion, (neighbour, lay)) in
                outcome.neighbours.iter_mut().zip(self.sim.neighbours.iter().zip(&self.lay))
            {
                motion.raised = self.centre_of(neighbour).z - lay.z;
            }
        }
        if outcome.verdict.is_held() && outcome.raised < self.protocol.raised {
            outcome.verdict = ClutterVerdict::NotLifted { height: outcome.raised };
        }
        Ok(outcome)
    }

    /// Puts hand and scene where a trial starts; the unit approach of the hand, in its base.
    fn seat(&mut self, posture: &[f64], base_from_scene: &IsometryMatrix3<f64>) -> Result<Vector3<f64>, HandError> {
        if !is_finite(base_from_scene) {
            return Err(HandError::Object { reason: "the pose of the scene is not finite".into() });
        }
        let sim = Arc::clone(&self.sim);
        let hand = self.hand.hand();
        let frames = hand.link_frames(&hand.posture_values(posture));
        let approach = hand.approach_direction(&frames);
        self.world_from_scene = *base_from_scene;
        let poses = &sim.scene.scene_from_objects;
        self.hand.start(posture, &(base_from_scene * poses[sim.target]))?;
        self.hand.set_effort(self.protocol.effort);
        let data = &mut self.hand.data;
        data.mocap_pos_mut()[0] = base_from_scene.translation.vector.into();
        data.mocap_quat_mut()[0] = quaternion(base_from_scene);
        for Neighbour { body, address } in &sim.neighbours {
            let pose = base_from_scene * poses[*body];
            let coordinates = &mut data.qpos_mut()[*address..][..7];
            coordinates[..3].copy_from_slice(pose.translation.vector.as_slice());
            coordinates[3..].copy_from_slice(&quaternion(&pose));
        }
        data.model_opt_mut().gravity = (base_from_scene.rotation * -Vector3::z() * GRAVITY).into();
        self.prescribe([approach * -self.protocol.stand_off, Vector3::zeros()], &Vector3::zeros());
        if let Some(collider) = &mut self.collider {
            collider.forget();
        }
        let loan = SceneLoan::new(&mut self.collider);
        self.hand.look();
        drop(loan);
        self.hand.data.qacc_warmstart_mut().fill(0.0);
        self.lay = sim.neighbours.iter().map(|neighbour| self.centre_of(neighbour)).collect();
        Ok(approach)
    }

    /// The phases, until one decides.
    fn decide(&mut self, outcome: &mut ClutterOutcome, approach: &Vector3<f64>) -> Decided<()> {
        // Refuse a hand that starts too deep.
        let penetration = self.start_depth();
        if penetration > deepest_start(self.protocol.start_depth) {
            return Err(ClutterVerdict::Refused { penetration });
        }
        // Approach from the pregrasp, with the fingers at rest.
        let ClutterProtocol { stand_off, approach_time, closing, lift, lift_time, hold_time, .. } = self.protocol;
        let [wait, close] =
            [MotorCommand::Hold, MotorCommand::Close].map(|command| vec![command; self.hand.hand().driven().len()]);
        let come = Glide { from: approach * -stand_off, to: Vector3::zeros(), time: approach_time };
        self.glide(outcome, ClutterPhase::Approach, &come, &wait, |_, _| Ok(()))?;
        self.hand.begin_to_move();
        // Closing, with the hand at rest.
        let from = self.hand.base_from_object() * self.object.centre;
        let here = Glide::still(Vector3::zeros(), closing);
        for step in 0..steps_in(closing) {
            self.step(outcome, ClutterPhase::Closing, &here, step, &close)?;
            if self.hand.is_at_rest() {
                break;
            }
            if (self.hand.base_from_object() * self.object.centre - from).norm() > PUSHED_AWAY {
                return Err(self.lost(ClutterPhase::Closing));
            }
        }
        // The target must be touched by at least two links.
        let reference = self.hand.base_from_object();
        outcome.closed = Some(reference);
        outcome.touches = self.hand.touches();
        match pressing_links(&outcome.touches).len() {
            0 => return Err(ClutterVerdict::NotTouching),
            1 => return Err(ClutterVerdict::OneLink),
            _ => {}
        }
        // Lift and hold, while the target stays in the hand.
        let up = self.world_from_scene.rotation * Vector3::z() * lift;
        let phases = [
            (ClutterPhase::Lift, Glide { from: Vector3::zeros(), to: up, time: lift_time }),
            (ClutterPhase::Hold, Glide::still(up, hold_time)),
        ];
        for (phase, glide) in phases {
            self.glide(outcome, phase, &glide, &close, |worker, outcome| {
                outcome.penetration = outcome.penetration.max(deepest(&worker.hand.touches()));
                worker.keeps(&reference).then_some(()).ok_or_else(|| worker.lost(phase))
            })?;
        }
        let links = pressing_links(&self.hand.touches()).len();
        if links < 2 {
            return Err(ClutterVerdict::LetGo { links });
        }
        // Contacts of a true mesh lose their direction beneath rounded edges.
        if outcome.penetration > EDGE_RADIUS {
            let what = Unstable { step: self.hand.steps(), kind: Instability::Depth };
            return Err(ClutterVerdict::Unstable { phase: ClutterPhase::Hold, what });
        }
        Ok(())
    }

    /// A motion of the hand to its end; `look` is called after each step.
    fn glide(
        &mut self,
        outcome: &mut ClutterOutcome,
        phase: ClutterPhase,
        glide: &Glide,
        commands: &[MotorCommand],
        look: impl Fn(&Self, &mut ClutterOutcome) -> Decided<()>,
    ) -> Decided<()> {
        for step in 0..steps_in(glide.time) {
            self.step(outcome, phase, glide, step, commands)?;
            look(self, outcome)?;
        }
        Ok(())
    }

    /// Step number `step` of a motion.
    fn step(
        &mut self,
        outcome: &mut ClutterOutcome,
        phase: ClutterPhase,
        glide: &Glide,
        step: u32,
        commands: &[MotorCommand],
    ) -> Decided<()> {
        let time = f64::from(step) * STEP;
        self.prescribe(glide.at(time), &glide.acceleration(time + STEP / 2.0));
        let loan = SceneLoan::new(&mut self.collider);
        let stepped = self.hand.step(commands);
        drop(loan);
        stepped.map_err(|what| ClutterVerdict::Unstable { phase, what })?;
        // The pushed body moves by less than the motion commanded in the next step.
        self.hand.carried = glide.at(time + STEP)[0];
        self.observe(outcome, phase);
        Ok(())
    }

    /// Gives the hand's base a position and a velocity, and for the next step an acceleration, against gravity; all in its frame.
    fn prescribe(&mut self, [position, velocity]: [Vector3<f64>; 2], acceleration: &Vector3<f64>) {
        self.hand.carried = position;
        let data = &mut self.hand.data;
        let gravity = Vector3::from(data.model_opt_mut().gravity);
        for BaseSlide { axis, address, dof, mass, weight } in &self.sim.slides {
            data.qpos_mut()[*address] = position[*axis];
            data.qvel_mut()[*dof] = velocity[*axis];
            data.qfrc_applied_mut()[*dof] = mass * acceleration[*axis] - weight * gravity[*axis];
        }
    }

    /// Records the things that the hand presses on, and how far the neighbours have moved.
    fn observe(&self, outcome: &mut ClutterOutcome, phase: ClutterPhase) {
        let time = f64::from(self.hand.steps()) * STEP;
        let known = outcome.touched.len();
        for (number, contact) in self.hand.data.contact().iter().enumerate() {
            let Some(thing) = self.pressed(contact) else { continue };
            let force = self.hand.data.contact_force(number)[0];
            if force <= 0.0 {
                continue;
            }
            let body = thing.checked_sub(1);
            match outcome.touched.iter_mut().find(|touched| touched.body == body) {
                Some(touched) => touched.force = touched.force.max(force),
                None => outcome.touched.push(ClutterTouch { body, phase, time, force }),
            }
        }
        outcome.touched[known..].sort_unstable_by_key(|touched| touched.body);
        for (motion, (neighbour, lay)) in outcome.neighbours.iter_mut().zip(self.sim.neighbours.iter().zip(&self.lay)) {
            motion.moved = motion.moved.max((self.centre_of(neighbour) - lay).norm());
        }
    }

    /// Number of the thing of the scene that the hand is in contact with: 0 for the container, or one more than a body's index.
    fn pressed(&self, contact: &MjContact) -> Option<usize> {
        match self.hand.owners_of(contact) {
            [Some(GeomOwner::Link(_)), Some(GeomOwner::Scene(thing))] => Some(thing),
            [Some(GeomOwner::Scene(thing)), Some(GeomOwner::Link(_))] => Some(thing),
            _ => None,
        }
    }

    /// Depth of the hand in the obstacles that it overlaps at the start [m].
    fn start_depth(&self) -> f64 {
        let meets = |contact: &&MjContact| match self.hand.owners_of(contact) {
            [Some(GeomOwner::Link(_)), Some(other)] | [Some(other), Some(GeomOwner::Link(_))] => {
                !matches!(other, GeomOwner::Link(_))
            }
            _ => false,
        };
        self.hand.data.contact().iter().filter(meets).map(|contact| -contact.dist).fold(0.0, f64::max)
    }

    /// Whether the target is still where it was in the hand, nearly.
    fn keeps(&self, reference: &IsometryMatrix3<f64>) -> bool {
        let now = self.hand.base_from_object();
        let moved = (now * self.object.centre - reference * self.object.centre).norm();
        moved <= self.protocol.lost_distance && angle_between(reference, &now) <= self.protocol.lost_angle
    }

    fn lost(&self, phase: ClutterPhase) -> ClutterVerdict {
        ClutterVerdict::Lost { phase, time: f64::from(self.hand.steps()) * STEP }
    }

    /// The target's centre of mass in the scene [m].
    fn target_centre(&self) -> Point3<f64> {
        let centre = self.hand.base_from_object() * self.object.centre + self.hand.carried;
        self.world_from_scene.inverse_transform_point(&centre)
    }

    /// A neighbour's centre of mass in the scene [m].
    fn centre_of(&self, neighbour: &Neighbour) -> Point3<f64> {
        let [x, y, z, rotation @ ..] =
            std::array::from_fn::<f64, 7, _>(|at| self.hand.data.qpos()[neighbour.address + at]);
        let pose = isometry(&[x, y, z], &rotation);
        self.world_from_scene.inverse_transform_point(&(pose * self.sim.scene.bodies[neighbour.body].solid.centre))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use nalgebra::Rotation3;

    use super::{super::ClutterScene, *};
    use crate::{
        HandModel,
        objects::{
            container::{Container, Vessel},
            scene_body::SimBody,
        },
    };
    use kernel::{
        contact::{ContactBody, ContactSurface, Sampled},
        geom::{MassProperties, TriMesh},
        voxel::InsideTest,
    };

    const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

    /// Height of the pads above the base of the parallel gripper [m].
    const PADS: f64 = 0.106;

    /// A closed box about the origin, by its half sides, of 0.2 kg.
    fn block(half: [f32; 3]) -> SimBody {
        let corner =
            |corner: usize| std::array::from_fn(|axis| if corner >> axis & 1 == 0 { -half[axis] } else { half[axis] });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = TriMesh { vertices: (0..8).map(corner).collect(), triangles };
        let surface = Arc::new(ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface"));
        let solid = MassProperties::of_solid(&surface.solid()).expect("a solid");
        let body = Arc::new(ContactBody::new(&mesh, surface, Sampled::Everywhere));
        SimBody { body, solid, mass: 0.2, friction: 0.5 }
    }

    fn scene(bodies: Vec<(SimBody, IsometryMatrix3<f64>)>) -> ClutterScene {
        let (bodies, scene_from_objects) = bodies.into_iter().unzip();
        let container = Container::Plane { size: [1.0, 1.0] };
        ClutterScene { container, bodies, scene_from_objects, rolling: 0.002, torsion: 0.002 }
    }

    fn bin() -> Container {
        let inner = [0.4, 0.3, 0.2];
        let mesh = TriMesh::open_box(inner, 0.02);
        let surface = ContactSurface::new(&mesh, InsideTest::WindingNumber).expect("a surface");
        let body = Arc::new(ContactBody::new(&mesh, Arc::new(surface), Sampled::Edges));
        Container::Bin(Vessel::open_box(body, inner, 0.02, IsometryMatrix3::identity()))
    }

    /// The bin as a mesh of any shape.
    fn mesh_of_bin() -> Container {
        let Container::Bin(Vessel { body, inner, world_from_vessel, .. }) = bin() else { unreachable!("a bin") };
        Container::Bin(Vessel::of_mesh(&TriMesh::open_box(inner, 0.02), body, inner, world_from_vessel))
    }

    fn gripper() -> HandModel {
        HandModel::open(&Path::new(ROOT).join("scenes/parallel_gripper.xml")).expect("the gripper")
    }

    /// The parallel gripper from above, its pads about a point of the scene, turned about the vertical.
    fn above(point: [f64; 3], turned: f64) -> IsometryMatrix3<f64> {
        let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), turned) * down;
        let base = Vector3::from(point) + Vector3::z() * PADS;
        IsometryMatrix3::from_parts(base.into(), turned).inverse()
    }

    fn worker(scene: &ClutterScene, target: usize) -> ClutterWorker {
        let awake = vec![true; scene.bodies.len()];
        let sim = ClutterSim::new(&gripper(), scene, target, &awake).expect("a simulation");
        ClutterWorker::new(&Arc::new(sim), ClutterProtocol::STANDARD)
    }

    fn tried(scene: &ClutterScene, target: usize, grasp: &IsometryMatrix3<f64>) -> ClutterOutcome {
        worker(scene, target).run(&gripper().hand.opened(), grasp).expect("a posture")
    }

    fn standing(x: f64, y: f64, z: f64) -> IsometryMatrix3<f64> {
        IsometryMatrix3::translation(x, y, z)
    }

    #[test]
    fn a_lone_block_is_lifted_off_a_table_however_the_hand_is_turned() {
        let scene = scene(vec![(block([0.02, 0.02, 0.04]), standing(0.1, -0.05, 0.04))]);
        for turned in [0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI] {
            let outcome = tried(&scene, 0, &above([0.1, -0.05, 0.04], turned));
            assert_eq!(outcome.verdict, ClutterVerdict::Held, "{outcome:?}");
            // The block is lifted with the hand.
            assert!((outcome.raised - 0.1).abs() < 2e-3, "{outcome:?}");
            assert!(outcome.touched.is_empty() && outcome.neighbours.is_empty(), "{outcome:?}");
            assert!(outcome.penetration < 1e-3, "{outcome:?}");
        }
    }

    #[test]
    fn what_the_hand_does_not_touch_stays_where_it_is() {
        let block = || block([0.02, 0.02, 0.04]);
        let neighbour = || (block(), standing(0.1, 0.15, 0.04));
        let lower = (block(), standing(-0.15, 0.0, 0.04));
        let upper = (block(), standing(-0.15, 0.0, 0.12));
        let scene = scene(vec![neighbour(), (block(), standing(0.0, 0.0, 0.04)), lower, upper]);
        let outcome = tried(&scene, 1, &above([0.0, 0.0, 0.04], 0.0));
        assert_eq!(outcome.verdict, ClutterVerdict::Held, "{outcome:?}");
        assert_eq!(outcome.neighbours.iter().map(|motion| motion.body).collect::<Vec<_>>(), [0, 2, 3]);
        for motion in &outcome.neighbours {
            assert!(motion.moved < 2e-4 && motion.raised.abs() < 2e-4, "{outcome:?}");
        }
    }

    #[test]
    fn a_block_in_the_way_of_a_finger_is_touched_and_pushed() {
        let block = || block([0.02, 0.02, 0.04]);
        // The opened fingers are from 40 to 52 mm to either side: one lands on the neighbour.
        let scene = scene(vec![(block(), standing(0.0, 0.0, 0.04)), (block(), standing(0.0, 0.07, 0.04))]);
        let outcome = tried(&scene, 0, &above([0.0, 0.0, 0.04], 0.0));
        let [first, ..] = outcome.touched[..] else { panic!("{outcome:?}") };
        assert_eq!((first.body, first.phase), (Some(1), ClutterPhase::Approach), "{outcome:?}");
        assert!(first.time > 0.1 && first.time < 0.5 && first.force > 1.0, "{outcome:?}");
        // There is room next to it.
        let beside = tried(&scene, 0, &above([0.0, 0.0, 0.04], std::f64::consts::FRAC_PI_2));
        assert_eq!(beside.verdict, ClutterVerdict::Held, "{beside:?}");
        assert!(beside.touched.is_empty(), "{beside:?}");
    }

    #[test]
    fn what_lies_on_the_target_comes_up_with_it() {
        let plate = (block([0.03, 0.018, 0.005]), standing(0.0, 0.0, 0.065));
        let scene = scene(vec![(block([0.02, 0.02, 0.03]), standing(0.0, 0.0, 0.03)), plate]);
        let mut side = worker(&scene, 0);
        // From the side: the approach along y, the fingers along x.
        let forward = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[
            -Vector3::z(),
            Vector3::x(),
            -Vector3::y(),
        ]));
        let base = IsometryMatrix3::from_parts(Vector3::new(0.0, PADS, 0.03).into(), forward);
        let outcome = side.run(&gripper().hand.opened(), &base.inverse()).expect("a posture");
        assert_eq!(outcome.verdict, ClutterVerdict::Held, "{outcome:?}");
        assert_eq!(outcome.carried(0.05).collect::<Vec<_>>(), [1], "{outcome:?}");
    }

    #[test]
    fn tables_and_walls_stop_a_hand_and_are_named() {
        let low = scene(vec![(block([0.02, 0.02, 0.005]), standing(0.0, 0.0, 0.005))]);
        let outcome = tried(&low, 0, &above([0.0, 0.0, 0.005], 0.0));
        let [first, ..] = outcome.touched[..] else { panic!("{outcome:?}") };
        assert_eq!((first.body, first.phase), (None, ClutterPhase::Approach), "{outcome:?}");
        // In a corner of a bin there is no room between object and wall, whether hands touch its boxes or its mesh.
        let mut corner = scene(vec![(block([0.02, 0.02, 0.04]), standing(0.0, 0.125, 0.04))]);
        for container in [bin(), mesh_of_bin()] {
            corner.container = container;
            let across = tried(&corner, 0, &above([0.0, 0.125, 0.04], 0.0));
            assert!(
                matches!(across.verdict, ClutterVerdict::Refused { penetration } if penetration > 0.01),
                "{across:?}"
            );
            let along = tried(&corner, 0, &above([0.0, 0.125, 0.04], std::f64::consts::FRAC_PI_2));
            assert_eq!(along.verdict, ClutterVerdict::Held, "{along:?}");
            // A hand that moves down onto the rim stops there.
            let rim = tried(&corner, 0, &above([0.0, 0.16, 0.1], 0.0));
            assert!(!rim.verdict.is_held() && rim.touched.iter().any(|thing| thing.body.is_none()), "{rim:?}");
        }
    }

    #[test]
    fn the_same_trial_twice_has_equal_bits_whatever_came_before() {
        let block = || block([0.02, 0.02, 0.04]);
        let scene = scene(vec![(block(), standing(0.0, 0.0, 0.04)), (block(), standing(0.0, 0.07, 0.04))]);
        let opened = gripper().hand.opened();
        let mut one = worker(&scene, 0);
        let first = one.run(&opened, &above([0.0, 0.0, 0.04], 0.0)).expect("a posture");
        one.run(&opened, &above([0.01, 0.0, 0.04], 1.0)).expect("a posture");
        assert_eq!(one.run(&opened, &above([0.0, 0.0, 0.04], 0.0)).expect("a posture"), first);
        assert_eq!(tried(&scene, 0, &above([0.0, 0.0, 0.04], 0.0)), first);
    }

    #[test]
    fn scenes_that_fit_no_bodies_are_refused() {
        let mut wrong = scene(vec![(block([0.02; 3]), standing(0.0, 0.0, 0.02))]);
        let refusal = |scene: &ClutterScene, target, awake: &[bool]| {
            ClutterSim::new(&gripper(), scene, target, awake).expect_err("no such body").to_string()
        };
        assert!(refusal(&wrong, 1, &[true]).contains("body 1 to grasp"));
        assert!(refusal(&wrong, 0, &[]).contains("0 states of being awake"));
        wrong.scene_from_objects[0].translation.x = f64::NAN;
        assert!(refusal(&wrong, 0, &[true]).contains("the pose of body 0 is not finite"));
    }
}
