// The tree over what shines: how much light of a node may arrive at a point. Conty Estevez and Kulla, "Importance Sampling of Many
// Lights with Adaptive Tree Splitting", HPG 2018, without the splitting.

// How much light of a node may arrive at p, up to a factor: section 4.1, with the cosines as heights over planes, that of a sphere being its
// middle's and its radius, and the square of the distance that of its middle and half that of its radius. n is the normal of a surface that light from its side alone can reach, or 0. Above 0 where any of it can
// arrive, with room for all that is rounded.
fn light_importance(node: LightNode, p: vec3f, n: vec3f) -> f32 {
    let to = node.center - p;
    let d2 = dot(to, to);
    let d = sqrt(d2);
    let along = -dot(node.axis, to);
    let ahead = select(along, abs(along), node.sides == 2u);
    let sine = sqrt(max(1.0 - node.cosine * node.cosine, 0.0));
    let turned = ahead * node.cosine + sqrt(max(d2 - along * along, 0.0)) * sine;
    let leaving = select(turned, d, ahead >= node.cosine * d); // d times the cosine to the nearest normal
    let facing = select(dot(n, to), d, dot(n, n) == 0.0);
    let outer = d + node.radius;
    let cosines = max((leaving + node.radius) / outer, 1e-3) * max((facing + node.radius) / outer, 1e-3);
    let value = node.intensity * cosines / max(d2 + 0.5 * node.radius * node.radius, 1e-30);
    // The cosine falls no faster than the angle grows, which the sphere widens by at most pi / 2 times its sine.
    let leaves = leaving + 1.5707964 * node.radius > (node.edge - 1e-3) * d;
    return select(0.0, max(value, 1e-36), leaves & (facing + node.radius > -1e-3 * d));
}

// The probability of the first of two nodes, by what may arrive of them; half where nothing does. None of two that are worth a look
// is so rare that the grid of random numbers matters.
fn first_share(first: f32, second: f32) -> f32 {
    let sum = first + second;
    let share = min(max(first / sum, 0.00024414063), 0.99975586);
    let one = select(select(1.0, 0.0, first == 0.0), share, (first > 0.0) & (second > 0.0));
    return select(one, 0.5, sum == 0.0);
}

// The other child of a node's parent: pairs are numbers 1 and 2, 3 and 4 and so on.
fn light_sibling(i: u32) -> u32 {
    return ((i - 1u) ^ 1u) + 1u;
}
