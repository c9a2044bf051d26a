"""Reads those of our scenes that are rectangles, boxes and spheres of diffuse and clear materials, for renderers that do not
know our files."""

import math
import tomllib

import numpy as np


def read(path):
    """Camera, parallelograms (corner and two edges, front side along their cross product) and spheres, each with its material."""
    with open(path, "rb") as file:
        scene = tomllib.load(file)
    parallelograms, spheres = [], []
    for thing in scene["objects"]:
        material = scene["materials"][thing["material"]]
        to_world = transform(thing.get("transform", []))
        if "sphere" in thing and not thing.get("transform"):
            spheres.append({**thing["sphere"], "material": material})
            continue
        if "rectangle" in thing:
            sides = [[thing["rectangle"][key] for key in ("corner", "edge_u", "edge_v")]]
        elif "box" in thing:
            sides = sides_of(np.array(thing["box"]["min"], float), np.array(thing["box"]["max"], float))
        else:
            raise SystemExit(f"{path}: object {thing['name']!r} is neither rectangle nor box nor a sphere at its place")
        for corner, edge_u, edge_v in sides:
            placed = [to_world @ [*corner, 1], to_world @ [*edge_u, 0], to_world @ [*edge_v, 0]]
            corner, edge_u, edge_v = (vector[:3].tolist() for vector in placed)
            parallelograms.append({"corner": corner, "edge_u": edge_u, "edge_v": edge_v, "material": material})
    return {
        "nits_per_unit": scene["nits_per_unit"],
        "camera": scene["camera"],
        "parallelograms": parallelograms,
        "spheres": spheres,
    }


def transform(steps):
    matrix = np.eye(4)
    for step in steps:
        applied = np.eye(4)
        if "translate" in step:
            applied[:3, 3] = step["translate"]
        elif step.get("axis") == [0, 1, 0]:
            angle = math.radians(step["rotate_deg"])
            applied[0, 0] = applied[2, 2] = math.cos(angle)
            applied[0, 2], applied[2, 0] = math.sin(angle), -math.sin(angle)
        else:
            raise SystemExit(f"transform {step} is not known here")
        matrix = applied @ matrix
    return matrix


def sides_of(least, most):
    """Six sides that look outwards."""
    sides = []
    for axis in range(3):
        u, v = np.zeros(3), np.zeros(3)
        u[(axis + 1) % 3] = (most - least)[(axis + 1) % 3]
        v[(axis + 2) % 3] = (most - least)[(axis + 2) % 3]
        far = least.copy()
        far[axis] = most[axis]
        sides += [[far, u, v], [least, v, u]]
    return sides
