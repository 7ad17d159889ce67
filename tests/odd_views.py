"""What a right camera sees: a texture further left, and all of a view that is turned, lower or larger."""

import dataclasses
import math

import cv2
import numpy as np

from rollcli.simulate.build import build_scene
from rollcli.simulate.spec import Stream
from rollcli.simulate.views import expose, render_view


def pair_at(disparity, shape=(120, 400), seed=0, first=None):
    """A random texture, seen again `disparity` pixels (a number, or one a row) further left."""
    texture = np.random.default_rng(seed).integers(0, 256, (shape[0], 2 * shape[1]), dtype=np.uint8)
    texture = cv2.GaussianBlur(texture, (3, 3), 0)
    columns = np.arange(shape[1]) + (first or shape[1] // 2)
    shifts = np.broadcast_to(np.rint(disparity).astype(int), shape[0])
    right = np.stack([row[columns + shift] for row, shift in zip(texture, shifts, strict=True)])
    return texture[:, columns], right


def seen_by(view, *, clockwise_deg=0.0, larger_percent=0.0, lower=0.0, border=cv2.BORDER_REFLECT):
    """The view as an odd camera sees it; OpenCV's own matrix, not the program's formulas.

    OpenCV's cubic would move what it shows by up to 0.05 px, as if the view were turned.
    """
    height, width = view.shape[:2]
    centre = (width - 1) / 2, (height - 1) / 2
    matrix = cv2.getRotationMatrix2D(centre, -clockwise_deg, 1 + larger_percent / 100)
    matrix[1, 2] += lower
    return cv2.warpAffine(view, matrix, (width, height), flags=cv2.INTER_LANCZOS4, borderMode=border)


def seen_turned(view, yaw_deg=0.0, pitch_deg=0.0, focal=0.7):
    """What a camera sees that is turned to the side or down, of a focal length of so many widths."""
    height, width = view.shape[:2]
    focal *= width
    camera = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]])
    turned, _ = cv2.Rodrigues(np.radians([pitch_deg, yaw_deg, 0.0]))
    seen = camera @ turned @ np.linalg.inv(camera)
    how = {"flags": cv2.INTER_LANCZOS4, "borderMode": cv2.BORDER_REFLECT}
    return cv2.warpPerspective(view, seen, (width, height), **how)


def seen_rolled(spec, clockwise_deg, larger_percent=0.0):
    """What a right camera sees that is rolled or of a longer focal length, about its principal point."""
    scene = build_scene(spec)
    camera = spec.cameras(scene.normal)[1]
    right, down, ahead = camera.axes
    cosine, sine = math.cos(math.radians(clockwise_deg)), math.sin(math.radians(clockwise_deg))
    axes = np.array([cosine * right - sine * down, sine * right + cosine * down, ahead])
    focal = camera.focal * (1 + larger_percent / 100)
    light = render_view(scene, dataclasses.replace(camera, axes=axes, focal=focal)).light
    # noise of its own, not that of the left view
    rng = np.random.default_rng([spec.seed, spec.index, Stream.SENSOR])
    return expose(light, spec.noise, spec.gain, spec.colour, rng)
