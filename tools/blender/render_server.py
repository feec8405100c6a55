"""Runs inside Blender (3.4 and later): renders what vlx-blender asks for, and never saves the file.

    blender -b SCENE.blend --python render_server.py -- '{"scene": path, ...}'

Requests and answers are lines of JSON on standard input and output, answers with `vlx ` before them; all that Blender
itself prints goes to standard error. The first answer says what the scene is; each request {"frame", "sample", "path"}
renders one image whose first sample has that number. The end of standard input ends Blender."""

import json
import os
import sys

import bpy

channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
os.dup2(2, 1)
wish = json.loads(sys.argv[sys.argv.index("--") + 1])


def answer(**values):
    print("vlx " + json.dumps(values), file=channel, flush=True)


def setting(of, name, value):
    """Of settings that not every version has."""
    if hasattr(of, name):
        setattr(of, name, value)


FIRST_TILE = {"<UDIM>": "1001", "<UVTILE>": "u1_v1"}  # what Blender's names of tiled images stand for


def missing_files():
    """Files that the scene names and that are not there."""
    used = [image for image in bpy.data.images
            if image.users > 0 and image.source in {"FILE", "SEQUENCE", "MOVIE", "TILED"} and not image.packed_file]
    used += [font for font in bpy.data.fonts if font.users > 0 and font.filepath != "<builtin>" and not font.packed_file]
    used += [*bpy.data.libraries, *bpy.data.volumes, *bpy.data.cache_files]
    missing = set()
    for data in used:
        path = bpy.path.abspath(data.filepath, library=data.library)
        for token, tile in FIRST_TILE.items():
            path = path.replace(token, tile)
        if path and not os.path.exists(path):
            missing.add(path)
    return sorted(missing)


def chosen_layer(scene):
    """The view layer that is rendered: the one asked for, or the first that is rendered at all."""
    wanted = wish["viewLayer"]
    return next((layer for layer in scene.view_layers if (layer.name == wanted if wanted else layer.use)), None)


def first_sample(layer):
    """Sample 0 is the pixel's centre with every seed, which says nothing of edges; but depth, position and indices are those of
    sample 0 alone."""
    return 0 if any((layer.use_pass_z, layer.use_pass_position, layer.use_pass_object_index, layer.use_pass_material_index)) else 1


def description(scene, layer):
    editor = scene.sequence_editor
    return {
        "file": bpy.data.filepath,
        "scene": scene.name,
        "scenes": len(bpy.data.scenes),
        "version": list(bpy.app.version),
        "fileVersion": list(bpy.data.version),
        "blender": bpy.app.version_string,
        "engine": scene.render.engine,
        "cycles": hasattr(scene, "cycles"),
        "camera": bool(scene.camera or any(marker.camera for marker in scene.timeline_markers)),
        "strips": bool(editor and (editor.strips_all if hasattr(editor, "strips_all") else editor.sequences_all)),  # since 4.4
        "frames": [scene.frame_start, scene.frame_end, scene.frame_step],
        "frame": scene.frame_current,
        "layer": layer.name if layer else None,
        "layers": [each.name for each in scene.view_layers],
        "firstSample": first_sample(layer) if layer else 1,
        "motionBlur": scene.render.use_motion_blur,
        "stereo": scene.render.use_multiview,
        "missing": missing_files(),
    }


def prepare(scene, layer):
    """What kriging needs. All else is the scene's own: camera, resolution, film, bounces, pixel filter, passes."""
    render, cycles, image = scene.render, scene.cycles, scene.render.image_settings
    render.engine = "CYCLES"
    # Independent errors, all of them: no denoiser, no pixel that stops earlier, no pattern shared by pixels.
    cycles.use_denoising = False
    cycles.use_adaptive_sampling = False
    cycles.time_limit = 0
    cycles.use_layer_samples = "IGNORE"
    setting(cycles, "auto_scrambling_distance", False)
    setting(cycles, "scrambling_distance", 1.0)
    patterns = cycles.bl_rna.properties["sampling_pattern"].enum_items.keys()
    if "TABULATED_SOBOL" in patterns:  # blue noise, where that is the default, shares errors out to neighbours
        cycles.sampling_pattern = "TABULATED_SOBOL"
    cycles.use_animated_seed = True  # frames have noise of their own
    for each in scene.view_layers:
        each.use = each == layer
    layer.use_pass_combined = True
    layer.cycles.denoising_store_passes = True
    if wish["vectors"]:
        layer.use_pass_vector = True
    render.use_persistent_data = True
    render.use_border = False
    render.use_multiview = False
    render.use_compositing = False
    render.use_sequencer = False
    for name in dir(render):
        if name.startswith("use_stamp"):  # files would carry paths and dates
            setattr(render, name, False)
    render.use_stamp_note = True
    setting(image, "media_type", "MULTI_LAYER_IMAGE")  # since 5.0
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"  # in half floats light groups would not add up to the beauty
    image.exr_codec = "ZIP"
    render.use_file_extension = False
    render.use_overwrite = True
    render.use_placeholder = False


def render_image(scene, request):
    cycles, samples = scene.cycles, wish["samples"]
    cycles.sample_offset = request["sample"]
    if hasattr(cycles, "use_sample_subset"):  # since 4.4: samples are those of the whole, of which a part is rendered
        cycles.use_sample_subset = True
        cycles.sample_subset_length = samples
        cycles.samples = request["sample"] + samples
    else:
        cycles.samples = samples
    if scene.frame_current != request["frame"] or scene.frame_subframe:
        scene.frame_set(request["frame"])
    scene.render.stamp_note_text = request["note"]
    scene.render.filepath = request["path"]
    bpy.ops.render.render(write_still=True, scene=scene.name)
    if not os.path.exists(request["path"]):
        raise RuntimeError("no image was written")


def serve():
    scene = bpy.context.scene
    layer = chosen_layer(scene)
    answer(**description(scene, layer))
    prepared = False
    for line in sys.stdin:
        request = json.loads(line)
        if not prepared:
            prepare(scene, layer)
            prepared = True
        render_image(scene, request)
        os.write(2, b"\nvlx\n")  # ends what Blender says of it
        answer(rendered=request["path"])


try:
    serve()
except Exception as error:  # Blender would go on without a word
    answer(error=str(error).strip() or type(error).__name__)
    sys.stdin.read()  # ended by vlx-blender
