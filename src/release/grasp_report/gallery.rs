//! Pictures of grasps: an object and the closed hand, the best and the worst kept grasp of each.

use std::{collections::BTreeMap, f64::consts::FRAC_PI_2, fmt::Write as _, sync::Arc};

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use crate::{
    dataset::{DatasetError, DatasetReader, Shapes},
    geom::{NoSurface, Shape, TouchShape, TriMesh, Triangles},
    ids::ObjectId,
    record::{Grasp, GraspRun, HandShape},
    release::{
        GraspedObject,
        grasps::{GraspPlace, GraspSurvey},
        page::escaped,
        picture::{Colour, Picture, Solid, SolidView, solid_picture},
    },
};

/// Objects that a page shows.
const SHOWN: usize = 16;
/// Side of a picture [px].
const SIDE: u32 = 200;
/// Radius of the dot at a contact [m].
const DOT: f64 = 0.003;
/// From how high a grasp is looked at [rad].
const ELEVATION: f64 = 0.35;

/// A hand that is drawn.
struct DrawnHand {
    shape: HandShape,
    /// One a solid of the shape.
    solids: Vec<TouchShape>,
    /// What marks a contact.
    dot: TouchShape,
}

impl DrawnHand {
    /// The hand of a dataset; `None` where it has a shape that cannot be drawn.
    fn of(shapes: &Shapes) -> Result<Option<Self>, DatasetError> {
        let shape = shapes.hand()?;
        let solids: Result<_, NoSurface> = shape.solids.iter().map(|solid| TouchShape::new(&solid.shape)).collect();
        let dot = TouchShape::new(&Shape::Sphere { radius: DOT });
        Ok(solids.ok().zip(dot.ok()).map(|(solids, dot)| Self { shape, solids, dot }))
    }
}

/// The objects with any state at even steps through their names, at most so many, with their places in the shapes.
fn shown<'a>(
    reader: &DatasetReader,
    survey: &'a GraspSurvey,
    most: usize,
) -> Result<Vec<(&'a GraspedObject, usize)>, DatasetError> {
    // The shapes are sorted as the asset table is.
    let places: BTreeMap<ObjectId, usize> =
        reader.assets()?.objects.iter().enumerate().map(|(place, row)| (row.object, place)).collect();
    let grasped: Vec<&GraspedObject> =
        survey.facts.objects.iter().filter(|object| !picks(survey, object).is_empty()).collect();
    let count = grasped.len().min(most);
    let even = (0..count).map(|step| grasped[step * grasped.len() / count]);
    Ok(even.filter_map(|object| Some((object, *places.get(&object.object)?))).collect())
}

fn picks<'a>(survey: &'a GraspSurvey, object: &GraspedObject) -> &'a [(&'static str, GraspPlace)] {
    survey.picks.get(&object.object).map(Vec::as_slice).unwrap_or_default()
}

/// The section, and how many objects it shows: those with any state at even steps through their names.
pub(super) fn gallery(reader: &DatasetReader, survey: &GraspSurvey) -> Result<(String, usize), DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let Some(hand) = DrawnHand::of(&shapes)? else {
        let nothing =
            "<section id=\"gallery\"><h2>Grasps</h2><p>The hand has a shape that cannot be drawn.</p></section>";
        return Ok((nothing.to_owned(), 0));
    };
    let shown = shown(reader, survey, SHOWN)?;
    let mut html = String::from(concat!(
        "<section id=\"gallery\"><h2>Grasps</h2><p>The best and the worst kept grasp of each object, by epsilon, the hand ",
        "closed and a dot at each contact, or the state of lowest energy where none was kept; two looks at each, across the approach and a quarter turn on. ",
        "Objects at even steps through their names.</p>"
    ));
    for (object, place) in &shown {
        let mesh = shapes.object(*place)?.mesh;
        html.push_str(&card(reader, object, &mesh, &hand, picks(survey, object))?);
    }
    html.push_str("</section>");
    Ok((html, shown.len()))
}

/// Of at most `most` objects the first grasp that a page shows, from two sides, each `side` pixels wide and high, with the
/// object's name; none where the hand has a shape that cannot be drawn.
pub(in crate::release) fn pictures(
    reader: &DatasetReader,
    survey: &GraspSurvey,
    most: usize,
    side: u32,
) -> Result<Vec<(String, Picture)>, DatasetError> {
    let shapes = Shapes::open(reader.folder())?;
    let Some(hand) = DrawnHand::of(&shapes)? else { return Ok(Vec::new()) };
    let mut pictures = Vec::new();
    for (object, place) in shown(reader, survey, most)? {
        let Some((_, pick)) = picks(survey, object).first() else { continue };
        let Some(sample) = reader.sample(pick.run)? else { continue };
        let run = sample.grasp_run()?;
        let (Some(grasp), Ok(solid)) = (run.grasps.get(pick.grasp), solid_of(&shapes.object(place)?.mesh)) else {
            continue;
        };
        let looks = [FRAC_PI_2, 0.0].map(|turn| look(grasp, &solid, &hand, turn, side));
        pictures.push((object.name.clone(), Picture::row(&looks, side / 20).with_few_colours()));
    }
    Ok(pictures)
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
    object: &GraspedObject,
    mesh: &TriMesh,
    hand: &DrawnHand,
    picks: &[(&'static str, GraspPlace)],
) -> Result<String, DatasetError> {
    let mut html = format!(
        "<article class=\"card\"><header><h3>{}</h3><p class=\"figures\">{} kept of {} found in {} runs</p></header>",
        escaped(&object.name),
        object.verdicts[0],
        object.found(),
        object.runs,
    );
    html.push_str("<div class=\"pictures\">");
    let solid = solid_of(mesh);
    for (word, place) in picks {
        let Some(sample) = reader.sample(place.run)? else { continue };
        let run = sample.grasp_run()?;
        let (Some(grasp), Ok(solid)) = (run.grasps.get(place.grasp), &solid) else { continue };
        for turn in [FRAC_PI_2, 0.0] {
            html.push_str(&panel(&run, grasp, solid, hand, turn, word, &object.name));
        }
    }
    html.push_str("</div></article>\n");
    Ok(html)
}

/// One look at a grasp, `turn` away from the approach's azimuth [rad].
fn panel(
    run: &GraspRun,
    grasp: &Grasp,
    object: &TouchShape,
    hand: &DrawnHand,
    turn: f64,
    word: &str,
    name: &str,
) -> String {
    let picture = look(grasp, object, hand, turn, SIDE).with_few_colours();
    let seed = run.sample.view;
    let mut html = String::new();
    let _ = write!(
        html,
        concat!(
            "<figure><img width=\"{0}\" height=\"{0}\" loading=\"lazy\" alt=\"{1} grasp of {2}\" src=\"{3}\">",
            "<figcaption>{1} <span class=\"quiet\">epsilon {4:.3}, energy {5:.2}, {6} contacts, seed {7}</span></figcaption></figure>"
        ),
        SIDE,
        word,
        escaped(name),
        picture.to_data_uri(),
        grasp.epsilon(&run.method),
        grasp.energy,
        grasp.contacts.len(),
        seed,
    );
    html
}

/// Object, hand and contacts, `turn` away from the approach's azimuth [rad].
fn look(grasp: &Grasp, object: &TouchShape, hand: &DrawnHand, turn: f64, side: u32) -> Picture {
    let frames = hand.shape.link_frames(&grasp.joints);
    let parts = hand.shape.solids.iter().zip(&hand.solids);
    let mut solids: Vec<Solid<'_>> = parts
        .map(|(part, shape)| Solid {
            shape,
            place: grasp.object_from_base.isometry() * frames[part.link] * part.link_from_solid,
            colour: Colour::EXPLORED,
        })
        .collect();
    solids.push(Solid { shape: object, place: IsometryMatrix3::identity(), colour: Colour::COMPLETE });
    solids.extend(grasp.contacts.iter().map(|contact| Solid {
        shape: &hand.dot,
        place: IsometryMatrix3::translation(contact.point[0], contact.point[1], contact.point[2]),
        colour: Colour::HELD,
    }));
    let view = view(&solids, &(grasp.object_from_approach.rotation() * Vector3::z()), turn);
    solid_picture(&solids, &view, side)
}

/// Hand and object in the middle, seen from the side of the approach.
fn view(solids: &[Solid<'_>], approach: &Vector3<f64>, turn: f64) -> SolidView {
    let balls: Vec<(Point3<f64>, f64)> = solids.iter().map(|solid| solid.shape.ball(&solid.place)).collect();
    let lowest = |axis: usize| balls.iter().map(|(centre, radius)| centre[axis] - radius).fold(f64::INFINITY, f64::min);
    let highest =
        |axis: usize| balls.iter().map(|(centre, radius)| centre[axis] + radius).fold(f64::NEG_INFINITY, f64::max);
    let middle = Point3::from([0, 1, 2].map(|axis| (lowest(axis) + highest(axis)) / 2.0));
    let reach = |(centre, radius): &(Point3<f64>, f64)| (centre - middle).norm() + radius;
    let extent = 2.0 * balls.iter().map(reach).fold(0.0, f64::max);
    // From straight above or below any side will do.
    let level = approach.x.hypot(approach.y);
    let azimuth = if level > 1e-3 { libm::atan2(-approach.y, -approach.x) } else { 0.0 };
    SolidView { azimuth: azimuth + turn, elevation: ELEVATION, middle, extent: 0.9 * extent }
}
