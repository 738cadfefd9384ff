"""The workloads of the script `run`."""
import dataclasses

import generate
import install

ALL = ("lavapipe", "mesa-backports", "cpu", "mitsuba", "povray")


@dataclasses.dataclass
class Workload:
    title: str
    scene: str  # a file of the repository, or the name of a scene in generate.py
    size: int = 512
    kind: str = "render"  # or "cold", "cached": the whole process; "build": reading a mesh and building its BVH
    lights: int = 1
    renderers: tuple = ALL
    repeats: int = 3  # per round
    integrator: str = "phong"
    spp: int = 16

    def generated(self):
        """Returns the names of the generated scenes that the workload needs."""
        if self.scene not in generate.SCENES:
            return []
        return [self.scene] + ([f"{self.scene}-tiny"] if self.kind == "build" else [])

    def resized(self, size):
        title = self.title.replace(f"{self.size}x{self.size}", f"{size}x{size}")
        return dataclasses.replace(self, title=title, size=size)

    def rays(self, spp, light_samples):
        """Returns the number of nominal rays. A path counts as one ray."""
        return self.size ** 2 * spp * (1 if self.integrator == "path" else 1 + light_samples * self.lights)


CORNELL, ELLIPSOIDS = str(install.ROOT / "scenes/cornell.toml"), str(install.HERE / "ellipsoids20.toml")
CORNELL_PATH = str(install.ROOT / "scenes/cornell-path.toml")
NO_POVRAY = ALL[:-1]
PATHS = ("lavapipe", "mesa-backports", "cpu", "mitsuba", "cycles")
WITHOUT_CYCLES = PATHS[:-1]


def large(title, scene, renderers=NO_POVRAY):
    return Workload(f"{title}, 512x512", scene, renderers=renderers, repeats=1)


def path(title, scene, size, kind="render"):
    return Workload(f"{title}, {size}x{size}", scene, size, kind, renderers=PATHS, integrator="path", spp=64, repeats=3 if kind == "render" else 1)


def build(title, scene):
    return Workload(f"reading and building {title}", scene, kind="build", renderers=("lavapipe", "mesa-backports", "cpu", "mitsuba"))


SMALL = {
    "cornell400": Workload("scenes/cornell.toml, 400x400", CORNELL, 400),
    "cornell800": Workload("scenes/cornell.toml, 800x800", CORNELL, 800),
    "ellipsoids": Workload("20 ellipsoids, 3 lights, 400x400", ELLIPSOIDS, 400, lights=3),
    "cold": Workload("scenes/cornell.toml, 400x400, whole process, caches empty", CORNELL, 400, "cold", repeats=1),
    "cached": Workload("scenes/cornell.toml, 400x400, whole process, caches warm", CORNELL, 400, "cached", repeats=1),
}
LARGE = {
    "rock70k": large("rock of 69,312 triangles", "rock70k", ALL),
    "rock870k": large("rock of 868,332 triangles", "rock870k"),
    "dragon870k": large("Stanford dragon, 871,414 triangles", "dragon870k"),
    "terrain1m": large("terrain of 999,698 triangles", "terrain1m"),
    "ellipsoids10": large("10 ellipsoids in a box", "ellipsoids10", ALL),
    "ellipsoids1000": large("1,000 ellipsoids in a box", "ellipsoids1000", ALL),
    "ellipsoids100000": large("100,000 ellipsoids in a box", "ellipsoids100000", ALL),
    "instances1000": large("1,000 instances of the rock of 69,312 triangles", "instances1000"),
    "build1m": build("the terrain of 999,698 triangles", "terrain1m"),
    "build10m": build("the terrain of 9,999,392 triangles", "terrain10m"),
    "terrain10m": large("terrain of 9,999,392 triangles", "terrain10m"),
}
PATH = {
    "path": path("paths in scenes/cornell-path.toml", CORNELL_PATH, 400),
    "path-rock70k": path("paths around a rock of 69,312 triangles", "path-rock70k", 400),
    "path-rock870k": dataclasses.replace(path("paths around a rock of 868,332 triangles", "path-rock870k", 400), renderers=WITHOUT_CYCLES),
    "path-cold": path("paths in scenes/cornell-path.toml, whole process, caches empty", CORNELL_PATH, 400, "cold"),
}
MATERIALS = {name: dataclasses.replace(workload, renderers=WITHOUT_CYCLES) for name, workload in {  # cycles_scenes.py does not support these scenes
    "spheres": path("a rough metal and a rough glass sphere under a map", "path-spheres", 400),
    "lamps1": path("a room with one area light", "path-lamps1", 400),
    "lamps1000": path("a room with 1,000 area lights", "path-lamps1000", 400),
    "principled70k": path("principled on a rock of 69,312 triangles", "path-principled70k", 400),
}.items()}
WORKLOADS = SMALL | LARGE | PATH | MATERIALS
SETS = {"small": list(SMALL), "large": list(LARGE), "paths": list(PATH), "materials": list(MATERIALS), "all": list(WORKLOADS)}
