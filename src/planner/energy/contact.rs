//! The contact energy of the thesis, section 4.4.1 and algorithm 1, with its two versions of `isVisible`.

use nalgebra::{IsometryMatrix3, Point3, Unit, Vector3};

use super::MAX_ENERGY;
use kernel::contact::ContactSurface;
use robot::hand::Hand;

/// A contact nearer to the surface than this has the inward normal as its direction to the surface [m].
const TOUCHES: f64 = 1e-6;

/// Distance from the surface that a hidden contact counts with in [`ContactForm::Standard`] [mm].
const HIDDEN_DISTANCE: f64 = 50.0;

/// Millimetres per metre.
const MILLIMETRES: f64 = 1e3;

/// A virtual contact of a hand in a state, and the point of the target nearest to it; in `Object`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandContact {
    /// Position of the contact [m].
    pub point: Point3<f64>,
    /// Normal of the contact, out of the hand.
    pub normal: Unit<Vector3<f64>>,
    /// Closest point of the target's surface [m].
    pub closest: Point3<f64>,
    /// Normal of the surface there, out of the target.
    pub outward: Unit<Vector3<f64>>,
    /// Whether the contact lies inside the target; never of a partial mesh.
    pub is_inside: bool,
    /// Whether the link with the approach frame carries it: for the Barrett hand 4 of 16.
    pub is_on_palm: bool,
}

/// Which contacts count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// All contacts. For completed objects, whose back is known.
    Off,
    /// Version A: contacts on the palm.
    Palm,
    /// Version B: contacts that come from the camera's side, (p - v) . (p - c) > 0 for the contact at v, its closest point p and
    /// the camera at c. For partial meshes.
    Facing,
}

/// Treatment of hidden contacts, and of contacts inside the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactForm {
    /// The mean over all contacts: a hidden one counts 50 mm and a right angle, so that a hand that shows one good contact is not the
    /// best one. Inside the target the direction to the surface is the inward one, as in `robot::grasp`.
    Standard,
    /// The mean over the visible contacts, and always p - v, as printed.
    Thesis,
}

/// Direction that the normal of a contact is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alignment {
    /// The direction from the contact to its closest point: text and figure 4.8 of the thesis.
    Offset,
    /// The outward normal of the surface: `ip.norm` of algorithm 1 as printed. A perfect contact scores worst, and version B of
    /// `isVisible` keeps the contacts that the camera cannot see. Kept as a named quirk.
    PrintedNormal,
}

/// The contact energy [mm]: the mean over the virtual contacts of |o| + gamma (1 - n . o / |o|), with the contact's normal n and
/// its offset o = p - v to the closest point p of the target (thesis, 4.4.1 and algorithm 1).
///
/// ```
/// use graspmill_planner::energy::{ContactEnergy, HandContact, Visibility};
/// use nalgebra::{Point3, Vector3};
///
/// // A contact 10 mm in front of the face x = 0 of an object, aligned with it.
/// let contact = HandContact {
///     point: Point3::new(0.01, 0.0, 0.0),
///     normal: -Vector3::x_axis(),
///     closest: Point3::origin(),
///     outward: Vector3::x_axis(),
///     is_inside: false,
///     is_on_palm: true,
/// };
/// let energy = ContactEnergy { visible: Visibility::Facing, ..ContactEnergy::STANDARD };
/// assert_eq!(energy.of(&[contact], &Point3::new(1.0, 0.0, 0.0)), 10.0);
/// // A camera behind the object sees none of it.
/// assert_eq!(energy.of(&[contact], &Point3::new(-1.0, 0.0, 0.0)), graspmill_planner::energy::MAX_ENERGY);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEnergy {
    /// Weight of 1 - cos against millimetres.
    pub gamma: f64,
    /// Which contacts count.
    pub visible: Visibility,
    /// Treatment of the others.
    pub form: ContactForm,
    /// Direction that normals are compared with.
    pub alignment: Alignment,
}

impl HandContact {
    /// The virtual contacts of a hand in a state, with exact distances. `joints` has the values of all joints in the order of the
    /// hand's tree [rad or m]; the contacts are in the order of [`Hand::contacts`].
    ///
    /// # Panics
    /// When there is not one value per joint.
    pub fn all(
        hand: &Hand,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        joints: &[f64],
    ) -> Vec<Self> {
        let frames = hand.link_frames(joints);
        let at = |(index, contact): (usize, &robot::hand::ContactPoint)| {
            let (point, normal) = hand.contact_in_base(index, &frames);
            let (point, normal) = (object_from_base * point, object_from_base.rotation * normal);
            let (outward, distance) = surface.outward(&point);
            Self {
                point,
                normal,
                closest: point - outward * distance,
                outward: Unit::new_normalize(outward),
                is_inside: distance < 0.0,
                is_on_palm: contact.link == hand.approach().link,
            }
        };
        hand.contacts().iter().enumerate().map(at).collect()
    }
}

impl ContactEnergy {
    /// Energy of the project's own datasets: gamma = 50, all contacts.
    pub const STANDARD: Self =
        Self { gamma: 50.0, visible: Visibility::Off, form: ContactForm::Standard, alignment: Alignment::Offset };

    /// Energy of the thesis, table 4.2: gamma = 500, and `isVisible` in version B.
    pub const THESIS: Self =
        Self { gamma: 500.0, visible: Visibility::Facing, form: ContactForm::Thesis, alignment: Alignment::Offset };

    /// Energy of a state [mm], with the camera's position in `Object` [m]; [`MAX_ENERGY`] where no contact is visible.
    pub fn of(&self, contacts: &[HandContact], camera: &Point3<f64>) -> f64 {
        let (mut sum, mut visible) = (0.0, 0);
        for contact in contacts {
            if self.is_visible(contact, camera) {
                let distance = (contact.closest - contact.point).norm();
                let cos = contact.normal.dot(&self.direction(contact));
                sum += MILLIMETRES * distance + self.gamma * (1.0 - cos);
                visible += 1;
            } else if self.form == ContactForm::Standard {
                // At a right angle: cos = 0.
                sum += HIDDEN_DISTANCE + self.gamma;
            }
        }
        match self.form {
            // The print divides by 0 here.
            _ if visible == 0 => MAX_ENERGY,
            ContactForm::Standard => sum / contacts.len() as f64,
            ContactForm::Thesis => sum / f64::from(visible),
        }
    }

    /// Whether a contact counts, with the camera's position in `Object` [m] (`isVisible` of algorithm 1).
    pub fn is_visible(&self, contact: &HandContact, camera: &Point3<f64>) -> bool {
        match self.visible {
            Visibility::Off => true,
            Visibility::Palm => contact.is_on_palm,
            Visibility::Facing => self.direction(contact).dot(&(contact.closest - camera)) > 0.0,
        }
    }

    /// Unit vector that the contact's normal is compared with.
    fn direction(&self, contact: &HandContact) -> Vector3<f64> {
        if self.alignment == Alignment::PrintedNormal {
            return contact.outward.into_inner();
        }
        let offset = contact.closest - contact.point;
        let distance = offset.norm();
        if distance < TOUCHES {
            return -contact.outward.into_inner();
        }
        let is_reversed = contact.is_inside && self.form == ContactForm::Standard;
        offset / if is_reversed { -distance } else { distance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::seed::Stream;

    const CAMERA: Point3<f64> = Point3::new(0.8, 0.0, 0.0);
    const RADIUS: f64 = 0.05;

    /// A contact before, on or in a ball about the origin, its normal towards the middle.
    fn on_ball(outward: Vector3<f64>, distance: f64) -> HandContact {
        let outward = Unit::new_normalize(outward);
        HandContact {
            point: Point3::from(outward.into_inner() * (RADIUS + distance)),
            normal: -outward,
            closest: Point3::from(outward.into_inner() * RADIUS),
            outward,
            is_inside: distance < 0.0,
            is_on_palm: false,
        }
    }

    fn around() -> Vec<HandContact> {
        let mut stream = Stream::of_job(1, b"", "contacts around a ball");
        (0..500).map(|_| on_ball(Vector3::from_fn(|_, _| stream.normal()), stream.uniform(0.001, 0.03))).collect()
    }

    /// Whether version B keeps exactly the contacts at points that the camera sees: those whose tangent plane it is above.
    fn keeps_what_the_camera_sees(alignment: Alignment) -> bool {
        let energy = ContactEnergy { alignment, ..ContactEnergy::THESIS };
        let sees = |contact: &HandContact| contact.outward.dot(&(CAMERA - contact.closest)) > 0.0;
        around().iter().all(|contact| energy.is_visible(contact, &CAMERA) == sees(contact))
    }

    #[test]
    fn version_b_keeps_exactly_the_contacts_that_face_the_camera() {
        assert!(keeps_what_the_camera_sees(Alignment::Offset));
        let energy = ContactEnergy::THESIS;
        let kept = around().iter().filter(|contact| energy.is_visible(contact, &CAMERA)).count();
        // A camera at 16 radii sees almost half of the ball: (1 - 1/16) / 2.
        assert!((200..270).contains(&kept), "{kept} of 500");
    }

    #[test]
    fn the_printed_normal_keeps_the_contacts_that_the_camera_cannot_see() {
        assert!(!keeps_what_the_camera_sees(Alignment::PrintedNormal));
        let [meant, printed] = [Alignment::Offset, Alignment::PrintedNormal]
            .map(|alignment| ContactEnergy { alignment, ..ContactEnergy::THESIS });
        assert!(
            around()
                .iter()
                .all(|contact| { meant.is_visible(contact, &CAMERA) != printed.is_visible(contact, &CAMERA) })
        );
    }

    #[test]
    fn a_perfect_contact_is_the_best_and_as_printed_the_worst() {
        let mut stream = Stream::of_job(2, b"", "normals");
        let of = |alignment: Alignment, contact: &HandContact| {
            ContactEnergy { alignment, visible: Visibility::Off, ..ContactEnergy::THESIS }.of(&[*contact], &CAMERA)
        };
        let perfect = on_ball(Vector3::x(), 0.0);
        assert_eq!(of(Alignment::Offset, &perfect), 0.0);
        for _ in 0..200 {
            let normal = Unit::new_normalize(Vector3::from_fn(|_, _| stream.normal()));
            let other = HandContact { normal, ..perfect };
            assert!(of(Alignment::Offset, &other) >= of(Alignment::Offset, &perfect));
            assert!(of(Alignment::PrintedNormal, &other) <= of(Alignment::PrintedNormal, &perfect));
        }
    }

    #[test]
    fn hidden_contacts_count_in_the_standard_form_alone() {
        let contacts = [on_ball(Vector3::x(), 0.01), on_ball(-Vector3::x(), 0.001)];
        let facing = |form| ContactEnergy { form, visible: Visibility::Facing, ..ContactEnergy::STANDARD };
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        close(facing(ContactForm::Thesis).of(&contacts, &CAMERA), 10.0);
        close(facing(ContactForm::Standard).of(&contacts, &CAMERA), (10.0 + 50.0 + 50.0) / 2.0);
        for form in [ContactForm::Standard, ContactForm::Thesis] {
            assert_eq!(facing(form).of(&contacts[1..], &CAMERA), MAX_ENERGY);
            let palm = ContactEnergy { form, visible: Visibility::Palm, ..ContactEnergy::STANDARD };
            assert_eq!(palm.of(&contacts, &CAMERA), MAX_ENERGY);
            let on_palm = HandContact { is_on_palm: true, ..contacts[1] };
            assert!(palm.of(&[on_palm], &CAMERA) < 1.001);
            assert_eq!(ContactEnergy { form, ..ContactEnergy::STANDARD }.of(&[], &CAMERA), MAX_ENERGY);
        }
    }

    #[test]
    fn inside_the_standard_direction_stays_the_inward_one() {
        let inside = on_ball(Vector3::x(), -0.002);
        let of = |form| ContactEnergy { form, ..ContactEnergy::STANDARD }.of(&[inside], &CAMERA);
        assert!((of(ContactForm::Standard) - 2.0).abs() < 1e-9);
        assert!((of(ContactForm::Thesis) - 102.0).abs() < 1e-9);
    }
}
