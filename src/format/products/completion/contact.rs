//! One contact of something with an object, and what is in the way of one.

/// One point where something touched the object, in `CameraCv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchContact {
    /// Which probe, counted from 0: of random rays the ray, of a hand its approach.
    pub probe: u32,
    /// Position [m].
    pub position: [f32; 3],
    /// Outward unit normal of the surface there.
    pub normal: [f32; 3],
    /// Distance of the contact from the start of the probe [m]; of a hand, until its first touch.
    pub distance: f32,
    /// Whether nothing stands between the contact and the camera: nothing of the object, of a body in clutter nothing of its scene.
    pub visible: bool,
    /// The cell of the pair's grid; `None` outside the grid.
    pub cell: Option<[u32; 3]>,
}

/// A probe that something else stopped than the object, in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockedProbe {
    /// Which probe, counted from 0.
    pub probe: u32,
    /// Number of the thing in its way, as in images of the scene: a body from 1, [the container](crate::SceneImage::CONTAINER) or
    /// [the table](crate::SceneImage::TABLE).
    pub by: u8,
    /// Where it was stopped, in `CameraCv` [m].
    pub position: [f32; 3],
}
