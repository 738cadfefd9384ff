//! The program and the library on a driver that loses its device, opens none, has no memory, or is slow: `icd.rs`, which hands
//! all else on to lavapipe.

mod driver;
mod library;
mod lost;
mod memory;
