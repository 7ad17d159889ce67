"""Frames are what runs in parallel: libraries' own threads would only get in their way."""


def use_one_thread() -> None:
    """Keep OpenCV to the calling thread; where frames are worked on, and nowhere else."""
    import cv2

    cv2.setNumThreads(1)
