// Textures that are computed: a checker and a grid of lines, averaged over the footprint.

// Pieces that a footprint is cut into along its longer edge; each is averaged as a box along u and v.
const MOST_PIECES: f32 = 16.0;

// The share of the second colour in a footprint: its mean over the pieces of a parallelogram. A piece has the box's
// width that gives it the same variance along u and along v, which is exact where its edges are.
fn pattern_share(kind: u32, line_width: f32, f: Footprint) -> f32 {
    let swap = f.dx.x * f.dx.x + f.dx.y * f.dx.y < f.dy.x * f.dy.x + f.dy.y * f.dy.y;
    let long = select(f.dx, f.dy, swap);
    let short = select(f.dy, f.dx, swap);
    let long_length = sqrt(long.x * long.x + long.y * long.y);
    let short_length = sqrt(short.x * short.x + short.y * short.y);
    let skewed = (abs(long.x) > 0.0) & (abs(long.y) > 0.0);
    let pieces = select(1.0, floor(min(long_length / short_length, MOST_PIECES - 1.0)) + 1.0, skewed);
    let piece = long / pieces;
    let width = vec2f(sqrt(piece.x * piece.x + short.x * short.x), sqrt(piece.y * piece.y + short.y * short.y));
    var sum = 0.0;
    for (var i = 0.0; i < pieces; i += 1.0) {
        let at = f.uv + long * ((i + 0.5) / pieces - 0.5);
        sum += select(lines_in_box(at, width, line_width), checker_in_box(at, width), kind == CHECKER);
    }
    return sum / pieces;
}

// The share of odd squares of side 1 in a box around `at`.
fn checker_in_box(at: vec2f, width: vec2f) -> f32 {
    return 0.5 - 0.5 * (square_wave(at.x, width.x) * square_wave(at.y, width.y));
}

// The mean over an interval around x of the function that is 1 from 0 to 1, -1 from 1 to 2, and so on.
fn square_wave(x: f32, width: f32) -> f32 {
    let reduced = x - 2.0 * floor(0.5 * x);
    let point = select(-1.0, 1.0, reduced < 1.0);
    let mean = (square_wave_integral(reduced + 0.5 * width) - square_wave_integral(reduced - 0.5 * width)) / width;
    return select(0.0, select(point, mean, width > NARROWEST), width < WIDEST);
}

fn square_wave_integral(x: f32) -> f32 {
    let reduced = x - 2.0 * floor(0.5 * x);
    return 1.0 - abs(reduced - 1.0);
}

// The share of lines around whole numbers in a box around `at`.
fn lines_in_box(at: vec2f, width: vec2f, line_width: f32) -> f32 {
    return 1.0 - (1.0 - pulse(at.x, width.x, line_width)) * (1.0 - pulse(at.y, width.y, line_width));
}

// The share of an interval around x that is within half a line's width of a whole number.
fn pulse(x: f32, width: f32, line_width: f32) -> f32 {
    let reduced = x - floor(x) + 0.5 * line_width; // lines now start at whole numbers
    let point = select(0.0, 1.0, reduced - floor(reduced) < line_width);
    let below = pulse_integral(reduced - 0.5 * width, line_width);
    let mean = (pulse_integral(reduced + 0.5 * width, line_width) - below) / width;
    return select(line_width, select(point, mean, width > NARROWEST), width < WIDEST);
}

fn pulse_integral(x: f32, line_width: f32) -> f32 {
    let whole = floor(x);
    return whole * line_width + min(x - whole, line_width);
}

// Below the one the mean loses its digits, and is the value itself; above the other it is that of the whole pattern.
const NARROWEST: f32 = 0.0001;
const WIDEST: f32 = 4096.0;
