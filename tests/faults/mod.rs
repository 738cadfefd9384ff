//! The program and the library on a fault-injecting driver (`icd.rs`), which loses its device, opens none, runs out of
//! memory or is slow, and otherwise forwards to lavapipe.

mod driver;
mod library;
mod lost;
mod memory;
