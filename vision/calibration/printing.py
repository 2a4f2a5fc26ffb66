"""Boards, tags and the robot's marks as SVG or PDF at true scale.

The pattern is drawn as vector rectangles, so that no printer driver resamples it. A ruler of
100 mm stands below it: measure it, and calibrate with the size found when it is not 100 mm.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.sax.saxutils import escape

from hil.core.errors import BadInput
from vision.calibration.boards import Board, Rect
from vision.cv_compat import write_atomic

PAPERS_MM = {
    "a4": (297.0, 210.0),
    "a3": (420.0, 297.0),
    "a2": (594.0, 420.0),
    "letter": (279.4, 215.9),
}
MARGIN_MM = 7.0
FOOT_MM = 14.0
RULER_MM = 100.0
BEZIER_CIRCLE = 0.5522847498
PT_PER_MM = 72.0 / 25.4


@dataclass(frozen=True, slots=True)
class Disc:
    """A filled circle: centre and radius in mm, colour (r, g, b) as shares of full."""

    x_mm: float
    y_mm: float
    radius_mm: float
    rgb: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Sheet:
    """A page: black rectangles and texts in mm, origin at the lower left corner of the paper.

    `discs` lie on the rectangles and `lines`, white rectangles, on both.
    """

    width_mm: float
    height_mm: float
    rects: list[Rect]
    texts: list[tuple[float, float, str]]
    discs: list[Disc] = field(default_factory=list)
    lines: list[Rect] = field(default_factory=list)


def lay_out(board: Board, paper: str, title: str) -> Sheet:
    """Return the board in the middle of a landscape page with ruler, origin mark and title.

    `paper` is a4, a3, a2, letter, or "fit" for a page as large as the board needs.
    """
    wide, high = (n * board.square_m * 1e3 for n in (board.columns, board.rows))
    need = (max(wide, RULER_MM) + 2 * MARGIN_MM, high + 2 * MARGIN_MM + FOOT_MM)
    page = page_for(need, paper, f"board of {wide:g} x {high:g} mm", "smaller squares")
    left = 0.5 * (page[0] - wide)
    bottom = 0.5 * (page[1] - FOOT_MM - high) + FOOT_MM
    rects = [(left + x * 1e3, bottom + y * 1e3, w * 1e3, h * 1e3) for x, y, w, h in board.black()]
    ruler_left = 0.5 * (page[0] - RULER_MM)
    rects += ruler(ruler_left, bottom - 9.0)
    texts = [
        (left, bottom - 4.0, "origin: corner of the pattern above, x right, y up"),
        (ruler_left, bottom - 13.0, f"this line is {RULER_MM:g} mm; {title}"),
    ]
    return Sheet(page[0], page[1], rects, texts)


def page_for(need: tuple[float, float], paper: str, what: str, instead: str) -> tuple[float, float]:
    """Return the size of the page in mm; raises BadInput for one unknown or too small."""
    if paper != "fit" and paper not in PAPERS_MM:
        raise BadInput(f"paper {paper!r}: unknown; one of fit, {', '.join(PAPERS_MM)}")
    page = need if paper == "fit" else PAPERS_MM[paper]
    if need[0] > page[0] or need[1] > page[1]:
        raise BadInput(
            f"{what} needs {need[0]:g} x {need[1]:g} mm of paper; {paper} is {page[0]:g} x"
            f" {page[1]:g} mm: take {instead} or larger paper"
        )
    return page


def ruler(x_mm: float, y_mm: float) -> list[Rect]:
    """Return a line of 100 mm with a tick each 10 mm; its outer edges are 100 mm apart."""
    ticks = [(x_mm + 10.0 * k - (0.3 if k == 10 else 0.0), y_mm, 0.3, 2.0) for k in range(11)]
    return [(x_mm, y_mm, RULER_MM, 0.3), *ticks]


def to_svg(sheet: Sheet) -> str:
    """Return the sheet as SVG; its page size and user unit are millimetres."""
    rects, lines = (
        "".join(
            f'<rect x="{x:.4f}" y="{sheet.height_mm - y - h:.4f}" width="{w:.4f}" height="{h:.4f}"/>\n'
            for x, y, w, h in some
        )
        for some in (sheet.rects, sheet.lines)
    )
    discs = "".join(
        f'<circle cx="{disc.x_mm:.4f}" cy="{sheet.height_mm - disc.y_mm:.4f}" r="{disc.radius_mm:.4f}"'
        f' fill="#{"".join(f"{round(255 * c):02x}" for c in disc.rgb)}"/>\n'
        for disc in sheet.discs
    )
    texts = "".join(
        f'<text x="{x:.3f}" y="{sheet.height_mm - y:.3f}" font-size="3" font-family="sans-serif">'
        f"{escape(text)}</text>\n"
        for x, y, text in sheet.texts
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{sheet.width_mm:g}mm"'
        f' height="{sheet.height_mm:g}mm" viewBox="0 0 {sheet.width_mm:g} {sheet.height_mm:g}">\n'
        f'<rect width="100%" height="100%" fill="white"/>\n'
        f'<g>\n{rects}</g>\n{discs}<g fill="white">\n{lines}</g>\n{texts}</svg>\n'
    )


def to_pdf(sheet: Sheet) -> bytes:
    """Return the sheet as a PDF of one page; the page matrix makes its unit one millimetre."""
    drawing = [f"{PT_PER_MM:.8f} 0 0 {PT_PER_MM:.8f} 0 0 cm 0 g"]
    drawing += [f"{x:.4f} {y:.4f} {w:.4f} {h:.4f} re" for x, y, w, h in sheet.rects]
    drawing.append("f")
    drawing += [_pdf_disc(disc) for disc in sheet.discs]
    drawing += [f"1 g {x:.4f} {y:.4f} {w:.4f} {h:.4f} re f" for x, y, w, h in sheet.lines]
    drawing.append("0 g")
    for x, y, text in sheet.texts:
        safe = text.encode("latin-1", "replace").decode("latin-1")
        safe = safe.replace("\\", "\\\\").replace("(", "\\(").replace(")", "\\)")
        drawing.append(f"BT /F1 3 Tf {x:.3f} {y:.3f} Td ({safe}) Tj ET")
    stream = "\n".join(drawing).encode("latin-1")
    width, height = sheet.width_mm * PT_PER_MM, sheet.height_mm * PT_PER_MM
    return _pdf_file(
        [
            b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            b"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.4f %.4f] /Contents 4 0 R"
            b" /Resources << /Font << /F1 5 0 R >> >> >>" % (width, height),
            b"<< /Length %d >>\nstream\n%s\nendstream" % (len(stream), stream),
            b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
        ]
    )


def _pdf_disc(disc: Disc) -> str:
    """Return a circle as four Bezier arcs, round to 0.03 % of its radius."""
    x, y, r = disc.x_mm, disc.y_mm, disc.radius_mm
    k = BEZIER_CIRCLE * r
    arcs = [
        (x + r, y + k, x + k, y + r, x, y + r),
        (x - k, y + r, x - r, y + k, x - r, y),
        (x - r, y - k, x - k, y - r, x, y - r),
        (x + k, y - r, x + r, y - k, x + r, y),
    ]
    curves = " ".join(" ".join(f"{value:.4f}" for value in arc) + " c" for arc in arcs)
    colour = " ".join(f"{value:.4f}" for value in disc.rgb)
    return f"{colour} rg {x + r:.4f} {y:.4f} m {curves} f"


def _pdf_file(objects: list[bytes]) -> bytes:
    """Return a PDF of the numbered objects with its cross-reference table."""
    out = b"%PDF-1.4\n"
    places = []
    for number, body in enumerate(objects, 1):
        places.append(len(out))
        out += b"%d 0 obj\n%s\nendobj\n" % (number, body)
    table = len(out)
    out += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    out += b"".join(b"%010d 00000 n \n" % place for place in places)
    out += b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (
        len(objects) + 1,
        table,
    )
    return out


def write_sheet(path: Path, sheet: Sheet) -> None:
    """Write the sheet as SVG or PDF, by the file's ending.

    Raises BadInput for another ending.
    """
    kind = path.suffix.lower()
    if kind == ".svg":
        write_atomic(path, to_svg(sheet).encode("utf-8"))
    elif kind == ".pdf":
        write_atomic(path, to_pdf(sheet))
    else:
        raise BadInput(f"{path}: a sheet is printed as .svg or .pdf")
