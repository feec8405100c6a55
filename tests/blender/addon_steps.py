"""The add-on in a Blender in the background: blender -b SCENE --python addon_steps.py -- ZIP PROGRAM FOLDER. Prints what it found."""

import json
import os
import sys

import bpy

archive, program, folder = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.preferences.addon_install(filepath=archive)
bpy.ops.preferences.addon_enable(module="variolux")
bpy.context.preferences.addons["variolux"].preferences.program = program
scene = bpy.context.scene
settings = scene.variolux
found = {}


def node():
    each = scene.node_tree.nodes["Variolux"]
    return {"outputs": [output.name for output in each.outputs if output.enabled], "file": os.path.basename(each.image.filepath),
            "source": each.image.source, "type": each.image.type, "frames": [each.frame_start, each.frame_offset, each.frame_duration]}


def attempt(name, **options):
    try:
        found[name] = list(bpy.ops.render.variolux(**options))
    except RuntimeError as error:
        found[name] = str(error)


settings.images, settings.samples, settings.quality = 2, 1, "draft"
settings.output = os.path.join(folder, "new", "still.exr")
attempt("still")
found["still node"] = node()
scene.frame_start, scene.frame_end, scene.frame_step = 2, 3, 1  # changed and not saved: a copy is rendered
settings.output, settings.temporal = os.path.join(folder, "shot_##.exr"), 1
attempt("shot", animation=True)
found["shot node"] = node()

# What the compositor gives of the sequence is the file's own, frame by frame.
tree = scene.node_tree
output = tree.nodes.new("CompositorNodeOutputFile")
output.base_path, output.format.file_format, output.format.color_depth = folder, "OPEN_EXR", "32"
output.file_slots[0].path = "comped_"
tree.links.new(tree.nodes["Variolux"].outputs["Combined"], output.inputs[0])
scene.render.resolution_percentage, scene.cycles.samples, scene.cycles.use_denoising = 100, 1, False
scene.render.filepath = os.path.join(folder, "render_")
bpy.ops.render.render(animation=True)

scene.camera = None
attempt("no camera")
bpy.context.preferences.addons["variolux"].preferences.program = "no-such-program"
attempt("no program")
found["images"] = len([image for image in bpy.data.images if image.filepath.endswith("##.exr") or "still" in image.filepath])
bpy.ops.preferences.addon_disable(module="variolux")
found["off"] = not hasattr(bpy.types.Scene, "variolux")
print("found " + json.dumps(found))
