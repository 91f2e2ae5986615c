"""The pixel camera: frames of markers with every fault of real ones, and where the markers truly are in them."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numba
import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Singles
from fingerslip.libraries import xr
from fingerslip.parameters import Angle, Fraction, NonNegativeNumber, Number, PositiveLength, Rate, parameters
from fingerslip.units import Unit
from fingerslip.vision.cameras.camera import (
    Camera,
    frame_times,
    image_points,
    interpolate,
    pixels_per_metre,
    seen_kind,
    true_tracks,
)
from fingerslip.vision.cameras.intrinsics import PositiveNumber
from fingerslip.vision.video import Frame, opencv, write_video

GreyLevel = Annotated[Number, pydantic.Field(ge=0, le=255)]
Softness = Annotated[Number, pydantic.Field(ge=0.5, le=100)]
Change = Annotated[float, Unit("1/s")]


@parameters
class MarkerLook:
    """What markers look like: round spots of one grey level on a background of another, with soft edges.

    See :func:`film`.
    """

    radius: Annotated[PositiveLength, "Radius of a marker [m]; 0.6 mm, assumed."] = 0.6e-3
    marker: Annotated[GreyLevel, "Grey levels from 0 to 255 in full light; 200 on 40, assumed."] = 200.0
    background: Annotated[GreyLevel, "Grey levels from 0 to 255 in full light; 200 on 40, assumed."] = 40.0
    softness: Annotated[
        Softness,
        "Standard deviation of the blur by the lens and the area of a pixel together [px]; 0.7, assumed. At least 0.5: "
        "with it the middle of a drawn spot is off by up to 0.0025 px, with 0.7 by up to 0.0002 px, if its radius is "
        "above 2 px; a radius of 0.5 px is off by 0.01 px.",
    ] = 0.7
    dome: Annotated[
        PositiveLength | None,
        "Radius of the dome that the markers stand on [m], its axis that of the camera: towards the rim they are seen "
        "from the side. Without it all are seen from the front.",
    ] = None
    glue: Annotated[
        Fraction, "Share of the markers beside which a spot of glue, as bright as they are, touches them [-]."
    ] = 0.0


BRIGHT_ON_DARK = MarkerLook()
DARK_ON_BRIGHT = MarkerLook(marker=50.0, background=190.0)
#: White pins moulded into a dark dome, as in recordings of real sensors: on a slope, blurred, some with glue.
MOULDED = MarkerLook(marker=205.0, background=85.0, softness=1.3, dome=20e-3, glue=0.15)


@parameters
class Glare:
    """A round spot of reflected light that stays where it is.

    See :func:`film`.
    """

    x: Annotated[Fraction, "Its middle, as shares of the width and the height of the image [-]."]
    y: Annotated[Fraction, "Its middle, as shares of the width and the height of the image [-]."]
    radius: Annotated[
        PositiveNumber,
        "Distance at which it falls to 61 % (a Gaussian's standard deviation), as a share of the width [-].",
    ] = 0.02
    level: Annotated[NonNegativeNumber, "Grey levels that it adds in its middle."] = 150.0


@parameters
class BrightRing:
    """A bright ring around the markers, as the rim of a lit sensor.

    See :func:`film`.
    """

    radius: Annotated[PositiveNumber, "Its radius around the middle of the image, as a share of the height [-]."] = 0.46
    width: Annotated[PositiveNumber, "Standard deviation across the ring, as a share of the height [-]."] = 0.012
    level: Annotated[NonNegativeNumber, "Grey levels that it adds on its line."] = 180.0
    outside: Annotated[
        GreyLevel | None, "Grey level of all that is outside of it, as of a white mount; without it as inside."
    ] = None


@parameters
class Lighting:
    """The light: even by default, each fault of it a switch.

    See :func:`film`.
    """

    vignetting: Annotated[
        Fraction,
        "Share of the light that is lost in the corners [-]; the loss grows with the squared distance from the middle.",
    ] = 0.0
    gradient: Annotated[Number, "Relative change of the light over the width of the image [-]."] = 0.0
    gradient_angle: Annotated[Angle, "Direction in which it brightens, from x towards y of the image [rad]."] = 0.0
    texture: Annotated[
        NonNegativeNumber, "Standard deviation of a pattern of the background that stays [grey levels]."
    ] = 0.0
    texture_length: Annotated[PositiveNumber, "Length over which that pattern changes [px]."] = 8.0
    glare: Annotated[tuple[Glare, ...], "Spots of reflected light."] = ()
    ring: Annotated[BrightRing | None, "A bright ring."] = None
    drift: Annotated[Change, "Relative change of brightness a second [1/s]."] = 0.0
    flicker: Annotated[Fraction, "Amplitude of a periodic change of brightness [-]."] = 0.0
    flicker_rate: Annotated[Rate, "Its frequency [1/s]; 100, twice that of mains in Europe."] = 100.0


#: Light as bad as that of real sensors may be; assumed, made to try trackers.
HARSH_LIGHT = Lighting(
    vignetting=0.5,
    gradient=0.4,
    gradient_angle=0.25 * math.pi,
    texture=6.0,
    glare=(Glare(0.36, 0.40), Glare(0.62, 0.56, 0.03, 120.0), Glare(0.55, 0.22, 0.015, 200.0)),
    ring=BrightRing(),
    drift=0.002,
    flicker=0.02,
)

#: Light as in recordings of real sensors: six lamps that saturate around the markers, and a white mount; assumed.
LAMPS = Lighting(
    vignetting=0.5,
    gradient=0.3,
    gradient_angle=0.25 * math.pi,
    texture=10.0,
    glare=tuple(
        Glare(0.5 + 0.24 * math.cos(angle), 0.5 + 0.32 * math.sin(angle), 0.018, 350.0)
        for angle in np.linspace(0.5, 0.5 + 2.0 * math.pi, 6, endpoint=False).tolist()
    ),
    ring=BrightRing(0.38, 0.012, 220.0, outside=245.0),
    flicker=0.01,
)


@parameters
class SensorNoise:
    """Random noise of the image sensor, new in every pixel of every frame.

    See :func:`film`.
    """

    read: Annotated[NonNegativeNumber, "Standard deviation in the dark [grey levels]; 2, assumed."] = 2.0
    shot: Annotated[NonNegativeNumber, "Variance that each grey level of light adds [grey levels]; 0, assumed."] = 0.0


@parameters
class PixelCamera:
    """A camera that takes pictures.

    See :func:`film`.
    """

    camera: Annotated[Camera, "Lens, place and times."]
    look: Annotated[MarkerLook, "Markers and background."] = BRIGHT_ON_DARK
    lighting: Annotated[Lighting, "The light."] = Lighting()
    noise: Annotated[SensorNoise, "Noise of the image sensor."] = SensorNoise()
    jpeg_quality: Annotated[
        Annotated[int, pydantic.Field(ge=1, le=100)] | None,
        "Quality from 1 to 100 of the compression that each frame goes through; none by default.",
    ] = None
    seed: Annotated[
        int,
        pydantic.Field(ge=0, lt=2**63),
        "Seed of everything random: the same seed gives the same frames, whatever part of them is taken.",
    ] = 0


_REACH = 4.0  # standard deviations of the edge, beyond which a spot covers 3e-5 of a pixel
_RIM = 3.0  # standard deviations of the bright ring from its line to what is outside
_STEEPEST = 0.95  # largest sine of the slope of a dome
_CHUNK = 64  # frames whose spots are computed together
_SAMPLES_PER_PIXEL, _MOST_SAMPLES = 2.0, 512
_BITS = 16
# The constants of SplitMix64 (Steele, Lea & Flood 2014).
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _16 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(_BITS)
_MASK = np.uint64(2**_BITS - 1)


@functools.cache
def normal_table() -> Singles:
    """Return 65,536 equally likely values of a normal distribution of mean 0 and variance 1, rising."""
    from scipy.special import ndtri

    values = ndtri((np.arange(2**_BITS) + 0.5) / 2**_BITS)
    table: Singles = (values / values.std()).astype(np.float32)
    return table


@numba.njit(cache=True, nogil=True)
def draw_spots(  # noqa: PLR0917  numba takes them in order
    picture: Singles, top: Singles, middles: Floats, halves: Floats, radii: Floats, tilts: Floats, softness: float
) -> None:
    """Lay spots over a picture, in place.

    Arrays: picture, top (height, width) [grey levels]; middles, halves (n, 2) [px]; radii (n,) [px]; tilts (n, 2), the
    direction in which a disc leans away times the sine of its angle [-]; softness [px].
    """
    for spot in range(len(middles)):
        x, y, dx, dy = middles[spot, 0], middles[spot, 1], halves[spot, 0], halves[spot, 1]
        reach = radii[spot] + _REACH * softness
        if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(dx) and math.isfinite(dy)):
            continue
        lean_x, lean_y = tilts[spot, 0], tilts[spot, 1]
        front = 1.0 - lean_x * lean_x - lean_y * lean_y  # squared cosine of the angle
        length = 2.0 * math.hypot(dx, dy)
        count = min(1 + math.ceil(_SAMPLES_PER_PIXEL * length), _MOST_SAMPLES)
        left, right = _limits(x, abs(dx) + reach, picture.shape[1])
        upper, lower = _limits(y, abs(dy) + reach, picture.shape[0])
        for row in range(upper, lower):
            for column in range(left, right):
                covered = 0.0
                for sample in range(count):
                    share = (2.0 * sample + 1.0) / count - 1.0
                    across, down = column - x - share * dx, row - y - share * dy
                    square, lean = across * across + down * down, (across * lean_x + down * lean_y) ** 2
                    # Distance on the disc; how fast it grows in the image turns it into pixels.
                    off = math.sqrt(square + lean / front)
                    growth = math.sqrt(square + lean * (1.0 + front) / (front * front))
                    covered += _cover((off - radii[spot]) * (off / growth if growth > 0.0 else 1.0), softness)
                covered /= count
                picture[row, column] += np.float32(covered) * (top[row, column] - picture[row, column])


@numba.njit(cache=True, nogil=True)
def _limits(middle: float, reach: float, size: int) -> tuple[int, int]:
    """Return the first pixel within reach and the one behind the last, inside the picture."""
    first, last = math.ceil(max(middle - reach, 0.0)), math.floor(min(middle + reach, size - 1.0))
    return int(first), int(last) + 1


@numba.njit(cache=True, nogil=True)
def _cover(outside: float, softness: float) -> float:
    """Return the share of a pixel that a blurred edge covers, at a distance outside it [px]."""
    if outside > _REACH * softness:
        return 0.0
    if outside < -_REACH * softness:
        return 1.0
    return 0.5 * math.erfc(outside / (math.sqrt(2.0) * softness))


@numba.njit(cache=True, nogil=True)
def _mix(state: np.uint64) -> np.uint64:
    """Return the random bits of a state (Steele, Lea & Flood 2014)."""
    state = (state ^ (state >> _30)) * _FIRST
    state = (state ^ (state >> _27)) * _SECOND
    return state ^ (state >> _31)


@numba.njit(cache=True, nogil=True)
def expose(  # noqa: PLR0917  numba takes them in order
    picture: Singles, factor: float, read: float, shot: float, seed: int, number: int, table: Singles
) -> NDArray[np.uint8]:
    """Return what a sensor makes of light: noise added, and whole grey levels from 0 to 255.

    Arrays: picture (height, width) [grey levels]; factor [-]; read [grey levels squared]; shot [grey levels]; table
    (65536,).
    """
    frame = np.empty(picture.shape, dtype=np.uint8)
    light, levels = picture.ravel(), frame.ravel()
    plain = math.sqrt(read)
    key = _mix(_mix(np.uint64(seed) + _GOLDEN) + np.uint64(number) * _GOLDEN)
    bits = key
    for pixel in range(light.size):
        if pixel % 4 == 0:
            bits = _mix(key + np.uint64(pixel // 4 + 1) * _GOLDEN)
        value = factor * light[pixel]
        deviation = plain if shot == 0.0 else math.sqrt(read + shot * max(value, 0.0))
        value += deviation * table[bits & _MASK] + 0.5
        bits >>= _16
        levels[pixel] = np.uint8(min(max(value, 0.0), 255.0))
    return frame


def pictures(pixel_camera: PixelCamera) -> tuple[Singles, Singles]:
    """Return grey levels (height, width) without markers, noise and changes over time, and of markers everywhere."""
    look, lighting = pixel_camera.look, pixel_camera.lighting
    lens, ring = pixel_camera.camera.intrinsics, lighting.ring
    # x and y of all pixels from the middle of the image [px].
    x = np.arange(lens.width)[None, :] - 0.5 * (lens.width - 1)
    y = np.arange(lens.height)[:, None] - 0.5 * (lens.height - 1)
    lost = lighting.vignetting * (x * x + y * y) / max(x[0, -1] ** 2 + y[-1, 0] ** 2, 1.0)
    along = (x * math.cos(lighting.gradient_angle) + y * math.sin(lighting.gradient_angle)) / x.size
    light = np.maximum((1.0 - lost) * (1.0 + lighting.gradient * along), 0.0)
    added = np.zeros((y.size, x.size))
    for spot in lighting.glare:
        across, down = x - (spot.x - 0.5) * x.size, y - (spot.y - 0.5) * y.size
        added += spot.level * np.exp(-0.5 * (across * across + down * down) / (spot.radius * x.size) ** 2)
    if ring is not None:
        off = (np.hypot(x, y) / y.size - ring.radius) / ring.width
        added += ring.level * np.exp(-0.5 * off**2)
    background: float | Floats = look.background
    if lighting.texture:
        from scipy import ndimage

        random = np.random.default_rng([pixel_camera.seed, 1]).standard_normal(light.shape)
        pattern = ndimage.gaussian_filter(random, lighting.texture_length, mode="wrap")
        background = background + pattern * (lighting.texture / pattern.std())
    empty = light * background + added
    if ring is not None and ring.outside is not None:
        # A dark rim is left between the ring and what is outside.
        empty += np.clip(off - _RIM, 0.0, 1.0) * (ring.outside - empty)
    return empty.astype(np.float32), (light * look.marker + added).astype(np.float32)


def brightness(lighting: Lighting, times: Floats) -> Floats:
    """Return the factors [-] by which light is brighter at some times [s] than at the time 0, without flicker."""
    wave = lighting.flicker * np.sin(2.0 * math.pi * lighting.flicker_rate * times)
    return np.asarray(np.maximum(1.0 + lighting.drift * times + wave, 0.0))


def film(pixel_camera: PixelCamera, tracks: xr.Dataset, path: str | Path, *, codec: str | None = None) -> xr.Dataset:
    """Film markers, write the video whole or not at all, and return where the markers truly are in it.

    Parameters
    ----------
    pixel_camera : PixelCamera
        The camera.
    tracks : xarray.Dataset
        Tracks in metres. A marker that is NaN is not drawn.
    path : path
        A video file or a folder; see :func:`~fingerslip.vision.video.write_video`.
    codec : str, optional
        Codec of the file.

    Returns
    -------
    xarray.Dataset
        True tracks in pixels, as of :func:`~fingerslip.vision.cameras.camera.true_tracks`.

    Raises
    ------
    InputError
        Where the tracks are not in metres, have no time, or have no marker that the camera sees.
    ResultError
        Where the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import fingerslip as fs
    >>> light = fs.Lighting(vignetting=0.3, glare=(fs.Glare(x=0.3, y=0.4),), ring=fs.BrightRing())
    >>> camera = fs.internal_camera(50e-3, 40e-3, frame_rate=10.0)
    >>> filming = fs.PixelCamera(camera, fs.MarkerLook(radius=0.5e-3), light, fs.SensorNoise(read=1.0), seed=1)
    >>> tracks = fs.make_tracks([[[0.0, 0.0, 0.0]], [[1e-3, 0.0, 0.0]]], [0.0, 1.0], units="m")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     truth = fs.film(filming, tracks, f"{folder}/slide.mkv")
    >>> truth.sizes["time"], truth["position"][-1, 0].values.round(3).tolist()
    (11, [335.5, 239.5])
    """
    truth = true_tracks(pixel_camera.camera, tracks)
    write_video(path, frames_of(pixel_camera, tracks), pixel_camera.camera.frame_rate, codec=codec)
    return truth.assign_attrs(source=f"truth of {Path(path).name}")


def frames_of(
    pixel_camera: PixelCamera, tracks: xr.Dataset, *, start: int = 0, stop: int | None = None
) -> Iterator[Frame]:
    """Yield the frames (height, width) that a camera takes of tracks in metres, from `start` to before `stop`.

    Each is as in the whole video. A marker that is NaN is not drawn. During the exposure a marker moves straight and
    evenly, half of the way before the time of the frame, so that the middle of its spot is its true position then.
    Raises InputError where the tracks are not in metres, or have no marker that the camera sees.
    """
    camera, noise, seed = pixel_camera.camera, pixel_camera.noise, pixel_camera.seed
    softness = pixel_camera.look.softness
    chosen = seen_kind(camera, tracks)
    empty, covered = pictures(pixel_camera)
    times = frame_times(camera, chosen)
    last = times.size if stop is None else min(stop, times.size)
    for first in range(start, last, _CHUNK):
        numbers = np.arange(first, min(first + _CHUNK, last))
        middles, halves, radii, tilts = _spots(pixel_camera, chosen, times[numbers])
        factors = brightness(pixel_camera.lighting, times[numbers]).tolist()
        for row, number in enumerate(numbers.tolist()):
            picture = empty.copy()
            draw_spots(picture, covered, middles[row], halves[row], radii[row], tilts[row], softness)
            frame: Frame = expose(picture, factors[row], noise.read**2, noise.shot, seed, number, normal_table())
            if pixel_camera.jpeg_quality is not None:
                cv2 = opencv()
                content = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, pixel_camera.jpeg_quality])[1]
                frame = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE)
            yield frame


def _spots(pixel_camera: PixelCamera, tracks: xr.Dataset, times: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what :func:`draw_spots` draws of markers and of glue beside some, one row of each for each time [s]."""
    camera, look = pixel_camera.camera, pixel_camera.look
    points = interpolate(tracks, times)
    middles, radii = image_points(camera, points), look.radius * pixels_per_metre(camera, points)
    first, last = tracks["time"].values[[0, -1]]
    opened, closed = (np.clip(times + side * camera.exposure, first, last) for side in (-0.5, 0.5))
    movement = image_points(camera, interpolate(tracks, closed)) - image_points(camera, interpolate(tracks, opened))
    # At both ends of the tracks half of the exposure lies outside: the speed is that of the other half.
    span = np.where(closed > opened, closed - opened, np.inf)[:, None, None]
    halves = np.nan_to_num(0.5 * camera.exposure * movement / span)
    tilts = np.zeros_like(middles)
    if look.dome is not None:
        outwards = camera.pose.to_camera(points)[..., :2] / look.dome
        tilts = outwards / np.maximum(np.linalg.norm(outwards, axis=-1, keepdims=True) / _STEEPEST, 1.0)
    share, angle, distance, size = np.random.default_rng([pixel_camera.seed, 4]).random((4, radii.shape[1]))
    away = (0.8 + 0.8 * distance)[:, None] * np.column_stack([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)])
    glue = middles + away * radii[..., None], halves, (0.3 + 0.6 * size) * radii, tilts
    pairs = zip((middles, halves, radii, tilts), glue, strict=True)
    middles, halves, radii, tilts = (np.concatenate([of, by[:, share < look.glue]], axis=1) for of, by in pairs)
    return middles, halves, radii, tilts
