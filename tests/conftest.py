"""What tests of several folders share."""

import contextlib
import functools
import os
import shutil

import hypothesis
import pytest

from rollcli.run.workers.pool import limit_blas_threads
from tests.object_store import object_store

limit_blas_threads()  # as every command does; NumPy is not loaded yet
hypothesis.settings.register_profile("untimed", deadline=None)  # no test fails on a busy machine
hypothesis.settings.load_profile("untimed")

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


@pytest.fixture
def bucket(store, tmp_path, monkeypatch):
    """A prefix of this test's own in the store's bucket, which this process and those it starts may use."""
    for name, value in store.items():
        monkeypatch.setenv(name, value)
    return f"s3://maps/{tmp_path.name}"


@pytest.fixture
def maps(tmp_path, request):
    """A folder with as many maps in `maps` as the module's FRAMES says."""
    from tests.run_cli import write_maps  # here: it loads NumPy

    write_maps(tmp_path / "maps", request.module.FRAMES)
    return tmp_path


@pytest.fixture
def synced(monkeypatch):
    """What was forced to the disk, in order: (inode, size at that time)."""
    calls, fsync = [], os.fsync

    def watch(descriptor):
        fsync(descriptor)
        status = os.fstat(descriptor)
        calls.append((status.st_ino, status.st_size))

    monkeypatch.setattr(os, "fsync", watch)
    return calls


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


@pytest.fixture
def open_page(browser):
    """Opens a page; a message on the console, a dialog or a request for anything outside of it fails."""
    with _pages(browser) as opened:
        yield opened


@pytest.fixture(scope="module")
def open_page_once(browser):
    """The same for tests that only look: asked for the same again, it returns the page that is open."""
    with _pages(browser) as opened:
        yield functools.cache(opened)


@contextlib.contextmanager
def _pages(browser):
    complaints = []
    with contextlib.ExitStack() as stack:

        def opened(url, width=1280, scheme="light", expected=complaints, script=""):
            context = browser.new_context(
                viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True
            )
            stack.callback(context.close)
            page = context.new_page()
            page.add_init_script(script)
            page.on("console", lambda message: expected.append(message.text))
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("dialog", lambda dialog: complaints.append(dialog.message))
            page.on("request", lambda request: complaints.extend(_outside(request.url, url)))
            page.goto(url)
            return page

        yield opened
    assert complaints == []


def _outside(requested, url):
    inside = requested.partition("#")[0] == url.partition("#")[0]
    return [] if inside or requested.startswith(("data:", "blob:")) else [requested]
