"""What a live camera is set to: the same settings in a run's `[camera.controls]` and on the Set-up page."""

from __future__ import annotations

from pydantic import Field

from hil.config.base import Section, quantity

_DRIVER = "in the driver's own unit; left out: locked at what its automatics chose"


class ControlsConfig(Section):
    """Controls of a live camera (`--camera 0`), locked for the run; the twin's camera has none.

    What is asked for is read back, and what is not in force is said in the run's events.
    """

    exposure: float | None = quantity(
        "(driver)", f"{_DRIVER}; V4L2's is 100 us, other drivers' the logarithm of seconds", None,
        ge=-20.0, le=100_000.0, source="the camera",
    )  # fmt: skip
    gain: float | None = quantity(
        "(driver)", _DRIVER, None, ge=-1000.0, le=100_000.0, source="the camera"
    )  # fmt: skip
    white_balance_k: float | None = quantity(
        "K", "colour temperature; left out: locked at what its automatics chose", None,
        ge=0.0, le=100_000.0, source="the camera",
    )  # fmt: skip
    focus: float | None = quantity(
        "(driver)", _DRIVER, None, ge=0.0, le=100_000.0, source="the camera"
    )  # fmt: skip
    raw: bool = Field(
        False,
        description="uncompressed pictures (YUYV) and not motion JPEG; 720p at 30 Hz needs USB 3",
    )
