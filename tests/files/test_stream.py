"""Standard output, pipes and devices are written to; everything else becomes a whole file."""

import contextlib
import errno
import os
import sys
import threading
from unittest.mock import Mock

import pytest

from rollcli.errors import OutputError
from rollcli.files import storage

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")


@pytest.fixture
def pipe():
    """Both ends of a pipe: (reads, writes)."""
    ends = os.pipe()
    yield ends
    for each in ends:
        with contextlib.suppress(OSError):  # a test may have closed it
            os.close(each)


def test_a_pipe_gets_all_of_the_bytes_and_stays_a_pipe(tmp_path):
    path, data, found = tmp_path / "pipe", os.urandom(300_000), []  # more than a pipe holds
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: found.append(path.read_bytes()))
    reader.start()
    storage.write_output(str(path), data, overwrite=False)
    reader.join(timeout=60)
    assert found == [data]
    assert path.is_fifo()


def test_standard_output_is_descriptor_1_unless_python_calls_it_closed(monkeypatch):
    with storage.open_stream("-") as write:
        assert write.args == (1,)
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(OutputError, match=r"^standard output: is closed$"), storage.open_stream("-"):
        pass


def test_a_reader_that_has_gone_is_told_from_an_error(pipe, monkeypatch):
    reads, writes = pipe
    os.close(reads)
    with pytest.raises(BrokenPipeError):
        storage.write_stream(writes, b"data", "/dev/x")

    monkeypatch.setattr(os, "write", Mock(side_effect=OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))))
    with pytest.raises(OutputError, match=r"^/dev/x: cannot be written: no space left on device$"):
        storage.write_stream(writes, b"data", "/dev/x")
