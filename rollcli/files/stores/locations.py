"""Names of places: a path on local disk, or a URL of an object store or web server. Import-light."""

import posixpath
import re
from pathlib import Path
from urllib.parse import unquote, urlsplit

from rollcli.errors import UsageError

OBJECT_STORES = ("s3", "gs", "az")
WEB_SERVERS = ("http", "https")
_QUERY = re.compile("[?#]")
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+)://")  # two letters or more: "c:/" is a drive of Windows


def is_url(location: str) -> bool:
    """Return whether a location is a URL rather than a local path."""
    return "://" in location and _SCHEME.match(location) is not None


def is_object_url(location: str) -> bool:
    """Return whether a location is a URL of an object store, whose objects can be listed and written."""
    return is_url(location) and scheme_of(location) in OBJECT_STORES


def is_web_url(location: str) -> bool:
    """Return whether a location is a URL of a web server, which has single files to read."""
    return is_url(location) and scheme_of(location) in WEB_SERVERS


def scheme_of(url: str) -> str:
    """Return the scheme of a URL, lower case.

    Raises
    ------
    UsageError
        rollcli cannot read from or write to places of this scheme.
    """
    match = _SCHEME.match(url)
    scheme = match[1].lower() if match else ""
    if scheme not in OBJECT_STORES + WEB_SERVERS:
        known = ", ".join(f"{each}://" for each in OBJECT_STORES + WEB_SERVERS)
        raise UsageError(f"{public_name(url)}: {scheme}:// is not supported; use {known} or a local path")
    return scheme


def split_url(url: str) -> tuple[str, str]:
    """Return the root of an object store's URL (``s3://bucket``) and the key below it.

    Raises
    ------
    UsageError
        The URL has no bucket, or another scheme.
    """
    scheme = scheme_of(url)
    rest = url[len(scheme) + 3 :]
    bucket, _, key = rest.partition("/")
    if "@" in bucket:
        raise UsageError(f"{public_name(url)}: keys go into the environment, not into a URL")
    if not bucket:
        raise UsageError(f"{public_name(url)}: names no bucket; write {scheme}://bucket/prefix")
    return f"{scheme}://{bucket}", key


def public_name(location: str) -> str:
    """Return a location as messages, rows and records show it: without passwords and signatures."""
    if not is_url(location):
        return location
    scheme, _, rest = location.partition("://")
    if scheme.lower() not in OBJECT_STORES:  # whose keys may hold "?" and "#"
        rest = _QUERY.split(rest, maxsplit=1)[0]
    host, slash, path = rest.partition("/")
    return f"{scheme}://{host.rpartition('@')[2]}{slash}{path}"


def located(root: str, location: str) -> str:
    """Return where a location lies for a worker whose relative paths start at `root`."""
    return location if not root or is_url(location) else str(Path(root, location))


def base_name(location: str) -> str:
    """Return the last part of a location's path."""
    if is_url(location) and scheme_of(location) in WEB_SERVERS:
        return posixpath.basename(unquote(urlsplit(location).path))
    return posixpath.basename(location)
