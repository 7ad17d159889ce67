"""Set up a process that runs tasks and does nothing else."""

import ctypes
import os

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
_MIB = 2**20


def limit_blas_threads() -> None:
    """Limit NumPy's linear algebra to one thread, here and in child processes; call it before NumPy loads."""
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")


def prepare_worker() -> None:
    """Set up this process to run tasks: one thread, silent decoders, memory that is kept between tasks."""
    import cv2

    from rollcli.files.codecs.mute_stderr import silence_decoders

    cv2.setNumThreads(1)  # tasks run in parallel, not the loops inside of one
    silence_decoders()
    _keep_freed_memory()


def _keep_freed_memory() -> None:
    """Let glibc keep the arrays of a task for the next one: returning them costs a fifth of the time."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library, which has no such function
    mallopt(_M_MMAP_THRESHOLD, 32 * _MIB)
    mallopt(_M_TRIM_THRESHOLD, 256 * _MIB)
