//! Jobs: as written (TOML), then as meant (checked, every default filled in, assets by hash).

mod checked;

pub use checked::{
    Channels, Completion, DepthFormat, Distance, Gate, ImplicitSamples, Job, JobObject, ModelChoice, Pivot, Profile,
    Renderer, SceneCamera, SplitSettings, SubsetSize, Truth,
};
