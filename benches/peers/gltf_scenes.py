"""Small glTF scenes for comparisons with other programs: spheres, a floor, textures and lights.

`all_scenes()` returns the names and files of the scenes, and their cameras and environments, which are not in the files.
"""
import json
import math
import struct
import zlib


class File:
    """A .glb file under construction."""

    def __init__(self):
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.bytes = bytearray()

    def add(self, section, value):
        """Appends a value to a list of the document and returns its index."""
        self.json.setdefault(section, []).append(value)
        return len(self.json[section]) - 1

    def view(self, data):
        """Adds a buffer view of data and returns its index."""
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        view = self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data
        return view

    def floats(self, values):
        """Adds an accessor of 32-bit floats or vectors and returns its index."""
        width = len(values[0])
        flat = [x for value in values for x in value]
        accessor = {"bufferView": self.view(struct.pack(f"<{len(flat)}f", *flat)), "componentType": 5126, "count": len(values),
                    "type": ["", "SCALAR", "VEC2", "VEC3", "VEC4"][width]}
        if width == 3:
            accessor["min"], accessor["max"] = ([f(v[k] for v in values) for k in range(3)] for f in (min, max))
        return self.add("accessors", accessor)

    def mesh(self, positions, normals, uvs, indices, material, colors=None):
        attributes = {"POSITION": self.floats(positions), "NORMAL": self.floats(normals), "TEXCOORD_0": self.floats(uvs)}
        if colors:
            attributes["COLOR_0"] = self.floats(colors)
        view = self.view(struct.pack(f"<{len(indices)}I", *indices))
        accessor = self.add("accessors", {"bufferView": view, "componentType": 5125, "count": len(indices), "type": "SCALAR"})
        return self.add("meshes", {"primitives": [{"attributes": attributes, "indices": accessor, "material": material}]})

    def node(self, **node):
        self.json["scenes"][0]["nodes"].append(self.add("nodes", node))

    def material(self, color=(0.8, 0.8, 0.8), metallic=0, roughness=0.5, **more):
        pbr = {"baseColorFactor": [*color, 1], "metallicFactor": metallic, "roughnessFactor": roughness, **more.pop("pbr", {})}
        for name in more.get("extensions", {}):
            self.uses(name)
        return self.add("materials", {"pbrMetallicRoughness": pbr, **more})

    def uses(self, name):
        if name not in self.json.setdefault("extensionsUsed", []):
            self.json["extensionsUsed"].append(name)

    def light(self, kind, intensity, color=(1, 1, 1), position=(0, 0, 0), rotation=(0, 0, 0, 1), **more):
        self.uses("KHR_lights_punctual")
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append({"type": kind, "intensity": intensity, "color": list(color), **more})
        reference = {"KHR_lights_punctual": {"light": len(lights) - 1}}
        self.node(translation=list(position), rotation=list(rotation), extensions=reference)

    def texture(self, rows):
        """Adds an unfiltered texture of 8-bit texels in row-major order, top row first."""
        raw = b"".join(b"\0" + bytes(x for texel in row for x in texel) for row in rows)
        chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
        png = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")
        image = self.add("images", {"bufferView": self.view(png), "mimeType": "image/png"})
        sampler = self.add("samplers", {"magFilter": 9728, "minFilter": 9728})
        return self.add("textures", {"source": image, "sampler": sampler})

    def sphere(self, material, rows=48):
        points, uvs = [], []
        for i in range(rows + 1):
            for j in range(2 * rows + 1):
                a, b = math.pi * i / rows, math.pi * j / rows
                points.append([math.sin(a) * math.cos(b), math.cos(a), -math.sin(a) * math.sin(b)])
                uvs.append([j / (2 * rows), i / rows])
        return self.mesh(points, points, uvs, self.sphere_indices(rows), material)

    @staticmethod
    def sphere_indices(rows):
        """Returns the triangles of a sphere except the degenerate triangles at the poles."""
        indices, width = [], 2 * rows + 1
        for i in range(rows):
            for j in range(2 * rows):
                k = i * width + j
                if i < rows - 1:
                    indices += [k, k + width, k + width + 1]
                if i > 0:
                    indices += [k, k + width + 1, k + 1]
        return indices

    def square(self, material, colors=None):
        """Adds a square from (-1, -1) to (1, 1) that faces +z."""
        corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
        uvs = [[0, 1], [1, 1], [1, 0], [0, 0]]
        return self.mesh(corners, [[0, 0, 1]] * 4, uvs, [0, 1, 2, 0, 2, 3], material, colors)

    def floor(self, size, material):
        half = math.sqrt(0.5)
        self.node(mesh=self.square(material), rotation=[-half, 0, 0, half], scale=[size, size, 1], translation=[0, -1, 0])

    def glb(self):
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.bytes) + b"\0" * (-len(self.bytes) % 4)
        chunks = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(data)) + b"BIN\0" + data
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


CHECKER = [[(200, 200, 200) if (i + j) % 2 else (60, 60, 60) for j in range(8)] for i in range(8)]
LETTER = [[(255, 60, 60), (255, 60, 60), (255, 255, 255), (60, 60, 255)],
          [(255, 60, 60), (60, 200, 60), (255, 255, 255), (255, 255, 255)],
          [(255, 60, 60), (255, 60, 60), (255, 60, 60), (255, 255, 255)],
          [(0, 0, 0), (255, 255, 255), (255, 255, 0), (255, 255, 0)]]


def row_of(file, materials, y=0.0):
    for i, material in enumerate(materials):
        file.node(mesh=file.sphere(material), translation=[2.2 * (i - (len(materials) - 1) / 2), y, 0])


def checkered(file):
    return file.material((1, 1, 1), pbr={"baseColorTexture": {"index": file.texture(CHECKER)}}, roughness=1)


def directional_light(file):
    """Adds a directional light from the upper right and the front."""
    a, b = math.radians(-50) / 2, math.radians(35) / 2
    rotation = [math.sin(a) * math.cos(b), math.cos(a) * math.sin(b), -math.sin(a) * math.sin(b), math.cos(a) * math.cos(b)]
    file.light("directional", 2, rotation=rotation)


def surfaces():
    file = File()
    file.floor(8, checkered(file))
    row_of(file, [file.material((0.9, 0.5, 0.2), 1, r) for r in (0.1, 0.35, 0.6, 1)], 0)
    row_of(file, [file.material((0.2, 0.5, 0.9), 0, r) for r in (0.1, 0.35, 0.6, 1)], 2.2)
    directional_light(file)
    return file


def glass():
    file = File()
    file.floor(8, checkered(file))
    clear = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}
    green = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.33},
             "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0.7, "attenuationColor": [0.4, 0.9, 0.5]}}
    row_of(file, [file.material((1, 1, 1), 0, 0, extensions=clear), file.material((1, 1, 1), 0, 0.4, extensions=clear),
                  file.material((1, 1, 1), 0, 0, extensions=green)])
    return file


def textures():
    file = File()
    file.uses("KHR_texture_transform")
    letter, quarter = file.texture(LETTER), math.pi / 2
    transforms = [{}, {"offset": [0.25, 0.5]}, {"scale": [2, 3]}, {"rotation": 0.5}, {"offset": [0, 1], "rotation": quarter},
                  {"offset": [0.3, -0.2], "rotation": -0.7, "scale": [1.5, 0.5]}]
    for i, transform in enumerate(transforms):
        info = {"index": letter, "extensions": {"KHR_texture_transform": transform}}
        mesh = file.square(file.material((1, 1, 1), roughness=1, pbr={"baseColorTexture": info}))
        file.node(mesh=mesh, translation=[2.3 * (i % 3 - 1), 1.15 - 2.3 * (i // 3), 0])
    return file


def colors():
    file = File()
    shades = [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 1, 1]]
    for i, base in enumerate([(1, 1, 1), (1, 0.5, 0.25)]):
        file.node(mesh=file.square(file.material(base, roughness=1), shades), translation=[2.3 * (i - 0.5), 0, 0])
    return file


def lights():
    file = File()
    file.floor(8, file.material((0.7, 0.7, 0.7), 0, 1))
    row_of(file, [file.material((0.8, 0.3, 0.2), 0, 1), file.material((0.3, 0.8, 0.2), 0, 0.6), file.material((0.9, 0.9, 0.9), 1, 0.4)])
    file.light("point", 30, (1, 0.8, 0.6), (-2, 3, 2))
    half = math.sqrt(0.5)
    file.light("spot", 60, (0.5, 0.7, 1), (2.5, 5, 1), (-half, 0, 0, half), spot={"innerConeAngle": 0.395, "outerConeAngle": 0.4})
    directional_light(file)
    return file


def layers():
    file = File()
    file.floor(8, checkered(file))
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.1}}
    cloth = {"KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1], "sheenRoughnessFactor": 0.5}}
    tint = {"KHR_materials_specular": {"specularFactor": 1, "specularColorFactor": [1, 0.2, 0.2]}, "KHR_materials_ior": {"ior": 2}}
    emitter = {"KHR_materials_emissive_strength": {"emissiveStrength": 3}}
    row_of(file, [file.material((0.6, 0.05, 0.05), 0, 0.8, extensions=coat), file.material((0.1, 0.1, 0.4), 0, 1, extensions=cloth),
                  file.material((0.1, 0.1, 0.1), 0, 0.2, extensions=tint),
                  file.material((0, 0, 0), 0, 1, extensions=emitter, emissiveFactor=[1, 0.5, 0.1])])
    directional_light(file)
    return file


def all_scenes():
    """Returns the name and file of each scene, the camera's position, target (+z up) and field of view, and the environment's colour."""
    sky = [0.6, 0.7, 0.9]
    return [
        ("surfaces", surfaces(), [0, -14, 4], [0, 0, 0.9], 36, sky),
        ("glass", glass(), [0, -10, 3], [0, 0, 0], 36, sky),
        ("textures", textures(), [0, -10, 0], [0, 0, 0], 42, [1, 1, 1]),
        ("colors", colors(), [0, -10, 0], [0, 0, 0], 30, [1, 1, 1]),
        ("lights", lights(), [0, -12, 4], [0, 0, 0], 36, [0, 0, 0]),
        ("layers", layers(), [0, -14, 4], [0, 0, 0], 36, sky),
    ]
