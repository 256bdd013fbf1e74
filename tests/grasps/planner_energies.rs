//! Energies of the planner against NumPy.

use std::f64::consts::PI;

use graspmill::{
    contact::ContactSurface,
    geom::Intrinsics,
    hand::Hand,
    runtime::planner::energy::{
        Alignment, ContactEnergy, ContactForm, EnergyForm, HandContact, HandShape, HeatmapEnergy, HeatmapSettings,
        Heatmaps, MAX_ENERGY, Visibility, combined_energy, grasp_energy,
    },
    seed::Stream,
    voxel::InsideTest,
};
use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Vector3};

use crate::support::{
    meshes::built_in_mesh,
    program::Program,
    robots::{BARRETT, open_hand},
    workspace::Workspace,
};

const STATES: usize = 1000;

/// Canonical types, and values of a map.
const TYPES: usize = 8;
const SIZE: [usize; 2] = [52, 72];

/// A state, and what the energies need to know of it.
struct State {
    contacts: Vec<HandContact>,
    camera: Point3<f64>,
    shape: HandShape,
    points: [Point3<f64>; 4],
    /// Potential, contact energy and reachability distance.
    rated: [f64; 3],
}

fn direction(stream: &mut Stream) -> Vector3<f64> {
    Vector3::from_fn(|_, _| stream.normal()).normalize()
}

fn shape(stream: &mut Stream) -> HandShape {
    let flexions = [(); 3].map(|()| stream.uniform(0.0, 2.44));
    HandShape { spread: stream.uniform(0.0, PI), flexions, roll: stream.uniform(-PI, PI) }
}

impl State {
    /// The Barrett hand anywhere around a mug, a camera on any side, and a shape near or far from every type.
    fn draw(hand: &Hand, surface: &ContactSurface, types: &[HandShape], stream: &mut Stream) -> Self {
        let rotation =
            Rotation3::from_axis_angle(&nalgebra::Unit::new_unchecked(direction(stream)), stream.uniform(0.0, PI));
        let shift = direction(stream) * stream.uniform(0.0, 0.2);
        let object_from_base = IsometryMatrix3::from_parts(Translation3::from(shift), rotation);
        let posture: Vec<f64> =
            hand.driven().iter().map(|driven| stream.uniform(driven.range()[0], driven.range()[1])).collect();
        let near = &types[stream.below(TYPES as u64) as usize];
        let shape = if stream.unit() < 0.3 {
            shape(stream)
        } else {
            HandShape {
                spread: near.spread + stream.uniform(-0.8, 0.8),
                roll: near.roll + stream.uniform(-1.0, 1.0),
                ..*near
            }
        };
        let distance = match stream.unit() {
            share if share < 0.05 => f64::NAN,
            share if share < 0.1 => 0.0,
            _ => stream.uniform(-3.0, 3.0),
        };
        Self {
            contacts: HandContact::all(hand, surface, &object_from_base, &hand.posture_values(&posture)),
            camera: Point3::from(direction(stream) * stream.uniform(0.3, 2.0)),
            shape,
            points: [(); 4]
                .map(|()| Point3::new(stream.uniform(-0.5, 0.5), stream.uniform(-0.4, 0.4), stream.uniform(-0.1, 1.2))),
            rated: [stream.uniform(-1.2, 0.6), stream.uniform(0.0, 80.0), distance],
        }
    }

    /// 247 numbers, as `planner_energies.py` reads them.
    fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        for contact in &self.contacts {
            for part in [&contact.point.coords, &contact.normal, &contact.closest.coords, &contact.outward] {
                numbers.extend(part.iter());
            }
            numbers.extend([contact.is_inside, contact.is_on_palm].map(|flag| f64::from(u8::from(flag))));
        }
        numbers.extend(self.camera.iter());
        numbers.extend(of_shape(&self.shape));
        numbers.extend(self.points.iter().flat_map(|point| point.coords.iter().copied().collect::<Vec<_>>()));
        numbers.extend(self.rated);
        numbers
    }

    /// Energies in the order of `planner_energies.py`.
    fn energies(&self, heatmap: &HeatmapEnergy) -> Vec<f64> {
        let mut energies = Vec::new();
        for gamma in [50.0, 500.0] {
            for visible in [Visibility::Off, Visibility::Palm, Visibility::Facing] {
                for form in [ContactForm::Standard, ContactForm::Thesis] {
                    for alignment in [Alignment::Offset, Alignment::PrintedNormal] {
                        let energy = ContactEnergy { gamma, visible, form, alignment };
                        energies.push(energy.of(&self.contacts, &self.camera));
                    }
                }
            }
        }
        let found = heatmap.of(&self.shape, &self.points);
        let kind = found.nearest.expect("a shape of numbers") as f64;
        let combined = combined_energy(0.1, found.energy, energies[0]);
        energies.extend([found.energy, kind, f64::from(found.without_value), combined]);
        let [potential, contact, distance] = self.rated;
        let forms = [EnergyForm::Standard, EnergyForm::Corrected, EnergyForm::Printed { reach_max: 10.55 }];
        energies.extend(forms.map(|form| grasp_energy(form, potential, contact, distance)));
        energies
    }
}

fn of_shape(shape: &HandShape) -> [f64; 5] {
    let [a, b, c] = shape.flexions;
    [shape.spread, a, b, c, shape.roll]
}

#[test]
fn numpy_finds_the_same_energies_of_a_thousand_states() {
    let model = open_hand(BARRETT);
    let surface = ContactSurface::new(&built_in_mesh("mug-01@16k"), InsideTest::Crossings).expect("a surface");
    let mut stream = Stream::of_job(1, b"", "states of planners");
    let types: Vec<HandShape> = (0..TYPES).map(|_| shape(&mut stream)).collect();
    let maps: Vec<f32> = (0..4 * TYPES * SIZE[0] * SIZE[1]).map(|_| stream.uniform(-0.3, 0.1) as f32).collect();
    let states: Vec<State> = (0..STATES).map(|_| State::draw(model.hand(), &surface, &types, &mut stream)).collect();
    let folder = Workspace::new();
    let bytes = |numbers: &[f64]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
    let files = [
        folder.write("states", states.iter().flat_map(|state| bytes(&state.numbers())).collect::<Vec<u8>>()),
        folder.write("types", types.iter().flat_map(|shape| bytes(&of_shape(shape))).collect::<Vec<u8>>()),
        folder.write("maps", maps.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>()),
    ];
    let heatmap = HeatmapEnergy {
        maps: Heatmaps::new(TYPES, SIZE, maps).expect("values"),
        camera: Intrinsics::from_horizontal_fov(640, 480, 1.047, 0.05).expect("a camera"),
        settings: HeatmapSettings::STANDARD,
        types,
    };
    let answers = Program::python().arg("tests/peers/planner_energies.py").args(&files).succeed().stdout;
    assert_eq!(answers.lines().count(), STATES);
    let (mut worst, mut largest, mut missing, mut refused) = (0.0f64, 0, 0, 0);
    for (state, line) in states.iter().zip(answers.lines()) {
        let expected: Vec<f64> = line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
        let found = state.energies(&heatmap);
        assert_eq!(found.len(), expected.len());
        for (index, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let off = if found == expected { 0.0 } else { (found - expected).abs() };
            assert!(off < 1e-9, "energy {index}: {found} {expected}");
            worst = worst.max(off);
        }
        largest += found.iter().filter(|energy| **energy == MAX_ENERGY).count();
        missing += usize::from(found[26] > 0.0);
        refused += usize::from(found[28] == f64::INFINITY);
    }
    println!(
        "apart at most {worst:e}; {largest} largest energies, {missing} states with points in the border, {refused} refused"
    );
    assert!(largest > 100 && missing > 100 && refused > 20, "{largest} {missing} {refused}");
}
