#!/usr/bin/env python3
"""Writes the scenes that path_check.py renders with wgray's and Mitsuba's path tracers, and the meshes of the scenes.

    python path_scenes.py FOLDER

TOML files of 96 x 96 pixels are written to FOLDER, three JSON scenes to FOLDER/configs, and the meshes of the JSON
scenes to FOLDER/assets. The JSON scenes have the format of a university course's renderer. The course's dragon and bunny
are not redistributed: bumpy closed meshes of similar size and position replace them. `ray_differentials` is off, because
Mitsuba does not filter its checkerboard textures.
"""
import json
import math
import pathlib
import random
import sys

HEAD = """[image]
width = 96
height = 96

[camera]
{camera}

[render]
integrator = "path"
max_depth = {depth}
rr_depth = {rr}
ray_differentials = false
pixel_samples = {{ count = 64 }}
"""
CAMERA = "position = [0, -4, 1.7]\nlook_at = [0, 0, 0.55]\nfov = 30"
ENVIRONMENT = "\n[environment]\ncolor = [0.25, 0.35, 0.5]\n"
GREY = 'type = "diffuse"\ncolor = [0.6, 0.55, 0.5]'


def head(camera=CAMERA, depth=8, rr=5):
    return HEAD.format(camera=camera, depth=depth, rr=rr)


def material(name, keys):
    return f"\n[materials.{name}]\n{keys}\n"


def table(section, kind, **keys):
    rows = [f"{key} = {json.dumps(value)}" for key, value in keys.items()]
    return f'\n[[{section}]]\ntype = "{kind}"\n' + "\n".join(rows) + "\n"


def shape(kind, material, **keys):
    return table("shapes", kind, material=material, **keys)


def rectangle(material, center, size, normal, tangent):
    return shape("rectangle", material, center=center, size=size, normal=normal, tangent=tangent)


def area_light(center=(0.9, -0.6, 2.4), size=(0.8, 0.5), normal=(-0.4, 0.3, -1), color=(9, 8, 7)):
    return table("lights", "rectangle", center=list(center), size=list(size), normal=list(normal), tangent=[1, 0, 0], color=list(color))


FLOOR = material("floor", GREY) + rectangle("floor", [0, 0, 0], [5, 5], [0, 0, 1], [1, 0, 0])
WALL = rectangle("floor", [0, 1.5, 1], [5, 2], [0, -1, 0], [1, 0, 0])


def ball(keys, more="", **render):
    """Returns a scene with a ball of a material on a floor, under an area light and a constant environment."""
    return (head(**render) + ENVIRONMENT + FLOOR + material("ball", keys) + area_light()
            + shape("sphere", "ball", center=[0, 0, 0.55], radius=0.5) + more)


def emitter(*shapes, emission='emission = [4, 3, 2]', more=""):
    """Returns a scene whose only emitter is a two-sided emissive shape between a floor and a wall."""
    lit = material("lit", 'type = "diffuse"\ncolor = [0.3, 0.4, 0.5]\n' + emission)
    return head() + more + FLOOR + WALL + lit + material("red", 'type = "diffuse"\ncolor = [0.7, 0.2, 0.1]') + "".join(shapes) + shape(
        "sphere", "red", center=[-0.7, -0.4, 0.25], radius=0.25)


def many_lights(count=64):
    generator = random.Random(count)
    text = head("position = [0, -5, 3]\nlook_at = [0, 0, 0.3]\nfov = 40") + FLOOR + WALL + material("ball", 'type = "phong"\nambient = [0, 0, 0]\ndiffuse = [0.4, 0.3, 0.3]\n'
                                                                                        "specular = [0.3, 0.3, 0.3]\nshininess = 20")
    for i in range(count):
        power = 10 ** generator.uniform(-1, 1.5)
        position = [generator.uniform(-2, 2), generator.uniform(-2, 1.4), generator.uniform(0.6, 2.5)]
        color = [power * generator.uniform(0.2, 1) for _ in range(3)]
        if i % 8:
            side = generator.uniform(0.05, 0.2)
            text += area_light(position, [side, side / 2], [generator.uniform(-1, 1), generator.uniform(-1, 1), -1], color)
        else:
            text += table("lights", "point", position=position, color=[c / 20 for c in color])
    text += table("lights", "directional", direction=[0.5, 0.6, -1], color=[0.6, 0.5, 0.4])
    for i in range(9):
        text += shape("sphere", "ball", center=[i % 3 - 1, i // 3 - 1, 0.3], radius=0.3)
    return text


def room(depth, rr=5):
    """Returns a closed room of high albedo, in which paths are long."""
    text = head("position = [0, -0.9, 1]\nlook_at = [0, 1, 1.2]\nfov = 100", depth, rr) + material("white", 'type = "diffuse"\ncolor = [0.9, 0.85, 0.8]')
    for center, normal, tangent in (([0, 0, 0], [0, 0, 1], [1, 0, 0]), ([0, 0, 2], [0, 0, -1], [1, 0, 0]), ([0, 1, 1], [0, -1, 0], [1, 0, 0]),
                                    ([0, -1, 1], [0, 1, 0], [1, 0, 0]), ([-1, 0, 1], [1, 0, 0], [0, 1, 0]), ([1, 0, 1], [-1, 0, 0], [0, 1, 0])):
        text += rectangle("white", center, [2, 2], normal, tangent)
    return (text + material("mirror", 'type = "conductor"\ncolor = [0.9, 0.8, 0.6]') + area_light([0, 0, 1.95], [0.6, 0.4], [0, 0, -1])
            + shape("sphere", "mirror", center=[0.4, 0.4, 0.3], radius=0.3) + rectangle("white", [-0.3, 0.3, 0.7], [0.7, 0.7], [0.5, -1, 0.3], [1, 0, 0]))


TETRAHEDRON = [[-0.4, -0.3, 0.5], [0.45, -0.2, 0.6], [0, 0.4, 0.55], [0.05, 0, 1.2]]
SHAPES = (shape("disk", "ball", center=[-0.8, 0.2, 0.5], radius=0.4, normal=[0.4, -1, 0.5]) + shape("tetrahedron", "ball", vertices=TETRAHEDRON)
          + shape("triangle", "ball", vertices=[[0.6, 0.3, 0.1], [1.2, 0, 0.2], [0.9, 0.2, 1]])
          + shape("ellipsoid", "ball", center=[-0.3, -0.9, 0.3], a=[0.4, 0.1, 0], b=[0, 0.2, 0.05], c=[0.1, 0, 0.25]))
MESH = shape("mesh", "ball", file="meshes/blob.obj", normals="flat", scale=0.5, rotate=[20, 0, 30], translate=[0, 0, 0.6])
CHECKER = '\n[textures.checker]\ntype = "checker"\neven = [0.8, 0.7, 0.2]\nodd = [0.1, 0.2, 0.6]\nscale = [{0}, {0}]\n'

# Materials that Mitsuba also supports. They have no energy compensation, which Mitsuba lacks.
GOLD = "eta = [0.143, 0.375, 1.442]\nk = [3.983, 2.386, 1.603]"
SKY = '\n[environment]\nfile = "maps/lobes.hdr"\n'


NO_SPECULAR = 'type = "principled"\nmetallic = 0\nspecular = 0'
UNDEFLECTED = "transmission = 1\nroughness = 0\nior = 1"


def rough(kind, roughness, keys):
    return f'type = "{kind}"\nroughness = {roughness}\nenergy_compensation = false\n{keys}'


SCENES = {
    "diffuse": ball('type = "diffuse"\ncolor = [0.8, 0.5, 0.2]'),
    "conductor": ball('type = "conductor"\ncolor = [0.9, 0.7, 0.4]'),
    "mirror": ball('type = "mirror"\ntint = [0.7, 0.9, 0.8]'),
    "dielectric": ball('type = "dielectric"\nior = 1.5'),
    "dielectric-color": ball('type = "dielectric"\nior = 1.33\ncolor = [0.9, 0.6, 0.3]'),
    "dielectric-absorption": ball('type = "dielectric"\nior = 1.5\nabsorption = [0.4, 1.5, 0]'),
    "dielectric-air": ball('type = "dielectric"\nior = 0.7'),
    "dielectric-core": ball('type = "dielectric"\nior = 1.5', material("core", 'type = "diffuse"\ncolor = [0.7, 0.2, 0.2]')
                            + shape("sphere", "core", center=[0, 0, 0.5], radius=0.25)),
    "glass": ball('type = "glass"\nior = 1.7\ntint = [0.7, 0.9, 0.8]'),
    **{f"phong{n}": ball(f'type = "phong"\nambient = [0, 0, 0]\ndiffuse = [0.4, 0.3, 0.2]\nspecular = [0.3, 0.4, 0.5]\nshininess = {n}') for n in (1, 10, 100, 1000)},
    "phong-specular": ball('type = "phong"\nambient = [0, 0, 0]\ndiffuse = [0, 0, 0]\nspecular = [0.9, 0.8, 0.7]\nshininess = 40'),
    "emit-rectangle": emitter(rectangle("lit", [0.2, 0, 0.9], [0.9, 0.6], [0.5, -0.6, 0.7], [1, 0, 0])),
    "emit-disk": emitter(shape("disk", "lit", center=[0.2, 0, 0.9], radius=0.5, normal=[0.5, -0.6, 0.7])),
    "emit-triangle": emitter(shape("triangle", "lit", vertices=[[-0.4, -0.2, 0.6], [0.7, 0, 0.8], [0.2, 0.5, 1.3]])),
    "emit-tetrahedron": emitter(shape("tetrahedron", "lit", vertices=TETRAHEDRON)),
    "emit-sphere": emitter(shape("sphere", "lit", center=[0.3, 0, 0.9], radius=0.3)),
    "emit-ellipsoid": emitter(shape("ellipsoid", "lit", center=[0.3, 0, 0.9], a=[0.4, 0.1, 0.1], b=[0, 0.2, 0.1], c=[0.1, 0, -0.3])),
    "emit-mesh": emitter(MESH.replace('"ball"', '"lit"')),
    "emit-checker": emitter(rectangle("lit", [0.2, 0, 0.9], [0.9, 0.9], [0.5, -0.6, 0.7], [1, 0, 0]), emission='emission = { texture = "checker" }',
                            more=CHECKER.format(4)),
    "emit-all": emitter(rectangle("lit", [-0.9, 0.6, 0.9], [0.3, 0.3], [0.5, -0.6, 0.7], [1, 0, 0]),
                        shape("disk", "lit", center=[0.9, 0.5, 1], radius=0.2, normal=[-0.5, -0.6, 0.2]),
                        shape("sphere", "lit", center=[0.5, -0.5, 0.2], radius=0.1), shape("tetrahedron", "lit", vertices=TETRAHEDRON))
    + ENVIRONMENT + area_light(),
    "many-lights": many_lights(),
    "points-and-sun": head() + FLOOR + WALL + material("ball", GREY) + SHAPES + table("lights", "point", position=[-1, -1.5, 2], color=[4, 3, 2])
    + table("lights", "directional", direction=[-0.5, 0.6, -1], color=[0.5, 0.8, 1]),
    "environment": head() + ENVIRONMENT + FLOOR + material("ball", 'type = "diffuse"\ncolor = [0.7, 0.7, 0.7]') + SHAPES,
    "orthographic": head('type = "orthographic"\nposition = [-2, -4, 3]\nlook_at = [0, 0, 0.4]\nheight = 2.6') + ENVIRONMENT + FLOOR
    + material("ball", GREY) + SHAPES + area_light(),
    "checker": head() + ENVIRONMENT + CHECKER.format(8) + material("floor", 'type = "diffuse"\ncolor = { texture = "checker" }')
    + rectangle("floor", [0, 0, 0], [5, 5], [0, 0, 1], [1, 0, 0]) + material("ball", 'type = "conductor"\ncolor = [0.9, 0.9, 0.9]')
    + shape("sphere", "ball", center=[0, 0, 0.5], radius=0.5) + area_light(),
    "plane": head("position = [0, -4, 3.2]\nlook_at = [0, 0, 0.4]\nfov = 30") + ENVIRONMENT + material("floor", GREY) + shape(
        "plane", "floor", point=[0, 0, 0], normal=[0, 0, 1], tangent=[1, 0, 0]) + material("ball", GREY) + SHAPES + area_light(),
    "mesh": head() + ENVIRONMENT + FLOOR + material("ball", 'type = "diffuse"\ncolor = [0.7, 0.4, 0.3]') + MESH + area_light(),
    "mesh-glass": head() + ENVIRONMENT + FLOOR + material("ball", 'type = "dielectric"\nior = 1.4\ncolor = [0.8, 0.9, 1]') + MESH + area_light(),
    "instances": head() + ENVIRONMENT + FLOOR + material("ball", 'type = "diffuse"\ncolor = [0.7, 0.4, 0.3]') + '\n[meshes.blob]\nfile = "meshes/blob.obj"\n'
    + "".join(f'\n[[instances]]\nmesh = "blob"\nmaterial = "ball"\nscale = 0.2\nrotate = [0, {40 * i}, {70 * i}]\ntranslate = [{0.5 * i - 1}, {0.3 * i - 0.8}, 0.25]\n'
              for i in range(5)) + area_light(),
    **{f"conductor-rough{n}": ball(rough("conductor", n, "color = [0.9, 0.7, 0.4]")) for n in (0.1, 0.3, 0.6, 1)},
    "conductor-gold": ball(rough("conductor", 0.4, GOLD)), "conductor-gold-smooth": ball('type = "conductor"\n' + GOLD),
    "conductor-brushed": ball(rough("conductor", 0.3, GOLD + "\nanisotropy = 0.8")),
    "conductor-brushed-across": ball(rough("conductor", 0.3, GOLD + "\nanisotropy = 0.8\nanisotropy_rotation = 90")),
    "conductor-mesh": head() + ENVIRONMENT + FLOOR + material("ball", rough("conductor", 0.4, GOLD)) + MESH + area_light(),
    **{f"dielectric-rough{n}": ball(rough("dielectric", n, "ior = 1.5")) for n in (0.2, 0.5, 0.9)},
    "dielectric-rough-color": ball(rough("dielectric", 0.4, "ior = 1.33\ncolor = [0.9, 0.6, 0.3]")),
    "dielectric-rough-air": ball(rough("dielectric", 0.4, "ior = 0.7")),
    "dielectric-thin": ball('type = "dielectric"\nior = 1.5\nthin = true'),
    # Mitsuba's `principled` metal agrees for alpha near 0.01: at an alpha of 0.04 its masking-shadowing function differs at
    # the ball's edge, and Mitsuba replaces an alpha of 0 by 0.001. For a dielectric without reflection, other Mitsuba BSDFs
    # match the remaining lobes.
    "principled-metal": ball('type = "principled"\nroughness = 0.1\nbase_color = [0.9, 0.7, 0.4]'),
    "principled-brushed": ball('type = "principled"\nroughness = 0.1\nanisotropy = 0.15\nbase_color = [0.9, 0.7, 0.4]'),
    "principled-ground": ball(f'{NO_SPECULAR}\nbase_color = [0.8, 0.5, 0.2]'),
    "principled-sheet": ball(f'{NO_SPECULAR}\n{UNDEFLECTED}\nbase_color = [0.8, 0.5, 0.9]'),
    "principled-volume": ball(f'{NO_SPECULAR}\n{UNDEFLECTED}\nthickness = 1\nattenuation_color = [0.8, 0.3, 0.9]\nattenuation_distance = 0.6'),
    "lens": head(CAMERA + "\naperture = 0.5\nfocus_distance = 3.2") + ENVIRONMENT + FLOOR + material("ball", GREY) + SHAPES + area_light(),
    "map": head() + SKY + FLOOR + material("ball", 'type = "diffuse"\ncolor = [0.7, 0.7, 0.7]') + SHAPES,
    "map-turned": head() + SKY + "scale = 0.5\nrotate = 130\n" + FLOOR + material("ball", 'type = "conductor"\ncolor = [0.9, 0.8, 0.7]') + SHAPES,
    "map-rough": head() + SKY + FLOOR + material("ball", rough("conductor", 0.3, GOLD)) + shape("sphere", "ball", center=[0, 0, 0.55], radius=0.5),
    "spot": head() + FLOOR + WALL + material("ball", GREY) + SHAPES
    + table("lights", "spot", position=[-0.8, -1.5, 2], direction=[0.7, 1.3, -1.6], color=[9, 8, 7], cone_angle=25, inner_angle=25),
    "depth0": room(0), "depth1": room(1), "depth2": room(2), "depth24": room(24, 3), "roulette": room(64, 0),
}


def blob(rows=24, seed=1, radii=(1, 1, 1), center=(0, 0, 0)):
    """Returns a bumpy closed mesh: its vertices, and its triangles in counter-clockwise order seen from outside."""
    def point(theta, phi):
        d = [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]
        r = 0.85 + 0.1 * math.sin(5 * d[0] + 3 * d[1] + seed) + 0.05 * math.sin(9 * d[1] - 7 * d[2] + 2 * seed)
        return [c + r * a * x for c, a, x in zip(center, radii, d)]
    vertices = [point(0, 0)] + [point(math.pi * i / rows, math.pi * j / rows) for i in range(1, rows) for j in range(2 * rows)] + [point(math.pi, 0)]
    vertex_index = lambda i, j: 0 if i == 0 else len(vertices) - 1 if i == rows else 1 + (i - 1) * 2 * rows + j % (2 * rows)
    faces = []
    for i in range(rows):
        for j in range(2 * rows):
            a, b, c, d = (vertex_index(*k) for k in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
            faces += ([(a, b, c)] if i < rows - 1 else []) + ([(a, c, d)] if i else [])
    return vertices, faces


def block(corners, height):
    """Returns a prism that stands on the floor; `corners` are the corners (x, z) of its base, and y is up."""
    signed_area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, corners[1:] + corners[:1]))
    corners = corners if signed_area < 0 else corners[::-1]  # counter-clockwise seen from above, with z pointing down the page
    vertices = [[x, y, z] for y in (0, height) for x, z in corners]
    quads = [(4, 5, 6, 7), (3, 2, 1, 0), *((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4))]
    return vertices, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]


def wall(a, b, c, d):
    return [a, b, c, d], [(0, 1, 2), (0, 2, 3)]


SHORT = [(-0.0460751, -0.573007), (0.124253, -0.00310463), (0.703337, -0.176177), (0.533009, -0.746079)]
TALL = [(-0.720444, 0.473882), (-0.146892, 0.673479), (0.0495656, 0.108948), (-0.523986, -0.0906493)]
ASSETS = {
    "floor": wall([-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]), "ceiling": wall([-1, 2, -1], [1, 2, -1], [1, 2, 1], [-1, 2, 1]),
    "back": wall([-1, 0, -1], [1, 0, -1], [1, 2, -1], [-1, 2, -1]), "left": wall([-1, 0, 1], [-1, 0, -1], [-1, 2, -1], [-1, 2, 1]),
    "right": wall([1, 0, -1], [1, 0, 1], [1, 2, 1], [1, 2, -1]), "short": block(SHORT, 0.6), "tall": block(TALL, 1.2),
    "dragon": blob(72, 3, (0.11, 0.09, 0.07), (0, -0.015, 0)), "bunny": blob(48, 5, (0.07, 0.08, 0.06), (0, 0.1, 0)),
}


def course_scene(depth, *objects):
    """Returns a JSON scene in the format of a university course's renderer: a box with objects."""
    walls = [("floor", "grey"), ("ceiling", "grey"), ("back", "grey"), ("left", "red"), ("right", "green")]
    return {
        "spp": 256, "max_depth": depth, "image_resolution": [600, 600],
        "cam_config": {"position": [0, 1, 6.8], "look_at": [0, 1, 0], "ref_up": [0, 1, 0], "vertical_fov": 19.5, "focal_length": 1},
        "light_config": {"position": [0, 1.98, 0], "size": [0.5, 0.5], "radiance": [17, 12, 5]},
        "materials": [{"name": "grey", "type": "diffuse", "color": [0.725, 0.71, 0.68]}, {"name": "green", "type": "diffuse", "color": [0.14, 0.45, 0.091]},
                      {"name": "red", "type": "diffuse", "color": [0.63, 0.065, 0.05]}, {"name": "mirror", "type": "specular", "color": [0.95, 0.95, 0.95]}],
        "objects": [{"obj_file_path": f"../assets/{name}.obj", "material_name": material, "translate": list(position), "scale": scale, "has_bvh": scale != 1}
                    for name, material, position, scale in [(name, color, (0, 0, 0), 1) for name, color in walls] + list(objects)],
    }


COURSE_SCENES = {
    "boxes": course_scene(10, ("short", "grey", (0, 0, 0), 1), ("tall", "grey", (0, 0, 0), 1)),
    "boxes-mirror": course_scene(10, ("short", "grey", (-0.7, 0, 0.6), 1), ("tall", "mirror", (0.7, 0, -0.5), 1)),
    "meshes": course_scene(12, ("dragon", "grey", (0.3, 0.4, -0.2), 4), ("bunny", "grey", (-0.4, -0.1, 0.2), 4), ("short", "grey", (0, 0, 0), 1)),
}


def write_map(path, width=256):
    """Writes a pale sky with a bright warm lobe and a dim cold lobe as an uncompressed Radiance file."""
    height = width // 2
    lobes = [((0.5, -0.7, 0.5), 30, (12, 10, 7)), ((-0.8, 0.1, 0.3), 8, (0.5, 0.9, 1.6))]
    lobes = [([x / math.hypot(*axis) for x in axis], sharpness, color) for axis, sharpness, color in lobes]
    texels = bytearray()
    for row in range(height):
        polar = math.pi * (row + 0.5) / height
        for column in range(width):
            azimuth = math.pi * (1 - 2 * (column + 0.5) / width)  # the centre is +x, the left half is towards +y
            d = (math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar))
            color = [0.15, 0.18, 0.22]
            for axis, sharpness, light in lobes:
                weight = math.exp(sharpness * (sum(a * b for a, b in zip(d, axis)) - 1))
                color = [c + weight * l for c, l in zip(color, light)]
            _, exponent = math.frexp(max(color))
            texels += bytes(min(255, int(c * 256 / 2 ** exponent)) for c in color) + bytes([exponent + 128])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {height} +X {width}\n".encode() + texels)


def write_obj(path, mesh):
    path.parent.mkdir(parents=True, exist_ok=True)
    vertices, faces = mesh
    path.write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in vertices) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces))


def write(folder):
    """Writes all files; returns the paths of the scenes by name."""
    folder = pathlib.Path(folder)
    write_obj(folder / "meshes" / "blob.obj", blob())
    write_map(folder / "maps" / "lobes.hdr")
    for name, mesh in ASSETS.items():
        write_obj(folder / "assets" / f"{name}.obj", mesh)
    (folder / "configs").mkdir(exist_ok=True)
    paths = {}
    for name, text in SCENES.items():
        paths[name] = folder / f"{name}.toml"
        paths[name].write_text(text)
    for name, scene in COURSE_SCENES.items():
        paths[name] = folder / "configs" / f"{name}.json"
        paths[name].write_text(json.dumps(scene, indent=2) + "\n")
    return paths


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    write(sys.argv[1])
