//! `graspmill hand check`: a summary of a hand's description and its table, and pictures of the hand.

use std::{
    collections::BTreeSet,
    f64::consts::PI,
    fmt::{self, Display},
    path::PathBuf,
};

use nalgebra::{IsometryMatrix3, Point3};
use serde::Serialize;

use super::{
    args::HandCheckArgs,
    exit::{Exit, Failure},
    pairs::{self, PairRow},
    printer::Printer,
};
use factory::{product::HandUse, products::PRODUCTS};
use format::Product;
use kernel::{
    description::Format,
    files::{Folder, Temporary},
    geom::TouchShape,
    seed::Stream,
    words::Show,
};
use publish::picture::{Colour, Picture, Solid, SolidView, solid_picture};
use robot::{
    collision::{Bodies, Geometry, Shape},
    hand::{Driven, Follower, Hand, Motor, Mount},
    kinematics::JointKind,
};
use sim::HandModel;

/// Distance of a contact from its link's surface above which the description is wrong; smaller ones are rounding [m].
const ON_SURFACE: f64 = 1e-4;

/// Side of each view of a picture [px].
const SIDE: u32 = 480;

/// Result of the check.
#[derive(Serialize)]
struct Report {
    description: String,
    #[serde(skip)]
    format: Format,
    name: String,
    /// Total mass [kg].
    mass: f64,
    links: Vec<String>,
    driven: Vec<DrivenRow>,
    /// The approach frame in the opened hand, expressed in the base frame: the top three rows of its 4x4 matrix [m].
    approach: [f64; 12],
    contacts: Vec<ContactRow>,
    /// Width between the pads, opened and closed [m]; `None` for hands without such a width.
    width: Option<[f64; 2]>,
    eigengrasps: Vec<EigengraspRow>,
    samples: u64,
    pairs: Vec<PairRow>,
    /// Pairs that touch in the opened hand.
    touch_opened: Vec<[String; 2]>,
    /// MJCF that excludes contacts of the pairs that always touch.
    exclude: Vec<String>,
    uses: Vec<UseRow>,
    pictures: Vec<PathBuf>,
}

#[derive(Serialize)]
struct DrivenRow {
    name: String,
    joint: String,
    /// `rad` or `m`.
    unit: &'static str,
    limits: [f64; 2],
    opened: f64,
    /// `None` for a joint that does not close the hand.
    closed: Option<f64>,
    /// Speed in `unit` per second.
    speed: f64,
    /// Torque or force of the motor [N m] or [N].
    torque: f64,
    /// Load at which the stopped joint moves back [N m] or [N].
    holding_torque: f64,
    followers: Vec<FollowerRow>,
}

#[derive(Serialize)]
struct FollowerRow {
    joint: String,
    ratio: f64,
    /// Motion per unit of the motor after the driven joint has stopped; `None` if this joint stops, too.
    after_breakaway: Option<f64>,
    /// Torque or force that then stops the joint [N m] or [N].
    torque: Option<f64>,
    /// Load at which the stopped joint then moves back [N m] or [N].
    holding_torque: Option<f64>,
}

#[derive(Serialize)]
struct ContactRow {
    name: String,
    link: String,
    /// Position in the opened hand, expressed in the base frame [m].
    point: [f64; 3],
    normal: [f64; 3],
    /// Distance outside its link's surface [m], negative inside.
    off_surface: f64,
}

#[derive(Serialize)]
struct EigengraspRow {
    direction: Vec<f64>,
    /// Amplitudes that keep every driven joint within its range, the others at 0.
    range: [f64; 2],
}

/// Setting of jobs that use a hand.
#[derive(Serialize)]
struct UseRow {
    product: Product,
    /// The setting as written in a job file.
    setting: &'static str,
    /// Reason why such a job cannot use this hand, with a remedy.
    refusal: Option<String>,
}

/// The hand's shapes with their search trees and their poses on their links.
struct Shapes {
    shapes: Vec<(Mount, TouchShape)>,
}

/// Checks a hand.
pub fn check(arguments: &HandCheckArgs, printer: &Printer) -> Result<Exit, Failure> {
    let model = HandModel::open(&arguments.hand).map_err(pairs::wrong_hand)?;
    let hand = model.hand();
    let (bodies, rules) = model.bodies().map_err(pairs::wrong_robot)?;
    let no_surface = |error| Failure::message(Exit::BadSpec, format!("{}: {error}", model.path().shown()));
    let checker = pairs::checker(&bodies, &rules).map_err(no_surface)?;
    let shapes = Shapes::new(&bodies).map_err(no_surface)?;
    let mut stream = Stream::of_job(0, b"", "hand check");
    let counts = checker.count((0..arguments.samples).map(|_| link_frames(hand, &anywhere_all(hand, &mut stream))));
    let opened: Vec<Motor> = hand.opened().into_iter().map(Motor::engaged).collect();
    let links = link_frames(hand, &opened);
    let frames = &links[1..];
    let pairs = PairRow::all(&bodies, &rules, &counts);
    let report = Report {
        description: model.path().display().to_string(),
        format: model.format(),
        name: hand.name().to_owned(),
        mass: model.mass(),
        links: hand.links().to_vec(),
        driven: hand.driven().iter().map(|driven| driven_row(hand, driven)).collect(),
        approach: hand.approach_pose(frames).to_rows(),
        contacts: (0..hand.contacts().len()).map(|contact| contact_row(hand, contact, frames, &shapes)).collect(),
        width: widths(hand),
        eigengrasps: eigengrasps(hand),
        samples: arguments.samples,
        touch_opened: pairs::touching(&bodies, &rules, &checker, &links),
        exclude: pairs.iter().filter(|pair| pair.always_touches(arguments.samples)).map(PairRow::exclude).collect(),
        uses: uses(&model),
        pairs,
        pictures: match arguments.picture.as_ref().map(Folder::at) {
            Some(folder) => draw(hand, &shapes, &folder)?,
            None => Vec::new(),
        },
    };
    if arguments.json {
        printer.json(&report)?
    } else {
        printer.result(&report.to_string())
    }
    Ok(Exit::Complete)
}

/// Frames of the links, the base first.
fn link_frames(hand: &Hand, motors: &[Motor]) -> Vec<IsometryMatrix3<f64>> {
    let mut values = vec![0.0; hand.tree().len()];
    hand.joint_values(motors, &mut values);
    std::iter::once(IsometryMatrix3::identity()).chain(hand.link_frames(&values)).collect()
}

/// Draws a random state of every motor within its range.
fn anywhere_all(hand: &Hand, stream: &mut Stream) -> Vec<Motor> {
    hand.driven().iter().map(|driven| anywhere(driven, stream)).collect()
}

/// Draws a random state of a motor within its range; a clutch is open or shut with equal probability.
fn anywhere(driven: &Driven, stream: &mut Stream) -> Motor {
    let [low, high] = driven.range();
    let motor = Motor::engaged(stream.uniform(low, high));
    match driven.breakaway {
        Some(_) if stream.uniform(0.0, 1.0) < 0.5 => {
            let stopped = driven.stopped(motor);
            let on = stopped.angle + stream.uniform(0.0, 1.0) * (driven.closed_angle(stopped) - stopped.angle);
            driven.driven_to(stopped, on)
        }
        _ => motor,
    }
}

/// Settings of all jobs that use hands, and whether this hand is suitable.
fn uses(model: &HandModel) -> Vec<UseRow> {
    let mut rows = Vec::new();
    for factory in PRODUCTS {
        let row = |HandUse { setting, check }: &HandUse| UseRow {
            product: factory.product,
            setting,
            refusal: check(model).err().map(|error| error.to_string()),
        };
        rows.extend(factory.hand_uses.iter().map(row));
    }
    rows
}

fn joint_name(hand: &Hand, joint: usize) -> String {
    hand.tree().joints()[joint].joint.name.clone()
}

fn driven_row(hand: &Hand, driven: &Driven) -> DrivenRow {
    let follower = |(index, follower): (usize, &Follower)| {
        let alone = driven.breakaway.filter(|breakaway| breakaway.follower == index);
        FollowerRow {
            joint: joint_name(hand, follower.joint),
            ratio: follower.ratio,
            after_breakaway: alone.map(|breakaway| breakaway.ratio),
            torque: alone.map(|breakaway| breakaway.torque),
            holding_torque: alone.map(|breakaway| breakaway.holding_torque),
        }
    };
    let slides = hand.tree().joints()[driven.joint].joint.kind == JointKind::Prismatic;
    DrivenRow {
        name: driven.name.clone(),
        joint: joint_name(hand, driven.joint),
        unit: if slides { "m" } else { "rad" },
        limits: driven.range(),
        opened: driven.opened,
        closed: driven.closed,
        speed: driven.speed,
        torque: driven.torque,
        holding_torque: driven.holding_torque,
        followers: driven.followers.iter().enumerate().map(follower).collect(),
    }
}

fn contact_row(hand: &Hand, contact: usize, frames: &[IsometryMatrix3<f64>], shapes: &Shapes) -> ContactRow {
    let (point, normal) = hand.contact_in_base(contact, frames);
    let contact = &hand.contacts()[contact];
    ContactRow {
        name: contact.name.clone(),
        link: hand.links()[contact.link].clone(),
        point: point.into(),
        normal: normal.into_inner().into(),
        off_surface: shapes.off_surface(contact.link, &contact.point),
    }
}

fn widths(hand: &Hand) -> Option<[f64; 2]> {
    let width = |posture: Vec<f64>| hand.width(&hand.link_frames(&hand.posture_values(&posture)));
    Some([width(hand.opened())?, width(hand.closed())?])
}

fn eigengrasps(hand: &Hand) -> Vec<EigengraspRow> {
    let directions = hand.eigengrasps().map(|grasps| grasps.directions.clone()).unwrap_or_default();
    let row = |(index, direction)| EigengraspRow { direction, range: hand.amplitude_range(index) };
    directions.into_iter().enumerate().map(row).collect()
}

impl Shapes {
    fn new(bodies: &Bodies) -> Result<Self, kernel::geom::NoSurface> {
        let all = bodies.bodies.iter().flat_map(|body| body.geometries.iter().map(|geometry| (body.link, geometry)));
        let mount = |link, geometry: &Geometry| Mount { link, link_from_frame: geometry.link_from_shape };
        let built = all.map(|(link, geometry)| Ok((mount(link, geometry), TouchShape::new(&geometry.shape)?)));
        Ok(Self { shapes: built.collect::<Result<_, _>>()? })
    }

    /// Distance of a point outside a link's surface [m].
    fn off_surface(&self, link: usize, point: &Point3<f64>) -> f64 {
        let of_link = self.shapes.iter().filter(|(mount, _)| mount.link == link);
        of_link.map(|(mount, shape)| shape.distance(&mount.link_from_frame, point)).fold(f64::INFINITY, f64::min)
    }

    /// The shapes at these link frames, links in steps of blue and grey.
    fn placed(&self, hand: &Hand, frames: &[IsometryMatrix3<f64>]) -> Vec<Solid<'_>> {
        const COLOURS: [Colour; 3] =
            [Colour([0xc4, 0xc9, 0xd0]), Colour([0x7f, 0xa9, 0xcf]), Colour([0x3f, 0x78, 0xb0])];
        self.shapes
            .iter()
            .map(|(mount, shape)| {
                let colour = COLOURS[if mount.link == 0 { 0 } else { 1 + mount.link % 2 }];
                Solid { shape, pose: hand.base_from(mount, frames), colour }
            })
            .collect()
    }
}

/// Draws the hand opened, half closed (joints that do not close it at the middle of their range) and closed. Each picture has
/// three views: from the side, from above a corner, and from above the palm. Contacts are orange balls.
fn draw(hand: &Hand, shapes: &Shapes, folder: &Folder) -> Result<Vec<PathBuf>, Failure> {
    folder.create()?;
    let ball = TouchShape::new(&Shape::Sphere { radius: 0.002 })?;
    let half = |driven: &Driven| {
        let [low, high] = driven.range();
        driven.closed.map_or((low + high) / 2.0, |closed| (driven.opened + closed) / 2.0)
    };
    let half: Vec<f64> = hand.driven().iter().map(half).collect();
    let mut written = Vec::new();
    for (name, posture) in [("opened", hand.opened()), ("half_closed", half), ("closed", hand.closed())] {
        let frames = hand.link_frames(&hand.posture_values(&posture));
        let mut solids = shapes.placed(hand, &frames);
        solids.extend((0..hand.contacts().len()).map(|contact| {
            let point = hand.contact_in_base(contact, &frames).0.coords;
            Solid {
                shape: &ball,
                pose: IsometryMatrix3::translation(point.x, point.y, point.z),
                colour: Colour::COMPLETE,
            }
        }));
        let file = format!("{name}.png");
        Temporary::write(folder, &file, &picture(&solids).to_png())?;
        written.push(folder.path_of(file));
    }
    Ok(written)
}

/// Draws three views side by side on white, with the same scale.
fn picture(solids: &[Solid<'_>]) -> Picture {
    let balls: Vec<_> = solids.iter().map(|solid| solid.shape.ball(&solid.pose)).collect();
    let side = |sign: f64| -> [f64; 3] {
        let end = |axis: usize| {
            let reach = balls.iter().map(|(centre, radius)| sign * centre[axis] + radius);
            sign * reach.fold(f64::NEG_INFINITY, f64::max)
        };
        std::array::from_fn(end)
    };
    let (low, high) = (Point3::from(side(-1.0)), Point3::from(side(1.0)));
    let extent = 1.02 * (high - low).norm() / f64::sqrt(1.5);
    let middle = nalgebra::center(&low, &high);
    let views = [(0.0, 0.0), (-0.25 * PI, 0.2 * PI), (0.0, 0.49 * PI)];
    let mut sheet = Picture::filled(SIDE * views.len() as u32, SIDE, [255; 4]);
    for (index, (azimuth, elevation)) in views.into_iter().enumerate() {
        let view = SolidView { azimuth, elevation, middle, extent };
        let drawn = solid_picture(solids, &view, SIDE);
        for row in 0..SIDE {
            for column in 0..SIDE {
                let [r, g, b, alpha] = drawn.at(column, row);
                let over = |channel: u8| {
                    ((u32::from(channel) * u32::from(alpha) + 255 * (255 - u32::from(alpha))) / 255) as u8
                };
                let target = (row * sheet.width + index as u32 * SIDE + column) as usize;
                sheet.pixels[target] = [over(r), over(g), over(b), 255];
            }
        }
    }
    sheet
}

impl Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} ({}), {:.3} kg", self.description, self.name, self.mass)?;
        writeln!(f, "\ndriven")?;
        self.driven.iter().try_for_each(|driven| write!(f, "{driven}"))?;
        let [ax, _, az, x, bx, _, bz, y, cx, _, cz, z] = self.approach.map(tidy);
        writeln!(f, "\nframes\n  base                     the description's world")?;
        writeln!(f, "  approach                 at ({x}, {y}, {z}) m, z ({az}, {bz}, {cz}), x ({ax}, {bx}, {cx})")?;
        if let Some([opened, closed]) = self.width {
            writeln!(f, "  width                    {:.1} mm opened, {:.1} mm closed", 1e3 * opened, 1e3 * closed)?;
        }
        writeln!(f, "\ncontacts, in the opened hand")?;
        for contact in &self.contacts {
            let ([x, y, z], [nx, ny, nz]) = (contact.point.map(tidy), contact.normal.map(tidy));
            write!(f, "  {:24} {:16} ({x}, {y}, {z}) m, normal ({nx}, {ny}, {nz})", contact.name, contact.link)?;
            match contact.off_surface {
                off if off.abs() <= ON_SURFACE => writeln!(f)?,
                off if off.is_infinite() => writeln!(f, "; its link has no shape")?,
                off if off > 0.0 => writeln!(f, "; {:.2} mm outside its link: move it to the surface", 1e3 * off)?,
                off => writeln!(f, "; {:.2} mm inside its link: move it to the surface", -1e3 * off)?,
            }
        }
        if !self.eigengrasps.is_empty() {
            writeln!(f, "\neigengrasps")?;
        }
        for EigengraspRow { direction, range: [low, high] } in &self.eigengrasps {
            writeln!(f, "  {direction:?}, amplitude {low:.3} .. {high:.3}")?;
        }
        writeln!(f, "\npairs, in {} random postures, clutches open and shut", self.samples)?;
        pairs::write_pairs(f, &self.pairs, self.samples)?;
        match self.touch_opened.as_slice() {
            [] => writeln!(f, "\nopened, nothing touches")?,
            pairs => {
                let pairs: Vec<_> = pairs.iter().map(|[one, other]| format!("{one} and {other}")).collect();
                writeln!(f, "\nopened, these touch: {}", pairs.join("; "))?;
            }
        }
        pairs::write_excludes(f, self.format, &self.exclude)?;
        self.write_uses(f)?;
        if !self.pictures.is_empty() {
            writeln!(f)?;
        }
        self.pictures.iter().try_for_each(|picture| writeln!(f, "{}", picture.shown()))
    }
}

impl Report {
    /// Writes which jobs can use the hand and why others cannot, grouped by reason.
    fn write_uses(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let settings = |refusal: Option<&String>| {
            let mut alike: Vec<&str> = Vec::new();
            for row in self.uses.iter().filter(|row| row.refusal.as_ref() == refusal) {
                // Jobs of two products may share a setting.
                if !alike.contains(&row.setting) {
                    alike.push(row.setting);
                }
            }
            alike.join(", ")
        };
        match settings(None).as_str() {
            "" => writeln!(f, "\nno job can use this hand")?,
            able => writeln!(f, "\njobs that can use this hand: {able}")?,
        }
        let refusals: BTreeSet<&String> = self.uses.iter().filter_map(|row| row.refusal.as_ref()).collect();
        let mut refusals = refusals.into_iter();
        refusals.try_for_each(|reason| {
            writeln!(f, "jobs that cannot: {}\n  {}", settings(Some(reason)), reason.replace('\n', "\n  "))
        })
    }
}

impl Display for DrivenRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, joint, unit, limits: [low, high], opened, speed, torque, holding_torque, .. } = self;
        let force = if *unit == "m" { "N" } else { "N m" };
        let closed = self.closed.map_or("does not close the hand".to_owned(), |closed| format!("closed {closed:.4}"));
        writeln!(f, "  {name:24} {joint}: {low:.4} .. {high:.4} {unit}, opened {opened:.4}, {closed}")?;
        writeln!(f, "  {:24} {speed} {unit}/s, stopped by {torque} {force}, holds {holding_torque}", "")?;
        for follower in &self.followers {
            write!(f, "  {:24} {} follows at {:.4}", "", follower.joint, follower.ratio)?;
            match (follower.after_breakaway, follower.torque, follower.holding_torque) {
                (Some(ratio), Some(torque), Some(holds)) => {
                    writeln!(
                        f,
                        "; after {joint} stops, continues at {ratio:.4} until {torque} {force}, holds {holds}"
                    )?;
                }
                _ => writeln!(f)?,
            }
        }
        Ok(())
    }
}

/// Rounds to a micrometre, without negative zero.
fn tidy(number: f64) -> f64 {
    (number * 1e6).round() / 1e6 + 0.0
}
