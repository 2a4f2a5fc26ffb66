"""Mark colours learned from images; colours that cannot be told apart are refused."""

import cv2
import numpy as np
import pytest

from hil.core.errors import BadInput
from vision.calibration.colours import Sample, chromaticity, grow, learn_colours, read_samples

RED, GREEN, ORANGE = (30, 25, 150), (30, 110, 25), (25, 60, 150)
FLOOR = (95, 105, 110)


def scene(front, rear, floor=FLOOR, noise_dn=2.0, gradient=True):
    """Two discs of 9 px radius at (100, 80) and (200, 120) on an unevenly lit floor."""
    image = np.empty((240, 320, 3))
    image[:] = floor
    cv2.circle(image, (100, 80), 9, front, -1)
    cv2.circle(image, (200, 120), 9, rear, -1)
    if gradient:
        image *= np.linspace(1.0, 0.65, 320)[None, :, None]
    image += np.random.default_rng(2).normal(0.0, noise_dn, image.shape)
    image = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return Sample("scene.png", image, (100.0, 80.0), (200.0, 120.0))


def test_colours_of_two_marks_are_learned():
    """Chromaticities come out as painted, whatever the light, and the marks stand well apart."""
    result = learn_colours([scene(RED, GREEN)])
    for colour, painted in ((result.front, RED), (result.rear, GREEN)):
        expected = chromaticity(np.array([painted], dtype=float))[0]
        assert colour.chroma == pytest.approx(expected, abs=0.01)
        assert colour.pixels == pytest.approx(np.pi * 8**2, rel=0.15)  # less a rim
    blue, green, red = result.front.bgr
    assert (blue / red, green / red) == pytest.approx((30 / 150, 25 / 150), abs=0.02)
    assert result.separation > 15
    assert result.alike_front_ratio == 0.0


@pytest.mark.parametrize("other", [RED, (33, 30, 148), (36, 31, 150)])
def test_marks_of_nearly_one_colour_are_refused(other):
    """Red and red, or reds a shade apart: refused with the separation and its limit."""
    with pytest.raises(BadInput, match=r"separation d' = \d+\.\d, limit 6"):
        learn_colours([scene(RED, other, noise_dn=4.0)])


def test_orange_and_red_in_noise_are_refused_and_in_clean_light_are_not():
    """The limit is about the samples' own scatter: the same pair passes when the sensor is quiet."""
    assert learn_colours([scene(RED, ORANGE, noise_dn=1.0)]).separation > 6
    with pytest.raises(BadInput, match="too alike"):
        learn_colours([scene(RED, ORANGE, noise_dn=14.0)])


def test_a_floor_of_the_marks_colour_is_refused():
    """A green floor, darker than the mark, swallows the green mark."""
    with pytest.raises(BadInput, match=r"patch of one colour|look like the rear mark"):
        learn_colours([scene(RED, GREEN, floor=(21, 76, 18))])


def test_a_pixel_beside_the_mark_is_refused():
    """The floor's patch is far larger than a mark; a pixel outside the image is said so."""
    sample = scene(RED, GREEN, gradient=False)
    with pytest.raises(BadInput, match="is the pixel on the mark"):
        grow(sample.image, (20.0, 200.0), "front")
    with pytest.raises(BadInput, match="not inside the image"):
        grow(sample.image, (400.0, 20.0), "front")


@pytest.mark.parametrize(
    ("front", "says"), [((40, 60, 255), "overexposed"), ((2, 2, 12), "too dark")]
)
def test_lost_colours_are_refused(front, says):
    """An overexposed or a black mark has no colour to learn."""
    with pytest.raises(BadInput, match=says):
        learn_colours([scene(front, GREEN, gradient=False)])


def test_samples_of_several_images(tmp_path):
    """A table names images beside it; both sides of the light go into the colours."""
    for name in ("a.png", "b.png"):
        cv2.imwrite(str(tmp_path / name), scene(RED, GREEN).image)
    table = tmp_path / "samples.csv"
    head = "image,front_u_px,front_v_px,rear_u_px,rear_v_px\n"
    table.write_text(head + "a.png,100,80,200,120\nb.png,100,80,200,120\n")
    samples = read_samples(table)
    assert [s.name for s in samples] == ["a.png", "b.png"]
    assert learn_colours(samples).front.pixels > 400
    table.write_text(head + "none.png,100,80,200,120\n")
    with pytest.raises(BadInput, match=r"none\.png: cannot be read"):
        read_samples(table)
