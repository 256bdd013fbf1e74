//! Energy of a searched state, and the reachability of a pose.

use nalgebra::{IsometryMatrix3, Point3};

use super::inputs::{HeatmapInput, PlanInputs, PlanReach, SearchEnergy};
use crate::energy::{
    ContactEnergy, EnergyForm, HandContact, HandShape, MAX_ENERGY, POTENTIAL_SCALE, combined_energy, grasp_energy,
};
use kernel::geom::{EndEffector, Pose, World};
use robot::grasp::{EnergyKind, STAND_OFF, SearchedContact, SearchedState};

/// Energy per millimetre that a contact is below the table, on the approach or where the hand closes.
const BELOW_TABLE: f64 = 10.0;

/// Memory of one thread that evaluates energies.
#[derive(Default)]
pub(super) struct Score {
    near: Vec<SearchedContact>,
    contacts: Vec<HandContact>,
}

impl Score {
    /// Energy of a state, by the settings of the plan; a hand below the table has more.
    pub(super) fn of(&mut self, inputs: &PlanInputs<'_>, state: &mut SearchedState<'_>) -> f64 {
        let energy = self.without_table(inputs, state);
        match inputs.table {
            Some(_) => {
                let hand = inputs.hand.hand();
                let frames = hand.link_frames(state.joints());
                let approach_from_base = hand.approach_pose(&frames).isometry().inverse();
                let scene_from_base = inputs.scene_from_target * state.object_from_approach() * approach_from_base;
                let room = room_above_table(inputs, &scene_from_base, &frames);
                energy + BELOW_TABLE * 1e3 * (-room).max(0.0)
            }
            None => energy,
        }
    }

    fn without_table(&mut self, inputs: &PlanInputs<'_>, state: &mut SearchedState<'_>) -> f64 {
        match inputs.settings.energy {
            SearchEnergy::Contact(energy) => self.contact(inputs, &energy, state),
            SearchEnergy::ContactAndPotential => state.energy(EnergyKind::ContactAndPotential),
            SearchEnergy::Combined { rho, contact } => {
                let contact = self.contact(inputs, &contact, state);
                let heatmap = inputs.heatmaps.map_or(MAX_ENERGY, |heatmaps| self.heatmap(inputs, &heatmaps, state));
                combined_energy(rho, heatmap, contact)
            }
            SearchEnergy::Reachability(form) => match inputs.reach {
                Some(reach) => reachability(inputs, &reach, form, state),
                None => state.energy(EnergyKind::ContactAndPotential),
            },
        }
    }

    fn contact(&mut self, inputs: &PlanInputs<'_>, energy: &ContactEnergy, state: &SearchedState<'_>) -> f64 {
        let hand = inputs.hand.hand();
        state.contacts(&mut self.near);
        self.contacts.clear();
        self.contacts.extend(self.near.iter().zip(hand.contacts()).map(|(near, contact)| HandContact {
            point: near.point,
            normal: near.normal,
            closest: near.point - near.outward.into_inner() * near.distance,
            outward: near.outward,
            is_inside: near.distance < 0.0,
            is_on_palm: contact.link == hand.approach().link,
        }));
        energy.of(&self.contacts, &camera_in_object(inputs))
    }

    /// The heatmap energy, whose contacts were placed before.
    fn heatmap(&self, inputs: &PlanInputs<'_>, heatmaps: &HeatmapInput<'_>, state: &SearchedState<'_>) -> f64 {
        let Some(camera) = inputs.camera else { return MAX_ENERGY };
        let scene_from_approach = inputs.scene_from_target * state.object_from_approach();
        let shape = HandShape::of(heatmaps.digits, state.joints(), scene_from_approach.rotation.matrix());
        let camera_from_object = camera.scene_from_camera.inverse() * inputs.scene_from_target;
        let palm = Point3::from(state.object_from_approach().translation.vector);
        let [a, b, c] = heatmaps.tips.map(|tip| self.contacts[tip].point);
        heatmaps.energy.of(&shape, &[palm, a, b, c].map(|point| camera_from_object * point)).energy
    }
}

/// The camera's position in `Object` [m]; the object's origin where there is none, which no energy reads.
pub(super) fn camera_in_object(inputs: &PlanInputs<'_>) -> Point3<f64> {
    let origin = |camera: super::inputs::PlanCamera| Point3::from(camera.scene_from_camera.translation.vector);
    inputs.camera.map_or(Point3::origin(), |camera| inputs.scene_from_target.inverse() * origin(camera))
}

/// Height of the lowest contact of the hand above the table and the margin from it, where it closes and 10 cm back [m]; infinite without
/// a table. All of the hand is as low or lower, so that a hand without room is blocked for sure.
pub(super) fn room_above_table(
    inputs: &PlanInputs<'_>,
    scene_from_base: &IsometryMatrix3<f64>,
    frames: &[IsometryMatrix3<f64>],
) -> f64 {
    let (Some(table), hand) = (inputs.table, inputs.hand.hand()) else { return f64::INFINITY };
    let back = (scene_from_base.rotation * hand.approach_direction(frames)).z * -STAND_OFF;
    let height = |contact| (scene_from_base * hand.contact_in_base(contact, frames).0).z;
    let lowest = (0..hand.contacts().len()).map(height).fold(f64::INFINITY, f64::min);
    lowest + back.min(0.0) - table - inputs.settings.margin
}

/// Algorithm 5 of a state; the potential is evaluated only where it decides.
fn reachability(
    inputs: &PlanInputs<'_>,
    reach: &PlanReach<'_>,
    form: EnergyForm,
    state: &mut SearchedState<'_>,
) -> f64 {
    let hand = inputs.hand.hand();
    let approach = hand.approach_pose(&hand.link_frames(state.joints()));
    let object_from_base = state.object_from_approach() * approach.isometry().inverse();
    let distance = field_distance(inputs, reach, &object_from_base);
    // Outside, the contact energy counts for stable states, too.
    if distance.is_nan() || distance >= 0.0 {
        return grasp_energy(form, 0.0, state.contact_energy(), distance);
    }
    let scale = if form == EnergyForm::Standard { POTENTIAL_SCALE } else { 1.0 };
    let offset = grasp_energy(form, -1.0, 0.0, distance) + scale;
    let potential = state.potential(scale, offset);
    grasp_energy(form, potential, state.contact_energy(), distance)
}

/// Distance of a hand from the border of the reachable set [cells].
pub(super) fn field_distance(
    inputs: &PlanInputs<'_>,
    reach: &PlanReach<'_>,
    object_from_base: &IsometryMatrix3<f64>,
) -> f64 {
    let map_from_site = reach.map_from_scene * inputs.scene_from_target * object_from_base * reach.base_from_site;
    (reach.distance)(&Pose::<World, EndEffector>::from_isometry(map_from_site).xyz_rpy())
}
