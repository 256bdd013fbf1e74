//! Files of a description, before MuJoCo opens them itself.

use std::path::Path;

use kernel::{
    assets::{Description, DescriptionTooLarge},
    files::FileRefusal,
};

/// Refuses a description that is, or names, what is no regular file, for which MuJoCo would wait, and one that is too large or asks
/// for memory or copies without end.
pub(super) fn refuse_unsafe(path: &Path) -> Result<(), String> {
    match Description::check_files(path) {
        Err(error)
            if error
                .source
                .get_ref()
                .is_some_and(|cause| cause.is::<FileRefusal>() || cause.is::<DescriptionTooLarge>()) =>
        {
            Err(error.to_string())
        }
        // Whatever else is wrong, MuJoCo says in its own words.
        _ => Ok(()),
    }
}
