"""Make the README's picture of the page anew: python -m tests.page_picture

A drive is rendered, in whose middle the rig is turned by a degree; its pairs are matched and estimated. Of
the page the answer, the chart of the roll and one frame's pictures are shown. It needs Chromium.
"""

import shutil
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from rollcli.files.atomic import write_atomic
from tests.conftest import BROWSERS, FLAGS
from tests.run_cli import ROOT, rollcli

PICTURE = ROOT / ".github" / "page.webp"
WIDTH = 1280
_HALF, _SIZE = 40, "480x200"
SHOWN = ("Roll over the frames", "Before and after de-rotation")


def make_page(folder: Path) -> Path:
    """Render, estimate and report a drive in a folder; returns the page."""
    for name, rolls, seed in (("drive", "-0.45:-0.35", "1"), ("after", "0.55:0.65", "2")):
        scene = ["--scene", "street", "--roll", rolls, "--size", _SIZE, "--seed", seed]
        _run("simulate", name, "--frames", str(_HALF), *scene, cwd=folder)
    for side in ("left", "right"):
        for number in range(1, _HALF + 1):
            after = folder / "after" / side / f"frame_{number:04}.png"
            after.rename(folder / "drive" / side / f"frame_{number + _HALF:04}.png")
    _run("estimate", "--left", "drive/left", "--right", "drive/right", "-o", "rolls.csv", cwd=folder)
    _run("report", "rolls.csv", "-o", "page.html", "--title", "Roll of a drive", cwd=folder)
    return folder / "page.html"


def photograph(browser: Any, page: Path) -> bytes:
    """Return the picture of a page, WebP: the parts that are shown, and the first frame of the gallery."""
    tab = browser.new_page(viewport={"width": WIDTH, "height": 900}, color_scheme="light")
    tab.goto(page.as_uri())
    tab.wait_for_selector("#histogram .main-svg")
    tab.evaluate(
        """shown => {
            for (const each of document.querySelectorAll("main section:not(.answer)"))
                if (!shown.includes(each.querySelector("h2").textContent)) each.remove();
            document.querySelectorAll("figure").forEach((each, place) => { if (place) each.remove(); });
            document.querySelectorAll("footer").forEach(each => each.remove());
        }""",
        list(SHOWN),
    )
    pixels = cv2.imdecode(np.frombuffer(tab.screenshot(full_page=True), np.uint8), cv2.IMREAD_COLOR)
    tab.close()
    return cv2.imencode(".webp", pixels, [cv2.IMWRITE_WEBP_QUALITY, 85])[1].tobytes()


def _run(*arguments: str, cwd: Path) -> None:
    done = rollcli(*arguments, "-q", cwd=cwd)
    if done.status:
        raise SystemExit(f"rollcli {' '.join(arguments)}: {done.err}")


if __name__ == "__main__":
    from playwright.sync_api import sync_playwright

    found = next(filter(None, map(shutil.which, BROWSERS)))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=found, args=list(FLAGS))
        write_atomic(PICTURE, photograph(chromium, make_page(Path(folder))))
