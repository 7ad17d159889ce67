"""The description that package indexes show; everything else of the package is in pyproject.toml."""

import re
import sys
from pathlib import Path

from setuptools import setup

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).resolve().parent
_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:)([^)]*)\)")


def description(readme: str, source: str) -> str:
    """Return the README for a page where relative links lead nowhere.

    Parameters
    ----------
    readme : str
        Markdown.
    source : str
        URL that relative links start from; where it is empty, links become their text, and pictures with
        their captions are left out.
    """
    if source:
        return _LINK.sub(lambda link: _absolute(link, source.rstrip("/")), readme)
    without = re.sub(
        r"^!\[[^\]]*\]\((?![a-z]+:)[^)]*\)\n+(\*.*?\*\n(?=\n|[A-Z]))?", "", readme, flags=re.M | re.S
    )
    return _LINK.sub(lambda link: link[2], without)


def _absolute(link: re.Match[str], source: str) -> str:
    picture, text, target = link.groups()
    if target.startswith("#"):
        return str(link[0])
    return f"{picture}[{text}]({source}/{target}{'?raw=true' if picture else ''})"


if __name__ == "__main__":
    urls = tomllib.loads((HERE / "pyproject.toml").read_text("utf-8"))["project"].get("urls", {})
    setup(
        long_description=description((HERE / "README.md").read_text("utf-8"), urls.get("Source", "")),
        long_description_content_type="text/markdown",
    )
