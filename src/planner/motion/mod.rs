//! Motions of an arm that are proven free of contact.
