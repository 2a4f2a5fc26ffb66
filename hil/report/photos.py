"""Photographs of a run in a report: small pictures as data."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2

from hil.report.compare import Comparison

_WIDTH_PX = 400
_JPEG_QUALITY = 72


def photos(comparison: Comparison, colours: Sequence[int]) -> list[dict[str, Any]]:
    """Return a strip of pictures for each run that has some: its label, colour and moments."""
    strips = []
    for entry, colour in zip(comparison.entries, colours, strict=True):
        moments = entry.run.moments()
        photos = [
            {
                "moment": moment,
                "time": f"{max(picture.t_s, 0.0):.1f}",
                "uri": _data_uri(picture.path),
            }
            for moment, picture in moments.items()
        ]
        if photos:
            strips.append({"label": entry.label, "colour": colour, "photos": photos})
    return strips


def _data_uri(path: Path) -> str:
    """Return a picture, made small, as a data URI; a file that is no picture becomes empty."""
    image = cv2.imread(str(path))
    if image is None:
        return ""
    height = round(image.shape[0] * _WIDTH_PX / image.shape[1])
    small = cv2.resize(image, (_WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg.tobytes()).decode()}"
