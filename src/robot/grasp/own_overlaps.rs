//! Overlaps of a hand with itself, over the postures of its eigengrasps.

use std::collections::{BTreeMap, BTreeSet};

use super::{frame::Frame, links::MAX_JOINTS, meeting::overlap, state::HandSearch};
use kernel::seed::Stream;

/// Postures that are tried: the origin of the eigengrasps, and others anywhere in the ranges of their amplitudes.
const POSTURES: u32 = 256;

/// Postures in which a hand overlaps itself by more than [`ALLOWED_OVERLAP`](super::ALLOWED_OVERLAP): a search skips
/// them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnOverlaps {
    /// Number of postures that were tried.
    pub postures: u32,
    /// Number of postures in which no two of the checked bodies overlap.
    pub clear: u32,
    /// Pairs of bodies (indices in [`Bodies::bodies`](crate::collision::Bodies::bodies), the lower first) that overlap, with the number of
    /// postures in which they do: the most frequent ones first.
    pub pairs: Vec<([usize; 2], u32)>,
}

impl HandSearch {
    /// Tries postures of the eigengrasps, always the same ones.
    pub fn own_overlaps(&self) -> OwnOverlaps {
        let ranges = self.amplitude_ranges();
        let mut stream = Stream::of_job(0, b"", "own overlaps");
        let (mut clear, mut counts) = (0, BTreeMap::<[usize; 2], u32>::new());
        for posture in 0..POSTURES {
            let amplitudes: Vec<f64> = match posture {
                0 => vec![0.0; ranges.len()],
                _ => ranges.iter().map(|[low, high]| stream.uniform(*low, *high)).collect(),
            };
            let pairs = self.overlapping(&amplitudes);
            clear += u32::from(pairs.is_empty());
            pairs.into_iter().for_each(|pair| *counts.entry(pair).or_default() += 1);
        }
        let mut pairs: Vec<_> = counts.into_iter().collect();
        pairs.sort_by_key(|(pair, count)| (std::cmp::Reverse(*count), *pair));
        OwnOverlaps { postures: POSTURES, clear, pairs }
    }

    fn amplitude_ranges(&self) -> Vec<[f64; 2]> {
        let directions = self.hand.eigengrasps().map_or(0, |grasps| grasps.directions.len());
        (0..directions).map(|direction| self.hand.amplitude_range(direction)).collect()
    }

    /// Pairs of bodies that overlap in a posture.
    fn overlapping(&self, amplitudes: &[f64]) -> BTreeSet<[usize; 2]> {
        let mut values = [0.0; MAX_JOINTS];
        let mut frames = vec![Frame::identity(); self.links.count()];
        self.links.values(amplitudes, &mut values);
        self.links.link_frames(&Frame::identity(), &values, &mut frames);
        let solids = self.solids.pairs.iter().map(|pair| pair.map(|solid| &self.solids.solids[solid]));
        let overlapping = solids.filter(|[one, other]| overlap(one, other, &frames));
        overlapping.map(|[one, other]| [one.body.min(other.body), one.body.max(other.body)]).collect()
    }
}
