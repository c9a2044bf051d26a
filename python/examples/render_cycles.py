"""Renders a small scene by Cycles with a seed and a number of samples, for `judge_renders.py` to say where its noise still shows.

Needs `pip install bpy` (Blender as a module; the Python version that its release names). Raw samples: no denoiser, no clamping.

    python python/examples/render_cycles.py --spp 64 --seed 1 -o a.npy
    python python/examples/render_cycles.py --spp 64 --seed 2 -o b.npy
    python python/examples/judge_renders.py a.npy b.npy --exposure 200 -o map.png
"""

import argparse
import math
import tempfile
from pathlib import Path

import bpy
import numpy as np


def material(name, color, **inputs):
    """A principled material; `inputs` by their names in Blender, underscores for spaces."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:  # before Blender 5
        made.use_nodes = True
    principled = made.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (*color, 1.0)
    for key, value in inputs.items():
        principled.inputs[key.replace("_", " ")].default_value = value
    return made


def give(made):
    """Gives the object that was added last a material."""
    bpy.context.object.data.materials.append(made)


def build_scene():
    """A floor and a wall, a grey, a glass and a metal ball, a lamp of half a metre, and a camera."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    grey = material("grey", (0.5, 0.5, 0.5), Roughness=1.0)
    add = bpy.ops.mesh
    add.primitive_plane_add(size=12)
    give(grey)
    add.primitive_plane_add(size=12, location=(0, 3, 0), rotation=(math.pi / 2, 0, 0))
    give(grey)
    for x, made in [
        (-1.3, material("clay", (0.7, 0.25, 0.15), Roughness=1.0)),
        (0.0, material("glass", (1.0, 1.0, 1.0), Roughness=0.0, Transmission_Weight=1.0, IOR=1.5)),
        (1.3, material("metal", (0.9, 0.7, 0.4), Roughness=0.3, Metallic=1.0)),
    ]:
        add.primitive_uv_sphere_add(radius=0.6, location=(x, 0, 0.6), segments=64, ring_count=32)
        give(made)
        bpy.ops.object.shade_smooth()
    bpy.ops.object.light_add(type="AREA", location=(-2.0, -1.5, 3.5), rotation=(0.5, -0.5, 0))
    bpy.context.object.data.energy = 150.0
    bpy.context.object.data.size = 0.5
    bpy.ops.object.camera_add(location=(0, -5.5, 1.8), rotation=(math.radians(78), 0, 0))
    bpy.context.scene.camera = bpy.context.object


def render(width, height, spp, seed):
    """Linear Rec. 709, (height, width, 3), from the top."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = spp
    scene.cycles.seed = seed
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0.0
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        picture = bpy.data.images.load(scene.render.filepath)
        values = np.empty(width * height * 4, np.float32)
        picture.pixels.foreach_get(values)
    return np.ascontiguousarray(values.reshape(height, width, 4)[::-1, :, :3])


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--width", type=int, default=480)
    arguments.add_argument("--height", type=int, default=270)
    arguments.add_argument("--spp", type=int, default=64)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("-o", "--output", type=Path, required=True)
    options = arguments.parse_args()
    build_scene()
    np.save(options.output, render(options.width, options.height, options.spp, options.seed))


if __name__ == "__main__":
    main()
