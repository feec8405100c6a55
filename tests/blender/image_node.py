"""Prints the outputs of the compositor's Image node with a picture: blender -b --python image_node.py -- PICTURE"""

import json
import sys

import bpy

bpy.context.scene.use_nodes = True
node = bpy.context.scene.node_tree.nodes.new("CompositorNodeImage")
node.image = bpy.data.images.load(sys.argv[-1])
print("outputs " + json.dumps([output.name for output in node.outputs if output.enabled]))
