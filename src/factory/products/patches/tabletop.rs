//! The table under an object, as a camera sees it: exact depth, and colours with the object's shadow.

use nalgebra::{Point3, Unit, Vector3};

use format::PatchTable;
use kernel::{
    geom::{CameraCv, DepthCrop, Intrinsics, Object, Pose, Ray, SimdLevel, TriMesh, TriangleTree, World},
    seed::Stream,
};
use sim::Appearance;

/// Half the side of the square tabletop [m]; its middle is below the object's centre of mass, nothing is behind its
/// edges.
const HALF_SIDE: f64 = 0.6;

/// A tabletop before a camera.
pub(super) struct Tabletop<'a> {
    table: &'a PatchTable,
    camera: &'a Intrinsics,
    table_from_camera: Pose<World, CameraCv>,
}

impl<'a> Tabletop<'a> {
    /// The tabletop of a table, as a camera sees it.
    pub fn new(table: &'a PatchTable, camera: &'a Intrinsics) -> Self {
        Self { table, camera, table_from_camera: table.camera_from_table.inverse() }
    }

    /// Where the ray through the middle of a pixel meets it: depth along the optical axis, and the point [m].
    fn hit(&self, column: u32, row: u32) -> Option<(f64, Point3<f64>)> {
        let sight = self.camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0);
        let depth = self.table.depth_along(&sight.coords).filter(|depth| *depth >= self.camera.near)?;
        let point = self.table_from_camera.point(&Point3::from(sight.coords * depth));
        (point.x.abs().max(point.y.abs()) <= HALF_SIDE).then_some((depth, point))
    }

    /// Puts it behind the depth image of an object; `image` becomes the image of both.
    pub fn put_under(&self, object: &DepthCrop, image: &mut DepthCrop) {
        let Intrinsics { width, height, .. } = *self.camera;
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        (image.left, image.top, image.width, image.height) = (0, 0, width, height);
        image.depth.clear();
        image.depth.extend(pixels.map(|(column, row)| {
            let under = self.hit(column, row).map_or(f32::NAN, |(depth, _)| depth as f32);
            // The lower of two numbers, or the number if the other one is NaN.
            object.at(column, row).min(under)
        }));
        *image = image.trimmed();
    }
}

/// Colours of a tabletop.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TablePaint {
    /// Two colours, shares of full brightness: red, green, blue.
    colours: [[f64; 3]; 2],
    /// Stripes, checks, or none of them.
    pattern: Pattern,
    /// Width of a stripe or a check [m].
    width: f64,
    /// Sine and cosine of the pattern's angle on the table.
    angle: (f64, f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pattern {
    Plain,
    Stripes,
    Checks,
}

impl Default for TablePaint {
    /// Plain, the colour of light wood.
    fn default() -> Self {
        Self { colours: [[0.62, 0.51, 0.39]; 2], pattern: Pattern::Plain, width: 1.0, angle: (0.0, 1.0) }
    }
}

impl TablePaint {
    /// Two colours in a pattern at random.
    pub fn random(stream: &mut Stream) -> Self {
        let mut colour = || [(); 3].map(|()| stream.uniform(0.1, 0.95));
        let colours = [colour(), colour()];
        let pattern = match stream.uniform(0.0, 3.0) {
            kind if kind < 1.0 => Pattern::Plain,
            kind if kind < 2.0 => Pattern::Stripes,
            _ => Pattern::Checks,
        };
        let width = stream.uniform(0.01, 0.12);
        Self { colours, pattern, width, angle: libm::sincos(stream.uniform(0.0, std::f64::consts::PI)) }
    }

    fn at(&self, point: &Point3<f64>) -> [f64; 3] {
        let (sin, cos) = self.angle;
        let across = ((cos * point.x + sin * point.y) / self.width).floor();
        let along = ((cos * point.y - sin * point.x) / self.width).floor();
        let odd = match self.pattern {
            Pattern::Plain => false,
            Pattern::Stripes => across.rem_euclid(2.0) != 0.0,
            Pattern::Checks => (across + along).rem_euclid(2.0) != 0.0,
        };
        self.colours[usize::from(odd)]
    }
}

/// An object that throws a shadow on the table.
pub(super) struct ShadowCaster {
    tree: TriangleTree,
    /// A ball around the object, in `Object` [m].
    middle: Point3<f64>,
    radius: f64,
    level: SimdLevel,
}

impl ShadowCaster {
    /// An object of this mesh.
    pub fn new(mesh: &TriMesh, level: SimdLevel) -> Self {
        let middle = mesh.aabb().map_or_else(Point3::origin, |bounds| bounds.centre());
        let points = mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from)));
        let radius = points.map(|point| (point - middle).norm()).fold(0.0, f64::max);
        Self { tree: TriangleTree::new(mesh), middle, radius, level }
    }

    /// Whether the object is between a point and a light, in `Object`.
    fn blocks(&self, point: &Point3<f64>, to_light: &Unit<Vector3<f64>>) -> bool {
        let to_middle = self.middle - point;
        let along = to_middle.dot(to_light);
        let aside = to_middle.norm_squared() - along * along;
        // What passes by the ball passes by the object.
        aside <= self.radius * self.radius
            && along >= -self.radius
            && self.tree.blocks(self.level, &Ray::new(point, to_light), along + self.radius)
    }
}

/// A tabletop in colours, lit as the object on it is and with its shadow.
pub(super) struct PaintedTabletop<'a> {
    /// The tabletop.
    pub tabletop: Tabletop<'a>,
    /// The table in the object's frame.
    pub object_from_table: Pose<Object, World>,
    /// Lights and the background.
    pub appearance: &'a Appearance,
    /// Colours of the top.
    pub paint: &'a TablePaint,
    /// The object.
    pub shadow: &'a ShadowCaster,
}

impl PaintedTabletop<'_> {
    /// Colour of what is behind the object in a pixel: the tabletop, else the background.
    pub fn colour_at(&self, [column, row]: [u32; 2]) -> [u8; 3] {
        let Some((_, point)) = self.tabletop.hit(column, row) else { return self.appearance.background };
        let normal = self.object_from_table.rotation() * Vector3::z();
        let in_object = self.object_from_table.point(&point);
        let axis = self.tabletop.table_from_camera.rotation() * Vector3::z();
        let mut light = [0, 1, 2].map(|channel| {
            let [ambient, headlight] = [&self.appearance.ambient, &self.appearance.headlight];
            f64::from(ambient[channel]) + f64::from(headlight[channel]) * (-axis.z).max(0.0)
        });
        for lamp in &self.appearance.lights {
            let to_light = -lamp.direction;
            let level = to_light.dot(&normal);
            if level > 0.0 && !self.shadow.blocks(&in_object, &to_light) {
                light.iter_mut().zip(lamp.colour).for_each(|(light, colour)| *light += level * f64::from(colour));
            }
        }
        let paint = self.paint.at(&point);
        std::array::from_fn(|channel| (255.0 * paint[channel] * light[channel]).round().clamp(0.0, 255.0) as u8)
    }
}
