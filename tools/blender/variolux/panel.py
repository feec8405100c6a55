"""The settings, which the scene keeps, and their panel in Render properties."""

import bpy

from . import operators


class VARIOLUX_Settings(bpy.types.PropertyGroup):
    output: bpy.props.StringProperty(
        name="Output", subtype="FILE_PATH", default="//kriged_####.exr",
        description="OpenEXR picture; #### stands for the frame's number, // for this file's folder")
    images: bpy.props.IntProperty(
        name="Images", default=4, min=2, max=4096, soft_max=64,
        description="A frame is rendered as so many images, whose differences tell how noisy a pixel is")
    samples: bpy.props.IntProperty(
        name="Samples", default=4, min=1, max=65536, soft_max=1024, description="Samples a pixel of each image")
    use_target: bpy.props.BoolProperty(
        name="Target Error", description="Render more images of a frame until its predicted relative squared error is low enough")
    target: bpy.props.FloatProperty(
        name="relMSE", default=0.01, min=1e-6, max=10, precision=4, description="The predicted relative squared error to get to")
    most_images: bpy.props.IntProperty(
        name="At Most", default=64, min=2, max=4096, description="Images of a frame at most")
    quality: bpy.props.EnumProperty(
        name="Quality", default="standard",
        items=(("draft", "Draft", "One model, sparse neighbourhoods"), ("standard", "Standard", "Three models"),
               ("high", "High", "Neighbourhoods twice as dense")))
    temporal: bpy.props.IntProperty(
        name="Frames Around", default=0, min=0, max=8,
        description="In animations: so many frames before and after add to each frame, moved by motion vectors. Best without motion blur")
    use_view: bpy.props.BoolProperty(
        name="Open Result", default=True, description="Show the picture in an Image Editor, and put it into the compositor as an Image node")


class RENDER_PT_variolux(bpy.types.Panel):
    bl_label = "Variolux"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout, settings = self.layout, context.scene.variolux
        layout.use_property_split = True
        layout.use_property_decorate = False
        if context.scene.render.engine != "CYCLES":
            layout.label(text="Renders with Cycles alone", icon="INFO")
            return
        layout.prop(settings, "output")
        column = layout.column(align=True)
        column.prop(settings, "images")
        column.prop(settings, "samples")
        column = layout.column(align=True)
        column.prop(settings, "use_target")
        if settings.use_target:
            column.prop(settings, "target")
            column.prop(settings, "most_images")
        layout.prop(settings, "quality")
        column = layout.column()
        column.active = not settings.use_target
        column.prop(settings, "temporal")
        layout.prop(settings, "use_view")
        groups = [group.name for group in context.view_layer.lightgroups]
        if groups:
            layout.label(text="Light groups: " + ", ".join(groups), icon="LIGHT")
        if operators.running:
            layout.label(text=operators.running.status())
            layout.operator("render.variolux_cancel", icon="CANCEL")
            return
        row = layout.row(align=True)
        row.operator("render.variolux", text="Image", icon="RENDER_STILL").animation = False
        row.operator("render.variolux", text="Animation", icon="RENDER_ANIMATION").animation = True
