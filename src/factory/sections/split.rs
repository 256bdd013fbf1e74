//! Rules of a split: which objects train, choose checkpoints and test.

use super::spec::{ObjectChoiceSpec, SplitSpec, SubsetSpec};
use form::{Checker, literal_pattern};

/// Rules of a split.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitSettings {
    /// Share of the items (views, runs) of each training object that is held out.
    pub holdout_items: f64,
    /// The validation objects, chosen among those that are no test objects.
    pub validation_objects: ObjectChoice,
    /// The test objects.
    pub test_objects: ObjectChoice,
    /// Split whole groups instead of objects.
    pub by_group: bool,
    /// Objects whose shapes coincide stay on one side; `false` allows twins to straddle.
    pub keep_twins_together: bool,
    /// Twins in several splits are intended, and not a leak.
    pub twins_intended: bool,
    /// Views of one object with equal rotations stay on one side; `false` (`thesis`) only counts those that straddle.
    pub keep_equal_views_together: bool,
    /// Nested subsets of the training objects, smallest first.
    pub training_subsets: Vec<SubsetSize>,
}

/// The objects that go to one side of the split.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectChoice {
    /// About this share; each object decides for itself, so that adding one moves no other.
    Share(f64),
    /// Exactly this many where groups and twins allow it; adding an object can move one other.
    Count(u32),
    /// By name.
    Named(Vec<String>),
}

/// Size of a nested training subset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SubsetSize {
    /// Count of objects.
    Count(u32),
    /// Share of the training objects.
    Share(f64),
}

impl SplitSettings {
    /// Checks the keys of `split`; names are still patterns.
    pub fn check(checker: &mut Checker, spec: &SplitSpec) -> Self {
        let choice = |models: &ObjectChoiceSpec| match models {
            ObjectChoiceSpec::Count(count) => ObjectChoice::Count(*count),
            ObjectChoiceSpec::Share(share) => ObjectChoice::Share(*share),
            ObjectChoiceSpec::Named(names) => ObjectChoice::Named(names.clone()),
        };
        let (validation, test) = (choice(&spec.validation_objects), choice(&spec.test_objects));
        if let (ObjectChoice::Share(validation), ObjectChoice::Share(test)) = (&validation, &test)
            && validation + test >= 1.0
        {
            let expected = "shares of validation and test objects that leave some to train";
            let found = format!("{validation} + {test} = {}", validation + test);
            checker.invalid("split.test_objects", expected, found);
        }
        let subset = |size: &SubsetSpec| match size {
            SubsetSpec::Count(count) => SubsetSize::Count(*count),
            SubsetSpec::Share(share) => SubsetSize::Share(*share),
        };
        let subsets: Vec<SubsetSize> = spec.training_subsets.iter().map(subset).collect();
        let grows = |pair: &[SubsetSize]| match pair {
            [SubsetSize::Count(a), SubsetSize::Count(b)] => a < b,
            [SubsetSize::Share(a), SubsetSize::Share(b)] => a < b,
            _ => true,
        };
        if !subsets.windows(2).all(grows) {
            let found = "one that is no larger than the one before";
            checker.invalid("split.training_subsets", "sizes in growing order", found);
        }
        let twins_intended = spec.twins_intended == Some(true);
        if twins_intended && spec.keep_twins_together {
            let because = "twins that stay together are on no two sides";
            checker.contradiction("split.twins_intended", "split.keep_twins_together", because);
        }
        Self {
            holdout_items: spec.holdout_items,
            validation_objects: validation,
            test_objects: test,
            by_group: spec.by_group,
            keep_twins_together: spec.keep_twins_together,
            twins_intended,
            keep_equal_views_together: spec.keep_equal_views_together,
            training_subsets: subsets,
        }
    }

    /// The rules as keys of a job file; names are written so that no letter of them is a pattern.
    pub fn spec(&self) -> SplitSpec {
        let Self {
            holdout_items,
            validation_objects,
            test_objects,
            by_group,
            keep_twins_together,
            twins_intended,
            keep_equal_views_together,
            training_subsets,
        } = self;
        let choice = |choice: &ObjectChoice| match choice {
            ObjectChoice::Share(share) => ObjectChoiceSpec::Share(*share),
            ObjectChoice::Count(count) => ObjectChoiceSpec::Count(*count),
            ObjectChoice::Named(names) => {
                ObjectChoiceSpec::Named(names.iter().map(|name| literal_pattern(name)).collect())
            }
        };
        let subset = |size: &SubsetSize| match size {
            SubsetSize::Count(count) => SubsetSpec::Count(*count),
            SubsetSize::Share(share) => SubsetSpec::Share(*share),
        };
        SplitSpec {
            holdout_items: *holdout_items,
            validation_objects: choice(validation_objects),
            test_objects: choice(test_objects),
            by_group: *by_group,
            keep_twins_together: *keep_twins_together,
            twins_intended: twins_intended.then_some(true),
            keep_equal_views_together: *keep_equal_views_together,
            training_subsets: training_subsets.iter().map(subset).collect(),
        }
    }
}
