"""Reads wgray's scene files for other renderers.

`load` supports the keys of docs/scene-format.md that the benchmark scenes use, and rejects all other keys. The scenes
are for the Phong integrator, with constant colours and rectangle lights, or, with `integrator="path"`, for the path tracer.
"""
import json
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
    """A material. Each colour is a list of three numbers or a Checker.

    `kind` is the material type of the scene format, except that "mirror" becomes "conductor" and "glass" becomes "dielectric"; without specular
    reflection, "principled" becomes "dielectric" if it transmits, else "diffuse".
    """
    kind: str = "phong"
    ambient: list | None = None
    diffuse: list | None = None
    specular: list | None = None
    shininess: float = 16
    color: list | None = None
    ior: float = 1
    absorption: list | None = None
    emission: list | None = None
    alpha: tuple = (0, 0)  # GGX roughness along and across the tangent; (0, 0) is smooth
    index: tuple | None = None  # n and k of a metal
    thin: bool = False
    metallic: float = 0
    coat: tuple = (0, 0)  # clearcoat and its roughness


@dataclass
class Checker:
    even: list
    odd: list
    scale: list


@dataclass
class Quad:
    """A rectangle, `center + s u + t v` with s and t in [-1, 1]. `color` is the colour of a light, otherwise None."""
    center: list
    u: list
    v: list
    material: Material | None = None
    color: list | None = None


@dataclass
class Disk:
    """The points `center + s u + t v` with s² + t² <= 1."""
    center: list
    u: list
    v: list
    material: Material


@dataclass
class PointLight:
    position: list
    color: list


@dataclass
class SpotLight:
    """A spot light with a hard edge."""
    position: list
    direction: list
    color: list
    angle: float


@dataclass
class EnvironmentMap:
    """An equirectangular environment map, with +x at the centre and +z at the upper edge. `rotate` is the rotation about z in
    degrees."""
    file: str
    scale: float
    rotate: float


@dataclass
class DirectionalLight:
    direction: list
    color: list


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
    """The triangles of a file, with an affine 3 x 4 transform. `normals` is "smooth", "flat", "file" or None."""
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
    integrator: str = "phong"
    view_height: float | None = None  # of an orthographic camera
    environment: list | EnvironmentMap | None = None
    lens: tuple | None = None  # diameter and focus distance
    max_depth: int = 8
    rr_depth: int = 5
    spp: int = 16


def quad(row, **attributes):
    n, t = unit(row["normal"]), row["tangent"]
    t = unit(sub(t, scaled(n, dot(n, t))))
    return Quad(row["center"], scaled(t, row["size"][0] / 2), scaled(cross(n, t), row["size"][1] / 2), **attributes)


def product(a, b):
    """Returns the affine transform that applies b, then a. Each transform is three rows of four numbers."""
    rows = [*b, [0, 0, 0, 1]]
    return [[sum(row[k] * rows[k][j] for k in range(4)) for j in range(4)] for row in a]


def rotation(axis, degrees):
    """Returns the rotation about an axis, by Rodrigues' formula."""
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
    """Returns the transform of a mesh: first the up axis, then the matrix, or scale, rotation and translation."""
    if "matrix" in row:
        return product(row["matrix"][:3], UP[up])
    x, y, z = row["scale"] if isinstance(row.get("scale"), list) else [row.get("scale", 1)] * 3
    transform = [[x, 0, 0, 0], [0, y, 0, 0], [0, 0, z, 0]]
    rotate = row.get("rotate", [0, 0, 0])
    if isinstance(rotate, dict):
        transform = product(rotation(rotate["axis"], rotate["degrees"]), transform)
    else:
        for axis, degrees in zip(([1, 0, 0], [0, 1, 0], [0, 0, 1]), rotate):
            transform = product(rotation(axis, degrees), transform)
    translated = [[*line[:3], offset] for line, offset in zip(transform, row.get("translate", [0, 0, 0]))]
    return product(translated, UP[up])


def color(path, row, key, textures, default=None):
    """Returns a colour of a material: three numbers, or a checker for the path tracer."""
    value = row.get(key, default)
    if not isinstance(value, dict):
        return value
    texture = textures.get(value["texture"], {})
    if texture.get("type") != "checker" or "rotate" in texture or "offset" in texture:
        raise ValueError(f"{path}: {key}: other renderers support only checkers, without rotation or offset")
    return Checker(texture["even"], texture["odd"], texture.get("scale", [1, 1]))


def material(path, row, textures, traced):
    kind = {"mirror": "conductor", "glass": "dielectric"}.get(row["type"], row["type"])
    if kind != "phong" and not traced:
        raise ValueError(f"{path}: material {row['type']!r}: without a path tracer, other renderers support only phong")
    rough = kind in ("conductor", "dielectric", "principled")
    if "normal_map" in row or "metal" in row or isinstance(row.get("roughness"), dict):
        raise ValueError(f"{path}: other renderers support neither normal maps, roughness textures nor named metals")
    if row.get("roughness", 0) != 0 and not rough:
        raise ValueError(f"{path}: a rough {kind}: other renderers lack this model")
    if rough and row.get("roughness", 0) != 0 and kind != "principled" and row.get("energy_compensation", True):
        raise ValueError(f"{path}: other renderers do not compensate for lost energy: energy_compensation must be false")
    result = Material(kind, emission=color(path, row, "emission", textures))
    if kind == "principled":
        result.color, result.metallic = color(path, row, "base_color", textures, [1, 1, 1]), row.get("metallic", 1)
        if result.metallic == 0 and row.get("specular") == 0:
            return without_specular(path, row, result)
        unsupported = set(row) - {"type", "base_color", "metallic", "roughness", "anisotropy", "clearcoat", "clearcoat_roughness"}
        if unsupported:
            raise ValueError(f"{path}: other renderers' principled does not support {', '.join(sorted(unsupported))}")
        alpha = row.get("roughness", 1) ** 2
        result.alpha = (alpha + (1 - alpha) * row.get("anisotropy", 0) ** 2, alpha)
        result.coat = (row.get("clearcoat", 0), row.get("clearcoat_roughness", 0))
        return result
    if rough:
        # glTF's formula for the roughness along the tangent: mix(alpha, 1, anisotropy^2). A rotation by 90 degrees exchanges
        # the two roughnesses.
        alpha = row.get("roughness", 0) ** 2
        tangent_alpha = alpha + (1 - alpha) * row.get("anisotropy", 0) ** 2 if alpha else 0
        angle = row.get("anisotropy_rotation", 0)
        if angle not in (0, 90):
            raise ValueError(f"{path}: other renderers support anisotropy rotations of 0 and 90 degrees")
        result.alpha = (tangent_alpha, alpha) if angle == 0 else (alpha, tangent_alpha)
        result.index = (row["eta"], row["k"]) if "eta" in row else None
        result.thin = row.get("thin", False)
    if kind == "phong":
        default = color(path, row, "color", textures)
        result.ambient, result.diffuse, result.specular = (color(path, row, term, textures, default) for term in ("ambient", "diffuse", "specular"))
        result.shininess = row.get("shininess", 16)
    else:
        result.color = color(path, row, "tint" if row["type"] in ("mirror", "glass") else "color", textures, [1, 1, 1])
        result.ior, result.absorption = row.get("ior", 1), row.get("absorption")
    if not traced and not all(isinstance(c, list) for c in (result.ambient, result.diffuse, result.specular)):
        raise ValueError(f"{path}: other renderers support only constant colours here")
    return result


def without_specular(path, row, result):
    """Converts a `principled` dielectric without specular reflection: its diffuse base, or full transmission without a base."""
    supported = {"type", "base_color", "metallic", "specular", "transmission", "thickness", "ior", "roughness", "attenuation_color", "attenuation_distance"}
    transmission, is_solid = row.get("transmission", 0), row.get("thickness", 0) > 0
    is_undeflected = row.get("roughness", 1) == 0 and row.get("ior", 1.5) == 1
    if set(row) - supported or transmission not in (0, 1) or (transmission and not is_undeflected):
        raise ValueError(f"{path}: other renderers support principled without reflection only as a diffuse base or with "
                         "undeflected transmission")
    result.kind = "dielectric" if transmission else "diffuse"
    if transmission:
        result.thin = not is_solid
        if "attenuation_color" in row:
            result.absorption = [-math.log(c) / row["attenuation_distance"] for c in row["attenuation_color"]]
    return result


def load(path, integrator="phong"):
    """Returns the Scene of a file. Raises ValueError for keys that the other renderers do not support."""
    traced = integrator == "path"
    if traced and str(path).endswith(".json"):
        return read_course_scene(path)
    with open(path, "rb") as file:
        document = tomllib.load(file)
    camera, render = document["camera"], document.get("render", {})
    orthographic = camera.get("type", "perspective") == "orthographic"
    if camera.get("type") == "panorama" or camera.get("blades", 0) or "f_number" in camera:
        raise ValueError(f"{path}: other renderers support neither panoramas, blades nor f-numbers")
    if render.get("integrator", "phong") != integrator:
        raise ValueError(f"{path}: render.integrator must be {integrator!r}")
    if orthographic and not traced:
        raise ValueError(f"{path}: other renderers support only perspective cameras here")
    if any(render.get("background", [0, 0, 0])):
        raise ValueError(f"{path}: other renderers support only a black background")
    scene = Scene(document["image"]["width"], document["image"]["height"], camera["position"], camera["look_at"],
                  camera.get("up", [0, 0, 1]), camera.get("fov"), render.get("ambient", [0, 0, 0]), integrator=integrator,
                  view_height=camera["height"] if orthographic else None, environment=environment(path, document.get("environment", {})),
                  lens=(camera["aperture"], camera.get("focus_distance", math.dist(camera["position"], camera["look_at"])))
                  if camera.get("aperture") else None, max_depth=render.get("max_depth", 8), rr_depth=render.get("rr_depth", 5),
                  spp=render.get("pixel_samples", {}).get("count", 16))
    textures = document.get("textures", {})
    materials = {name: material(path, row, textures, traced) for name, row in document["materials"].items()}
    folder = os.path.dirname(os.path.abspath(path))

    def mesh(row, source):
        if "material" not in row or "materials" in row:
            raise ValueError(f"{path}: other renderers support only meshes with one material, `material`")
        file = os.path.join(folder, source["file"])
        scene.shapes.append(Mesh(file, source.get("normals"), to_world(row, source.get("up", "z")), materials[row["material"]]))

    for row in document.get("shapes", []):
        if row["type"] == "mesh":
            mesh(row, row)
        else:
            scene.shapes.append(shape(path, row, materials[row["material"]]))
    for row in document.get("instances", []):
        mesh(row, document["meshes"][row["mesh"]])
    for row in document.get("lights", []):
        if row["type"] == "rectangle":
            scene.lights.append(quad(row, color=row["color"]))
        elif row["type"] == "point" and traced:
            scene.lights.append(PointLight(row["position"], row["color"]))
        elif row["type"] == "spot" and traced:
            if row.get("inner_angle", 0) != row["cone_angle"]:
                raise ValueError(f"{path}: other renderers' spot lights fall off differently: inner_angle must be cone_angle")
            scene.lights.append(SpotLight(row["position"], row["direction"], row["color"], row["cone_angle"]))
        elif row["type"] == "directional" and traced:
            scene.lights.append(DirectionalLight(row["direction"], row["color"]))
        else:
            raise ValueError(f"{path}: other renderers do not support lights of type {row['type']!r} here")
    return scene


def environment(path, row):
    if set(row) - {"color", "file", "scale", "rotate"} or isinstance(row.get("rotate", 0), (list, dict)):
        raise ValueError(f"{path}: other renderers support only environments of one colour, or files rotated about z")
    if "file" in row:
        return EnvironmentMap(os.path.join(os.path.dirname(os.path.abspath(path)), row["file"]), row.get("scale", 1), row.get("rotate", 0))
    return [x * row.get("scale", 1) for x in row["color"]] if "color" in row else None


def shape(path, row, material):
    kind = row["type"]
    if kind == "rectangle":
        return quad(row, material=material)
    if kind == "disk":
        n = unit(row["normal"])
        square = quad({"tangent": [0, 1, 0] if abs(n[0]) > 0.9 else [1, 0, 0], "size": [2 * row["radius"]] * 2} | row)
        return Disk(square.center, square.u, square.v, material)
    if kind == "ellipsoid":
        return Ellipsoid(row["center"], row["a"], row["b"], row["c"], material)
    if kind == "sphere":
        r = row["radius"]
        return Ellipsoid(row["center"], [r, 0, 0], [0, r, 0], [0, 0, r], material)
    if kind == "triangle":
        return Triangles(row["vertices"], [(0, 1, 2)], material)
    if kind == "tetrahedron":
        a, b, c, d = row["vertices"]
        if dot(cross(sub(b, a), sub(c, a)), sub(d, a)) < 0:
            b, c = c, b
        return Triangles([a, b, c, d], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], material)
    if kind == "plane":
        return Plane(row["point"], unit(row["normal"]), material)
    raise ValueError(f"{path}: other renderers do not support shapes of type {kind!r}")


def read_course_scene(path):
    """Reads a JSON scene in the format of a university course. The axes are not converted (y is up), which does not affect
    the image."""
    with open(path, encoding="utf-8") as file:
        config = json.load(file)
    camera, light = config["cam_config"], config["light_config"]
    scene = Scene(*config["image_resolution"], camera["position"], camera["look_at"], camera["ref_up"], camera["vertical_fov"],
                  [0, 0, 0], integrator="path", max_depth=config["max_depth"], spp=config["spp"])
    kinds = {"diffuse": "diffuse", "specular": "conductor"}
    materials = {row["name"]: Material(kinds[row["type"]], color=row["color"]) for row in config["materials"]}
    folder = os.path.dirname(os.path.abspath(path))
    for row in config["objects"]:
        transform = to_world({"scale": row.get("scale", 1), "translate": row.get("translate", [0, 0, 0])}, "z")
        scene.shapes.append(Mesh(os.path.join(folder, row["obj_file_path"]), "flat", transform, materials[row["material_name"]]))
    scene.lights.append(quad({"center": light["position"], "size": light["size"], "normal": [0, -1, 0], "tangent": [1, 0, 0]},
                             color=light["radiance"]))
    return scene
