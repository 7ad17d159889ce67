"""The true disparity of a simulated frame in double precision, which its files do not hold."""

from rollcli.simulate.build import build_scene
from rollcli.simulate.views import trace


def true_disparity(spec):
    """Return the disparity (H, W) of the left view, 0 in the sky, and which of its pixels are road."""
    scene = build_scene(spec)
    camera = spec.cameras(scene.normal)[0]
    hits = trace(scene, camera.rays_of(range(camera.height)))
    disparity, road = spec.focal * spec.baseline / hits.depth, hits.material == scene.road
    return disparity.reshape(camera.height, -1), road.reshape(camera.height, -1)
