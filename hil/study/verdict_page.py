"""The page of a verdict, from its data."""

from __future__ import annotations

from pathlib import Path

from hil.report import fronts
from hil.study import verdict_words as words


def fronts_of(data: words.Data) -> dict[str, list[list[tuple[float, float, float]]]]:
    """Return every law's points on the unseen tasks, a list for each seed of the search."""
    seeds = words.seeds_of(data)
    return {law: [words.unseen_front(data, law, seed) for seed in seeds] for law in data["laws"]}


def write(path: Path, data: words.Data) -> None:
    """Write the page of a verdict."""
    plan = data["plan"]
    others = words.other_rankings(data)
    said = [
        words.first_line(data),
        f"{plan['candidates']} candidates a law and search seed ({len(plan['search_seeds'])} seeds), each "
        f"in {len(data['search_cells'])} cells; judged in {len(data['unseen_cells'])} cells that no "
        "search has seen. A line is the front of one search, on the unseen cells.",
        "Each cell of the table: accuracy score against PID's at that calm, with the widest interval of the "
        "seeds; bold where every seed of the search shows it. PID's own row is its score.",
        f"Another law is first on: {', '.join(others)}."
        if others
        else "Every unseen task ranks alike.",
    ]
    tables = [words.readme_table(data), words.ablation_table(data) if data["ablation"] else []]
    text = fronts.page("Verdict: all laws on unseen tasks", fronts_of(data), said, tables)
    fronts.write_page(path, text)
