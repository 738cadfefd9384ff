// The buffers of every kernel, in groups by how often they change. At 1 of the first group is what a kernel writes, which is
// declared with it.

// With every call.
@group(0) @binding(0) var<uniform> params: DispatchParams;
@group(0) @binding(2) var<storage, read_write> completion: Completion;

// With the scene: its camera, its settings, and what it looks like.
@group(1) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(1) var<uniform> environment: Environment;
@group(1) @binding(2) var<uniform> counts: Counts;
@group(1) @binding(3) var<uniform> filter_table: array<vec4f, FILTER_BINS_MAX>;
@group(1) @binding(4) var<storage, read> records: array<vec4u>; // the rows of materials, lights and textures
@group(1) @binding(5) var<storage, read> texels: array<u32>;

// With the scene's shapes.
@group(2) @binding(0) var<storage, read> primitives: array<Primitive>;
@group(2) @binding(1) var<storage, read> bounds: array<Sphere>;
@group(2) @binding(2) var<storage, read> nodes: array<vec4u>; // the rows of trees, of their items and of instances
@group(2) @binding(3) var<storage, read> meshes: array<vec4u>; // the rows of triangles and vertices
