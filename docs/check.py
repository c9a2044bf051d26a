"""Do the documents hold what they promise?

    python3 docs/check.py                          # every relative link of every Markdown file leads to a file and, after #, to a heading,
                                                   # no paragraph or heading stands in a file twice, and no comment is too wide
    python3 docs/check.py target/release/fechner   # and every example of docs/commands.md runs, in a copy of the scenes: a minute and a half

Nothing to install. Exit status 1 names what does not hold.
"""

import collections
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parent.parent
CODE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
# What `fechner view` would wait for is somebody who ends it.
SECONDS_OF_A_VIEW = 6
# Columns of a line: rustfmt.toml's max_width.
WIDTH = 120


def documents():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / name for name in listed.stdout.splitlines()]


def anchors(document):
    """What GitHub makes of headings."""
    headings = re.findall(r"^#+ (.*)$", CODE.sub("", document.read_text(encoding="utf-8")), re.MULTILINE)
    plain = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower() for heading in headings)
    return {"".join(c for c in heading if c.isalnum() or c in " -_").replace(" ", "-") for heading in plain}


def broken_links():
    for document in documents():
        for link in re.findall(r"\]\(([^)\s]+)\)", CODE.sub("", document.read_text(encoding="utf-8"))):
            if re.match(r"[a-z]+:", link):
                continue
            name, _, anchor = link.partition("#")
            target = document.parent / name if name else document
            if not target.exists():
                yield f"{document.relative_to(ROOT)}: {link}: no such file"
            elif anchor and anchor not in anchors(target):
                yield f"{document.relative_to(ROOT)}: {link}: no such heading"


def repeated():
    """Paragraphs and headings that a file has twice. An entry of a list or a table may say no more than another."""
    for document in documents():
        prose = CODE.sub("", document.read_text(encoding="utf-8"))
        blocks = [block.strip() for block in re.split(r"\n\s*\n", prose)]
        titles = [block for block in blocks if block.startswith("## ")]
        paragraphs = [block for block in blocks if len(block) > 80 and not block.startswith(("#", "-", "|"))]
        for block, times in collections.Counter(titles + paragraphs).items():
            if times > 1:
                yield f"{document.relative_to(ROOT)}: {block.splitlines()[0]}: stands there {times} times"


def wide_comments():
    """Comments of Rust that are wider than the code may be, which no formatter breaks; tables apart."""
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.rs"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(lambda name: (ROOT / name).exists(), listed.stdout.splitlines()):
        for number, line in enumerate((ROOT / name).read_text(encoding="utf-8").splitlines(), 1):
            if len(line) > WIDTH and re.match(r"\s*//[/!]? (?!\|)", line):
                yield f"{name}:{number}: a comment of {len(line)} columns; break it at {WIDTH}"


def fields(figures):
    """Names of a JSON object's fields, and of the objects in it."""
    if isinstance(figures, list):
        figures = {"": figures[0]} if figures and isinstance(figures[0], dict) else {}
    for name, value in figures.items():
        if name:
            yield name
        if isinstance(value, (dict, list)):
            yield from fields(value)


def unexplained_fields(folder):
    """Fields of the JSON files that the examples wrote which docs/figures.md does not name."""
    text = (ROOT / "docs/figures.md").read_text(encoding="utf-8")
    named = {word for words in re.findall(r"`([a-z0-9_.]+)`", text) for word in words.split(".")}
    for file in ("out/cornell.json", "out/denoised.json", "out/difference.json", "out/apart.json", "out/ball.json"):
        for field in sorted(set(fields(json.loads((folder / file).read_text(encoding="utf-8"))))):
            if field not in named:
                yield f"{file}: {field} is not in docs/figures.md"


def examples():
    text = (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        if "<<" in block:
            yield block
        else:
            yield from (line for line in block.splitlines() if re.match(r"(fechner|mkdir|printf) ", line))


def failing_examples(program):
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "scenes", pathlib.Path(folder) / "scenes")
        programs = pathlib.Path(folder) / "bin"
        programs.mkdir()
        (programs / "fechner").symlink_to(pathlib.Path(program).resolve())
        environment = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}"}
        for command in examples():
            watched = command.startswith("fechner view ")
            limited = f"timeout --signal=INT --preserve-status {SECONDS_OF_A_VIEW} {command}" if watched else command
            done = subprocess.run(["bash", "-c", limited], cwd=folder, env=environment, capture_output=True, text=True)
            print(f"{done.returncode}  {command.splitlines()[0]}", flush=True)
            # 1 is an answer of `compare`: a difference can be seen.
            if done.returncode not in ((0, 1) if command.startswith("fechner compare ") else (0,)):
                yield f"docs/commands.md: exit status {done.returncode}: {command}\n{done.stderr.strip()}"
        yield from unexplained_fields(pathlib.Path(folder))


def main():
    problems = [*broken_links(), *repeated(), *wide_comments()]
    if len(sys.argv) > 1:
        problems += failing_examples(sys.argv[1])
    print("\n".join(problems) or "the documents hold")
    sys.exit(bool(problems))


if __name__ == "__main__":
    main()
