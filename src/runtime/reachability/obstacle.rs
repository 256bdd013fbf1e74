//! Obstacles, the end effector as balls, and whether the two overlap.

use nalgebra::{Isometry3, Point3, Vector3};

use kernel::geom::{
    Aabb, Axis, AxisGrid, AxisUnit, EndEffector, MeshQuery, NoSurface, Object, OccupancyGrid, Pose, TriMesh, World,
    signed_distance_standard,
};

/// A ball in the end effector's frame [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre [m].
    pub centre: Point3<f64>,
    /// Radius [m].
    pub radius: f64,
}

/// Volume of the end effector that must not touch an obstacle: balls that cover it, in the end effector's frame.
///
/// The cover is slightly larger than the volume, so poses that pass by closely may count as blocked, but no touching pose counts
/// as free.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EndEffectorVolume {
    balls: Vec<Ball>,
}

impl EndEffectorVolume {
    /// Creates a volume from balls.
    pub fn new(balls: Vec<Ball>) -> Self {
        Self { balls }
    }

    /// Adds a box around `pose` with these half sides [m], divided into pieces with sides up to `piece` [m] and a ball around
    /// each.
    #[must_use]
    pub fn with_box(mut self, pose: &Pose<EndEffector, Object>, half: [f64; 3], piece: f64) -> Self {
        let counts = half.map(|half| (2.0 * half / piece).ceil().max(1.0) as usize);
        let side: [f64; 3] = std::array::from_fn(|k| 2.0 * half[k] / counts[k] as f64);
        let radius = 0.5 * Vector3::from(side).norm();
        for index in 0..counts.iter().product() {
            let indices = [index / counts[2] / counts[1], index / counts[2] % counts[1], index % counts[2]];
            let centre: [f64; 3] = std::array::from_fn(|k| (indices[k] as f64 + 0.5) * side[k] - half[k]);
            self.balls.push(Ball { centre: pose.point(&Point3::from(centre)), radius });
        }
        self
    }

    /// Adds all points within `radius` of a segment [m]: slightly larger balls, half a radius apart.
    #[must_use]
    pub fn with_capsule(mut self, ends: [Point3<f64>; 2], radius: f64) -> Self {
        let along = ends[1] - ends[0];
        let pieces = (along.norm() / (0.5 * radius)).ceil().max(1.0);
        let radius = libm::hypot(0.5 * along.norm() / pieces, radius);
        for piece in 0..=pieces as usize {
            self.balls.push(Ball { centre: ends[0] + along * (piece as f64 / pieces), radius });
        }
        self
    }

    /// The balls.
    pub fn balls(&self) -> &[Ball] {
        &self.balls
    }
}

/// An object in the world that the end effector must not touch. `World` is the frame of the field's poses.
pub struct Obstacle {
    kind: Kind,
    shape_from_world: Isometry3<f64>,
    /// Box around it in the world.
    bounds: Aabb,
}

enum Kind {
    Box([f64; 3]),
    Mesh(Box<MeshQuery>),
    Occupancy(Occupied),
}

/// Reason why an [`Obstacle`] cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidObstacle {
    /// A length is negative, infinite or not a number, or a pose is not finite.
    #[error("{what} = {value} must be finite and not negative")]
    Length {
        /// Name of the length.
        what: &'static str,
        /// Given value.
        value: f64,
    },
    /// A mesh without triangles.
    #[error(transparent)]
    NoSurface(#[from] NoSurface),
    /// The obstacle is empty.
    #[error("no occupied cell or no point; omit the obstacle")]
    Empty,
}

impl Obstacle {
    /// Creates a box around `pose` with these half sides [m].
    ///
    /// # Errors
    /// A length that is not finite or negative.
    pub fn cuboid(pose: &Pose<World, Object>, half: [f64; 3]) -> Result<Self, InvalidObstacle> {
        for value in half {
            length("half a side of a box", value)?;
        }
        Self::new(Kind::Box(half), pose, Aabb { min: Point3::from(half.map(|half| -half)), max: Point3::from(half) })
    }

    /// Creates the axis-aligned box of these points in the world, as the thesis does for a mesh.
    ///
    /// # Errors
    /// No point, or one that is not finite.
    pub fn box_of(points: &[Point3<f64>]) -> Result<Self, InvalidObstacle> {
        let first = *points.first().ok_or(InvalidObstacle::Empty)?;
        let (min, max) = points.iter().fold((first, first), |(min, max), point| (min.inf(point), max.sup(point)));
        let half = (max - min) / 2.0;
        Self::cuboid(&Pose::new(nalgebra::Rotation3::identity(), min.coords + half), half.into())
    }

    /// Creates an obstacle from the surface of a triangle mesh. A ball that is wholly inside a closed mesh does not touch it.
    ///
    /// # Errors
    /// A mesh without triangles, or a pose that is not finite.
    pub fn mesh(pose: &Pose<World, Object>, mesh: &TriMesh) -> Result<Self, InvalidObstacle> {
        let query = MeshQuery::new(mesh)?;
        Self::new(Kind::Mesh(query.into()), pose, mesh.aabb().ok_or(InvalidObstacle::Empty)?)
    }

    /// Creates an obstacle from the occupied cells of a grid with cubic cells of side `cell` [m]. The lower corner of cell (0, 0,
    /// 0) is the origin of the grid's frame.
    ///
    /// # Errors
    /// No occupied cell, or a side that is not above zero.
    pub fn occupancy(pose: &Pose<World, Object>, grid: &OccupancyGrid, cell: f64) -> Result<Self, InvalidObstacle> {
        length("the side of a cell", cell)?;
        let occupied = Occupied::new(grid, cell).ok_or(InvalidObstacle::Empty)?;
        let bounds = occupied.bounds();
        Self::new(Kind::Occupancy(occupied), pose, bounds)
    }

    fn new(kind: Kind, pose: &Pose<World, Object>, local: Aabb) -> Result<Self, InvalidObstacle> {
        for value in pose.to_rows() {
            length("a number of the pose", value.abs())?;
        }
        let half = (local.max - local.min) / 2.0;
        let (centre, reach) = (pose.point(&local.centre()), pose.rotation().matrix().abs() * half);
        let isometry = pose.isometry().inverse();
        let shape_from_world = Isometry3::from_parts(isometry.translation, isometry.rotation.into());
        Ok(Self { kind, shape_from_world, bounds: Aabb { min: centre - reach, max: centre + reach } })
    }

    /// A box around it, in the world [m].
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Whether a ball in the world overlaps or touches it.
    pub fn touches(&self, centre: &Point3<f64>, radius: f64) -> bool {
        let local = self.shape_from_world * centre;
        match &self.kind {
            Kind::Box(half) => {
                let gaps: [f64; 3] = std::array::from_fn(|k| (local[k].abs() - half[k]).max(0.0));
                gaps.iter().map(|gap| gap * gap).sum::<f64>() <= radius * radius
            }
            Kind::Mesh(query) => query.distance(&local) <= radius,
            Kind::Occupancy(occupied) => occupied.touches(&local, radius),
        }
    }
}

fn length(what: &'static str, value: f64) -> Result<(), InvalidObstacle> {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { Err(InvalidObstacle::Length { what, value }) }
}

/// Occupied cells, and the distance of each cell's centre from them.
struct Occupied {
    grid: OccupancyGrid,
    cell: f64,
    /// Distance [m] from the centre of each cell to the nearest occupied cell's box, negative inside.
    clearance: Vec<f32>,
    low: [u32; 3],
    high: [u32; 3],
}

impl Occupied {
    fn new(grid: &OccupancyGrid, cell: f64) -> Option<Self> {
        let n = grid.resolution();
        let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
        let mut inside = vec![false; (n as usize).pow(3)];
        for cell in grid.cells() {
            low = std::array::from_fn(|k| low[k].min(cell[k]));
            high = std::array::from_fn(|k| high[k].max(cell[k]));
            inside[((cell[0] * n + cell[1]) * n + cell[2]) as usize] = true;
        }
        // A grid of poses whose positions alone differ has the same distances.
        let axis = |k: usize| {
            let (unit, count) = if k < 3 { (AxisUnit::Metre, n as usize) } else { (AxisUnit::Radian, 1) };
            Axis {
                name: ["x", "y", "z", "roll", "pitch", "yaw"][k],
                unit,
                first: 0.5 * cell,
                step: cell,
                count,
                periodic: false,
            }
        };
        let poses = AxisGrid::new(std::array::from_fn(axis)).ok()?;
        let clearance = signed_distance_standard(&inside, &poses, 1.0);
        (low[0] <= high[0]).then(|| Self { grid: grid.clone(), cell, clearance, low, high })
    }

    fn bounds(&self) -> Aabb {
        let corner = |cell: [u32; 3], by: f64| Point3::from(cell.map(|index| (f64::from(index) + by) * self.cell));
        Aabb { min: corner(self.low, 0.0), max: corner(self.high, 1.0) }
    }

    fn touches(&self, centre: &Point3<f64>, radius: f64) -> bool {
        let n = self.grid.resolution();
        let index_of = |coordinate: f64| ((coordinate / self.cell).max(0.0) as u32).min(n - 1);
        let nearest: [u32; 3] = std::array::from_fn(|k| index_of(centre[k]));
        let middle = Point3::from(nearest.map(|index| (f64::from(index) + 0.5) * self.cell));
        // From the middle of a cell to the centre the clearance changes by no more than their distance.
        let clearance = f64::from(self.clearance[((nearest[0] * n + nearest[1]) * n + nearest[2]) as usize]);
        let away = (centre - middle).norm() + 1e-6 * (self.cell + clearance.abs());
        if clearance.max(0.0) - away > radius {
            return false;
        }
        if clearance.max(0.0) + away <= radius {
            return true;
        }
        let (from, to) = (centre.map(|value| value - radius), centre.map(|value| value + radius));
        let range = |k: usize| index_of(from[k])..=index_of(to[k]);
        range(0).any(|x| {
            range(1).any(|y| range(2).any(|z| self.grid.get([x, y, z]) && self.cell_within([x, y, z], centre, radius)))
        })
    }

    fn cell_within(&self, cell: [u32; 3], centre: &Point3<f64>, radius: f64) -> bool {
        let gaps: [f64; 3] = std::array::from_fn(|k| {
            let low = f64::from(cell[k]) * self.cell;
            (low - centre[k]).max(centre[k] - (low + self.cell)).max(0.0)
        });
        gaps.iter().map(|gap| gap * gap).sum::<f64>() <= radius * radius
    }
}
