"""Frames inside of one file: members of archives, and the names that frames of recordings have.

A frame inside of a file is a path like any other, ``run.zip#maps/a.png``. Where it lies may stand
behind, for a worker that reads it: ``run.tar#maps/a.png#@512+9000``; rows and lists leave that out (`shown`).
Import-light.
"""

import os
import posixpath
import re
import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rollcli.errors import InputError, UsageError, reading
from rollcli.files.atomic import is_file, is_folder
from rollcli.files.bounded import most_unpacked, state_of, too_large
from rollcli.files.naming import natural_key, split_position
from rollcli.files.stores.locations import base_name, is_url, require_local

if TYPE_CHECKING:
    from numpy.typing import NDArray

ARCHIVES = (".zip", ".tar")
BAGS = (".bag", ".db3", ".mcap")
VIDEOS = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm")
_PACKED = (".tar.gz", ".tgz", ".tar.xz", ".tar.bz2", ".tar.zst", ".7z", ".rar")
_KINDS = "|".join(each[1:] for each in (*ARCHIVES, *BAGS, *VIDEOS))
_INSIDE = re.compile(rf"(.*?\.(?:{_KINDS}))#(.*)", re.IGNORECASE | re.DOTALL)
_MOST_LINKS = 40  # as many as Linux follows


def split_member(location: str) -> tuple[str, str] | None:
    """Return the file that a frame lies in, and its name there; None for a file of its own."""
    if "#" not in location or is_url(location):
        return None
    found = _INSIDE.fullmatch(location)
    if found is None or os.path.lexists(location):  # a file may have any name
        return None
    return found[1], found[2]


def file_of(location: str) -> str:
    """Return the file on disk, or the URL, that holds a frame."""
    member = split_member(location)
    return location if member is None else member[0]


def shown(location: str) -> str:
    """Return a location without where its frame lies in the file."""
    return split_position(location)[0]


def frame_name(name: str) -> str:
    """Return the name of a frame below its archive, or of a map of one of a recording; others as they are."""
    found = _INSIDE.fullmatch(name) if "#" in name else None
    if found is None:
        return name
    if found[1].lower().endswith((*BAGS, *VIDEOS)):
        stem = posixpath.splitext(posixpath.basename(found[1].replace(os.sep, "/")))[0]
        ending = "png" if "/compressed" in found[2] else "npy"
        return f"{stem}_{found[2].rpartition('@')[2].replace('.', '_')}.{ending}"
    return found[2].replace("\\", "/")  # as programs for Windows write it in archives


def is_archive(location: str) -> bool:
    """Tell whether this names an archive, which is read as a folder."""
    return location.lower().endswith(ARCHIVES) and not is_url(location)


def is_video(location: str) -> bool:
    """Tell whether this names a video, not one of its frames."""
    return location.lower().endswith(VIDEOS)


def is_rest(location: str) -> bool:
    """Tell whether this names what is broken behind the frames of a recording, not one of them."""
    inside = split_member(location)
    return inside is not None and inside[1] == "rest" and inside[0].lower().endswith((*BAGS, *VIDEOS))


def has_doffs(location: str) -> bool:
    """Tell whether a frame is a DisparityImage of a bag, which has the offset of its calibration already."""
    inside = split_member(location)
    if inside is None or not inside[0].lower().endswith(BAGS):
        return False
    from rollcli.files.recordings.frames import is_disparity_image

    return is_disparity_image(*inside)


def bag_files(location: str) -> list[str]:
    """List the files of a bag: itself, or those of a rosbag2 folder in order; none where this is no bag.

    Raises
    ------
    UsageError
        They are compressed as whole files, or in a store.
    """
    files = [location]
    if is_folder(location):
        # a recorder that is killed writes no metadata.yaml beside DRIVE/DRIVE_0.mcap
        first = f"{Path(os.path.abspath(location)).name}_0"  # noqa: PTH100
        marks = ("metadata.yaml", f"{first}.mcap", f"{first}.db3")
        is_bag = any(is_file(f"{location}/{each}") for each in marks)
        names = sorted(os.listdir(location), key=natural_key) if is_bag else []  # noqa: PTH208
        files = [f"{location.rstrip('/')}/{name}" for name in names]
    if packed := next((each for each in files if each.lower().endswith((".db3.zstd", ".mcap.zstd"))), None):
        raise UsageError(f"{packed}: is compressed as a whole; unpack it by zstd -d")
    found = [each for each in files if each.lower().endswith(BAGS)]
    if found:
        require_local(location)
    return found


def refuse_others(location: str) -> None:
    """Refuse a bag outside of INPUTS, and an archive whose members cannot be read one by one.

    Raises
    ------
    UsageError
    """
    if location.lower().endswith(BAGS):
        hint = "name it among INPUTS, not in a list; its views by --left-topic and --right-topic alone"
        raise UsageError(f"{location}: is a bag: {hint}")
    if is_archive(base_name(location)):
        require_local(location, "archives are read from local disk: download it first")
    if location.lower().endswith(_PACKED):
        hint = "unpack it, or pack it as .zip or .tar"
        raise UsageError(f"{location}: its members cannot be read one by one; {hint}")


def members(path: str) -> Iterator[tuple[str, str]]:
    """Yield the location of each regular file in an archive, and its name there; not of hidden ones.

    Raises
    ------
    InputError
        It is damaged, or cannot be read.
    """
    if path.lower().endswith(".tar"):
        found = _tar_members(path)
    else:
        found = ((each.filename, "") for each in _zip(path).infolist() if not each.is_dir())
    for name, position in found:
        below = name.replace("\\", "/").removeprefix("./")
        if not any(part.startswith((".", "__MACOSX")) and part.strip(".") for part in below.split("/")):
            yield f"{path}#{name}{position}", below


def _tar_members(path: str) -> Iterator[tuple[str, str]]:
    """Yield what unpacking would give: of members of one name the last, and links as what they lead to."""
    found: dict[str, str] = {}
    links: dict[str, str] = {}
    try:
        with reading(path), tarfile.open(path, "r:") as archive:
            for each in archive:
                archive.members = []  # type: ignore[attr-defined]  # a shard may have a million of them
                name = each.name.removeprefix("./")
                found.pop(name, None)
                links.pop(name, None)
                if each.isreg() and not each.issparse():
                    found[name] = f"#@{each.offset_data}+{each.size}"
                elif each.islnk():
                    links[name] = each.linkname.removeprefix("./")
                elif each.issym():
                    links[name] = posixpath.normpath(posixpath.join(posixpath.dirname(name), each.linkname))
        yield from found.items()
        for name in links:
            target, hops = name, 0
            while target in links and hops < _MOST_LINKS:
                target, hops = links[target], hops + 1
            if target in found:
                yield name, found[target]
    except (tarfile.TarError, ValueError, EOFError) as error:
        raise InputError(f"{path}: is a damaged archive: {str(error) or 'it ends too early'}") from None


def read_member(location: str, name: str, most: int) -> "bytes | NDArray[Any] | None":
    """Return the bytes of an archive's member, the pixels of a recording's frame (see `recordings`).

    None: the location is a file of its own.

    Raises
    ------
    InputError
        It is not there, damaged, encrypted, or too large: beyond `most`, or for its packed bytes.
    """
    inside = split_member(location)
    if inside is None:
        return None
    path, member = inside
    with reading(name):
        if path.lower().endswith(".tar"):
            return _read_tar(path, member, name, most)
        if path.lower().endswith(BAGS):
            from rollcli.files.recordings.frames import read_frame

            return read_frame(path, member, name)
        if path.lower().endswith(VIDEOS):
            from rollcli.files.recordings.video import read_video_frame

            return read_video_frame(path, member, name)
        return _read_zip(path, member, name, most)


def _read_tar(path: str, member: str, name: str, most: int) -> bytes:
    position = split_position(member)[1] or split_position(dict(_tar_members(path)).get(member, ""))[1]
    if not position:
        raise InputError(f"{name}: no such file in {path}")
    start, size = position
    if size > most:
        raise too_large(name, size, most)
    with Path(path).open("rb") as file:
        file.seek(start)
        data = file.read(size)
    if len(data) < size:
        raise InputError(f"{name}: is truncated: {size} bytes lie in {path}, {len(data)} are there")
    return data


def _read_zip(path: str, member: str, name: str, most: int) -> bytes:
    archive = _zip(path)
    try:
        each = archive.getinfo(member)
    except KeyError:
        raise InputError(f"{name}: no such file in {path}") from None
    if each.flag_bits & 1:
        raise InputError(f"{name}: is encrypted; unpack it")
    if each.compress_type != zipfile.ZIP_STORED:
        most = min(most, most_unpacked(each.compress_size))
    if each.file_size > most:
        raise too_large(name, each.file_size, most)
    try:
        with archive.open(each) as file:
            return file.read(each.file_size + 1)  # zipfile gives no more than that size
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise InputError(f"{name}: is damaged in {path}: {str(error) or 'it ends too early'}") from None


def _zip(path: str) -> zipfile.ZipFile:
    try:
        with reading(path):
            return _opened_zip(*state_of(path))
    except (zipfile.BadZipFile, ValueError, NotImplementedError):
        raise InputError(f"{path}: is no ZIP archive, or a damaged one") from None


@lru_cache(maxsize=4)  # its directory is read once by each worker
def _opened_zip(path: str, size: int, modified_ns: int, process: int) -> zipfile.ZipFile:
    return zipfile.ZipFile(path)
