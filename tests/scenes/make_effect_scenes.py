#!/usr/bin/env python3
"""Makes glTF scenes from one diffuse box to everything that vlx-trace simulates, for tools/planned-general.

Usage: make_effect_scenes.py FOLDER

Conventions are those of make_scenes.py, whose scenes are made as well.
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import make_scenes  # noqa: E402
from make_scenes import Scene, floor, lamp  # noqa: E402


def matte(scene, colour):
    return scene.material(colour, specular=0, double_sided=True)


def extend(scene, material, name, values):
    scene._use(name)
    scene.json["materials"][material].setdefault("extensions", {})[name] = values


def animate(scene, node, before, after, seconds=1 / 48):
    """Moves a node of the scene from one translation to another."""
    def accessor(rows):
        if len(rows[0]) > 1:
            return scene._floats(rows)
        scene.json["accessors"].append({"bufferView": scene._view(make_scenes.struct.pack(
            f"<{len(rows)}f", *(v for row in rows for v in row))), "componentType": 5126, "count": len(rows),
            "type": "SCALAR", "min": [rows[0][0]], "max": [rows[-1][0]]})
        return len(scene.json["accessors"]) - 1
    animations = scene.json.setdefault("animations", [])
    animations.append({"samplers": [{"input": accessor([(0.0,), (seconds,)]), "output": accessor([before, after])}],
                       "channels": [{"sampler": 0, "target": {"node": node, "path": "translation"}}]})


def one_box():
    """A diffuse box on a diffuse floor under one lamp."""
    s = Scene()
    s.camera((0, 1.6, 4.4), (0, 0.5, 0), 40)
    floor(s, matte(s, (0.6, 0.6, 0.6)), 3)
    s.box(matte(s, (0.7, 0.3, 0.2)), (0, 0.5, 0), (1, 1, 1), 30)
    lamp(s, (0.5, 3, 1), 1, 1, (6, 6, 6))
    s.json["materials"][-1].setdefault("extensions", {})["KHR_materials_specular"] = {"specularFactor": 0}
    return s


def diffuse_room():
    """A closed room of diffuse walls."""
    s = Scene()
    s.camera((0, 1.2, 2.8), (0, 1.0, 0), 50)
    white, red, green = (matte(s, c) for c in ((0.75, 0.75, 0.75), (0.7, 0.1, 0.1), (0.1, 0.6, 0.1)))
    s.quad(white, (-2, 0, 3), (4, 0, 0), (0, 0, -5))
    s.quad(white, (-2, 3, -2), (4, 0, 0), (0, 0, 5))
    s.quad(white, (-2, 0, -2), (4, 0, 0), (0, 3, 0))
    s.quad(red, (-2, 0, 3), (0, 0, -5), (0, 3, 0))
    s.quad(green, (2, 0, -2), (0, 0, 5), (0, 3, 0))
    s.quad(white, (2, 0, 3), (-4, 0, 0), (0, 3, 0))
    s.box(white, (-0.6, 0.6, -0.6), (0.9, 1.2, 0.9), 20)
    s.sphere(white, (0.7, 0.45, 0.2), 0.45)
    lamp(s, (0, 2.99, 0), 1.2, 1.2, (9, 9, 9))
    s.json["materials"][-1].setdefault("extensions", {})["KHR_materials_specular"] = {"specularFactor": 0}
    return s


def moving():
    """Two spheres, one of which flies past."""
    s = Scene()
    s.camera((0, 1.6, 4.4), (0, 0.5, 0), 40)
    floor(s, s.material((0.6, 0.6, 0.6)), 3)
    s.sphere(s.material((0.8, 0.3, 0.2), roughness=0.5), (-0.7, 0.5, 0), 0.5)
    s.sphere(s.material((0.2, 0.4, 0.8), roughness=0.3), (0.5, 0.5, 0.3), 0.4)
    animate(s, len(s.json["nodes"]) - 1, (0, 0, 0), (0.6, 0.3, 0))
    lamp(s, (0.5, 3, 1), 1, 1, (6, 6, 6))
    return s


def everything():
    """Every effect at once."""
    s = Scene()
    s.camera((0, 1.5, 4.6), (0, 0.6, 0), 42, lens_radius=0.02, focus=4.4)
    camera = len(s.json["nodes"]) - 1
    s.json["scenes"][0]["nodes"].remove(camera)
    s._node({"name": "dolly", "translation": [0, 0, 0], "children": [camera]})
    animate(s, len(s.json["nodes"]) - 1, (0, 0, 0), (0.05, 0, 0))
    s.environment((0.15, 0.18, 0.25))
    s.json.setdefault("images", [])
    s.json.setdefault("textures", [])

    def texture(pixel):
        s.json["images"].append({"bufferView": s._view(make_scenes.png(64, 64, pixel)), "mimeType": "image/png"})
        s.json["textures"].append({"source": len(s.json["images"]) - 1})
        return len(s.json["textures"]) - 1
    tiles = texture(lambda x, y: (200, 190, 170) if (x // 8 + y // 8) % 2 else (90, 80, 70))
    bumps = texture(lambda x, y: (128 + (x % 8 - 4) * 8, 128 + (y % 8 - 4) * 8, 240))
    tiled = s.material((1, 1, 1), texture=tiles, roughness=0.6)
    s.json["materials"][tiled]["normalTexture"] = {"index": bumps}
    floor(s, tiled, 3, (6, 6))
    glass = s.material((1, 1, 1), roughness=0, transmission=1)
    extend(s, glass, "KHR_materials_volume",
           {"thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0.4, 0.8, 0.6]})
    s.sphere(glass, (-0.9, 0.45, 0.7), 0.45)
    s.sphere(s.material((1, 1, 1), roughness=0.4, transmission=1), (0.1, 0.3, 1.2), 0.3)
    s.sphere(s.material((0.9, 0.9, 0.9), metallic=1, roughness=0), (0.9, 0.4, 0.5), 0.4)
    coated = s.material((0.5, 0.05, 0.05), roughness=0.7)
    extend(s, coated, "KHR_materials_clearcoat", {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.1})
    s.box(coated, (-0.4, 0.4, -0.7), (0.8, 0.8, 0.8), 25)
    cloth = s.material((0.1, 0.15, 0.4))
    extend(s, cloth, "KHR_materials_sheen", {"sheenColorFactor": [0.6, 0.6, 0.8], "sheenRoughnessFactor": 0.4})
    s.sphere(cloth, (0.6, 0.5, -0.6), 0.5)
    animate(s, len(s.json["nodes"]) - 1, (0, 0, 0), (0.3, 0, 0))
    veil = s.material((0.8, 0.8, 0.3), double_sided=True)
    s.json["materials"][veil]["alphaMode"] = "BLEND"
    s.json["materials"][veil]["pbrMetallicRoughness"]["baseColorFactor"] = [0.8, 0.8, 0.3, 0.5]
    s.quad(veil, (-1.7, 0, -0.2), (0.7, 0, 0.4), (0, 1.2, 0))
    lamp(s, (0.5, 3, 1), 0.8, 0.8, (8, 8, 8))
    s.point_light((-2, 2.5, 1.5), (3, 2.5, 2))
    s.point_light((1.8, 2, 2), (1.5, 1.8, 2))
    s.json["nodes"][-1]["extras"] = {"radius": 0.15}
    return s


def small_light():
    """The floor beside a glass ball: a small light shines through it, where paths from the camera hardly ever meet it."""
    s = Scene()
    s.camera((0.8, 1.9, 3.6), (0.8, 0, 0.5), 24)
    floor(s, matte(s, (0.7, 0.66, 0.6)))
    s.sphere(s.material((1, 1, 1), roughness=0, transmission=1), (0, 1.2, 0.1), 0.5, 28)
    s.point_light((-1.4, 3.2, -0.8), (10, 9.5, 9))
    s.json["nodes"][-1]["extras"] = {"radius": 0.04}
    return s


SCENES = (one_box, diffuse_room, moving, everything, small_light)


def main(arguments):
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    os.makedirs(arguments[0], exist_ok=True)
    for make in SCENES + make_scenes.SCENES:
        path = os.path.join(arguments[0], make.__name__ + ".glb")
        with open(path + ".part", "wb") as file:
            file.write(make().glb())
        os.replace(path + ".part", path)
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
