"""`hil power`: how many pairs of runs a difference needs to be seen."""

from __future__ import annotations

from typing import Any

import click

from hil.cli.options import json_option, plain_console, print_json


@click.command("power")
@click.option("--difference", type=float, required=True, metavar="X",
              help="Mean difference to be seen, in the figure's unit.")  # fmt: skip
@click.option("--sd", type=click.FloatRange(min=0.0, min_open=True), required=True, metavar="X",
              help="Standard deviation of the paired differences (`sd` of hil compare --json).")  # fmt: skip
@click.option("--power", "wanted", type=click.FloatRange(0.05, 1.0, min_open=True, max_open=True),
              default=0.8, show_default=True, help="How likely it shall be seen.")  # fmt: skip
@click.option("--pairs", type=click.IntRange(2, 10_000_000),
              help="Also say what that many pairs show.")  # fmt: skip
@json_option
def command(difference: float, sd: float, wanted: float, pairs: int | None, as_json: bool) -> None:
    """Say how many pairs (seeds that both laws run) show a mean difference at 5 %.

    Of a paired t test on normal differences; docs/statistics.md has what skewed ones ask for more.
    """
    from hil.analysis import multiple

    needed = multiple.pairs_needed(difference, sd, wanted)
    document: dict[str, Any] = {
        "difference": difference,
        "sd": sd,
        "power": wanted,
        "pairs": needed,
        "power_at_pairs": multiple.power(difference / sd, needed),
    }
    lines = [
        f"{needed} pairs show a mean difference of {difference:g} (sd {sd:g}) in {100 * wanted:g} % of "
        "studies"
    ]
    if pairs is not None:
        share, seen = (
            multiple.power(difference / sd, pairs),
            multiple.difference_seen(sd, pairs, wanted),
        )
        document["asked"] = {"pairs": pairs, "power": share, "difference_seen": seen}
        lines.append(
            f"{pairs} pairs show it in {100 * share:.0f} %, and {seen:.3g} in {100 * wanted:g} %"
        )
    if as_json:
        print_json(document)
        return
    for line in lines:
        plain_console().print(line)
