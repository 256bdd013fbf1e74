//! Depth and colours by MuJoCo's OpenGL renderer, headless.

use std::sync::Arc;

use mujoco_rs::{
    mujoco_c::mjtRndFlag,
    wrappers::{
        mj_data::MjData,
        mj_model::MjModel,
        mj_rendering::{MjrContext, MjrRectangle},
        mj_visualization::{MjvCamera, MjvOption, MjvPerturb, MjvScene},
    },
};

use crate::{
    error::GlError,
    ffi::{self, GlContext},
    render::model::{PixelBox, SimModel},
};
use kernel::geom::Intrinsics;

/// Far plane of depth, and of colours without shadows [m]. With reversed z the depth's precision hardly depends on it.
const FAR: f64 = 100.0;
/// Samples along each side of a pixel in colour.
const SAMPLES: u32 = 2;
/// Room in a scene for geoms that are not the model's.
const SPARE_GEOMS: usize = 3;

/// A GL context and MuJoCo's objects in it for one model. Fields are dropped in this order: GL objects first.
pub(crate) struct GlView {
    uploaded: Option<Uploaded>,
    raw: Vec<f32>,
    colours: Vec<u8>,
    gl: GlContext,
}

struct Uploaded {
    context: MjrContext,
    scene: MjvScene,
    /// Size of the off-screen buffer [px].
    size: [u32; 2],
}

impl GlView {
    pub(crate) fn new() -> Result<Self, GlError> {
        Ok(Self { uploaded: None, raw: Vec::new(), colours: Vec::new(), gl: GlContext::new()? })
    }

    /// Keeps the GL context, frees the objects of the model.
    pub(crate) fn without_model(mut self) -> Self {
        self.forget_model();
        self
    }

    fn forget_model(&mut self) {
        // MuJoCo's GL objects must go while their context is current; if it cannot be, they go with the context.
        match self.gl.make_current() {
            Ok(()) => self.uploaded = None,
            Err(_) => std::mem::forget(self.uploaded.take()),
        }
    }

    pub(crate) fn renderer(&self) -> String {
        format!("{}, OpenGL {}", self.gl.renderer, self.gl.version)
    }

    /// Draws the box and writes depth along the axis [m], NaN = no return, row-major from the top.
    pub(crate) fn draw(
        &mut self,
        model: &SimModel,
        data: &mut MjData<Arc<MjModel>>,
        camera: &Intrinsics,
        pixels: &PixelBox,
        depth: &mut [f32],
    ) -> Result<(), GlError> {
        let (width, height) = (pixels.width(), pixels.height());
        let Uploaded { context, scene, .. } = self.prepare(model, data, camera, (pixels, FAR), 1)?;
        // Flat colours only: no light, shadow, texture or sky is computed. Both sides of a face are drawn.
        set_flags(scene, &[mjtRndFlag::mjRND_SEGMENT, mjtRndFlag::mjRND_IDCOLOR]);
        let viewport = MjrRectangle::new(0, 0, width as i32, height as i32);
        scene.render(&viewport, context);
        let Self { uploaded, raw, .. } = self;
        raw.resize(depth.len(), 0.0);
        uploaded.as_ref().map_or(Ok(()), |uploaded| read(&uploaded.context, None, raw, &viewport))?;
        convert(raw, width as usize, camera.near, depth);
        Ok(())
    }

    /// Draws a part of the image and writes its colours, row-major from the top: with shadows where there is a far plane for them
    /// [m]. `lit` lights and paints the scene, and `behind` gives the colours where nothing is.
    #[expect(clippy::too_many_arguments, reason = "what draw takes, and what colours need besides")]
    pub(crate) fn draw_colours(
        &mut self,
        model: &SimModel,
        data: &mut MjData<Arc<MjModel>>,
        camera: &Intrinsics,
        (pixels, shadows_to): (&PixelBox, Option<f64>),
        lit: impl FnOnce(&mut MjvScene),
        behind: &dyn Fn(u32, u32) -> [u8; 3],
        rgb: &mut [[u8; 3]],
    ) -> Result<(), GlError> {
        let (width, height) = (SAMPLES * pixels.width(), SAMPLES * pixels.height());
        let far = shadows_to.unwrap_or(FAR);
        let Uploaded { context, scene, .. } = self.prepare(model, data, camera, (pixels, far), SAMPLES)?;
        // No sky, and shadows if requested.
        set_flags(scene, if shadows_to.is_some() { &[mjtRndFlag::mjRND_SHADOW] } else { &[] });
        lit(scene);
        let viewport = MjrRectangle::new(0, 0, width as i32, height as i32);
        scene.render(&viewport, context);
        let Self { uploaded, raw, colours, .. } = self;
        let samples = width as usize * height as usize;
        raw.resize(samples, 0.0);
        colours.resize(3 * samples, 0);
        uploaded.as_ref().map_or(Ok(()), |uploaded| read(&uploaded.context, Some(colours), raw, &viewport))?;
        for (index, (sample, depth)) in (0..).zip(colours.as_chunks_mut::<3>().0.iter_mut().zip(raw.iter())) {
            if *depth == 0.0 {
                // The bottom row comes first.
                let (column, row) = (index % width / SAMPLES, index / width / SAMPLES);
                *sample = behind(pixels.left + column, pixels.bottom - 1 - row);
            }
        }
        shrink(colours.as_chunks::<3>().0, width as usize, rgb);
        Ok(())
    }

    /// The scene of a model, its camera aimed at the box with a far plane [m], and room for `samples` samples along
    /// each side of a pixel.
    fn prepare(
        &mut self,
        model: &SimModel,
        data: &mut MjData<Arc<MjModel>>,
        camera: &Intrinsics,
        (pixels, far): (&PixelBox, f64),
        samples: u32,
    ) -> Result<&mut Uploaded, GlError> {
        let (width, height) = (samples * pixels.width(), samples * pixels.height());
        if width.max(height) > self.gl.largest {
            return Err(GlError::TooLarge { width, height, limit: self.gl.largest });
        }
        self.gl.make_current()?;
        let uploaded = match self.uploaded.take() {
            Some(uploaded) => self.uploaded.insert(uploaded),
            None => self.uploaded.insert(Uploaded::new(&self.gl, &model.model)?),
        };
        uploaded.make_room(width, height);
        let mut viewer = MjvCamera::new_fixed(model.camera);
        uploaded.scene.update(data, &MjvOption::default(), &MjvPerturb::default(), &mut viewer);
        aim(&mut uploaded.scene, camera, pixels, far);
        Ok(uploaded)
    }
}

impl Drop for GlView {
    fn drop(&mut self) {
        self.forget_model();
    }
}

impl Uploaded {
    fn new(gl: &GlContext, model: &MjModel) -> Result<Self, GlError> {
        let context = ffi::upload(gl, model)?;
        let scene = MjvScene::new(model, model.geom_bodyid().len() + SPARE_GEOMS);
        let size = [context.ffi().offWidth, context.ffi().offHeight].map(|side| u32::try_from(side).unwrap_or(0));
        Ok(Self { context, scene, size })
    }

    /// Makes the off-screen buffer large enough.
    fn make_room(&mut self, width: u32, height: u32) {
        if width > self.size[0] || height > self.size[1] {
            self.size = [self.size[0].max(width), self.size[1].max(height)];
            self.context.resize_offscreen(self.size[0], self.size[1]);
        }
    }
}

/// Sets these flags and no other.
fn set_flags(scene: &mut MjvScene, set: &[mjtRndFlag]) {
    let flags = scene.flags_mut();
    *flags = [0; mjtRndFlag::mjNRNDFLAG as usize];
    set.iter().for_each(|flag| flags[*flag as usize] = 1);
}

fn read(
    context: &MjrContext,
    colours: Option<&mut [u8]>,
    depth: &mut [f32],
    viewport: &MjrRectangle,
) -> Result<(), GlError> {
    let read = context.read_pixels(colours, Some(depth), viewport);
    read.map_err(|error| GlError::Failed(format!("mjr_readPixels: {error}")))
}

/// Means of the samples of each pixel, from bottom row first to top row first; half a step is rounded up.
fn shrink(samples: &[[u8; 3]], width: usize, rgb: &mut [[u8; 3]]) {
    let each = SAMPLES as usize;
    let count = SAMPLES * SAMPLES;
    let rows = samples.chunks_exact(each * width).rev();
    for (to, from) in rgb.chunks_exact_mut(width / each).zip(rows) {
        for (column, pixel) in to.iter_mut().enumerate() {
            *pixel = std::array::from_fn(|channel| {
                let of_row = |row: usize| (0..each).map(move |k| (row, each * column + k));
                let sum: u32 = (0..each)
                    .flat_map(of_row)
                    .map(|(row, column)| u32::from(from[row * width + column][channel]))
                    .sum();
                ((sum + count / 2) / count) as u8
            });
        }
    }
}

/// Narrows the scene's camera to the box, keeping MuJoCo's camera position and axes: the frustum of the job's camera at the
/// near plane, cut at pixel edges, and a far plane [m].
fn aim(scene: &mut MjvScene, camera: &Intrinsics, pixels: &PixelBox, far: f64) {
    let near = camera.near;
    let x = |column: u32| (f64::from(column) - camera.cx) / camera.fx * near;
    let y = |row: u32| (camera.cy - f64::from(row)) / camera.fy * near;
    let (left, right, top, bottom) = (x(pixels.left), x(pixels.right), y(pixels.top), y(pixels.bottom));
    for eye in scene.camera_mut() {
        eye.frustum_center = ((left + right) / 2.0) as f32;
        eye.frustum_width = ((right - left) / 2.0) as f32;
        eye.frustum_bottom = bottom as f32;
        eye.frustum_top = top as f32;
        eye.frustum_near = near as f32;
        eye.frustum_far = far as f32;
    }
}

/// From the depth buffer (1 = near plane, 0 = far plane or nothing; bottom row first) to metres.
fn convert(raw: &[f32], width: usize, near: f64, depth: &mut [f32]) {
    // The planes as the driver got them, rounded to f32.
    let (near, far) = (f64::from(near as f32), f64::from(FAR as f32));
    for (to, from) in depth.chunks_exact_mut(width).zip(raw.chunks_exact(width).rev()) {
        for (metres, &value) in to.iter_mut().zip(from) {
            *metres =
                if value == 0.0 { f32::NAN } else { (near * far / (near + f64::from(value) * (far - near))) as f32 };
        }
    }
}
