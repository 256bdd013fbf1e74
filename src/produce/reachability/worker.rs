//! One thread's workshop: labels one position after the other.

use super::{LabelledPosition, PoseLabeller, Scratch};
use crate::{
    assets::Description,
    ids::{ObjectId, SampleId, ViewId},
    job::ReachabilityJob,
    produce::{Outcome, ProduceError, Producer},
    record::{Channel, ReachabilityBlock},
};

/// One thread's workshop; its memory is reused from position to position.
pub struct ReachabilityWorker<'j> {
    job: &'j ReachabilityJob,
    labeller: &'j PoseLabeller,
    loaded: bool,
    scratch: Scratch,
    labelled: LabelledPosition,
    block: ReachabilityBlock,
    payload: Vec<u8>,
}

impl<'j> ReachabilityWorker<'j> {
    /// A workshop for one thread.
    pub fn new(job: &'j ReachabilityJob, labeller: &'j PoseLabeller) -> Self {
        Self {
            job,
            labeller,
            loaded: false,
            scratch: Scratch::default(),
            labelled: LabelledPosition::default(),
            block: ReachabilityBlock {
                sample: SampleId::of_object(job.robot.id, ViewId(0)),
                joints: labeller.joints() as u32,
                labels: Vec::new(),
                proofs: Vec::new(),
                witnesses: Vec::new(),
            },
            payload: Vec::new(),
        }
    }
}

impl Producer for ReachabilityWorker<'_> {
    fn channels(&self) -> Vec<Channel> {
        vec![Channel::Block]
    }

    /// The one robot is read once for all threads; here it is checked that its files are still those of the job.
    fn load(&mut self, _subject: usize) -> Result<(), ProduceError> {
        if !self.loaded {
            let robot = &self.job.robot;
            let found = ObjectId(Description::read(&robot.scene)?.digest);
            if found != robot.id {
                let name = robot.scene.display().to_string();
                return Err(ProduceError::RobotChanged { name, found, expected: robot.id });
            }
            self.loaded = true;
        }
        Ok(())
    }

    fn produce(&mut self, view: ViewId) -> Result<(SampleId, Outcome), ProduceError> {
        let Self { job, labeller, scratch, labelled, block, payload, .. } = self;
        labeller.label(scratch, job.poses.centre(view.0 as usize).into(), labelled);
        block.sample = SampleId::of_object(job.robot.id, view);
        // The lists change places, so that both keep their memory.
        std::mem::swap(&mut block.labels, &mut labelled.labels);
        std::mem::swap(&mut block.proofs, &mut labelled.proofs);
        std::mem::swap(&mut block.witnesses, &mut labelled.witnesses);
        payload.clear();
        block.encode(payload);
        Ok((block.sample, Outcome::Kept(block.facts().into())))
    }

    fn payloads(&self) -> Vec<(Channel, &[u8])> {
        vec![(Channel::Block, self.payload.as_slice())]
    }
}
