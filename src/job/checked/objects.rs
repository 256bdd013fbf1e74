//! What is divided into those that train and those that test, whatever is made of it.

use super::{CompletionJob, GraspJob, JobObject, SplitSettings};

/// The objects of a job, as their split sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct Divided<'j> {
    /// The objects, in the job's order.
    pub objects: &'j [JobObject],
    /// What is asked for.
    pub split: &'j SplitSettings,
    /// Of each view the first one that shows the same.
    pub first_equal: Vec<u32>,
}

impl Divided<'_> {
    /// Views of each object.
    pub fn views(&self) -> u32 {
        self.first_equal.len() as u32
    }
}

impl CompletionJob {
    /// Its objects, to be split.
    pub fn divided(&self) -> Divided<'_> {
        let first_equal = self.settings.views.equal_rotations();
        Divided { objects: &self.objects, split: &self.split, first_equal }
    }
}

impl GraspJob {
    /// Its objects, to be split: every seed is a view of its own.
    pub fn divided(&self) -> Divided<'_> {
        let first_equal = (0..self.settings.seeds).collect();
        Divided { objects: &self.objects, split: &self.split, first_equal }
    }
}
