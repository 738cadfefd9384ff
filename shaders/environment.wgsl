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

// A cell of a block.
struct BlockCell {
    entry: u32,            // of the cell in the alias table: its offset
    cell: u32,             // row * 65536 + column
    position: vec2f,       // in the cell, 0 to 1
}

// The radiance at the corners of a cell.
struct CellCorners {
    a: vec3f,              // upper left
    b: vec3f,              // upper right
    c: vec3f,              // lower left
    e: vec3f,              // lower right
}

fn environment_texel(row: u32, column: u32) -> vec3f {
    let start = environment.texels + 3u * (row * environment.width + column);
    return vec3f(bitcast<f32>(texel_word(start)), bitcast<f32>(texel_word(start + 1u)), bitcast<f32>(texel_word(start + 2u)));
}

fn environment_float(index: u32) -> f32 {
    return bitcast<f32>(texel_word(index));
}

// Returns the offset of the distribution of block rows for a bin of normals. The distributions of the blocks in each row
// follow.
fn block_distributions(bin: u32) -> u32 {
    let rows = (environment.height >> (environment.shifts >> 8u)) + 1u;
    return environment.blocks + rows * ENVIRONMENT_BLOCKS + bin * ((rows + 1u) * (ENVIRONMENT_BLOCKS + 1u));
}

// Returns the interval that contains u, among the 32 intervals of a cumulative distribution. It is never empty.
fn interval_at(distribution: u32, u: f32) -> u32 {
    var entry = distribution;
    entry += select(0u, 16u, u >= environment_float(entry + 16u));
    entry += select(0u, 8u, u >= environment_float(entry + 8u));
    entry += select(0u, 4u, u >= environment_float(entry + 4u));
    entry += select(0u, 2u, u >= environment_float(entry + 2u));
    entry += select(0u, 1u, u >= environment_float(entry + 1u));
    return entry - distribution;
}

// Returns the position of u in an interval of a cumulative distribution, from 0 to less than 1. `digits` extends the 24
// binary digits of u.
fn interval_position(low: f32, high: f32, u: f32, digits: f32) -> f32 {
    return min(((u - low) + digits * 5.9604644775390625e-8) / (high - low), 0.99999994);
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
    let corners = CellCorners(
        environment_texel(cell.row, cell.column),
        environment_texel(cell.row, next_column),
        environment_texel(cell.row + 1u, cell.column),
        environment_texel(cell.row + 1u, next_column),
    );
    let block = block_terms(block_distributions(normal_bin(normal)), cell.row, cell.column);
    return cell_eval(corners, cell.x, cell.y, block.x, block.y);
}

// Returns the probability of the block of a cell, and the reciprocal of the block's integrated radiance.
fn block_terms(distributions: u32, cell_row: u32, cell_column: u32) -> vec2f {
    let row = cell_row >> (environment.shifts >> 8u);
    let column = cell_column >> (environment.shifts & 255u);
    let columns = distributions + (row + 1u) * (ENVIRONMENT_BLOCKS + 1u);
    let probability = interval_width(distributions, row) * interval_width(columns, column);
    return vec2f(probability, environment_float(environment.blocks + row * ENVIRONMENT_BLOCKS + column));
}

// Returns the radiance and the pdf at a point (x, y) of a cell, for the probability of its block and the reciprocal of
// the block's integrated radiance.
fn cell_eval(corners: CellCorners, x: f32, y: f32, probability: f32, inverse: f32) -> EnvironmentEval {
    let upper = corners.a + (corners.b - corners.a) * x;
    let lower = corners.c + (corners.e - corners.c) * x;
    let sum = corners.a + corners.b + corners.c + corners.e;
    let pdf = (sum.x + sum.y + sum.z) * inverse * (probability * environment.density);
    return EnvironmentEval(upper + (lower - upper) * y, pdf);
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
    let rows = block_distributions(normal_bin(normal));
    let row = interval_at(rows, u.y);
    let columns = rows + (row + 1u) * (ENVIRONMENT_BLOCKS + 1u);
    let column = interval_at(columns, u.x);
    let x = interval_position(environment_float(columns + column), environment_float(columns + column + 1u), u.x, unit_float(bits.x));
    let y = interval_position(environment_float(rows + row), environment_float(rows + row + 1u), u.y, unit_float(bits.y));
    let own = block_cell(row, column, vec2f(x, y));
    let cell = selected_cell(own.entry, own.cell, bits.z);
    return EnvironmentPoint(cell & 65535u, cell >> 16u, own.position);
}

// Returns the cell itself, or the alias in its entry of the table.
fn selected_cell(entry: u32, cell: u32, bits: u32) -> u32 {
    return select(texel_word(entry + 1u), cell, bits < texel_word(entry));
}

// Returns the cell at a position in a block, from 0 to 1.
fn block_cell(row: u32, column: u32, position: vec2f) -> BlockCell {
    let row_shift = environment.shifts >> 8u;
    let column_shift = environment.shifts & 255u;
    let first_row = row << row_shift;
    let first_column = column << column_shift;
    // Blocks at the right and the lower edge may be smaller.
    let columns = min(f32(environment.width - first_column), f32(1u << column_shift));
    let rows = min(f32(environment.height + 1u - first_row), f32(1u << row_shift));
    let x = position.x * columns;
    let y = position.y * rows;
    let cell_x = u32(x);
    let cell_y = u32(y);
    let index = first_row * environment.width + u32(rows) * first_column + cell_y * u32(columns) + cell_x;
    let cell = (first_row + cell_y) * 65536u + first_column + cell_x;
    return BlockCell(environment.cells + 2u * index, cell, vec2f(x - f32(cell_x), y - f32(cell_y)));
}

// Samples a direction to the map. Radiance and pdf are evaluated as for BSDF samples, so that the pdfs agree.
fn sample_environment(light: Light, normal: vec3f, u: vec2f) -> LightSample {
    let point = environment_point(normal, u);
    let d = direction_in_cell(point.column, point.row, point.position, environment.width, environment.height);
    let direction = normalize(environment.x * d.x + environment.y * d.y + environment.z * d.z);
    let eval = environment_eval(direction, normal);
    return LightSample(direction, eval.radiance, eval.pdf, false, light.t_max, NO_INDEX);
}
