//! Grasps sampled on one body of a scene.

use super::{
    followed::recorded,
    loaded::ClosedGrasp,
    scene::LoadedScene,
    settings::{PickSettings, ScenePoses},
};
use format::{DrawnPick, PickCandidate, PickPoses, PickSampling};
use kernel::{geom::SimdLevel, ids::SampleId, seed::Stream};
use robot::{
    grasp::{HandPassage, HandSearch, PoseCounts, SampledGrasp, SceneSampler, SceneSampling, SceneTarget},
    hand::Hand,
};

/// One thread's sampling.
pub(super) struct Sampling {
    sampler: SceneSampler,
    poses: ScenePoses,
    settings: SceneSampling,
    level: SimdLevel,
}

/// Grasps of one body.
pub(super) struct SampledBody {
    pub candidates: Vec<PickCandidate>,
    /// The hand closed in each candidate, if that was needed.
    pub closed: Vec<Option<ClosedGrasp>>,
    pub record: PickSampling,
}

impl Sampling {
    /// Sampling for a hand that keeps a margin from everything but the body [m]; `None` for a hand without two pads that slide towards each
    /// other.
    pub fn new(search: &HandSearch, settings: &PickSettings, poses: ScenePoses, level: SimdLevel) -> Option<Self> {
        let sampler = SceneSampler::new(search, settings.margin, level)?;
        let settings = SceneSampling {
            poses: poses.poses,
            grasps: settings.candidates,
            half_angle: poses.half_angle_deg.to_radians(),
            friction: poses.cone_friction,
        };
        Some(Self { sampler, poses, settings, level })
    }

    /// Samples grasps of a body, from the stream `pick poses` of its sample.
    pub fn sample(
        &mut self,
        sample: SampleId,
        scene: &LoadedScene,
        (passage, hand): (&mut HandPassage, &Hand),
        seed: u64,
    ) -> SampledBody {
        let body = sample.item.0 as usize;
        let object = scene.record.bodies[body].object;
        let container = scene.open_box();
        let target = SceneTarget {
            scene: &scene.surroundings,
            target: body,
            container: container.as_ref(),
            floor: scene.floor(),
            points: scene.objects[body].points(object, self.sampler.widest_pair(), self.level),
        };
        let mut stream = Stream::of_sample(seed, &sample, "pick poses");
        let found = self.sampler.sample(passage, &target, &self.settings, &mut stream);
        let record = PickSampling {
            sample,
            friction: self.settings.friction,
            half_angle: self.settings.half_angle,
            budget: self.poses.poses,
            poses: counted(&found.counts),
            palm_only: found.palm_only && found.counts.free == 0,
            drawn: found.grasps.iter().map(drawn).collect(),
        };
        let (mut candidates, mut closed) = (Vec::new(), Vec::new());
        for grasp in found.grasps {
            let hand = grasp.closed.map(|closed| ClosedGrasp::from_closed(hand, closed));
            let key = [0, grasp.pose, 0];
            candidates.push(recorded(scene, body, key, &grasp.object_from_base, grasp.ways, hand.as_ref()));
            closed.push(hand);
        }
        SampledBody { candidates, closed, record }
    }
}

fn counted(counts: &PoseCounts) -> PickPoses {
    let &PoseCounts { poses, unopposed, too_wide, tilted, too_low, rejected, alike, blocked, free } = counts;
    PickPoses { poses, unopposed, too_wide, tilted, too_low, rejected, alike, blocked, free }
}

fn drawn(grasp: &SampledGrasp) -> DrawnPick {
    DrawnPick { scheme: grasp.scheme, points: grasp.points.map(Into::into), opening: grasp.opening, depth: grasp.depth }
}
