"""What is finer than a pixel is averaged exactly."""

import numpy as np
import pytest

from rollcli.simulate.materials import Facade, NoiseTile, band, bars, coarse, fine


def averaged(pattern, centre, width):
    """The mean of a pattern of 0 and 1 over pixels, by brute force."""
    offsets = (np.arange(4000) + 0.5) / 4000 - 0.5
    return pattern(centre[:, None] + offsets * width).mean(axis=1)


@pytest.mark.parametrize("width", [0.01, 0.3, 2.0, 25.0])
def test_a_band_covers_its_share_of_a_pixel(width):
    x = np.linspace(-3, 3, 101, dtype=np.float32)
    expected = averaged(lambda t: (t > -0.4) & (t < 0.7), x, width)
    assert np.allclose(band(x, -0.4, 0.7, np.full_like(x, width)), expected, atol=1e-3)


@pytest.mark.parametrize("width", [0.01, 0.3, 2.0, 25.0])
def test_bars_cover_their_share_of_a_pixel_however_many_it_holds(width):
    x = np.linspace(-3, 3, 101, dtype=np.float32)
    expected = averaged(lambda t: np.mod(t, 1.3) < 0.4, x, width)
    assert np.allclose(bars(x, 1.3, 0.4, np.full_like(x, width)), expected, atol=2e-3)


def test_a_level_of_a_noise_tile_holds_the_averages_of_the_finer_one():
    tile = NoiseTile(seed=5, slope=0.7, longest=200.0)
    rows, columns = np.mgrid[:64, :64]

    def texels(level, rows, columns):
        scale = 2.0**level
        x, y = ((at.ravel() + 0.5) * scale for at in (columns, rows))
        return tile.sample(x.astype(np.float32), y.astype(np.float32), np.full(x.size, level, np.int32))

    fine_texels = texels(0, rows, columns).reshape(64, 64)
    for level in (1, 3, 5):
        side = 1 << level
        coarser = texels(level, *np.mgrid[: 64 >> level, : 64 >> level]).reshape(64 >> level, -1)
        assert np.allclose(
            coarser, fine_texels.reshape(64 >> level, side, -1, side).mean(axis=(1, 3)), atol=1e-5
        )


@pytest.mark.parametrize("noise", [fine, coarse])
def test_noise_has_unit_variance_up_close_and_fades_with_distance(noise):
    p, q = np.random.default_rng(0).uniform(0, 500, (2, 20000)).astype(np.float32)
    spreads = [noise(p, q, np.full_like(p, w)).std() for w in (0.001, 0.1, 1.0, 100.0)]
    assert 0.7 < spreads[0] < 1.05
    assert np.all(np.diff(spreads) < 0.02)
    assert spreads[-1] < 0.1


def test_a_window_pane_shows_nothing_of_the_plaster_around_it():
    def house(level):
        one = np.ones(1, np.float32)
        facade = Facade(0.0, np.array([0, 90], np.float32), level * one, np.ones((1, 3)), 3 * one, 2 * one)
        return facade.albedo(p, q, np.full_like(p, 1e-3))

    # 30 bays of the upper storeys; inside of one half of each window, and between windows
    bay, storey = np.meshgrid(np.arange(30), np.arange(1, 5))
    q = (3 * (storey.ravel() + 0.55)).astype(np.float32)
    p = (2 * (bay.ravel() + 0.4)).astype(np.float32)
    np.testing.assert_allclose(house(0.3), house(0.6), atol=1e-4)  # edges are a little soft
    assert house(0.3).std() > 0.02
    p = (2 * (bay.ravel() + 0.1)).astype(np.float32)
    assert (house(0.6) > 1.5 * house(0.3)).all()


def test_each_house_has_its_own_colour_and_the_outermost_go_on():
    edges, tints = np.array([0, 10, 25, 40], np.float32), np.eye(3, dtype=np.float32)
    one = np.ones(3, np.float32)
    row = Facade(0.0, edges, np.array([0.2, 0.4, 0.6], np.float32), tints, 3 * one, 2 * one)
    p = np.array([-3, 0.01, 9.99, 10.01, 24.99, 25.01, 39.99, 50], np.float32)
    assert row.colour(p, p).argmax(axis=1).tolist() == [0, 0, 0, 1, 1, 2, 2, 2]
    # plaster between the windows of the first floor, far enough away to see no grain
    middles = np.array([2.0, 12.0, 27.0], np.float32)
    wall = row.albedo(middles, np.full(3, 5.8, np.float32), np.full(3, 0.05, np.float32))
    assert (np.diff(wall) > 0.05).all()
