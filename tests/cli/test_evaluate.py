"""`rollcli evaluate` as a user runs it."""

import sys

import pytest

from tests.run_cli import rollcli, write_maps


@pytest.mark.parametrize("missing", ["plotly", "jinja2", "matplotlib"])
def test_without_the_extra_paper_says_what_to_install_before_any_work(tmp_path, monkeypatch, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    write_maps(tmp_path / "maps", 1)
    refusal = rollcli("evaluate", "paper", "maps", "-o", "out", cwd=tmp_path).refused()
    assert f"needs the extra report: {sys.executable} -m pip install {missing}\n" in refusal
    assert not (tmp_path / "out").exists()
