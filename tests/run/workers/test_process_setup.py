"""A process that runs tasks: one thread, and memory that is kept between tasks."""

import ctypes
from types import SimpleNamespace

import cv2
import pytest

from rollcli.files.codecs import png as mute_stderr
from rollcli.run.workers import pool as process_setup

NAMES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def test_linear_algebra_has_one_thread_unless_the_user_says_more(monkeypatch):
    for name in NAMES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "4")
    process_setup.limit_blas_threads()
    assert [process_setup.os.environ[name] for name in NAMES] == ["1", "1", "4", "1"]


def test_freed_memory_is_kept_up_to_the_thresholds(monkeypatch):
    told = []
    library = SimpleNamespace(mallopt=lambda *arguments: told.append(arguments))
    monkeypatch.setattr(ctypes, "CDLL", lambda name: library)
    process_setup._keep_freed_memory()
    # in malloc.h M_MMAP_THRESHOLD is -3 and M_TRIM_THRESHOLD -1; the former is at most 32 MiB
    assert told == [(-3, 33_554_432), (-1, 268_435_456)]


@pytest.mark.parametrize("error", [OSError, TypeError, AttributeError])
def test_another_c_library_is_left_alone(monkeypatch, error):
    def fail(name):
        raise error

    monkeypatch.setattr(ctypes, "CDLL", fail)
    process_setup._keep_freed_memory()


def test_a_worker_decodes_in_one_thread_and_silently(monkeypatch):
    threads, silenced = [], []
    monkeypatch.setattr(cv2, "setNumThreads", threads.append)
    monkeypatch.setattr(mute_stderr, "silence_decoders", lambda: silenced.append(True))
    process_setup.prepare_worker()
    assert (threads, silenced) == ([1], [True])
