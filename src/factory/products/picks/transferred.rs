//! Stored grasps of a lone object, evaluated on one of its bodies in a scene.

use nalgebra::Vector3;

use super::{
    followed::recorded,
    loaded::ClosedGrasp,
    rotated::rotated_about_line,
    scene::LoadedScene,
    settings::{PickSettings, StoredGrasp},
};
use format::PickCandidate;
use kernel::seed::Stream;
use robot::{grasp::HandPassage, hand::Hand};

/// A candidate, and the hand closed in it if that was needed.
pub(super) type Evaluated<'o> = (PickCandidate, Option<&'o ClosedGrasp>);

/// Stored grasps, and the hand that is to take them.
pub(super) struct Transfer<'s> {
    pub hand: &'s Hand,
    /// Direction along which the hand closes, in its base frame, of a hand with such a line.
    pub line: Option<Vector3<f64>>,
    pub stored: &'s [StoredGrasp],
    pub settings: PickSettings,
}

impl Transfer<'_> {
    /// Evaluates some of the grasps on a body, drawn from the stream `pick candidates` of its sample.
    pub fn evaluate<'o>(
        &self,
        scene: &'o LoadedScene,
        body: usize,
        passage: &mut HandPassage,
        stream: &mut Stream,
    ) -> Vec<Evaluated<'o>> {
        let PickSettings { rolls, .. } = self.settings;
        let object = &scene.objects[body];
        let evaluate = |number: u32| {
            let (grasp, direction) = (&self.stored[(number / rolls) as usize], number % rolls);
            let base = rotated_about_line(grasp, self.line, direction, rolls);
            let mut found = None;
            let ways = passage.follow_and_close(&scene.surroundings, body, &base, &grasp.posture, |passage| {
                let close = || ClosedGrasp::new(passage, self.hand, object, &base, &grasp.posture);
                &found.insert(object.closed(number as usize, close)).grasp
            });
            (recorded(scene, body, [grasp.run, grasp.rank, direction], &base, ways, found), found)
        };
        self.draw(stream).into_iter().map(evaluate).collect()
    }

    /// Numbers of stored grasps times directions, ascending.
    fn draw(&self, stream: &mut Stream) -> Vec<u32> {
        let PickSettings { rolls, candidates, .. } = self.settings;
        let mut drawn: Vec<u32> = (0..self.stored.len() as u32 * rolls).collect();
        stream.shuffle(&mut drawn);
        drawn.truncate(candidates as usize);
        drawn.sort_unstable();
        drawn
    }
}
