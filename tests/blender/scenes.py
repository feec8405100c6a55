"""Blender files for the tests: blender -b --factory-startup --python scenes.py -- FOLDER"""

import math
import os
import sys

import bpy

folder = sys.argv[-1]


def save(name, **options):
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, name), copy=True, check_existing=False, **options)


def textured(name, image=None):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    pattern = tree.nodes.new("ShaderNodeTexImage" if image else "ShaderNodeTexChecker")
    if image:
        pattern.image = image
    tree.links.new(pattern.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])
    return material


def light(kind, group, location, energy):
    bpy.ops.object.light_add(type=kind, location=location, rotation=(0.6, 0.6, 0))
    bpy.context.object.data.energy = energy
    bpy.context.object.lightgroup = group
    return bpy.context.object


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
layer = scene.view_layers[0]
render, cycles = scene.render, scene.cycles
render.engine = "CYCLES"
for group in ("key", "fill"):
    layer.lightgroups.add(name=group)
bpy.ops.mesh.primitive_plane_add(size=3)  # beyond it is nothing
bpy.context.object.data.materials.append(textured("floor"))
bpy.ops.mesh.primitive_uv_sphere_add(radius=0.7, location=(-0.4, 0, 0.7))
ball = bpy.context.object
for frame, x in ((1, -0.4), (9, 0.4)):
    ball.location.x = x
    ball.keyframe_insert("location", frame=frame)
light("AREA", "key", (2, -2, 3), 200)
light("POINT", "fill", (-2, -2, 2), 50)
bpy.ops.object.camera_add(location=(0, -6, 3), rotation=(math.radians(66), 0, 0))
camera = scene.camera = bpy.context.object
render.resolution_x, render.resolution_y = 40, 32
scene.frame_start, scene.frame_end, scene.frame_step, scene.frame_current = 2, 6, 2, 3
cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 7, False, False
save("plain.blend", compress=False)

passes = ["z", *(f"{kind}_{part}" for kind in ("diffuse", "glossy") for part in ("direct", "indirect", "color"))]
for name in passes:
    setattr(layer, "use_pass_" + name, True)
save("passes.blend")
for name in passes:
    setattr(layer, "use_pass_" + name, False)

# All that is to be off while rendering, on. The picture is that of the plain file.
cycles.use_adaptive_sampling = cycles.use_denoising = True
cycles.time_limit, cycles.sample_offset = 0.001, 5
cycles.auto_scrambling_distance, cycles.scrambling_distance = True, 0.2
layer.samples = 3
render.use_border, render.border_max_x = True, 0.5
render.use_stamp = render.use_stamp_note = render.use_multiview = True
render.image_settings.file_format, render.filepath = "PNG", "//elsewhere"
scene.use_nodes = True
tree = scene.node_tree
tree.nodes.clear()
black = tree.nodes.new("CompositorNodeRGB")
tree.links.new(black.outputs[0], tree.nodes.new("CompositorNodeComposite").inputs[0])
scene.sequence_editor_create().sequences.new_effect("strip", "COLOR", 1, 1, frame_end=10)
save("switches.blend")
scene.camera = None
save("edit.blend")
scene.camera = camera

render.engine = "BLENDER_EEVEE"
save("eevee.blend")
render.engine = "CYCLES"

image = bpy.data.images.new("bricks", 4, 4)
image.source, image.filepath = "FILE", "//textures/bricks.png"
ball.data.materials.append(textured("bricks", image))
save("textures.blend", compress=False)

render.use_motion_blur = True
save("blurred.blend")
