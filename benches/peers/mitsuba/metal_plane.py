#!/usr/bin/env python3
"""How much of a rough metal's light, away from the highlight, is our lobe of missing energy?

A plane seen at a cosine of 0.21 and lit from one at 0.43, by the sun and by a small sphere, in our Mitsuba reader and in
Mitsuba 3, which follows one bounce off the facets only. Prints reflected radiance · π / irradiance, so that a white diffuse
plane is 1. No statistics: every pixel of such a picture has one value but for the width of the lamp.

    python3 -m venv venv && venv/bin/pip install mitsuba numpy
    cargo build --release
    venv/bin/python benches/peers/mitsuba/metal_plane.py
"""

import math
import pathlib
import subprocess
import tempfile

import mitsuba
import numpy as np

mitsuba.set_variant("llvm_ad_rgb")

ROOT = pathlib.Path(__file__).resolve().parents[3]
SEEN_AT, LIT_AT = 0.21, 0.43
LAMP_ANGLE = 0.05  # sine of the sphere's angular radius

SCENE = """<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><float name="fov" value="0.2"/>
<transform name="to_world"><lookat origin="{eye}" target="0,0,0" up="0,0,1"/></transform>
<sampler type="independent"><integer name="sample_count" value="256"/></sampler>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>
{lamp}
<shape type="rectangle"><transform name="to_world"><scale value="50"/></transform>{surface}</shape></scene>"""

SUN = """<emitter type="directional"><vector name="direction" x="{0}" y="{1}" z="{2}"/>
<rgb name="irradiance" value="1,1,1"/></emitter>"""
SPHERE = """<shape type="sphere"><point name="center" x="{0}" y="{1}" z="{2}"/><float name="radius" value="5"/>
<emitter type="area"><rgb name="radiance" value="1,1,1"/></emitter></shape>"""
DIFFUSE = """<bsdf type="diffuse"><rgb name="reflectance" value="0.5,0.5,0.5"/></bsdf>"""
METAL = """<bsdf type="roughconductor"><string name="material" value="none"/>
<string name="distribution" value="{0}"/><float name="alpha" value="{1}"/></bsdf>"""

SURFACES = {
    "diffuse 0.5": DIFFUSE,
    "GGX 0.1": METAL.format("ggx", 0.1),
    "GGX 0.3": METAL.format("ggx", 0.3),
    "Beckmann 0.1": METAL.format("beckmann", 0.1),
}


def direction(cosine, azimuth_degrees):
    sine, azimuth = math.sqrt(1 - cosine * cosine), math.radians(azimuth_degrees)
    return sine * math.cos(azimuth), sine * math.sin(azimuth), cosine


def lamp(kind, azimuth_degrees):
    """The lamp, and its irradiance of the plane."""
    to_lamp = direction(LIT_AT, azimuth_degrees)
    if kind == "sun":
        return SUN.format(*(-x for x in to_lamp)), LIT_AT
    return SPHERE.format(*(100 * x for x in to_lamp)), LIT_AT * math.pi * LAMP_ANGLE**2


def ours(scene, folder):
    source, target = folder / "plane.xml", folder / "plane.exr"
    source.write_text(scene)
    command = [ROOT / "target/release/fechner", "render", source, "-o", target, "--sampling", "uniform", "--spp", "256"]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    picture = dict(mitsuba.Bitmap(str(target)).split())["<root>"]
    return np.array(picture)[..., :3].mean()


def main():
    eye = ",".join(str(10 * x) for x in direction(SEEN_AT, 0))
    print("| surface | lamp | azimuth from the eye | fechner | Mitsuba | ours less theirs |\n| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for name, surface in SURFACES.items():
            for kind in ["sun", "sphere"]:
                for azimuth in [0, 90, 150]:
                    element, irradiance = lamp(kind, azimuth)
                    scene = SCENE.format(eye=eye, lamp=element, surface=surface)
                    theirs = np.array(mitsuba.render(mitsuba.load_string(scene))).mean()
                    both = [value * math.pi / irradiance for value in (ours(scene, pathlib.Path(folder)), theirs)]
                    print(f"| {name} | {kind} | {azimuth}° | {both[0]:.4f} | {both[1]:.4f} | {both[0] - both[1]:.4f} |")


main()
