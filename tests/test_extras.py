"""What is said where an extra is missing."""

import sys

import pytest

from rollcli.errors import UsageError
from rollcli.extras import require_extra


def test_only_the_packages_that_are_missing_are_to_be_installed(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly", None)
    with pytest.raises(UsageError) as caught:
        require_extra("report", "the page")
    assert str(caught.value) == (f"the page needs the extra report: {sys.executable} -m pip install plotly")


def test_a_program_that_pipx_installed_is_extended_by_pipx(monkeypatch, tmp_path):
    (tmp_path / "pipx_metadata.json").write_text("{}")
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    for name in ("dask", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UsageError, match=r"the extra cluster: pipx inject rollcli dask distributed$"):
        require_extra("cluster", "--scheduler")
