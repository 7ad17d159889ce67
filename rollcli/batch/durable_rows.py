"""Rows that enter the result in groups, each once its images survive a power cut."""

import time
from collections.abc import Iterable
from pathlib import Path

from rollcli.batch.result_file import ResultFile
from rollcli.files.durable import sync_files

_MOST_IMAGES = 512
_LONGEST_S = 1.0  # a row waits no longer for the others of its group
_SHARE = 100  # a group lasts so many times as long as the last one took to sync: 1 % of the time at most


class DurableRows:
    """Collects rows, forces their images to the disk, then writes them and forces them too.

    Rows without images are written at once; a killed run loses none of them.

    Attributes
    ----------
    written : int
        The number of rows in the file that this object wrote.
    """

    def __init__(self, file: ResultFile) -> None:
        self.written = 0
        self._file = file
        self._rows: list[bytes] = []
        self._images: list[str] = []
        self._folders: set[Path] = set()  # whose names are on the disk
        self._unsynced = False
        self._last, self._wait_s = time.monotonic(), 0.0

    def append(self, row: bytes, images: Iterable[str]) -> None:
        """Add a row and the images that must be on the disk before it.

        Raises
        ------
        OutputError
            The disk does not take an image or a row.
        """
        before = len(self._images)
        self._images.extend(images)
        if self._rows or len(self._images) > before:
            self._rows.append(row)
        else:
            self._write(row)
        self._commit_in_time()

    def restore(self, images: Iterable[str]) -> None:
        """Add images whose row is in the result already.

        Raises
        ------
        OutputError
            The disk does not take an image or a row.
        """
        self._images.extend(images)
        self._commit_in_time()

    def commit(self) -> None:
        """Force everything to the disk that was added.

        Raises
        ------
        OutputError
            The disk does not take it.
        """
        start = time.monotonic()
        if self._images:
            sync_files(self._images, self._folders)
            self._images.clear()
        while self._rows:
            self._write(self._rows[0])
            del self._rows[0]
        if self._unsynced:
            self._file.sync()
            self._unsynced = False
        self._last = time.monotonic()
        self._wait_s = min(_SHARE * (self._last - start), _LONGEST_S)

    def _commit_in_time(self) -> None:
        if time.monotonic() - self._last >= self._wait_s or len(self._images) >= _MOST_IMAGES:
            self.commit()

    def _write(self, row: bytes) -> None:
        self._file.append(row)
        self.written += 1
        self._unsynced = True
