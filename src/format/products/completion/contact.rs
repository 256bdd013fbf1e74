//! One contact of something with an object.

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
    /// Whether nothing of the object stands between the contact and the camera.
    pub visible: bool,
    /// The cell of the pair's grid; `None` outside the grid.
    pub cell: Option<[u32; 3]>,
}
