"""Frames to workers and outcomes back in order, with a bounded number of frames in flight."""

from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import Future
from typing import Protocol

from rollcli.batch.job import Frame, Outcome
from rollcli.batch.signals import Stop


class Crew(Protocol):
    """Workers, wherever they are.

    Attributes
    ----------
    window : int
        How many frames may be in flight: enough that nobody waits, few enough that memory stays bounded.
    deaths : tuple of exception types
        How the future of a lost frame ends.
    broken : bool
        A worker has died, and with it every frame in flight is lost.
    """

    window: int
    deaths: tuple[type[BaseException], ...]
    broken: bool

    def submit(self, frame: Frame) -> "Future[Outcome]":
        """Start a frame; if its worker dies, the future ends with one of `deaths`."""

    def again(self, frame: Frame) -> Outcome:
        """Do a lost frame once more, alone; if that kills its worker too, its row is an error."""

    def renew(self) -> None:
        """Replace workers that have died."""


def in_order(frames: Iterable[Frame], crew: Crew, stop: Stop) -> Generator[Outcome, None, None]:
    """The outcome of each frame, in the frames' order.

    Takes no new frames when asked to stop, nor while lost frames are done once more: what died for want of
    memory gets all of it.
    """
    source, flying = iter(frames), deque[tuple[Frame, "Future[Outcome]"]]()
    while True:
        if crew.broken and not flying:
            crew.renew()
        while len(flying) < crew.window and not (stop.asked or crew.broken):
            frame = next(source, None)
            if frame is None:
                break
            flying.append((frame, crew.submit(frame)))
        if not flying:
            return
        frame, future = flying.popleft()
        try:
            outcome = future.result()
        except crew.deaths:
            if stop.asked:
                return  # whoever asked has ended the workers too
            outcome = crew.again(frame)
        yield outcome
