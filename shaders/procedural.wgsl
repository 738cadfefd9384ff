// Checker and line textures, filtered analytically. They combine a pulse in u and a pulse in v. A pulse is 1 on a
// fraction `on` of each period of 1, else 0. A wave is a pulse minus its mean. The integrals of a wave, and the mean of
// the product of two waves over a parallelogram, have closed forms.

// Returns the mean fraction of the second color.
fn procedural_share(kind: u32, line_width: f32, f: Footprint) -> f32 {
    let checker = kind == CHECKER;
    let scale = select(1.0, 0.5, checker);
    let on = select(line_width, 0.5, checker);
    let shift = select(0.5 * line_width, 0.0, checker);
    let wide_x = !((abs(f.dx.x) + abs(f.dy.x)) * scale < WIDEST);
    let wide_y = !((abs(f.dx.y) + abs(f.dy.y)) * scale < WIDEST);
    let dx = vec2f(select(f.dx.x * scale, 0.0, wide_x), select(f.dx.y * scale, 0.0, wide_y));
    let dy = vec2f(select(f.dy.x * scale, 0.0, wide_x), select(f.dy.y * scale, 0.0, wide_y));
    let swap = dx.x * dx.x + dx.y * dx.y < dy.x * dy.x + dy.y * dy.y;
    let long = select(dx, dy, swap);
    let short = widened_edge(long, select(dy, dx, swap));
    let t_max = vec2f(abs(long.x) + abs(short.x), abs(long.y) + abs(short.y));
    let at = vec2f(phase(f.uv.x * scale + shift), phase(f.uv.y * scale + shift));

    // With at most one step in the footprint, positions are relative to the step, to keep the precision of small
    // footprints.
    let least = min(on, 1.0 - on);
    let near_x = t_max.x < least;
    let near_y = t_max.y < least;
    let offset = vec2f(nearest_step(at.x, on), nearest_step(at.y, on));
    let rise = vec2f(select(0.5, -0.5, offset.x == at.x - on), select(0.5, -0.5, offset.y == at.y - on));
    let wave = vec2f(wave_mean(select(at.x, offset.x, near_x), long.x, short.x, on, near_x),
                     wave_mean(select(at.y, offset.y, near_y), long.y, short.y, on, near_y));
    let mean_x = select(select(on + wave.x, 0.5 + rise.x * wave.x, near_x), on, wide_x);
    let mean_y = select(select(on + wave.y, 0.5 + rise.y * wave.y, near_y), on, wide_y);

    // With one pulse constant, the mean of the product is the product of the means.
    let apart = wide_x | wide_y | (near_x & (abs(offset.x) >= 0.5 * t_max.x)) | (near_y & (abs(offset.y) >= 0.5 * t_max.y));
    let crossed = max(min(abs(long.x), abs(long.y)), min(abs(short.x), abs(short.y)));
    var together = 0.0;
    if crossed > MAX_PERIODS {
        together = far_product(at, long, short, on);
    } else {
        let near = near_x & near_y;
        let area = long.x * short.y - long.y * short.x;
        let product = around_footprint(select(at, offset, near), long, short, on, near) / area;
        together = select(product - (mean_x - on) * (mean_y - on), rise.x * rise.y * (product - wave.x * wave.y), near);
    }
    let both = mean_x * mean_y + select(together, 0.0, apart);
    let share = mean_x + mean_y - both * select(1.0, 2.0, checker);
    return min(max(share, 0.0), 1.0);
}

fn phase(x: f32) -> f32 {
    let small = select(0.0, x, abs(x) < 8388608.0); // larger ones have no fraction
    return small - floor(small);
}

// Returns the shorter edge, moved off the line of the longer edge: then a footprint either has an area or is a point.
fn widened_edge(long: vec2f, short: vec2f) -> vec2f {
    let length = sqrt(long.x * long.x + long.y * long.y);
    let across = vec2f(-long.y, long.x) / max(length, 1e-30);
    let width = across.x * short.x + across.y * short.y;
    let least = THINNEST * min(length, 1.0);
    let more = select(least, -least, width < 0.0) - width;
    return short + across * select(0.0, more, abs(width) < least);
}

// Returns the offset of x in [0, 1) from the nearest step: 0, `on` or 1.
fn nearest_step(x: f32, on: f32) -> f32 {
    let outer = select(x - 1.0, x, x < 0.5);
    let inner = x - on;
    return select(outer, inner, abs(inner) < abs(outer));
}

// Returns the wave; if `near` is true, the sign of x, which is an offset from a step.
fn wave_value(x: f32, on: f32, near: bool) -> f32 {
    return select(select(-on, 1.0 - on, x - floor(x) < on), select(1.0, -1.0, x < 0.0), near);
}

// Returns the integral of the wave, shifted to a mean of 0.
fn wave_integral(x: f32, on: f32, near: bool) -> f32 {
    let r = x - floor(x);
    return select(min(r * (1.0 - on), (1.0 - r) * on) - 0.5 * on * (1.0 - on), abs(x), near);
}

fn wave_integral_2(x: f32, on: f32, near: bool) -> f32 {
    let r = x - floor(x);
    let s = 1.0 - r;
    let far = select(0.5 * on * s * (1.0 - on - s), 0.5 * (1.0 - on) * r * (r - on), r < on);
    return select(far, 0.5 * x * abs(x), near);
}

// Returns the mean of a wave over a footprint around x with the edges a and b.
fn wave_mean(x: f32, a: f32, b: f32, on: f32, near: bool) -> f32 {
    let long = max(abs(a), abs(b));
    let short = min(abs(a), abs(b));
    let outer = 0.5 * (long + short);
    let inner = 0.5 * (long - short);
    let boxed = (wave_integral(x + 0.5 * long, on, near) - wave_integral(x - 0.5 * long, on, near)) / long;
    let after = wave_integral_2(x + outer, on, near) - wave_integral_2(x + inner, on, near);
    let before = wave_integral_2(x - inner, on, near) - wave_integral_2(x - outer, on, near);
    let mean = select((after - before) / (long * short), boxed, short < 0.001 * long);
    return select(mean, wave_value(x, on, near), (long < 1e-6) | (near & (abs(x) >= outer)));
}

// Returns the integral of the product of both waves over the footprint around `at` with the edges a and b. By Green's
// theorem, this is the integral of W(x) w(y) dy along the boundary of the footprint, where W is the integral of the
// wave w.
fn around_footprint(at: vec2f, a: vec2f, b: vec2f, on: f32, near: bool) -> f32 {
    let half = (a + b) * 0.5;
    let other = (a - b) * 0.5;
    var sum = 0.0;
    var tail = at - half;
    for (var i = 0; i < 4; i++) {
        let head = at + select(half, other, (i == 0) | (i == 2)) * select(-1.0, 1.0, i < 2);
        sum += along_edge(tail, head, on, near);
        tail = head;
    }
    return sum;
}

// Returns the integral of W(x) w(y) dy along an edge: if flat, the slope times the integral of W(x) w(y) dx by parts,
// from the second integral at the ends and at the steps of w(y). If steep, x and y are swapped: the integrals of W(x)
// w(y) dy and W(y) w(x) dx add up to the difference of W(x) W(y) at the ends.
fn along_edge(tail: vec2f, head: vec2f, on: f32, near: bool) -> f32 {
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
    let value_low = wave_value(low.y, on, near);
    let value_high = wave_value(high.y, on, near);
    let height = select(1.0, 2.0, near);
    var steps = 0.0;
    for (var i = 0.0; i <= last; i += 1.0) {
        let y = first + i - low.y;
        let rises = select(i > 0.0, (value_low < 0.0) & (value_high > 0.0), near);
        let falls = !near & ((i > 0.0) | (value_low > 0.0)) & ((i < last) | (value_high <= 0.0));
        steps += select(0.0, height * wave_integral_2(low.x + y * inverse, on, near), rises);
        steps -= select(0.0, wave_integral_2(low.x + (y + on) * inverse, on, near), falls);
    }
    let ends = wave_integral_2(high.x, on, near) * value_high - wave_integral_2(low.x, on, near) * value_low;
    let along = select(0.0, rise / run, rise > 0.0) * (ends - steps) * select(-1.0, 1.0, up);
    let corners = wave_integral(end.x, on, near) * wave_integral(end.y, on, near)
        - wave_integral(start.x, on, near) * wave_integral(start.y, on, near);
    return select(along, corners - along, steep);
}

// Returns the mean of the product over many periods: the Fourier terms that vary least along the longer edge, as the
// others average to almost 0.
fn far_product(at: vec2f, long: vec2f, short: vec2f, on: f32) -> f32 {
    let flat = abs(long.x) > abs(long.y);
    let a = select(long, long.yx, flat);
    let b = select(short, short.yx, flat);
    let x = select(at.x, at.y, flat) - 0.5 * on;
    let y = select(at.y, at.x, flat) - 0.5 * on;
    let ratio = min(abs(a.y) / abs(a.x), 1000.0);
    let turn = select(1.0, -1.0, a.x * a.y > 0.0);
    var sum = 0.0;
    for (var i = 1.0; i <= MAX_HARMONICS; i += 1.0) {
        let n = turn * i;
        let m = floor(i * ratio + 0.5);
        let along = sine_ratio(m * a.x + n * a.y) * sine_ratio(m * b.x + n * b.y);
        let weight = on * on * (sine_ratio(m * on) * sine_ratio(n * on));
        sum += 2.0 * weight * (sine(2.0 * (m * x + n * y) + 0.5) * along);
    }
    return sum;
}

// Returns sin(pi x) / (pi x).
fn sine_ratio(x: f32) -> f32 {
    return select(sine(x) / (3.1415927 * x), 1.0, abs(x) < 0.001);
}

// Number of Fourier terms.
const MAX_HARMONICS: f32 = 8.0;
// Maximum periods of an edge along both axes without Fourier series, to bound the work.
const MAX_PERIODS: f32 = 32.0;
// Minimum width relative to the length or a period.
const THINNEST: f32 = 0.001;
// Extent along an axis; for larger footprints, the result is the mean of the pattern.
const WIDEST: f32 = 4096.0;
