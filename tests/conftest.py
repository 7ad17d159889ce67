"""What tests of several folders share."""

import shutil

import pytest

from rollcli.parallel.process_setup import limit_blas_threads
from tests.object_store import object_store

limit_blas_threads()  # as every command does; NumPy is not loaded yet

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="session")
def store():
    """The environment that leads to an object store on this machine, which has the bucket `maps`."""
    with object_store() as environment:
        yield environment


@pytest.fixture(scope="module")
def browser():
    """A headless Chromium with a profile of its own."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright, which drives the browser, is not here"
    )
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"no browser is installed ({', '.join(BROWSERS)})")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=found, args=list(FLAGS))
        yield chromium
        chromium.close()
