// The buffers of every kernel. Binding 10 is what a kernel writes, and is declared with it.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<uniform> camera: Camera;
@group(0) @binding(2) var<uniform> environment: Environment;
@group(0) @binding(3) var<storage, read> primitives: array<Primitive>;
@group(0) @binding(4) var<storage, read> bounds: array<Sphere>;
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var<storage, read> lights: array<Light>;
@group(0) @binding(7) var<storage, read> textures: array<Texture>;
@group(0) @binding(8) var<storage, read> texels: array<u32>;
@group(0) @binding(9) var<uniform> filter_table: array<vec4f, BINS>;
@group(0) @binding(11) var<storage, read_write> receipt: Receipt;
