"""Runs vlx-blender on this file, with progress and an end by Esc, and opens the result."""

import atexit
import json
import os
import shutil
import subprocess
import tempfile
import threading

import bpy

from . import results

running = None  # the Run that goes on, if there is one


class Run:
    """One vlx-blender. What it says is read by a thread of its own."""

    def __init__(self, command, temporary):
        self.temporary = temporary
        self.outputs, self.messages, self.failure = [], [], ""
        self.task, self.fraction, self.left = "starting Blender", 0.0, None
        try:
            self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                            text=True, errors="replace")
        except OSError as error:
            shutil.rmtree(temporary, ignore_errors=True)
            raise RuntimeError(f"{command[0]}: {error.strerror}: set the path of vlx-blender in the add-on's preferences") from None
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()

    def listen(self):
        for line in self.process.stderr:
            try:
                record = json.loads(line)
            except ValueError:  # bad usage is told in words
                self.failure += line
                continue
            event = record["event"]
            if event == "progress":
                self.task, self.fraction, self.left = record["task"], record["fraction"], record["secondsLeft"]
            elif event == "frame":
                self.outputs.append((record["frame"], record["output"]))
            elif event == "message":
                self.messages.append(record["message"])
            elif event == "end":
                self.failure = record.get("message", "")

    def status(self):
        left = "" if self.left is None else f", {self.left:.0f} s left"
        return f"{self.task}: {self.fraction * 100:.0f} %{left}"

    def wait(self):
        """The exit code, when all is read."""
        code = self.process.wait()
        self.listener.join()
        shutil.rmtree(self.temporary, ignore_errors=True)
        return code


def end():
    """Of what goes on, with the file, the add-on or Blender."""
    global running
    if running:
        running.process.terminate()
        running.wait()
        running = None


atexit.register(end)


def file_to_render(temporary):
    """A copy of what is open: changes by scripts do not make a file dirty."""
    path = os.path.join(temporary, os.path.basename(bpy.data.filepath) or "untitled.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False, relative_remap=True)
    return path


def command(context, animation, temporary):
    scene = context.scene
    settings = scene.variolux
    if settings.output.startswith("//") and not bpy.data.filepath:
        raise RuntimeError("Save the file first, or give an output that does not begin with //, its folder")
    output = bpy.path.abspath(settings.output)
    os.makedirs(os.path.dirname(output) or ".", exist_ok=True)
    frames = f"{scene.frame_start}-{scene.frame_end}x{scene.frame_step}" if animation else str(scene.frame_current)
    program = context.preferences.addons[__package__].preferences.program
    words = [bpy.path.abspath(program), file_to_render(temporary), "-o", output, "--frames", frames, "--images", str(settings.images),
             "--spp", str(settings.samples), "--view-layer", context.view_layer.name, "--blender", bpy.app.binary_path,
             "--overwrite", "--log", "json"]
    if settings.use_target:
        words += ["--target-error", f"relmse={settings.target:.6g}", "--max-images", str(max(settings.most_images, settings.images))]
    elif settings.temporal and animation:
        words += ["--temporal", str(settings.temporal)]
    return [*words, "--", "--quality", settings.quality]


class RENDER_OT_variolux(bpy.types.Operator):
    """Render with few samples, krige, and open the picture with its error map. Esc cancels"""
    bl_idname = "render.variolux"
    bl_label = "Render with Variolux"
    animation: bpy.props.BoolProperty(name="Animation", description="All frames of the scene, not the current one alone")
    timer = None

    @classmethod
    def poll(cls, context):
        return running is None and context.scene.render.engine == "CYCLES"

    def start(self, context):
        global running
        temporary = tempfile.mkdtemp(prefix="variolux-")
        try:
            running = Run(command(context, self.animation, temporary), temporary)
        except (RuntimeError, OSError) as error:
            shutil.rmtree(temporary, ignore_errors=True)
            self.report({"ERROR"}, str(error))
            return False
        return True

    def execute(self, context):
        """Blocking, as scripts and background mode want it."""
        return self.finish(context) if self.start(context) else {"CANCELLED"}

    def invoke(self, context, event):
        if bpy.app.background:
            return self.execute(context)
        if not self.start(context):
            return {"CANCELLED"}
        context.window_manager.progress_begin(0, 100)
        self.timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if running is None:  # ended by the button
            self.stop(context)
            self.report({"INFO"}, "Variolux: cancelled")
            return {"CANCELLED"}
        if event.type == "ESC":
            end()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        context.window_manager.progress_update(int(running.fraction * 100))
        redraw(context)
        if running.process.poll() is None:
            return {"PASS_THROUGH"}
        self.stop(context)
        return self.finish(context)

    def stop(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        redraw(context)

    def finish(self, context):
        global running
        run, code = running, running.wait()
        running = None
        for message in run.messages:
            self.report({"WARNING" if "WARNING" in message else "INFO"}, message)
        if code not in (0, 3):  # 3: not as accurate as was wanted, which is told
            self.report({"ERROR"}, run.failure.strip() or f"vlx-blender was ended ({code})")
            return {"CANCELLED"}
        if context.scene.variolux.use_view:
            results.show(context, sorted(run.outputs))
        self.report({"INFO"}, f"Variolux: {run.outputs[-1][1]}")
        return {"FINISHED"}


class RENDER_OT_variolux_cancel(bpy.types.Operator):
    """End the render"""
    bl_idname = "render.variolux_cancel"
    bl_label = "Cancel"

    def execute(self, context):
        end()
        return {"FINISHED"}


def redraw(context):
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
