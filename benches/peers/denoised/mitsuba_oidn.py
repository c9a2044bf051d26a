"""Mitsuba 3 (llvm_ad_rgb), uniform samples, then Open Image Denoise with albedo and normals, within so many seconds.

    python mitsuba_oidn.py SCENE.toml SIZE REFERENCE_SPP FOLDER SECONDS...      (pip install mitsuba numpy pyoidn)

Writes reference.npy and three pictures for each time, linear RGB, and prints a line of JSON for each. Loading and compiling are
not counted: each number of samples is rendered once before it is timed.
"""

import json
import sys
import time

import described
import drjit as dr
import mitsuba as mi
import numpy as np
import pyoidn

mi.set_variant("llvm_ad_rgb")
THREADS = 2
# None of the reference, whose passes count from 0.
SEEDS = [1001, 1002, 1003]


def bsdf(material):
    if material["type"] == "dielectric":
        return {"type": "dielectric", "int_ior": material["ior"], "ext_ior": 1.0}
    reflectance = {"type": "rgb", "value": material["reflectance"]}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}


def with_material(shape, material):
    shape["bsdf"] = bsdf(material)
    if "emission" in material:
        shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": material["emission"]}}
    return shape


def load(path, size):
    scene = described.read(path)
    camera = scene["camera"]
    look_at = mi.ScalarTransform4f().look_at(
        origin=camera["position"], target=camera["look_at"], up=[0, 1, 0]
    )
    film = {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "component_format": "float32"}
    # Any wider filter shares noise between pixels, which the denoiser takes for detail.
    film["rfilter"] = {"type": "box"}
    made = {
        "type": "scene",
        "integrator": {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "path": {"type": "path"}},
        "sensor": {
            "type": "perspective",
            "fov": camera["vertical_fov_deg"],
            "fov_axis": "y",
            "near_clip": 1e-3,
            "to_world": look_at,
            "film": film,
            "sampler": {"type": "independent"},
        },
    }
    for number, side in enumerate(scene["parallelograms"]):
        corner, u, v = (np.array(side[key]) for key in ("corner", "edge_u", "edge_v"))
        matrix = np.eye(4)
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = u / 2, v / 2, np.cross(u, v)
        matrix[:3, 3] = corner + (u + v) / 2
        shape = {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix)}
        made[f"side_{number}"] = with_material(shape, side["material"])
    for number, ball in enumerate(scene["spheres"]):
        shape = {"type": "sphere", "center": ball["center"], "radius": ball["radius"]}
        made[f"ball_{number}"] = with_material(shape, ball["material"])
    return mi.load_dict(made)


def render(scene, samples, seed):
    """Colour, albedo and normals, and the seconds that they took."""
    started = time.perf_counter()
    image = mi.render(scene, spp=samples, seed=seed)
    dr.eval(image)
    dr.sync_thread()
    seconds = time.perf_counter() - started
    channels = np.asarray(image, dtype=np.float32)
    return [np.ascontiguousarray(channels[:, :, i : i + 3]) for i in (0, 3, 6)], seconds


def denoised(layers):
    started = time.perf_counter()
    color, albedo, normal = layers
    # Its guides have noise at edges alone, and ours are trusted too.
    picture = pyoidn.denoise(color, albedo=albedo, normal=normal, hdr=True, clean_aux=True)
    return np.asarray(picture), time.perf_counter() - started


def main():
    path, size, reference_spp, folder = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    dr.set_thread_count(THREADS)
    scene = load(path, size)
    passes = [render(scene, 256, seed)[0][0] for seed in range(reference_spp // 256)]
    np.save(f"{folder}/reference.npy", np.mean(passes, axis=0))
    layers, _ = render(scene, 16, SEEDS[0])
    _, tracing = render(scene, 16, SEEDS[1])
    denoised(layers)
    _, denoising = denoised(layers)
    for words in sys.argv[5:]:
        samples = max(1, int((float(words) - denoising) / tracing * 16))
        render(scene, samples, SEEDS[0])
        for seed in SEEDS:
            layers, tracing_s = render(scene, samples, seed)
            picture, denoising_s = denoised(layers)
            np.save(f"{folder}/{words}-{seed}.npy", picture)
            said = {"asked": words, "seed": seed, "seconds": tracing_s + denoising_s, "spp": samples}
            print(json.dumps(said), flush=True)


main()
