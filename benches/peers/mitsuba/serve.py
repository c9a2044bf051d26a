"""Mitsuba 3 (llvm_ad_rgb) on a scene that benches/support/peer.rs wrote, rendering when asked.

    python3 serve.py SCENE.json SIZE        (pip install mitsuba numpy; needs an LLVM library, e.g. libllvm15)

Prints `ready`. For each line `SAMPLES SEED THREADS FILE` on standard input it renders, writes the picture to FILE (linear
RGB, 32-bit floats, row-major) and prints CPU seconds and wall seconds. An empty line ends it. The first render with a
number of samples compiles its kernel: ask twice.
"""

import json
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")


def bsdf(surface):
    if "eta" in surface:
        return {
            "type": "conductor",
            "eta": {"type": "rgb", "value": surface["eta"]},
            "k": {"type": "rgb", "value": surface["k"]},
        }
    if "ior" in surface:
        return {"type": "dielectric", "int_ior": surface["ior"], "ext_ior": 1.0}
    diffuse = surface["diffuse"]
    if isinstance(diffuse, str):
        reflectance = {"type": "bitmap", "filename": diffuse, "filter_type": "bilinear", "wrap_mode": "repeat"}
    else:
        reflectance = {"type": "rgb", "value": diffuse}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}


def shape(description):
    if "ply" in description:
        made = {"type": "ply", "filename": description["ply"], "face_normals": True}
    else:
        made = {"type": "sphere", "center": description["center"], "radius": description["radius"]}
    made["bsdf"] = bsdf(description["material"]["surface"])
    emission = description["material"]["emission"]
    if any(emission):
        made["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": emission}}
    return made


def load(path, size):
    with open(path, encoding="utf-8") as file:
        description = json.load(file)
    scene = {
        "type": "scene",
        # Roulette begins after the fourth scattering event, as ours does.
        "integrator": {"type": "path", "max_depth": description["max_depth"], "rr_depth": 4},
        "sensor": {
            "type": "perspective",
            "fov": description["vertical_fov_deg"],
            "fov_axis": "y",
            "near_clip": 1e-3,
            "to_world": mi.ScalarTransform4f().look_at(
                origin=description["origin"], target=description["target"], up=description["up"]
            ),
            "film": {
                "type": "hdrfilm",
                "width": size,
                "height": size,
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent"},
        },
    }
    for number, described in enumerate(description["shapes"]):
        scene[f"shape_{number}"] = shape(described)
    return mi.load_dict(scene)


def main():
    scene = load(sys.argv[1], int(sys.argv[2]))
    print("ready", flush=True)
    for line in sys.stdin:
        words = line.split()
        if not words:
            break
        samples, seed, threads = map(int, words[:3])
        dr.set_thread_count(threads)
        cpu, wall = time.process_time(), time.perf_counter()
        image = mi.render(scene, spp=samples, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        np.asarray(image, dtype=np.float32).tofile(words[3])
        print(f"{cpu:.6f} {wall:.6f}", flush=True)


main()
