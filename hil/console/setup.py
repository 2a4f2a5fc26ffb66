"""What the Set-up page asks for: doctor, and the calibration of a camera from pictures given to it.

Each step runs the command of the same name, so that the files are those that the command writes. Pictures and
files lie in `set-up` of the records folder.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import FileResponse, Response

from hil.console.answers import answer_json, body_of
from hil.console.folders import Folders, confined
from hil.console.set_up_files import BOARD, CAMERA_FILE, DRAWN, PICTURES, SETS, SUFFIXES
from hil.console.tasks import required
from hil.core.errors import BadInput
from hil.core.files import replace_file
from hil.core.text import visible

if TYPE_CHECKING:
    from hil.console.shared import Answer, Console

_PICTURE_BYTES = 40_000_000
_PICTURES_MOST = 200
_NAME = re.compile(r"[\w][\w .()+-]{0,118}", re.ASCII)


def _folder(folders: Folders, which: object) -> Path:
    if which not in SETS:
        raise BadInput(f"pictures: {which!r}: choose {', '.join(SETS)}")
    folder = folders.set_up / PICTURES / str(which)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _pictures(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir() if file.suffix.lower() in SUFFIXES)


def _picture_name(name: str) -> str:
    if not _NAME.fullmatch(name) or Path(name).suffix.lower() not in SUFFIXES:
        raise BadInput(
            f"picture {visible(name)}: letters, digits and . - _ only, and one of {', '.join(SUFFIXES)}"
        )
    return name


async def _take_picture(request: Request, console: Console) -> Response:
    """Keep one picture that a page sent."""
    folder = _folder(console.folders, request.query_params.get("set"))
    name = _picture_name(request.query_params.get("name", ""))
    if len(_pictures(folder)) >= _PICTURES_MOST:
        raise BadInput(f"pictures: {_PICTURES_MOST} are there already; clear them first")
    data = bytearray()
    async for part in request.stream():
        data += part
        if len(data) > _PICTURE_BYTES:
            raise BadInput(f"picture {name}: more than {_PICTURE_BYTES} bytes")
    replace_file(folder / name, bytes(data))
    return answer_json({"pictures": _pictures(folder)})


async def _clear(request: Request, console: Console) -> Response:
    folder = _folder(console.folders, (await body_of(request)).get("set"))
    for name in _pictures(folder):
        (folder / name).unlink()
    return answer_json({"pictures": []})


async def _show_pictures(request: Request, console: Console) -> Response:
    folder = _folder(console.folders, request.query_params.get("set"))
    camera = console.folders.set_up / CAMERA_FILE
    return answer_json(
        {
            "pictures": _pictures(folder),
            "camera_file": console.folders.name_of(camera) if camera.is_file() else "",
            "text": camera.read_text(encoding="utf-8") if camera.is_file() else "",
        }
    )


async def _show_file(request: Request, console: Console) -> Response:
    """Return a picture of the set-up folder."""
    file = confined(console.folders.set_up, request.query_params.get("name", ""))
    if not file.is_file() or file.suffix.lower() not in SUFFIXES:
        raise BadInput(f"{visible(file.name)}: no such picture")
    return FileResponse(file)


async def _doctor(_request: Request, console: Console) -> Response:
    return answer_json(json.loads(required(await console.tasks.hil("doctor", "--json")).out))


async def _calibrate(request: Request, console: Console) -> Response:
    """Run `hil calibrate camera|floor|colours` on the pictures given."""
    tree = await body_of(request)
    step = str(tree.get("step", ""))
    makers = {"lens": _lens, "floor": _floor, "colours": _colours}
    if step not in makers:
        raise BadInput(f"calibrate: {visible(step)!r}: choose {', '.join(makers)}")
    folders = console.folders
    camera = folders.set_up / CAMERA_FILE
    drawn = folders.set_up / DRAWN
    drawn.mkdir(exist_ok=True)
    words = [*makers[step](tree, folders), "--camera-file", str(camera), "--json"]
    picture = drawn / f"{step}.png"
    if step != "colours":
        words += ["--picture", str(picture)]
    said = required(await console.tasks.hil("calibrate", *words))
    return answer_json(
        {
            "found": json.loads(said.out),
            "log": said.err.strip().splitlines()[-_PICTURES_MOST:],
            "picture": f"{DRAWN}/{picture.name}" if step != "colours" else "",
            "camera_file": folders.name_of(camera),
            "text": camera.read_text(encoding="utf-8"),
        }
    )


def _lens(tree: dict[str, Any], folders: Folders) -> list[str]:
    board = str(tree.get("board", ""))
    if not BOARD.fullmatch(board):
        raise BadInput(
            f"board {visible(board)}: give charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM or "
            "chess:COLUMNSxROWS:SQUARE_MM, in squares"
        )
    folder = _folder(folders, "lens")
    if not _pictures(folder):
        raise BadInput("calibrate: no pictures yet: give 10 to 30 views of the board")
    return ["camera", str(folder), "--board", board]


def _floor(tree: dict[str, Any], folders: Folders) -> list[str]:
    """Write the points that were clicked as the CSV that the command takes."""
    rows = tree.get("points")
    if not isinstance(rows, list) or len(rows) < 4:
        raise BadInput("floor: give at least 4 known points, well spread over the floor")
    lines = ["x_m,y_m,u_px,v_px"]
    lines += [",".join(f"{_number(row, k):.6g}" for k in range(4)) for row in rows[:500]]
    file = folders.set_up / "floor_points.csv"
    replace_file(file, ("\n".join(lines) + "\n").encode())
    words = ["floor", "--points", str(file)]
    fit = str(tree.get("fit_lens", ""))
    if fit:
        if not re.fullmatch(r"\d{2,4}x\d{2,4}", fit):
            raise BadInput(f"floor: image size {visible(fit)}: give WIDTHxHEIGHT")
        words += ["--fit-lens", fit]
        if tree.get("height_m"):
            words += ["--camera-height", f"{_number([tree['height_m']], 0):g}"]
    return words


def _colours(tree: dict[str, Any], folders: Folders) -> list[str]:
    folder = _folder(folders, "colours")
    name = _picture_name(str(tree.get("picture", "")))
    if name not in _pictures(folder):
        raise BadInput(f"colours: picture {name}: not given yet")
    words = ["colours", str(folder / name)]
    for mark in ("front", "rear"):
        at = tree.get(mark)
        words += [f"--{mark}", f"{_number(at, 0):.1f},{_number(at, 1):.1f}"]
    return words


def _number(row: object, place: int) -> float:
    """Return a number of a list that a page sent; raises BadInput."""
    value = row[place] if isinstance(row, list) and len(row) > place else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1e6:
        raise BadInput("not understood: numbers are wanted; click on the picture, fill every field")
    return float(value)


LOOKED_AT: dict[str, Answer] = {
    "/api/doctor": _doctor,
    "/api/pictures": _show_pictures,
    "/api/set-up-file": _show_file,
}
CHANGED: dict[str, Answer] = {
    "/api/picture": _take_picture,
    "/api/clear-pictures": _clear,
    "/api/calibrate": _calibrate,
}
