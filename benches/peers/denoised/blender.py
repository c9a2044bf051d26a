"""Cycles with adaptive sampling and its denoiser, as it comes, within so many seconds.

    python blender.py SCENE.toml SIZE REFERENCE_SPP FOLDER SECONDS...      (pip install bpy numpy)

Writes reference.npy and three pictures for each time, linear RGB, and prints a line of JSON for each. What Blender does before and
after the samples is measured on a render of one sample and not counted; denoising is.
"""

import json
import math
import sys
import time

import bpy
import described
import mathutils
import numpy as np

THREADS = 2
REFERENCE_SEED = 77
SEEDS = [1, 2, 3]


def material(description):
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    if "emission" in description:
        # Light on the front side alone, as in the others.
        emission, black = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeBsdfDiffuse")
        black.inputs["Color"].default_value = (0, 0, 0, 1)
        strength = max(description["emission"])
        emission.inputs["Color"].default_value = [*(c / strength for c in description["emission"]), 1]
        emission.inputs["Strength"].default_value = strength
        side, mix = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeMixShader")
        links.new(side.outputs["Backfacing"], mix.inputs[0])
        links.new(emission.outputs[0], mix.inputs[1])
        links.new(black.outputs[0], mix.inputs[2])
        links.new(mix.outputs[0], output.inputs[0])
    elif description["type"] == "dielectric":
        glass = nodes.new("ShaderNodeBsdfGlass")
        glass.inputs["IOR"].default_value = description["ior"]
        glass.inputs["Roughness"].default_value = 0.0
        links.new(glass.outputs[0], output.inputs[0])
    else:
        diffuse = nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = [*description["reflectance"], 1]
        links.new(diffuse.outputs[0], output.inputs[0])
    return made


def add_side(side):
    corner, u, v = (np.array(side[key]) for key in ("corner", "edge_u", "edge_v"))
    mesh = bpy.data.meshes.new("side")
    mesh.from_pydata([corner.tolist(), (corner + u).tolist(), (corner + u + v).tolist(), (corner + v).tolist()], [], [[0, 1, 2, 3]])
    mesh.materials.append(material(side["material"]))
    bpy.context.collection.objects.link(bpy.data.objects.new("side", mesh))


def add_ball(ball):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=192, ring_count=96, radius=ball["radius"], location=ball["center"])
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material(ball["material"]))


def add_camera(camera):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle_y = math.radians(camera["vertical_fov_deg"])
    placed = bpy.data.objects.new("camera", data)
    position, target = mathutils.Vector(camera["position"]), mathutils.Vector(camera["look_at"])
    back = (position - target).normalized()
    right = mathutils.Vector((0, 1, 0)).cross(back).normalized()
    rotation = mathutils.Matrix((right, back.cross(right), back)).transposed()
    placed.matrix_world = mathutils.Matrix.Translation(position) @ rotation.to_4x4()
    bpy.context.collection.objects.link(placed)
    bpy.context.scene.camera = placed


def load(path, size, is_unbiased):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="cycles")
    description = described.read(path)
    for side in description["parallelograms"]:
        add_side(side)
    for ball in description["spheres"]:
        add_ball(ball)
    add_camera(description["camera"])
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.render.threads_mode, scene.render.threads = "FIXED", THREADS
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.cycles.denoiser = "OPENIMAGEDENOISE"
    if is_unbiased:
        scene.cycles.sample_clamp_indirect = scene.cycles.blur_glossy = 0.0


def render(folder, samples, seed=1, seconds=0.0, is_adaptive=True, is_denoised=True):
    """The picture, and how long it took with all that Blender does."""
    scene = bpy.context.scene
    scene.cycles.seed = seed
    scene.cycles.samples, scene.cycles.time_limit = samples, seconds
    scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = is_adaptive, is_denoised
    scene.render.filepath = f"{folder}/cycles.exr"
    started = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    taken = time.perf_counter() - started
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Linear Rec.709"
    width, height = image.size
    picture = np.array(image.pixels[:], dtype=np.float32).reshape(height, width, image.channels)[::-1, :, :3]
    bpy.data.images.remove(image)
    return picture, taken


def main():
    arguments = [word for word in sys.argv[1:] if word != "--unbiased"]
    path, size, reference_spp, folder, *times = arguments
    load(path, int(size), is_unbiased="--unbiased" in sys.argv)
    # Another seed: of the same one, the pictures' samples would be among the reference's.
    picture, _ = render(folder, int(reference_spp), seed=REFERENCE_SEED, is_adaptive=False, is_denoised=False)
    np.save(f"{folder}/reference.npy", picture)
    render(folder, 1)
    least = lambda **options: min(render(folder, 1, **options)[1] for _ in range(3))
    around = least(is_denoised=False)
    denoising = max(0.0, least() - around)
    for asked in times:
        for seed in SEEDS:
            picture, taken = render(folder, 1 << 14, seed=seed, seconds=max(0.1, float(asked) - denoising))
            np.save(f"{folder}/{asked}-{seed}.npy", picture)
            said = {"asked": asked, "seed": seed, "seconds": taken - around, "spp": None}
            print("JSON", json.dumps(said), flush=True)


main()
