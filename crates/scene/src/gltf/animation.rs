//! glTF animations (section 3.11, appendix C).

use std::collections::HashSet;

use glam::{DQuat, DVec3};
use gltf_json::animation::{Interpolation, Property};
use gltf_json::validation::Checked;

use super::document::Document;
use super::error::GltfError;
use super::node::{Pose, quaternion};

/// Maximum total number of morph weights of animated nodes.
const MAX_WEIGHTS: usize = 1 << 24;

/// Maximum number of animations named in a warning.
const MAX_NAMED: usize = 5;

impl Document {
    /// Returns the animations whose properties no earlier animation drives. A note lists the skipped animations.
    pub(super) fn compatible(&self, animations: Vec<usize>, notes: &mut Vec<String>) -> Vec<usize> {
        let mut driven = HashSet::new();
        let (mut playing, mut skipped) = (Vec::new(), Vec::new());
        for i in animations {
            let channels = self.json.animations[i].channels.iter();
            let targets = channels.filter_map(|channel| match channel.target.path {
                Checked::Valid(path) => Some((channel.target.node.value(), path as u8)),
                Checked::Invalid => None,
            });
            let properties: HashSet<(usize, u8)> = targets.collect();
            match driven.is_disjoint(&properties) {
                true => {
                    driven.extend(properties);
                    playing.push(i);
                }
                false => skipped.push(i),
            }
        }
        if !skipped.is_empty() {
            let name = |i: &usize| match &self.json.animations[*i].name {
                Some(name) => format!("{i} ({name:?})"),
                None => i.to_string(),
            };
            let mut named: Vec<String> = skipped.iter().take(MAX_NAMED).map(name).collect();
            if skipped.len() > MAX_NAMED {
                named.push(format!("{} more", skipped.len() - MAX_NAMED));
            }
            let (noun, verb) = match skipped.len() {
                1 => ("animation", "drives"),
                _ => ("animations", "drive"),
            };
            notes.push(format!(
                "{noun} {} {verb} properties that an earlier animation drives, and {} not play; choose one with --animation",
                named.join(", "),
                if skipped.len() == 1 { "does" } else { "do" },
            ));
        }
        playing
    }

    /// Applies an animation at `time` in seconds, clamped to the first and last key.
    pub(super) fn animate(
        &self,
        poses: &mut [Pose],
        animation: usize,
        time: f64,
        notes: &mut Vec<String>,
    ) -> Result<(), GltfError> {
        let location = |channel: usize| format!("animations[{animation}].channels[{channel}]");
        let animation = &self.json.animations[animation];
        let mut weight_count = 0;
        let mut driven = HashSet::new();
        let (mut equal_times, mut repeated_target) = (None, None);
        for (i, channel) in animation.channels.iter().enumerate() {
            let node = channel.target.node.value();
            let sampler = animation.samplers.get(channel.sampler.value());
            let (Some(pose), Some(sampler)) = (poses.get_mut(node), sampler) else {
                return Err(self.fault(
                    location(i),
                    "refers to a node or a sampler that does not exist".to_owned(),
                ));
            };
            let times = self.vectors::<1>(sampler.input.value())?;
            let times: Vec<f64> = times.iter().map(|[time]| f64::from(*time)).collect();
            if times.is_empty() || !times.is_sorted() || !times.iter().all(|time| time.is_finite()) {
                return Err(self.fault(
                    location(i),
                    "the times must be finite and in ascending order".to_owned(),
                ));
            }
            if times.windows(2).any(|pair| pair[0] == pair[1]) {
                equal_times.get_or_insert(i);
            }
            if let Checked::Valid(path) = channel.target.path
                && !driven.insert((node, path as u8))
            {
                repeated_target.get_or_insert(i);
            }
            let Checked::Valid(interpolation) = sampler.interpolation else {
                return Err(self.fault(location(i), "unknown interpolation".to_owned()));
            };
            let interval = KeyInterval::of(&times, time, interpolation);
            let wrong_count = |found: usize| {
                let expected = interval.value_count(times.len());
                self.fault(
                    location(i),
                    format!("number of output values: {found}; expected {expected}"),
                )
            };
            match channel.target.path {
                Checked::Valid(Property::Translation) => {
                    let values = self.vectors::<3>(sampler.output.value())?;
                    let value = interval
                        .value(&values, times.len())
                        .ok_or_else(|| wrong_count(values.len()))?;
                    pose.decompose();
                    pose.translation = DVec3::from_array(value);
                }
                Checked::Valid(Property::Scale) => {
                    let values = self.vectors::<3>(sampler.output.value())?;
                    let value = interval
                        .value(&values, times.len())
                        .ok_or_else(|| wrong_count(values.len()))?;
                    pose.decompose();
                    pose.scale = DVec3::from_array(value);
                }
                Checked::Valid(Property::Rotation) => {
                    let values = self.vectors::<4>(sampler.output.value())?;
                    let value = interval
                        .rotation(&values, times.len())
                        .ok_or_else(|| wrong_count(values.len()))?;
                    pose.decompose();
                    pose.rotation = value;
                }
                Checked::Valid(Property::MorphTargetWeights) => {
                    let values = self.vectors::<1>(sampler.output.value())?;
                    let node_weights = interval
                        .weights(&values, times.len())
                        .ok_or_else(|| wrong_count(values.len()))?;
                    weight_count += node_weights.len();
                    if weight_count > MAX_WEIGHTS {
                        let rule = format!("all nodes together must have at most {MAX_WEIGHTS} weights");
                        return Err(self.fault(location(i), rule));
                    }
                    pose.weights = Some(node_weights);
                }
                Checked::Invalid => {} // a property of an extension
            }
        }
        if let Some(i) = equal_times {
            notes.push(format!(
                "{}: some times are equal; the last key of equal times is used",
                location(i)
            ));
        }
        if let Some(i) = repeated_target {
            notes.push(format!(
                "{}: drives the same property as an earlier channel; the last channel is used",
                location(i)
            ));
        }
        Ok(())
    }
}

impl Pose {
    /// Replaces a matrix by scale, rotation and translation. Only invalid files need this: the specification does not
    /// allow matrices on animated nodes.
    fn decompose(&mut self) {
        if let Some(matrix) = self.matrix.take() {
            (self.scale, self.rotation, self.translation) = matrix.to_scale_rotation_translation();
        }
    }
}

struct KeyInterval {
    interpolation: Interpolation,
    keys: [usize; 2],
    /// Position in the key interval, 0 to 1.
    fraction: f64,
    /// Length of the key interval in seconds.
    seconds: f64,
}

impl KeyInterval {
    fn of(times: &[f64], time: f64, interpolation: Interpolation) -> KeyInterval {
        let last = times.len() - 1;
        let next = times.partition_point(|key| *key <= time);
        let keys = match next {
            0 => [0, 0],
            next if next > last => [last, last],
            next => [next - 1, next],
        };
        let seconds = times[keys[1]] - times[keys[0]];
        let fraction = if seconds > 0.0 {
            (time - times[keys[0]]) / seconds
        } else {
            0.0
        };
        KeyInterval {
            interpolation,
            keys,
            fraction,
            seconds,
        }
    }

    fn value_count(&self, keys: usize) -> usize {
        match self.interpolation {
            Interpolation::CubicSpline => 3 * keys, // in-tangent, value and out-tangent
            _ => keys,
        }
    }

    fn value<const N: usize>(&self, values: &[[f32; N]], keys: usize) -> Option<[f64; N]> {
        if values.len() != self.value_count(keys) {
            return None;
        }
        let mut result = [0.0; N];
        for (k, component) in result.iter_mut().enumerate() {
            *component = self.interpolate(|i| f64::from(values[i][k]));
        }
        Some(result)
    }

    fn rotation(&self, values: &[[f32; 4]], keys: usize) -> Option<DQuat> {
        if self.interpolation != Interpolation::Linear {
            return self
                .value(values, keys)
                .map(|value| quaternion(value.map(|x| x as f32)));
        }
        if values.len() != keys {
            return None;
        }
        let [a, b] = self.keys.map(|key| quaternion(values[key]));
        Some(a.slerp(b, self.fraction)) // along the shorter arc
    }

    fn weights(&self, values: &[[f32; 1]], keys: usize) -> Option<Vec<f32>> {
        let values_per_weight = self.value_count(keys);
        let count = values.len() / values_per_weight;
        if count * values_per_weight != values.len() {
            return None;
        }
        let weights = (0..count).map(|k| self.interpolate(|i| f64::from(values[i * count + k][0])) as f32);
        Some(weights.collect())
    }

    /// Interpolates a scalar; `value` returns the output value with an index. A cubic spline has three values per key.
    fn interpolate(&self, value: impl Fn(usize) -> f64) -> f64 {
        let ([a, b], t) = (self.keys, self.fraction);
        match self.interpolation {
            Interpolation::Step => value(a),
            Interpolation::Linear if a == b => value(a),
            Interpolation::Linear => value(a) * (1.0 - t) + value(b) * t,
            Interpolation::CubicSpline => {
                // Cubic Hermite spline (appendix C.5).
                let (t2, t3) = (t * t, t * t * t);
                let (out_tangent, in_tangent) = (value(3 * a + 2) * self.seconds, value(3 * b) * self.seconds);
                (2.0 * t3 - 3.0 * t2 + 1.0) * value(3 * a + 1)
                    + (t3 - 2.0 * t2 + t) * out_tangent
                    + (3.0 * t2 - 2.0 * t3) * value(3 * b + 1)
                    + (t3 - t2) * in_tangent
            }
        }
    }
}
