//! Touch: rays against closed forms and independent tracers, and the readers of the result.

mod by_hand;
mod looking;
mod peers;
mod rays;
