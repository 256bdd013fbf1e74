//! The run of one body: poses are drawn, rejected by ever costlier tests, and decided by the exact path.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{
    super::{
        alike::KnownGrasps,
        frame::Frame,
        pads::{Grip, Pads},
        passage::{ClosingGrasp, HandPassage, Passage, PathObstacle, Surroundings},
        points::SurfacePoints,
        solids::HandSolids,
        state::HandSearch,
    },
    draw::{Backmost, Draw, DrawnPair, Floor, Limits, NoPose},
    rejections::{Around, OpenBox, Test},
    sweep::{InnerBox, SweptBox},
};
use crate::hand::Hand;
use kernel::{
    geom::SimdLevel,
    seed::Stream,
    words::{BothWays, PointScheme},
};

/// An opened pad is so far from its point at least [m].
const MIN_GAP: f64 = 0.001;

/// Settings of the sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneSampling {
    /// Poses of a body, at most.
    pub poses: u32,
    /// Grasps that are returned, at most: free ones first. The run ends with as many free ones.
    pub grasps: u32,
    /// Largest angle between the approach and straight down [rad], at most a right angle.
    pub half_angle: f64,
    /// Coefficient of friction of the cone in which the second point of a pair lies.
    pub friction: f64,
}

/// A body of a scene, and what is around it.
#[derive(Clone, Copy)]
pub struct SceneTarget<'s> {
    /// The scene.
    pub scene: &'s Surroundings,
    /// Index of the body.
    pub target: usize,
    /// The container where it is an open box; its mesh is in `scene`, too.
    pub container: Option<&'s OpenBox>,
    /// Height below which no fingertip can be: that of the floor or of the ground [m].
    pub floor: f64,
    /// Points of the body.
    pub points: &'s SurfacePoints,
}

/// A pose that reached the test of the exact path.
#[derive(Clone, Debug, PartialEq)]
pub struct SampledGrasp {
    /// Number of the pose in drawn order, from 0.
    pub pose: u32,
    /// Scheme that drew its first point.
    pub scheme: PointScheme,
    /// The points between the pads, in `Object` [m].
    pub points: [Point3<f64>; 2],
    /// Distance between the opened pads [m].
    pub opening: f64,
    /// Distance of the fingertips past the points along the approach [m].
    pub depth: f64,
    /// The hand's base where it closes.
    pub object_from_base: IsometryMatrix3<f64>,
    /// The posture in which it comes, one value per driven joint.
    pub posture: Vec<f64>,
    /// The path on both ways.
    pub ways: BothWays<Passage>,
    /// The hand closed on the body alone, if a way is free up to there.
    pub closed: Option<ClosingGrasp>,
}

/// Poses by result. Their sum with the free grasps is `poses`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PoseCounts {
    /// Poses drawn.
    pub poses: u32,
    /// Without an opposite point within the friction cones.
    pub unopposed: u32,
    /// Wider than the hand opens.
    pub too_wide: u32,
    /// Without a roll that brings the approach within the half angle of straight down.
    pub tilted: u32,
    /// With fingertips below the floor before they are past the pair.
    pub too_low: u32,
    /// Rejected by a yes-or-no test: at the ground, the container, the body itself, a neighbour.
    pub rejected: [u32; 4],
    /// Alike to a free grasp that was found before, and not tested.
    pub alike: u32,
    /// Blocked on the exact path by the ground, the container, the body itself, a neighbour.
    pub blocked: [u32; 4],
    /// Free and unlike each other.
    pub free: u32,
}

/// A pose that a yes-or-no test rejects.
#[derive(Clone, Debug, PartialEq)]
pub struct RejectedPose {
    /// The hand's base where it would close.
    pub object_from_base: IsometryMatrix3<f64>,
    /// The posture in which it would come, one value per driven joint.
    pub posture: Vec<f64>,
    /// The obstacle.
    pub by: PathObstacle,
}

/// Result of the run of a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledGrasps {
    /// Poses that reached the exact path, in drawn order: all free ones, and of the blocked ones the first.
    pub grasps: Vec<SampledGrasp>,
    /// All poses by result.
    pub counts: PoseCounts,
    /// Whether a pose was rejected for the palm alone: the fingers pass every yes-or-no test.
    pub palm_only: bool,
}

/// Samples grasps of a gripper in scenes. Each thread needs its own.
pub struct SceneSampler {
    hand: Arc<Hand>,
    solids: HandSolids,
    pads: Pads,
    boxes: Vec<InnerBox>,
    is_finger: Vec<bool>,
    /// Whether the hand is the same after 180 degrees about its approach.
    is_symmetric: bool,
    margin: f64,
    level: SimdLevel,
    exits: Vec<(f64, Vector3<f64>)>,
    swept: Vec<SweptBox>,
}

/// A pose of the hand about a pair.
struct Pose {
    pair: DrawnPair,
    grip: Grip,
    opening: f64,
    depth: f64,
    scene_from_base: IsometryMatrix3<f64>,
    /// Whether a part other than the fingers is below the ground.
    palm_is_low: bool,
}

/// Reason why a pose is lost before the exact path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Loss {
    NoPose(NoPose),
    TooLow,
    Rejected(PathObstacle),
}

impl PoseCounts {
    fn lose(&mut self, loss: Loss) {
        let count = match loss {
            Loss::NoPose(NoPose::Unopposed) => &mut self.unopposed,
            Loss::NoPose(NoPose::TooWide) => &mut self.too_wide,
            Loss::NoPose(NoPose::Tilted) => &mut self.tilted,
            Loss::TooLow => &mut self.too_low,
            Loss::Rejected(by) => &mut self.rejected[number(by)],
        };
        *count += 1;
    }
}

/// Number of an obstacle in counts.
fn number(by: PathObstacle) -> usize {
    match by {
        PathObstacle::Ground => 0,
        PathObstacle::Container => 1,
        PathObstacle::Target => 2,
        PathObstacle::Neighbour(_) => 3,
    }
}

impl SceneSampler {
    /// A sampler of a hand that keeps a margin from everything but the body [m]; `None` for a hand without a
    /// [`Hand::closing_line`].
    pub fn new(search: &HandSearch, margin: f64, level: SimdLevel) -> Option<Self> {
        let (hand, solids) = (&search.hand, search.solids.clone());
        let pads = Pads::new(hand)?;
        Some(Self {
            is_symmetric: search.is_half_turn_symmetric(),
            boxes: InnerBox::all(&solids, |link| hand.closing_side(link), margin),
            is_finger: solids.solids.iter().map(|solid| hand.closing_side(solid.link) != 0.0).collect(),
            hand: Arc::clone(hand),
            solids,
            pads,
            margin,
            level: level.usable(),
            exits: Vec::new(),
            swept: Vec::new(),
        })
    }

    /// Widest pair that the hand takes between its pads [m].
    pub fn widest_pair(&self) -> f64 {
        self.pads.widest - 2.0 * MIN_GAP
    }

    /// Samples grasps of a body. `passage`, of the same hand and margin, decides.
    pub fn sample(
        &mut self,
        passage: &mut HandPassage,
        body: &SceneTarget<'_>,
        sampling: &SceneSampling,
        stream: &mut Stream,
    ) -> SampledGrasps {
        let around = Around::new(body.scene, body.target, body.container, self.level);
        let limits = self.limits(body, sampling);
        let (mut found, mut known) = (SampledGrasps::default(), KnownGrasps::new(self.is_symmetric));
        let mut blocked = 0;
        while !body.points.is_empty() && found.counts.poses < sampling.poses && found.counts.free < sampling.grasps {
            let (number, draw) = (found.counts.poses, Draw::next(stream));
            found.counts.poses += 1;
            let pose = self.pose(body, &draw, &limits);
            let pose = pose.and_then(|pose| self.rejected(&around, &pose, &mut found.palm_only).map_or(Ok(pose), Err));
            let pose = match pose {
                Ok(pose) => pose,
                Err(loss) => {
                    found.counts.lose(loss);
                    continue;
                }
            };
            // A grasp like a free one is known to be possible: it costs no exact path.
            let here = self.compared(body, &pose);
            if known.has(&here) {
                found.counts.alike += 1;
                continue;
            }
            let grasp = exact(passage, body, number, pose);
            match grasp.ways.shaped.blocked {
                None => {
                    found.counts.free += 1;
                    known.add(here);
                }
                Some((_, by)) => {
                    found.counts.blocked[self::number(by)] += 1;
                    blocked += 1;
                    if blocked > sampling.grasps {
                        continue;
                    }
                }
            }
            found.grasps.push(grasp);
        }
        found.truncate(sampling.grasps);
        found
    }

    /// The poses among `sampling.poses` draws that yes-or-no tests reject, for comparison with the exact path: it finds none of them
    /// free.
    pub fn rejections(
        &mut self,
        body: &SceneTarget<'_>,
        sampling: &SceneSampling,
        stream: &mut Stream,
    ) -> Vec<RejectedPose> {
        let around = Around::new(body.scene, body.target, body.container, self.level);
        let object_from_scene = body.scene.objects[body.target].scene_from_obstacle.inverse();
        let limits = self.limits(body, sampling);
        let mut found = Vec::new();
        for _ in 0..sampling.poses {
            let Ok(pose) = self.pose(body, &Draw::next(stream), &limits) else { continue };
            let object_from_base = object_from_scene * pose.scene_from_base;
            if let Some(Loss::Rejected(by)) = self.rejected(&around, &pose, &mut true) {
                found.push(RejectedPose { object_from_base, posture: pose.grip.posture, by });
            }
        }
        found
    }

    /// Limits of draws of a body.
    fn limits(&self, body: &SceneTarget<'_>, sampling: &SceneSampling) -> Limits {
        let target = &body.scene.objects[body.target];
        let bounds = target.surface.bounds();
        Limits {
            friction: sampling.friction,
            cos_half_angle: libm::cos(sampling.half_angle),
            widest_pair: self.widest_pair(),
            up: target.scene_from_obstacle.rotation.inverse() * Vector3::z(),
            far: (bounds.max - bounds.min).norm(),
        }
    }

    /// The hand of a draw, or the reason why there is none.
    fn pose(&mut self, body: &SceneTarget<'_>, draw: &Draw, limits: &Limits) -> Result<Pose, Loss> {
        let target = &body.scene.objects[body.target];
        // Two points, the opening, and the roll about the line between them.
        let point = body.points.at(draw.point).ok_or(Loss::NoPose(NoPose::TooWide))?;
        let pair = draw.pair(&target.surface, point, limits, self.level, &mut self.exits).map_err(Loss::NoPose)?;
        let opening = draw.opening(&pair, self.pads.widest);
        let value = self.pads.value(opening).ok_or(Loss::NoPose(NoPose::TooWide))?;
        let grip = self.pads.grip(&self.hand, &self.solids, value);
        let approach = self.hand.approach_direction(&grip.frames);
        let rotation = draw.rotation(&pair, &grip, &approach, limits).map_err(Loss::NoPose)?;
        // As far back as the tips allow, then forward into the room above the floor.
        let middle = target.scene_from_obstacle * pair.middle();
        let back = Backmost::new(&grip, &approach, target.scene_from_obstacle.rotation * rotation, &middle);
        let floor = Floor { tips: body.floor + self.margin, ground: body.scene.ground + self.margin };
        let [fingers, palm] = back.lowest(&self.solids, &grip.frames, &self.is_finger);
        let (tips, palm) = (back.room(fingers, floor.tips.max(floor.ground)), back.room(palm, floor.ground));
        if tips < 0.0 {
            return Err(Loss::TooLow);
        }
        let palm_is_low = palm < 0.0;
        let forward = draw.forward(if palm_is_low { tips } else { tips.min(palm) });
        let (scene_from_base, depth) = (back.at(forward), super::super::pads::TIP + forward);
        Ok(Pose { pair, grip, opening, depth, scene_from_base, palm_is_low })
    }

    /// SceneObstacle of a pose by the yes-or-no tests. Until `palm_only` is set, the fingers of a hand whose palm meets something are tested
    /// further, and it is set if they pass.
    fn rejected(&mut self, around: &Around<'_>, pose: &Pose, palm_only: &mut bool) -> Option<Loss> {
        let approach = self.hand.approach_direction(&pose.grip.frames);
        let Self { boxes, solids, swept, .. } = self;
        swept.clear();
        swept.extend(boxes.iter().map(|inner| inner.swept(solids, &pose.grip.frames, &approach)));
        let (fingers, palm) = swept.split_at(swept.iter().filter(|swept| swept.is_finger).count());
        let mut of_palm = pose.palm_is_low.then_some(PathObstacle::Ground);
        for test in Test::ALL {
            if of_palm.is_some() && *palm_only {
                break;
            }
            if let Some(by) = around.blocks(test, fingers, &pose.scene_from_base) {
                return Some(Loss::Rejected(of_palm.unwrap_or(by)));
            }
            of_palm = of_palm.or_else(|| around.blocks(test, palm, &pose.scene_from_base));
        }
        *palm_only |= of_palm.is_some();
        of_palm.map(Loss::Rejected)
    }

    /// Frame that is compared, in `Object`: origin between the pads, axes of the approach frame.
    fn compared(&self, body: &SceneTarget<'_>, pose: &Pose) -> Frame {
        let object_from_scene = body.scene.objects[body.target].scene_from_obstacle.inverse();
        let object_from_base = object_from_scene * pose.scene_from_base;
        let approach = self.hand.approach_pose(&pose.grip.frames);
        Frame {
            origin: object_from_base.transform_vector(&pose.grip.base_from_line.translation.vector)
                + object_from_base.translation.vector,
            rotation: (object_from_base.rotation * approach.isometry().rotation).into_inner(),
        }
    }
}

/// The exact path of a pose.
fn exact(passage: &mut HandPassage, body: &SceneTarget<'_>, number: u32, pose: Pose) -> SampledGrasp {
    let target = &body.scene.objects[body.target];
    let object_from_base = target.scene_from_obstacle.inverse() * pose.scene_from_base;
    let (mut closed, posture) = (None, pose.grip.posture);
    let ways = passage.follow_and_close(body.scene, body.target, &object_from_base, &posture, |passage| {
        closed.insert(passage.close(&target.surface, &object_from_base, &posture))
    });
    SampledGrasp {
        pose: number,
        scheme: pose.pair.scheme,
        points: pose.pair.points,
        opening: pose.opening,
        depth: pose.depth,
        object_from_base,
        ways,
        closed,
        posture,
    }
}

impl SampledGrasps {
    /// Keeps all free grasps, and of the blocked ones the first, up to a count in all.
    fn truncate(&mut self, count: u32) {
        let mut room = count - self.counts.free;
        self.grasps.retain(|grasp| {
            let is_free = grasp.ways.shaped.blocked.is_none();
            let stays = is_free || room > 0;
            room -= u32::from(stays && !is_free);
            stays
        });
    }
}
