"""From a video to a folder of tracks: what ``fingerslip track`` does."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from fingerslip.storage.files import check_replaceable, folder_beside
from fingerslip.vision.video import frames_text, open_frames


def track_video(
    video: Path,
    out: Path | None,
    options: Mapping[str, Any],
    tell: Callable[[str], object] = lambda _: None,
    *,
    fields: bool = False,
) -> Iterator[str]:
    """Track a video, write the folder, and yield lines that say what came out."""
    if out is not None:
        check_replaceable(out, "tracks.nc")
    frames = open_frames(video, options.get("frame_rate"), options.get("channel", "grey"))
    next(frames.read())  # InputError where there is none
    # The tracker is slow to load, and figures are: what is wrong with a video is said before.
    from fingerslip.vision.tracking.track import TrackingWarning, track_markers

    tell(f"{video}: following its markers")
    with warnings.catch_warnings():
        # The lines below say the same.
        warnings.simplefilter("ignore", TrackingWarning)
        tracks = track_markers(video, **options)
    from fingerslip.report.page.sensor import source_of_tracking, write_tracking
    from fingerslip.vision.fields import marker_fields
    from fingerslip.vision.overlay import SHOWN_FIELDS
    from fingerslip.vision.tracking.track import seen_share
    from fingerslip.vision.tracks import seen

    rest = int(tracks.attrs["rest_frames"])
    computed = marker_fields(tracks, rest=rest) if fields else None
    tell(f"{video}: writing {tracks.sizes['time']} frames, overlay and page")
    folder = out or folder_beside(video, "tracks", source_of_tracking)
    is_there = folder.exists()
    write_tracking(tracks, frames, folder, fields=computed)
    for text in filter(None, str(tracks.attrs["warnings"]).split("\n")):
        yield f"warning: {text}"
    count = tracks.sizes["marker"]
    length = frames_text(tracks.sizes["time"], frames, options.get("frame_rate"))
    partial = "partial tracks" if tracks.attrs["partial"] else "tracks"
    still = int(tracks["still"].sum()) if "still" in tracks else 0
    beside = f"; {still} do not move with their neighbours: reflections, or markers that stick beside slip" * (
        still > 0
    )
    followed, visible = 100 * float(seen(tracks).mean()), 100 * seen_share(tracks)
    found = f"{followed:.2f} % of the positions found"
    if visible < followed:
        found += f", {visible:.2f} % of those of all visible markers"
    yield f"{partial} of {count} markers in {length}, {found}, at rest in the first {rest}{beside}"
    yield f"quality: {folder / 'quality.html'}{', which was replaced' if is_there else ''}"
    if computed is not None:
        yield f"fields: {folder / 'fields.nc'}, fields.png, {', '.join(f'{name}.avi' for name in SHOWN_FIELDS)}"
