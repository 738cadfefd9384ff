#!/usr/bin/env python3
"""Evaluates importance functions of the light tree; prints a Markdown table.

A cell is the relative variance (variance over squared mean) of one sample of the unshadowed direct light at points on
the walls of a room: the mean over the points, and the median in parentheses. Computed in f64.

    target/peers/venv/bin/python benches/peers/light_importance.py

The tree splits at the median of the longest side, unlike wgray's. The importance of a child is that of
docs/decisions/light-tree.md, compared with that of earlier versions. The variance is exact: it follows
from the contribution and the probability of each light, without sampling.
"""
import argparse

import numpy as np

import lamps

POINTS = 2000
DOWN = np.array([0, 0, -1.0])


def points_on_walls(generator):
    """Returns uniformly distributed points on the walls of the room of `lamps.py`, and their normals."""
    size = np.array([4, 8, 3.0])
    areas = np.repeat([size[1] * size[2], size[0] * size[2], size[0] * size[1]], 2)
    wall = generator.choice(6, p=areas / areas.sum(), size=POINTS)
    axis, side = wall // 2, wall % 2 - 0.5
    points, normals = (generator.random((POINTS, 3)) - 0.5) * size, np.zeros((POINTS, 3))
    rows = np.arange(POINTS)
    points[rows, axis] = side * size[axis]
    normals[rows, axis] = -2 * side
    return points + [0, 0, 1.5], normals


def split(positions, lights):
    """Splits lights at the median of the longest side of their bounds."""
    selected = positions[lights]
    axis = np.argmax(selected.max(0) - selected.min(0))
    lights = lights[np.argsort(selected[:, axis], kind="stable")]
    return [lights[:len(lights) // 2], lights[len(lights) // 2:]]


def tree(positions, lights, width):
    """Returns the index of a light, or a list of children: pairs of light indices and their subtree."""
    if len(lights) == 1:
        return lights[0]
    groups = [lights]
    while len(groups) < width:
        cost = [len(group) * np.prod(np.ptp(positions[group], axis=0) + 0.01) ** (2 / 3) if len(group) > 1 else 0 for group in groups]
        worst = int(np.argmax(cost))
        if cost[worst] == 0:
            break
        groups[worst:worst + 1] = split(positions, groups[worst])
    return [(group, tree(positions, group, width)) for group in groups]


def heights(points, normals, center, flat):
    """Returns the distance of a sphere's centre, and its heights above the planes of the light and of the surface."""
    to = center - points
    distance = np.sqrt((to ** 2).sum(-1))
    return distance, -(to @ DOWN) if flat else distance, (to * normals).sum(-1)


def cosine_bounds(points, normals, center, radius, flat):
    distance, leaving, facing = heights(points, normals, center, flat)
    cosines = [np.maximum((height + radius) / (distance + radius), 1e-3) for height in (leaving, facing)]
    value = cosines[0] * cosines[1] / (distance ** 2 + 0.5 * radius ** 2)
    return np.where((leaving + 1.57 * radius > 0) & (facing + radius > 0), value, 0)


def cosine_means(points, normals, center, radius, flat):
    distance, leaving, facing = heights(points, normals, center, flat)
    square = distance ** 2 + 0.1 * radius ** 2

    def above(height):
        partial = (height + radius) ** 2 / (4 * max(radius, 1e-9))
        return np.maximum(np.where(np.abs(height) < radius, partial, np.maximum(height, 0)), 0.03 * radius)

    value = above(leaving) * above(facing) / square ** 2
    return np.where((leaving + 1.57 * radius > 0) & (facing + radius > 0), value, 0)


def probabilities(positions, width, importance, points, normals, flat):
    """Returns the probability with which the light tree selects each light, for each point."""
    out = np.zeros((len(points), len(positions)))

    def add_node(node, probability):
        if not isinstance(node, list):
            out[:, node] = probability
            return
        values = []
        for lights, _ in node:
            low, high = positions[lights].min(0), positions[lights].max(0)
            radius = np.linalg.norm(high - low) / 2
            values.append(len(lights) * importance(points, normals, (low + high) / 2, radius, flat))
        weights = np.stack(values, -1)
        weights = np.where(weights > 0, np.maximum(weights, weights.sum(-1, keepdims=True) / 4096), 0)
        total = weights.sum(-1, keepdims=True)
        weights = np.where(total > 0, weights / np.where(total > 0, total, 1), 0)
        for i, (_, child) in enumerate(node):
            add_node(child, probability * weights[:, i])

    add_node(tree(positions, np.arange(len(positions)), width), np.ones(len(points)))
    return out


def variance(positions, width, importance, points, normals, flat):
    """Returns a cell of the table."""
    to = positions[None] - points[:, None]
    squares = (to ** 2).sum(-1)
    cosines = np.maximum((to * normals[:, None]).sum(-1), 0) / np.sqrt(squares)
    light = cosines / squares * (np.maximum(-(to @ DOWN), 0) / np.sqrt(squares) if flat else 1)
    probability = probabilities(positions, width, importance, points, normals, flat)
    if ((light > 1e-12) & (probability == 0)).any():
        raise SystemExit("a light that contributes has probability 0")
    second_moment = np.where(light > 0, light ** 2 / np.maximum(probability, 1e-300), 0).sum(1)
    mean = light.sum(1)
    lit = mean > 1e-3
    relative = second_moment[lit] / mean[lit] ** 2 - 1
    return f"{relative.mean():.2f} ({np.median(relative):.2f})"


def main():
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    generator = np.random.default_rng(1)
    points, normals = points_on_walls(generator)
    grid = np.meshgrid(np.linspace(-1.9, 1.9, 25), np.linspace(-3.9, 3.9, 40), [2.7])
    clumps = [(x, y, 1.5) + 0.05 * generator.standard_normal((100, 3)) for x in (-1, 1) for y in (-3, -1.5, 0, 1.5, 3)]
    layouts = {"spread over the room": np.array(lamps.positions(1000)), "under the ceiling": np.stack(grid, -1).reshape(-1, 3),
              "in ten clumps": np.concatenate(clumps)}
    print("| a thousand lights | two children, bounds of cosines | four children, bounds of cosines | four children, means of cosines |")
    print("| --- | ---: | ---: | ---: |")
    for name, positions in layouts.items():
        for kind, flat in (("rectangles that face down", True), ("points", False)):
            variants = [(2, cosine_bounds), (4, cosine_bounds), (4, cosine_means)]
            cells = [variance(positions, width, importance, points, normals, flat) for width, importance in variants]
            print(f"| {kind}, {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
