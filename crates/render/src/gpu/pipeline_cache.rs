//! Cache of compiled pipelines of a device.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::compose::{Kernel, Source};
use super::rounding::Rounding;
use wgray_trace::records::Specialization;

/// Maximum number of pipelines. The least recently used pipeline is dropped first.
const CAPACITY: usize = 32;

/// Hash of everything that a pipeline is compiled from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl Key {
    /// Returns a kernel's key. Bindings are not hashed, because the text determines them.
    pub fn new(kernel: &Kernel, source: &Source, constants: &Specialization, exact: Option<Rounding>) -> Key {
        let mut hasher = blake3::Hasher::new();
        hasher.update(format!("{} {exact:?} {constants:?}\n", kernel.entry_point).as_bytes());
        hasher.update(source.text.as_bytes());
        Key(*hasher.finalize().as_bytes())
    }
}

/// Pipelines, from least to most recently used. Clones share the cache.
#[derive(Clone, Default)]
pub struct PipelineCache(Arc<Mutex<VecDeque<(Key, wgpu::ComputePipeline)>>>);

impl PipelineCache {
    pub fn get(&self, key: Key) -> Option<wgpu::ComputePipeline> {
        let mut pipelines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let position = pipelines.iter().position(|(cached, _)| *cached == key)?;
        let entry = pipelines.remove(position)?;
        let pipeline = entry.1.clone();
        pipelines.push_back(entry);
        Some(pipeline)
    }

    pub fn add(&self, key: Key, pipeline: &wgpu::ComputePipeline) {
        let mut pipelines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        pipelines.retain(|(cached, _)| *cached != key);
        if pipelines.len() == CAPACITY {
            pipelines.pop_front();
        }
        pipelines.push_back((key, pipeline.clone()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compose::RENDER;
    use crate::gpu::{AdapterChoice, choose};

    fn key(text: &str, samples: u32, exact: Option<Rounding>) -> Key {
        let mut source = Source::default();
        source.append("a.wgsl", text);
        let constants = Specialization {
            pixel_samples: samples,
            ..Specialization::default()
        };
        Key::new(&RENDER, &source, &constants, exact)
    }

    #[test]
    fn keys_differ_by_text_constants_and_rounding() {
        let original = key("a", 1, None);
        assert_eq!(original, key("a", 1, None));
        for other in [
            key("b", 1, None),
            key("a", 2, None),
            key("a", 1, Some(Rounding::Device)),
            key("a", 1, Some(Rounding::Software)),
        ] {
            assert_ne!(original, other);
        }
    }

    #[test]
    fn the_least_recently_used_pipeline_is_dropped() {
        let device = match choose(&AdapterChoice::Auto) {
            Ok(device) => device,
            Err(_) if std::env::var_os("WGRAY_TEST_WITHOUT_GPU").is_some() => return,
            Err(error) => panic!("{error}"),
        };
        let (wgpu, _) = device.wgpu();
        let module = wgpu.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl("@compute @workgroup_size(1) fn main() {}".into()),
        });
        let pipeline = wgpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let keys: Vec<Key> = (0..=CAPACITY as u32).map(|i| key("a", i, None)).collect();
        let cache = PipelineCache::default();
        for key in &keys[..CAPACITY] {
            cache.add(*key, &pipeline);
        }
        assert_eq!(cache.get(keys[0]).as_ref(), Some(&pipeline));
        cache.add(keys[CAPACITY], &pipeline);
        let cached: Vec<bool> = keys.iter().map(|key| cache.get(*key).is_some()).collect();
        let expected: Vec<bool> = (0..=CAPACITY).map(|i| i != 1).collect();
        assert_eq!(cached, expected);
    }
}
