// Checker and line textures, filtered analytically. The textures combine a pulse in u and a pulse in v. A pulse has
// period 1: its value is 1 on the fraction `duty` of a period, else 0. A wave is a pulse minus its mean. The integrals
// of a wave, and the mean of the product of two waves over a parallelogram, have closed forms.

// Returns the mean fraction of the second color over the footprint.
fn procedural_share(kind: u32, line_width: f32, f: Footprint) -> f32 {
    let checker = kind == CHECKER;
    let scale = select(1.0, 0.5, checker);
    let duty = select(line_width, 0.5, checker);
    let shift = select(0.5 * line_width, 0.0, checker);
    let wide_x = !((abs(f.dx.x) + abs(f.dy.x)) * scale < MAX_EXTENT);
    let wide_y = !((abs(f.dx.y) + abs(f.dy.y)) * scale < MAX_EXTENT);
    let dx = vec2f(select(f.dx.x * scale, 0.0, wide_x), select(f.dx.y * scale, 0.0, wide_y));
    let dy = vec2f(select(f.dy.x * scale, 0.0, wide_x), select(f.dy.y * scale, 0.0, wide_y));
    let swap = dx.x * dx.x + dx.y * dx.y < dy.x * dy.x + dy.y * dy.y;
    let long = select(dx, dy, swap);
    let short = widened_edge(long, select(dy, dx, swap));
    let extent = vec2f(abs(long.x) + abs(short.x), abs(long.y) + abs(short.y));
    let position = vec2f(phase(f.uv.x * scale + shift), phase(f.uv.y * scale + shift));

    // With at most one step in the footprint, positions are relative to the step, which is precise for small
    // footprints.
    let min_gap = min(duty, 1.0 - duty);
    let near_x = extent.x < min_gap;
    let near_y = extent.y < min_gap;
    let offset = vec2f(nearest_step(position.x, duty), nearest_step(position.y, duty));
    let rise = vec2f(select(0.5, -0.5, offset.x == position.x - duty), select(0.5, -0.5, offset.y == position.y - duty));
    let wave = vec2f(wave_mean(select(position.x, offset.x, near_x), long.x, short.x, duty, near_x),
                     wave_mean(select(position.y, offset.y, near_y), long.y, short.y, duty, near_y));
    let mean_x = select(select(duty + wave.x, 0.5 + rise.x * wave.x, near_x), duty, wide_x);
    let mean_y = select(select(duty + wave.y, 0.5 + rise.y * wave.y, near_y), duty, wide_y);

    // With one pulse constant, the mean of the product is the product of the means.
    let is_uncorrelated = wide_x | wide_y | (near_x & (abs(offset.x) >= 0.5 * extent.x)) | (near_y & (abs(offset.y) >= 0.5 * extent.y));
    let crossed_periods = max(min(abs(long.x), abs(long.y)), min(abs(short.x), abs(short.y)));
    var covariance = 0.0;
    if crossed_periods > MAX_PERIODS {
        covariance = far_product(position, long, short, duty);
    } else {
        let near = near_x & near_y;
        let area = long.x * short.y - long.y * short.x;
        let product = product_integral(select(position, offset, near), long, short, duty, near) / area;
        covariance = select(product - (mean_x - duty) * (mean_y - duty), rise.x * rise.y * (product - wave.x * wave.y), near);
    }
    let mean_product = mean_x * mean_y + select(covariance, 0.0, is_uncorrelated);
    let share = mean_x + mean_y - mean_product * select(1.0, 2.0, checker);
    return min(max(share, 0.0), 1.0);
}

fn phase(x: f32) -> f32 {
    let small = select(0.0, x, abs(x) < 8388608.0); // larger numbers are integers
    return small - floor(small);
}

// Returns the shorter edge, moved off the line of the longer edge, so that a footprint either has an area or is a
// point.
fn widened_edge(long: vec2f, short: vec2f) -> vec2f {
    let length = sqrt(long.x * long.x + long.y * long.y);
    let perpendicular = vec2f(-long.y, long.x) / max(length, 1e-30);
    let width = perpendicular.x * short.x + perpendicular.y * short.y;
    let min_width = MIN_WIDTH * min(length, 1.0);
    let shift = select(min_width, -min_width, width < 0.0) - width;
    return short + perpendicular * select(0.0, shift, abs(width) < min_width);
}

// Returns the offset of x in [0, 1) from the nearest step: 0, `duty` or 1.
fn nearest_step(x: f32, duty: f32) -> f32 {
    let outer = select(x - 1.0, x, x < 0.5);
    let inner = x - duty;
    return select(outer, inner, abs(inner) < abs(outer));
}

// Returns the value of the wave. If `near` is true, x is an offset from a step, and the value is the sign of x.
fn wave_value(x: f32, duty: f32, near: bool) -> f32 {
    return select(select(-duty, 1.0 - duty, x - floor(x) < duty), select(1.0, -1.0, x < 0.0), near);
}

// Returns the integral of the wave, with a mean of 0.
fn wave_integral(x: f32, duty: f32, near: bool) -> f32 {
    let r = x - floor(x);
    return select(min(r * (1.0 - duty), (1.0 - r) * duty) - 0.5 * duty * (1.0 - duty), abs(x), near);
}

// Returns the integral of `wave_integral`.
fn wave_integral_2(x: f32, duty: f32, near: bool) -> f32 {
    let r = x - floor(x);
    let s = 1.0 - r;
    let far = select(0.5 * duty * s * (1.0 - duty - s), 0.5 * (1.0 - duty) * r * (r - duty), r < duty);
    return select(far, 0.5 * x * abs(x), near);
}

// Returns the mean of a wave over a footprint around x with the edges a and b.
fn wave_mean(x: f32, a: f32, b: f32, duty: f32, near: bool) -> f32 {
    let long = max(abs(a), abs(b));
    let short = min(abs(a), abs(b));
    let outer = 0.5 * (long + short);
    let inner = 0.5 * (long - short);
    let boxed = (wave_integral(x + 0.5 * long, duty, near) - wave_integral(x - 0.5 * long, duty, near)) / long;
    let after = wave_integral_2(x + outer, duty, near) - wave_integral_2(x + inner, duty, near);
    let before = wave_integral_2(x - inner, duty, near) - wave_integral_2(x - outer, duty, near);
    let mean = select((after - before) / (long * short), boxed, short < 0.001 * long);
    return select(mean, wave_value(x, duty, near), (long < 1e-6) | (near & (abs(x) >= outer)));
}

// Returns the integral of the product of the two waves over the footprint around `center` with the edges a and b: by
// Green's theorem, the integral of W(x) w(y) dy along the boundary of the footprint, where W is the integral of the
// wave w.
fn product_integral(center: vec2f, a: vec2f, b: vec2f, duty: f32, near: bool) -> f32 {
    let half_sum = (a + b) * 0.5;
    let half_difference = (a - b) * 0.5;
    var sum = 0.0;
    var tail = center - half_sum;
    for (var i = 0; i < 4; i++) {
        let head = center + select(half_sum, half_difference, (i == 0) | (i == 2)) * select(-1.0, 1.0, i < 2);
        sum += edge_integral(tail, head, duty, near);
        tail = head;
    }
    return sum;
}

// Returns the integral of W(x) w(y) dy along an edge. On a flat edge, this is the slope times the integral of W(x) w(y)
// dx, by parts from the second integral at the ends and at the steps of w(y). On a steep edge, x and y are swapped: the
// integrals of W(x) w(y) dy and W(y) w(x) dx add up to the difference of W(x) W(y) at the ends.
fn edge_integral(tail: vec2f, head: vec2f, duty: f32, near: bool) -> f32 {
    let steep = abs(head.x - tail.x) < abs(head.y - tail.y);
    let start = select(tail, tail.yx, steep);
    let end = select(head, head.yx, steep);
    let up = end.y >= start.y;
    let low = select(end, start, up);
    let high = select(start, end, up);
    let run = high.x - low.x;
    let rise = high.y - low.y;
    let inverse = run / rise;
    let first = select(floor(low.y), 0.0, near);
    let last = select(min(floor(high.y) - first, MAX_PERIODS + 2.0), 0.0, near);
    let value_low = wave_value(low.y, duty, near);
    let value_high = wave_value(high.y, duty, near);
    let height = select(1.0, 2.0, near);
    var steps = 0.0;
    for (var i = 0.0; i <= last; i += 1.0) {
        let y = first + i - low.y;
        let rises = select(i > 0.0, (value_low < 0.0) & (value_high > 0.0), near);
        let falls = !near & ((i > 0.0) | (value_low > 0.0)) & ((i < last) | (value_high <= 0.0));
        steps += select(0.0, height * wave_integral_2(low.x + y * inverse, duty, near), rises);
        steps -= select(0.0, wave_integral_2(low.x + (y + duty) * inverse, duty, near), falls);
    }
    let ends = wave_integral_2(high.x, duty, near) * value_high - wave_integral_2(low.x, duty, near) * value_low;
    let integral = select(0.0, rise / run, rise > 0.0) * (ends - steps) * select(-1.0, 1.0, up);
    let corners = wave_integral(end.x, duty, near) * wave_integral(end.y, duty, near)
        - wave_integral(start.x, duty, near) * wave_integral(start.y, duty, near);
    return select(integral, corners - integral, steep);
}

// Returns the mean of the product of the two waves over many periods: the Fourier terms that vary least along the
// longer edge; all others average to almost 0.
fn far_product(center: vec2f, long: vec2f, short: vec2f, duty: f32) -> f32 {
    let flat = abs(long.x) > abs(long.y);
    let a = select(long, long.yx, flat);
    let b = select(short, short.yx, flat);
    let x = select(center.x, center.y, flat) - 0.5 * duty;
    let y = select(center.y, center.x, flat) - 0.5 * duty;
    let ratio = min(abs(a.y) / abs(a.x), 1000.0);
    let sign = select(1.0, -1.0, a.x * a.y > 0.0);
    var sum = 0.0;
    for (var i = 1.0; i <= MAX_HARMONICS; i += 1.0) {
        let n = sign * i;
        let m = floor(i * ratio + 0.5);
        let footprint_factor = sine_ratio(m * a.x + n * a.y) * sine_ratio(m * b.x + n * b.y);
        let weight = duty * duty * (sine_ratio(m * duty) * sine_ratio(n * duty));
        sum += 2.0 * weight * (sine(2.0 * (m * x + n * y) + 0.5) * footprint_factor);
    }
    return sum;
}

// Returns sin(pi x) / (pi x).
fn sine_ratio(x: f32) -> f32 {
    return select(sine(x) / (3.1415927 * x), 1.0, abs(x) < 0.001);
}

// Number of Fourier terms that `far_product` adds.
const MAX_HARMONICS: f32 = 8.0;
// Maximum number of periods that an edge crosses along both axes; beyond, Fourier terms replace the exact integral to
// limit the cost.
const MAX_PERIODS: f32 = 32.0;
// Minimum width of a footprint, relative to its length or to a period, whichever is shorter.
const MIN_WIDTH: f32 = 0.001;
// Maximum extent of a footprint along an axis, in periods; beyond it, the pulse along that axis is replaced by its
// mean.
const MAX_EXTENT: f32 = 4096.0;
