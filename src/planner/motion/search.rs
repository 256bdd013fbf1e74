//! Search for a joint path: two trees that grow towards each other.
//!
//! RRT-Connect (J. Kuffner, S. LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000),
//! the smaller tree extended first, with a dynamic domain (L. Jaillet, A. Yershova, S. LaValle, T. Simeon, "Adaptive tuning
//! of the sampling domain for dynamic-domain RRTs", IROS 2005): a node from which extensions failed is extended towards
//! near samples only. Work is counted; no clock is read.

use super::{
    scene::{ArmScene, Checks},
    settings::{PathKey, PathSettings, PathWork},
    tree::Tree,
};
use kernel::seed::Stream;

/// A path as found: its configurations, and the goal in which it ends.
pub(super) struct Found {
    pub path: Vec<Vec<f64>>,
    pub goal: usize,
}

/// Two trees, from the start and from the goals.
struct Search<'a> {
    scene: &'a ArmScene,
    settings: &'a PathSettings,
    /// Resolution of edges [rad].
    resolution: f64,
    trees: [Tree; 2],
    dynamic_domain: bool,
}

/// End of one iteration.
enum Step {
    /// No node was added.
    Rejected,
    /// A tree has grown.
    Grown,
    /// The trees have met at these nodes of the start's tree and of the goals'.
    Met([usize; 2]),
}

/// A path of free samples from `start` to one of `goals`, all free of contact; `None` where the bounds on work are reached.
pub(super) fn search(
    scene: &ArmScene,
    start: &[f64],
    goals: &[&[f64]],
    key: &PathKey<'_>,
    (settings, resolution): (&PathSettings, f64),
    work: &mut PathWork,
    checks: &mut Checks,
) -> Option<Found> {
    let joints = scene.space().joints();
    let trees = || [Tree::new(joints, &[start]), Tree::new(joints, goals)];
    let mut search = Search { scene, settings, resolution, trees: trees(), dynamic_domain: true };
    let (most_checks, most_iterations) = (checks.count + settings.checks, work.iterations + settings.iterations);
    let (mut restarts, mut rejected) = (0, 0);
    let mut stream = key.stream(restarts);
    while work.iterations < most_iterations && checks.count < most_checks {
        work.iterations += 1;
        match search.step(&mut stream, checks) {
            Step::Met(nodes) => {
                work.nodes += search.trees.iter().map(|tree| tree.len() as u64).sum::<u64>();
                return Some(search.joined(nodes));
            }
            Step::Grown => rejected = 0,
            Step::Rejected => rejected += 1,
        }
        if rejected >= settings.rejections {
            rejected = 0;
            if search.dynamic_domain {
                search.dynamic_domain = false;
            } else {
                // A new start with other samples.
                restarts += 1;
                work.restarts += 1;
                stream = key.stream(restarts);
                (search.trees, search.dynamic_domain) = (trees(), true);
            }
        }
    }
    work.nodes += search.trees.iter().map(|tree| tree.len() as u64).sum::<u64>();
    None
}

impl Search<'_> {
    /// Extends the smaller tree towards a sample, and the other towards what was added.
    fn step(&mut self, stream: &mut Stream, checks: &mut Checks) -> Step {
        let space = self.scene.space();
        let sample = space.draw(stream);
        let grows = usize::from(self.trees[1].len() < self.trees[0].len());
        let (near, distance) = self.trees[grows].nearest(space, &sample);
        if distance <= 0.0 || self.dynamic_domain && distance > self.trees[grows].radius(near) {
            return Step::Rejected;
        }
        let tree = &self.trees[grows];
        let share = (self.settings.step / distance).min(1.0);
        let difference = space.difference(tree.node(near), &sample).into_iter().map(|value| value * share);
        let difference: Vec<f64> = difference.collect();
        let radius = tree.radius(near);
        if !self.scene.samples_free(tree.node(near), &difference, self.resolution, checks) {
            let smaller = (radius * (1.0 - self.settings.domain_change)).max(self.settings.smallest_domain);
            let radius = if radius.is_finite() { smaller } else { self.settings.domain };
            self.trees[grows].set_radius(near, radius);
            return Step::Rejected;
        }
        let added = space.along(tree.node(near), &difference, 1.0);
        if radius.is_finite() {
            self.trees[grows].set_radius(near, radius * (1.0 + self.settings.domain_change));
        }
        let node = self.trees[grows].add(&added, Some(near));
        match self.connect(1 - grows, &added, checks) {
            None => Step::Grown,
            Some(other) if grows == 0 => Step::Met([node, other]),
            Some(other) => Step::Met([other, node]),
        }
    }

    /// Extends a tree in steps towards a configuration of the other; its node there, when it arrives.
    fn connect(&mut self, tree: usize, target: &[f64], checks: &mut Checks) -> Option<usize> {
        let space = self.scene.space();
        let (mut node, distance) = self.trees[tree].nearest(space, target);
        let from = self.trees[tree].node(node).to_vec();
        let count = (distance / self.settings.step).ceil().max(1.0);
        let difference = space.difference(&from, target);
        let step: Vec<f64> = difference.iter().map(|value| value / count).collect();
        for index in 1..=count as usize {
            if !self.scene.samples_free(self.trees[tree].node(node), &step, self.resolution, checks) {
                return None;
            }
            let next = space.along(&from, &difference, index as f64 / count);
            node = self.trees[tree].add(&next, Some(node));
        }
        Some(node)
    }

    /// The path through two nodes that are the same configuration.
    fn joined(&self, [from_start, from_goal]: [usize; 2]) -> Found {
        let mut path = self.trees[0].way_to_root(from_start);
        path.reverse();
        path.extend(self.trees[1].way_to_root(from_goal).into_iter().skip(1));
        self.scene.space().unwind(&mut path);
        Found { path, goal: self.trees[1].root(from_goal) }
    }
}

/// Replaces parts of a path by straight edges of free samples, between points that are drawn along its length.
pub(super) fn shorten(
    scene: &ArmScene,
    path: &mut Vec<Vec<f64>>,
    (attempts, resolution): (u32, f64),
    stream: &mut Stream,
    checks: &mut Checks,
) {
    let space = scene.space();
    for _ in 0..attempts {
        if path.len() < 3 {
            return;
        }
        let lengths: Vec<f64> =
            path.windows(2).map(|edge| space.length(&space.difference(&edge[0], &edge[1]))).collect();
        let total: f64 = lengths.iter().sum();
        let mut points = [stream.uniform(0.0, total), stream.uniform(0.0, total)];
        points.sort_by(f64::total_cmp);
        let [(first, one), (last, two)] = points.map(|point| point_at(scene, path, &lengths, point));
        if first == last {
            continue;
        }
        let difference = space.difference(&one, &two);
        // Shorter than the part between, or not worth an edge.
        if space.length(&difference) > points[1] - points[0] - 1e-6
            || !scene.samples_free(&one, &difference, resolution, checks)
        {
            continue;
        }
        path.splice(first + 1..=last, [one, two]);
        space.unwind(path);
    }
}

/// The edge at a length along a path, and the configuration there.
fn point_at(scene: &ArmScene, path: &[Vec<f64>], lengths: &[f64], mut at: f64) -> (usize, Vec<f64>) {
    let mut edge = 0;
    while edge + 1 < lengths.len() && at > lengths[edge] {
        at -= lengths[edge];
        edge += 1;
    }
    let difference = scene.space().difference(&path[edge], &path[edge + 1]);
    let share = if lengths[edge] > 0.0 { (at / lengths[edge]).min(1.0) } else { 0.0 };
    (edge, scene.space().along(&path[edge], &difference, share))
}
