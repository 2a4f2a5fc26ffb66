"""Measures STOP: from the press in Chromium to zero PWM on the served twin.

`python -m tests.console.stop_latency [COUNT]`. The press is dated by the page, the PWM by the host when the
wheel report that says zero, and every one after it, has come over the link (radio included): both are
clocks of this machine. Deadline misses and round trips are of the run's own record.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

import hil
from hil.record.tlog import read_tlog
from hil.wire import dialect
from hil.wire.framing import FrameReader
from tests.console.rig import PATIENCE_S, Console, browser, served_twin


def zero_pwm_unix_ms(record: Path) -> float:
    """Return when the last report with PWM was followed by those without, in ms of Unix time."""
    reader, zero_ms = FrameReader(), float("nan")
    was_zero = True
    for frame in read_tlog(record / "link.tlog"):
        for msg_id, message, _ in reader.feed(frame.frame):
            if msg_id != dialect.MAVLINK_MSG_ID_WHEEL_STATE:
                continue
            is_zero = message.pwm_left_counts == 0 == message.pwm_right_counts
            if is_zero and not was_zero:
                zero_ms = frame.unix_us / 1e3
            was_zero = is_zero
    assert was_zero
    return zero_ms


def one(page: Any, records: Path, after_ms: int) -> tuple[float, Path]:
    """Press STOP in mid-run; return the milliseconds to zero PWM and the record."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    page.select_option("#scenario", "circle")  # the wheels always turn
    page.click("#arm")
    page.click("#start")
    expect(page.locator("#phase")).to_have_text("running")
    expect(page.locator("#events")).to_contain_text("board: armed")
    page.wait_for_timeout(after_ms)
    pressed_ms = page.locator("#stop").evaluate(
        "(stop) => { stop.dispatchEvent(new PointerEvent('pointerdown', {bubbles: true}));"
        " return performance.timeOrigin + performance.now(); }"
    )
    expect(page.locator("#outcome")).to_contain_text("Stopped.")
    name = page.locator("#outcome").inner_text().split("Record: ")[1].strip()
    return zero_pwm_unix_ms(records / name) - pressed_ms, records / name


def main() -> None:
    """Stop COUNT runs, each at another instant, with this page and five viewers; print what was found."""
    from playwright.sync_api import expect  # noqa: PLC0415 - where there is a browser

    expect.set_options(timeout=PATIENCE_S * 1e3)
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    found = []
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        with (
            served_twin(work, "--camera", "pose") as (target, camera),
            Console(work, "--on", target, "--camera", camera) as console,
            browser() as chromium,
        ):
            page = chromium.new_page()
            page.set_default_timeout(PATIENCE_S * 1e3)
            page.goto(console.address)
            page.locator("#law option").nth(2).wait_for(state="attached")
            for k in range(count):
                took_ms, record = one(page, console.records, 600 + 137 * k)
                figures = hil.open_record(record).figures
                found.append(took_ms)
                print(
                    json.dumps(
                        {
                            "stop_ms": round(took_ms, 1),
                            "deadline_misses": figures["deadline_misses"],
                            "rtt_median_ms": round(1e3 * figures["rtt_median_s"], 1),
                        }
                    ),
                    flush=True,
                )
    print(f"STOP to zero PWM: median {statistics.median(found):.0f} ms, worst {max(found):.0f} ms")


if __name__ == "__main__":
    main()
