//! Cache of compiled pipelines of a device.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::compose::{Kernel, Source};
use super::rounding::Rounding;
use crate::records::Specialization;

/// Maximum number of pipelines. The least recently used pipeline is dropped first.
const CAPACITY: usize = 32;

/// Hash of everything that a pipeline is compiled from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl Key {
    /// Returns a kernel's key. The text determines the bindings.
    pub fn new(kernel: &Kernel, source: &Source, constants: &Specialization, exact: Option<Rounding>) -> Key {
        let mut hasher = blake3::Hasher::new();
        hasher.update(format!("{} {exact:?} {constants:?}\n", kernel.entry_point).as_bytes());
        hasher.update(source.text.as_bytes());
        Key(*hasher.finalize().as_bytes())
    }
}

/// From least to most recently used, shared by clones.
#[derive(Clone, Default)]
pub struct PipelineCache(Arc<Mutex<VecDeque<(Key, wgpu::ComputePipeline)>>>);

impl PipelineCache {
    pub fn get(&self, key: Key) -> Option<wgpu::ComputePipeline> {
        let mut pipelines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let position = pipelines.iter().position(|(known, _)| *known == key)?;
        let entry = pipelines.remove(position)?;
        let pipeline = entry.1.clone();
        pipelines.push_back(entry);
        Some(pipeline)
    }

    pub fn add(&self, key: Key, pipeline: &wgpu::ComputePipeline) {
        let mut pipelines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        pipelines.retain(|(known, _)| *known != key);
        if pipelines.len() == CAPACITY {
            pipelines.pop_front();
        }
        pipelines.push_back((key, pipeline.clone()));
    }
}
