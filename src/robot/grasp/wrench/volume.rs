//! Volume of the hull, from all of its facets.

use super::{
    enclose::{CORNERS, Simplex},
    polytope::{Polytope, height},
    set::{FLAT, WrenchSet},
};

/// Volume of a hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HullVolume {
    /// Volume without unit, for forces and for wrenches, since torques are divided by a length. 0 where the hull is
    /// flat.
    pub volume: f64,
    /// Facets of the hull; those of flat faces are counted as simplices.
    pub facets: usize,
}

/// Memory for whole hulls.
#[derive(Clone, Debug, Default)]
pub struct HullSolver {
    forces: Polytope<3>,
    wrenches: Polytope<6>,
}

impl HullSolver {
    /// Volume of the hull of the forces.
    pub fn of_forces(&mut self, set: &WrenchSet) -> HullVolume {
        volume(&mut self.forces, set)
    }

    /// Volume of the hull of the wrenches. Its facets grow with the third power of the edges: use 8 edges per contact,
    /// on kept grasps only.
    pub fn of_wrenches(&mut self, set: &WrenchSet) -> HullVolume {
        volume(&mut self.wrenches, set)
    }
}

fn volume<const D: usize>(polytope: &mut Polytope<D>, set: &WrenchSet) -> HullVolume {
    let Some((simplex, corners)) =
        far_corners::<D>(set).and_then(|corners| Some((Simplex::<D>::new(set, &corners)?, corners)))
    else {
        return HullVolume { volume: 0.0, facets: 0 };
    };
    polytope.start(&simplex, set.len());
    let count = set.len();
    // A fixed order that jumps between contacts: neighbours in the set are neighbours in the hull, and facets of few contacts
    // would be made for nothing.
    let stride = (count * 5 / 8..).find(|stride| gcd(*stride, count) == 1).unwrap_or(1);
    let mut last = 0;
    for step in 0..count {
        let index = (step * stride % count) as u16;
        if corners[..=D].contains(&index) {
            continue;
        }
        let point: [f64; D] = set.point(index);
        let sees = |name: usize| height(&polytope.facets[name], &point) > 0.0;
        let names = (last..polytope.facets.len()).chain(0..last);
        // Heights above facets that are gone are NaN.
        if let Some(below) = names.into_iter().find(|name| sees(*name)) {
            polytope.add(index, &point, below as u32, |name, _| last = name as usize);
        }
    }
    let middle = set_middle::<D>(set, &corners);
    let (mut sum, mut facets) = (0.0, 0);
    for (_, facet) in polytope.alive() {
        let edges = facet.corners.map(|corner| {
            let point: [f64; D] = set.point(corner);
            std::array::from_fn(|axis| point[axis] - middle[axis])
        });
        sum += determinant(edges).abs();
        facets += 1;
    }
    let factorial: f64 = (1..=D).map(|factor| factor as f64).product();
    HullVolume { volume: sum / factorial, facets }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// The middle of a simplex.
fn set_middle<const D: usize>(set: &WrenchSet, corners: &[u16; CORNERS]) -> [f64; D] {
    let mut middle = [0.0; D];
    for corner in &corners[..=D] {
        let point: [f64; D] = set.point(*corner);
        (0..D).for_each(|axis| middle[axis] += point[axis] / (D as f64 + 1.0));
    }
    middle
}

/// Corners that span much: each the farthest from the flat through those before it. `None` when the set is flat.
fn far_corners<const D: usize>(set: &WrenchSet) -> Option<[u16; CORNERS]> {
    let mut rest: Vec<[f64; D]> = (0..set.len()).map(|index| set.point(index as u16)).collect();
    let mut corners = [0; CORNERS];
    let first = *rest.first()?;
    for point in &mut rest {
        (0..D).for_each(|axis| point[axis] -= first[axis]);
    }
    for corner in &mut corners[1..=D] {
        let size = |point: &[f64; D]| point.iter().map(|value| value * value).sum::<f64>();
        let farthest = (0..rest.len()).fold(0, |best, at| if size(&rest[at]) > size(&rest[best]) { at } else { best });
        let far = rest[farthest];
        let square = size(&far);
        if libm::sqrt(square) <= FLAT * set.scale() {
            return None;
        }
        *corner = farthest as u16;
        for point in &mut rest {
            let along = (0..D).map(|axis| point[axis] * far[axis]).sum::<f64>() / square;
            (0..D).for_each(|axis| point[axis] -= along * far[axis]);
        }
    }
    Some(corners)
}

/// By elimination with partial pivoting.
fn determinant<const D: usize>(mut rows: [[f64; D]; D]) -> f64 {
    let mut product = 1.0;
    for step in 0..D {
        let pivot =
            (step..D).fold(step, |best, row| if rows[row][step].abs() > rows[best][step].abs() { row } else { best });
        rows.swap(step, pivot);
        let own = rows[step];
        if own[step] == 0.0 {
            return 0.0;
        }
        product *= own[step];
        for row in &mut rows[step + 1..] {
            let share = row[step] / own[step];
            (step..D).for_each(|column| row[column] -= share * own[column]);
        }
    }
    product
}
