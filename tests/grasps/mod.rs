//! Grasps: annealing, wrench spaces, trials, and datasets of grasps and of patches, against what others compute.

mod annealing;
mod datasets;
mod in_scene;
mod kept_trials;
mod ladders;
mod passage;
mod patch_marks;
mod patches;
mod planner_energies;
mod second_engine;
mod table_trials;
mod trials;
mod wrench;
