"""Draws what `hil bench vision` has measured into docs/vision.md.

`python -m tests.docs.vision FILE...` takes what `hil bench vision --json` has printed, and what pieces of it
(`--scenes`, `--drawn`) have, keeps that in tests/data/vision_bench.json and writes the lines between the
page's marks; without a file it draws what is kept. `--page` takes what `hil bench vision --page` has written
and puts its pictures together in docs/vision-worst.webp.
"""

from __future__ import annotations

import argparse
import base64
import html
import json
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hil.tools import drawn_look_alikes
from hil.tools.bench_peers import Line, as_markdown
from hil.tools.drawn_look_alikes import Drawn
from hil.tools.look_alikes import Empty, most_ratio, together

ROOT = Path(__file__).resolve().parents[2]
PAGE, KEPT = ROOT / "docs" / "vision.md", ROOT / "tests" / "data" / "vision_bench.json"
WORST = ROOT / "docs" / "vision-worst.webp"
COLUMNS, PICTURE_PX, WORDS_PX = 5, (288, 144), 18
GOAL_FRAMES = 100_000
END = "<!-- figures: end -->\n"


def begin(part: str) -> str:
    """Return the mark before a part of the page."""
    return f"<!-- {part}: drawn by python -m tests.docs.vision -->\n"


def peers(found: list[Line]) -> str:
    """Return how many frames a line there are, and the table of all methods."""
    frames = sorted({line.frames for line in found})
    return f"{' or '.join(map(str, frames))} frames a line:\n\n{as_markdown(found)}\n"


def empty(found: Empty) -> str:
    """Return what scenes without the robot have shown, with what it says of all such scenes and frames."""
    frames = most_ratio(found.accepted, found.frames)
    scenes = most_ratio(len(found.taken_in), found.scenes)
    goal = "met" if found.frames >= GOAL_FRAMES and not found.accepted else "not met"
    named = f" (scene {', '.join(map(str, found.taken_in))})" if found.taken_in else ""
    return (
        f"Of {found.frames:,} frames without the robot, in {found.scenes:,} scenes, {found.accepted:,}"
        f" were accepted, and of {found.with_robot:,} with it among look-alikes {found.found:,} had its"
        f" pose and {found.wrong:,} another. Scenes in which something else was taken for it:"
        f" {len(found.taken_in)}{named}."
        f" With 95 % confidence that is less than {_share(frames)} of such frames, were each a draw of its"
        f" own, and less than {_share(scenes)} of such scenes, which are. The goal, none in"
        f" {GOAL_FRAMES:,} frames, is {goal}.\n"
    )


def drawn_flat(found: Drawn) -> str:
    """Return how many drawn scenes there are, what was taken for the robot in them, and the table by kind."""
    most = most_ratio(found.accepted, found.scenes)
    return (
        f"{found.scenes:,} scenes ({found.equals} more held an equal of the robot and were left out), in"
        f" {found.accepted} of which something was taken for it; with 95 % confidence that is less than"
        f" {_share(most)} of such scenes:\n\n{drawn_look_alikes.as_markdown(found)}\n"
    )


def drawn_of_data(data: dict[str, Any]) -> Drawn:
    """Return the counts of drawn scenes that JSON holds."""
    kinds = tuple((kind, shown, taken) for kind, shown, taken in data["kinds"])
    return Drawn(kinds, data["equals"], tuple(data["taken_in"]))


def _share(ratio: float) -> str:
    return f"{100.0 * ratio:.2g} %"


def drawn(page: str, data: dict[str, Any]) -> str:
    """Return a page with what was measured between its marks."""
    parts = {
        "peers": peers([Line.of_data(line) for line in data["peers"]]),
        "without the robot": empty(of_data(data["empty_scenes"])),
        "drawn flat": drawn_flat(drawn_of_data(data["drawn_scenes"])),
    }
    for part, text in parts.items():
        before, rest = page.split(begin(part))
        _, after = rest.split(END, 1)
        page = f"{before}{begin(part)}{text}{END}{after}"
    return page


def of_data(data: dict[str, Any]) -> Empty:
    """Return the counts that JSON holds."""
    return Empty(**{
        **data,
        "accepted_by": tuple((kind, count) for kind, count in data["accepted_by"]),
        "taken_in": tuple(data["taken_in"]),
    })  # fmt: skip


def kept(files: list[Path]) -> dict[str, Any]:
    """Return the lines beside peers, of the last file that has them, and all scenes together.

    What no file has is that which is kept.
    """
    data: dict[str, Any] = json.loads(KEPT.read_text(encoding="utf-8"))
    found = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    pieces = [of_data(document["empty_scenes"]) for document in found if "empty_scenes" in document]
    flat = [drawn_of_data(one["drawn_scenes"]) for one in found if "drawn_scenes" in one]
    for document in found:
        data["peers"] = document.get("peers", data["peers"])
    if pieces:
        data["empty_scenes"] = asdict(together(pieces))
    if flat:
        data["drawn_scenes"] = asdict(drawn_look_alikes.together(flat))
    return data


def worst(page: str) -> bytes:
    """Return the pictures of a page of the bench side by side, packed as WebP, each over its words."""
    found = re.findall(r"base64,([^']+)'><figcaption>([^<]+)<", page)
    cells = [_cell(base64.b64decode(packed), html.unescape(words)) for packed, words in found]
    cells += [np.full_like(cells[0], 255)] * (-len(cells) % COLUMNS)
    rows = [np.hstack(cells[k : k + COLUMNS]) for k in range(0, len(cells), COLUMNS)]
    _, packed = cv2.imencode(".webp", np.vstack(rows), [cv2.IMWRITE_WEBP_QUALITY, 80])
    return packed.tobytes()


def _cell(packed: bytes, words: str) -> Any:
    image = cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_COLOR)
    image = cv2.resize(image, PICTURE_PX, interpolation=cv2.INTER_AREA)
    image = cv2.copyMakeBorder(image, 0, WORDS_PX, 0, 4, cv2.BORDER_CONSTANT, value=(255, 255, 255))
    short = words.replace(", coloured floor", ", colours").replace(" claimed", "")
    at = (2, PICTURE_PX[1] + WORDS_PX - 6)
    return cv2.putText(image, short, at, cv2.FONT_HERSHEY_SIMPLEX, 0.33, (0, 0, 0), 1, cv2.LINE_AA)


def main() -> None:
    """Keep what was measured, then draw."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("files", nargs="*", type=Path)
    options.add_argument("--page", type=Path)
    asked = options.parse_args()
    files = asked.files
    if asked.page is not None:
        WORST.write_bytes(worst(asked.page.read_text(encoding="utf-8")))
    if files:
        text = json.dumps(kept(files), indent=1, allow_nan=False)
        KEPT.write_text(f"{text}\n", encoding="utf-8")
    data = json.loads(KEPT.read_text(encoding="utf-8"))
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8"), data), encoding="utf-8")


if __name__ == "__main__":
    main()
