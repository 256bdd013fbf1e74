//! Splits: exact for requested counts, stable when objects are added or removed, free of leaks.

use std::{collections::BTreeMap, path::Path};

use graspmill::{
    assets::{AssetRecord, MeshRefusal},
    factory::{
        job::{Job, JobObject},
        plan::{JobSplits, Plan},
    },
    ids::Digest,
    words::Split,
};

use super::{asset, completion, read, resolve};

/// A job over `shapes` built-in shapes, without reading one.
fn job(shapes: usize, overrides: &[&str]) -> Job {
    let text = format!("[[objects]]\nbuilt_in = {shapes}\n");
    resolve(read(&text, overrides).unwrap_or_else(|errors| panic!("{}", errors.render())))
}

fn split_of(job: &Job, twins: &[Vec<usize>]) -> JobSplits {
    JobSplits::new(&job.divided().expect("objects"), job.seed, twins)
}

/// The split of each object, in the job's order.
fn models(job: &Job, split: &JobSplits) -> Vec<Split> {
    let row = |object: &JobObject| split.table.object(&object.id()).expect("a row per object").split;
    job.objects().iter().map(row).collect()
}

fn models_by_name(job: &Job, twins: &[Vec<usize>]) -> BTreeMap<String, Split> {
    let models = models(job, &split_of(job, twins));
    job.objects().iter().zip(models).map(|(object, split)| (object.source.name.clone(), split)).collect()
}

/// Objects of each whole split: training, validation, test.
fn model_counts(split: &JobSplits) -> [usize; 3] {
    Split::OF_OBJECTS.map(|wanted| split.table.objects.iter().filter(|row| row.split == wanted).count())
}

/// Samples of a split, before any is rejected.
fn samples(job: &Job, split: &JobSplits, wanted: Split) -> usize {
    let views = completion(job).settings.views.len() as u32;
    split
        .table
        .objects
        .iter()
        .flat_map(|row| (0..views).map(|view| row.split_of(view)))
        .filter(|of| *of == wanted)
        .count()
}

#[test]
fn the_thesis_split_has_the_thesis_counts() {
    let job = job(608, &["profile=thesis", "split.test_objects=122", "split.training_subsets=[14, 94, 486]"]);
    let split = split_of(&job, &[]);
    assert_eq!(model_counts(&split), [486, 0, 122]);
    assert_eq!(Split::ALL.map(|of| samples(&job, &split, of)).iter().sum::<usize>(), 441_408);
    assert_eq!(samples(&job, &split, Split::Holdout), 486 * 145);
    assert_eq!(samples(&job, &split, Split::Test), 122 * 726);
    // A row names the smallest subset that holds its object: the larger ones hold it, too.
    let members = |subset: u32| split.table.objects.iter().filter(move |row| row.subset.is_some_and(|of| of <= subset));
    assert_eq!(split.table.training_subsets, [14, 94, 486]);
    assert_eq!([0, 1, 2].map(|subset| members(subset).count()), [14, 94, 486]);
    assert!(members(2).all(|row| row.split == Split::Training));
    assert_eq!(split.notes, Vec::<String>::new());

    let leaks = &split.leaks;
    assert_eq!((leaks.views, leaks.distinct_rotations, leaks.repeated_rotations), (726, 420, 306));
    assert!(leaks.straddling_views > 0 && !leaks.is_clean());
    assert_eq!(leaks.objects_straddling + leaks.geometries_straddling, 0);
}

#[test]
fn straddling_views_are_counted_as_a_plain_search_counts_them() {
    let job = job(5, &["profile=thesis", "split.test_objects=1"]);
    let split = split_of(&job, &[]);
    let views = &completion(&job).settings.views;
    let first: Vec<usize> = (0..views.len())
        .map(|view| {
            let same =
                |other: &usize| (views.rotation(*other).matrix() - views.rotation(view).matrix()).abs().max() < 1e-9;
            (0..=view).find(same).expect("a view equals itself")
        })
        .collect();
    let mut expected = 0;
    for row in &split.table.objects {
        let split_of = |view: usize| row.split_of(view as u32);
        expected += (0..views.len())
            .filter(|view| {
                let trained = |other: usize| first[other] == first[*view] && split_of(other) == Split::Training;
                split_of(*view) == Split::Holdout && (0..views.len()).any(trained)
            })
            .count() as u64;
    }
    assert_eq!(split.leaks.straddling_views, expected);
}

#[test]
fn equal_views_stay_together_unless_told_otherwise() {
    let together = job(20, &["profile=thesis", "split.keep_equal_views_together=true"]);
    let split = split_of(&together, &[]);
    let leaks = &split.leaks;
    assert_eq!((leaks.repeated_rotations, leaks.straddling_views), (306, 0));
    assert!(leaks.is_clean());
    let training = model_counts(&split)[0];
    assert_eq!(samples(&together, &split, Split::Holdout), training * 145);

    let standard = job(20, &[]);
    let split = split_of(&standard, &[]);
    assert!(split.leaks.is_clean());
}

#[test]
fn shares_move_nothing_when_objects_come_and_go() {
    let shares = ["split.test_objects=0.2", "split.validation_objects=0.15"];
    let (small, large) = (models_by_name(&job(300, &shares), &[]), models_by_name(&job(400, &shares), &[]));
    assert!(small.iter().all(|(name, role)| large[name] == *role));
    let count = |role| large.values().filter(|other| **other == role).count();
    // Within four standard deviations of 80 and 60 of 400.
    assert!((48..=112).contains(&count(Split::Test)), "{}", count(Split::Test));
    assert!((32..=88).contains(&count(Split::Validation)), "{}", count(Split::Validation));
}

#[test]
fn counts_are_exact_and_a_new_object_moves_at_most_one() {
    let counts = ["split.test_objects=30", "split.validation_objects=10"];
    let before = models_by_name(&job(300, &counts), &[]);
    assert_eq!(before.values().filter(|role| **role == Split::Test).count(), 30);
    assert_eq!(before.values().filter(|role| **role == Split::Validation).count(), 10);
    for more in [301, 302, 303] {
        let after = models_by_name(&job(more, &counts), &[]);
        let moved = before.iter().filter(|(name, role)| after[*name] != **role).count();
        assert!(moved <= 2 * (more - 300), "{moved} moved");
    }
    // Each new object can push one test model out, which can push one validation model out.
}

#[test]
fn another_seed_makes_another_split_and_the_shard_size_does_not() {
    let plain = split_of(&job(200, &[]), &[]);
    assert_ne!(plain.table, split_of(&job(200, &["seed=1"]), &[]).table);
    assert_eq!(plain, split_of(&job(200, &["shards.samples=100", "name=x"]), &[]));
}

#[test]
fn twins_never_straddle_unless_allowed() {
    let twins: Vec<Vec<usize>> = (0..30).map(|group| (0..3).map(|member| group * 3 + member).collect()).collect();
    for models in ["split.test_objects=0.3", "split.test_objects=31"] {
        let job = job(120, &[models]);
        let split = split_of(&job, &twins);
        let leaks = &split.leaks;
        assert_eq!((leaks.twin_groups, leaks.twin_groups_straddling), (30, 0));
        if models.ends_with("31") {
            assert_eq!(model_counts(&split)[2], 31);
        }
        let apart = self::job(120, &[models, "split.keep_twins_together=false"]);
        let split = split_of(&apart, &twins);
        let leaks = &split.leaks;
        assert!(leaks.twin_groups_straddling > 0 && !leaks.is_clean());
        assert_eq!((leaks.warnings().count(), leaks.intended()), (1, None));
        // A job that is about its twins: the same split and digest, the same counts, and no warning.
        let meant = self::job(120, &[models, "split.keep_twins_together=false", "split.twins_intended=true"]);
        assert_eq!(meant.digest(), apart.digest());
        let intended = split_of(&meant, &twins);
        assert_eq!(intended.table, split.table);
        assert_eq!(intended.leaks.counts(), leaks.counts());
        assert_eq!((intended.leaks.warnings().count(), intended.leaks.intended()), (0, Some("twin_groups_straddling")));
        let text = meant.to_toml(Path::new("jobs"));
        assert!(text.contains("twins_intended = true") && !apart.to_toml(Path::new("jobs")).contains("twins_intended"));
    }
    // Clusters are chosen as often as single objects are.
    let mut tested = [0; 2];
    for seed in 0..40 {
        let seed = format!("seed={seed}");
        let job = job(120, &["split.test_objects=0.3", &seed]);
        let split = split_of(&job, &twins);
        let models = models(&job, &split);
        (0..120).filter(|index| models[*index] == Split::Test).for_each(|index| tested[index / 90] += 1);
    }
    let shares = [tested[0] as f64 / (90.0 * 40.0), tested[1] as f64 / (30.0 * 40.0)];
    assert!(shares.iter().all(|share| (share - 0.3).abs() < 0.06), "{shares:?}");
}

#[test]
fn groups_move_as_one() {
    let job = job(160, &["split.by_group=true", "split.test_objects=40", "split.validation_objects=0.2"]);
    let split = split_of(&job, &[]);
    let leaks = &split.leaks;
    assert_eq!(leaks.groups_straddling, 0);
    // Sixteen families of 10 shapes: 40 are four families.
    assert_eq!(model_counts(&split)[2], 40);
    assert!(model_counts(&split).iter().all(|count| count % 10 == 0));
    let alone = self::job(160, &["split.test_objects=40"]);
    assert!(split_of(&alone, &[]).leaks.groups_straddling > 0);
}

#[test]
fn what_cannot_be_met_is_noted() {
    let job = job(32, &["split.by_group=true", "split.test_objects=3", "split.training_subsets=[500]"]);
    let split = split_of(&job, &[]);
    assert_eq!(model_counts(&split)[2], 2);
    assert_eq!(split.notes.len(), 2, "{:?}", split.notes);
}

#[test]
fn named_models_are_taken_with_their_twins() {
    let job = job(64, &["split.test_objects=['can-*', 'bowl-01']", "split.validation_objects=['bowl-02']"]);
    let names: Vec<&str> = job.objects().iter().map(|object| object.source.name.as_str()).collect();
    let index = |name: &str| names.iter().position(|known| *known == name).expect("a name of the job");
    let twins = [vec![index("bowl-01"), index("cup-03")]];
    let split = split_of(&job, &twins);
    let models = models(&job, &split);
    let tested: Vec<&str> = (0..names.len()).filter(|at| models[*at] == Split::Test).map(|at| names[at]).collect();
    assert_eq!(tested, ["bowl-01", "can-01", "can-02", "can-03", "can-04", "cup-03"]);
    assert_eq!(models[index("bowl-02")], Split::Validation);
    assert_eq!(split.notes.len(), 1);
    assert!(
        read("[[objects]]\nbuilt_in = 9\n", &["split.test_objects=['spoon-*']"])
            .map(|draft| {
                let assets = draft.sources().map(|source| Ok(asset(&source.name))).collect();
                draft.resolve(assets).is_err()
            })
            .expect("a draft")
    );
}

#[test]
fn copies_are_refused_and_meshes_that_fail_do_not_stop_the_others() {
    let draft = read("[[objects]]\nbuilt_in = 9\n", &[]).expect("a job");
    let assets = draft.sources().enumerate().map(|(index, source)| match index {
        // The second file has the first one's content, the third its geometry in another order.
        1 => Ok(asset("bottle-01")),
        2 => Ok(AssetRecord { geometry: asset("bottle-01").geometry, ..asset("x") }),
        3 => Err(MeshRefusal {
            file: source.name.clone(),
            reason: "truncated".to_owned(),
            problem: "ends early".to_owned(),
            location: None,
            remedy: "fetch it again".to_owned(),
        }),
        _ => Ok(asset(&source.name)),
    });
    let assets = assets.collect();
    let job = draft.resolve(assets).expect("six make a job");
    assert_eq!(job.work.subjects().len(), 6);
    let reasons: Vec<&str> = job.refused().iter().map(|refusal| refusal.reason.as_str()).collect();
    assert_eq!(reasons, ["duplicate", "duplicate", "truncated"]);
    assert!(job.refused()[0].problem.contains("bottle-01"));
    assert_eq!(Plan::new(&job.work.subjects(), job.shard_samples).samples, 6 * 726);
    assert!(job.objects().iter().all(|object| object.id().0 != Digest::hash(b"x")));

    let draft = read("[[objects]]\nbuilt_in = 1\n", &[]).expect("a job");
    let refusal = job.refused()[2].clone();
    let errors = draft.resolve(vec![Err(refusal)]).expect_err("nothing is left");
    assert!(errors.render().contains("1 refused"), "{}", errors.render());
}
