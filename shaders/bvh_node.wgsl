// A node of an 8-wide BVH with quantized child boxes: Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on
// GPUs Through Compressed Wide BVHs", HPG 2017, section 3.

// Unpacks one coordinate of four children.
fn steps(word: u32) -> vec4f {
    return vec4f(f32(word & 0xffu), f32((word >> 8u) & 0xffu), f32((word >> 16u) & 0xffu), f32(word >> 24u));
}

fn step_length(node: Node, axis: u32) -> f32 {
    return bitcast<f32>(((node.scales >> (8u * axis)) & 0xffu) << 23u);
}

fn larger(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a > b);
}

fn smaller(a: vec4f, b: vec4f) -> vec4f {
    return select(b, a, a < b);
}

// Returns the mask of nonempty intervals that overlap [0, limit].
fn hit_bits(near: vec4f, far: vec4f, limit: f32) -> u32 {
    let is_hit = (near <= far) & (far >= vec4f(0.0)) & (near <= vec4f(limit));
    return select(0u, 1u, is_hit.x) | select(0u, 2u, is_hit.y) | select(0u, 4u, is_hit.z) | select(0u, 8u, is_hit.w);
}

fn children_hit(node: Node, s: Slabs, limit: f32) -> u32 {
    let first = four_hit(node, vec3u(node.low_x.x, node.low_y.x, node.low_z.x),
                            vec3u(node.high_x.x, node.high_y.x, node.high_z.x), s, limit);
    let second = four_hit(node, vec3u(node.low_x.y, node.low_y.y, node.low_z.y),
                             vec3u(node.high_x.y, node.high_y.y, node.high_z.y), s, limit);
    return first | (second << 4u);
}

fn four_hit(node: Node, low: vec3u, high: vec3u, s: Slabs, limit: f32) -> u32 {
    let x = step_length(node, 0u);
    let y = step_length(node, 1u);
    let z = step_length(node, 2u);
    let low_x = (node.base.x + steps(low.x) * x - s.low_origin.x) * s.inverse.x;
    let high_x = (node.base.x + steps(high.x) * x - s.high_origin.x) * s.inverse.x;
    let low_y = (node.base.y + steps(low.y) * y - s.low_origin.y) * s.inverse.y;
    let high_y = (node.base.y + steps(high.y) * y - s.high_origin.y) * s.inverse.y;
    let low_z = (node.base.z + steps(low.z) * z - s.low_origin.z) * s.inverse.z;
    let high_z = (node.base.z + steps(high.z) * z - s.high_origin.z) * s.inverse.z;
    let near = larger(larger(smaller(low_x, high_x), smaller(low_y, high_y)), smaller(low_z, high_z));
    let far = smaller(smaller(larger(low_x, high_x), larger(low_y, high_y)), larger(low_z, high_z));
    return hit_bits(near, far, limit);
}

// Returns the mask of children that any ray of the interval may hit.
fn children_in_interval(node: Node, rays: RayInterval, limit: f32) -> u32 {
    let first = four_in_interval(node, vec3u(node.low_x.x, node.low_y.x, node.low_z.x),
                            vec3u(node.high_x.x, node.high_y.x, node.high_z.x), rays, limit);
    let second = four_in_interval(node, vec3u(node.low_x.y, node.low_y.y, node.low_z.y),
                             vec3u(node.high_x.y, node.high_y.y, node.high_z.y), rays, limit);
    return first | (second << 4u);
}

fn four_in_interval(node: Node, low: vec3u, high: vec3u, rays: RayInterval, limit: f32) -> u32 {
    let x = step_length(node, 0u);
    let y = step_length(node, 1u);
    let z = step_length(node, 2u);
    let low_x = node.base.x + steps(low.x) * x - rays.low_origin.x;
    let high_x = node.base.x + steps(high.x) * x - rays.high_origin.x;
    let low_y = node.base.y + steps(low.y) * y - rays.low_origin.y;
    let high_y = node.base.y + steps(high.y) * y - rays.high_origin.y;
    let low_z = node.base.z + steps(low.z) * z - rays.low_origin.z;
    let high_z = node.base.z + steps(high.z) * z - rays.high_origin.z;
    let near_x = larger(low_x * rays.near_low.x, high_x * rays.near_high.x);
    let near_y = larger(low_y * rays.near_low.y, high_y * rays.near_high.y);
    let near_z = larger(low_z * rays.near_low.z, high_z * rays.near_high.z);
    let far_x = far_side(low_x, high_x, rays.far_low.x, rays.far_high.x);
    let far_y = far_side(low_y, high_y, rays.far_low.y, rays.far_high.y);
    let far_z = far_side(low_z, high_z, rays.far_low.z, rays.far_high.z);
    return hit_bits(larger(larger(near_x, near_y), near_z), smaller(smaller(far_x, far_y), far_z), limit);
}

// Returns the largest t at which any ray of the interval leaves a box along an axis.
fn far_side(low: vec4f, high: vec4f, far_low: f32, far_high: f32) -> vec4f {
    let is_unbounded = (far_low == 0.0) & (far_high == 0.0);
    return select(low * far_low + high * far_high, vec4f(INFINITE_T), is_unbounded);
}

// Permutes the bits of slots to visiting order: bit i becomes the bit of slot i ^ octant. Bit k of an octant is set if
// the direction is negative along axis k, bit k of a slot if the box is on the upper side.
fn in_order(bits: u32, octant: u32) -> u32 {
    let after_x = select(bits, ((bits & 0x55u) << 1u) | ((bits >> 1u) & 0x55u), (octant & 1u) != 0u);
    let after_y = select(after_x, ((after_x & 0x33u) << 2u) | ((after_x >> 2u) & 0x33u), (octant & 2u) != 0u);
    return select(after_y, ((after_y & 0x0fu) << 4u) | ((after_y >> 4u) & 0x0fu), (octant & 4u) != 0u);
}

fn octant_of(direction: vec3f) -> u32 {
    return select(0u, 1u, direction.x < 0.0) | select(0u, 2u, direction.y < 0.0) | select(0u, 4u, direction.z < 0.0);
}

// Returns the first item and the number of items, which is 0 for an empty slot.
fn leaf_items(node: Node, slot: u32) -> vec2u {
    let word = select(node.leaves.x, node.leaves.y, slot >= 4u);
    let leaf = (word >> (8u * (slot & 3u))) & 0xffu;
    return vec2u(node.first_item + (leaf & 31u), leaf >> 5u);
}
