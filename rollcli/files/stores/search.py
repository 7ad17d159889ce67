"""Which objects lie behind one URL: all below a prefix, or those that match a pattern."""

import fnmatch
import glob
import posixpath
import re
from collections.abc import Iterator, Sequence

from rollcli.files.existence import is_folder
from rollcli.files.stores.locations import OBJECT_STORES, is_url, scheme_of, split_url
from rollcli.files.stores.objects import list_objects

_MAGIC = re.compile(r"[*?[]")


def is_folder_url(url: str) -> bool:
    """Return whether a URL names a prefix: it ends at a slash or a bucket, or its last part has no ending."""
    if scheme_of(url) not in OBJECT_STORES:
        return False
    key = split_url(url)[1]
    return key in ("", "/") or key.endswith("/") or posixpath.splitext(key)[1] == ""


def is_place(location: str) -> bool:
    """Tell whether a location holds files: a local folder, or what `is_folder_url` takes for one."""
    return is_folder_url(location) if is_url(location) else is_folder(location)


def objects_behind(url: str, *, recursive: bool) -> Iterator[tuple[str, str]]:
    """Yield the URL of each object behind a URL, and its path below the prefix or pattern.

    Hidden objects and those in hidden folders are left out, as they are on disk.

    Parameters
    ----------
    url : str
        A prefix or a pattern.
    recursive : bool
        Whether to search the folders below a prefix, too.
    """
    if glob.has_magic(url):
        yield from _matching(url)
        return
    base = url.rstrip("/") + "/"
    for found, _ in list_objects(base):
        relative = found.removeprefix(base)
        if found.startswith(base) and (recursive or "/" not in relative) and not _hidden(relative):
            yield found, relative


def _matching(pattern: str) -> Iterator[tuple[str, str]]:
    base = pattern[: pattern.rindex("/", 0, _MAGIC.search(pattern).start()) + 1]  # type: ignore[union-attr]
    wanted = pattern.removeprefix(base).split("/")
    for found, _ in list_objects(base):
        relative = found.removeprefix(base)
        if _fits(relative.split("/"), wanted) and not _hidden(relative):
            yield found, relative


def _fits(names: Sequence[str], patterns: Sequence[str]) -> bool:
    """Return whether a path fits a pattern, folder by folder; ``**`` stands for any number of folders."""
    if not patterns:
        return not names
    if patterns[0] == "**":
        return any(_fits(names[start:], patterns[1:]) for start in range(len(names) + 1))
    return bool(names) and fnmatch.fnmatchcase(names[0], patterns[0]) and _fits(names[1:], patterns[1:])


def _hidden(relative: str) -> bool:
    return any(part.startswith(".") for part in relative.split("/"))
