//! Frames as types: a pose says which frame it maps to and from, so that only poses that fit compose.
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
    /// The prepared mesh's own frame [m].
    Object = "object";
    /// Camera, computer-vision axes: x right, y down, +z away from the camera [m].
    CameraCv = "camera_cv";
    /// Camera, OpenGL and MuJoCo axes: x right, y up, the camera looks along -z [m].
    CameraGl = "camera_gl";
    /// The frame of a robot that is brought to a pose: the target site of a planning group [m].
    EndEffector = "end_effector";
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

    /// From a rigid motion of which the caller says the frames.
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

    /// The inverse of [`Pose::to_rows`]; the rows are taken as they stand.
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
