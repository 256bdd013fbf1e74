//! The producer of labels for one thread: one position after the other.

use super::{
    labeller::{LabelledPosition, PoseLabeller, Scratch},
    settings::ReachabilityJob,
};
use crate::{ProduceError, SampleWriter, work::Producer};
use format::{Channel, ReachabilityBlock};
use kernel::{
    cancel::Cancel,
    description::Description,
    ids::{ItemId, ObjectId, SampleId},
};

/// The producer of one thread; its memory is reused from position to position.
pub struct ReachabilityWorker<'j> {
    job: &'j ReachabilityJob,
    labeller: &'j PoseLabeller,
    loaded: bool,
    scratch: Scratch,
    labelled: LabelledPosition,
    block: ReachabilityBlock,
}

impl<'j> ReachabilityWorker<'j> {
    /// A producer for one thread.
    pub fn new(job: &'j ReachabilityJob, labeller: &'j PoseLabeller) -> Self {
        Self {
            job,
            labeller,
            loaded: false,
            scratch: Scratch::default(),
            labelled: LabelledPosition::default(),
            block: ReachabilityBlock {
                sample: SampleId::of_object(job.robot.id, ItemId(0)),
                joints: labeller.joints() as u32,
                labels: Vec::new(),
                proofs: Vec::new(),
                witnesses: Vec::new(),
            },
        }
    }
}

impl Producer for ReachabilityWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        vec![Channel::BLOCK]
    }

    /// The one robot is read once for all threads; here it is checked that its files are still those of the job.
    fn load(&mut self, _subject: usize, _cancel: &Cancel) -> Result<(), ProduceError> {
        if !self.loaded {
            let robot = &self.job.robot;
            let description = Description::read(&robot.file).map_err(ProduceError::gone)?;
            let found = ObjectId(description.digest);
            if found != robot.id {
                let name = robot.file.display().to_string();
                return Err(ProduceError::Changed { name, found, expected: robot.id });
            }
            self.loaded = true;
        }
        Ok(())
    }

    fn produce(&mut self, item: ItemId, out: &mut SampleWriter<'_>) -> Result<(), ProduceError> {
        let Self { job, labeller, scratch, labelled, block, .. } = self;
        labeller.label(scratch, job.poses.centre(item.0 as usize).into(), labelled);
        block.sample = SampleId::of_object(job.robot.id, item);
        // The lists change places, so that both keep their memory.
        std::mem::swap(&mut block.labels, &mut labelled.labels);
        std::mem::swap(&mut block.proofs, &mut labelled.proofs);
        std::mem::swap(&mut block.witnesses, &mut labelled.witnesses);
        if let Some(payload) = out.payload(Channel::BLOCK) {
            block.encode(payload);
        }
        out.keep(block.sample, block.facts())
    }
}
