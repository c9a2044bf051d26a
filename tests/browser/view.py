#!/usr/bin/env python3
"""`fechner view` in a headless Chromium, as its users meet it.

Needs Debian's `chromium` and playwright, of which only the driver is used:

    python3 -m venv venv && venv/bin/pip install playwright
    cargo build --release
    venv/bin/python tests/browser/view.py [--screenshot FILE.png]

Leaves with 0 if every step holds, and says which did not.
"""

import argparse
import contextlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from playwright.sync_api import sync_playwright

ROOT = pathlib.Path(__file__).resolve().parents[2]
FECHNER = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/fechner"
SCENE = ROOT / "scenes/cornell-box.toml"
# Large enough to be watched, and at an end in seconds.
JOB = [str(SCENE), "--size", "96x96", "--visibility", "8"]
# Something that moves, seen from so near that its margins are far from where one looks.
MOVING_JOB = [str(ROOT / "scenes/rolling-ball.toml"), "--size", "80x40", "--visibility", "8", "--display", "near.toml", "--foveated"]
NEAR_DISPLAY = """name = "near"
pixels_per_degree = 5.0
white_cd_m2 = 200.0
black_cd_m2 = 0.2
"""
PATIENCE_S = 120


@contextlib.contextmanager
def preview(folder, job):
    """The address of a preview, ended afterwards."""
    command = [str(FECHNER), "view", *job]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()


class Page:
    """The page, and what a user reads off it."""

    def __init__(self, page):
        self.page = page

    def text(self, name):
        return self.page.inner_text(f"#{name}")

    def number(self, name):
        words = self.text(name).replace("cd/m²", "").split()
        return float(words[0]) if words and words[0] != "–" else None

    def until(self, what, expression):
        """Asks again and again until JavaScript says true: the page's content policy forbids playwright's own waiting."""
        deadline = time.monotonic() + PATIENCE_S
        while not self.page.evaluate(expression):
            if time.monotonic() > deadline:
                raise AssertionError(f"{what} never came; the page says:\n{self.page.evaluate('document.body.innerText')}")
            self.page.wait_for_timeout(50)

    def pixels(self, name="picture"):
        """Bytes of a canvas, RGBA."""
        script = f"""() => {{ const c = document.getElementById({name!r});
            return [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]; }}"""
        return self.page.evaluate(script)

    def brightness(self, name="picture"):
        pixels = self.pixels(name)
        return sum(sum(pixels[channel::4]) for channel in range(3)) / (3 * len(pixels) / 4)

    def place(self, x, y):
        """Where a share of the picture's width and height is on the page."""
        box = self.page.locator("#picture").bounding_box()
        return box["x"] + x * box["width"], box["y"] + y * box["height"]

    def samples_around(self, x, y):
        """Mean over pixels of a field of 16x24, of whose blocks one or another is done early, asked for without a pointer there."""
        counts = []
        for column in range(x - 8, x + 8, 4):
            for row in range(y - 12, y + 12, 4):
                at = f"{column}, {row}"
                self.page.evaluate(f"pointed = {{ x: {column}, y: {row} }}; inspect()")
                self.until("a pixel", f"document.getElementById('at').textContent === {at!r}")
                counts.append(self.number("count"))
        return sum(counts) / len(counts)

    def until_stopped(self):
        self.until("a stop", "document.getElementById('phase').textContent.startsWith('Stopped')")


def saved(page, folder, button, name):
    page.page.click(f"#{button}")
    page.until(f"{name} saved", f"document.getElementById('note').textContent.includes({name!r})")
    return (folder / name).read_bytes()


def steps(page, folder):
    """What must hold, one after the other; a step's name before it is tried."""
    yield "opens and shows a picture that is not black"
    page.until("a picture", "document.getElementById('picture').width === 96")
    assert page.brightness() > 10, page.brightness()

    yield "refines"
    page.until_stopped()
    # What the page says of samples a pixel from a new start on, and what its picture is.
    page.page.evaluate("""() => { window.told_means = []; new MutationObserver(() => told_means.push(Number(
        document.getElementById('mean').textContent))).observe(document.getElementById('mean'), { childList: true }); }""")
    page.page.click("#restart")
    page.until("a new start", "!document.getElementById('phase').textContent.startsWith('Stopped')")
    page.until_stopped()
    means = page.page.evaluate("told_means")
    means = means[means.index(min(means)) :]
    assert len(set(means)) >= 3 and means == sorted(means), means

    yield "stops by itself, and saves the bytes that render writes"
    page.until_stopped()
    assert page.text("share") != "–"
    picture = saved(page, folder, "png", "cornell-box-1.png")
    command = [str(FECHNER), "render", *JOB, "-o", "rendered.png"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    assert picture == (folder / "rendered.png").read_bytes(), "the saved PNG is another than that of render"

    yield "inspects a pixel"
    x, y = page.place(0.5, 0.5)
    page.page.mouse.move(x - 3, y)
    page.page.mouse.move(x, y)
    page.until("a pixel", "document.getElementById('rgb').textContent !== '–'")
    assert page.number("count") >= 16 and page.number("luminance") > 0, page.text("count")
    assert page.number("threshold") > 0 and page.number("visibility") > 0, page.text("threshold")

    yield "shows every layer"
    pictures = set()
    for key in "1234567890":
        legend = page.text("legend")
        page.page.keyboard.press(key)
        if key != "1":
            page.until(f"layer {key}", f"document.getElementById('legend').textContent !== {legend!r}")
        pictures.add(tuple(page.pixels()))
    assert len(pictures) == 10, len(pictures)
    assert page.text("legend") == "nothing moves here", page.text("legend")
    page.page.keyboard.press("1")

    yield "sets a layer beside another, with a divider that moves"
    page.page.keyboard.press("x")
    page.until("the second layer", "document.getElementById('legend-second').textContent !== ''")
    assert page.pixels("second") != page.pixels()
    divider = page.page.locator("#divider").bounding_box()
    page.page.mouse.move(divider["x"] + 6, divider["y"] + 50)
    page.page.mouse.down()
    page.page.mouse.move(*page.place(0.25, 0.5))
    page.page.mouse.up()
    split = float(page.page.evaluate("document.getElementById('frame').style.getPropertyValue('--split')").rstrip("%"))
    assert abs(split - 25) < 2, split
    page.page.locator("#divider").focus()
    for key, value in [("ArrowRight", 27), ("PageUp", 37), ("End", 100), ("Home", 0), ("ArrowLeft", 0)]:
        page.page.keyboard.press(key)
        told = page.page.evaluate("Number(document.getElementById('divider').getAttribute('aria-valuenow'))")
        assert abs(told - value) <= 2, (key, told)
    page.page.keyboard.press("x")
    assert not page.page.is_visible("#second") and not page.page.is_visible("#divider")

    yield "keeps a picture, and sets it beside a later one"
    before = page.pixels()
    page.page.keyboard.press("k")
    page.page.evaluate("send({ do: 'exposure', stops: 1 })")
    page.until("another exposure", "told.exposure === 1")
    page.until_stopped()
    page.page.keyboard.press("x")
    assert page.text("legend-second").startswith("kept at"), page.text("legend-second")
    assert page.pixels("second") == before and page.pixels() != before
    page.page.keyboard.press("x")
    page.page.keyboard.press("4")
    page.until("what can be seen", "document.getElementById('legend').textContent.startsWith('blue')")
    page.page.keyboard.press("k")
    page.page.keyboard.press("1")
    page.page.keyboard.press("x")
    kept = page.page.evaluate("document.getElementById('beside').selectedOptions[0].textContent")
    assert kept == "Kept: Visibility" and "blue: at most " in page.text("legend-second"), (kept, page.text("legend-second"))
    page.page.keyboard.press("x")
    page.page.evaluate("send({ do: 'exposure', stops: 0 })")
    page.until("the first exposure", "told.exposure === 0")
    page.until_stopped()

    yield "tells the exposure that there is, beyond the slider and between its steps"
    for stops, told in [(-14, "-14"), (0.1, "0.1"), (0, "0")]:
        page.page.evaluate(f"send({{ do: 'exposure', stops: {stops} }})")
        page.until("the exposure", f"document.getElementById('stops').textContent === {told!r}")
    page.until_stopped()

    yield "shows the display's own pixels, and keeps what is under the pointer there"
    fitted = page.page.locator("#picture").bounding_box()
    page.page.mouse.move(*page.place(0.25, 0.25))
    there = page.page.evaluate("pointer")
    page.page.keyboard.press("z")
    box = page.page.locator("#picture").bounding_box()
    ratio = page.page.evaluate("devicePixelRatio")
    assert abs(box["width"] * ratio - 96) < 0.5 and fitted["width"] > box["width"], box
    assert all(abs(a - b) < 1 for a, b in zip(page.place(0.25, 0.25), there)), (page.place(0.25, 0.25), there)
    page.page.keyboard.press("z")
    assert page.page.locator("#picture").bounding_box() == fitted

    yield "changes the operator without new samples"
    samples, before = page.number("mean"), page.pixels()
    page.page.select_option("#operator", "ward-larson97")
    page.until("another picture", f"""() => {{ const c = document.getElementById('picture');
        const now = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        return {before}.some((byte, i) => byte !== now[i]); }}""")
    page.until_stopped()
    assert page.number("mean") == samples, (page.number("mean"), samples)

    yield "changes the display and the distance, and the threshold map follows"
    page.page.select_option("#display", "phone")
    page.until("the phone", "document.getElementById('ppd').textContent.startsWith('90 ')")
    page.page.evaluate("""() => { const d = document.getElementById('distance'); d.value = 1;
        d.dispatchEvent(new Event('input')); d.dispatchEvent(new Event('change')); }""")
    page.until("twice as far", "document.getElementById('ppd').textContent.startsWith('180 ')")
    page.until_stopped()

    yield "orbits, and comes home"
    before = page.text("mean")
    page.page.mouse.move(*page.place(0.5, 0.5))
    page.page.mouse.down()
    before_updates = page.page.evaluate("updates")
    for step in range(20):
        page.page.mouse.move(*page.place(0.5 + 0.01 * step, 0.5 - 0.002 * step))
        page.page.wait_for_timeout(20)
    page.until("what the camera sees on its way", f"updates >= {before_updates} + 3")
    page.page.mouse.up()
    page.until("a new picture", "!document.getElementById('phase').textContent.startsWith('Stopped')")
    page.until_stopped()
    assert page.page.evaluate("document.getElementById('picture').width") == 96
    assert page.brightness() > 5
    page.page.click("#home")
    page.until("a new picture", "!document.getElementById('phase').textContent.startsWith('Stopped')")
    page.until_stopped()

    yield "pans and comes nearer by two fingers, and orbits by one"
    script = """() => { window.asked = []; const before = move; move = movement => asked.push(movement);
        const touch = (type, pointerId, clientX, clientY) => stage.dispatchEvent(new PointerEvent(type,
            { pointerId, clientX, clientY, pointerType: "touch", bubbles: true }));
        const capture = stage.setPointerCapture; stage.setPointerCapture = () => {};
        touch("pointerdown", 7, 100, 200); touch("pointerdown", 8, 200, 200);
        touch("pointermove", 8, 300, 200);
        touch("pointerup", 8, 300, 200); touch("pointermove", 7, 140, 200); touch("pointerup", 7, 140, 200);
        move = before; stage.setPointerCapture = capture; return asked; }"""
    pan, dolly, orbit = page.page.evaluate(script)
    assert (pan["by"], dolly["by"], orbit["by"]) == ("pan", "dolly", "orbit"), (pan, dolly, orbit)
    assert pan["right"] < 0 and abs(0.9 ** dolly["steps"] - 0.5) < 1e-6, (pan, dolly)

    yield "orbits, pans and comes nearer by keys"
    script = """() => { window.asked = []; const before = move; move = movement => asked.push(movement);
        for (const [key, shiftKey] of [["ArrowRight", false], ["ArrowUp", true], ["PageUp", false]])
            stage.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey, bubbles: true }));
        document.getElementById("png").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowUp", bubbles: true }));
        move = before; return [stage.getAttribute("aria-label") !== null, ...asked]; }"""
    is_named, orbit, pan, *dolly = page.page.evaluate(script)
    assert is_named and (orbit["by"], pan["by"], [step["by"] for step in dolly]) == ("orbit", "pan", ["dolly"]), (orbit, pan, dolly)
    assert orbit["right"] > 0 and pan["up"] > 0 and dolly[0]["steps"] > 0, (orbit, pan, dolly)

    yield "keeps its keys after a slider and a list, and with caps lock"
    page.page.locator("#target").focus()
    page.page.keyboard.press("2")
    assert page.page.evaluate("sides[0].layer") == 1
    page.page.locator("#operator").focus()
    page.page.evaluate("document.getElementById('operator').dispatchEvent(new Event('change'))")
    page.page.keyboard.press("1")
    assert page.page.evaluate("sides[0].layer") == 0
    page.page.evaluate("""() => { window.asked = []; const before = send; send = message => asked.push(message);
        pointed = { x: 1, y: 1 };
        for (const key of ["F", "A"]) document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
        setTimeout(() => { send = before; window.asked_all = true; }, 200); }""")
    page.until("the keys", "window.asked_all")
    asked = page.page.evaluate("asked.filter(message => message.do !== 'inspect')")
    assert [message["do"] for message in asked] == ["focus", "camera"] and asked[1]["steps"] == 1, asked

    yield "copies the camera where there is no clipboard"
    page.page.evaluate("Object.defineProperty(navigator, 'clipboard', { value: undefined, configurable: true })")
    page.page.click("#copy")
    page.until("a word about it", "document.getElementById('note').textContent.includes('as TOML')")
    selected = page.page.evaluate("[document.activeElement.id, getSelection().toString() || document.activeElement.value]")
    assert selected[0] == "camera" and selected[1].startswith("[camera]"), selected

    yield "zooms, opens the lens and focuses by keys"
    page.page.locator("#stage").focus()
    page.page.mouse.move(*page.place(0.4, 0.7))
    page.page.keyboard.press("a")
    page.until("a lens", "told.camera.includes('aperture_radius')")
    page.until_stopped()
    focus = page.page.evaluate("told.camera")
    page.page.keyboard.press("f")
    page.until("another focus", f"told.camera !== {focus!r}")
    page.page.keyboard.press("+")
    page.until("a longer lens", f"!told.camera.includes({focus.split('vertical_fov_deg')[1].splitlines()[0]!r})")

    yield "pauses and goes on"
    page.page.click("#pause")
    page.until("a pause", "/^(Paused|Stopped)/.test(document.getElementById('phase').textContent)")
    page.page.click("#pause")
    page.until_stopped()


def steps_of_motion_and_gaze(page):
    """The same for a scene that moves, whose viewer's pointer is his gaze."""
    yield "shows what moves"
    page.until("a picture", "document.getElementById('picture').width === 80")
    page.page.keyboard.press("0")
    page.until("motion", "document.getElementById('legend').textContent.includes('pixels in 1/24 s')")
    grey = sum(page.pixels()[i : i + 3] == [127, 127, 127] for i in range(0, 80 * 40 * 4, 4 * 32))
    assert grey < 100, "nothing moves"
    page.page.keyboard.press("1")

    yield "samples where one looks"
    page.page.mouse.move(*page.place(0.5, 0.5))
    page.page.mouse.move(*page.place(0.1, 0.6))
    from_there = "document.getElementById('phase').textContent.includes('from there')"
    page.until("a stop from there", from_there)
    # Nobody has looked elsewhere since this new start.
    page.page.evaluate("send({ do: 'restart' })")
    page.until("a new start", "!document.getElementById('phase').textContent.startsWith('Stopped')")
    page.until("a stop from there", from_there)
    near, far = page.samples_around(8, 24), page.samples_around(72, 24)
    page.page.mouse.move(2, 2)
    page.until("a stop for anybody", "document.getElementById('phase').textContent.endsWith('at this target')")
    far_for_anybody = page.samples_around(72, 24)
    # 40 and 144 when this was written; at a target of 16 they were 32 and 33, too near each other for a test.
    assert far_for_anybody > 1.5 * far, (near, far, far_for_anybody)


def steps_of_a_render(page):
    """The same for a render that is somebody else's."""
    yield "offers its end and nothing else"
    page.until("a picture", "document.getElementById('picture').width === 32")
    enabled = page.page.evaluate("[...document.querySelectorAll('aside :is(button, input, select):enabled')].map(e => e.id)")
    assert enabled == ["stop", "keep", "beside", "copy"], enabled
    page.page.keyboard.press("+")
    page.page.wait_for_timeout(500)
    assert page.text("error") == "", page.text("error")
    page.page.click("#stop")
    page.until("the end", "socket.readyState === 3")
    page.page.wait_for_timeout(1500)
    assert page.text("phase") == "Ended: stopped from this page", page.text("phase")
    assert page.page.evaluate("socket.readyState") == 3, "the page still asks for a render that has ended"


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--screenshot", type=pathlib.Path, help="where a picture of the page goes")
    arguments = arguments.parse_args()
    chromium = shutil.which("chromium") or sys.exit("there is no chromium here: apt-get install chromium")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = pathlib.Path(name)
        (folder / "near.toml").write_text(NEAR_DISPLAY)
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        visit(browser, folder, JOB, lambda page: steps(page, folder), arguments.screenshot)
        visit(browser, folder, MOVING_JOB, steps_of_motion_and_gaze)
        visit_render(browser, folder)
        browser.close()
    print("all steps hold")


def visit(browser, folder, job, steps_of, screenshot=None):
    """Opens a preview of a job and takes the steps; leaves the program at the first that does not hold."""
    with preview(folder, job) as (process, address):
        tab = browser.new_page(viewport={"width": 1180, "height": 760})
        complaints = []
        tab.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.goto(address)
        step = "starts"
        try:
            for step in steps_of(Page(tab)):
                print(f"{step} ...", flush=True)
            assert not complaints, complaints
            assert process.poll() is None, "the server went down"
            if screenshot:
                tab.screenshot(path=screenshot)
        except Exception as error:
            sys.exit(f"FAILED: {step}\n{error}\nthe console says: {complaints}")
        tab.close()


def visit_render(browser, folder):
    """Watches a render that would not end by itself."""
    command = [str(FECHNER), "render", str(SCENE), "--view", "--size", "32x32", "--visibility", "0.01", "-o", "watched.png"]
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)
    try:
        address = next(line for line in process.stderr if "http://" in line).split()[-1]
        tab = browser.new_page()
        tab.goto(address)
        step = "starts"
        try:
            for step in steps_of_a_render(Page(tab)):
                print(f"{step} ...", flush=True)
            process.communicate(timeout=PATIENCE_S)
            assert process.returncode == 0 and (folder / "watched.png").exists()
        except Exception as error:
            sys.exit(f"FAILED: {step}\n{error}")
        tab.close()
    finally:
        process.kill()
        process.wait()


main()
