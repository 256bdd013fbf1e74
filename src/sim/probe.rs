//! Facts of this machine's MuJoCo and OpenGL, for `graspmill doctor` and for the manifest.

use std::{collections::BTreeMap, fs, path::PathBuf};

use crate::{
    error::GlError,
    ffi::{self, GlContext},
};

/// blake3 of libmujoco.so.3.17.0 for x86-64, as packed in the Python package `mujoco` (`scripts/fetch.py` has its
/// sha256).
const PINNED: &str = "e5611a62d8cb6d2a84892f3f9f12428212d766db14352a0b0da3a95c96dc3246";

/// Libraries that the program runs with.
#[derive(Debug, Clone, PartialEq)]
pub struct SimFacts {
    /// MuJoCo's version.
    pub version: String,
    /// The library file that the program loaded at its start; `None` if the system does not report it.
    pub library: Option<PathBuf>,
    /// blake3 of that file, in hexadecimal: the first part of the label of data of class `physics`.
    pub digest: Option<String>,
    /// Whether it is the very file that the tests ran with.
    pub pinned: bool,
    /// The C library and its version.
    pub libc: String,
}

impl SimFacts {
    /// Platform that numbers of class `physics` are promised for, with `gl` those of class `colour` too: the manifest's
    /// table.
    pub fn platform(&self, gl: Option<&GlFacts>) -> BTreeMap<String, String> {
        let mut platform = BTreeMap::from([
            ("libmujoco".to_owned(), self.digest.clone().unwrap_or_else(|| format!("{}, unknown file", self.version))),
            ("libc".to_owned(), self.libc.clone()),
            ("mujoco".to_owned(), self.version.clone()),
            ("processor".to_owned(), processor_level().to_owned()),
        ]);
        if let Some(gl) = gl {
            platform.insert("gl_renderer".to_owned(), gl.renderer.clone());
            platform.insert("gl_version".to_owned(), gl.version.clone());
        }
        platform
    }
}

/// The x86-64 feature level, or the architecture: a C library picks its maths by it.
fn processor_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512cd")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
        {
            return "x86-64-v4";
        }
        if is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("fma")
        {
            return "x86-64-v3";
        }
    }
    std::env::consts::ARCH
}

/// OpenGL driver that draws.
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

/// Queries libmujoco.
pub fn sim_facts() -> SimFacts {
    ffi::prepare_library();
    let library = loaded_library();
    let digest = library.as_ref().and_then(|path| fs::read(path).ok()).map(|bytes| blake3::hash(&bytes).to_string());
    SimFacts {
        version: mujoco_rs::mujoco_version().to_owned(),
        pinned: digest.as_deref() == Some(PINNED),
        library,
        digest,
        libc: ffi::libc_version(),
    }
}

/// Queries the OpenGL driver. Opens and closes a context without a window: tens of milliseconds.
///
/// # Errors
/// If there is no such context.
pub fn gl_facts() -> Result<GlFacts, GlError> {
    let gl = GlContext::new()?;
    Ok(GlFacts {
        egl: gl.egl_vendor.clone(),
        renderer: gl.renderer.clone(),
        version: gl.version.clone(),
        largest: gl.largest,
    })
}

/// The mapped file, from Linux's own list.
fn loaded_library() -> Option<PathBuf> {
    let maps = fs::read_to_string("/proc/self/maps").ok()?;
    let line = maps.lines().find(|line| line.contains("/libmujoco.so"))?;
    Some(PathBuf::from(&line[line.find('/')?..]))
}
