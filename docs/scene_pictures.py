"""Draw the README's pictures and the gallery's; those of scenes with a headless Chromium.

`make pictures` runs it; names of scenarios and robots as arguments draw those of the gallery
alone, and `readme` the README's.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from extensions.gallery import at_home
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from playwright.sync_api import sync_playwright

import knotwork as kw
from knotwork.files.documents import resources
from knotwork.view import plot_joints

DOCS = Path(__file__).parent
GALLERY = DOCS / "gallery"
SIZE = (1280, 760)
SMALL = (560, 332)
MOVING = (800, 475)
FRAMES = 66
# Of the duration, where the tool would hide behind its part.
MOMENTS = {"ur10_weld": 0.12, "ur5_machine_door": 0.34, "panda_bookshelf": 0.95, "ur5_belt": 0.52}
# The camera turns about the scene by this [rad], where something hides the arm from the front.
TURNS = {"panda_bookshelf": 2.4}
TURN = """angle => {
    const {camera, controls} = window.viewer;
    camera.position.sub(controls.target).applyAxisAngle(camera.up, angle).add(controls.target);
    controls.update();
}"""
CONTROLS = ".dg, #bar, #shown, #joints { display: none !important; }"
WORDS = "#head, #legend, #labels, #leaders { display: none !important; }"


# What stands in the picture of a whole page; it is kept in the picture, for a test to compare.
WRITTEN = "['head', 'legend'].map((id) => document.getElementById(id).innerText).join('\\n')"


@contextmanager
def scene(tab: Any, plan: kw.Plan, style: str = CONTROLS) -> Iterator[Any]:
    """The scene of a plan in a tab, without its controls; called with a time it gives a picture."""
    with tempfile.TemporaryDirectory() as folder:
        page = plan.view().save(Path(folder) / "scene.html")
        tab.goto(page.as_uri() + "#paused")
        tab.wait_for_function("document.documentElement.dataset.ready === 'true'")
        tab.add_style_tag(content=style)

        def taken(time: float) -> Image.Image:
            tab.evaluate(
                """time => {
                    const slider = document.getElementById("scrub");
                    slider.value = time;
                    slider.dispatchEvent(new Event("input", {bubbles: true}));
                }""",
                time - plan.trajectory.start_time,
            )
            tab.wait_for_timeout(120)
            return Image.open(io.BytesIO(tab.screenshot())).convert("RGB")

        tab.wait_for_timeout(1000)
        yield taken


def draw_readme(tab: Any) -> None:
    """The first look at `ur5_deburring`: as a picture, and moving."""
    plan = kw.plan("ur5_deburring")
    start, end = plan.trajectory.start_time, plan.trajectory.end_time
    with scene(tab, plan) as taken:
        whole, written = taken(8.0), tab.evaluate(WRITTEN)
        words = PngInfo()
        words.add_text("words", written)
        whole.save(DOCS / "scene.png", pnginfo=words)
        times = [start + (end - start) * i / (FRAMES - 1) for i in range(FRAMES)]
        frames = [taken(time).resize(MOVING, Image.Resampling.LANCZOS) for time in times]
    frames[0].save(
        DOCS / "ur5_deburring.webp",
        save_all=True,
        append_images=frames[1:],
        duration=1000 * (end - start) / FRAMES / 2,  # twice as fast as the arm
        loop=0,
        xmp=written.encode(),
        quality=55,
        method=6,
    )


def draw_plot() -> None:
    """The plot of the README's task, by the command that it shows."""
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    (task,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "glue.yaml"
        file.write_text(task, encoding="utf-8")
        command = [sys.executable, "-m", "knotwork", "plot", str(file), "--size", "slide"]
        subprocess.run([*command, "-o", str(DOCS / "glue.png")], check=True)


def draw_gallery(tab: Any, names: list[str]) -> None:
    """A small picture of each scenario, and of each robot at home."""
    GALLERY.mkdir(exist_ok=True)
    for name in resources.names("scenarios"):
        if names and name not in names:
            continue
        plan = kw.plan(name)
        if plan.joints.robot is None:
            _keep(_drawn(plan), name)
            continue
        with scene(tab, plan, CONTROLS + WORDS) as taken:
            tab.evaluate(TURN, TURNS.get(name, 0.0))
            start, end = plan.trajectory.start_time, plan.trajectory.end_time
            _keep(taken(start + MOMENTS.get(name, 0.72) * (end - start)), name)
    for name in kw.robot_names():
        if names and name not in names:
            continue
        with scene(tab, at_home(name), CONTROLS + WORDS) as taken:
            _keep(taken(0.5), f"robot_{name}")


def _drawn(plan: kw.Plan) -> Image.Image:
    """The joints over time, where there is no arm, on white as wide as other pictures."""
    file = io.BytesIO()
    figure = plot_joints(plan, quantities=["position", "velocity"], size="slide")
    figure.savefig(file, format="png", dpi=100)
    plot = Image.open(file).convert("RGB")
    plot.thumbnail(SIZE, Image.Resampling.LANCZOS)
    picture = Image.new("RGB", SIZE, "white")
    picture.paste(plot, ((SIZE[0] - plot.width) // 2, (SIZE[1] - plot.height) // 2))
    return picture


def _keep(picture: Image.Image, name: str) -> None:
    small = picture.resize(SMALL, Image.Resampling.LANCZOS)
    small.save(GALLERY / f"{name}.webp", quality=70, method=6)


def main() -> None:
    """Draw all, or those named."""
    names = sys.argv[1:]
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        if not names or names == ["readme"]:
            draw_readme(tab)
            draw_plot()
        if names != ["readme"]:
            draw_gallery(tab, names)
        browser.close()


if __name__ == "__main__":
    main()
