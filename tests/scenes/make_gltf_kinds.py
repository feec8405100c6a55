#!/usr/bin/env python3
"""Writes small glTF files, one of each kind that real files are of, and what a picture of each must show.

Usage: make_gltf_kinds.py FOLDER [--sheet PNG --programs FOLDER]

kinds.json says for every file, for 32 x 32 pixels, what is in which rectangle: tests/render/gltf_kinds_test.cpp
traces them all and compares. --sheet: traces them by vlx-trace and puts them on one sheet (oiiotool).

The camera looks along -z at the square of -2 to 2 in x and y; 8 pixels are 1 long at z = 0. What shows a pure colour
is unlit; what is lit has white light (1, 1, 1) from all around, so that what it reflects is known.
"""

import argparse
import base64
import json
import math
import os
import struct
import subprocess
import tempfile
import zlib

SIDE = 32
RED, GREEN, BLUE, WHITE, BLACK = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (0, 0, 0)
EXACT = 1e-5
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
CODE = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}


def png(rows):
    """A PNG file of rows of (r, g, b[, a]) bytes."""
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    channels = len(rows[0][0])
    raw = b"".join(b"\0" + bytes(v for pixel in row for v in pixel) for row in rows)
    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


CARD = png([[(255, 0, 0), (0, 0, 255)]])  # red on the left, blue on the right


class File:
    def __init__(self, light=False):
        self.json = {"asset": {"version": "2.0", "generator": "make_gltf_kinds.py"}, "scene": 0, "scenes": [{"nodes": []}],
                     "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "cameras": []}
        self.bytes = bytearray()
        self.pictures = []
        self.beside = {}  # further files
        self.buffer_uri = None
        if light:
            self.json["scenes"][0]["extras"] = {"env_constant": [1, 1, 1]}
        self.camera()
        self.picture()
        if light:
            self.shows(-2, -2, 2, 2, WHITE)

    # What is seen

    def picture(self, **how):
        """A further picture, with `shutter`, `variant` or `environment`; at first black everywhere."""
        self.pictures.append({**how, "regions": []})
        self.shows(-2, -2, 2, 2, BLACK)

    def shows(self, x0, y0, x1, y1, rgb, tolerance=EXACT, mean=False):
        """In a rectangle each pixel, or the mean; rgb None: whatever. Later ones lie on top."""
        def pixel(v):
            return round((v + 2) * SIDE / 4, 6)
        box = [pixel(x0), SIDE - pixel(y1), pixel(x1), SIDE - pixel(y0)]
        assert all(v == int(v) for v in box), box
        self.pictures[-1]["regions"].append({"box": [int(v) for v in box], "rgb": rgb, "tolerance": tolerance,
                                             "mean": mean})

    # What is there

    def use(self, extension, required=False):
        for key in ["extensionsUsed"] + ["extensionsRequired"] * required:
            names = self.json.setdefault(key, [])
            if extension not in names:
                names.append(extension)

    def add(self, array, item):
        self.json.setdefault(array, []).append(item)
        return len(self.json[array]) - 1

    def view(self, data, **more):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.bytes += data
        return self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.bytes) - len(data), "byteLength": len(data),
                                        **more})

    def accessor(self, values, kind, component="f", **more):
        flat = [v for row in values for v in row] if kind != "SCALAR" else list(values)
        width = WIDTH[kind]
        stride = -(-width * struct.calcsize(component) // 4) * 4 if kind != "SCALAR" else None
        if stride:
            rows = [struct.pack(f"<{width}{component}", *flat[i:i + width]) for i in range(0, len(flat), width)]
            padded = stride > len(rows[0])
            view = self.view(b"".join(row.ljust(stride, b"\0") for row in rows), **({"byteStride": stride} if padded else {}))
        else:
            view = self.view(struct.pack(f"<{len(flat)}{component}", *flat))
        bounds = {}
        if kind == "VEC3" and component == "f" or kind == "SCALAR" and component == "f":
            columns = [flat[i::width] for i in range(width)]
            bounds = {"min": [min(c) for c in columns], "max": [max(c) for c in columns]}
        return self.add("accessors", {"bufferView": view, "componentType": CODE[component], "count": len(flat) // width,
                                      "type": kind, **bounds, **more})

    def node(self, root=True, **what):
        index = self.add("nodes", what)
        if root:
            self.json["scenes"][0]["nodes"].append(index)
        return index

    def camera(self):
        kind = {"type": "perspective", "perspective": {"yfov": 2 * math.atan(0.5), "znear": 0.1, "aspectRatio": 1}}
        return self.node(name="eye", camera=self.add("cameras", kind), translation=[0, 0, 4])

    def material(self, **what):
        for extension in what.get("extensions", {}):
            self.use(extension)
        return self.add("materials", what)

    def unlit(self, rgb=WHITE, alpha=1, texture=None, **what):
        pbr = {"baseColorFactor": [*rgb, alpha]}
        if texture:
            pbr["baseColorTexture"] = texture
        return self.material(pbrMetallicRoughness=pbr, extensions={"KHR_materials_unlit": {}}, **what)

    def surface(self, rgb=BLACK, roughness=1, **extensions):
        """A dielectric of this colour."""
        extensions = {"KHR_materials_" + name: value for name, value in extensions.items()}
        return self.material(pbrMetallicRoughness={"baseColorFactor": [*rgb, 1], "metallicFactor": 0,
                                                   "roughnessFactor": roughness}, extensions=extensions)

    def texture(self, image=CARD, mime="image/png", **more):
        """Its number; the nearest texel is shown."""
        sampler = self.add("samplers", {"magFilter": 9728, "minFilter": 9728})
        source = self.add("images", {"bufferView": self.view(image), "mimeType": mime})
        return self.add("textures", {"source": source, "sampler": sampler, **more})

    def primitive(self, material, positions, attributes=None, indices=(0, 1, 2, 0, 2, 3), **more):
        p = {"attributes": {"POSITION": self.accessor(positions, "VEC3"), **(attributes or {})}, **more}
        if material is not None:
            p["material"] = material
        if indices:
            p["indices"] = self.accessor(indices, "SCALAR", "H")
        return p

    def mesh(self, *primitives, **more):
        return self.add("meshes", {"primitives": list(primitives), **more})

    def quad(self, material, x0, y0, x1, y1, z=0.0, attributes=None, **node):
        """A rectangle that faces the camera: its node."""
        return self.node(mesh=self.mesh(self.primitive(material, corners(x0, y0, x1, y1, z), attributes)), **node)

    def animate(self, node, path, times, values, kind, interpolation="LINEAR"):
        sampler = {"input": self.accessor(times, "SCALAR"), "output": self.accessor(values, kind),
                   "interpolation": interpolation}
        self.add("animations", {"samplers": [sampler], "channels": [{"sampler": 0, "target": {"node": node, "path": path}}]})

    def uvs(self, flipped=False):
        """Coordinates of a rectangle's corners: u to the right, v down; or u to the left."""
        return self.accessor([(u if not flipped else 1 - u, v) for u, v in ((0, 1), (1, 1), (1, 0), (0, 0))], "VEC2")

    def write(self, folder, name):
        made = {key: value for key, value in self.json.items() if value != []}
        made.setdefault("buffers", [{}])
        made["buffers"][0] = {"byteLength": len(self.bytes)}
        if self.buffer_uri:
            made["buffers"][0]["uri"] = self.buffer_uri
            self.beside[self.buffer_uri.replace("%20", " ")] = bytes(self.bytes)
        else:
            made["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self.bytes).decode()
        for other, data in self.beside.items():
            with open(os.path.join(folder, other), "wb") as out:
                out.write(data)
        with open(os.path.join(folder, name + ".gltf"), "w", encoding="utf-8") as out:
            json.dump(made, out, indent=1)


def corners(x0, y0, x1, y1, z=0.0):
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def moved(x, y=0, z=0):
    """A matrix, column by column."""
    return (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1)


# Geometry that bends

def skinned(f, weights, joints, sets=1):
    """Rectangles of 0.5 x 0.5 at x = -1.75, one above the other, as many as there are rows of `weights`. Joint i is
    at (0.5 i, 0, 0) where it was bound at (0, i, 0)."""
    positions, indices = [], []
    attributes = {}
    for i in range(len(weights)):
        indices += [4 * i + k for k in (0, 1, 2, 0, 2, 3)]
        positions += corners(-1.75, -1.75 + i * 0.75, -1.25, -1.25 + i * 0.75)
    each = [row for row in weights for _ in range(4)]
    for s in range(sets):
        attributes[f"JOINTS_{s}"] = f.accessor([list(range(4 * s, 4 * s + 4)) if 4 * s + 3 < joints else [0, 1, 0, 0]
                                                for _ in each], "VEC4", "B")
        attributes[f"WEIGHTS_{s}"] = f.accessor([row[4 * s:4 * s + 4] for row in each], "VEC4")
    nodes = [f.node(root=False, translation=[0.5 * i, 0, 0]) for i in range(joints)]
    f.node(name="skeleton", children=nodes)
    skin = f.add("skins", {"joints": nodes, "inverseBindMatrices": f.accessor([moved(0, 0)] * joints, "MAT4")})
    mesh = f.mesh(f.primitive(f.unlit(GREEN), positions, attributes, indices))
    f.node(mesh=mesh, skin=skin, translation=[7, 7, 7])  # which is of no account
    return nodes


def shows_skinned(f, shifts):
    for i, x in enumerate(shifts):
        f.shows(-1.75 + x, -1.75 + i * 0.75, -1.25 + x, -1.25 + i * 0.75, GREEN)


def skin():
    """Of two joints: one rectangle of each, and one of both."""
    f = File()
    skinned(f, [(1, 0, 0, 0), (0, 1, 0, 0), (0.5, 0.5, 0, 0)], 2)
    shows_skinned(f, (0, 0.5, 0.25))
    return f


def skin_animated():
    """The second joint goes from x = 0 to 4 in a second."""
    f = File()
    joints = skinned(f, [(1, 0, 0, 0), (0, 1, 0, 0), (0.5, 0.5, 0, 0)], 2)
    f.animate(joints[1], "translation", [0, 1], [(0, 0, 0), (4, 0, 0)], "VEC3")
    f.pictures[0]["shutter"] = [0, 0]
    shows_skinned(f, (0, 0, 0))
    f.picture(shutter=[0.5, 0.5])
    shows_skinned(f, (0, 2, 1))
    f.picture(shutter=[0.25, 0.75])  # from 1 to 3, and half of that: where it is all the time, and never
    shows_skinned(f, (0,))
    f.shows(-2, -1, 2, -0.5, None)
    f.shows(-2, -0.25, 2, 0.25, None)
    f.shows(0.25, -1, 0.75, -0.5, [0, 0.25, 0], 0.1, mean=True)  # 0.5 wide, over a way of 2
    return f


def skin_eight():
    """Five influences a vertex, in two sets."""
    f = File()
    skinned(f, [(0.2, 0.2, 0.2, 0.2, 0.2, 0, 0, 0), (0, 0, 0, 0, 0, 0, 1, 0)], 8, sets=2)
    shows_skinned(f, (0.5 * 2, 0.5 * 6))
    return f


def morph_targets(f, **mesh):
    """A rectangle whose right side a first target moves by 1, and whose top a second, sparse one by 1."""
    first = f.accessor([(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 0)], "VEC3")
    second = f.add("accessors", {
        "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [0, 1, 0],
        "sparse": {"count": 2, "indices": {"bufferView": f.view(struct.pack("<2H", 2, 3)), "componentType": 5123},
                   "values": {"bufferView": f.view(struct.pack("<6f", 0, 1, 0, 0, 1, 0))}}})
    return f.mesh(f.primitive(f.unlit(RED), corners(-1, -1, 0, 0), targets=[{"POSITION": first}, {"POSITION": second}]),
                  **mesh)


def morph():
    """By weights of the mesh."""
    f = File()
    f.node(mesh=morph_targets(f, weights=[1, 0.5]))
    f.shows(-1, -1, 1, 0.5, RED)
    return f


def morph_node():
    """By weights of its own the node overrides the mesh's."""
    f = File()
    f.node(mesh=morph_targets(f, weights=[1, 0.5]), weights=[0.25, 0])
    f.shows(-1, -1, 0.25, 0, RED)
    return f


def morph_animated():
    """By an animation, along a cubic spline: of the first from rest to 1, of the second not at all."""
    f = File()
    node = f.node(mesh=morph_targets(f))
    keys = [(0, 0), (0, 1), (0, 0), (0, 0), (2, 1), (0, 0)]  # in-tangent, value, out-tangent of two keys
    f.animate(node, "weights", [0, 1], [v for key in keys for v in key], "SCALAR", "CUBICSPLINE")
    f.pictures[0]["shutter"] = [0, 0]
    f.shows(-1, -1, 0, 1, RED)
    f.picture(shutter=[0.5, 0.5])  # half way
    f.shows(-1, -1, 1, 1, RED)
    return f


def morph_skin():
    """First morphed, then skinned: the joint turns it by a quarter."""
    f = File()
    s = math.sqrt(0.5)
    joint = f.node(rotation=[0, 0, s, s])
    mesh = morph_targets(f, weights=[1, 0])
    f.json["meshes"][mesh]["primitives"][0]["attributes"].update(
        JOINTS_0=f.accessor([(0, 0, 0, 0)] * 4, "VEC4", "H"),
        WEIGHTS_0=f.accessor([(255, 0, 0, 0)] * 4, "VEC4", "B", normalized=True))
    f.node(mesh=mesh, skin=f.add("skins", {"joints": [joint]}))
    f.shows(0, -1, 1, 1, RED)  # -1 to 1 in x, -1 to 0 in y, turned
    return f


def instancing():
    """A node's mesh in three places: moved, turned (in bytes) and scaled."""
    f = File()
    node = f.quad(f.unlit(BLUE), 0, 0, 1, 0.5, translation=[-1, 0, 0])
    attributes = {"TRANSLATION": f.accessor([(0, 0, 0), (2, 0, 0), (0, -1, 0)], "VEC3"),
                  "ROTATION": f.accessor([(0, 0, 0, 127), (0, 0, 127, 0), (0, 0, 0, 127)], "VEC4", "b", normalized=True),
                  "SCALE": f.accessor([(1, 1, 1), (1, 1, 1), (0.5, 1, 1)], "VEC3")}
    f.use("EXT_mesh_gpu_instancing", required=True)
    f.json["nodes"][node]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    f.shows(-1, 0, 0, 0.5, BLUE)
    f.shows(0, -0.5, 1, 0, BLUE)  # half a turn about (1, 0)
    f.shows(-1, -1, -0.5, -0.5, BLUE)
    return f


def animation():
    """A node moved, turned and scaled."""
    f = File()
    node = f.quad(f.unlit(GREEN), -0.5, -0.25, 0.5, 0.25)
    s = math.sqrt(0.5)
    f.animate(node, "translation", [0, 1], [(0, 0, 0), (2, 0, 0)], "VEC3")
    f.animate(node, "rotation", [0, 0.5], [(0, 0, 0, 1), (0, 0, s, s)], "VEC4")
    f.animate(node, "scale", [0, 0.25], [(1, 1, 1), (2, 1, 1)], "VEC3", "STEP")
    f.pictures[0]["shutter"] = [0, 0]
    f.shows(-0.5, -0.25, 0.5, 0.25, GREEN)
    f.picture(shutter=[0.5, 0.5])
    f.shows(0.75, -1, 1.25, 1, GREEN)
    return f


def spline():
    """A node along a cubic spline that leaves at speed 4 and arrives at rest."""
    f = File()
    node = f.quad(f.unlit(GREEN), -0.5, -0.5, 0.5, 0.5)
    keys = [(0, 0, 0), (0, 0, 0), (4, 0, 0), (0, 0, 0), (1, 0, 0), (0, 0, 0)]
    f.animate(node, "translation", [0, 1], keys, "VEC3", "CUBICSPLINE")
    f.pictures[0]["shutter"] = [0.5, 0.5]
    f.shows(0.5, -0.5, 1.5, 0.5, GREEN)  # at 1/2 + 4/8
    return f


def mirrored():
    """A negative scale turns no front into a back, and swaps left and right."""
    f = File()
    texture = {"index": f.texture()}
    f.quad(f.unlit(texture=texture), -1, -1, 1, 0, attributes={"TEXCOORD_0": f.uvs()}, scale=[-1, 1, 1])
    f.shows(-1, -1, 0, 0, BLUE)
    f.shows(0, -1, 1, 0, RED)
    # From behind: only what is double-sided.
    f.quad(f.unlit(GREEN), -1, 0.5, 0, 1, rotation=[0, 1, 0, 0])
    f.quad(f.unlit(GREEN, doubleSided=True), -1, 1, 0, 1.5, rotation=[0, 1, 0, 0])
    f.shows(0, 1, 1, 1.5, GREEN)
    return f


# How geometry is written

def strip():
    f = File()
    positions = [(-1, 1, 0), (-1, -1, 0), (0, 1, 0), (0, -1, 0), (1, 0, 0), (1, -1, 0)]
    f.node(mesh=f.mesh(f.primitive(f.unlit(RED), positions, indices=None, mode=5)))
    f.shows(-1, -1, 0, 1, RED)
    f.shows(0, -1, 1, 0, RED)
    f.shows(0, 0, 1, 1, None)  # the half of it
    return f


def fan():
    f = File()
    f.node(mesh=f.mesh(f.primitive(f.unlit(RED), [(-1, -1, 0), (1, -1, 0), (1, 0, 0), (1, 1, 0), (-1, 1, 0)],
                                   indices=(0, 1, 2, 3, 4), mode=6)))
    f.shows(-1, -1, 1, 1, RED)
    return f


def points_and_lines():
    """Left out, beside triangles."""
    f = File()
    material = f.unlit(RED)
    f.node(mesh=f.mesh(*[f.primitive(material, corners(-1, -1, 1, 1), indices=None, mode=mode) for mode in range(4)],
                       f.primitive(material, corners(0, 0, 1, 1))))
    f.shows(0, 0, 1, 1, RED)
    return f


def sparse():
    """An accessor without data of its own, zeros, of which one corner is put elsewhere: a triangle."""
    f = File()
    positions = f.add("accessors", {
        "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0],
        "sparse": {"count": 3, "indices": {"bufferView": f.view(bytes([1, 2, 3])), "componentType": 5121},
                   "values": {"bufferView": f.view(struct.pack("<9f", 1, 0, 0, 1, 1, 0, 0, 1, 0))}}})
    f.node(mesh=f.mesh({"attributes": {"POSITION": positions}, "material": f.unlit(RED),
                        "indices": f.accessor((0, 1, 2, 0, 2, 3), "SCALAR", "B")}))
    f.shows(0, 0, 1, 1, RED)
    return f


def quantization():
    """Positions in 16-bit, coordinates in 8-bit whole numbers."""
    f = File()
    f.use("KHR_mesh_quantization", required=True)
    positions = f.accessor([(-32767, -32767, 0), (32767, -32767, 0), (32767, 32767, 0), (-32767, 32767, 0)], "VEC3", "h",
                           normalized=True)
    uvs = f.accessor([(0, 255), (255, 255), (255, 0), (0, 0)], "VEC2", "B", normalized=True)
    f.node(mesh=f.mesh({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices":
                        f.accessor((0, 1, 2, 0, 2, 3), "SCALAR", "I"), "material": f.unlit(texture={"index": f.texture()})}),
           scale=[1, 0.5, 1])
    f.shows(-1, -0.5, 0, 0.5, RED)
    f.shows(0, -0.5, 1, 0.5, BLUE)
    return f


def interleaved():
    """Positions, coordinates and colours in one bufferView."""
    f = File()
    rows = [struct.pack("<5f4B", *p, u, v, *colour) for p, u, v, colour in
            zip(corners(-1, -1, 1, 1), (0, 1, 1, 0), (1, 1, 0, 0), [(255, 255, 255, 255)] * 4)]
    view = f.view(b"".join(rows), byteStride=24)

    def part(offset, kind, component, **more):
        return f.add("accessors", {"bufferView": view, "byteOffset": offset, "componentType": CODE[component],
                                   "count": 4, "type": kind, **more})
    attributes = {"POSITION": part(0, "VEC3", "f", min=[-1, -1, 0], max=[1, 1, 0]), "TEXCOORD_0": part(12, "VEC2", "f"),
                  "COLOR_0": part(20, "VEC4", "B", normalized=True)}
    f.node(mesh=f.mesh({"attributes": attributes, "material": f.unlit(texture={"index": f.texture()}),
                        "indices": f.accessor((0, 1, 2, 0, 2, 3), "SCALAR", "H")}))
    f.shows(-1, -1, 0, 1, RED)
    f.shows(0, -1, 1, 1, BLUE)
    return f


def files():
    """A buffer and an image in files whose names have a space."""
    f = File()
    f.buffer_uri = "two%20words.bin"
    f.beside["a card.png"] = CARD
    sampler = f.add("samplers", {"magFilter": 9728})
    texture = f.add("textures", {"source": f.add("images", {"uri": "a%20card.png"}), "sampler": sampler})
    f.quad(f.unlit(texture={"index": texture}), -1, -1, 1, 1, attributes={"TEXCOORD_0": f.uvs()})
    f.shows(-1, -1, 0, 1, RED)
    f.shows(0, -1, 1, 1, BLUE)
    return f


def scenes():
    """The second scene is the one to show."""
    f = File()
    f.quad(f.unlit(RED), -1, -1, 1, 1)
    f.json["scenes"].append({"nodes": [0, f.add("nodes", {"mesh": f.mesh(f.primitive(f.unlit(GREEN), corners(0, 0, 1, 1)))})]})
    f.json["scene"] = 1
    f.shows(0, 0, 1, 1, GREEN)
    return f


# Made by draco_encoder 1.5.5 (-qp 11 -qt 10) and by meshoptimizer 0.18: the square of -1 to 1, v downwards in the image.
DRACO = ("RFJBQ08CAgEBAAAABAICAgAAAR//ARH/ARH/ARED/wAAAAAAAQAAAQAJAwAAAgEDCQIAAQIBAQkDAAIDAQEBAAMDATABEAMAKIKYAAAAAAD/BwAA"
         "AACAvwAAgL8AAAAAAAAAQAsFAQEAAwMBMAEQAwAkgiYAAgAAAAEBIAAAAAD/AwAAAAAAAAAAAAAAAIA/CgYDAQEBAQFAAQD/AAAAfwAAAP8CREAI")
MESHOPT = ("oAAAAAEzAAAA//8AAAABDAAAAP8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAIC/AACAvwAAAAA=", "4PAAAHaHVmd4qYZliWiYAWkAAA==")


def draco():
    f = File()
    f.use("KHR_draco_mesh_compression", required=True)

    def announced(kind, component, count, **more):
        return f.add("accessors", {"componentType": CODE[component], "count": count, "type": kind, **more})
    attributes = {"POSITION": announced("VEC3", "f", 4, min=[-1, -1, 0], max=[1, 1, 0]),
                  "TEXCOORD_0": announced("VEC2", "f", 4)}
    compressed = {"bufferView": f.view(base64.b64decode(DRACO)), "attributes": {"POSITION": 0, "TEXCOORD_0": 1}}
    f.node(mesh=f.mesh({"attributes": attributes, "indices": announced("SCALAR", "H", 6),
                        "material": f.unlit(texture={"index": f.texture()}),
                        "extensions": {"KHR_draco_mesh_compression": compressed}}))
    f.shows(-1, -1, 0, 1, RED)
    f.shows(0, -1, 1, 1, BLUE)
    return f


def meshopt():
    f = File()
    f.use("EXT_meshopt_compression", required=True)
    f.json["buffers"] = [{}, {"byteLength": 60, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}]

    def compressed(data, offset, count, stride, mode):
        packed = f.json["bufferViews"].pop(f.view(base64.b64decode(data)))
        return f.add("bufferViews", {"buffer": 1, "byteOffset": offset, "byteLength": count * stride, "extensions": {
            "EXT_meshopt_compression": {**packed, "byteStride": stride, "count": count, "mode": mode}}})
    positions = f.add("accessors", {"bufferView": compressed(MESHOPT[0], 0, 4, 12, "ATTRIBUTES"), "componentType": 5126,
                                    "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]})
    indices = f.add("accessors", {"bufferView": compressed(MESHOPT[1], 48, 6, 2, "TRIANGLES"), "componentType": 5123,
                                  "count": 6, "type": "SCALAR"})
    f.node(mesh=f.mesh({"attributes": {"POSITION": positions}, "indices": indices, "material": f.unlit(BLUE)}))
    f.shows(-1, -1, 1, 1, BLUE)
    return f


# Textures and colours

def unlit():
    """Its colour, whatever the light, and its image in a mirror."""
    f = File(light=True)
    f.quad(f.unlit((0.25, 0.5, 0.75)), -1, -1, 0, 1)
    f.shows(-1, -1, 0, 1, (0.25, 0.5, 0.75))
    mirror = f.material(pbrMetallicRoughness={"metallicFactor": 1, "roughnessFactor": 0})
    f.quad(mirror, 0, -1, 1, 1)
    behind = f.unlit((0.5, 0.125, 0))  # a wall behind the camera
    f.quad(behind, -9, -9, 9, 9, z=-5, rotation=[0, 1, 0, 0])
    f.shows(0, -1, 1, 1, (0.5, 0.125, 0))
    return f


def vertex_colours():
    """In bytes, without alpha; and a gradient."""
    f = File()
    flat = f.accessor([(255, 0, 0), (255, 0, 0), (255, 0, 0), (255, 0, 0)], "VEC3", "B", normalized=True)
    f.quad(f.unlit((0.5, 1, 1)), -1, 0, 1, 1, attributes={"COLOR_0": flat})
    f.shows(-1, 0, 1, 1, (0.5, 0, 0))
    ramp = f.accessor([(0, 0, 0, 1), (0, 1, 0, 1), (0, 1, 0, 1), (0, 0, 0, 1)], "VEC4")
    f.quad(f.unlit(), -1, -1, 1, 0, attributes={"COLOR_0": ramp})
    for i in range(16):  # to within the half of a pixel that a sample may be off its middle
        f.shows(-1 + i / 8, -1, -1 + (i + 1) / 8, 0, (0, (i + 0.5) / 16, 0), 1 / 32 + EXACT)
    return f


def coordinates(number):
    """Textures by TEXCOORD_`number`, whose u runs the other way than that of TEXCOORD_0."""
    f = File()
    attributes = {"TEXCOORD_0": f.uvs(), **{f"TEXCOORD_{i}": f.uvs(flipped=i == number) for i in range(1, number + 1)}}
    f.quad(f.unlit(texture={"index": f.texture(), "texCoord": number}), -1, -1, 1, 1, attributes=attributes)
    f.shows(-1, -1, 0, 1, BLUE)
    f.shows(0, -1, 1, 1, RED)
    return f


def second_coordinates():
    return coordinates(1)


def third_coordinates():
    return coordinates(2)


def texture_transform():
    """A quarter turn, half of the width, and a shift."""
    f = File()
    f.use("KHR_texture_transform")
    texture = {"index": f.texture(), "extensions": {"KHR_texture_transform": {
        "rotation": math.pi / 2, "scale": [1, 1], "offset": [0, 1]}}}  # u' = v, v' = 1 - u
    f.quad(f.unlit(texture=texture), -1, -1, 1, 1, attributes={"TEXCOORD_0": f.uvs()})
    f.shows(-1, 0, 1, 1, RED)  # v below 1/2: above
    f.shows(-1, -1, 1, 0, BLUE)
    return f


def webp():
    """White on the left, black on the right; a PNG beside it is not looked at."""
    f = File()
    f.use("EXT_texture_webp")
    image = f.view(base64.b64decode("UklGRiwAAABXRUJQVlA4ICAAAABQAQCdASogABAAAAAAJaQAA9lAAP7/3t2Q//vrh4AAAA=="))
    source = f.add("images", {"bufferView": image, "mimeType": "image/webp"})
    texture = f.texture(extensions={"EXT_texture_webp": {"source": source}})
    f.quad(f.unlit((0, 1, 0), texture={"index": texture}), -1, -1, 1, 1, attributes={"TEXCOORD_0": f.uvs()})
    f.shows(-1, -1, 0, 1, GREEN, 0.01)
    return f


def variants():
    """Red; green in the variant `grass`, blue in `water`."""
    f = File()
    f.use("KHR_materials_variants")
    f.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "grass"}, {"name": "water"}]}}
    red, green, blue = f.unlit(RED), f.unlit(GREEN), f.unlit(BLUE)
    node = f.quad(red, -1, -1, 1, 1)
    f.json["meshes"][f.json["nodes"][node]["mesh"]]["primitives"][0]["extensions"] = {"KHR_materials_variants": {
        "mappings": [{"material": green, "variants": [0]}, {"material": blue, "variants": [1]}]}}
    f.shows(-1, -1, 1, 1, RED)
    for variant, colour in (("water", BLUE), ("0", GREEN)):
        f.picture(variant=variant)
        f.shows(-1, -1, 1, 1, colour)
    return f


def alpha_mask():
    """Cut out by the alpha of a texture, below 1/2."""
    f = File()
    image = png([[(255, 0, 0, 255), (255, 0, 0, 127), (255, 0, 0, 129), (255, 0, 0, 0)]])
    f.quad(f.unlit(texture={"index": f.texture(image)}, alphaMode="MASK"), -1, -1, 1, 1,
           attributes={"TEXCOORD_0": f.uvs()})
    f.shows(-1, -1, -0.5, 1, RED)
    f.shows(0, -1, 0.5, 1, RED)
    return f


def alpha_blend():
    """A quarter of red before green."""
    f = File()
    f.quad(f.unlit(GREEN), -1, -1, 1, 1, z=-0.5)
    f.quad(f.unlit(RED, alpha=0.25, alphaMode="BLEND"), -1, -1, 1, 1)
    f.shows(-1, -1, 1, 1, None)  # the one behind is smaller in the picture
    f.shows(-0.75, -0.75, 0.75, 0.75, (0.25, 0.75, 0), 0.03, mean=True)
    return f


# Surfaces under white light

MIDDLE = (-0.25, -0.25, 0.25, 0.25)  # seen straight on
DULL = {"specularFactor": 0}
F = 0.04  # what a smooth surface of index 1.5 reflects of light that falls on it straight


def in_the_middle(f, material, rgb, tolerance, mean=False):
    f.quad(material, -1, -1, 1, 1)
    f.shows(-1, -1, 1, 1, None)
    f.shows(*MIDDLE, rgb, tolerance, mean)
    return f


def clearcoat():
    f = File(light=True)
    return in_the_middle(f, f.surface(specular=DULL, clearcoat={"clearcoatFactor": 0.5}), (F / 2,) * 3, 2e-4)


def ior():
    f = File(light=True)
    return in_the_middle(f, f.surface(roughness=0, ior={"ior": 2}), ((1 / 3) ** 2,) * 3, 1e-3)


def specular():
    f = File(light=True)
    some = {"specularFactor": 0.5, "specularColorFactor": [1, 2, 0]}
    return in_the_middle(f, f.surface(roughness=0, specular=some), (F / 2, F, 0), 1e-3)


def glossiness():
    """An archived extension: a coloured reflection, smooth; and a rough one, by a texture, of a colour that is black."""
    f = File(light=True)
    gold = {"diffuseFactor": [0, 0, 0, 1], "specularFactor": [0.5, 0.25, 0]}
    in_the_middle(f, f.surface(pbrSpecularGlossiness=gold), (0.5, 0.25, 0), 1e-3)
    texture = {"index": f.texture(png([[(255, 255, 255, 0)]]))}
    dark = {"diffuseFactor": [0.5, 0, 0, 1], "specularFactor": [0, 0, 0], "specularGlossinessTexture": texture}
    f.quad(f.surface(pbrSpecularGlossiness=dark), -1, 1, 1, 2, attributes={"TEXCOORD_0": f.uvs()})
    f.shows(-1, 1, 1, 2, None)
    f.shows(-0.25, 1.25, 0.25, 1.75, (0.5, 0, 0), 0.06, mean=True)
    return f


def sheen():
    """Charlie's distribution with Neubelt's visibility, all that it reflects of light from all around."""
    f = File(light=True)
    alpha, steps, albedo = 0.5 ** 2, 2000, 0
    for i in range(steps):
        z = (i + 0.5) / steps
        half = math.sqrt((1 + z) / 2)  # cosine of half the angle: the viewer looks straight on
        d = (2 + 1 / alpha) * (1 - half * half) ** (0.5 / alpha) / (2 * math.pi)
        albedo += d / (4 * (1 + z - z)) * z * 2 * math.pi / steps
    material = f.surface(specular=DULL, sheen={"sheenColorFactor": [1, 0.5, 0], "sheenRoughnessFactor": 0.5})
    return in_the_middle(f, material, (albedo, albedo / 2, 0), 0.15 * albedo, mean=True)


def slab(material, rgb):
    """A slab of glass, 1 thick, before something white and unlit."""
    f = File()
    glass = f.surface(WHITE, roughness=0, **material)
    f.quad(glass, -1, -1, 1, 1, z=0.5)
    f.quad(glass, -1, -1, 1, 1, z=0.5, rotation=[0, 1, 0, 0])
    f.quad(f.unlit(), -9, -9, 9, 9, z=-3)
    f.shows(-2, -2, 2, 2, WHITE)
    f.shows(-1.25, -1.25, 1.25, 1.25, None)
    f.shows(-0.5, -0.5, 0.5, 0.5, rgb, 0.03, mean=True)
    return f


def transmission():
    """What is left after any number of reflections inside: (1 - F)^2 (1 + F^2 + F^4 + ...)."""
    return slab({"transmission": {"transmissionFactor": 1}}, ((1 - F) / (1 + F),) * 3)


def volume():
    """The same, a half, a quarter and all of the light being left each time it crosses the slab."""
    left = [(1 - F) ** 2 * a / (1 - (F * a) ** 2) for a in (0.5, 0.25, 1)]
    return slab({"transmission": {"transmissionFactor": 1}, "volume": {
        "thicknessFactor": 1, "attenuationDistance": 1, "attenuationColor": [0.5, 0.25, 1]}}, left)


def emissive_strength():
    f = File()
    f.quad(f.material(emissiveFactor=[0.5, 0.25, 0], pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1]},
                      extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 8}}), -1, -1, 1, 1)
    f.shows(-1, -1, 1, 1, (4, 2, 0))
    return f


def orthographic():
    f = File()
    node = f.json["nodes"][f.json["scenes"][0]["nodes"][0]]
    f.quad(f.unlit(GREEN), -1, -1, 1, 1)
    f.shows(-1, -1, 1, 1, GREEN)
    f.json["cameras"][node["camera"]] = {"type": "orthographic", "orthographic": {
        "xmag": 2, "ymag": 2, "znear": 0.1, "zfar": 10}}
    return f


def no_camera():
    """Of the camera that is made: the quad is in the middle, aslant, and the corners are empty."""
    f = File()
    f.quad(f.unlit(GREEN), -1, -1, 1, 1)
    f.json["nodes"][0].pop("camera")
    f.json["cameras"] = []
    f.shows(-2, -2, 2, 2, None)
    f.shows(-0.5, -0.5, 0.5, 0.5, GREEN)
    for x in (-2, 1.75):
        for y in (-2, 1.75):
            f.shows(x, y, x + 0.25, y + 0.25, BLACK)
    return f


def no_light():
    """Lit by what an option says is all around."""
    f = File()
    f.quad(f.surface((0.5, 0.5, 0.5), specular=DULL), -1, -1, 1, 1)
    f.pictures[0]["environment"] = [1, 1, 1]
    f.shows(-2, -2, 2, 2, WHITE)
    f.shows(-1, -1, 1, 1, (0.5, 0.5, 0.5), 0.03, mean=True)
    return f


KINDS = (skin, skin_animated, skin_eight, morph, morph_node, morph_animated, morph_skin, instancing, animation, spline,
         mirrored, strip, fan, points_and_lines, sparse, quantization, interleaved, files, scenes, draco, meshopt, unlit,
         vertex_colours, second_coordinates, third_coordinates, texture_transform, webp, variants, alpha_mask,
         alpha_blend, clearcoat, ior, specular, glossiness, sheen, transmission, volume, emissive_strength,
         orthographic, no_camera, no_light)


def sheet(folder, kinds, programs, out):
    """Traces the last picture of each kind; 8 in a row."""
    with tempfile.TemporaryDirectory() as work:
        tiles = []
        for name, pictures in kinds.items():
            tile = os.path.join(work, name + ".exr")
            how = pictures[-1]
            command = [os.path.join(programs, "vlx-trace"), os.path.join(folder, name + ".gltf"), "-o", tile, "--width", "96",
                       "--spp", "64", "--quiet"]
            if "shutter" in how:
                command += ["--shutter", ",".join(map(str, how["shutter"]))]
            if "variant" in how:
                command += ["--variant", how["variant"]]
            if "environment" in how:
                command += ["--env-constant", ",".join(map(str, how["environment"]))]
            subprocess.run(command, check=True)
            tiles.append(tile)
        rows = -(-len(tiles) // 8)
        command = ["oiiotool"]
        for tile in tiles:
            command += [tile, "--ch", "R,G,B"]
        subprocess.run([*command, "--mosaic:pad=4", f"8x{rows}", "--colorconvert", "linear", "sRGB", "-d", "uint8", "-o", out],
                       check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--sheet", metavar="PNG")
    parser.add_argument("--programs", metavar="FOLDER", default="build/release/bin")
    args = parser.parse_args()
    os.makedirs(args.folder, exist_ok=True)
    kinds = {}
    for kind in KINDS:
        made = kind()
        made.write(args.folder, kind.__name__)
        kinds[kind.__name__] = made.pictures
    with open(os.path.join(args.folder, "kinds.json"), "w", encoding="utf-8") as out:
        json.dump(kinds, out, indent=1)
    if args.sheet:
        sheet(args.folder, kinds, args.programs, args.sheet)


if __name__ == "__main__":
    main()
