//! Pictures of grasps: an object and the closed hand, with a grasp that held and one that failed, or without trials the best and
//! the worst kept grasp.

use std::{collections::BTreeMap, f64::consts::FRAC_PI_2, sync::Arc};

use nalgebra::{IsometryMatrix3, Point3, Vector3};
use serde::Serialize;

use super::inspection::{GraspIndex, GraspObjectFacts, GraspSurvey, resting_poses};
use crate::{
    page::{ImageView, StripCard},
    picture::{Colour, Picture, Solid, SolidView, solid_picture},
};
use format::{
    Grasp, GraspRun, HandShape,
    dataset::{AssetRow, DatasetError, DatasetReader},
    extras::Shapes,
};
use kernel::{
    geom::{NoSurface, RestingPose, Shape, TouchShape, TriMesh, Triangles},
    ids::ObjectId,
};

/// Objects that a page shows.
const SHOWN: usize = 16;
/// Side of a picture [px].
const SIDE: u32 = 200;
/// Side of a picture over the radius of the dot at a contact.
const SIDE_OVER_DOT: f64 = 56.0;
/// Elevation from which a grasp is drawn [rad].
const ELEVATION: f64 = 0.35;
/// Thickness of a drawn table [m], and its half side over the radius of the object on it.
const TABLE_THICKNESS: f64 = 0.002;
const TABLE_OVER_OBJECT: f64 = 1.5;

/// The card of an object: pictures of its grasps.
#[derive(Serialize)]
pub(crate) struct CardView {
    pub object: String,
    kept: u64,
    found: u64,
    runs: u64,
    /// Number of tried grasps, and of those that held.
    trials: [u64; 2],
    panels: Vec<PanelView>,
}

/// One picture of a grasp.
#[derive(Serialize)]
struct PanelView {
    image: ImageView,
    /// Reason why the grasp is shown.
    why: &'static str,
    epsilon: String,
    energy: String,
    contacts: usize,
    seed: String,
}

/// An object to draw, and its pose on a table.
struct DrawnObject {
    solid: TouchShape,
    resting: Vec<RestingPose>,
}

impl DrawnObject {
    /// The object of a row of the asset table; `None` if its mesh has no surface.
    fn of(reader: &DatasetReader, row: &AssetRow, mesh: &TriMesh) -> Result<Option<Self>, DatasetError> {
        let Ok(solid) = solid_of(mesh) else { return Ok(None) };
        Ok(Some(Self { solid, resting: resting_poses(reader, row)? }))
    }

    /// The object's most likely resting pose in which the hand stays above the table, as in trials.
    fn on_table(&self, grasp: &Grasp) -> Option<&RestingPose> {
        self.resting.get(grasp.likeliest_table()?)
    }
}

/// A hand to draw.
struct DrawnHand {
    shape: HandShape,
    /// One per solid of the shape.
    solids: Vec<TouchShape>,
}

impl DrawnHand {
    /// Reads the hand of a dataset; `None` if it has a shape that cannot be drawn.
    fn of(shapes: &Shapes) -> Result<Option<Self>, DatasetError> {
        let shape = shapes.hand()?;
        let solids: Result<_, NoSurface> = shape.solids.iter().map(|solid| TouchShape::new(&solid.shape)).collect();
        Ok(solids.ok().map(|solids| Self { shape, solids }))
    }
}

/// Objects with a state, at even steps through their names, at most `max` of them, with their indices in the shapes.
fn shown<'a>(
    reader: &DatasetReader,
    survey: &'a GraspSurvey,
    max: usize,
) -> Result<Vec<(&'a GraspObjectFacts, usize)>, DatasetError> {
    // The shapes have the order of the asset table.
    let index_of: BTreeMap<ObjectId, usize> =
        reader.assets()?.objects.iter().enumerate().map(|(index, row)| (row.object, index)).collect();
    let grasped: Vec<&GraspObjectFacts> =
        survey.facts.objects.iter().filter(|object| !picks(survey, object).is_empty()).collect();
    let count = grasped.len().min(max);
    let even = (0..count).map(|step| grasped[step * grasped.len() / count]);
    Ok(even.filter_map(|object| Some((object, *index_of.get(&object.object)?))).collect())
}

fn picks<'a>(survey: &'a GraspSurvey, object: &GraspObjectFacts) -> &'a [(&'static str, GraspIndex)] {
    survey.picks.get(&object.object).map(Vec::as_slice).unwrap_or_default()
}

/// The cards of objects at even steps through their names; `None` if the hand has a shape that cannot be drawn.
pub(crate) fn cards(reader: &DatasetReader, survey: &GraspSurvey) -> Result<Option<Vec<CardView>>, DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let Some(hand) = DrawnHand::of(&shapes)? else { return Ok(None) };
    let mut cards = Vec::new();
    let rows = reader.assets()?.objects;
    for (object, index) in shown(reader, survey, SHOWN)? {
        let drawn = DrawnObject::of(reader, &rows[index], &shapes.object(index)?.mesh)?;
        cards.push(card(reader, object, drawn.as_ref(), &hand, picks(survey, object))?);
    }
    Ok(Some(cards))
}

/// The first grasp that a page shows of each of at most `max` objects, from two sides, each `side` pixels wide and high, with the
/// object's name; empty if the hand has a shape that cannot be drawn.
pub(crate) fn pictures(
    reader: &DatasetReader,
    survey: &GraspSurvey,
    max: usize,
    side: u32,
) -> Result<Vec<(String, Picture)>, DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let Some(hand) = DrawnHand::of(&shapes)? else { return Ok(Vec::new()) };
    let (mut pictures, rows) = (Vec::new(), reader.assets()?.objects);
    for (object, index) in shown(reader, survey, max)? {
        let drawn = DrawnObject::of(reader, &rows[index], &shapes.object(index)?.mesh)?;
        let (Some(grasp), Some(drawn)) = (first_grasp(reader, picks(survey, object))?, drawn) else { continue };
        let panels = [FRAC_PI_2, 0.0].map(|aside| draw(&grasp, &drawn, &hand, aside, side));
        pictures.push((object.name.clone(), Picture::row(&panels, side / 20).with_few_colours()));
    }
    Ok(pictures)
}

/// The first grasp that a page shows of an object, from one side; `None` if nothing was found, or the hand has a shape that
/// cannot be drawn.
pub(crate) fn best_grasp(
    reader: &DatasetReader,
    survey: &GraspSurvey,
    object: ObjectId,
    side: u32,
) -> Result<Option<Picture>, DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let rows = reader.assets()?.objects;
    let index = rows.iter().position(|row| row.object == object);
    let picks = survey.picks.get(&object).map(Vec::as_slice).unwrap_or_default();
    let (Some(hand), Some(index), Some(grasp)) = (DrawnHand::of(&shapes)?, index, first_grasp(reader, picks)?) else {
        return Ok(None);
    };
    let drawn = DrawnObject::of(reader, &rows[index], &shapes.object(index)?.mesh)?;
    Ok(drawn.map(|drawn| draw(&grasp, &drawn, &hand, FRAC_PI_2, side)))
}

/// The first of the picked grasps.
fn first_grasp(reader: &DatasetReader, picks: &[(&'static str, GraspIndex)]) -> Result<Option<Grasp>, DatasetError> {
    let Some((_, pick)) = picks.first() else { return Ok(None) };
    let Some(sample) = reader.sample(pick.run)? else { return Ok(None) };
    Ok(sample.read::<GraspRun>()?.grasps.get(pick.grasp).cloned())
}

fn solid_of(mesh: &TriMesh) -> Result<TouchShape, NoSurface> {
    let triangles = Triangles {
        corners: mesh.vertices.iter().map(|corner| Point3::from(corner.map(f64::from))).collect(),
        triangles: mesh.triangles.clone(),
    };
    TouchShape::new(&Shape::Mesh(Arc::new(triangles)))
}

fn card(
    reader: &DatasetReader,
    object: &GraspObjectFacts,
    drawn: Option<&DrawnObject>,
    hand: &DrawnHand,
    picks: &[(&'static str, GraspIndex)],
) -> Result<CardView, DatasetError> {
    let mut panels = Vec::new();
    for (why, found) in picks {
        let Some(sample) = reader.sample(found.run)? else { continue };
        let run = sample.read::<GraspRun>()?;
        let (Some(grasp), Some(drawn)) = (run.grasps.get(found.grasp), drawn) else { continue };
        for aside in [FRAC_PI_2, 0.0] {
            let picture = draw(grasp, drawn, hand, aside, SIDE).with_few_colours();
            panels.push(PanelView::of(&run, grasp, why, &picture));
        }
    }
    Ok(CardView {
        object: object.name.clone(),
        kept: object.verdicts[0],
        found: object.found(),
        runs: object.runs,
        trials: object.trials,
        panels,
    })
}

impl CardView {
    /// The card in the strip at the top of the page.
    pub fn for_strip(&self) -> StripCard {
        let pictures = self.panels.iter().map(|panel| panel.image.clone());
        StripCard { caption: self.object.clone(), pictures: pictures.collect() }
    }
}

impl PanelView {
    fn of(run: &GraspRun, grasp: &Grasp, why: &'static str, picture: &Picture) -> Self {
        Self {
            image: ImageView::of(picture, SIDE, SIDE),
            why,
            epsilon: format!("{:.3}", grasp.epsilon(&run.method)),
            energy: format!("{:.2}", grasp.energy),
            contacts: grasp.contacts.len(),
            seed: run.sample.item.to_string(),
        }
    }
}

/// Draws object and hand, viewed `aside` away from the approach's azimuth [rad], with a dot at each contact on top, because
/// contacts are hidden between hand and object. The object is on its table if the hand stays above it.
fn draw(grasp: &Grasp, object: &DrawnObject, hand: &DrawnHand, aside: f64, side: u32) -> Picture {
    let on_table = object.on_table(grasp);
    let world_from_object =
        on_table.map_or_else(IsometryMatrix3::identity, |resting| *resting.world_from_object.isometry());
    let frames = hand.shape.link_frames(&grasp.joints);
    let parts = hand.shape.solids.iter().zip(&hand.solids);
    let mut solids: Vec<Solid<'_>> = parts
        .map(|(part, shape)| Solid {
            shape,
            pose: world_from_object * grasp.object_from_base.isometry() * frames[part.link] * part.link_from_solid,
            colour: Colour::EXPLORED,
        })
        .collect();
    solids.push(Solid { shape: &object.solid, pose: world_from_object, colour: Colour::COMPLETE });
    let approach = world_from_object.rotation * grasp.object_from_approach.rotation() * Vector3::z();
    let view = view(&solids, &approach, aside);
    // The table comes last, because the view is fitted to hand and object.
    let table = on_table.and_then(|_| table_under(&object.solid, &world_from_object));
    if let Some((shape, pose)) = &table {
        solids.push(Solid { shape, pose: *pose, colour: Colour::TABLE });
    }
    let mut picture = solid_picture(&solids, &view, side);
    for contact in &grasp.contacts {
        let pixel = view.pixel(&(world_from_object * Point3::from(contact.point)), side);
        picture.dot(pixel, f64::from(side) / SIDE_OVER_DOT, Colour::CONTACT);
    }
    picture
}

/// A square piece of the table z = 0 under an object, and its pose in the world.
fn table_under(object: &TouchShape, pose: &IsometryMatrix3<f64>) -> Option<(TouchShape, IsometryMatrix3<f64>)> {
    let (centre, radius) = object.ball(pose);
    let half = TABLE_OVER_OBJECT * radius;
    let shape = TouchShape::new(&Shape::Box { half: [half, half, TABLE_THICKNESS / 2.0] }).ok()?;
    Some((shape, IsometryMatrix3::translation(centre.x, centre.y, -TABLE_THICKNESS / 2.0)))
}

/// View with hand and object in the middle, from the side of the approach.
fn view(solids: &[Solid<'_>], approach: &Vector3<f64>, aside: f64) -> SolidView {
    let balls: Vec<(Point3<f64>, f64)> = solids.iter().map(|solid| solid.shape.ball(&solid.pose)).collect();
    let lowest = |axis: usize| balls.iter().map(|(centre, radius)| centre[axis] - radius).fold(f64::INFINITY, f64::min);
    let highest =
        |axis: usize| balls.iter().map(|(centre, radius)| centre[axis] + radius).fold(f64::NEG_INFINITY, f64::max);
    let middle = Point3::from([0, 1, 2].map(|axis| (lowest(axis) + highest(axis)) / 2.0));
    let reach = |(centre, radius): &(Point3<f64>, f64)| (centre - middle).norm() + radius;
    let extent = 2.0 * balls.iter().map(reach).fold(0.0, f64::max);
    // For an approach from straight above or below, any side is suitable.
    let level = approach.xy().norm();
    let azimuth = if level > 1e-3 { libm::atan2(-approach.y, -approach.x) } else { 0.0 };
    SolidView { azimuth: azimuth + aside, elevation: ELEVATION, middle, extent: 0.9 * extent }
}

#[cfg(test)]
impl CardView {
    /// A card of one panel, with this number of tried grasps.
    pub fn example(object: &str, tried: u64) -> Self {
        let panel = PanelView {
            image: ImageView::of(&Picture::filled(1, 1, [0; 4]), SIDE, SIDE),
            why: "highest epsilon",
            epsilon: "0.123".to_owned(),
            energy: "-1.20".to_owned(),
            contacts: 4,
            seed: "2".to_owned(),
        };
        Self { object: object.to_owned(), kept: 1, found: 2, runs: 3, trials: [tried, 0], panels: vec![panel] }
    }
}
