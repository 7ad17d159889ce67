"""The same rig written in every format, by hand, and samples of real files."""

from typing import NamedTuple

import numpy as np


class Rig(NamedTuple):
    """A rectified pair: pixels, metres."""

    fx: float = 707.0912
    fy: float = 707.0912
    cx: float = 601.8873
    cy: float = 183.1104
    baseline: float = 0.5372
    doffs: float = 0.0
    width: int = 1226
    height: int = 370


def _row(*values):
    return " ".join(repr(float(value)) for value in values)


def _projections(rig, unit=1.0):
    left = (rig.fx, 0, rig.cx, 0, 0, rig.fy, rig.cy, 0, 0, 0, 1, 0)
    shift = -rig.fx * rig.baseline / unit
    right = (rig.fx, 0, rig.cx + rig.doffs, shift, 0, rig.fy, rig.cy, 0, 0, 0, 1, 0)
    return left, right


def kitti_benchmark(rig):
    left, right = _projections(rig)
    return f"P0: {_row(*left)}\nP1: {_row(*right)}\nTr_cam_to_road:\nR0_rect: 1 0 0 0 1 0 0 0 1\n"


def kitti_raw(rig):
    left, right = _projections(rig)
    return (
        "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.950000e-02\n"
        f"S_00: 1392 512\nK_00: 984.2 0 690.0 0 980.8 233.2 0 0 1\nS_rect_00: {rig.width} {rig.height}\n"
        f"P_rect_00: {_row(*left)}\nS_rect_01: {rig.width} {rig.height}\nP_rect_01: {_row(*right)}\n"
    )


def driving_stereo(rig):
    left, right = _projections(rig)
    return (
        f"S_rect_101: {rig.width} {rig.height}\nP_rect_101: {_row(*left)}\n"
        f"T_103: {-rig.baseline} 0.002 0.001\nP_rect_103: {_row(*right)}\n"
    )


def middlebury(rig):
    return (
        f"cam0=[{rig.fx!r} 0 {rig.cx!r}; 0 {rig.fy!r} {rig.cy!r}; 0 0 1]\n"
        f"cam1=[{rig.fx!r} 0 {rig.cx + rig.doffs!r}; 0 {rig.fy!r} {rig.cy!r}; 0 0 1]\n"
        f"doffs={rig.doffs!r}\nbaseline={rig.baseline * 1000!r}\n"
        f"width={rig.width}\nheight={rig.height}\nndisp=280\nisint=0\nvmin=31\nvmax=257\n"
    )


def _matrix_yaml(name, rows, columns, values):
    listed = ",\n       ".join(repr(float(value)) for value in values)
    return f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {listed} ]\n"


def opencv_yaml(rig):
    left, right = _projections(rig)
    q = np.zeros((4, 4))
    q[0, 0] = q[1, 1] = 1
    q[:3, 3] = -rig.cx, -rig.cy, rig.fx
    q[3, 2:] = 1 / rig.baseline, rig.doffs / rig.baseline
    matrices = (("P1", 3, 4, left), ("P2", 3, 4, right), ("Q", 4, 4, q.ravel()))
    return "%YAML:1.0\n---\n" + "".join(_matrix_yaml(*matrix) for matrix in matrices)


def orb_slam(rig):
    return (
        "%YAML:1.0\n\n#----\n# Camera Parameters. Adjust them!\n#----\n\n"
        f"Camera.fx: {rig.fx!r}\nCamera.fy: {rig.fy!r}\nCamera.cx: {rig.cx!r}\nCamera.cy: {rig.cy!r}\n\n"
        f"Camera.width: {rig.width}\nCamera.height: {rig.height}\n\n# baseline times fx\n"
        f"Camera.bf: {rig.fx * rig.baseline!r}\n\nORBextractor.nFeatures: 2000\n"
    )


def ros(rig, *, right, positive=False):
    left, second = _projections(rig)
    values = list(second if right else left)
    if positive:
        values[3] = abs(values[3])
    listed = ", ".join(repr(float(value)) for value in values)
    return (
        f"image_width: {rig.width}\nimage_height: {rig.height}\n"
        f"camera_name: zed/{'right' if right else 'left'}\n"
        "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [350.112, 0, 349.13501, 0, 350.112, 196.8, 0, 0, 1]\n"
        "distortion_model: plumb_bob\n"
        "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n"
        f"projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{listed}]\n"
    )


def cityscapes(rig):
    return (
        f'{{"extrinsic": {{"baseline": {rig.baseline!r}, "pitch": 0.038, "roll": 0.0, "x": 1.7, "y": 0.1, '
        f'"yaw": -0.0195, "z": 1.22}}, "intrinsic": {{"fx": {rig.fx!r}, "fy": {rig.fy!r}, '
        f'"u0": {rig.cx!r}, "v0": {rig.cy!r}}}}}'
    )


def kalibr(rig):
    return (
        "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n"
        "  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]\n"
        "  intrinsics: [464.4666, 465.3676, 345.1018, 229.4891]\n"
        "  resolution: [640, 480]\n  rostopic: /left\n"
        "cam1:\n  T_cn_cnm1:\n"
        f"  - [1.0, 0.0, 0.0, {-rig.baseline!r}]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n"
        "  - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: [0]\n"
    )


def zed(rig):
    return (
        "[LEFT_CAM_HD]\nfx=699.41\nfy=699.365\ncx=652.8\ncy=358.133\nk1=-0.170704\n\n"
        f"[STEREO]\nBaseline={rig.baseline * 1000!r}\nTY=0.1\nCV_HD=0.002\n"
    )


WHOLE = {
    "kitti-benchmark": kitti_benchmark,
    "kitti-raw": kitti_raw,
    "driving-stereo": driving_stereo,
    "middlebury": middlebury,
    "opencv-yaml": opencv_yaml,
    "orb-slam": orb_slam,
    "cityscapes": cityscapes,
}
WITH_SIZE = ("kitti-raw", "driving-stereo", "middlebury", "orb-slam")
WITHOUT_DOFFS = ("orb-slam", "cityscapes")

# real files, shortened
KITTI_OBJECT = (
    "P2: 7.070493e+02 0.000000e+00 6.040814e+02 4.575831e+01 0.000000e+00 7.070493e+02 1.805066e+02 "
    "-3.454157e-01 0.000000e+00 0.000000e+00 1.000000e+00 4.981016e-03\n"
    "P3: 7.070493e+02 0.000000e+00 6.040814e+02 -3.341081e+02 0.000000e+00 7.070493e+02 1.805066e+02 "
    "2.330660e+00 0.000000e+00 0.000000e+00 1.000000e+00 3.201153e-03\n"
)
KITTI_RAW = (
    "S_rect_00: 1.242000e+03 3.750000e+02\n"
    "P_rect_00: 7.215377e+02 0.000000e+00 6.095593e+02 0.000000e+00 0.000000e+00 7.215377e+02 1.728540e+02 "
    "0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
    "P_rect_01: 7.215377e+02 0.000000e+00 6.095593e+02 -3.875744e+02 0.000000e+00 7.215377e+02 1.728540e+02 "
    "0.000000e+00 0.000000e+00 0.000000e+00 1.000000e+00 0.000000e+00\n"
)
MIDDLEBURY = (
    "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\n"
    "cam1=[3997.684 0 1307.839; 0 3997.684 1011.728; 0 0 1]\n"
    "doffs=131.111\nbaseline=193.001\nwidth=2964\nheight=1988\nndisp=280\n"
)
OPENCV = (
    "%YAML:1.0\n"
    "P1: !!opencv-matrix\n   rows: 3\n   cols: 4\n   dt: d\n"
    "   data: [ 538.45139, 0., 314.71402, 0., 0., 538.45139, 234.58003, 0., 0., 0., 1., 0. ]\n"
    "P2: !!opencv-matrix\n   rows: 3\n   cols: 4\n   dt: d\n"
    "   data: [ 538.45139, 0., 314.71402, -4240.5388, 0., 538.45139, 234.58003, 0., 0., 0., 1., 0. ]\n"
    "Q: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n"
    "   data: [ 1., 0., 0., -314.71402, 0., 1., 0., -234.58003,\n"
    "       0., 0., 0., 538.45139, 0., 0., 0.12697712, 0. ]\n"
)
ROS_RIGHT = (
    "image_width: 672\nimage_height: 376\ncamera_name: zed/right\n"
    "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [350.112, 0, 349.13501, 0, 350.112, 196.824997, 0, 0, 1]\n"
    "projection_matrix:\n  rows: 3\n  cols: 4\n"
    "  data: [350.112000, 0, 349.135010, 41.954632, 0, 350.112, 196.824997, 0, 0, 0, 1, 0]\n"
)
ROS_LEFT = ROS_RIGHT.replace("41.954632", "0").replace("right", "left")
KALIBR = (
    "cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n"
    "  intrinsics: [464.4666, 465.3676, 345.1018, 229.4891]\n"
    "cam1:\n  T_cn_cnm1:\n  - [0.9996465, -0.0253778, 0.0079243, -0.1125119]\n"
    "  - [0.0254764, 0.9995959, -0.0126016, -0.0017042]\n  - [-0.0076013, 0.0127990, 0.9998891, -0.0005072]\n"
    "  - [0, 0, 0, 1]\n  camera_model: pinhole\n"
)
