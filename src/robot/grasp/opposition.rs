//! Contacts of a hand that face each other: between them a hand with several fingers takes a pair of points, as a gripper does
//! between its pads. Over the postures of its eigengrasps they are pinches of two tips, tripods of one finger against two, wraps
//! between the middles of fingers, and holds against the palm.

use std::collections::BTreeMap;

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Vector3};

use super::{
    motion::moves,
    pads::{Grip, TIP},
    solids::HandSolids,
};
use crate::hand::Hand;
use kernel::{geom::rotation_towards, seed::Stream};

/// Two contacts face each other where the line between them leaves each within this angle of its normal: its cosine.
const MIN_FACING: f64 = 0.8;

/// Nearer to each other they hold nothing [m].
const MIN_WIDTH: f64 = 0.002;

/// Postures that are looked at, at most: a grid over the amplitudes of the eigengrasps, as fine as that allows.
const MAX_POSTURES: f64 = 4096.0;

/// Steps along an amplitude, at most.
const MAX_SIDE: usize = 32;

/// Two fingers hold one side where the cosine of the angle between their normals is at least this.
const MIN_ALIKE: f64 = 0.9;

/// One side of a hold, by the indices of its places: the hand's contacts come first, then the tips of its fingers. Twice the same
/// place, or two of fingers that hold together, and the side is half way between them.
type Side = [usize; 2];

/// Two sides that face each other in a posture.
struct Opposition {
    /// Index of the posture.
    posture: u32,
    /// Between them [m].
    width: f64,
    sides: [Side; 2],
}

/// All of a hand.
pub(super) struct Oppositions {
    postures: Vec<Posture>,
    /// Links that end the fingers that close.
    tips: Vec<usize>,
    /// Between tips, and between contacts: those of the same links together, the narrowest first.
    of_links: [Vec<Vec<Opposition>>; 2],
}

/// One value per driven joint, and the amplitudes of the eigengrasps that make them.
struct Posture {
    values: Vec<f64>,
    amplitudes: Vec<f64>,
}

/// A place of a hand that may hold one side.
#[derive(Clone, Copy)]
struct Place {
    /// Expressed in the base frame [m].
    point: Point3<f64>,
    /// The hand's surface is so far from it towards the other side: of a tip, the ball that ends it.
    radius: f64,
    /// Where it points to; a tip holds in any direction.
    normal: Option<Vector3<f64>>,
    link: usize,
}

/// Kinds of grasps by the parts of the hand between which they hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HoldKind {
    /// Two tips.
    Pinch,
    /// A tip against two.
    Tripod,
    /// Contacts along the fingers.
    Wrap,
}

/// Whether two contacts of a hand face each other in any posture of its eigengrasps.
pub fn has_opposition(hand: &Hand) -> bool {
    postures(hand).iter().any(|posture| {
        let frames = hand.link_frames(&hand.posture_values(&posture.values));
        let contacts: Vec<Place> = (0..hand.contacts().len()).map(|index| contact(hand, &frames, index)).collect();
        !facing(&contacts).is_empty()
    })
}

impl Oppositions {
    /// Over the postures whose amplitudes `is_clear` accepts: no two links of the hand overlap.
    pub(super) fn new(hand: &Hand, solids: &HandSolids, mut is_clear: impl FnMut(&[f64]) -> bool) -> Self {
        let postures: Vec<Posture> =
            postures(hand).into_iter().filter(|posture| is_clear(&posture.amplitudes)).collect();
        let tips: Vec<usize> = (1..=hand.tree().len()).filter(|link| is_tip(hand, solids, *link)).collect();
        let mut of_links = [(); 2].map(|()| BTreeMap::<[Side; 2], Vec<Opposition>>::new());
        let count = hand.contacts().len();
        for (number, posture) in (0..).zip(&postures) {
            let frames = hand.link_frames(&hand.posture_values(&posture.values));
            let places: Vec<Place> =
                (0..count + tips.len()).map(|index| place(hand, solids, &tips, &frames, index)).collect();
            for (kind, places, first) in [(0, &places[count..], count), (1, &places[..count], 0)] {
                for (sides, width) in facing(places) {
                    let links = sides.map(|side| side.map(|place| places[place].link));
                    let sides = sides.map(|side| side.map(|place| place + first));
                    of_links[kind].entry(links).or_default().push(Opposition { posture: number, width, sides });
                }
            }
        }
        let of_links = of_links.map(|lists| {
            let mut lists: Vec<Vec<Opposition>> = lists.into_values().collect();
            lists.iter_mut().for_each(|list| list.sort_by(|one, other| one.width.total_cmp(&other.width)));
            lists
        });
        Self { postures, tips, of_links }
    }

    /// Largest width between two sides that face each other [m]; 0 without such sides.
    pub(super) fn widest(&self) -> f64 {
        let lists = self.of_links.iter().flatten();
        lists.filter_map(|list| Some(list.last()?.width)).fold(0.0, f64::max)
    }

    /// Draws two sides at a width within a range [m]: tips or contacts first, then links, then a posture, all as likely. `None`
    /// where no two face each other so.
    pub(super) fn draw(
        &self,
        hand: &Hand,
        solids: &HandSolids,
        [low, high]: [f64; 2],
        stream: &mut Stream,
    ) -> Option<Grip> {
        let [kind, choice, share] = [(); 3].map(|()| stream.unit());
        let within = |list: &'_ Vec<Opposition>| {
            let first = list.partition_point(|opposition| opposition.width < low);
            let last = list.partition_point(|opposition| opposition.width <= high);
            (first < last).then_some(first..last)
        };
        let found = self.of_links.each_ref().map(|lists| -> Vec<&[Opposition]> {
            lists.iter().filter_map(|list| Some(&list[within(list)?])).collect()
        });
        let kind = usize::from(kind < 0.5 && !found[1].is_empty() || found[0].is_empty());
        let list = found[kind].get((choice * found[kind].len() as f64) as usize)?;
        let Opposition { posture, sides, .. } = &list[(share * list.len() as f64) as usize];
        Some(self.grip(hand, solids, &self.postures[*posture as usize], sides))
    }

    /// Draws two sides of a kind at a width within a range [m]: links first, then a posture, all as likely. Returns the hand in the
    /// posture with the width; `None` where no two sides of the kind face each other so.
    pub(super) fn draw_kind(
        &self,
        hand: &Hand,
        solids: &HandSolids,
        kind: HoldKind,
        [low, high]: [f64; 2],
        stream: &mut Stream,
    ) -> Option<(Grip, f64)> {
        let [choice, share] = [(); 2].map(|()| stream.unit());
        let is_pair = |list: &[Opposition]| list[0].sides.iter().all(|[one, other]| one == other);
        let lists: Vec<&[Opposition]> = self.of_links[usize::from(kind == HoldKind::Wrap)]
            .iter()
            .filter(|list| kind == HoldKind::Wrap || is_pair(list) == (kind == HoldKind::Pinch))
            .filter_map(|list| {
                let first = list.partition_point(|opposition| opposition.width < low);
                let last = list.partition_point(|opposition| opposition.width <= high);
                (first < last).then(|| &list[first..last])
            })
            .collect();
        let list = lists.get((choice * lists.len() as f64) as usize)?;
        let Opposition { posture, sides, width } = &list[(share * list.len() as f64) as usize];
        Some((self.grip(hand, solids, &self.postures[*posture as usize], sides), *width))
    }

    /// The hand in a posture, to hold a pair between two sides.
    fn grip(&self, hand: &Hand, solids: &HandSolids, posture: &Posture, sides: &[Side; 2]) -> Grip {
        let joints = hand.posture_values(&posture.values);
        let frames = hand.link_frames(&joints);
        let sides = sides.map(|side| side.map(|index| place(hand, solids, &self.tips, &frames, index)));
        let [first, second] = sides.each_ref().map(|[one, other]| both([one, other]));
        let line = (second.point - first.point).normalize();
        let middle =
            nalgebra::center(&first.point, &second.point).coords + line * ((first.radius - second.radius) / 2.0);
        let rotation = Rotation3::from_matrix_unchecked(rotation_towards(&line, 0.0));
        let approach = hand.approach_direction(&frames);
        // From between the sides to just before the nearest of the tips.
        let reach = |place: &Place| solids.reach_along(place.link, &approach, &frames);
        let tip = sides.as_flattened().iter().map(reach).fold(f64::INFINITY, f64::min);
        Grip {
            base_from_line: IsometryMatrix3::from_parts(Translation3::from(middle), rotation),
            extent: [0.0, (tip - TIP - middle.dot(&approach)).max(0.0)],
            posture: posture.values.clone(),
            amplitudes: posture.amplitudes.clone(),
            joints,
            frames,
        }
    }
}

/// A grid over the amplitudes of a hand's eigengrasps; none where it has no eigengrasps.
fn postures(hand: &Hand) -> Vec<Posture> {
    let count = hand.eigengrasps().map_or(0, |grasps| grasps.directions.len());
    if count == 0 {
        return Vec::new();
    }
    let side = (libm::pow(MAX_POSTURES, 1.0 / count as f64) + 1e-9) as usize;
    let side = side.clamp(2, MAX_SIDE);
    let ranges: Vec<[f64; 2]> = (0..count).map(|direction| hand.amplitude_range(direction)).collect();
    let of = |number: usize| {
        let amplitude = |(direction, [low, high]): (usize, &[f64; 2])| {
            let step = number / side.pow(direction as u32) % side;
            low + (high - low) * step as f64 / (side - 1) as f64
        };
        let amplitudes: Vec<f64> = ranges.iter().enumerate().map(amplitude).collect();
        Posture { values: hand.posture_of(&amplitudes), amplitudes }
    };
    (0..side.pow(count as u32)).map(of).collect()
}

/// A place by its index, as those of a [`Side`].
fn place(hand: &Hand, solids: &HandSolids, tips: &[usize], frames: &[IsometryMatrix3<f64>], index: usize) -> Place {
    match index.checked_sub(hand.contacts().len()) {
        Some(tip) => {
            let approach = hand.approach_pose(frames).isometry().rotation * Vector3::z();
            let link = tips[tip];
            let (point, radius) = solids.farthest_ball(link, &approach, frames).expect("a tip has solids");
            Place { point, radius, normal: None, link }
        }
        None => contact(hand, frames, index),
    }
}

fn contact(hand: &Hand, frames: &[IsometryMatrix3<f64>], index: usize) -> Place {
    let (point, normal) = hand.contact_in_base(index, frames);
    Place { point, radius: 0.0, normal: Some(normal.into_inner()), link: hand.contacts()[index].link }
}

/// Whether a link ends a finger that closes.
fn is_tip(hand: &Hand, solids: &HandSolids, link: usize) -> bool {
    let is_solid = |link: usize| solids.solids.iter().any(|solid| solid.link == link);
    let carries = |mut other: usize| {
        while other > link {
            other = hand.tree().joints()[other - 1].carried_by;
        }
        other == link
    };
    let closes = hand.driven().iter().any(|driven| driven.closing_sign() != 0.0 && moves(hand, link, driven));
    closes && is_solid(link) && !(link + 1..=hand.tree().len()).any(|other| is_solid(other) && carries(other))
}

/// Sides that face each other, with their distance [m]: one place against another, and two that hold together against a third.
fn facing(places: &[Place]) -> Vec<([Side; 2], f64)> {
    let apart = |one: usize, other: usize| places[one].link != places[other].link;
    let all = (0..places.len()).flat_map(|one| (one + 1..places.len()).map(move |other| [one, other]));
    let mut found = Vec::new();
    for [one, other] in all.filter(|[one, other]| apart(*one, *other)) {
        found.extend(width(&places[one], &places[other]).map(|width| ([[one, one], [other, other]], width)));
        let together = match [one, other].map(|place| places[place].normal) {
            [Some(a), Some(b)] => a.dot(&b) >= MIN_ALIKE,
            _ => true,
        };
        if together {
            let both = both([&places[one], &places[other]]);
            let others = (0..places.len()).filter(|third| apart(one, *third) && apart(other, *third));
            found.extend(others.filter_map(|third| Some(([[one, other], [third; 2]], width(&both, &places[third])?))));
        }
    }
    found
}

/// Half way between two places.
fn both([one, other]: [&Place; 2]) -> Place {
    let normal = one.normal.zip(other.normal).map(|(one, other)| (one + other).normalize());
    let radius = (one.radius + other.radius) / 2.0;
    Place { point: nalgebra::center(&one.point, &other.point), radius, normal, link: one.link }
}

/// Distance between two places that face each other [m].
fn width(one: &Place, other: &Place) -> Option<f64> {
    let line = other.point - one.point;
    let min = MIN_FACING * line.norm();
    let width = line.norm() - one.radius - other.radius;
    let faces = |normal: Option<Vector3<f64>>, sign: f64| normal.is_none_or(|normal| sign * normal.dot(&line) >= min);
    (width >= MIN_WIDTH && faces(one.normal, 1.0) && faces(other.normal, -1.0)).then_some(width)
}
