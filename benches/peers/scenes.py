"""Reads wgray's scene files for the peers, so that a scene stands in one place.

`load` takes the part of the format that the benchmark scenes use (docs/scene-format.md) and refuses the rest.
"""
import math
import os
import tomllib
from dataclasses import dataclass, field


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def scaled(a, s):
    return [x * s for x in a]


def unit(a):
    return scaled(a, 1 / math.sqrt(dot(a, a)))


@dataclass
class Material:
    ambient: list
    diffuse: list
    specular: list
    shininess: float


@dataclass
class Quad:
    """A rectangle, `center + s u + t v` with s and t in [-1, 1]; of a light: its `color` too."""
    center: list
    u: list
    v: list
    material: Material | None = None
    color: list | None = None


@dataclass
class Triangles:
    vertices: list
    faces: list
    material: Material


@dataclass
class Ellipsoid:
    """The image of the unit sphere under `center + x a + y b + z c`."""
    center: list
    a: list
    b: list
    c: list
    material: Material


@dataclass
class Plane:
    point: list
    normal: list
    material: Material


@dataclass
class Mesh:
    """The triangles of a file, moved by an affine map of three rows of four numbers. `normals`: "smooth", "flat", "file", None."""
    file: str
    normals: str | None
    to_world: list
    material: Material


@dataclass
class Scene:
    width: int
    height: int
    position: list
    look_at: list
    up: list
    fov: float
    ambient: list
    shapes: list = field(default_factory=list)
    lights: list = field(default_factory=list)


def quad(row, **more):
    n, t = unit(row["normal"]), row["tangent"]
    t = unit(sub(t, scaled(n, dot(n, t))))
    return Quad(row["center"], scaled(t, row["size"][0] / 2), scaled(cross(n, t), row["size"][1] / 2), **more)


def product(a, b):
    """The affine map that applies b, then a; each is three rows of four numbers."""
    rows = [*b, [0, 0, 0, 1]]
    return [[sum(row[k] * rows[k][j] for k in range(4)) for j in range(4)] for row in a]


def about(axis, degrees):
    """Rodrigues' rotation formula."""
    x, y, z = unit(axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    k = 1 - c
    return [[c + k * x * x, k * x * y - s * z, k * x * z + s * y, 0],
            [k * x * y + s * z, c + k * y * y, k * y * z - s * x, 0],
            [k * x * z - s * y, k * y * z + s * x, c + k * z * z, 0]]


UP = {"x": [[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 0]],
      "y": [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0]],
      "z": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}


def to_world(row, up):
    """The map of a mesh: its axis that is up, then scale, rotate, translate, or the matrix in their place."""
    if "matrix" in row:
        return product(row["matrix"][:3], UP[up])
    x, y, z = row["scale"] if isinstance(row.get("scale"), list) else [row.get("scale", 1)] * 3
    turn = [[x, 0, 0, 0], [0, y, 0, 0], [0, 0, z, 0]]
    rotate = row.get("rotate", [0, 0, 0])
    if isinstance(rotate, dict):
        turn = product(about(rotate["axis"], rotate["degrees"]), turn)
    else:
        for axis, degrees in zip(([1, 0, 0], [0, 1, 0], [0, 0, 1]), rotate):
            turn = product(about(axis, degrees), turn)
    moved = [[*line[:3], by] for line, by in zip(turn, row.get("translate", [0, 0, 0]))]
    return product(moved, UP[up])


def load(path):
    with open(path, "rb") as file:
        text = tomllib.load(file)
    camera, render = text["camera"], text["render"]
    if camera.get("type", "perspective") != "perspective" or render.get("integrator", "phong") != "phong":
        raise ValueError(f"{path}: the peers' scenes have a perspective camera and the phong integrator")
    if any(render.get("background", [0, 0, 0])):
        raise ValueError(f"{path}: the peers' scenes have a black background")
    scene = Scene(text["image"]["width"], text["image"]["height"], camera["position"], camera["look_at"],
                  camera.get("up", [0, 0, 1]), camera["fov"], render["ambient"])
    materials = {}
    for name, row in text["materials"].items():
        if row.get("type", "phong") != "phong":
            raise ValueError(f"{path}: materials.{name}: the peers' materials are phong")
        terms = [row[term] if term in row else row["color"] for term in ("ambient", "diffuse", "specular")]
        if any(not isinstance(term, list) for term in terms):
            raise ValueError(f"{path}: materials.{name}: the peers' colours are plain")
        materials[name] = Material(*terms, row["shininess"])
    folder = os.path.dirname(os.path.abspath(path))

    def mesh(row, source):
        if "material" not in row or "materials" in row:
            raise ValueError(f"{path}: the peers' meshes have one material, `material`")
        file = os.path.join(folder, source["file"])
        scene.shapes.append(Mesh(file, source.get("normals"), to_world(row, source.get("up", "z")), materials[row["material"]]))

    for row in text.get("shapes", []):
        kind = row["type"]
        if kind == "mesh":
            mesh(row, row)
            continue
        material = materials[row["material"]]
        if kind == "rectangle":
            scene.shapes.append(quad(row, material=material))
        elif kind == "ellipsoid":
            scene.shapes.append(Ellipsoid(row["center"], row["a"], row["b"], row["c"], material))
        elif kind == "sphere":
            r = row["radius"]
            scene.shapes.append(Ellipsoid(row["center"], [r, 0, 0], [0, r, 0], [0, 0, r], material))
        elif kind == "triangle":
            scene.shapes.append(Triangles(row["vertices"], [(0, 1, 2)], material))
        elif kind == "tetrahedron":
            scene.shapes.append(Triangles(row["vertices"], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], material))
        elif kind == "plane":
            scene.shapes.append(Plane(row["point"], unit(row["normal"]), material))
        else:
            raise ValueError(f"{path}: no peer has shapes of type {kind!r}")
    for row in text.get("instances", []):
        mesh(row, text["meshes"][row["mesh"]])
    for row in text["lights"]:
        if row["type"] != "rectangle":
            raise ValueError(f"{path}: the peers' lights are rectangles, not {row['type']!r}")
        scene.lights.append(quad(row, color=row["color"]))
    return scene
