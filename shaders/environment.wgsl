// The environment map and its importance sampling by radiance and clamped cosine.
//
// The map is divided into at most 32 x 32 blocks of cells. A block is selected in proportion to its irradiance on the
// surface, from cumulative distributions for 290 bins of normals. A cell of the block is selected in proportion to its
// mean radiance times its solid angle. Thus pdfs are exact, and a pixel's samples stay stratified over blocks.

struct EnvironmentEval {
    radiance: vec3f,
    pdf: f32,              // of `sample_environment`, per solid angle, including the emitter selection
}

// A sampled cell, and the position in it from 0 to 1.
struct EnvironmentPoint {
    column: u32,
    row: u32,
    position: vec2f,
}

// An interval of a cumulative distribution.
struct Interval {
    index: u32,
    width: f32,            // probability
    position: f32,         // of the random number in the interval, 0 to 1
}

fn environment_texel(row: u32, column: u32) -> vec3f {
    let start = environment.texels + 3u * (row * environment.width + column);
    return vec3f(bitcast<f32>(texel_word(start)), bitcast<f32>(texel_word(start + 1u)), bitcast<f32>(texel_word(start + 2u)));
}

fn environment_float(index: u32) -> f32 {
    return bitcast<f32>(texel_word(index));
}

// Returns the offset of a normal's distribution of block rows. The distributions of the blocks in each row follow.
fn block_distributions(normal: vec3f) -> u32 {
    let rows = (environment.height >> (environment.shifts >> 8u)) + 1u;
    return environment.blocks + rows * ENVIRONMENT_BLOCKS + normal_bin(normal) * (rows + 1u) * (ENVIRONMENT_BLOCKS + 1u);
}

// Finds the interval that contains u, among the 32 intervals of a cumulative distribution. Never returns an empty
// interval. `digits` extends the 24 binary digits of u.
fn interval_at(distribution: u32, u: f32, digits: f32) -> Interval {
    var entry = distribution;
    entry += select(0u, 16u, u >= environment_float(entry + 16u));
    entry += select(0u, 8u, u >= environment_float(entry + 8u));
    entry += select(0u, 4u, u >= environment_float(entry + 4u));
    entry += select(0u, 2u, u >= environment_float(entry + 2u));
    entry += select(0u, 1u, u >= environment_float(entry + 1u));
    let low = environment_float(entry);
    let width = environment_float(entry + 1u) - low;
    let position = ((u - low) + digits * 5.9604644775390625e-8) / width;
    return Interval(entry - distribution, width, min(position, 0.99999994));
}

fn interval_width(distribution: u32, index: u32) -> f32 {
    return environment_float(distribution + index + 1u) - environment_float(distribution + index);
}

// Returns the bilinearly interpolated radiance, and the pdf for a surface normal: the probability of sampling the map,
// times that of the block, times the cell's mean radiance divided by the block's integrated radiance.
fn environment_eval(direction: vec3f, normal: vec3f) -> EnvironmentEval {
    let d = vec3f(dot(environment.x, direction), dot(environment.y, direction), dot(environment.z, direction));
    let cell = cell_towards(d, environment.width, environment.height);
    return environment_at(cell, normal);
}

// Returns the radiance and the pdf at a point of a cell.
fn environment_at(cell: EnvironmentCell, normal: vec3f) -> EnvironmentEval {
    let next_column = column_after(cell.column, environment.width);
    let a = environment_texel(cell.row, cell.column);
    let b = environment_texel(cell.row, next_column);
    let c = environment_texel(cell.row + 1u, cell.column);
    let e = environment_texel(cell.row + 1u, next_column);
    let upper = a + (b - a) * cell.x;
    let lower = c + (e - c) * cell.x;
    let sum = a + b + c + e;
    let row = cell.row >> (environment.shifts >> 8u);
    let column = cell.column >> (environment.shifts & 255u);
    let rows = block_distributions(normal);
    let columns = rows + (row + 1u) * (ENVIRONMENT_BLOCKS + 1u);
    let probability = interval_width(rows, row) * interval_width(columns, column) * environment.density;
    let inverse = environment_float(environment.blocks + row * ENVIRONMENT_BLOCKS + column);
    return EnvironmentEval(upper + (lower - upper) * cell.y, (sum.x + sum.y + sum.z) * inverse * probability);
}

// Returns the MIS-weighted radiance of a ray that leaves the scene. `pdf` is the pdf of the ray's direction, and `eval`
// is evaluated for the normal of the surface where the ray starts.
fn environment_mis(eval: EnvironmentEval, pdf: f32) -> vec3f {
    return eval.radiance * select(1.0, power_heuristic(pdf, eval.pdf), pdf > 0.0);
}

// Samples a point of the map for a surface normal, or 0 if light may arrive from both sides. Inverts the distributions
// of rows and blocks, then selects a cell by Walker's alias method; the position in the block selects the entry of the
// alias table.
fn environment_point(normal: vec3f, u: vec2f) -> EnvironmentPoint {
    let bits = hash4(vec4u(bitcast<u32>(u.x), bitcast<u32>(u.y), 0u, 0u));
    let rows = block_distributions(normal);
    let row = interval_at(rows, u.y, unit_float(bits.y));
    let column = interval_at(rows + (row.index + 1u) * (ENVIRONMENT_BLOCKS + 1u), u.x, unit_float(bits.x));
    let width = environment.width;
    let height = environment.height;
    let row_shift = environment.shifts >> 8u;
    let column_shift = environment.shifts & 255u;
    let remaining = vec2u(width - (column.index << column_shift), height + 1u - (row.index << row_shift));
    let full = vec2u(1u << column_shift, 1u << row_shift);
    let size = select(remaining, full, full < remaining);
    let x = column.position * f32(size.x);
    let y = row.position * f32(size.y);
    let cell = vec2u(u32(x), u32(y));
    let cell_index = (row.index << row_shift) * width + size.y * (column.index << column_shift) + cell.y * size.x + cell.x;
    let entry = environment.cells + 2u * cell_index;
    let own_cell = ((row.index << row_shift) + cell.y) * 65536u + (column.index << column_shift) + cell.x;
    let selected_cell = select(texel_word(entry + 1u), own_cell, bits.z < texel_word(entry));
    let position = vec2f(x - f32(cell.x), y - f32(cell.y));
    return EnvironmentPoint(selected_cell & 65535u, selected_cell >> 16u, position);
}

// Samples a direction to the map. Radiance and pdf are evaluated as for BSDF samples, so that the pdfs agree.
fn sample_environment(light: Light, normal: vec3f, u: vec2f) -> LightSample {
    let point = environment_point(normal, u);
    let d = direction_in_cell(point.column, point.row, point.position, environment.width, environment.height);
    let direction = normalize(environment.x * d.x + environment.y * d.y + environment.z * d.z);
    let eval = environment_eval(direction, normal);
    return LightSample(direction, eval.radiance, eval.pdf, false, light.t_max, NO_INDEX);
}
