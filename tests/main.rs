//! The promise that GPU and CPU agree (`docs/agreement.md`), and what it rests on. One binary: a test build links once.

mod adapter;
mod against_oracle;
mod agreement;
mod analytic;
mod bounds;
mod inputs;
mod kernel;
mod layout;
mod oracle;
mod patterns;
mod pictures;
mod probes;
mod random;
mod scenes;
mod sources;
mod twins;
mod words;
