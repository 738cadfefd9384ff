// Equirectangular mapping of the environment map, and its cells. The center is +x, left and right edges are -x, the
// upper edge is +z. A cell lies between the centers of four texels, or of two texels and a pole.

// A point in a cell. Rows have `width` cells. The map has one more row of cells than rows of texels.
struct EnvironmentCell {
    column: u32,
    row: u32,
    x: f32,                // position in the cell, 0 to 1
    y: f32,
}

fn cell_towards(d: vec3f, width: u32, height: u32) -> EnvironmentCell {
    let u = (0.5 - atan2(d.y, d.x) * 0.15915494) * f32(width) - 0.5;
    let v = atan2(sqrt(d.x * d.x + d.y * d.y), d.z) * 0.31830987 * f32(height) + 0.5;
    let column = floor(u);
    let row = min(floor(v), f32(height));
    // The first and the last row have half the height: `fraction` is 1/2 to 1 in the first row, 0 to 1/2 in the last.
    let fraction = v - row;
    let is_first = row == 0.0;
    let is_last = row == f32(height);
    let y = select(select(fraction, 2.0 * fraction, is_last), 2.0 * fraction - 1.0, is_first);
    let clamped_y = min(max(y, 0.0), 1.0);
    return EnvironmentCell(u32(select(f32(width) - 1.0, column, column >= 0.0)), u32(row), u - column, clamped_y);
}

// Returns the next column, wrapped around the edge.
fn column_after(column: u32, width: u32) -> u32 {
    return select(column + 1u, 0u, column + 1u == width);
}

// Returns 1 - cos(angle) from the pole to the upper border of `row`, without cancellation near the pole.
fn cap_above(row: u32, height: u32) -> f32 {
    let from_pole = max(f32(row) - 0.5, 0.0) / f32(height);
    let s = sine(0.5 * min(from_pole, 1.0));
    return 2.0 * s * s;
}

// Returns a normal's bin: the nearest point of a grid on the octahedral map; the grid includes the axes. Cigolle et
// al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014. The last bin is for the
// normal 0.
fn normal_bin(normal: vec3f) -> u32 {
    let sum = abs(normal.x) + abs(normal.y) + abs(normal.z);
    let x = normal.x / sum;
    let y = normal.y / sum;
    let folded_x = select(abs(y) - 1.0, 1.0 - abs(y), x >= 0.0);
    let folded_y = select(abs(x) - 1.0, 1.0 - abs(x), y >= 0.0);
    let last = f32(NORMAL_BINS - 1u);
    let column = (select(folded_x, x, normal.z >= 0.0) * 0.5 + 0.5) * last + 0.5;
    let row = (select(folded_y, y, normal.z >= 0.0) * 0.5 + 0.5) * last + 0.5;
    let bin = u32(min(max(row, 0.0), last)) * NORMAL_BINS + u32(min(max(column, 0.0), last));
    return select(NORMAL_BINS * NORMAL_BINS, bin, sum > 0.0);
}

// Returns the direction to the point u of a cell, uniform over the solid angle for uniform u. The length is 1 within
// 1e-6.
fn direction_in_cell(column: u32, row: u32, u: vec2f, width: u32, height: u32) -> vec3f {
    let turn = 1.0 - 2.0 * ((f32(column) + 0.5 + u.x) / f32(width));
    let is_lower_half = row > height / 2u;
    let from_pole = select(row, height - row, is_lower_half);
    let inner = cap_above(from_pole, height);
    let cap = inner + (cap_above(from_pole + 1u, height) - inner) * u.y;
    let radius = sqrt(max(cap * (2.0 - cap), 0.0));
    let z = 1.0 - cap;
    return vec3f(radius * sine(turn + 0.5), radius * sine(turn), select(z, -z, is_lower_half));
}
