//! Pictures of a scene with a suction cup on one of its bodies, and with all stored poses.

use std::{
    collections::BTreeMap,
    f64::consts::{FRAC_PI_4, TAU},
};

use nalgebra::{IsometryMatrix3, Point3};

use crate::{
    picture::{Colour, Picture, Solid, SolidView, seen_pixels, solid_picture},
    products::scene_shapes::{container_shape, mesh_shape},
};
use format::{
    SuctionPose, SuctionPoses, SuctionResult,
    dataset::{DatasetError, DatasetReader},
    extras::Shapes,
};
use kernel::{
    geom::{Shape, TouchShape},
    ids::ObjectId,
};

/// Elevation from which a scene is drawn, above the walls of a bin [rad].
const ELEVATION: f64 = 0.95;

/// Number of candidate views, evenly around the scene.
const AZIMUTHS: u32 = 12;

/// Side of the picture for rating a view by the visible pixels [px].
const COARSE_SIDE: u32 = 60;

/// Length of the surroundings of the body that a picture shows [m].
const EXTENT: f64 = 0.36;

/// Side of a picture over the radius of the dot of a pose.
const SIDE_OVER_DOT: f64 = 90.0;

/// Objects of a dataset, ready to be drawn.
pub(super) struct Drawn {
    shapes: Shapes,
    /// Index of each object among the shapes.
    places: BTreeMap<ObjectId, usize>,
    objects: BTreeMap<ObjectId, TouchShape>,
}

/// The pictures of a body of a scene.
pub(super) struct SuctionPictures {
    /// Cup and tube on the body, for the free pose with the largest margins. `None` if no pose is free.
    pub cup: Option<Picture>,
    /// The bodies, and a dot at each pose: green if free, vermilion if the cup leaks, else blue.
    pub poses: Picture,
}

impl Drawn {
    /// Reads the objects of a dataset.
    pub fn of(reader: &DatasetReader) -> Result<Self, DatasetError> {
        let shapes = Shapes::open(reader.folder())?;
        // The shapes have the order of the asset table.
        let places = reader.assets()?.objects.iter().enumerate().map(|(place, row)| (row.object, place)).collect();
        Ok(Self { shapes, places, objects: BTreeMap::new() })
    }

    /// Draws a sample; each picture has `side` pixels along each side.
    pub fn pictures(&mut self, poses: &SuctionPoses, side: u32) -> Result<SuctionPictures, DatasetError> {
        for (object, _) in &poses.bodies {
            self.load(*object)?;
        }
        let container = container_shape(&poses.container);
        let (mut solids, mut own): (Vec<Solid<'_>>, _) = (Vec::new(), None);
        for (number, (object, pose)) in (1..).zip(&poses.bodies) {
            let Some(shape) = self.objects.get(object) else { continue };
            let is_own = number == poses.body();
            own = if is_own { Some(solids.len()) } else { own };
            let colour = if is_own { Colour::COMPLETE } else { Colour::OTHERS };
            solids.push(Solid { shape, pose: *pose.isometry(), colour });
        }
        solids.extend(container.as_ref().map(|(shape, pose)| Solid { shape, pose: *pose, colour: Colour::TABLE }));
        let without_cup = solids.len();
        let best = best(poses);
        let parts = best.map(|pose| cup_solids(poses, pose)).unwrap_or_default();
        solids.extend(parts.iter().map(|(shape, pose)| Solid { shape, pose: *pose, colour: Colour::EXPLORED }));
        let view = view(&solids, own, without_cup, poses);
        let cup = best.map(|_| solid_picture(&solids, &view, side).with_few_colours());
        let mut dots = solid_picture(&solids[..without_cup], &view, side);
        // Free poses come last: they are few and hide nothing important.
        for (results, colour) in [
            (&[SuctionResult::Leaking][..], Colour::HELD),
            (&[SuctionResult::Weak, SuctionResult::Blocked], Colour::PARTIAL),
            (&[SuctionResult::Free], Colour::TOUCHED),
        ] {
            for pose in poses.poses.iter().filter(|pose| results.contains(&pose.result())) {
                let at = poses.world_from_object().isometry() * pose.object_from_cup.isometry();
                let pixel = view.pixel(&Point3::from(at.translation.vector), side);
                dots.dot(pixel, f64::from(side) / SIDE_OVER_DOT, colour);
            }
        }
        Ok(SuctionPictures { cup, poses: dots.with_few_colours() })
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

/// The free pose whose smaller margin, of seal and hold, is the largest; the first of equals.
fn best(poses: &SuctionPoses) -> Option<&SuctionPose> {
    let margin = |pose: &SuctionPose| pose.hold.map_or(f64::NEG_INFINITY, |hold| hold.margin.min(pose.seal_margin));
    poses.free().reduce(|best, next| if margin(next) > margin(best) { next } else { best })
}

/// Cup and tube in a pose, in the world.
fn cup_solids(poses: &SuctionPoses, pose: &SuctionPose) -> Vec<(TouchShape, IsometryMatrix3<f64>)> {
    let world_from_cup = poses.world_from_object().isometry() * pose.object_from_cup.isometry();
    let seat = pose.surface.map_or(0.0, |surface| surface.seat);
    let cup = &poses.cup;
    let cylinder = |radius: f64, front: f64, length: f64| {
        let shape = TouchShape::new(&Shape::Cylinder { radius, half: length / 2.0 }).ok()?;
        Some((shape, world_from_cup * IsometryMatrix3::translation(0.0, 0.0, seat - front - length / 2.0)))
    };
    let parts = [cylinder(cup.outer_radius, 0.0, cup.height), cylinder(cup.tube_radius, cup.height, cup.tube_length)];
    parts.into_iter().flatten().collect()
}

/// The view that shows most of a body and of the cup on it, because bodies of a scene hide each other from some sides. `own` is
/// the index of the body, if it can be drawn; the solids of the cup come last.
fn view(solids: &[Solid<'_>], own: Option<usize>, without_cup: usize, poses: &SuctionPoses) -> SolidView {
    let middle = match own {
        Some(own) => solids[own].shape.ball(&solids[own].pose).0,
        None => Point3::from(*poses.world_from_object().translation()),
    };
    let from = |step: u32| {
        let azimuth = -FRAC_PI_4 + TAU * f64::from(step) / f64::from(AZIMUTHS);
        SolidView { azimuth, elevation: ELEVATION, middle, extent: EXTENT }
    };
    let seen = |view: &SolidView| {
        let pixels = seen_pixels(solids, view, COARSE_SIDE);
        let of_cup: u32 = pixels[without_cup..].iter().sum();
        let of_body = own.map_or(0, |own| pixels[own]);
        if without_cup < solids.len() { u64::from(of_body) * u64::from(of_cup) } else { u64::from(of_body) }
    };
    // Iterating in reverse selects the first of equally good views.
    let views = (0..AZIMUTHS).rev().map(from);
    views.max_by_key(seen).unwrap_or_else(|| from(0))
}
