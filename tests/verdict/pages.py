"""Put what the verdict's data say into README and docs: `python -m tests.verdict.pages`, after a new verdict.

Between the marks <!-- verdict --> and <!-- /verdict --> (and ablation, shipped) the pages hold what is
made here.
"""

import json
import re
from pathlib import Path

from hil.study import verdict_words as words
from hil.study.verdict import repeated_texts, shipped_text

ROOT = Path(__file__).resolve().parents[2]


def budget(data):
    """Return in words what every law was given."""
    plan, laws = data["plan"], data["laws"]
    seeds = ", ".join(map(str, plan["search_seeds"]))
    small = plan["candidates"] * len(data["search_cells"]) < 100
    pilot = " A pilot, far below the command's own budget: no evidence to rely on." if small else ""
    return (
        f"Budget of the data: {len(laws)} laws, {plan['candidates']} candidates a law in "
        f"{len(data['search_cells'])} cells, seeds of the search {seeds}; judged in "
        f"{len(data['unseen_cells'])} unseen cells.{pilot}"
    )


def block(data):
    """Return the verdict as the pages have it."""
    others = words.other_rankings(data)
    ranked = (
        f"At a calm of {words.MAIN_LEVEL:g} another law than over all is first on: {', '.join(others)}."
        if others
        else f"Every unseen task has the same law first at a calm of {words.MAIN_LEVEL:g}."
    )
    parts = [
        f"**{words.first_line(data)}**",
        budget(data),
        "\n".join(words.readme_table(data)),
        ranked,
        *(words.repeated_line(data, json.loads(text)) for text in repeated_texts().values()),
    ]
    return "\n\n".join(parts)


def ablation_block():
    """Return the table of `hil ablate` with the gains that ship, and the cells it is of."""
    found = json.loads((ROOT / "hil/data/ablation.json").read_text(encoding="utf-8"))
    table = "\n".join(words.ablation_table({"ablation": found["rows"]}))
    cells = len(found["cells"])
    return f"With the gains that ship, in {cells} unseen cells of `{found['deck']}`:\n\n{table}"


def shipped_block(data):
    """Return what the gains that ship are worth in the unseen cells."""
    return "\n".join(words.shipped_table(data))


def filled(text, name, content):
    """Return a page with what stands between the marks of `name` replaced."""
    marks = f"<!-- {name} -->", f"<!-- /{name} -->"
    pattern = re.compile(f"{marks[0]}.*?{marks[1]}", re.S)
    assert pattern.search(text), f"no mark {marks[0]}"
    return pattern.sub(lambda _match: f"{marks[0]}\n{content}\n{marks[1]}", text)


def pages(data):
    """Return each page's text as it should be."""
    found = {}
    for name in ("README.md", "docs/verdict.md"):
        text = filled((ROOT / name).read_text(encoding="utf-8"), "verdict", block(data))
        if name == "docs/verdict.md":
            text = filled(text, "ablation", ablation_block())
            text = filled(text, "shipped", shipped_block(data))
        found[name] = text
    return found


if __name__ == "__main__":
    for page, made in pages(json.loads(shipped_text())).items():
        (ROOT / page).write_text(made, encoding="utf-8")
