"""Synthetic clips of marker fields whose truth is known, good and bad: glare, bright ring, drift, motion blur."""

import dataclasses
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.special import erf

from fingerslip.detect.synthetic import CENTRE, SyntheticSensor, synthetic_slides
from fingerslip.marker_layouts import RING_COUNTS, hexagonal_layout, ring_layout


@dataclass(frozen=True)
class Look:
    """What frames look like; lengths in px, brightness in grey levels."""

    shape: tuple[int, int] = (480, 640)
    radius: float = 5.0
    blur: float = 0.8
    marker: float = 45.0
    background: float = 165.0
    noise: float = 2.0
    exposure: float = 0.0  # share of the time between frames
    gradient: float = 0.0  # share of the brightness, from one side to the other
    vignette: float = 0.0  # share of the brightness that the corners lack
    ring: float = 0.0  # a bright ring around the field
    glare: int = 0  # reflections that wander
    glare_level: float = 120.0
    glare_size: float = 9.0
    drift: float = 0.0  # share of the brightness that is lost along the clip
    flicker: float = 0.0  # share of the brightness, standard deviation
    texture: float = 0.0  # grey levels of a pattern that stands still
    foreshortening: float = 0.0  # share of the radius that markers at the rim lose, radially
    jpeg: int = 0  # quality; 0 for none


DEFAULT = Look()
#: As bad as recordings of real sensors: reflections, a bright ring, changing light, blurred and foreshortened markers.
BAD = Look(
    noise=4.0,
    blur=1.2,
    exposure=0.5,
    gradient=0.4,
    vignette=0.5,
    ring=80.0,
    glare=4,
    drift=0.3,
    flicker=0.02,
    texture=6.0,
    foreshortening=0.4,
    jpeg=80,
)


def field(look=DEFAULT, layout="rings", pitch=0.0, rings=4):
    """Return markers at rest around the middle of the frame (n, 2) [px]."""
    height, width = look.shape
    pitch = pitch or 0.092 * height * 4 / rings
    made = ring_layout(pitch, RING_COUNTS[: rings + 1]) if layout == "rings" else hexagonal_layout(pitch, rings)
    return made.position + np.array([0.5 * width + 0.21, 0.5 * height - 0.37])


def still(points, count):
    """Return positions of markers that rest (count, n, 2)."""
    return np.repeat(points[None], count, axis=0)


def slide(points, direction, *, travel=40.0, count=120, rest=20):
    """Return markers that are dragged along: the middle first and all in the end, with slips, (count, n, 2) [px]."""
    middle = points.mean(axis=0)
    distance = np.linalg.norm(points - middle, axis=1) / np.linalg.norm(points - middle, axis=1).max()
    phase = np.clip((np.arange(count) - rest) / (count - rest - 1), 0.0, 1.0)
    # Three times a part of the way is lost suddenly, most in the middle.
    saw = travel * (1.25 * phase - 0.05 * np.floor(3.999 * phase) / 3.0 * (1.0 - distance[:, None]).clip(0.2))
    share = np.exp(-1.2 * distance**2)[:, None] ** (1.0 - phase[None, :])
    along = (saw * share).T
    along *= travel / max(along.max(), 1e-9)
    across = 0.06 * travel * phase[:, None] * np.sin(3.0 * distance)[None]
    ex, ey = np.cos(direction), np.sin(direction)
    return points[None] + np.stack([along * ex - across * ey, along * ey + across * ex], axis=2)


def press(points, *, spread=0.06, count=80, rest=20):
    """Return markers that spread from the middle while the sensor is pressed (count, n, 2) [px]."""
    middle = points.mean(axis=0)
    phase = np.clip((np.arange(count) - rest) / (count - rest - 1), 0.0, 1.0)
    return middle + (points - middle)[None] * (1.0 + spread * np.sin(0.5 * np.pi * phase))[:, None, None]


def part(points, apart, *, count=80, rest=20):
    """Return markers of which one half slips past the other, by a share of their distance, (count, n, 2) [px]."""
    steps = np.linalg.norm(points[:, None] - points[None], axis=2)
    spacing = float(np.median(np.sort(steps, axis=1)[:, 1]))
    phase = np.clip((np.arange(count) - rest) / (0.8 * (count - rest)), 0.0, 1.0)
    slips = points[:, 1] > np.median(points[:, 1])
    slip = apart * spacing * phase[:, None] * slips
    return points[None] + np.stack([slip + 10.0 * phase[:, None], np.zeros_like(slip)], axis=2)


def pinch(points, share=0.35, *, count=80, rest=20):
    """Return markers that come together around the middle until they touch, and part again, (count, n, 2) [px]."""
    middle = points.mean(axis=0)
    offset = points - middle
    reach = np.linalg.norm(offset, axis=1).max()
    phase = np.sin(np.pi * np.clip((np.arange(count) - rest) / (count - rest - 8), 0.0, 1.0))
    pull = np.exp(-(((offset / (0.5 * reach)) ** 2).sum(axis=1)))[:, None]
    return np.asarray(middle + offset[None] * (1.0 - share * phase[:, None, None] * pull[None]))


def truth_of(positions, look):
    """Return where the markers are in the middle of the exposure (t, n, 2) [px]."""
    return positions + 0.5 * look.exposure * _steps(positions)


def filmed(positions, look=DEFAULT, *, seed=0, hidden=None):
    """Yield the frames of markers that move (t, n, 2); those that are `hidden` (t, n) are not drawn."""
    rng = np.random.default_rng(seed)
    (light, ring), pattern, spots = _light(look), _texture(look, rng), _spots(look, rng)
    steps, rest = _steps(positions), positions[0]
    for t, here in enumerate(positions):
        drawn = np.ones(len(here), dtype=bool) if hidden is None else ~hidden[t]
        cover = _cover(look, here[drawn], steps[t][drawn], rest[drawn])
        paint = look.background + (look.marker - look.background) * cover + pattern
        strength = (1.0 - look.drift * t / max(len(positions) - 1, 1)) * (1.0 + look.flicker * rng.standard_normal())
        frame = paint * light * strength + _glare(look, spots, t) + ring
        frame += look.noise * rng.standard_normal(look.shape, dtype=np.float32)
        grey = np.clip(np.rint(frame), 0, 255).astype(np.uint8)
        if look.jpeg:
            content = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, look.jpeg])[1]
            grey = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE)
        yield grey


def _steps(positions):
    return np.diff(positions, axis=0, append=positions[-1:])


def _light(look):
    """Return the share of the light at each pixel, and what a bright ring adds."""
    height, width = look.shape
    rows, columns = np.mgrid[:height, :width]
    x, y = (columns - 0.5 * width) / (0.5 * height), (rows - 0.5 * height) / (0.5 * height)
    light = (1.0 + 0.5 * look.gradient * (0.8 * x + 0.6 * y)) * (1.0 - 0.6 * look.vignette * (x * x + y * y))
    ring = look.ring * np.exp(-(((np.hypot(x, y) - 0.97) / 0.05) ** 2))
    return light.clip(0.05).astype(np.float32), ring.astype(np.float32)


def _texture(look, rng):
    if not look.texture:
        return 0.0
    rough = cv2.GaussianBlur(rng.standard_normal(look.shape).astype(np.float32), (0, 0), 3.0 * look.radius)
    return look.texture * rough / rough.std()


def _spots(look, rng):
    """Return place, speed and size of each reflection."""
    height, width = look.shape
    place = rng.uniform(-0.3, 0.3, (look.glare, 2)) * [height, height] + [0.5 * width, 0.5 * height]
    return np.column_stack([place, rng.normal(0, 0.004 * height, (look.glare, 2)), rng.uniform(0.6, 1.4, look.glare)])


def _glare(look, spots, t):
    if not len(spots):
        return 0.0
    height, width = look.shape
    total = np.zeros(look.shape, dtype=np.float32)
    columns, rows = np.arange(width), np.arange(height)
    for x, y, vx, vy, size in spots:
        sigma = look.glare_size * size
        # They wander to and fro by some tens of pixels.
        px, py = x + 8.0 * vx * np.sin(0.1 * t), y + 8.0 * vy * np.sin(0.07 * t)
        total += look.glare_level * np.outer(
            np.exp(-0.5 * ((rows - py) / (0.6 * sigma)) ** 2), np.exp(-0.5 * ((columns - px) / sigma) ** 2)
        ).astype(np.float32)
    return total


def _cover(look, points, steps, rest):
    """Return how much of each pixel markers cover, smeared along their motion while the shutter is open."""
    cover = np.zeros(look.shape, dtype=np.float32)
    middle = 0.5 * np.array(look.shape[::-1])
    reach = np.linalg.norm(rest - middle, axis=1).max(initial=1.0)
    for point, step, place in zip(points, steps, rest, strict=True):
        smear = look.exposure * float(np.hypot(*step))
        parts = 1 + int(np.ceil(smear))
        squeeze = 1.0 - look.foreshortening * (np.hypot(*(place - middle)) / reach) ** 2
        for part in range(parts):
            here = point + look.exposure * step * ((part + 0.5) / parts)
            _disk(cover, here, look, place - middle, squeeze, 1.0 / parts)
    return cover.clip(0.0, 1.0)


def _disk(  # noqa: PLR0917
    cover, here, look, outwards, squeeze, share
):
    side = int(look.radius + 4.0 * look.blur + 3.0)
    column, row = np.rint(here).astype(int)
    top, left = max(row - side, 0), max(column - side, 0)
    patch = cover[top : row + side + 1, left : column + side + 1]
    if not patch.size:
        return
    y = np.arange(top, top + patch.shape[0])[:, None] - here[1]
    x = np.arange(left, left + patch.shape[1])[None, :] - here[0]
    if squeeze < 1.0:
        ex, ey = outwards / max(np.hypot(*outwards), 1e-9)
        radial, along = (x * ex + y * ey) / squeeze, -x * ey + y * ex
        x, y = radial, along
    # A pixel is a box of variance 1/12.
    patch += share * 0.5 * (1.0 - erf((np.hypot(x, y) - look.radius) / (np.sqrt(2.0) * np.hypot(look.blur, 0.29))))


def tutorial_slides():
    """Return twelve analytic slides, deeper than those of the tutorial, by name: pins slip alone, leap and touch."""
    return {trial.name: trial for trial in synthetic_slides((3e-3, 4e-3), 3, 2, sensor=SMALL_SENSOR, travel=6e-3)}


SMALL_SENSOR = SyntheticSensor(metres_per_pixel=120e-6)


def seen_by(trial, kind):
    """Return where the markers of a kind are in the frames of a film of a trial (t, n, 2) [px]."""
    position = trial.tracks["position"].values[:, trial.tracks["kind"].values == kind]
    return position - np.array(CENTRE) + [159.5, 119.5]


@dataclass(frozen=True)
class Score:
    """How tracks compare with the truth."""

    rms: float  # px, of what was kept
    worst: float
    kept: float  # share of the marker-frames that could be seen, within 1 px of the truth
    stray: int  # marker-frames with a position more than 1 px off
    swapped: int  # marker-frames nearer to the truth of another marker
    swapped_last: int  # markers that are another one in the last frame


def scored(position, truth, hidden=None):
    """Compare positions (t, n, 2) with the truth (t, n, 2), both in the same order of markers."""
    error = np.linalg.norm(position - truth, axis=2)
    seen, shown = np.isfinite(error), np.ones(error.shape, dtype=bool) if hidden is None else ~hidden
    good = seen & (error < 1.0)
    apart = np.linalg.norm(position[:, :, None] - truth[:, None], axis=3)
    nearest = np.where(seen, np.where(np.isfinite(apart), apart, np.inf).argmin(axis=2), -1)
    other = seen & (nearest != np.arange(truth.shape[1]))
    difference = (position - truth)[good]
    return Score(
        rms=float(np.sqrt(np.mean(difference**2))) if good.any() else np.nan,
        worst=float(error[seen].max()) if seen.any() else np.nan,
        kept=float((good & shown).sum() / shown.sum()),
        stray=int((seen & ~good).sum()),
        swapped=int(other.sum()),
        swapped_last=int(other[-1].sum()),
    )


def in_true_order(position, truth):
    """Return positions (t, n, 2) with markers as in the truth, matched at rest; NaN for markers without a track."""
    from scipy.optimize import linear_sum_assignment

    tracks = position[:10].transpose(1, 0, 2)
    start = np.array([np.nanmedian(track, axis=0) if np.isfinite(track).any() else [1e6, 1e6] for track in tracks])
    rows, columns = linear_sum_assignment(np.linalg.norm(start[:, None] - truth[0][None], axis=2).clip(0, 50.0))
    out = np.full(truth.shape, np.nan)
    for row, column in zip(rows, columns, strict=True):
        if np.linalg.norm(start[row] - truth[0, column]) < 5.0:
            out[:, column] = position[: len(truth), row]
    return out


def with_look(look, **changes):
    """Return a look with some changes."""
    return dataclasses.replace(look, **changes)  # type: ignore[arg-type]
