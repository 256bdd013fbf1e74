//! What this machine has of MuJoCo and OpenGL, for `graspmill doctor` and for the manifest.

use std::{fs, path::PathBuf};

use super::{
    error::GlError,
    ffi::{self, GlContext},
};

/// blake3 of libmujoco.so.3.17.0 for x86-64, as packed in the Python package `mujoco` (its sha256 stands in
/// `scripts/fetch.py`).
const PINNED: &str = "e5611a62d8cb6d2a84892f3f9f12428212d766db14352a0b0da3a95c96dc3246";

/// What the program runs with.
#[derive(Debug, Clone, PartialEq)]
pub struct SimFacts {
    /// MuJoCo's version.
    pub version: String,
    /// The file that the program was linked with at its start; `None` where the system does not tell.
    pub library: Option<PathBuf>,
    /// blake3 of that file, in hexadecimal: the first part of the label of data of class `physics`.
    pub digest: Option<String>,
    /// Whether it is the very file that the tests ran with.
    pub pinned: bool,
    /// OpenGL without a window, or why not.
    pub gl: Result<GlFacts, GlError>,
}

/// What draws.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GlFacts {
    /// EGL's vendor, version and platform.
    pub egl: String,
    /// The driver's name (GL_RENDERER).
    pub renderer: String,
    /// The driver's version (GL_VERSION).
    pub version: String,
    /// Longest side of an image [px].
    pub largest: u32,
}

/// Asks libmujoco and the OpenGL driver. Opens and closes a GL context: tens of milliseconds.
pub fn sim_facts() -> SimFacts {
    ffi::prepare_library();
    let library = loaded_library();
    let digest = library.as_ref().and_then(|path| fs::read(path).ok()).map(|bytes| blake3::hash(&bytes).to_string());
    SimFacts {
        version: mujoco_rs::mujoco_version().to_owned(),
        pinned: digest.as_deref() == Some(PINNED),
        library,
        digest,
        gl: GlContext::new().map(|gl| GlFacts {
            egl: gl.egl_vendor.clone(),
            renderer: gl.renderer.clone(),
            version: gl.version.clone(),
            largest: gl.largest,
        }),
    }
}

/// The mapped file, from Linux's own list.
fn loaded_library() -> Option<PathBuf> {
    let maps = fs::read_to_string("/proc/self/maps").ok()?;
    let line = maps.lines().find(|line| line.contains("/libmujoco.so"))?;
    Some(PathBuf::from(&line[line.find('/')?..]))
}
