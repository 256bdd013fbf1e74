//! From a description to MuJoCo's specification of it: first its text is checked, then MuJoCo reads it.

use std::path::{Path, PathBuf};

use kernel::description::{DescriptionError, DescriptionText, Format};
use mujoco_rs::{error::MjEditError, wrappers::mj_editing::MjSpec};

use crate::{
    error::RobotError,
    ffi::{prepare_library, size_memory_by_content},
    statements::{self, Usage},
};

/// Free memory that a compilation needs [bytes]. With less, any error of MuJoCo may come from that: the C library
/// reserves 128 MiB for the first allocation of a thread, and if that fails, its error number makes MuJoCo's parser
/// refuse a number.
const NEEDED_MEMORY: usize = 192 << 20;

/// A description as MuJoCo has read it, not compiled.
pub(crate) struct OpenedSpec {
    pub(crate) spec: MjSpec,
    pub(crate) text: DescriptionText,
}

/// Opens a description for a use.
///
/// # Errors
/// When its text is refused, or MuJoCo refuses it.
pub(crate) fn open_spec(path: &Path, usage: Usage) -> Result<OpenedSpec, RobotError> {
    prepare_library();
    if path.to_str().is_none_or(|text| text.contains('\0')) {
        return Err(RobotError::Refused { path: path.to_owned(), message: "its path is not UTF-8".into() });
    }
    let text = DescriptionText::read(path).map_err(|error| unreadable(path, error))?;
    statements::check(&text, usage).map_err(|refused| RobotError::Statements { refused })?;
    let mut spec = MjSpec::from_xml(path).map_err(|error| refused_by_mujoco(path, &error))?;
    size_memory_by_content(&mut spec);
    // Actuators of the file are not used: nothing measures how long they are.
    spec.compiler_mut().lropt_mut().mode = 0;
    if text.format == Format::Urdf {
        adapt_urdf(&mut spec, &text)?;
    }
    Ok(OpenedSpec { spec, text })
}

/// Links keep their names, files of packages are where the text's reader has found them, and soft limits narrow the joints.
fn adapt_urdf(spec: &mut MjSpec, text: &DescriptionText) -> Result<(), RobotError> {
    spec.compiler_mut().set_fusestatic(false);
    for mesh in spec.mesh_iter_mut() {
        let found = text.files.iter().find(|(written, _)| written == mesh.file());
        if let Some(path) = found.and_then(|(_, path)| path.to_str()) {
            mesh.set_file(path);
        }
    }
    for statement in text.statements.iter().filter(|statement| statement.is("joint/safety_controller")) {
        let joint = statement.parent.and_then(|parent| text.statements[parent].get("name"));
        let limit = |attribute: &str| statement.get(attribute).and_then(|value| value.trim().parse::<f64>().ok());
        let (Some(joint), Some(low), Some(high)) = (joint, limit("soft_lower_limit"), limit("soft_upper_limit")) else {
            continue;
        };
        if let Some(joint) = spec.joint_mut(joint).filter(|_| low < high) {
            let [hard_low, hard_high] = *joint.range();
            let is_limited = hard_low < hard_high;
            *joint.range_mut() = if is_limited { [low.max(hard_low), high.min(hard_high)] } else { [low, high] };
        }
    }
    Ok(())
}

/// Error of a text that cannot be read.
fn unreadable(path: &Path, error: DescriptionError) -> RobotError {
    match error {
        DescriptionError::Unreadable { path: file, by: Some(_), source }
            if source.kind() == std::io::ErrorKind::NotFound =>
        {
            RobotError::Missing { path: path.to_owned(), file }
        }
        error => RobotError::Text { remedy: error.remedy(), message: error.to_string() },
    }
}

/// Error of a description that MuJoCo does not read or compile.
pub(crate) fn refused_by_mujoco(path: &Path, error: &MjEditError) -> RobotError {
    const OPENING: &str = "Error opening file '";
    if is_memory_short() {
        return RobotError::Memory { path: path.to_owned(), needed: NEEDED_MEMORY };
    }
    let message = error.to_string();
    let file =
        message.split_once(OPENING).and_then(|(_, rest)| rest.split_once('\'')).map(|(file, _)| PathBuf::from(file));
    match file {
        Some(file) if file != path => RobotError::Missing { path: path.to_owned(), file },
        _ => RobotError::Refused { path: path.to_owned(), message },
    }
}

/// Whether less memory is left than a compilation needs. MuJoCo's parser takes a failed allocation for a wrong number.
fn is_memory_short() -> bool {
    Vec::<u8>::new().try_reserve_exact(NEEDED_MEMORY).is_err()
}
