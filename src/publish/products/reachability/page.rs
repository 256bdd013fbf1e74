//! The page of a reachability dataset: counts, cross-sections with approach directions over the field, and directions.

use serde::Serialize;

use super::{
    census::Census,
    inspection::{AxisFacts, ReachabilityFacts},
    labels::{ORDER, in_words},
    section::{BandView, Cut, band_key, class, legend},
    tables::{CountsView, DirectionsView},
};
use crate::{
    chart::{grouped, percent, short},
    markup::Markup,
    page::{DatasetView, ImageView, SpeedView, StripCard, StripPicture},
    picture::Picture,
};
use format::ReachabilityField;
use kernel::geom::{AxisUnit, FieldMetric, PoseGrid, PoseLabel};

/// Level cross-sections.
const LEVELS: usize = 4;
/// Largest side of a picture of the strip [px]: twice its size on the page.
const STRIP_SIDE: u32 = 320;
/// Name of a job's collision test if collisions are not checked.
const NO_COLLISIONS: &str = "none";

/// Input of the page's template.
#[derive(Serialize)]
pub(crate) struct ReachabilityPage<'a> {
    dataset: DatasetView<'a>,
    strip: Vec<StripPicture>,
    numbers: HeaderNumbers,
    speed: Option<SpeedView>,
    /// Poses per second, if the run stored its figures.
    poses_per_second: Option<String>,
    /// The reachable pose farthest from the border, as an argument of `--pose`; `None` if none is reachable.
    deepest: Option<String>,
    labels: [LabelView; 3],
    robot: RobotView<'a>,
    solver: &'a str,
    /// Shapes that are checked for collisions; `None` if collisions are not checked.
    collisions: Option<&'a str>,
    grid: GridView<'a>,
    field: FieldView<'a>,
    upright: CutView,
    levels: Vec<CutView>,
    key: KeyView,
    counts: CountsView,
    directions: DirectionsView,
    job: &'a str,
}

impl<'a> ReachabilityPage<'a> {
    /// Count of the cross-sections.
    pub fn shown(&self) -> usize {
        1 + self.levels.len()
    }

    /// The page of a map.
    pub fn of(facts: &'a ReachabilityFacts, field: &ReachabilityField, job: &'a str) -> Self {
        let census = Census::of(field);
        let (upright, levels) = cuts(field, &census);
        let (grid, band) = (&field.header.grid, band(field));
        let view = |cut: &Cut| CutView {
            kind: if matches!(cut, Cut::Level(_)) { "level" } else { "upright" },
            name: cut.name(grid),
            svg: cut.svg(grid, &census, band),
        };
        Self {
            dataset: DatasetView::of(&facts.header),
            strip: strip([upright].iter().chain(&levels), grid, &census),
            numbers: HeaderNumbers::of(facts),
            speed: SpeedView::of(&facts.header, "positions"),
            poses_per_second: facts.header.notes.speed.as_ref().map(|speed| {
                let per_position = facts.poses as f64 / facts.positions.max(1) as f64;
                grouped((speed.rate() * per_position).round() as u64)
            }),
            deepest: deepest_pose(field),
            labels: ORDER.map(|label| LabelView::of(facts, label)),
            robot: RobotView::of(facts),
            solver: &facts.solver,
            collisions: (facts.collisions != NO_COLLISIONS).then_some(&facts.collisions),
            grid: GridView::of(facts),
            field: FieldView::of(facts),
            upright: view(&upright),
            levels: levels.iter().map(view).collect(),
            key: KeyView::of(grid, &census, band, levels.iter().chain([&upright])),
            counts: CountsView::of(facts, field, &census),
            directions: DirectionsView::of(&census),
            job,
        }
    }
}

/// The strip at the top: a small picture of each cross-section.
fn strip<'a>(cuts: impl Iterator<Item = &'a Cut>, grid: &PoseGrid, census: &Census) -> Vec<StripPicture> {
    let card = |cut: &Cut| {
        let picture = cut.picture(grid, census, cut.fitting_cell(grid, STRIP_SIDE)).with_few_colours();
        let (width, height) = (picture.width, picture.height);
        StripCard { caption: cut.name(grid), pictures: vec![ImageView::of(&picture, width, height)] }
    };
    StripPicture::strip(&(1..).zip(cuts.map(card)).collect::<Vec<_>>())
}

/// The reachable pose with the smallest signed distance, x, y, z [m], roll, pitch, yaw [rad], as `--pose` takes it; `None`
/// where none is reachable.
fn deepest_pose(field: &ReachabilityField) -> Option<String> {
    let cells = field.labels.iter().zip(&field.distances).enumerate();
    let reachable = cells.filter(|(_, (label, _))| **label == PoseLabel::Reachable);
    let (cell, _) = reachable.min_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b))?;
    // Tenths of millimetres and of milliradians; zero has no sign.
    let number = |value: f64| ((value * 1e4).round() / 1e4 + 0.0).to_string();
    Some(field.header.grid.pose(cell).map(number).join(","))
}

/// The vertical cross-section and a horizontal one as pictures, with their positions; `cell` pixels per position.
pub(crate) fn pictures(field: &ReachabilityField, cell: u32) -> Vec<(String, Picture)> {
    let census = Census::of(field);
    let (upright, levels) = cuts(field, &census);
    let grid = &field.header.grid;
    let middle = levels.get((levels.len() + 1).div_ceil(2) - 1);
    let shown = [upright].into_iter().chain(middle.copied());
    shown.map(|cut| (cut.name(grid), cut.picture(grid, &census, cell).with_few_colours().framed())).collect()
}

/// The vertical cross-section as a picture, with the largest whole number of pixels per position that fits a square of `side`
/// pixels.
pub(crate) fn upright_picture(field: &ReachabilityField, side: u32) -> Picture {
    let census = Census::of(field);
    let (upright, _) = cuts(field, &census);
    let grid = &field.header.grid;
    upright.picture(grid, &census, upright.fitting_cell(grid, side))
}

/// The vertical cross-section through the middle, and horizontal ones from above.
fn cuts(field: &ReachabilityField, census: &Census) -> (Cut, Vec<Cut>) {
    let upright = Cut::Upright(field.header.grid.position_axes()[1].nearest(0.0));
    (upright, census.middle_heights(LEVELS).into_iter().rev().map(Cut::Level).collect())
}

/// Width of the bands of signed distance, in the field's unit.
fn band(field: &ReachabilityField) -> f64 {
    match field.header.metric {
        FieldMetric::Metres { .. } => (field.header.grid.position_axes()[0].step / 2.0).max(0.025),
        FieldMetric::Cells => 0.5,
    }
}

/// The most important numbers.
#[derive(Serialize)]
struct HeaderNumbers {
    poses: String,
    positions: String,
}

impl HeaderNumbers {
    fn of(facts: &ReachabilityFacts) -> Self {
        Self { poses: grouped(facts.poses), positions: grouped(facts.positions) }
    }
}

/// A label and its number of poses.
#[derive(Serialize)]
struct LabelView {
    name: &'static str,
    meaning: &'static str,
    class: &'static str,
    count: String,
    share: String,
}

impl LabelView {
    fn of(facts: &ReachabilityFacts, label: PoseLabel) -> Self {
        let count = facts.labels.get(label.name()).copied().unwrap_or(0);
        Self {
            name: in_words(label),
            meaning: meaning(label),
            class: class(label),
            count: grouped(count),
            share: percent(count as f64 / facts.poses.max(1) as f64),
        }
    }
}

fn meaning(label: PoseLabel) -> &'static str {
    match label {
        PoseLabel::Reachable => "reachable: joint values are known",
        PoseLabel::Colliding => "colliding: joint values exist, but all of them collide",
        PoseLabel::NoSolution => "no solution: no joint values within their limits",
    }
}

/// Robot and group.
#[derive(Serialize)]
struct RobotView<'a> {
    name: &'a str,
    content: String,
    joints: String,
    /// Other joints with their values in the job; empty if the robot's file sets them.
    fixed: String,
    target: &'a str,
    frame: &'a str,
}

impl<'a> RobotView<'a> {
    fn of(facts: &'a ReachabilityFacts) -> Self {
        let robot = &facts.robot;
        let fixed: Vec<String> = robot.fixed.iter().map(|(joint, value)| format!("{joint} = {value}")).collect();
        Self {
            name: &robot.name,
            content: robot.id.0.short().to_string(),
            joints: robot.joints.join(", "),
            fixed: fixed.join(", "),
            target: &robot.target,
            frame: &robot.frame,
        }
    }
}

/// The grid of poses.
#[derive(Serialize)]
struct GridView<'a> {
    /// Whether the grid is made of directions and rolls.
    is_directed: bool,
    covering: &'a str,
    axes: Vec<AxisView<'a>>,
}

/// An axis of the grid.
#[derive(Serialize)]
struct AxisView<'a> {
    name: &'a str,
    count: u64,
    /// First centre, last centre and step; `None` for directions.
    ends: Option<[String; 3]>,
}

impl<'a> GridView<'a> {
    fn of(facts: &'a ReachabilityFacts) -> Self {
        Self {
            is_directed: facts.axes.iter().any(|axis| axis.unit == AxisUnit::HealPix.name()),
            covering: &facts.covering.words,
            axes: facts.axes.iter().map(AxisView::of).collect(),
        }
    }
}

impl<'a> AxisView<'a> {
    fn of(axis: &'a AxisFacts) -> Self {
        let value = |value: f64| match axis.unit.as_str() {
            "rad" => format!("{}°", short((value.to_degrees() * 1e6).round() / 1e6)),
            _ => format!("{} m", short((value * 1e6).round() / 1e6)),
        };
        let last = axis.first + axis.count.saturating_sub(1) as f64 * axis.step;
        let directions = axis.unit == AxisUnit::HealPix.name();
        let ends = (!directions).then(|| [axis.first, last, axis.step].map(value));
        Self { name: &axis.name, count: axis.count, ends }
    }
}

/// The signed distances.
#[derive(Serialize)]
struct FieldView<'a> {
    profile: &'a str,
    unit: &'a str,
    /// Metres that count as much as one radian.
    radian: Option<String>,
    /// `None` if all labels are alike.
    range: Option<RangeView>,
}

/// Smallest, largest and mean distance.
#[derive(Serialize)]
struct RangeView {
    min: String,
    max: String,
    mean: String,
}

impl<'a> FieldView<'a> {
    fn of(facts: &'a ReachabilityFacts) -> Self {
        let field = &facts.field;
        let range = match (field.min, field.max, field.mean) {
            (Some(min), Some(max), Some(mean)) => Some([min, max, mean].map(|value| format!("{value:.3}"))),
            _ => None,
        };
        Self {
            profile: &field.profile,
            unit: &field.unit,
            radian: field.radian_weight.map(short),
            range: range.map(|[min, max, mean]| RangeView { min, max, mean }),
        }
    }
}

/// A cross-section.
#[derive(Serialize)]
struct CutView {
    kind: &'static str,
    name: String,
    svg: Markup,
}

/// Marks and colours of the cross-sections.
#[derive(Serialize)]
struct KeyView {
    /// Number of directions, if each counts for the nearest of the 26 that are drawn.
    directions: Option<usize>,
    /// Positions between marks, if not every position has one.
    stride: Option<usize>,
    marks: Markup,
    band: String,
    bands: Vec<BandView>,
}

impl KeyView {
    fn of<'a>(grid: &PoseGrid, census: &Census, band: f64, cuts: impl Iterator<Item = &'a Cut>) -> Self {
        let finite =
            || census.positions.iter().map(|position| position.distance).filter(|distance| distance.is_finite());
        Self {
            directions: match grid {
                PoseGrid::Axes(_) => None,
                PoseGrid::Sphere(grid) => Some(grid.directions().count()),
            },
            stride: cuts.map(|cut| cut.stride(grid)).max().filter(|stride| *stride > 1),
            marks: legend(),
            band: short(band),
            bands: band_key(band, finite().fold(0.0, f64::min), finite().fold(0.0, f64::max)),
        }
    }
}
