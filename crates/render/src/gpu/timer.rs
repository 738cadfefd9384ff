//! Durations of dispatches, measured with GPU timestamps.

use std::time::Duration;

use wgpu::BufferUsages;

use super::device::Device;

/// Size of a dispatch's two timestamps, start and end, in bytes.
pub const TIMESTAMP_BYTES: u64 = 2 * size_of::<u64>() as u64;

pub struct Timer {
    clock: Option<Clock>,
}

struct Clock {
    queries: wgpu::QuerySet,
    ticks: wgpu::Buffer,
    /// Nanoseconds per tick.
    period: f64,
}

impl Timer {
    /// Creates a timer, which measures nothing if the device has no clock.
    pub fn new(device: &Device) -> Timer {
        let has_clock = device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        Timer {
            clock: has_clock.then(|| Clock {
                queries: device.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: None,
                    ty: wgpu::QueryType::Timestamp,
                    count: 2,
                }),
                ticks: device.buffer(TIMESTAMP_BYTES, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
                period: f64::from(device.queue.get_timestamp_period()),
            }),
        }
    }

    /// Returns the timestamp queries of a compute pass.
    pub fn writes(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.clock.as_ref().map(|clock| wgpu::ComputePassTimestampWrites {
            query_set: &clock.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        })
    }

    /// Copies the timestamps of a pass to a buffer.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder, destination: &wgpu::Buffer, offset: u64) {
        if let Some(Clock { queries, ticks, .. }) = &self.clock {
            encoder.resolve_query_set(queries, 0..2, ticks, 0);
            encoder.copy_buffer_to_buffer(ticks, 0, destination, offset, TIMESTAMP_BYTES);
        }
    }

    /// Returns the duration between two timestamps, which take two words each.
    pub fn duration(&self, words: &[u32]) -> Option<Duration> {
        let clock = self.clock.as_ref()?;
        let [start_low, start_high, end_low, end_high] = *words else {
            return None;
        };
        let ticks = |low: u32, high: u32| u64::from(low) | u64::from(high) << 32;
        let elapsed = ticks(end_low, end_high)
            .checked_sub(ticks(start_low, start_high))
            .filter(|ticks| *ticks > 0)?;
        let nanoseconds = elapsed as f64 * clock.period;
        (nanoseconds < 3.6e12).then(|| Duration::from_nanos(nanoseconds as u64)) // longer durations are invalid
    }
}
