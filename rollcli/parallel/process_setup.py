"""How a process is set up that works on frames, and on nothing else."""

import ctypes
import os

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h
_MIB = 2**20


def limit_blas_threads() -> None:
    """Keep NumPy's linear algebra to one thread, here and in processes to come; before NumPy is loaded."""
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")


def prepare_worker() -> None:
    """Set up this process: the frames are what runs in parallel, and each needs the same memory again."""
    import cv2

    from rollcli.files.codecs.mute_stderr import silence_decoders

    cv2.setNumThreads(1)
    silence_decoders()
    _keep_freed_memory()


def _keep_freed_memory() -> None:
    """Have glibc keep the arrays of a frame for the next: giving it back costs a fifth of the time."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return  # another C library: it has its own ways
    mallopt(_M_MMAP_THRESHOLD, 32 * _MIB)
    mallopt(_M_TRIM_THRESHOLD, 256 * _MIB)
