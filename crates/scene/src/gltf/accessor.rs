//! glTF accessors (specification, section 3.6.2): typed buffer data as `f32` and `u32`.

use gltf_json::accessor::sparse::Sparse;
use gltf_json::accessor::{Accessor, ComponentType, Type};
use gltf_json::validation::Checked;

use super::budget::Resource;
use super::document::Document;
use super::error::{GltfError, GltfFault};
use super::extension;
use super::json::out_of_range;

/// Maximum element count of an accessor without a buffer view.
const MAX_ZEROS: u64 = 1 << 22;
/// Maximum decoded size of an accessor without a buffer view, in bytes.
const MAX_ZEROS_BYTES: u64 = 64 << 20;
/// Bytes charged to the budget per read in addition to the data, which limits the number of small reads.
const READ_OVERHEAD: u64 = 64;

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
    fn column_stride(self) -> usize {
        let bytes = self.rows * self.component.size();
        if self.columns == 1 {
            bytes
        } else {
            bytes.next_multiple_of(4)
        }
    }

    /// Packed element stride in bytes.
    fn size(self) -> usize {
        self.column_stride() * self.columns
    }

    /// Element size without trailing padding, in bytes.
    fn unpadded_size(self) -> usize {
        self.column_stride() * (self.columns - 1) + self.rows * self.component.size()
    }

    fn component_count(self) -> usize {
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
    /// Checks that `count` elements are within `bytes`. `view` is the name of `bytes` in errors.
    fn in_bytes<'a>(
        key: &str,
        (bytes, view): (&'a [u8], &str),
        offset: u64,
        count: u64,
        stride: Option<usize>,
        layout: Layout,
    ) -> Result<Elements<'a>, GltfFault> {
        let size = layout.size();
        let stride = stride.unwrap_or(size);
        if stride < layout.unpadded_size() {
            let rule = format!("the stride of {stride} bytes must be at least {size}, the size of an element");
            return Err(GltfFault::key(key, rule));
        }
        let last = count.saturating_sub(1);
        let needed = (stride as u64).checked_mul(last);
        let needed = needed.and_then(|bytes| bytes.checked_add(layout.unpadded_size() as u64));
        let end = needed.and_then(|bytes| bytes.checked_add(offset));
        let available = bytes.len() as u64;
        if count > 0 && end.is_none_or(|end| end > available) || offset > available {
            return Err(GltfFault::key(
                key,
                format!(
                    "count {count}, element size {size}, stride {stride} and offset {offset} exceed the {available} bytes of {view}"
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

    fn gather<const N: usize, const S: usize>(&self, convert: impl Fn([u8; S]) -> f32) -> Vec<[f32; N]> {
        let column_stride = self.layout.column_stride();
        let offsets: [usize; N] =
            std::array::from_fn(|k| k / self.layout.rows * column_stride + k % self.layout.rows * S);
        let unpadded_size = self.layout.unpadded_size();
        (0..self.count)
            .map(|i| {
                let element = &self.bytes[i * self.stride..][..unpadded_size];
                offsets.map(|offset| {
                    let mut component = [0; S];
                    component.copy_from_slice(&element[offset..offset + S]);
                    convert(component)
                })
            })
            .collect()
    }

    fn integers(&self) -> Vec<u32> {
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
    /// Returns the number of components per element: 3 for VEC3, 16 for MAT4.
    pub fn components(&self, accessor: usize) -> Result<usize, GltfError> {
        let layout = self
            .accessor(accessor)
            .and_then(|(key, accessor)| Layout::of(&key, accessor));
        layout
            .map(Layout::component_count)
            .map_err(|fault| fault.of(&self.path))
    }

    /// Returns the elements of an accessor with `N` components per element. Matrices are column-major. Normalized
    /// integers are mapped to -1 ... 1 or 0 ... 1; floats may be NaN or infinite.
    pub fn vectors<const N: usize>(&self, accessor: usize) -> Result<Vec<[f32; N]>, GltfError> {
        self.floats(accessor).map_err(|fault| fault.of(&self.path))
    }

    /// Returns the elements as indices. The primitive restart value is an error.
    pub fn indices(&self, accessor: usize) -> Result<Vec<u32>, GltfError> {
        self.integers(accessor).map_err(|fault| fault.of(&self.path))
    }

    fn accessor(&self, index: usize) -> Result<(String, &Accessor), GltfFault> {
        let accessors = &self.json.accessors;
        let accessor = accessors
            .get(index)
            .ok_or_else(|| out_of_range("accessors", index, "accessors", accessors.len()))?;
        Ok((format!("accessors[{index}]"), accessor))
    }

    fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, GltfFault> {
        let (key, accessor) = self.accessor(index)?;
        let layout = Layout::of(&key, accessor)?;
        if layout.component_count() != N {
            let rule = format!(
                "number of components of the elements: {}; expected {N}",
                layout.component_count()
            );
            return Err(GltfFault::key(format!("{key}.type"), rule));
        }
        let elements = self.elements(&key, accessor, layout)?;
        self.charge_read(&key, accessor, 4 * N)?;
        let mut vectors = match elements {
            Some(elements) => elements.vectors(),
            None => vec![[0.0; N]; accessor.count.0 as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            let (sparse_indices, values) = self.sparse_elements(&key, accessor, sparse, layout)?;
            for (i, value) in sparse_indices.into_iter().zip(values.vectors()) {
                vectors[i as usize] = value;
            }
        }
        Ok(vectors)
    }

    fn integers(&self, index: usize) -> Result<Vec<u32>, GltfFault> {
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
        if layout.component_count() != 1 {
            return Err(GltfFault::key(format!("{key}.type"), "indices must be SCALAR"));
        }
        let elements = self.elements(&key, accessor, layout)?;
        self.charge_read(&key, accessor, size_of::<u32>())?;
        let mut indices = match elements {
            Some(elements) => elements.integers(),
            None => vec![0; accessor.count.0 as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            let (sparse_indices, values) = self.sparse_elements(&key, accessor, sparse, layout)?;
            for (k, value) in sparse_indices.into_iter().zip(values.integers()) {
                indices[k as usize] = value;
            }
        }
        match indices.iter().position(|index| *index == restart) {
            None => Ok(indices),
            Some(i) => {
                let rule = "the primitive restart value; an index must be less than this value";
                Err(GltfFault::key(key, format!("element {i} is {restart}, {rule}")))
            }
        }
    }

    /// Charges the elements of an accessor, decoded to `size` bytes each, to the budget.
    fn charge_read(&self, key: &str, accessor: &Accessor, size: usize) -> Result<(), GltfFault> {
        let bytes = accessor
            .count
            .0
            .saturating_mul(size as u64)
            .saturating_add(READ_OVERHEAD);
        let charge = self.budget.take(Resource::Read, bytes);
        charge.map_err(|rule| GltfFault::key(format!("{key}.count"), rule))
    }

    /// Returns the elements of an accessor; `None` if the accessor has no buffer view: then all elements are zero.
    fn elements(&self, key: &str, accessor: &Accessor, layout: Layout) -> Result<Option<Elements<'_>>, GltfFault> {
        let count = accessor.count.0;
        let Some(view) = accessor.buffer_view else {
            let unsupported = accessor
                .extensions
                .as_ref()
                .and_then(|all| extension::unsupported(&all.others));
            if let Some(name) = unsupported.filter(|_| accessor.sparse.is_none()) {
                return Err(extension::only_data_fault(key, name));
            }
            let max_count = MAX_ZEROS.min(MAX_ZEROS_BYTES / (4 * layout.component_count() as u64));
            if count > max_count {
                let rule = format!("{count} elements without a bufferView; there must be at most {max_count}");
                return Err(GltfFault::key(format!("{key}.count"), rule));
            }
            return Ok(None);
        };
        let view = view.value();
        let stride = self.json.buffer_views.get(view).and_then(|view| view.byte_stride);
        let bytes = (self.view_bytes(view)?, &*format!("bufferViews[{view}]"));
        let offset = accessor.byte_offset.unwrap_or_default().0;
        Elements::in_bytes(key, bytes, offset, count, stride.map(|stride| stride.0), layout).map(Some)
    }

    /// Returns the indices and values of the sparse elements.
    fn sparse_elements(
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
        let index_layout = Layout {
            component: component.0,
            rows: 1,
            columns: 1,
            is_normalized: false,
        };
        let view = sparse.indices.buffer_view.value();
        let bytes = (self.view_bytes(view)?, &*format!("bufferViews[{view}]"));
        let indices =
            Elements::in_bytes(&key, bytes, sparse.indices.byte_offset.0, count, None, index_layout)?.integers();
        for (i, index) in indices.iter().enumerate() {
            if i > 0 && *index <= indices[i - 1] {
                let rule = format!("element {i} is {index}; it must be greater than the previous element");
                return Err(GltfFault::key(key, rule));
            }
            if u64::from(*index) >= accessor.count.0 {
                let rule = format!(
                    "element {i} is {index}; it must be less than {}, the count of all elements",
                    accessor.count.0
                );
                return Err(GltfFault::key(key, rule));
            }
        }
        let key = key.replace("indices", "values");
        let view = sparse.values.buffer_view.value();
        let bytes = (self.view_bytes(view)?, &*format!("bufferViews[{view}]"));
        let values = Elements::in_bytes(&key, bytes, sparse.values.byte_offset.0, count, None, layout)?;
        Ok((indices, values))
    }
}

#[cfg(test)]
mod tests;
