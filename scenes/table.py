"""What is in each scene of this folder: the table of scenes/README.md.

    python3 scenes/table.py        # Python 3.11 or later, nothing to install

Triangles are those of the files: a rectangle is 2, a box 12, a disk 128, a polygon of n corners n - 2. Spheres are exact, no triangles.
Lamps are objects whose material shines and entries of [[lights]].
"""

import pathlib
import tomllib

FOLDER = pathlib.Path(__file__).parent
TRIANGLES = {"rectangle": 2, "box": 12, "disk": 128, "sphere": 0}


def mesh_triangles(path):
    with open(path, encoding="utf-8") as lines:
        return sum(len(line.split()) - 3 for line in lines if line.startswith("f "))


def triangles(thing):
    for shape, count in TRIANGLES.items():
        if shape in thing:
            return count
    return mesh_triangles(FOLDER / thing["mesh"])


def shines(material):
    return any(key.startswith(("emission", "power_lm")) for keys in [material, *material.get("keyframes", [])] for key in keys)


def surroundings(scene):
    environment = scene.get("environment", {})
    if "sky" in environment:
        return "sky and sun" if environment["sky"].get("sun", True) else "sky"
    if "image" in environment:
        return f"`{environment['image']}`"
    return "even light" if environment else "none"


def row(path):
    scene = tomllib.loads(path.read_text(encoding="utf-8"))
    objects, materials = scene["objects"], scene.get("materials", {})
    lamps = sum(shines(materials.get(thing.get("material"), {})) for thing in objects) + len(scene.get("lights", []))
    spheres = sum("sphere" in thing for thing in objects)
    size = "×".join(str(side) for side in scene.get("film", {}).get("size", [512, 512]))
    return f"| `{path.name}` | {size} | {sum(map(triangles, objects)):,} | {spheres} | {lamps} | {surroundings(scene)} |"


print("| scene | size | triangles | spheres | lamps | surroundings |\n| --- | --- | --- | --- | --- | --- |")
for scene_file in sorted(FOLDER.glob("*.toml")):
    print(row(scene_file))
