//! Collision checks of joint values by MuJoCo's own contacts.

use super::settings::Robot;
use sim::RobotModel;

/// Check of one thread: whether joint values are free of collisions.
pub(super) type IsFree = Box<dyn FnMut(&[f64]) -> bool + Send>;

/// A robot whose contacts MuJoCo finds; shared by all threads.
pub(super) struct Contacts {
    model: RobotModel,
    robot: Robot,
}

impl Contacts {
    pub fn new(model: RobotModel, robot: &Robot) -> Self {
        Self { model, robot: robot.clone() }
    }

    /// Check for one thread.
    pub fn worker(&self) -> IsFree {
        let joints: Vec<&str> = self.robot.joints.iter().map(String::as_str).collect();
        let worker = self.model.contact_worker(&joints, &self.robot.fixed);
        let mut worker = worker.expect("the robot gave its planning group for these names");
        Box::new(move |q| worker.is_free(q))
    }
}
