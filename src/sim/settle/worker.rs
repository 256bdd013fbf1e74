//! Settling, one scene after another.

use std::collections::BTreeMap;

use nalgebra::IsometryMatrix3;

use super::{
    Placement, SettleSettings, Walls,
    model::SceneModel,
    outcome::{Fault, SettleOutcome, SettledBody},
    run::Run,
};
use crate::objects::{collider::SceneCollider, container::Container, patch::BodyPatch, scene_body::SimBody};
use kernel::geom::SimdLevel;

/// Times that bodies which the check moves may settle on, at most.
const MORE_RESTS: u32 = 3;

/// Working memory of one thread; its models are its own.
pub struct SettleWorker {
    pub(super) container: Container,
    pub(super) walls: Option<Walls>,
    pub(super) settings: SettleSettings,
    pub(super) level: SimdLevel,
    /// A model per count of bodies.
    pub(super) models: BTreeMap<usize, SceneModel>,
    /// The worker with shorter steps, for bodies that end up in one another.
    pub(super) finer: Option<Box<SettleWorker>>,
}

impl SettleWorker {
    /// A worker for scenes in one container.
    pub fn new(container: Container, settings: SettleSettings, level: SimdLevel) -> Self {
        let finer = (settings.finer > 1).then(|| {
            let timestep = settings.timestep / f64::from(settings.finer);
            Box::new(Self::new(container.clone(), SettleSettings { timestep, finer: 1, ..settings }, level))
        });
        Self { container, walls: None, settings, level, models: BTreeMap::new(), finer }
    }

    /// The worker with walls between which bodies are dropped. Once the bodies rest, or do not within the cap, the walls are
    /// lifted away, and the bodies settle again.
    #[must_use]
    pub fn with_walls(self, walls: Walls) -> Self {
        let finer = self.finer.map(|finer| Box::new(finer.with_walls(walls.clone())));
        Self { walls: Some(walls), finer, ..self }
    }

    /// Settles bodies from their placements, in the order of their release; earlier scenes leave no trace. `min`:
    /// number of bodies that must stay in the container.
    ///
    /// Thin walls can pass one another between two steps. Bodies that end up in one another settle once more from the
    /// same placements, in shorter steps, and then on in those of the settings, in which contacts give way more; the
    /// check from the stored poses always has the steps of the settings. Bodies at rest by every rule of speed may
    /// still fall: where the check moves one, they settle on from its result.
    ///
    /// # Panics
    /// When there are not as many placements as bodies, or there is no body.
    pub fn settle(&mut self, bodies: &[SimBody], placements: &[Placement], min: usize) -> SettleOutcome {
        assert_eq!(bodies.len(), placements.len(), "one placement per body");
        let mut scene = SettleOutcome::default();
        let rested = self.rest(bodies, placements, min, &mut scene);
        self.conclude(rested, bodies, min, &mut scene);
        if let (Some(Fault::Crossed { .. } | Fault::TooDeep { .. }), Some(finer)) = (&scene.fault, &mut self.finer) {
            scene = SettleOutcome::default();
            let rested = finer.rest(bodies, placements, min, &mut scene);
            let rested = rested.and_then(|()| self.settle_on(bodies, min, &mut scene, 0.0));
            self.conclude(rested, bodies, min, &mut scene);
        }
        scene
    }

    /// Checks bodies at rest, and lets them settle on while the check moves one of them.
    fn conclude(&mut self, rested: Result<(), Fault>, bodies: &[SimBody], min: usize, scene: &mut SettleOutcome) {
        let mut checked = rested.and_then(|()| self.check(bodies, scene));
        for _ in 0..MORE_RESTS {
            if !matches!(checked, Err(Fault::Moved { .. })) {
                break;
            }
            let recheck = self.settings.recheck;
            checked = self.settle_on(bodies, min, scene, recheck).and_then(|()| self.check(bodies, scene));
        }
        scene.fault = checked.err();
    }

    /// Steps the bodies of a scene from its poses for a time [s], and on until they rest.
    fn settle_on(&mut self, bodies: &[SimBody], min: usize, scene: &mut SettleOutcome, time: f64) -> Result<(), Fault> {
        let stood = std::mem::take(&mut scene.bodies);
        let (rest_time, steps) = (scene.rest_time, scene.steps);
        let poses: Vec<IsometryMatrix3<f64>> = stood.iter().map(|body| body.world_from_object).collect();
        let standing: Vec<SimBody> = stood.iter().map(|body| bodies[body.index].clone()).collect();
        let mut run = self.run(&standing);
        run.seat(&poses);
        run.step_for(time)?;
        let speed = run.wait(standing.len(), scene)?;
        (scene.rest_time, scene.steps) = (rest_time + time + scene.rest_time, steps + scene.steps);
        if let Some(speed) = speed {
            return Err(Fault::NeverRested { speed });
        }
        let [kept, gone] = run.kept_and_gone(standing.len());
        let settled = |at: &usize| SettledBody::at(stood[*at].index, run.pose(*at), stood[*at].released_at);
        scene.depths = [0.0; 2];
        scene.keep(kept.iter().map(settled).collect(), gone.into_iter().map(|at| stood[at].index), min)
    }

    pub(super) fn run<'w>(&'w mut self, bodies: &'w [SimBody]) -> Run<'w> {
        let Self { container, settings, models, .. } = self;
        let model = models.entry(bodies.len()).or_insert_with(|| SceneModel::new(container, settings, bodies.len()));
        let patches: Vec<BodyPatch> = bodies.iter().map(|body| BodyPatch::new(body, settings.rolling)).collect();
        model.set_bodies(&patches);
        model.data.reset();
        let surfaces = bodies.iter().map(|body| std::sync::Arc::clone(&body.body)).collect();
        let collider = Some(SceneCollider::new(0, container.clone(), surfaces));
        let present = vec![true; bodies.len()];
        Run { model, collider, bodies, container, settings, present, walls: None, steps: 0 }
    }

    /// Lets the bodies fall until they rest; the scene then has those that stay.
    fn rest(
        &mut self,
        bodies: &[SimBody],
        placements: &[Placement],
        min: usize,
        scene: &mut SettleOutcome,
    ) -> Result<(), Fault> {
        // Walls are the last of the bodies.
        let walls = self.walls.clone();
        let all: Vec<SimBody> = bodies.iter().chain(walls.as_ref().map(|walls| &walls.body)).cloned().collect();
        let mut run = self.run(&all);
        run.walls = walls.as_ref().map(|walls| walls.standing(bodies.len()));
        let mut released = run.fall(placements)?;
        let mut speed = run.wait(bodies.len(), scene)?;
        if let Some(walls) = &walls {
            run.lift_walls(walls.lift_speed, bodies.len())?;
            speed = run.wait(bodies.len(), scene)?;
        }
        // Bodies that left the container are not part of the scene.
        let [mut kept, mut gone] = run.kept_and_gone(bodies.len());
        for time in 0..run.settings.put_back {
            let is_over = speed.is_some() || kept.len() >= min.max(1);
            if is_over || !run.put_back(&gone, placements, 0.5_f64.powi(time as i32 + 1), &mut released)? {
                break;
            }
            speed = run.wait(bodies.len(), scene)?;
            [kept, gone] = run.kept_and_gone(bodies.len());
        }
        if let Some(speed) = speed {
            return Err(Fault::NeverRested { speed });
        }
        let settled = |index: &usize| SettledBody::at(*index, run.pose(*index), released[*index]);
        scene.keep(kept.iter().map(settled).collect(), gone, min)
    }
}
