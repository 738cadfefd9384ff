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
    /// Returns the animations that do not drive a property of an earlier animation. The others are listed in `notes`.
    pub(super) fn compatible(&self, animations: Vec<usize>, notes: &mut Vec<String>) -> Vec<usize> {
        let mut driven = HashSet::new();
        let (mut playing, mut others) = (Vec::new(), Vec::new());
        for i in animations {
            let channels = self.json.animations[i].channels.iter();
            let properties = channels.filter_map(|channel| match channel.target.path {
                Checked::Valid(path) => Some((channel.target.node.value(), path as u8)),
                Checked::Invalid => None,
            });
            let own: HashSet<(usize, u8)> = properties.collect();
            match driven.is_disjoint(&own) {
                true => {
                    driven.extend(own);
                    playing.push(i);
                }
                false => others.push(i),
            }
        }
        if !others.is_empty() {
            let name = |i: &usize| match &self.json.animations[*i].name {
                Some(name) => format!("{i} ({name:?})"),
                None => i.to_string(),
            };
            let mut named: Vec<String> = others.iter().take(MAX_NAMED).map(name).collect();
            if others.len() > MAX_NAMED {
                named.push(format!("{} more", others.len() - MAX_NAMED));
            }
            let (what, verb) = match others.len() {
                1 => ("animation", "drives"),
                _ => ("animations", "drive"),
            };
            notes.push(format!(
                "{what} {} {verb} properties that an earlier animation drives, and {} not play; choose one with --animation",
                named.join(", "),
                if others.len() == 1 { "does" } else { "do" },
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
        let place = |channel: usize| format!("animations[{animation}].channels[{channel}]");
        let animation = &self.json.animations[animation];
        let mut weights = 0;
        let mut moved = HashSet::new();
        let (mut equal, mut twice) = (None, None);
        for (i, channel) in animation.channels.iter().enumerate() {
            let node = channel.target.node.value();
            let sampler = animation.samplers.get(channel.sampler.value());
            let (Some(pose), Some(sampler)) = (poses.get_mut(node), sampler) else {
                return Err(self.fault(place(i), "refers to a node or a sampler that does not exist".to_owned()));
            };
            let times = self.vectors::<1>(sampler.input.value())?;
            let times: Vec<f64> = times.iter().map(|[time]| f64::from(*time)).collect();
            if times.is_empty() || !times.is_sorted() || !times.iter().all(|time| time.is_finite()) {
                return Err(self.fault(place(i), "its times must be finite and increasing".to_owned()));
            }
            if times.windows(2).any(|pair| pair[0] == pair[1]) {
                equal.get_or_insert(i);
            }
            if let Checked::Valid(path) = channel.target.path
                && !moved.insert((node, path as u8))
            {
                twice.get_or_insert(i);
            }
            let Checked::Valid(interpolation) = sampler.interpolation else {
                return Err(self.fault(place(i), "its interpolation is unknown".to_owned()));
            };
            let between = KeyInterval::of(&times, time, interpolation);
            let fault = |got: usize| {
                let wanted = between.values(times.len());
                self.fault(place(i), format!("its output must have {wanted} values; it has {got}"))
            };
            match channel.target.path {
                Checked::Valid(Property::Translation) => {
                    let values = self.vectors::<3>(sampler.output.value())?;
                    let value = between.value(&values, times.len()).ok_or_else(|| fault(values.len()))?;
                    pose.take_apart();
                    pose.translation = DVec3::from_array(value);
                }
                Checked::Valid(Property::Scale) => {
                    let values = self.vectors::<3>(sampler.output.value())?;
                    let value = between.value(&values, times.len()).ok_or_else(|| fault(values.len()))?;
                    pose.take_apart();
                    pose.scale = DVec3::from_array(value);
                }
                Checked::Valid(Property::Rotation) => {
                    let values = self.vectors::<4>(sampler.output.value())?;
                    let value = between
                        .rotation(&values, times.len())
                        .ok_or_else(|| fault(values.len()))?;
                    pose.take_apart();
                    pose.rotation = value;
                }
                Checked::Valid(Property::MorphTargetWeights) => {
                    let values = self.vectors::<1>(sampler.output.value())?;
                    let found = between.list(&values, times.len()).ok_or_else(|| fault(values.len()))?;
                    weights += found.len();
                    if weights > MAX_WEIGHTS {
                        let rule = format!("all nodes together must have at most {MAX_WEIGHTS} weights");
                        return Err(self.fault(place(i), rule));
                    }
                    pose.weights = Some(found);
                }
                Checked::Invalid => {} // a property of an extension
            }
        }
        if let Some(i) = equal {
            notes.push(format!(
                "{}: some of its times are equal; the last of them is used",
                place(i)
            ));
        }
        if let Some(i) = twice {
            notes.push(format!(
                "{}: drives the same property as an earlier channel; the last one is used",
                place(i)
            ));
        }
        Ok(())
    }
}

impl Pose {
    /// Decomposes the matrix. The specification does not allow matrices on animated nodes.
    fn take_apart(&mut self) {
        if let Some(matrix) = self.matrix.take() {
            (self.scale, self.rotation, self.translation) = matrix.to_scale_rotation_translation();
        }
    }
}

struct KeyInterval {
    interpolation: Interpolation,
    keys: [usize; 2],
    /// Position in the key interval, 0 to 1.
    share: f64,
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
        let share = if seconds > 0.0 {
            (time - times[keys[0]]) / seconds
        } else {
            0.0
        };
        KeyInterval {
            interpolation,
            keys,
            share,
            seconds,
        }
    }

    fn values(&self, keys: usize) -> usize {
        match self.interpolation {
            Interpolation::CubicSpline => 3 * keys, // in-tangent, value and out-tangent
            _ => keys,
        }
    }

    fn value<const N: usize>(&self, values: &[[f32; N]], keys: usize) -> Option<[f64; N]> {
        if values.len() != self.values(keys) {
            return None;
        }
        let mut found = [0.0; N];
        for (k, found) in found.iter_mut().enumerate() {
            *found = self.number(|i| f64::from(values[i][k]));
        }
        Some(found)
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
        Some(a.slerp(b, self.share)) // along the shorter arc
    }

    fn list(&self, values: &[[f32; 1]], keys: usize) -> Option<Vec<f32>> {
        let each = self.values(keys);
        let count = values.len() / each;
        if count * each != values.len() {
            return None;
        }
        let found = (0..count).map(|k| self.number(|i| f64::from(values[i * count + k][0])) as f32);
        Some(found.collect())
    }

    /// Interpolates a scalar. A cubic spline has three output values per key.
    fn number(&self, at: impl Fn(usize) -> f64) -> f64 {
        let ([a, b], t) = (self.keys, self.share);
        match self.interpolation {
            Interpolation::Step => at(a),
            Interpolation::Linear if a == b => at(a),
            Interpolation::Linear => at(a) * (1.0 - t) + at(b) * t,
            Interpolation::CubicSpline => {
                // Cubic Hermite spline (appendix C.5).
                let (t2, t3) = (t * t, t * t * t);
                let (before, behind) = (at(3 * a + 2) * self.seconds, at(3 * b) * self.seconds);
                (2.0 * t3 - 3.0 * t2 + 1.0) * at(3 * a + 1)
                    + (t3 - 2.0 * t2 + t) * before
                    + (3.0 * t2 - 2.0 * t3) * at(3 * b + 1)
                    + (t3 - t2) * behind
            }
        }
    }
}
