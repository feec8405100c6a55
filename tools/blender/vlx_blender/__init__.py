"""What vlx-blender consists of. Python's standard library alone."""
