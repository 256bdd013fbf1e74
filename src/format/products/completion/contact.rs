//! Contacts with an object, and probes that an obstacle stopped.

/// One point where something touched the object, in `CameraCv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchContact {
    /// Index of the probe: a ray, or an approach of a hand.
    pub probe: u32,
    /// Position [m].
    pub position: [f32; 3],
    /// Outward unit normal of the surface there.
    pub normal: [f32; 3],
    /// Distance of the contact from the start of the probe [m]; for a hand, until its first touch.
    pub distance: f32,
    /// Whether nothing is between the contact and the camera: no part of the object, or in clutter no part of the scene.
    pub visible: bool,
    /// The cell of the pair's grid; `None` outside the grid.
    pub cell: Option<[u32; 3]>,
}

/// A probe that an obstacle stopped, in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockedProbe {
    /// Index of the probe.
    pub probe: u32,
    /// Number of the obstacle, as in images of the scene: a body from 1, [the container](crate::SceneImage::CONTAINER) or
    /// [the table](crate::SceneImage::TABLE).
    pub by: u8,
    /// Where it was stopped, in `CameraCv` [m].
    pub position: [f32; 3],
}
