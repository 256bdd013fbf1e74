//! Poses of a suction cup on a body of a scene: drawn on its points, and decided by the seal, the load and the exact path.

use std::f64::consts::{PI, TAU};

use nalgebra::{IsometryMatrix3, Point3, Translation3, Unit, Vector3};

use super::{
    cup::SuctionCup,
    draw::{Draw, in_cone},
    hold::{Hold, HoldLimit, Load},
    seal::{Seal, SealLimit, SealMeter},
    shape::SealShape,
};
use crate::grasp::{Passage, PathObstacle, SurfacePoints, Surroundings, ToolPassage};
use kernel::{geom::SimdLevel, seed::Stream, words::PointScheme};

/// Cups whose points are nearer than this can be alike [m].
const DISTANCE: f64 = 0.02;

/// Cups whose axes differ by less than this can be alike [rad].
const ANGLE: f64 = PI / 12.0;

/// Cosine by which an approach can come nearer to straight down when it is aligned with the plane of the lip; a normal farther
/// from the half angle is not measured.
const ALIGNED: f64 = 0.25;

/// Settings of the sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuctionSampling {
    /// Poses of a body, at most.
    pub poses: u32,
    /// Free poses unlike each other at which the run ends. As many of the poses that leak, that are too weak and that are blocked
    /// are returned, too.
    pub free: u32,
    /// Largest angle between the approach and straight down [rad].
    pub half_angle: f64,
    /// Largest angle between the approach and the inward normal [rad]. Half of the poses are tilted, uniformly over the cone of
    /// this half angle; the others are normal to the plane of the lip.
    pub tilt: f64,
    /// Factor on the weight, for accelerations and leaks.
    pub safety: f64,
    /// Whether a cup must hold the body in every direction of gravity, and not only as it lies.
    pub any_direction: bool,
}

/// Errors of a robot's pose, for [`SuctionSampler::robustness`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseErrors {
    /// Poses with errors.
    pub poses: u32,
    /// Largest shift across the axis [m]: uniform over the disc.
    pub distance: f64,
    /// Largest angle of the axis [rad]: uniform over the cone.
    pub angle: f64,
}

impl Default for PoseErrors {
    /// 20 poses with errors up to 2 mm and 3 degrees.
    fn default() -> Self {
        Self { poses: 20, distance: 0.002, angle: PI / 60.0 }
    }
}

/// A body of a scene, and what is around it.
#[derive(Clone, Copy)]
pub struct SuctionTarget<'s> {
    /// The scene.
    pub scene: &'s Surroundings,
    /// Index of the body.
    pub target: usize,
    /// Points of the body, of any thickness.
    pub points: &'s SurfacePoints,
    /// Mass of the body [kg].
    pub mass: f64,
    /// Centre of mass, in `Object` [m].
    pub centre: Point3<f64>,
}

/// A pose whose path was followed.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledSuction {
    /// Number of the pose in drawn order, from 0.
    pub pose: u32,
    /// Scheme that drew its point.
    pub scheme: PointScheme,
    /// The cup: the origin is the point on the axis where it meets the surface, z the approach.
    pub object_from_cup: IsometryMatrix3<f64>,
    /// The tool when all of the lip lies on the surface: the origin is the middle of the relaxed lip, z the approach. Where a ray
    /// misses the surface, that of the cup.
    pub object_from_tool: IsometryMatrix3<f64>,
    /// Seal on the surface.
    pub seal: Seal,
    /// Hold of the body's weight; `None` where the cup leaks.
    pub hold: Option<Hold>,
    /// The straight path of cup and tube.
    pub passage: Passage,
}

/// Poses by result. Their sum with the free poses is `poses`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SuctionCounts {
    /// Poses drawn.
    pub poses: u32,
    /// With an approach farther from straight down than the half angle.
    pub tilted: u32,
    /// Leaking, by the weakest limit in the order of [`SealLimit::ALL`](super::SealLimit::ALL).
    pub leaking: [u32; 7],
    /// Too weak for the load, by the weakest strength in the order of [`HoldLimit::ALL`](super::HoldLimit::ALL).
    pub weak: [u32; 4],
    /// Alike to a free pose that was found before, and not followed.
    pub alike: u32,
    /// Blocked on the path by the ground, the container, the body itself, a neighbour.
    pub blocked: [u32; 4],
    /// Free and unlike each other.
    pub free: u32,
}

/// Result of the run of a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledSuctions {
    /// Poses within the half angle, in drawn order: all free ones, and the first of the others but those that are alike.
    pub suctions: Vec<SampledSuction>,
    /// All poses by result.
    pub counts: SuctionCounts,
}

/// Samples poses of a suction cup in scenes. Each thread needs its own.
///
/// ```
/// use std::sync::Arc;
///
/// use kernel::{contact::ContactSurface, geom::{SimdLevel, TriMesh}, seed::Stream, voxel::InsideTest};
/// use nalgebra::{IsometryMatrix3, Point3};
/// use graspmill_robot::{
///     grasp::{SceneObstacle, SurfacePoints, Surroundings},
///     suction::{CupSettings, PoseErrors, SuctionCup, SuctionSampler, SuctionSampling, SuctionTarget},
/// };
///
/// // A tray of 100 mm on the ground, 150 g.
/// let surface = Arc::new(ContactSurface::new(&TriMesh::open_box([0.1, 0.1, 0.02], 0.005), InsideTest::WindingNumber)?);
/// let tray = SceneObstacle {
///     surface: Arc::clone(&surface),
///     scene_from_obstacle: IsometryMatrix3::translation(0.0, 0.0, 0.005),
/// };
/// let scene = Surroundings { container: None, ground: 0.0, objects: vec![tray] };
/// let level = SimdLevel::detect();
/// let points = SurfacePoints::new(&surface, b"tray", f64::INFINITY, level);
/// let centre = Point3::new(0.0, 0.0, 0.005);
/// let target = SuctionTarget { scene: &scene, target: 0, points: &points, mass: 0.15, centre };
/// let sampling = SuctionSampling {
///     poses: 400,
///     free: 4,
///     half_angle: 60f64.to_radians(),
///     tilt: 10f64.to_radians(),
///     safety: 1.5,
///     any_direction: false,
/// };
/// let mut sampler = SuctionSampler::new(&SuctionCup::new(CupSettings::default())?, 0.002, level);
/// let found = sampler.sample(&target, &sampling, &mut Stream::of_job(1, b"tray", "suction"));
/// assert_eq!(found.counts.free, 4);
/// let free = found.suctions.iter().find(|suction| suction.hold.is_some() && suction.passage.blocked.is_none());
/// let pose = &free.expect("a free pose").object_from_cup;
/// let mut errors = Stream::of_job(1, b"tray", "errors of suction");
/// assert!(sampler.robustness(&target, &sampling, pose, &PoseErrors::default(), &mut errors) > 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SuctionSampler {
    meter: SealMeter,
    passage: ToolPassage,
}

/// Reason why a pose is lost whatever its path.
#[derive(Clone, Copy)]
enum Loss {
    Leaks(SealLimit),
    Weak(HoldLimit),
}

/// A pose within the half angle, before its path.
struct Pose {
    scheme: PointScheme,
    object_from_cup: IsometryMatrix3<f64>,
    seal: Seal,
    hold: Option<Hold>,
}

impl Pose {
    /// The reason why the cup does not hold the body, if it does not.
    fn loss(&self) -> Option<Loss> {
        match self.hold {
            None => Some(Loss::Leaks(self.seal.weakest)),
            Some(hold) => (!hold.holds()).then_some(Loss::Weak(hold.weakest)),
        }
    }
}

impl SuctionCounts {
    /// Counts a lost pose; the number of poses lost for reasons of its kind.
    fn lose(&mut self, loss: Loss) -> u32 {
        let (counts, index): (&mut [u32], _) = match loss {
            Loss::Leaks(limit) => (&mut self.leaking, limit as usize),
            Loss::Weak(limit) => (&mut self.weak, limit as usize),
        };
        counts[index] += 1;
        counts.iter().sum()
    }
}

impl SuctionSampler {
    /// A sampler of a cup that keeps a margin from everything but the body [m].
    ///
    /// # Panics
    /// When the margin is not at least 0 and below [`Passage::FAR`].
    pub fn new(cup: &SuctionCup, margin: f64, level: SimdLevel) -> Self {
        Self { meter: SealMeter::new(cup, level), passage: ToolPassage::new(&cup.solids(), margin) }
    }

    /// Samples poses on a body.
    pub fn sample(
        &mut self,
        body: &SuctionTarget<'_>,
        sampling: &SuctionSampling,
        stream: &mut Stream,
    ) -> SampledSuctions {
        let (mut found, mut known) = (SampledSuctions::default(), Vec::<IsometryMatrix3<f64>>::new());
        while found.counts.poses < sampling.poses && found.counts.free < sampling.free {
            let (number, draw) = (found.counts.poses, Draw::next(stream));
            let Some(drawn) = body.points.draw(draw.point) else { break };
            found.counts.poses += 1;
            let Some(pose) = self.pose(body, sampling, &draw, drawn) else {
                found.counts.tilted += 1;
                continue;
            };
            if let Some(loss) = pose.loss() {
                if found.counts.lose(loss) <= sampling.free {
                    found.suctions.push(self.followed(body, number, pose));
                }
                continue;
            }
            // A pose like a free one is known to be possible: it costs no exact path.
            if known.iter().any(|known| are_alike(known, &pose.object_from_cup)) {
                found.counts.alike += 1;
                continue;
            }
            let suction = self.followed(body, number, pose);
            match suction.passage.blocked {
                None => {
                    found.counts.free += 1;
                    known.push(suction.object_from_cup);
                }
                Some((_, by)) => {
                    found.counts.blocked[obstacle(by)] += 1;
                    if found.counts.blocked.iter().sum::<u32>() > sampling.free {
                        continue;
                    }
                }
            }
            found.suctions.push(suction);
        }
        found
    }

    /// Share of poses with errors, 0 to 1, in which the cup seals and holds. A shift along the axis changes nothing: the cup comes until
    /// its lip lies on the surface. Dex-Net 3.0 averages over errors of the pose in the same way.
    pub fn robustness(
        &mut self,
        body: &SuctionTarget<'_>,
        sampling: &SuctionSampling,
        object_from_cup: &IsometryMatrix3<f64>,
        errors: &PoseErrors,
        stream: &mut Stream,
    ) -> f64 {
        let surface = &body.scene.objects[body.target].surface;
        let mut held = 0;
        for _ in 0..errors.poses {
            let [away, side, tilt, tilt_side] = [(); 4].map(|()| stream.unit());
            let (sin, cos) = libm::sincos(TAU * side);
            let shift = Vector3::new(cos, sin, 0.0) * (errors.distance * away.sqrt());
            let approach = in_cone(&(object_from_cup.rotation * Vector3::z()), errors.angle, [tilt, tilt_side]);
            let pose = SealMeter::pose(&(object_from_cup * Point3::from(shift)), &approach);
            let seal = self.meter.measure(surface, &pose);
            let shape = seal.shape.filter(|_| seal.is_sealed());
            held += u32::from(shape.is_some_and(|shape| self.hold(body, sampling, &pose, &shape).holds()));
        }
        f64::from(held) / f64::from(errors.poses)
    }

    /// The pose of a draw; `None` beyond the half angle.
    fn pose(
        &mut self,
        body: &SuctionTarget<'_>,
        sampling: &SuctionSampling,
        draw: &Draw,
        (scheme, point, out): (PointScheme, Point3<f64>, Vector3<f64>),
    ) -> Option<Pose> {
        let target = &body.scene.objects[body.target];
        let down = target.scene_from_obstacle.rotation.inverse() * -Vector3::z();
        let cos_half_angle = libm::cos(sampling.half_angle);
        // Along the normal of the lip's plane, or tilted.
        let object_from_cup = match draw.tilted(&-out, sampling.tilt) {
            Some(approach) => SealMeter::pose(&point, &approach),
            None if -out.dot(&down) < cos_half_angle - ALIGNED => return None,
            None => self.meter.aligned(&target.surface, &SealMeter::pose(&point, &-out)),
        };
        if (object_from_cup.rotation * Vector3::z()).dot(&down) < cos_half_angle {
            return None;
        }
        let seal = self.meter.measure(&target.surface, &object_from_cup);
        let shape = seal.shape.filter(|_| seal.is_sealed());
        let hold = shape.map(|shape| self.hold(body, sampling, &object_from_cup, &shape));
        Some(Pose { scheme, object_from_cup, seal, hold })
    }

    /// Hold of the body's weight.
    fn hold(
        &self,
        body: &SuctionTarget<'_>,
        sampling: &SuctionSampling,
        object_from_cup: &IsometryMatrix3<f64>,
        shape: &SealShape,
    ) -> Hold {
        let scene_from_object = body.scene.objects[body.target].scene_from_obstacle;
        let down = (scene_from_object.rotation * object_from_cup.rotation).inverse() * -Vector3::z();
        // From the middle of the lip, where its plane meets the axis.
        let middle = Vector3::z() * (shape.seat - shape.compression);
        let load = Load {
            mass: body.mass,
            safety: sampling.safety,
            lever: object_from_cup.inverse_transform_point(&body.centre).coords - middle,
            down: (!sampling.any_direction).then(|| Unit::new_unchecked(down)),
        };
        self.meter.cup().hold(&load, shape.compression)
    }

    /// A pose with its path.
    fn followed(&mut self, body: &SuctionTarget<'_>, number: u32, pose: Pose) -> SampledSuction {
        let seat = pose.seal.shape.map_or(0.0, |shape| shape.seat);
        let object_from_tool = pose.object_from_cup * Translation3::from(Vector3::z() * seat);
        SampledSuction {
            pose: number,
            scheme: pose.scheme,
            object_from_cup: pose.object_from_cup,
            object_from_tool,
            seal: pose.seal,
            hold: pose.hold,
            passage: self.passage.follow(body.scene, body.target, &object_from_tool),
        }
    }
}

/// Whether two cups are alike: max(distance / 20 mm, angle between the axes / 15 degrees) is below 1.
fn are_alike(one: &IsometryMatrix3<f64>, other: &IsometryMatrix3<f64>) -> bool {
    let apart = one.translation.vector - other.translation.vector;
    let cos = (one.rotation * Vector3::z()).dot(&(other.rotation * Vector3::z()));
    apart.norm_squared() < DISTANCE * DISTANCE && cos > libm::cos(ANGLE)
}

/// Index of an obstacle in counts.
fn obstacle(by: PathObstacle) -> usize {
    match by {
        PathObstacle::Ground => 0,
        PathObstacle::Container => 1,
        PathObstacle::Target => 2,
        PathObstacle::Neighbour(_) => 3,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::{super::cup::CupSettings, *};
    use crate::grasp::SceneObstacle;
    use kernel::{contact::ContactSurface, geom::TriMesh, voxel::InsideTest};

    const SAMPLING: SuctionSampling =
        SuctionSampling { poses: 600, free: 40, half_angle: 1.05, tilt: 0.2, safety: 1.5, any_direction: false };

    fn obstacle(mesh: &TriMesh, at: [f64; 3]) -> SceneObstacle {
        let surface = ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface");
        SceneObstacle {
            surface: Arc::new(surface),
            scene_from_obstacle: IsometryMatrix3::translation(at[0], at[1], at[2]),
        }
    }

    /// A block on z = 0, by half its sides along x and y, and its height.
    fn block([x, y, height]: [f32; 3]) -> TriMesh {
        let corner = |k: u32| {
            let sign = |bit: u32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            [x * sign(0), y * sign(1), if k >> 2 & 1 == 1 { height } else { 0.0 }]
        };
        let faces: [[u32; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        TriMesh { vertices: (0..8).map(corner).collect(), triangles }
    }

    /// In a bin, a block of 60 x 60 x 80 mm, and a tower on the right third of it.
    fn scene() -> Surroundings {
        let bin = TriMesh::open_box([0.24, 0.24, 0.2], 0.01);
        let tower = block([0.01, 0.03, 0.1]);
        Surroundings {
            container: Some(obstacle(&bin, [0.0; 3])),
            ground: -0.01,
            objects: vec![obstacle(&block([0.03, 0.03, 0.08]), [0.0; 3]), obstacle(&tower, [0.02, 0.0, 0.0802])],
        }
    }

    fn sample(scene: &Surroundings, mass: f64, sampling: &SuctionSampling) -> SampledSuctions {
        let level = SimdLevel::detect();
        let points = SurfacePoints::new(&scene.objects[0].surface, b"block", f64::INFINITY, level);
        let centre = Point3::new(0.0, 0.0, 0.04);
        let body = SuctionTarget { scene, target: 0, points: &points, mass, centre };
        let cup = SuctionCup::new(CupSettings::default()).expect("a cup");
        SuctionSampler::new(&cup, 0.002, level).sample(&body, sampling, &mut Stream::of_job(1, b"block", "suction"))
    }

    #[test]
    fn poses_seal_hold_and_are_free_or_name_the_obstacle() {
        let scene = scene();
        let found = sample(&scene, 0.1, &SAMPLING);
        let SuctionCounts { poses, tilted, leaking, weak, alike, blocked, free } = found.counts;
        let sum = |counts: &[u32]| counts.iter().sum::<u32>();
        assert_eq!(poses, tilted + sum(&leaking) + sum(&weak) + alike + sum(&blocked) + free, "{:?}", found.counts);
        assert!(free > 1 && blocked[3] > 0 && tilted > 0 && sum(&leaking) > 0, "{:?}", found.counts);
        let mut known: Vec<IsometryMatrix3<f64>> = Vec::new();
        let mut lost = 0;
        for suction in &found.suctions {
            let approach = suction.object_from_cup.rotation * Vector3::z();
            assert!(-approach.z >= libm::cos(1.05) && suction.hold.is_some() == suction.seal.is_sealed());
            if !suction.hold.is_some_and(|hold| hold.holds()) {
                lost += 1;
                continue;
            }
            // The origin of the tool is as far along the axis as the farthest point of the lip.
            let seat = suction.seal.shape.expect("a sealed cup").seat;
            let along = suction.object_from_tool.translation.vector - suction.object_from_cup.translation.vector;
            assert!((along - approach * seat).norm() < 1e-12);
            if suction.passage.blocked.is_none() {
                assert!(suction.passage.clearance >= 0.002 - Passage::TOLERANCE);
                assert!(!known.iter().any(|known| are_alike(known, &suction.object_from_cup)));
                known.push(suction.object_from_cup);
            }
        }
        assert_eq!(known.len() as u32, free);
        assert_eq!(lost, sum(&leaking).min(SAMPLING.free) + sum(&weak).min(SAMPLING.free));
        assert_eq!(found, sample(&scene, 0.1, &SAMPLING), "the same stream gives the same poses");
    }

    #[test]
    fn heavy_bodies_are_lost_by_the_strength_that_gives_way() {
        let scene = scene();
        // A force of 18.8 N, safety 1.5.
        let heavy = sample(&scene, 3.0, &SAMPLING).counts;
        assert!(heavy.free == 0 && heavy.weak.iter().sum::<u32>() > 0, "{heavy:?}");
        let any = sample(&scene, 0.3, &SuctionSampling { any_direction: true, ..SAMPLING }).counts;
        let lying = sample(&scene, 0.3, &SAMPLING).counts;
        assert!(any.weak[HoldLimit::Tilt as usize] > lying.weak[HoldLimit::Tilt as usize], "{any:?} {lying:?}");
    }

    /// On a face of the block, a shift across the edge by 1 mm leaks: about a fifth of a disc of 2 mm is beyond half of its radius.
    #[test]
    fn poses_near_an_edge_are_less_robust() {
        let scene = scene();
        let level = SimdLevel::detect();
        let points = SurfacePoints::new(&scene.objects[0].surface, b"block", f64::INFINITY, level);
        let centre = Point3::new(0.0, 0.0, 0.04);
        let body = SuctionTarget { scene: &scene, target: 0, points: &points, mass: 0.05, centre };
        let cup = SuctionCup::new(CupSettings::default()).expect("a cup");
        let mut sampler = SuctionSampler::new(&cup, 0.002, level);
        let errors = PoseErrors { poses: 2000, angle: 0.0, ..PoseErrors::default() };
        let mut share = |x: f64| {
            let pose = SealMeter::pose(&Point3::new(x, 0.0, 0.08), &-Vector3::z());
            sampler.robustness(&body, &SAMPLING, &pose, &errors, &mut Stream::of_job(1, b"", "errors"))
        };
        assert_eq!(share(0.0), 1.0);
        // The lip's outer edge is 11 mm from the axis, the edge of the face at 30 mm: 18 mm leave 1 mm.
        let beyond = (PI / 3.0 - 3f64.sqrt() / 4.0) / PI;
        assert!((share(0.018) - (1.0 - beyond)).abs() < 0.03, "{} {beyond}", share(0.018));
        assert_eq!(share(0.025), 0.0);
    }
}
