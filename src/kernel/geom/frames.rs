//! Frames as types: a pose states which frame it maps to and from, so that only matching poses compose.
//!
//! ```text
//! point_in_camera = camera_from_world * (world_from_object * point_in_object)
//! ```

use std::{fmt, marker::PhantomData, ops::Mul};

use nalgebra::{IsometryMatrix3, Matrix3, Point3, Rotation3, Translation3, Vector3};

/// A coordinate frame; implemented by marker types only.
pub trait Frame: Copy + fmt::Debug + 'static {
    /// The name used in messages and records.
    const NAME: &'static str;
}

macro_rules! frames {
    ($($(#[$doc:meta])* $name:ident = $text:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name;

        impl Frame for $name {
            const NAME: &'static str = $text;
        }
    )*};
}

frames! {
    /// The room: z up [m].
    World = "world";
    /// The world of the files of an imported scene, chosen by its makers [m].
    SourceWorld = "source_world";
    /// The prepared mesh's own frame [m].
    Object = "object";
    /// Camera, computer-vision axes: x right, y down, +z away from the camera [m].
    CameraCv = "camera_cv";
    /// Camera, OpenGL and MuJoCo axes: x right, y up, the camera points along -z [m].
    CameraGl = "camera_gl";
    /// The frame of a robot that is brought to a pose: the target site of a planning group [m].
    EndEffector = "end_effector";
    /// A fused volume: the origin is the corner of its cube from which its voxels are counted, the axes run along its edges [m].
    Volume = "volume";
    /// A hand's base: the frame of its description [m].
    HandBase = "hand_base";
    /// Pose from which a hand grasps: the origin on its palm, +z out of the palm towards the object [m].
    Approach = "approach";
}

/// A rigid motion that maps coordinates in `From` to coordinates in `To`; translation in metres.
#[derive(Clone, Copy, PartialEq)]
pub struct Pose<To: Frame, From: Frame> {
    isometry: IsometryMatrix3<f64>,
    frames: PhantomData<(To, From)>,
}

impl<To: Frame, From: Frame> Pose<To, From> {
    /// From a rotation and a translation (the origin of `From`, seen in `To` [m]).
    pub fn new(rotation: Rotation3<f64>, translation: Vector3<f64>) -> Self {
        Self::from_isometry(IsometryMatrix3::from_parts(Translation3::from(translation), rotation))
    }

    /// From a rigid motion whose frames the caller states.
    pub fn from_isometry(isometry: IsometryMatrix3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }

    /// The pose that changes no coordinate.
    pub fn identity() -> Self {
        Self::new(Rotation3::identity(), Vector3::zeros())
    }

    /// The rigid motion without its frames.
    pub fn isometry(&self) -> &IsometryMatrix3<f64> {
        &self.isometry
    }

    /// The rotation part.
    pub fn rotation(&self) -> &Rotation3<f64> {
        &self.isometry.rotation
    }

    /// The translation part [m].
    pub fn translation(&self) -> &Vector3<f64> {
        &self.isometry.translation.vector
    }

    /// From a translation x, y, z [m] and angles roll, pitch, yaw [rad] of [`rotation_from_rpy`].
    pub fn from_xyz_rpy([x, y, z, roll, pitch, yaw]: [f64; 6]) -> Self {
        Self::new(rotation_from_rpy(roll, pitch, yaw), Vector3::new(x, y, z))
    }

    /// Translation x, y, z [m] and angles [rad]: roll and yaw in -pi..=pi, pitch in -pi/2..=pi/2.
    ///
    /// Two triples of angles mean each rotation, (roll, pitch, yaw) and (roll + pi, pi - pitch, yaw + pi); this is that of
    /// the smaller pitch. At a pitch of 90 deg, where only their difference counts, roll is 0.
    pub fn xyz_rpy(&self) -> [f64; 6] {
        let (m, t) = (self.isometry.rotation.matrix(), self.translation());
        let level = libm::hypot(m[(0, 0)], m[(1, 0)]);
        let pitch = libm::atan2(-m[(2, 0)], level);
        // Beyond this, the rest of roll and yaw is rounding.
        let [roll, yaw] = if level > 1e-9 {
            [libm::atan2(m[(2, 1)], m[(2, 2)]), libm::atan2(m[(1, 0)], m[(0, 0)])]
        } else {
            [0.0, libm::atan2(-m[(0, 1)], m[(1, 1)])]
        };
        [t.x, t.y, t.z, roll, pitch, yaw]
    }

    /// The map from `To` back to `From`.
    pub fn inverse(&self) -> Pose<From, To> {
        Pose::from_isometry(self.isometry.inverse())
    }

    /// Coordinates in `To` of a point given in `From` [m].
    pub fn point(&self, point: &Point3<f64>) -> Point3<f64> {
        self.isometry * point
    }

    /// The top three rows of the 4x4 matrix, row-major: (3, 4), last column the translation [m].
    pub fn to_rows(&self) -> [f64; 12] {
        let (r, t) = (self.isometry.rotation.matrix(), self.translation());
        std::array::from_fn(|i| if i % 4 == 3 { t[i / 4] } else { r[(i / 4, i % 4)] })
    }

    /// The inverse of [`Pose::to_rows`]; uses the rows unchanged.
    pub fn from_rows(rows: &[f64; 12]) -> Self {
        let rotation = Matrix3::from_fn(|row, column| rows[4 * row + column]);
        Self::new(Rotation3::from_matrix_unchecked(rotation), Vector3::new(rows[3], rows[7], rows[11]))
    }
}

impl<A: Frame, B: Frame, C: Frame> Mul<Pose<B, C>> for Pose<A, B> {
    type Output = Pose<A, C>;

    fn mul(self, right: Pose<B, C>) -> Pose<A, C> {
        Pose::from_isometry(self.isometry * right.isometry)
    }
}

impl Pose<CameraCv, CameraGl> {
    /// The one home of the change of camera axes: y and z change sign.
    pub fn cv_from_gl() -> Self {
        Self::new(
            Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))),
            Vector3::zeros(),
        )
    }
}

impl<To: Frame, From: Frame> fmt::Debug for Pose<To, From> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}_from_{} {:?}", To::NAME, From::NAME, self.to_rows())
    }
}

/// R = Rz(yaw) Ry(pitch) Rx(roll), angles in radians; `libm`, so the same bits everywhere.
pub fn rotation_from_rpy(roll: f64, pitch: f64, yaw: f64) -> Rotation3<f64> {
    let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(roll), libm::sincos(pitch), libm::sincos(yaw));
    Rotation3::from_matrix_unchecked(Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    ))
}

/// Axes whose z is `direction`, a unit vector, rolled about it [rad].
pub fn rotation_towards(direction: &Vector3<f64>, roll: f64) -> Matrix3<f64> {
    let aside = if direction.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let x = direction.cross(&aside).normalize();
    let (sin, cos) = libm::sincos(roll);
    let x = x * cos + direction.cross(&x) * sin;
    Matrix3::from_columns(&[x, direction.cross(&x), *direction])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn angles_come_back_as_the_same_rotation() {
        for roll in [-PI, -2.0, -0.3, 0.0, 1.2, PI, 4.0] {
            for pitch in [-PI, -2.0, -FRAC_PI_2, -0.4, 0.0, 0.9, FRAC_PI_2, 2.5, PI] {
                for yaw in [-PI, -1.0, 0.0, 0.2, 3.0, PI] {
                    let pose = Pose::<World, EndEffector>::from_xyz_rpy([0.1, -0.2, 0.3, roll, pitch, yaw]);
                    let [x, y, z, r, p, w] = pose.xyz_rpy();
                    assert_eq!([x, y, z], [0.1, -0.2, 0.3]);
                    assert!(r.abs() <= PI && w.abs() <= PI && p.abs() <= FRAC_PI_2);
                    let again = rotation_from_rpy(r, p, w);
                    let apart = (again.matrix() - pose.rotation().matrix()).amax();
                    assert!(apart < 1e-12, "{roll} {pitch} {yaw}: {r} {p} {w}, {apart:e} apart");
                }
            }
        }
    }
}
