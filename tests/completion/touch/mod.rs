//! Touch: rays against closed forms and tracers that are not ours, and what readers make of it.

mod by_hand;
mod looking;
mod peers;
mod rays;
