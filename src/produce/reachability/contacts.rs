//! Whether a configuration is free by MuJoCo's own contacts.

#[cfg(feature = "sim")]
pub(super) use with_mujoco::Contacts;
#[cfg(not(feature = "sim"))]
pub(super) use without::Contacts;

/// What one thread asks: whether joint values are free.
pub(super) type Ask = Box<dyn FnMut(&[f64]) -> bool + Send>;

#[cfg(feature = "sim")]
mod with_mujoco {
    use super::Ask;
    use crate::{job::Robot, sim::RobotModel};

    /// A robot whose contacts MuJoCo is asked for; shared by all threads.
    pub(in super::super) struct Contacts {
        model: RobotModel,
        robot: Robot,
    }

    impl Contacts {
        pub fn new(model: RobotModel, robot: &Robot) -> Self {
            Self { model, robot: robot.clone() }
        }

        /// For one thread.
        pub fn worker(&self) -> Ask {
            let joints: Vec<&str> = self.robot.joints.iter().map(String::as_str).collect();
            let worker = self.model.contact_worker(&joints, &self.robot.fixed);
            let mut worker = worker.expect("the robot gave its planning group for these names");
            Box::new(move |q| worker.is_free(q))
        }
    }
}

#[cfg(not(feature = "sim"))]
mod without {
    use super::Ask;

    /// Nobody to ask.
    pub(in super::super) enum Contacts {}

    impl Contacts {
        pub fn worker(&self) -> Ask {
            match *self {}
        }
    }
}
