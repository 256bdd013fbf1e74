//! Objects of a scene, drawn by rendezvous: each object has a number of its own for each scene, and the lowest numbers are in
//! it. One more object changes only the scenes that draw it.

use kernel::{
    ids::{Digest, ObjectId, SampleId},
    seed::Stream,
    words::Split,
};

/// Indices of the `count` objects of a scene, in the order in which they are let go.
pub(super) fn drawn(seed: u64, split: Split, scene: u32, objects: &[(usize, ObjectId)], count: usize) -> Vec<usize> {
    let number = |id: &ObjectId| {
        let [seed, scene] = [seed.to_le_bytes().to_vec(), scene.to_le_bytes().to_vec()];
        Digest::of_parts([b"scene draw 1".as_slice(), &seed, split.name().as_bytes(), &scene, &id.0.0])
    };
    let mut numbers: Vec<(Digest, usize)> = objects.iter().map(|(index, id)| (number(id), *index)).collect();
    numbers.sort_unstable();
    numbers.into_iter().take(count).map(|(_, index)| index).collect()
}

/// Bodies of a scene.
pub(super) fn body_count(seed: u64, sample: &SampleId, [min, max]: [u32; 2]) -> usize {
    let more = Stream::of_sample(seed, sample, "scene count").below(u64::from(max - min) + 1);
    (u64::from(min) + more) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn objects(count: u8) -> Vec<(usize, ObjectId)> {
        (0..count).map(|number| (usize::from(number), ObjectId(Digest::of(&[number])))).collect()
    }

    #[test]
    fn one_more_object_changes_the_scenes_that_draw_it_alone() {
        let (few, more) = (objects(40), objects(41));
        let (mut changed, scenes) = (0, 2000);
        for scene in 0..scenes {
            let [before, after] = [&few, &more].map(|objects| drawn(7, Split::Training, scene, objects, 10));
            assert_eq!(after.contains(&40), before != after, "scene {scene}");
            // The others keep their order, and one goes.
            let others: Vec<usize> = after.iter().copied().filter(|index| *index != 40).collect();
            assert_eq!(others[..], before[..others.len()], "scene {scene}");
            changed += u32::from(before != after);
        }
        // As often as 10 of 41 are drawn: within five standard deviations.
        let expected = f64::from(scenes) * 10.0 / 41.0;
        assert!((f64::from(changed) - expected).abs() < 5.0 * expected.sqrt(), "{changed} of {expected}");
    }

    #[test]
    fn scenes_and_splits_differ_and_the_job_order_of_objects_counts_for_nothing() {
        let (all, mut other) = (objects(40), objects(40));
        other.reverse();
        let draw = |split, scene, objects: &[_]| drawn(7, split, scene, objects, 10);
        assert_eq!(draw(Split::Training, 3, &all), draw(Split::Training, 3, &other));
        assert_ne!(draw(Split::Training, 3, &all), draw(Split::Training, 4, &all));
        assert_ne!(draw(Split::Training, 3, &all), draw(Split::Holdout, 3, &all));
    }
}
