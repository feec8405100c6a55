#!/usr/bin/env python3
"""Makes small glTF scenes that stress one thing each, for tools/evaluate.

Usage: make_scenes.py FOLDER [NAME...]      (default: all; --list prints the names)

Python 3 and its standard library only; the files' bytes depend on nothing but this script. Conventions are those of
vlx-trace: metres, y up, radiometric units (point lights W/sr, emission is radiance), camera extras `lens_radius` and
`focus_distance`, scene extras `light_units` and `env_constant`. Without the latter the background is black. Every
picture is square.
"""

import json
import math
import os
import random
import struct
import sys
import zlib


# ---- vectors ---------------------------------------------------------------------------------------------------

def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def subtract(a, b):
    return tuple(x - y for x, y in zip(a, b))


def scaled(a, s):
    return tuple(x * s for x in a)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    return scaled(a, 1 / math.sqrt(sum(x * x for x in a)))


def png(width, height, pixel):
    """An 8-bit RGB PNG whose pixels are pixel(x, y) = (r, g, b), 0 to 255 (sRGB)."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    rows = b"".join(b"\0" + bytes(v for x in range(width) for v in pixel(x, y)) for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


# ---- a glTF file in the making ---------------------------------------------------------------------------------

class Scene:
    def __init__(self):
        self.json = {"asset": {"version": "2.0", "generator": "make_scenes.py"}, "scene": 0,
                     "scenes": [{"nodes": [], "extras": {"light_units": "radiometric"}}], "nodes": [],
                     "cameras": [], "materials": [], "meshes": [], "accessors": [], "bufferViews": []}
        self.bytes = b""
        self.triangles = 0

    def _use(self, extension):
        used = self.json.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def _node(self, node):
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]))
        self.json["nodes"].append(node)

    def _view(self, data):
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data + b"\0" * (-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def _floats(self, rows):
        n = len(rows[0])
        view = self._view(struct.pack(f"<{n * len(rows)}f", *(v for row in rows for v in row)))
        accessor = {"bufferView": view, "componentType": 5126, "count": len(rows), "type": f"VEC{n}"}
        # What the file holds are floats: so are the bounds that the specification asks for.
        single = [struct.unpack(f"<{n}f", struct.pack(f"<{n}f", *row)) for row in rows]
        accessor["min"] = [min(c) for c in zip(*single)]
        accessor["max"] = [max(c) for c in zip(*single)]
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def texture(self, file, nearest=False):
        """An embedded PNG, repeated; returns its index."""
        images = self.json.setdefault("images", [])
        images.append({"bufferView": self._view(file), "mimeType": "image/png"})
        samplers = self.json.setdefault("samplers", [])
        samplers.append({"magFilter": 9728 if nearest else 9729, "wrapS": 10497, "wrapT": 10497})
        textures = self.json.setdefault("textures", [])
        textures.append({"source": len(images) - 1, "sampler": len(samplers) - 1})
        return len(textures) - 1

    def material(self, colour=(0.8, 0.8, 0.8), metallic=0.0, roughness=1.0, emission=None, transmission=0.0,
                 texture=None, double_sided=False, specular=1.0):
        """`emission` is radiance (W/sr/m2); returns the material's index."""
        pbr = {"baseColorFactor": [*colour, 1], "metallicFactor": metallic, "roughnessFactor": roughness}
        if texture is not None:
            pbr["baseColorTexture"] = {"index": texture}
        m = {"pbrMetallicRoughness": pbr, "doubleSided": double_sided}
        extensions = {}
        if emission:
            strength = max(emission)
            m["emissiveFactor"] = list(scaled(emission, 1 / strength))
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        if transmission:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": transmission}
        if specular != 1:
            extensions["KHR_materials_specular"] = {"specularFactor": specular}
        if extensions:
            m["extensions"] = extensions
            for name in extensions:
                self._use(name)
        self.json["materials"].append(m)
        return len(self.json["materials"]) - 1

    def mesh(self, material, positions, triangles, normals=None, uvs=None):
        attributes = {"POSITION": self._floats(positions)}
        if normals:
            attributes["NORMAL"] = self._floats(normals)
        if uvs:
            attributes["TEXCOORD_0"] = self._floats(uvs)
        flat = [i for t in triangles for i in t]
        self.json["accessors"].append({"bufferView": self._view(struct.pack(f"<{len(flat)}H", *flat)),
                                       "componentType": 5123, "count": len(flat), "type": "SCALAR"})
        primitive = {"attributes": attributes, "indices": len(self.json["accessors"]) - 1, "material": material}
        self._node({"mesh": len(self.json["meshes"])})
        self.json["meshes"].append({"primitives": [primitive]})
        self.triangles += len(triangles)

    def quad(self, material, corner, u, v, repeat=(1, 1)):
        """The parallelogram corner, corner + u, corner + u + v, corner + v; it faces u x v."""
        n = unit(cross(u, v))
        s, t = repeat
        self.mesh(material, [corner, add(corner, u), add(add(corner, u), v), add(corner, v)],
                  [(0, 1, 2), (0, 2, 3)], [n] * 4, [(0, 0), (s, 0), (s, t), (0, t)])

    def box(self, material, centre, size, turn=0):
        """Axis-parallel, then turned about the vertical through its centre by `turn` degrees."""
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        x = scaled((c, 0, -s), size[0])
        y = (0, size[1], 0)
        z = scaled((s, 0, c), size[2])
        low = subtract(centre, scaled(add(add(x, y), z), 0.5))
        for corner, u, v in ((add(low, z), x, y), (add(low, x), scaled(x, -1), y), (low, z, y),
                             (add(add(low, x), z), scaled(z, -1), y), (add(add(low, y), z), x, scaled(z, -1)),
                             (low, x, z)):
            self.quad(material, corner, u, v)

    def sphere(self, material, centre, radius, segments=24):
        """segments around, half as many from pole to pole: segments (segments - 2) triangles."""
        rings = segments // 2
        normals = [(0.0, 1.0, 0.0)]
        for i in range(1, rings):
            polar = math.pi * i / rings
            for j in range(segments):
                around = 2 * math.pi * j / segments
                normals.append((math.sin(polar) * math.cos(around), math.cos(polar),
                                -math.sin(polar) * math.sin(around)))
        normals.append((0.0, -1.0, 0.0))
        last = len(normals) - 1

        def at(ring, j):
            return 1 + (ring - 1) * segments + j % segments
        triangles = [(0, at(1, j), at(1, j + 1)) for j in range(segments)]
        for i in range(1, rings - 1):
            for j in range(segments):
                triangles += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
        triangles += [(last, at(rings - 1, j + 1), at(rings - 1, j)) for j in range(segments)]
        self.mesh(material, [add(centre, scaled(n, radius)) for n in normals], triangles, normals)

    def tube(self, material, start, end, radius, sides=3):
        """An open prism with rounded normals around the line from start to end."""
        axis = unit(subtract(end, start))
        side = unit(cross(axis, (0, 0, 1) if abs(axis[2]) < 0.9 else (1, 0, 0)))
        up = cross(axis, side)
        normals, positions, triangles = [], [], []
        for j in range(sides):
            a = 2 * math.pi * j / sides
            n = add(scaled(side, math.cos(a)), scaled(up, math.sin(a)))
            normals += [n, n]
            positions += [add(start, scaled(n, radius)), add(end, scaled(n, radius))]
            p, q = 2 * j, 2 * ((j + 1) % sides)
            triangles += [(p, q, p + 1), (q, q + 1, p + 1)]
        self.mesh(material, positions, triangles, normals)

    def camera(self, eye, target, fov, lens_radius=0.0, focus=None):
        back = unit(subtract(eye, target))
        right = unit(cross((0, 1, 0), back))
        up = cross(back, right)
        extras = {"active": 1}
        if lens_radius:
            extras |= {"lens_radius": lens_radius, "focus_distance": focus}
        self._node({"camera": len(self.json["cameras"]), "name": "camera", "extras": extras,
                    "matrix": [*right, 0, *up, 0, *back, 0, *eye, 1]})
        self.json["cameras"].append({"type": "perspective", "perspective": {
            "yfov": math.radians(fov), "aspectRatio": 1, "znear": 0.01}})

    def point_light(self, position, intensity):
        """`intensity` is W/sr for R, G, B."""
        self._use("KHR_lights_punctual")
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        strength = max(intensity)
        lights.append({"type": "point", "intensity": strength, "color": list(scaled(intensity, 1 / strength))})
        self._node({"translation": list(position), "extensions": {"KHR_lights_punctual": {"light": len(lights) - 1}}})

    def environment(self, radiance):
        self.json["scenes"][0]["extras"]["env_constant"] = list(radiance)

    def glb(self):
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        return (struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(self.bytes), len(text), 0x4E4F534A) + text +
                struct.pack("<II", len(self.bytes), 0x004E4942) + self.bytes)


def floor(scene, material, half=5.0, repeat=(1, 1)):
    scene.quad(material, (-half, 0, half), (2 * half, 0, 0), (0, 0, -2 * half), repeat)


def lamp(scene, centre, width, depth, radiance):
    """A horizontal emitter that shines downwards."""
    material = scene.material((0, 0, 0), emission=radiance)
    scene.quad(material, (centre[0] - width / 2, centre[1], centre[2] - depth / 2), (width, 0, 0), (0, 0, depth))


# ---- the scenes ------------------------------------------------------------------------------------------------

def hard_shadow():
    """One point light: shadow edges that no feature shows, sharp at every distance."""
    s = Scene()
    s.camera((0.4, 2.2, 5.2), (0, 0.7, 0), 40)
    s.point_light((-1.5, 3.4, 3.0), (64, 61, 55))
    floor(s, s.material((0.6, 0.58, 0.55)))
    s.quad(s.material((0.45, 0.55, 0.65)), (-5, 0, -2), (10, 0, 0), (0, 5, 0))
    s.box(s.material((0.75, 0.25, 0.2)), (-0.8, 0.5, 0.2), (0.8, 1, 0.8), 25)
    s.sphere(s.material((0.25, 0.6, 0.3), roughness=0.4), (0.7, 0.5, 0.7), 0.5)
    pole = s.material((0.8, 0.75, 0.4), metallic=1, roughness=0.35)
    s.tube(pole, (1.4, 0, -0.6), (1.4, 2.1, -0.6), 0.03, 8)
    s.tube(pole, (0.5, 1.75, -0.6), (2.3, 1.75, -0.6), 0.03, 8)
    for i in range(5):  # a comb: its teeth's shadows are a few pixels wide
        s.tube(pole, (-1.9 + 0.14 * i, 0, -1.0), (-1.9 + 0.14 * i, 1.3, -1.0), 0.025, 6)
    return s


def soft_shadow():
    """One large area light: penumbrae from contact to metres wide."""
    s = Scene()
    s.camera((-0.6, 2.0, 5.0), (0, 0.6, 0), 40)
    lamp(s, (1.2, 3.4, 0.6), 1.8, 1.2, (9, 8.6, 8))
    floor(s, s.material((0.7, 0.68, 0.64)))
    s.quad(s.material((0.7, 0.6, 0.5)), (-5, 0, -2), (10, 0, 0), (0, 5, 0))
    s.box(s.material((0.3, 0.4, 0.7)), (-0.9, 0.8, -0.4), (0.5, 1.6, 0.5), 15)
    s.box(s.material((0.7, 0.7, 0.7)), (0.2, 0.9, -0.7), (2.4, 0.05, 0.5), -8)
    s.sphere(s.material((0.8, 0.35, 0.25)), (0.5, 0.4, 0.6), 0.4)
    s.sphere(s.material((0.7, 0.7, 0.3), roughness=0.3), (-0.2, 0.2, 1.3), 0.2, 20)
    return s


def caustics():
    """A glass ball and the inside of a polished ring throw light on a diffuse floor."""
    s = Scene()
    s.camera((0, 2.6, 4.4), (0, 0.35, 0.1), 38)
    lamp(s, (-1.0, 3.2, -0.6), 1.4, 1.4, (13, 12.2, 11))
    floor(s, s.material((0.7, 0.66, 0.6)))
    s.quad(s.material((0.35, 0.4, 0.45)), (-5, 0, -2.2), (10, 0, 0), (0, 5, 0))
    s.sphere(s.material((1, 1, 1), roughness=0, transmission=1), (-0.75, 0.6, 0.1), 0.5, 28)
    gold = s.material((0.95, 0.75, 0.4), metallic=1, roughness=0.02, double_sided=True)
    s.tube(gold, (0.9, 0, 0.5), (0.9, 0.4, 0.5), 0.6, 48)
    s.box(s.material((0.6, 0.2, 0.25)), (1.2, 0.3, -1.0), (0.5, 0.6, 0.5), 30)
    return s


def fine_texture():
    """Textures from several pixels a texel down to many texels a pixel, without regularity to hide behind."""
    s = Scene()
    rng = random.Random(1)
    speckle = [[rng.random() for _ in range(128)] for _ in range(128)]

    def carpet(x, y):
        v = speckle[y][x] ** 2
        red = (x // 16 + y // 16) % 2
        return (int(60 + 190 * v), int((40 if red else 80) + 150 * v), int((40 if red else 120) + 110 * v))

    def page(x, y):
        """Lines of letters of random strokes."""
        ink = y % 8 < 5 and 4 <= x < 124 and speckle[y // 8][x // 4] > 0.15 and speckle[y][x] > 0.45
        return (25, 25, 35) if ink else (235, 228, 210)
    s.camera((0, 1.3, 4.2), (0, 0.65, 0), 42)
    lamp(s, (0.5, 3.6, 1.5), 1.2, 1.2, (11, 11, 11))
    s.environment((0.25, 0.28, 0.32))
    floor(s, s.material((1, 1, 1), texture=s.texture(png(128, 128, carpet), nearest=True)), 6, (8, 8))
    letters = s.material((1, 1, 1), texture=s.texture(png(128, 128, page)))
    s.quad(letters, (-2.6, 0, -1.6), (5.2, 0, 0), (0, 3, 0), (2.6, 1.5))
    s.box(letters, (-0.9, 0.45, 0.4), (0.9, 0.9, 0.9), 35)
    s.sphere(s.material((0.6, 0.3, 0.2), roughness=0.2), (0.8, 0.4, 0.6), 0.4)
    return s


def mirrors():
    """Flat and curved mirrors that see each other, and a glossy floor: edges that first-hit features miss."""
    s = Scene()
    tiles = png(64, 64, lambda x, y: (225, 220, 205) if (x // 32 + y // 32) % 2 else (70, 110, 130))
    s.camera((0.9, 1.5, 4.2), (-0.1, 0.75, -0.2), 44)
    lamp(s, (0, 3.2, 0.8), 1.4, 1.4, (8, 7.7, 7.2))
    floor(s, s.material((1, 1, 1), roughness=0.18, texture=s.texture(tiles, nearest=True)), 4, (6, 6))
    for corner, u in (((-4, 0, -2), (8, 0, 0)), ((4, 0, 4), (-8, 0, 0)), ((-3, 0, 4), (0, 0, -8)),
                      ((3, 0, -4), (0, 0, 8))):
        s.quad(s.material((0.6, 0.55, 0.5)), corner, u, (0, 3.5, 0))
    mirror = s.material((0.95, 0.95, 0.95), metallic=1, roughness=0)
    s.quad(mirror, (-1.5, 0.2, -1.9), (2.2, 0, 0), (0, 1.9, 0))
    s.quad(mirror, (-2.2, 0.2, 1.4), (0.3, 0, -2.6), (0, 1.7, 0))
    s.sphere(mirror, (0.1, 0.45, 0.1), 0.45, 28)
    s.sphere(s.material((0.95, 0.7, 0.45), metallic=1, roughness=0.25), (1.1, 0.3, 0.5), 0.3, 20)
    s.box(s.material((0.7, 0.15, 0.15)), (-0.9, 0.3, 0.5), (0.4, 0.6, 0.4), 20)
    s.box(s.material((0.2, 0.3, 0.7)), (1.4, 0.6, -1.0), (0.5, 1.2, 0.5), -20)
    return s


def depth_of_field():
    """A wide lens over rows of balls: features are noisy wherever the picture is out of focus."""
    s = Scene()
    rng = random.Random(2)
    checks = png(64, 64, lambda x, y: (200, 195, 185) if (x // 32 + y // 32) % 2 else (60, 55, 50))
    eye, focus = (0, 0.9, 3.2), (0, 0.25, 0)
    s.camera(eye, focus, 36, 0.08, math.dist(eye, focus))
    s.environment((0.35, 0.4, 0.5))
    lamp(s, (1, 3, 1), 1, 1, (9, 8.5, 8))
    floor(s, s.material((1, 1, 1), texture=s.texture(checks, nearest=True)), 8, (16, 16))
    for row, z in enumerate((1.5, 0.75, 0, -1, -2.5)):
        for i in range(3):
            colour = (0.2 + 0.6 * rng.random(), 0.2 + 0.6 * rng.random(), 0.2 + 0.6 * rng.random())
            x = (i - 1) * (0.62 + 0.12 * row) + 0.15 * (row % 2)
            s.sphere(s.material(colour, roughness=rng.choice((0.15, 0.5, 1))), (x, 0.2, z), 0.2, 12)
    for i in range(6):  # lights far behind the focus become discs
        bulb = s.material((0, 0, 0), emission=(14, 11, 7))
        s.box(bulb, (-2.4 + 0.9 * i, 0.9 + 0.35 * (i % 2), -4), (0.05, 0.05, 0.05))
    return s


def thin_geometry():
    """Wires, a lattice and blades, all thinner than a pixel or nearly so, before a bright and a dark ground."""
    s = Scene()
    rng = random.Random(3)
    s.camera((0, 1.2, 4.2), (0, 0.85, 0), 40)
    lamp(s, (-1.5, 3.6, 2.0), 1.2, 1.2, (13, 12.5, 12))
    s.environment((0.15, 0.18, 0.22))
    floor(s, s.material((0.35, 0.3, 0.22)))
    s.quad(s.material((0.75, 0.72, 0.68)), (0, 0, -1.6), (4, 0, 0), (0, 4, 0))
    s.quad(s.material((0.08, 0.1, 0.14)), (-4, 0, -1.6), (4, 0, 0), (0, 4, 0))
    wire = s.material((0.85, 0.85, 0.88), metallic=1, roughness=0.3)
    for i in range(16):  # the fence
        s.tube(wire, (-1.5 + 0.2 * i, 0.5, -0.2), (-1.5 + 0.2 * i, 1.8, -0.2), 0.006)
    for i in range(7):
        s.tube(wire, (-1.5, 0.5 + 0.2 * i, -0.2), (1.5, 0.5 + 0.2 * i, -0.2), 0.006)
    cable = s.material((0.1, 0.1, 0.1), roughness=0.6)
    for i in range(4):  # slanted cables that thin out with distance
        s.tube(cable, (-1.9, 2.3 - 0.12 * i, 0.6), (1.9, 2.0 - 0.09 * i, -1.5), 0.008)
    positions, triangles = [], []
    for _ in range(220):  # grass
        x, z = rng.uniform(-1.8, 1.8), rng.uniform(-0.9, 1.2)
        height, turn = rng.uniform(0.25, 0.55), rng.uniform(0, math.pi)
        lean = (rng.uniform(-0.12, 0.12), rng.uniform(-0.12, 0.12))
        dx, dz = 0.012 * math.cos(turn), 0.012 * math.sin(turn)
        n = len(positions)
        positions += [(x - dx, 0, z - dz), (x + dx, 0, z + dz), (x + lean[0], height, z + lean[1])]
        triangles.append((n, n + 1, n + 2))
    s.mesh(s.material((0.25, 0.5, 0.12), double_sided=True), positions, triangles)
    positions, triangles = [], []
    for _ in range(90):  # leaves around a stem
        centre = (0.9 + rng.gauss(0, 0.28), 1.15 + rng.gauss(0, 0.28), 0.6 + rng.gauss(0, 0.2))
        u = scaled(unit((rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))), 0.06)
        v = scaled(unit(cross(u, (rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1)))), 0.025)
        n = len(positions)
        positions += [subtract(centre, u), add(centre, v), add(centre, u), subtract(centre, v)]
        triangles += [(n, n + 1, n + 2), (n, n + 2, n + 3)]
    s.mesh(s.material((0.6, 0.35, 0.1), roughness=0.5, double_sided=True), positions, triangles)
    s.tube(s.material((0.3, 0.2, 0.1)), (0.9, 0, 0.6), (0.9, 1.2, 0.6), 0.012, 5)
    return s


def next_door():
    """A dark room whose only light comes through a door from the next one."""
    s = Scene()
    plaster = s.material((0.75, 0.73, 0.68))
    s.camera((-1.3, 1.5, 2.7), (0.3, 0.9, -0.9), 58)
    wood = s.material((0.45, 0.3, 0.18), roughness=0.35)
    # Both rooms: x from -2 to 2, height 2.6; z from -1.5 to 3 (this one) and from -5 to -1.6 (the other).
    s.quad(wood, (-2, 0, 3), (4, 0, 0), (0, 0, -8))
    s.quad(plaster, (-2, 2.6, -5), (4, 0, 0), (0, 0, 8))
    s.quad(plaster, (-2, 0, 3), (0, 0, -8), (0, 2.6, 0))
    s.quad(s.material((0.4, 0.5, 0.6)), (2, 0, -5), (0, 0, 8), (0, 2.6, 0))
    s.quad(plaster, (2, 0, 3), (-4, 0, 0), (0, 2.6, 0))
    s.quad(s.material((0.8, 0.6, 0.4)), (-2, 0, -5), (4, 0, 0), (0, 2.6, 0))
    # The wall between them, with a doorway x from 0.3 to 1.1, 2 high.
    s.box(plaster, (-0.85, 1.3, -1.55), (2.3, 2.6, 0.1))
    s.box(plaster, (1.55, 1.3, -1.55), (0.9, 2.6, 0.1))
    s.box(plaster, (0.7, 2.3, -1.55), (0.8, 0.6, 0.1))
    s.box(s.material((0.7, 0.7, 0.65), roughness=0.4), (0.42, 1, -1.12), (0.04, 2, 0.76), 15)  # the door, ajar
    lamp(s, (-0.4, 2.55, -3.3), 1.6, 1.4, (60, 54, 44))
    s.box(s.material((0.6, 0.15, 0.12)), (-0.9, 0.35, -0.6), (0.9, 0.7, 0.6), -20)
    s.sphere(s.material((0.8, 0.8, 0.8), metallic=1, roughness=0.1), (-0.9, 0.95, -0.6), 0.25, 20)
    s.sphere(s.material((0.3, 0.55, 0.35)), (0.1, 0.25, 0.9), 0.25, 20)
    return s


def noise_free():
    """Emitters and black background, without any noise, beside a panel and a corner that have it."""
    s = Scene()
    s.camera((0, 1.2, 5), (0, 1.0, 0), 36)
    for i, radiance in enumerate(((0.05, 0.05, 0.05), (0.4, 0.1, 0.05), (0.1, 0.5, 0.9), (3, 2.5, 1))):
        # Emitters that reflect nothing: the picture there is a constant. They shine away from all that is noisy.
        shine = s.material((0, 0, 0), emission=radiance, specular=0)
        s.quad(shine, (-1.5 + 0.4 * i, 1.75, 0.6), (0.34, 0, 0), (0, 0.5, 0))
    s.quad(s.material((0, 0, 0), specular=0), (-1.5, 1.1, 0.3), (1.2, 0, 0), (0, 0.5, 0))  # black, before black
    # Smooth, under the point light and, at a grazing angle, the lamp: noisy because one light is chosen at random.
    s.quad(s.material((0.7, 0.7, 0.7), specular=0), (-1.5, 0.1, 0.0), (1.2, 0, 0), (0, 0.8, 0))
    s.point_light((-0.9, 0.3, 3.0), (7, 7, 7))
    # The noisy corner.
    s.quad(s.material((0.7, 0.65, 0.6)), (0.1, 0, 1.2), (1.6, 0, 0), (0, 0, -2))
    s.quad(s.material((0.3, 0.5, 0.7)), (0.1, 0, -0.8), (1.6, 0, 0), (0, 2, 0))
    s.quad(s.material((0.7, 0.3, 0.3)), (1.7, 0, -0.8), (0, 0, 2), (0, 2, 0))
    s.sphere(s.material((0.8, 0.8, 0.8), roughness=0.3), (0.9, 0.35, 0.2), 0.35, 20)
    lamp(s, (0.9, 1.95, 0.2), 0.5, 0.5, (12, 12, 12))
    return s


def environment():
    """Nothing but constant light from everywhere: occlusion and colour bleeding, no edge brighter than the sky."""
    s = Scene()
    s.camera((0, 1.6, 4.4), (0, 0.5, 0), 40)
    s.environment((0.62, 0.7, 0.8))
    floor(s, s.material((0.55, 0.52, 0.48)), 3)
    s.box(s.material((0.75, 0.2, 0.15)), (-0.9, 0.6, -0.5), (0.8, 1.2, 0.8), 20)
    s.box(s.material((0.2, 0.45, 0.75)), (0.0, 0.25, -0.6), (0.5, 0.5, 0.5), -10)
    s.sphere(s.material((0.9, 0.9, 0.9)), (0.7, 0.5, 0.2), 0.5)
    s.sphere(s.material((0.9, 0.7, 0.3), metallic=1, roughness=0.2), (-0.3, 0.3, 0.8), 0.3, 20)
    s.quad(s.material((0.6, 0.6, 0.3), double_sided=True), (1.3, 0, -0.9), (0.6, 0, 0.6), (0, 1.3, 0))
    return s


SCENES = (hard_shadow, soft_shadow, caustics, fine_texture, mirrors, depth_of_field, thin_geometry, next_door,
          noise_free, environment)


def main(arguments):
    names = [f.__name__ for f in SCENES]
    if arguments == ["--list"]:
        print("\n".join(names))
        return 0
    if not arguments or arguments[0].startswith("-") or not set(arguments[1:]) <= set(names):
        print(__doc__.strip() + "\n\nNames: " + " ".join(names), file=sys.stderr)
        return 2
    folder, chosen = arguments[0], arguments[1:] or names
    os.makedirs(folder, exist_ok=True)
    for make in SCENES:
        if make.__name__ not in chosen:
            continue
        scene = make()
        path = os.path.join(folder, make.__name__ + ".glb")
        with open(path + ".part", "wb") as file:
            file.write(scene.glb())
        os.replace(path + ".part", path)
        print(f"{path}: {scene.triangles} triangles")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
