//! Robots, hands, grasps and scenes: kinematics, collisions, trials and settling, and the datasets made of them.

mod grasps;
mod reachability;
mod robot;
mod scenes;
mod support;
