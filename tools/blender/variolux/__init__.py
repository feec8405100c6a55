"""Variolux in Blender: renders through vlx-blender, and opens what it wrote."""

import bpy

from . import operators, panel

bl_info = {
    "name": "Variolux",
    "author": "the Variolux authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Render > Variolux",
    "description": "Kriged renders with error maps: few samples, all light groups, frames that add to each other",
    "category": "Render",
}


class VARIOLUX_Preferences(bpy.types.AddonPreferences):
    bl_idname = __name__
    program: bpy.props.StringProperty(
        name="vlx-blender", subtype="FILE_PATH", default="vlx-blender",
        description="The program: its name where PATH finds it, else its whole path (bin/vlx-blender where Variolux is installed)")

    def draw(self, context):
        self.layout.prop(self, "program")


CLASSES = (VARIOLUX_Preferences, panel.VARIOLUX_Settings, operators.RENDER_OT_variolux, operators.RENDER_OT_variolux_cancel,
           panel.RENDER_PT_variolux)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.variolux = bpy.props.PointerProperty(type=panel.VARIOLUX_Settings)


def unregister():
    operators.end()
    del bpy.types.Scene.variolux
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
