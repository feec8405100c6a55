#!/usr/bin/env python3
"""Animates the demo room: shots of a few frames, each of which tries sequences in another way.

Usage: make_shots.py FOLDER [NAME...]      (default: all; --list prints the names)

    dolly        the camera goes sideways and turns a little, the bronze head turns: slow, what --temporal is for
    moving_light the pendant lamp's light swings, nothing else moves
    pan          the camera turns by 30 pixels a frame (of 160 a row): most of what is seen is soon gone
    appears      the bronze head is there from frame 4 on
    cut          from frame 5 on another camera

Keys are 1/24 s apart, vlx-trace's frames by default; frames 0 to 7. Python 3 and its standard library only.
"""

import json
import math
import os
import struct
import sys

ROOM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../testdata/scenes/interior.glb")
FRAMES, FPS = 8, 24
PIXEL_ANGLE = 2 * math.tan(1.3714590072631836 / 2) / 160  # of cam_main, in its middle


def product(a, b):
    """Of quaternions x, y, z, w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def turn(angle):
    """About the vertical axis."""
    return [0, math.sin(angle / 2), 0, math.cos(angle / 2)]


class Room:
    def __init__(self):
        with open(ROOM, "rb") as file:
            data = file.read()
        length = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20:20 + length])
        self.bytes = data[28 + length:]
        self.number = {node["name"]: i for i, node in enumerate(self.json["nodes"])}
        self.json["animations"] = [{"samplers": [], "channels": []}]

    def node(self, name):
        return self.json["nodes"][self.number[name]]

    def _accessor(self, rows, kind):
        while len(self.bytes) % 4:
            self.bytes += b"\0"
        flat = [v for row in rows for v in row]
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": 4 * len(flat)})
        self.bytes += struct.pack(f"<{len(flat)}f", *flat)
        accessor = {"bufferView": len(self.json["bufferViews"]) - 1, "componentType": 5126, "count": len(rows), "type": kind}
        if kind == "SCALAR":
            accessor.update(min=[min(flat)], max=[max(flat)])
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def animate(self, name, path, values, step=False):
        """values: one for each frame."""
        animation = self.json["animations"][0]
        early = 1e-3 if step else 0  # a key that rounds to later than its frame would be missed
        times = self._accessor([(max(0, frame / FPS - early),) for frame in range(len(values))], "SCALAR")
        output = self._accessor(values, "VEC4" if path == "rotation" else "VEC3")
        animation["samplers"].append({"input": times, "output": output, "interpolation": "STEP" if step else "LINEAR"})
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1,
                                      "target": {"node": self.number[name], "path": path}})

    def glb(self):
        self.json["buffers"][0]["byteLength"] = len(self.bytes)
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        body = self.bytes + b"\0" * (-len(self.bytes) % 4)
        return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body)) + struct.pack("<I4s", len(text), b"JSON") + text +
                struct.pack("<I4s", len(body), b"BIN\0") + body)


def dolly():
    room = Room()
    x, y, z = room.node("cam_main")["translation"]
    rotation = room.node("cam_main")["rotation"]
    room.animate("cam_main", "translation", [(x - 0.02 * f, y, z - 0.01 * f) for f in range(FRAMES)])
    room.animate("cam_main", "rotation", [product(turn(-0.004 * f), rotation) for f in range(FRAMES)])
    head = room.node("suzanne_bronze")["rotation"]
    room.animate("suzanne_bronze", "rotation", [product(turn(0.05 * f), head) for f in range(FRAMES)])
    return room


def moving_light():
    room = Room()
    x, y, z = room.node("pendant_point")["translation"]
    room.animate("pendant_point", "translation", [(x + 0.6 * math.sin(0.6 * f), y, z) for f in range(FRAMES)])
    return room


def pan():
    room = Room()
    rotation = room.node("cam_main")["rotation"]
    room.animate("cam_main", "rotation", [product(turn(30 * PIXEL_ANGLE * (f - 3.5)), rotation) for f in range(FRAMES)])
    return room


def appears():
    room = Room()
    scale = room.node("suzanne_bronze")["scale"]
    room.animate("suzanne_bronze", "scale", [[v * (1 if f >= 4 else 1e-4) for v in scale] for f in range(FRAMES)], step=True)
    return room


def cut():
    room = Room()
    for path in ("translation", "rotation"):
        room.animate("cam_main", path, [room.node("cam_main" if f < 5 else "cam_sofa")[path] for f in range(FRAMES)], step=True)
    return room


SHOTS = (dolly, moving_light, pan, appears, cut)


def main(arguments):
    names = [shot.__name__ for shot in SHOTS]
    if arguments == ["--list"]:
        print("\n".join(names))
        return 0
    if not arguments or arguments[0].startswith("-") or not set(arguments[1:]) <= set(names):
        print(__doc__, file=sys.stderr)
        return 2
    os.makedirs(arguments[0], exist_ok=True)
    for shot in SHOTS:
        if len(arguments) == 1 or shot.__name__ in arguments[1:]:
            with open(os.path.join(arguments[0], shot.__name__ + ".glb"), "wb") as file:
                file.write(shot().glb())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
