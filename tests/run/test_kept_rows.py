"""What a resume knows of the rows that an interrupted run has left."""

import sys

import pytest

from rollcli.files.results import Row
from rollcli.run.frame import Frame
from rollcli.run.options import ImageOptions, ResultOptions
from rollcli.run.plan import Plan
from rollcli.run.resume import KeptRows, Mismatch
from tests.run.estimate_options import estimate_options

NAMES = ("a.png", "b.png", "c.png")


def frame(name):
    return Frame(file=name, right_file="", path=name, right_path="", relative=name, mask=None)


@pytest.fixture
def take(tmp_path):
    """Take in rows of some files, each `name` or `name status`."""

    def kept(*rows, retry=False, images=False):
        options = estimate_options(
            images=ImageOptions(derotated=str(tmp_path)) if images else ImageOptions(),
            result=ResultOptions(resume=True, retry_failed=retry),
        )
        plan = Plan([frame(name) for name in NAMES], str(tmp_path / "rolls.csv"), "csv")
        parts = [(*each.split(), "ok")[:2] for each in rows]
        return KeptRows(plan, options, [Row(name, status=status) for name, status in parts])

    return kept


def test_it_counts_and_holds_no_row(take):
    kept = take("a.png", "b.png error")
    row = Row("c.png", status="suspect")
    before = sys.getrefcount(row)
    kept.add(row)
    assert sys.getrefcount(row) == before
    assert (kept.count, kept.errors, kept.again) == (3, [1], [])
    assert kept.summary.counts == {"ok": 1, "suspect": 1, "error": 1}
    assert kept.mismatch is None


def test_failed_frames_that_are_done_again_are_not_counted(take):
    kept = take("a.png error", "b.png", "c.png error", retry=True)
    assert kept.again == [0, 2]
    assert kept.summary.counts == {"ok": 1}
    assert kept.count == 3


def test_the_first_row_of_another_frame_is_kept_in_mind(take):
    assert take("a.png", "x.png", "y.png").mismatch == Mismatch("x.png", "b.png", frame_is_new=True)
    assert take("a.png", "c.png", "b.png").mismatch == Mismatch("c.png", "b.png", frame_is_new=False)
    assert take("a.png", "b.png", "c.png", "d.png").mismatch is None


def test_frames_without_their_images_are_incomplete_but_failed_ones_have_none(take, tmp_path):
    (tmp_path / "a.png").write_bytes(b"an image")
    (tmp_path / "b.png").write_bytes(b"")
    assert [each.file for each in take("a.png", "b.png", "c.png", images=True).incomplete] == [
        "b.png",
        "c.png",
    ]
    assert [each.file for each in take("a.png", "b.png error", images=True).incomplete] == []
    assert take("b.png").incomplete == []
