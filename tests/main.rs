//! The promise that GPU and CPU agree (`docs/agreement.md`), and what it rests on. One binary: a test build links once.

mod layout;
mod scenes;
mod sources;
mod twins;
