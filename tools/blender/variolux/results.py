"""Opens pictures: in Image Editors, and as the compositor's Image node."""

import bpy

NODE = "Variolux"


def load(outputs):
    """[(frame, path)]: the image, or the sequence of them, with all layers."""
    image = bpy.data.images.load(outputs[0][1], check_existing=True)
    image.reload()
    image.source = "SEQUENCE" if len(outputs) > 1 else "FILE"
    return image


def place(user, image, outputs):
    """What an image user or the node is to show at which frame: that of the file's own number."""
    if image.source == "SEQUENCE":
        first, last = outputs[0][0], outputs[-1][0]
        user.frame_start, user.frame_offset, user.frame_duration = first, first - 1, last - first + 1
        user.use_auto_refresh = True


def into_compositor(scene, image, outputs):
    """The node of an earlier picture, with its links, or a new one."""
    if not hasattr(scene, "node_tree"):  # Blender 5 keeps compositor trees elsewhere
        return
    scene.use_nodes = True
    tree = scene.node_tree
    node = tree.nodes.get(NODE)
    if node is None:
        node = tree.nodes.new("CompositorNodeImage")
        node.name = node.label = NODE
        node.location = (min(each.location.x for each in tree.nodes) - 300, 0)
    node.image = image
    place(node, image, outputs)


def into_editors(context, image, outputs):
    """Every Image Editor that is open; where there is none, in a window of its own."""
    editors = [area for window in context.window_manager.windows for area in window.screen.areas if area.type == "IMAGE_EDITOR"]
    if not editors and context.window_manager.windows:
        bpy.ops.wm.window_new()
        area = context.window_manager.windows[-1].screen.areas[0]
        area.ui_type = "IMAGE_EDITOR"
        editors = [area]
    for area in editors:
        area.spaces.active.image = image
        place(area.spaces.active.image_user, image, outputs)


def show(context, outputs):
    image = load(outputs)
    into_compositor(context.scene, image, outputs)
    if not bpy.app.background:
        into_editors(context, image, outputs)
