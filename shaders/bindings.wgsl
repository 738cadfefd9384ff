// The bindings of every kernel, in groups by how often they change. Each kernel declares its output, binding 1 of group
// 0.

// Changed by every dispatch.
@group(0) @binding(0) var<uniform> params: DispatchParams;
@group(0) @binding(2) var<storage, read_write> completion: Completion;

// Changed with the scene.
@group(1) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(1) var<uniform> environment: Environment;
@group(1) @binding(2) var<uniform> counts: Counts;
@group(1) @binding(3) var<uniform> filter_table: array<vec4f, FILTER_TABLE_SIZE>;
@group(1) @binding(4) var<storage, read> records: array<vec4u>; // records of materials, textures and lights
@group(1) @binding(5) var<storage, read> texels: array<u32>;

// Changed with the shapes of the scene.
@group(2) @binding(0) var<storage, read> primitives: array<Primitive>;
@group(2) @binding(1) var<storage, read> bounds: array<Sphere>;
@group(2) @binding(2) var<storage, read> nodes: array<vec4u>; // BVH nodes, BVH items, instances, group words
@group(2) @binding(3) var<storage, read> meshes: array<vec4u>; // triangles, vertices and their attributes
