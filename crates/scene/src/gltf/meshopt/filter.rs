//! Filters of decoded meshopt attributes (`KHR_meshopt_compression`, appendix B).

/// A filter with a validated stride.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

impl Filter {
    /// Applies the filter in place. Results of invalid values are unspecified.
    pub fn apply(self, bytes: &mut [u8], stride: usize) {
        match (self, stride) {
            (Filter::None, _) => {}
            (Filter::Octahedral, 4) => map_elements(bytes, |v: [i8; 4]| {
                octahedral(v.map(f32::from), 127.0, v[3], |x| x as i8)
            }),
            (Filter::Octahedral, _) => map_elements(bytes, |v: [i16; 4]| {
                octahedral(v.map(f32::from), 32767.0, v[3], |x| x as i16)
            }),
            (Filter::Quaternion, _) => map_elements(bytes, quaternion),
            (Filter::Exponential, _) => {
                for word in bytes.as_chunks_mut::<4>().0 {
                    *word = exponential(i32::from_le_bytes(*word)).to_le_bytes();
                }
            }
            (Filter::Color, 4) => map_elements(bytes, |v: [i8; 4]| {
                let [y, _, _, a] = v.map(|x| i32::from(x as u8));
                let rgba = color(y, i32::from(v[1]), i32::from(v[2]), a, 255.0);
                rgba.map(|x| (x as u8) as i8)
            }),
            (Filter::Color, _) => map_elements(bytes, |v: [i16; 4]| {
                let [y, _, _, a] = v.map(|x| i32::from(x as u16));
                let rgba = color(y, i32::from(v[1]), i32::from(v[2]), a, 65535.0);
                rgba.map(|x| (x as u16) as i16)
            }),
        }
    }
}

trait Component: Copy {
    const SIZE: usize;
    fn read(bytes: &[u8]) -> Self;
    fn write(self, bytes: &mut [u8]);
}

impl Component for i8 {
    const SIZE: usize = 1;
    fn read(bytes: &[u8]) -> i8 {
        bytes[0] as i8
    }
    fn write(self, bytes: &mut [u8]) {
        bytes[0] = self as u8;
    }
}

impl Component for i16 {
    const SIZE: usize = 2;
    fn read(bytes: &[u8]) -> i16 {
        i16::from_le_bytes([bytes[0], bytes[1]])
    }
    fn write(self, bytes: &mut [u8]) {
        bytes.copy_from_slice(&self.to_le_bytes());
    }
}

fn map_elements<T: Component>(bytes: &mut [u8], convert: impl Fn([T; 4]) -> [T; 4]) {
    let size = T::SIZE;
    for element in bytes.chunks_exact_mut(4 * size) {
        let converted = convert(std::array::from_fn(|k| T::read(&element[k * size..])));
        for (value, bytes) in converted.into_iter().zip(element.chunks_exact_mut(size)) {
            value.write(bytes);
        }
    }
}

/// Decodes an octahedral unit vector whose third component is the scale; the last component is unchanged.
fn octahedral<T>([x, y, scale, _]: [f32; 4], max: f32, last: T, to_integer: impl Fn(f32) -> T) -> [T; 4] {
    let (x, y) = (x / scale, y / scale);
    let z = 1.0 - x.abs() - y.abs();
    let t = z.min(0.0);
    let (x, y) = (x - t.copysign(x), y - t.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x, y, z].map(|x| to_integer((x / length * max).round()));
    [x, y, z, last]
}

fn quaternion(v: [i16; 4]) -> [i16; 4] {
    let scale = f32::from(v[3] | 3);
    let range = 1.0 / 2f32.sqrt();
    let [x, y, z] = [v[0], v[1], v[2]].map(|x| f32::from(x) / scale * range);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let omitted = usize::from(v[3] as u16 & 3);
    let mut result = [0; 4];
    for (k, x) in [w, x, y, z].into_iter().enumerate() {
        result[(omitted + k) % 4] = (x * 32767.0).round() as i16;
    }
    result
}

fn exponential(value: i32) -> f32 {
    let (exponent, mantissa) = (value >> 24, value << 8 >> 8);
    // The clamped exponent avoids subnormal numbers; the specification allows -100 to 100.
    let power = f32::from_bits(((exponent.max(-126) + 127) as u32) << 23);
    power * mantissa as f32
}

/// Decodes a YCoCg color. The highest set bit of alpha determines the bit depth.
fn color(y: i32, co: i32, cg: i32, a: i32, max: f32) -> [f32; 4] {
    let bits = 32 - a.leading_zeros();
    let max_code = (1 << bits) - 1;
    let alpha = a & (max_code >> 1);
    let alpha = alpha << 1 | alpha & 1;
    let scale = max / max_code as f32;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|x| (x as f32 * scale).round())
}
