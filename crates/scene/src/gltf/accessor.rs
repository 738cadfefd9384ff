//! glTF accessors (specification, section 3.6.2): typed buffer data as `f32` and `u32`.

use gltf_json::accessor::sparse::Sparse;
use gltf_json::accessor::{Accessor, ComponentType, Type};
use gltf_json::validation::Checked;

use super::budget::Resource;
use super::document::Document;
use super::error::{GltfError, GltfFault};
use super::extension;
use super::json::missing;

/// Maximum element count of an accessor without a buffer view.
const MAX_ZEROS: u64 = 1 << 22;
/// Maximum decoded size of an accessor without a buffer view, in bytes.
const MAX_ZEROS_BYTES: u64 = 64 << 20;
/// Bytes charged per read in addition to the data; limits the number of small reads.
const BESIDE: u64 = 64;

/// Element type and memory layout of an accessor.
#[derive(Clone, Copy)]
struct Layout {
    component: ComponentType,
    rows: usize,
    columns: usize,
    is_normalized: bool,
}

impl Layout {
    fn of(key: &str, accessor: &Accessor) -> Result<Layout, GltfFault> {
        let (Checked::Valid(component), Checked::Valid(kind)) = (accessor.component_type, accessor.type_) else {
            return Err(GltfFault::key(key, "unknown type"));
        };
        let (rows, columns) = match kind {
            Type::Scalar => (1, 1),
            Type::Vec2 => (2, 1),
            Type::Vec3 => (3, 1),
            Type::Vec4 => (4, 1),
            Type::Mat2 => (2, 2),
            Type::Mat3 => (3, 3),
            Type::Mat4 => (4, 4),
        };
        Ok(Layout {
            component: component.0,
            rows,
            columns,
            is_normalized: accessor.normalized,
        })
    }

    /// Column stride in bytes; columns are aligned to 4 bytes (section 3.6.2.4).
    fn column(self) -> usize {
        let bytes = self.rows * self.component.size();
        if self.columns == 1 {
            bytes
        } else {
            bytes.next_multiple_of(4)
        }
    }

    /// Packed element stride in bytes.
    fn size(self) -> usize {
        self.column() * self.columns
    }

    /// Element size without trailing padding, in bytes.
    fn used(self) -> usize {
        self.column() * (self.columns - 1) + self.rows * self.component.size()
    }

    fn count(self) -> usize {
        self.rows * self.columns
    }
}

struct Elements<'a> {
    bytes: &'a [u8],
    count: usize,
    stride: usize,
    layout: Layout,
}

impl Elements<'_> {
    /// Checks that `count` elements are within `bytes`. Error messages contain `place`.
    fn in_bytes<'a>(
        key: &str,
        (bytes, place): (&'a [u8], &str),
        offset: u64,
        count: u64,
        stride: Option<usize>,
        layout: Layout,
    ) -> Result<Elements<'a>, GltfFault> {
        let size = layout.size();
        let stride = stride.unwrap_or(size);
        if stride < layout.used() {
            let rule = format!("the stride of {stride} bytes must be at least the {size} of an element");
            return Err(GltfFault::key(key, rule));
        }
        let last = count.saturating_sub(1);
        let needed = (stride as u64).checked_mul(last);
        let needed = needed.and_then(|bytes| bytes.checked_add(layout.used() as u64));
        let end = needed.and_then(|bytes| bytes.checked_add(offset));
        let has = bytes.len() as u64;
        if count > 0 && end.is_none_or(|end| end > has) || offset > has {
            return Err(GltfFault::key(
                key,
                format!(
                    "{count} elements of {size} bytes, {stride} apart, from byte {offset} on; {place} has {has} bytes"
                ),
            ));
        }
        Ok(Elements {
            bytes: &bytes[offset as usize..],
            count: count as usize,
            stride,
            layout,
        })
    }

    fn vectors<const N: usize>(&self) -> Vec<[f32; N]> {
        let is_packed = self.stride == self.layout.size() && self.stride == 4 * N;
        match (self.layout.component, self.layout.is_normalized) {
            (ComponentType::F32, _) if is_packed => {
                let mut vectors = vec![[0.0f32; N]; self.count];
                let floats: &mut [u8] = bytemuck::cast_slice_mut(vectors.as_flattened_mut());
                floats.copy_from_slice(&self.bytes[..floats.len()]);
                if cfg!(target_endian = "big") {
                    for x in vectors.as_flattened_mut() {
                        *x = f32::from_bits(x.to_bits().swap_bytes());
                    }
                }
                vectors
            }
            (ComponentType::F32, _) => self.gather(f32::from_le_bytes),
            // Normalized integers (section 3.6.2.2).
            (ComponentType::I8, true) => self.gather(|[x]: [u8; 1]| (f32::from(x as i8) / 127.0).max(-1.0)),
            (ComponentType::U8, true) => self.gather(|[x]: [u8; 1]| f32::from(x) / 255.0),
            (ComponentType::I16, true) => self.gather(|x| (f32::from(i16::from_le_bytes(x)) / 32767.0).max(-1.0)),
            (ComponentType::U16, true) => self.gather(|x| f32::from(u16::from_le_bytes(x)) / 65535.0),
            (ComponentType::I8, false) => self.gather(|[x]: [u8; 1]| f32::from(x as i8)),
            (ComponentType::U8, false) => self.gather(|[x]: [u8; 1]| f32::from(x)),
            (ComponentType::I16, false) => self.gather(|x| f32::from(i16::from_le_bytes(x))),
            (ComponentType::U16, false) => self.gather(|x| f32::from(u16::from_le_bytes(x))),
            // The specification does not allow normalized 32-bit integers.
            (ComponentType::U32, _) => self.gather(|x| u32::from_le_bytes(x) as f32),
        }
    }

    fn gather<const N: usize, const S: usize>(&self, number: impl Fn([u8; S]) -> f32) -> Vec<[f32; N]> {
        let column = self.layout.column();
        let offsets: [usize; N] = std::array::from_fn(|k| k / self.layout.rows * column + k % self.layout.rows * S);
        let used = self.layout.used();
        (0..self.count)
            .map(|i| {
                let element = &self.bytes[i * self.stride..][..used];
                offsets.map(|offset| {
                    let mut component = [0; S];
                    component.copy_from_slice(&element[offset..offset + S]);
                    number(component)
                })
            })
            .collect()
    }

    fn whole(&self) -> Vec<u32> {
        let (bytes, stride) = (self.bytes, self.stride);
        let size = self.layout.component.size();
        let elements = (0..self.count).map(|i| &bytes[i * stride..][..size]);
        match size {
            1 => elements.map(|x| u32::from(x[0])).collect(),
            2 => elements.map(|x| u32::from(u16::from_le_bytes([x[0], x[1]]))).collect(),
            _ => elements.map(|x| u32::from_le_bytes([x[0], x[1], x[2], x[3]])).collect(),
        }
    }
}

impl Document {
    /// Returns the components per element: 3 for VEC3, 16 for MAT4.
    pub fn components(&self, accessor: usize) -> Result<usize, GltfError> {
        let layout = self
            .accessor(accessor)
            .and_then(|(key, accessor)| Layout::of(&key, accessor));
        layout.map(Layout::count).map_err(|fault| fault.of(&self.path))
    }

    /// Returns the elements of an accessor with `N` components, matrices column-major. Normalized integers become -1
    /// ... 1 or 0 ... 1; floats may be NaN or infinite.
    pub fn vectors<const N: usize>(&self, accessor: usize) -> Result<Vec<[f32; N]>, GltfError> {
        self.floats(accessor).map_err(|fault| fault.of(&self.path))
    }

    /// Returns the elements as indices. The primitive restart value is an error.
    pub fn indices(&self, accessor: usize) -> Result<Vec<u32>, GltfError> {
        self.whole(accessor).map_err(|fault| fault.of(&self.path))
    }

    fn accessor(&self, index: usize) -> Result<(String, &Accessor), GltfFault> {
        let all = &self.json.accessors;
        let accessor = all.get(index).ok_or_else(|| missing("accessors", index, all.len()))?;
        Ok((format!("accessors[{index}]"), accessor))
    }

    fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, GltfFault> {
        let (key, accessor) = self.accessor(index)?;
        let layout = Layout::of(&key, accessor)?;
        if layout.count() != N {
            let rule = format!("its elements have {} components; {N} are expected", layout.count());
            return Err(GltfFault::key(format!("{key}.type"), rule));
        }
        let elements = self.elements(&key, accessor, layout)?;
        self.may_read(&key, accessor, 4 * N)?;
        let mut vectors = match elements {
            Some(elements) => elements.vectors(),
            None => vec![[0.0; N]; accessor.count.0 as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            let (places, values) = self.replaced(&key, accessor, sparse, layout)?;
            for (place, value) in places.into_iter().zip(values.vectors()) {
                vectors[place as usize] = value;
            }
        }
        Ok(vectors)
    }

    fn whole(&self, index: usize) -> Result<Vec<u32>, GltfFault> {
        let (key, accessor) = self.accessor(index)?;
        let layout = Layout::of(&key, accessor)?;
        let restart = match layout.component {
            ComponentType::U8 => 0xff,
            ComponentType::U16 => 0xffff,
            ComponentType::U32 => u32::MAX,
            _ => {
                let rule = "indices must be unsigned bytes, shorts or ints";
                return Err(GltfFault::key(format!("{key}.componentType"), rule));
            }
        };
        if layout.count() != 1 {
            return Err(GltfFault::key(format!("{key}.type"), "indices must be SCALAR"));
        }
        let elements = self.elements(&key, accessor, layout)?;
        self.may_read(&key, accessor, size_of::<u32>())?;
        let mut indices = match elements {
            Some(elements) => elements.whole(),
            None => vec![0; accessor.count.0 as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            let (places, values) = self.replaced(&key, accessor, sparse, layout)?;
            for (place, value) in places.into_iter().zip(values.whole()) {
                indices[place as usize] = value;
            }
        }
        match indices.iter().position(|index| *index == restart) {
            None => Ok(indices),
            Some(i) => {
                let rule = "which would restart a strip: an index must be smaller";
                Err(GltfFault::key(key, format!("element {i} is {restart}, {rule}")))
            }
        }
    }

    /// Charges elements of `size` bytes to the budget.
    fn may_read(&self, key: &str, accessor: &Accessor, size: usize) -> Result<(), GltfFault> {
        let bytes = accessor.count.0.saturating_mul(size as u64).saturating_add(BESIDE);
        let room = self.budget.take(Resource::Read, bytes);
        room.map_err(|rule| GltfFault::key(format!("{key}.count"), rule))
    }

    /// Returns the elements of the buffer view; `None` for zeros.
    fn elements(&self, key: &str, accessor: &Accessor, layout: Layout) -> Result<Option<Elements<'_>>, GltfFault> {
        let count = accessor.count.0;
        let Some(view) = accessor.buffer_view else {
            let others = accessor
                .extensions
                .as_ref()
                .and_then(|all| extension::unknown(&all.others));
            if let Some(name) = others.filter(|_| accessor.sparse.is_none()) {
                return Err(extension::only_in(key, name));
            }
            let most = MAX_ZEROS.min(MAX_ZEROS_BYTES / (4 * layout.count() as u64));
            if count > most {
                let rule = format!("{count} elements without a bufferView; there must be at most {most}");
                return Err(GltfFault::key(format!("{key}.count"), rule));
            }
            return Ok(None);
        };
        let view = view.value();
        let stride = self.json.buffer_views.get(view).and_then(|view| view.byte_stride);
        let bytes = (self.bytes_of(view)?, &*format!("bufferViews[{view}]"));
        let offset = accessor.byte_offset.unwrap_or_default().0;
        Elements::in_bytes(key, bytes, offset, count, stride.map(|stride| stride.0), layout).map(Some)
    }

    /// Returns the indices and values of the sparse elements.
    fn replaced(
        &self,
        key: &str,
        accessor: &Accessor,
        sparse: &Sparse,
        layout: Layout,
    ) -> Result<(Vec<u32>, Elements<'_>), GltfFault> {
        let count = sparse.count.0;
        if count > accessor.count.0 {
            let rule = format!(
                "{count} must be at most {}, the count of all elements",
                accessor.count.0
            );
            return Err(GltfFault::key(format!("{key}.sparse.count"), rule));
        }
        let key = format!("{key}.sparse.indices");
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(GltfFault::key(key, "unknown type"));
        };
        let places = Layout {
            component: component.0,
            rows: 1,
            columns: 1,
            is_normalized: false,
        };
        let view = sparse.indices.buffer_view.value();
        let bytes = (self.bytes_of(view)?, &*format!("bufferViews[{view}]"));
        let places = Elements::in_bytes(&key, bytes, sparse.indices.byte_offset.0, count, None, places)?.whole();
        for (i, place) in places.iter().enumerate() {
            if i > 0 && *place <= places[i - 1] {
                let rule = format!("element {i} is {place}, which must be greater than the one before it");
                return Err(GltfFault::key(key, rule));
            }
            if u64::from(*place) >= accessor.count.0 {
                let rule = format!(
                    "element {i} is {place}, which is not there; there are {}",
                    accessor.count.0
                );
                return Err(GltfFault::key(key, rule));
            }
        }
        let key = key.replace("indices", "values");
        let view = sparse.values.buffer_view.value();
        let bytes = (self.bytes_of(view)?, &*format!("bufferViews[{view}]"));
        let values = Elements::in_bytes(&key, bytes, sparse.values.byte_offset.0, count, None, layout)?;
        Ok((places, values))
    }
}

#[cfg(test)]
mod tests;
