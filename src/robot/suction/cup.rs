//! Measures and strengths of a suction cup.

use std::f64::consts::PI;

use nalgebra::IsometryMatrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::grasp::ToolSolid;
use kernel::geom::Shape;

/// Settings of a suction cup, as a table of a job has them.
///
/// The defaults are those of a bellows cup of 20 mm. Radius and lip are those of SuctionNet-1Billion (a radius of 10 mm, a ring of
/// 2 mm); friction and the accepted stretch those of Dex-Net 3.0 (0.5 and 10 %); 60 kPa is the vacuum at which data sheets of cups
/// give forces. The others are typical of such a cup; its data sheet has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CupSettings {
    /// Radius of the circle along which the lip seals.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub radius: f64,
    /// Width of the lip, half of it on each side of that circle; at most the radius.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub lip_width: f64,
    /// Length of the relaxed cup from its lip to the tube.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub height: f64,
    /// Length by which the bellows can be compressed, at most `height`: limit on the range of the surface's distance along the lip.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub stroke: f64,
    /// Limit on the range of the surface's distance from a plane along the lip: tilted bellows follow a plane, the lip itself
    /// follows the rest.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub lip_flex: f64,
    /// Limit on the stretch of a piece of the lip between two of its 72 points, as a share of its length.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_stretch: f64,
    /// Depth of the room inside of the lip: limit on the height of the surface there over the plane of the lip.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub inner_depth: f64,
    /// Smallest radius of curvature on which the cup seals, convex or concave.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub min_curvature_radius: f64,
    /// Axial stiffness of the bellows. Compressed bellows push the object away by the mean compression times this.
    #[schemars(range(min = 0), extend("x-unit" = "N/m"))]
    pub stiffness: f64,
    /// Pressure below that of the surroundings.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "Pa"))]
    pub vacuum: f64,
    /// Coefficient of friction between lip and object.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub friction: f64,
    /// Limit on the force of the vacuum. Default: none, the force is the vacuum times the area inside of the sealing circle.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "N", "examples" = [15.0]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_force: Option<f64>,
    /// Limit on the moment that tilts the cup. Default: the lip opens where its load, distributed linearly along the circle, falls
    /// to 0, at the normal force times half the radius. Dex-Net 3.0 has pi r times 0.005 N, SuctionNet-1Billion pi r times 15.6 N.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "N m", "examples" = [0.49]))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_moment: Option<f64>,
    /// Radius of the tube behind the cup.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub tube_radius: f64,
    /// Length of the tube behind the cup that must be free of obstacles.
    #[schemars(extend("exclusiveMinimum" = 0, "x-unit" = "m"))]
    pub tube_length: f64,
}

impl Default for CupSettings {
    fn default() -> Self {
        Self {
            radius: 0.01,
            lip_width: 0.002,
            height: 0.02,
            stroke: 0.006,
            lip_flex: 0.002,
            max_stretch: 0.1,
            inner_depth: 0.005,
            min_curvature_radius: 0.02,
            stiffness: 200.0,
            vacuum: 60e3,
            friction: 0.5,
            max_force: None,
            max_moment: None,
            tube_radius: 0.008,
            tube_length: 0.1,
        }
    }
}

/// A setting of a cup outside of its range.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {value}: it must be {range}")]
pub struct InvalidCup {
    /// Name of the setting.
    pub key: &'static str,
    /// Value of the setting.
    pub value: f64,
    /// Allowed values, in words.
    pub range: &'static str,
}

/// A suction cup whose settings are consistent.
///
/// ```
/// use graspmill_robot::suction::{CupSettings, SuctionCup};
///
/// let cup = SuctionCup::new(CupSettings { radius: 0.015, min_curvature_radius: 0.03, ..CupSettings::default() })?;
/// assert!((cup.force(0.0) - 42.4).abs() < 0.1, "60 kPa over a circle of 30 mm");
/// assert!(SuctionCup::new(CupSettings { stroke: 0.03, ..CupSettings::default() }).is_err(), "longer than the cup");
/// # Ok::<(), graspmill_robot::suction::InvalidCup>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuctionCup(CupSettings);

impl SuctionCup {
    /// A cup of these settings.
    ///
    /// # Errors
    /// When a length, a force or a coefficient is not above 0 and finite, the stiffness is below 0, the bellows are compressed by
    /// more than the cup is long, or the lip is wider than the cup's radius.
    pub fn new(settings: CupSettings) -> Result<Self, InvalidCup> {
        let CupSettings { radius, lip_width, height, stroke, stiffness, max_force, max_moment, .. } = settings;
        let above_0 = [
            ("radius", radius),
            ("lip_width", lip_width),
            ("height", height),
            ("stroke", stroke),
            ("lip_flex", settings.lip_flex),
            ("max_stretch", settings.max_stretch),
            ("inner_depth", settings.inner_depth),
            ("min_curvature_radius", settings.min_curvature_radius),
            ("vacuum", settings.vacuum),
            ("friction", settings.friction),
            ("max_force", max_force.unwrap_or(1.0)),
            ("max_moment", max_moment.unwrap_or(1.0)),
            ("tube_radius", settings.tube_radius),
            ("tube_length", settings.tube_length),
        ];
        for (key, value) in above_0 {
            check(value > 0.0 && value.is_finite(), key, value, "above 0")?;
        }
        check(stiffness >= 0.0 && stiffness.is_finite(), "stiffness", stiffness, "at least 0")?;
        check(stroke <= height, "stroke", stroke, "at most the cup's height")?;
        check(lip_width <= radius, "lip_width", lip_width, "at most the cup's radius")?;
        Ok(Self(settings))
    }

    /// The settings.
    pub fn settings(&self) -> &CupSettings {
        &self.0
    }

    /// Outer radius of the lip [m].
    pub fn outer_radius(&self) -> f64 {
        self.0.radius + self.0.lip_width / 2.0
    }

    /// Force with which the cup holds an object along its axis [N] while its bellows are compressed by a mean length [m]: that of
    /// the vacuum less that of the bellows, at least 0.
    pub fn force(&self, compression: f64) -> f64 {
        let CupSettings { radius, vacuum, max_force, stiffness, .. } = self.0;
        let of_vacuum = vacuum * PI * radius * radius;
        (of_vacuum.min(max_force.unwrap_or(f64::INFINITY)) - stiffness * compression).max(0.0)
    }

    /// The cup's solids: the relaxed cup, which may touch the target, and the tube behind it. The origin of the tool's frame is the
    /// middle of the relaxed lip, and the tool approaches along z.
    pub fn solids(&self) -> [ToolSolid; 2] {
        let CupSettings { height, tube_radius, tube_length, .. } = self.0;
        let cylinder = |radius: f64, front: f64, length: f64, is_soft: bool| ToolSolid {
            shape: Shape::Cylinder { radius, half: length / 2.0 },
            tool_from_shape: IsometryMatrix3::translation(0.0, 0.0, -front - length / 2.0),
            is_soft,
        };
        [cylinder(self.outer_radius(), 0.0, height, true), cylinder(tube_radius, height, tube_length, false)]
    }
}

fn check(is_allowed: bool, key: &'static str, value: f64, range: &'static str) -> Result<(), InvalidCup> {
    if is_allowed { Ok(()) } else { Err(InvalidCup { key, value, range }) }
}

/// Moment that an elastic ring resists [N m], pi r k for a radius [m] and a constant of the material [N]: the limit of Dex-Net 3.0
/// (Mahler et al. 2018, k = 0.005 N) and of SuctionNet-1Billion (Cao et al. 2021, k = 15.6 N).
///
/// ```
/// assert!((graspmill_robot::suction::elastic_moment(0.01, 15.6) - 0.490).abs() < 1e-3);
/// ```
pub fn elastic_moment(radius: f64, constant: f64) -> f64 {
    PI * radius * constant
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_named_with_their_values() {
        let default = CupSettings::default();
        assert!(SuctionCup::new(default).is_ok());
        for (settings, key) in [
            (CupSettings { radius: 0.0, ..default }, "radius"),
            (CupSettings { vacuum: f64::INFINITY, ..default }, "vacuum"),
            (CupSettings { max_moment: Some(-1.0), ..default }, "max_moment"),
            (CupSettings { stiffness: -1.0, ..default }, "stiffness"),
            (CupSettings { stroke: 0.021, ..default }, "stroke"),
            (CupSettings { lip_width: 0.011, ..default }, "lip_width"),
        ] {
            assert_eq!(SuctionCup::new(settings).expect_err("a mistake").key, key);
        }
    }

    /// Forces of a vacuum of 60 kPa by hand, as tables of cups give them.
    #[test]
    fn forces_are_pressure_times_area() {
        for (radius, force) in [(0.005, 4.71), (0.01, 18.85), (0.02, 75.4), (0.03, 169.6)] {
            let cup = SuctionCup::new(CupSettings { radius, ..CupSettings::default() }).expect("a cup");
            assert!((cup.force(0.0) / force - 1.0).abs() < 1e-3);
            // 200 N/m over 2 mm.
            assert!((cup.force(0.0) - cup.force(0.002) - 0.4).abs() < 1e-12);
            assert_eq!(cup.force(1.0), 0.0);
        }
        let weak = SuctionCup::new(CupSettings { max_force: Some(3.0), ..CupSettings::default() }).expect("a cup");
        assert_eq!(weak.force(0.0), 3.0);
    }
}
