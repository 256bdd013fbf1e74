//! Completion datasets: audits by other readers, half-shapes, touch, and the same bytes on every machine.

mod audit;
mod determinism;
mod half_shapes;
mod nearness;
mod occlusion;
mod touch;
mod views_per_object;
