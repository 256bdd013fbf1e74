//! Objects of a scene, drawn by rendezvous hashing: each object has a number in each scene, and the scene contains the
//! objects with the lowest numbers. One more object changes only the scenes that draw it.

use kernel::{
    ids::{Digest, ObjectId, SampleId},
    seed::Stream,
    words::Split,
};

/// Indices of the `count` objects of a scene, in the order of their release. Where objects can repeat, each has a
/// second number: a scene contains it at most twice.
pub(super) fn drawn(
    seed: u64,
    split: Split,
    scene: u32,
    objects: &[(usize, ObjectId)],
    repeats: bool,
    count: usize,
) -> Vec<usize> {
    let number = |id: &ObjectId, copy: &[u8]| {
        let [seed, scene] = [seed.to_le_bytes().to_vec(), scene.to_le_bytes().to_vec()];
        let parts = [b"scene draw 1".as_slice(), &seed, split.name().as_bytes(), &scene, &id.0.0];
        Digest::hash_parts(parts.into_iter().chain((!copy.is_empty()).then_some(copy)))
    };
    let first = objects.iter().map(|(index, id)| (number(id, b""), *index));
    let second = objects.iter().filter(|_| repeats).map(|(index, id)| (number(id, b"second"), *index));
    let mut numbers: Vec<(Digest, usize)> = first.chain(second).collect();
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
        (0..count).map(|number| (usize::from(number), ObjectId(Digest::hash(&[number])))).collect()
    }

    #[test]
    fn one_more_object_changes_the_scenes_that_draw_it_alone() {
        let (few, more) = (objects(40), objects(41));
        let (mut changed, scenes) = (0, 2000);
        for scene in 0..scenes {
            let [before, after] = [&few, &more].map(|objects| drawn(7, Split::Training, scene, objects, false, 10));
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
        let draw = |split, scene, objects: &[_]| drawn(7, split, scene, objects, false, 10);
        assert_eq!(draw(Split::Training, 3, &all), draw(Split::Training, 3, &other));
        assert_ne!(draw(Split::Training, 3, &all), draw(Split::Training, 4, &all));
        assert_ne!(draw(Split::Training, 3, &all), draw(Split::Holdout, 3, &all));
    }

    #[test]
    fn where_objects_repeat_some_stand_twice_and_none_more_often() {
        let (few, more) = (objects(10), objects(11));
        let mut twice = 0;
        for scene in 0..500 {
            let draw = |objects: &[_], repeats| drawn(7, Split::Training, scene, objects, repeats, 8);
            let [single, doubled, grown] = [draw(&few, false), draw(&few, true), draw(&more, true)];
            for (index, _) in &few {
                let count = doubled.iter().filter(|other| *other == index).count();
                assert!(count <= 2);
                twice += usize::from(count == 2);
            }
            assert!((0..10).all(|index| single.iter().filter(|other| **other == index).count() <= 1));
            assert_eq!(grown.contains(&10), grown != doubled, "scene {scene}");
        }
        // Of 20 numbers 8 are the lowest: both of an object with 8/20 times 7/19.
        let expected = 500.0 * 10.0 * 8.0 / 20.0 * 7.0 / 19.0;
        assert!((twice as f64 - expected).abs() < 5.0 * f64::sqrt(expected), "{twice} of {expected}");
        assert_eq!(drawn(7, Split::Training, 1, &few, true, 20).len(), 20);
    }
}
