//! Settings of occluders in front of the objects.

use super::spec_occlusion::{OcclusionMode, OcclusionSpec};
use form::{Checker, Path};
use kernel::render::{OccluderKind, OccluderModel};

/// The occluders of a job.
pub(super) fn occlusion(checker: &mut Checker, spec: &OcclusionSpec) -> OccluderModel {
    let OcclusionSpec { modes, share, min_hidden, max_hidden } = spec;
    if min_hidden > max_hidden {
        let expected = format!("at least min_hidden = {min_hidden}");
        checker.invalid("occlusion.max_hidden", expected, format!("{max_hidden}"));
    }
    for (index, mode) in modes.iter().enumerate() {
        if modes[..index].contains(mode) {
            let path = Path::from("occlusion.modes").index(index);
            checker.invalid(path, "each mode once", "one that is listed before".to_owned());
        }
    }
    let kind = |mode: &OcclusionMode| match mode {
        OcclusionMode::Neighbours => OccluderKind::Neighbour,
        OcclusionMode::HalfSpace => OccluderKind::HalfSpace,
    };
    OccluderModel { kinds: modes.iter().map(kind).collect(), share: *share, hidden: [*min_hidden, *max_hidden] }
}

/// The keys of a job's occluders.
pub(super) fn occlusion_keys(model: &OccluderModel) -> OcclusionSpec {
    let OccluderModel { kinds, share, hidden: [min_hidden, max_hidden] } = model;
    let mode = |kind: &OccluderKind| match kind {
        OccluderKind::Neighbour => OcclusionMode::Neighbours,
        OccluderKind::HalfSpace => OcclusionMode::HalfSpace,
    };
    OcclusionSpec {
        modes: kinds.iter().map(mode).collect(),
        share: *share,
        min_hidden: *min_hidden,
        max_hidden: *max_hidden,
    }
}
