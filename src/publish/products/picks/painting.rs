//! Pictures of a scene with grasps of one of its bodies: the closed hand among the bodies, and the positions of all hands.

use std::{
    collections::BTreeMap,
    f64::consts::{FRAC_PI_4, TAU},
};

use nalgebra::{Point3, Vector3};

use crate::{
    picture::{Colour, Picture, Solid, SolidView, seen_pixels, solid_picture},
    products::scene_shapes::{container_shape, mesh_shape},
    scene_samples::ScenePanel,
};
use format::{
    HandShape, LinkSolid, PickCandidate, PickCandidates, PickTrial, PickTrials,
    dataset::{DatasetError, DatasetReader, Sample},
    extras::Shapes,
};
use kernel::{
    geom::{NoSurface, TouchShape},
    ids::ObjectId,
};

/// Elevation from which a scene is drawn, above the walls of a bin [rad].
const ELEVATION: f64 = 0.95;

/// Number of candidate views, evenly around the scene.
const AZIMUTHS: u32 = 12;

/// Side of the picture for rating a view by the visible pixels [px].
const COARSE_SIDE: u32 = 60;

/// Length of the surroundings of the body that a picture shows [m].
const EXTENT: f64 = 0.42;

/// Side of a picture over the radius of the dot of a hand.
const SIDE_OVER_DOT: f64 = 90.0;

/// Hand and objects of a dataset, ready to be drawn.
pub(super) struct Drawn {
    hand: HandShape,
    /// One per solid of the hand.
    solids: Vec<TouchShape>,
    shapes: Shapes,
    /// Index of each object among the shapes.
    places: BTreeMap<ObjectId, usize>,
    objects: BTreeMap<ObjectId, TouchShape>,
}

/// The pictures of a body of a scene.
pub(super) struct PickPictures {
    /// The closed hand among the bodies, for a grasp that held, or else a free grasp. `None` if no grasp is free.
    pub held: Option<Picture>,
    /// The bodies, and a dot at the base of each hand: green if free, vermilion if blocked.
    pub ways: Picture,
}

impl Drawn {
    /// Reads hand and objects of a dataset; `None` if the hand has a shape that cannot be drawn.
    pub fn of(reader: &DatasetReader) -> Result<Option<Self>, DatasetError> {
        let shapes = Shapes::open(reader.folder())?;
        let hand = shapes.hand()?;
        let solids: Result<_, NoSurface> = hand.solids.iter().map(|solid| TouchShape::new(&solid.shape)).collect();
        // The shapes have the order of the asset table.
        let places = reader.assets()?.objects.iter().enumerate().map(|(place, row)| (row.object, place)).collect();
        Ok(solids.ok().map(|solids| Self { hand, solids, shapes, places, objects: BTreeMap::new() }))
    }

    /// Draws a sample; each picture has `side` pixels along each side.
    pub fn pictures(
        &mut self,
        candidates: &PickCandidates,
        trials: Option<&PickTrials>,
        side: u32,
    ) -> Result<PickPictures, DatasetError> {
        for (object, _) in &candidates.bodies {
            self.load(*object)?;
        }
        let container = container_shape(&candidates.container);
        let (mut solids, mut own): (Vec<Solid<'_>>, _) = (Vec::new(), None);
        for (number, (object, pose)) in (1..).zip(&candidates.bodies) {
            let Some(shape) = self.objects.get(object) else { continue };
            let is_own = number == candidates.body();
            own = if is_own { Some(solids.len()) } else { own };
            let colour = if is_own { Colour::COMPLETE } else { Colour::OTHERS };
            solids.push(Solid { shape, pose: *pose.isometry(), colour });
        }
        solids.extend(container.as_ref().map(|(shape, pose)| Solid { shape, pose: *pose, colour: Colour::TABLE }));
        let without_hand = solids.len();
        let shown =
            trials.and_then(first_held).map(|trial| trial.candidate as usize).or_else(|| candidates.free().next());
        let shown = shown.and_then(|index| candidates.candidates.get(index));
        solids.extend(shown.into_iter().flat_map(|candidate| self.closed_hand(candidate)));
        let view = view(&solids, own, without_hand, candidates);
        let held = shown.map(|_| solid_picture(&solids, &view, side).with_few_colours());
        let mut ways = solid_picture(&solids[..without_hand], &view, side);
        // Free hands come last: they are few and hide nothing important.
        for is_free in [false, true] {
            let colour = if is_free { Colour::TOUCHED } else { Colour::HELD };
            for candidate in candidates.candidates.iter().filter(|candidate| candidate.is_free() == is_free) {
                let at = Point3::from(*candidate.world_from_base.translation());
                ways.dot(view.pixel(&at, side), f64::from(side) / SIDE_OVER_DOT, colour);
            }
        }
        Ok(PickPictures { held, ways: ways.with_few_colours() })
    }

    /// The hand of a free candidate, closed.
    fn closed_hand(&self, candidate: &PickCandidate) -> Vec<Solid<'_>> {
        let frames = self.hand.link_frames(&candidate.closed);
        let base = candidate.world_from_base.isometry();
        let parts = self.hand.solids.iter().zip(&self.solids);
        let solid = |(part, shape): (&LinkSolid, _)| Solid {
            shape,
            pose: base * frames[part.link] * part.link_from_solid,
            colour: Colour::EXPLORED,
        };
        parts.map(solid).collect()
    }

    fn load(&mut self, object: ObjectId) -> Result<(), DatasetError> {
        if let (Some(place), false) = (self.places.get(&object), self.objects.contains_key(&object))
            && let Ok(shape) = mesh_shape(&self.shapes.object(*place)?.mesh)
        {
            self.objects.insert(object, shape);
        }
        Ok(())
    }
}

/// The view that shows most of a body and of the hand on it, because bodies of a scene hide each other from some sides. `own` is
/// the index of the body, if it can be drawn; the solids of the hand come last.
fn view(solids: &[Solid<'_>], own: Option<usize>, without_hand: usize, candidates: &PickCandidates) -> SolidView {
    let centre_of = |solids: &[Solid<'_>]| -> Option<Point3<f64>> {
        let sum: Vector3<f64> = solids.iter().map(|solid| solid.shape.ball(&solid.pose).0.coords).sum();
        (!solids.is_empty()).then(|| Point3::from(sum / solids.len() as f64))
    };
    let of_body = own.and_then(|own| centre_of(&solids[own..=own]));
    let of_body =
        of_body.unwrap_or_else(|| Point3::from(*candidates.bodies[candidates.sample.item.0 as usize].1.translation()));
    let middle = centre_of(&solids[without_hand..]).map_or(of_body, |hand| nalgebra::center(&of_body, &hand));
    let from = |step: u32| {
        let azimuth = -FRAC_PI_4 + TAU * f64::from(step) / f64::from(AZIMUTHS);
        SolidView { azimuth, elevation: ELEVATION, middle, extent: EXTENT }
    };
    let seen = |view: &SolidView| {
        let pixels = seen_pixels(solids, view, COARSE_SIDE);
        let of_hand: u32 = pixels[without_hand..].iter().sum();
        let of_body = own.map_or(0, |own| pixels[own]);
        if without_hand < solids.len() { u64::from(of_body) * u64::from(of_hand) } else { u64::from(of_body) }
    };
    // Iterating in reverse selects the first of equally good views.
    let views = (0..AZIMUTHS).rev().map(from);
    views.max_by_key(seen).unwrap_or_else(|| from(0))
}

/// The first trial that held.
fn first_held(trials: &PickTrials) -> Option<&PickTrial> {
    trials.trials.iter().find(|trial| trial.verdict.is_held())
}

/// Side of the picture of a body in the first picture of a set [px].
const SIDE: u32 = 480;

/// A grasp that held the body of a sample, in the first picture of a set; `None` if none held, or the hand has a shape that
/// cannot be drawn. The name is that of the body's object.
pub(super) fn pick_panel(
    reader: &DatasetReader,
    sample: &Sample,
    name: &str,
) -> Result<Option<ScenePanel>, DatasetError> {
    let (candidates, trials) = (sample.read::<PickCandidates>()?, sample.find::<PickTrials>()?);
    let held = trials.as_ref().and_then(first_held);
    let (Some(mut drawn), Some(trial)) = (Drawn::of(reader)?, held) else { return Ok(None) };
    let pictures = drawn.pictures(&candidates, trials.as_ref(), SIDE)?;
    let caption = format!(
        "A grasp of {name} that held among its neighbours in simulation: the hand (blue) lifted the body (orange) by {:.0} cm.",
        100.0 * trial.raised
    );
    Ok(pictures.held.map(|picture| ScenePanel { caption, pictures: vec![picture] }))
}
