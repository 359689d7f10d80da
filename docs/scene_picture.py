"""Draw `docs/scene.png`: the first look at the scene of `ur5_deburring`, by a headless Chromium."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import knotwork as kw

OUTPUT = Path(__file__).parent / "scene.png"


def main() -> None:
    """Plan the scenario, write its page, and take a picture of it half way along the edge."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        page = kw.plan("ur5_deburring").view().save(Path(folder) / "scene.html")
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 1280, "height": 760})
        tab.goto(page.as_uri() + "#t=8")
        tab.wait_for_function("document.documentElement.dataset.ready === 'true'")
        tab.add_style_tag(content=".dg, #bar, #shown { display: none !important; }")
        tab.wait_for_timeout(1000)
        tab.screenshot(path=OUTPUT)
        browser.close()


if __name__ == "__main__":
    main()
