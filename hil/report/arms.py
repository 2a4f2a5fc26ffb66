"""What tells the arms of repeated runs apart: the laws, their gains, and whatever else differs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hil.core.errors import BadInput

if TYPE_CHECKING:
    from hil.record.reader import RunRecord

Arm = tuple[str, ...]  # outer law, inner law; of several with these laws, what else tells it apart
Facts = dict[str, Any]

# The first of these that an experiment has is the baseline.
_BASELINE_ORDER = ("pid", "asg-ism")
_DEFAULT_SET = "tuned"
# No condition of a run: what is said of it, what is asked of it, and gains of laws not in use.
_NO_CONDITION = ("description", "requirements", "control.outer", "control.gain")


def law_rank(law: str) -> tuple[int, str]:
    """Return what sorts laws so that the baseline comes first."""
    known = _BASELINE_ORDER.index(law) if law in _BASELINE_ORDER else len(_BASELINE_ORDER)
    return known, law


def arm_names(arms: Sequence[Arm]) -> dict[Arm, str]:
    """Return what tells the arms apart: the law that varies, or both, and what else does."""

    def laws(arm: Arm) -> str:
        for index in (0, 1):
            if len({other[1 - index] for other in arms}) == 1:
                return arm[index]
        return f"{arm[0]} over {arm[1]}"

    return {arm: ", ".join(part for part in (laws(arm), *arm[2:]) if part) for arm in arms}


def arms_of(runs: Sequence[RunRecord]) -> dict[Arm, list[RunRecord]]:
    """Return the runs by arm, the baseline first; the order of the runs does not matter.

    Runs of the same laws are split by their gains, and, where that leaves two of one seed, by every
    other condition in which they differ.
    """
    by_laws: dict[tuple[str, str], list[RunRecord]] = {}
    for run in runs:
        by_laws.setdefault((run.manifest.outer, run.manifest.inner), []).append(run)
    found: dict[Arm, list[RunRecord]] = {}
    for laws, group in by_laws.items():
        for gains, alike in _split(group, [_gains(run) for run in group]).items():
            seeds = [run.manifest.seed for run in alike]
            if len(set(seeds)) == len(seeds):
                found[(*laws, gains)] = alike
                continue
            for rest, own in _split(alike, [_conditions(run) for run in alike]).items():
                found[(*laws, ", ".join(part for part in (gains, rest) if part))] = own
    return dict(sorted(found.items(), key=lambda item: _rank(item[0])))


def by_seed(name: str, runs: Sequence[RunRecord]) -> dict[int, RunRecord]:
    """Return an arm's runs by seed; raises BadInput when a seed has two."""
    found: dict[int, RunRecord] = {}
    for run in runs:
        seed = run.manifest.seed
        if seed in found:
            raise BadInput(
                f"{found[seed].path} and {run.path}: both are {name}, seed {seed}, and nothing tells "
                "them apart, so they make no pairs with runs of other laws; give each run once, and "
                "each repeat a --seed of its own"
            )
        found[seed] = run
    return found


def _rank(arm: Arm) -> tuple[object, ...]:
    outer, inner, rest = arm
    return law_rank(outer), law_rank(inner), not rest.startswith(f"gains {_DEFAULT_SET}"), rest


def _split(runs: Sequence[RunRecord], facts: Sequence[Facts]) -> dict[str, list[RunRecord]]:
    """Return the runs by what they differ in, told as "key value, key value"; "" when in nothing."""
    keys = sorted({key for fact in facts for key in fact})
    unlike = [key for key in keys if any(fact.get(key) != facts[0].get(key) for fact in facts)]
    if "gains" in unlike:  # a set's name tells its values, unless sets of one name differ
        unlike = _beyond_set(facts, unlike)
    found: dict[str, list[RunRecord]] = {}
    for run, fact in zip(runs, facts, strict=True):
        told = ", ".join(f"{key} {_short(fact.get(key))}" for key in unlike)
        found.setdefault(told, []).append(run)
    return found


def _beyond_set(facts: Sequence[Facts], unlike: Sequence[str]) -> list[str]:
    """Return the set's name, and those values in which sets of one name differ."""
    first: dict[Any, Facts] = {}
    for fact in facts:
        first.setdefault(fact["gains"], fact)
    return [
        key
        for key in unlike
        if key == "gains" or any(fact.get(key) != first[fact["gains"]].get(key) for fact in facts)
    ]


def _gains(run: RunRecord) -> Facts:
    """Return the gains in force: the set's name, those of the outer law, those of the board."""
    gains = run.manifest.gains
    return {"gains": str(gains.get("set", ""))} | {
        key: value
        for part in ("outer", "board")
        for key, value in _leaves(gains.get(part) or {}).items()
    }


def _conditions(run: RunRecord) -> Facts:
    """Return everything else that decides a run."""
    manifest = run.manifest
    names = ("target", "camera", "git_revision", "firmware_build_id")
    found = {name.replace("_", " "): getattr(manifest, name) for name in names}
    tree = _leaves(manifest.scenario)
    return found | {key: v for key, v in tree.items() if not key.startswith(_NO_CONDITION)}


def _leaves(tree: Mapping[str, Any], prefix: str = "") -> Facts:
    found: Facts = {}
    for key, value in tree.items():
        name = f"{prefix}{key}"
        found |= _leaves(value, f"{name}.") if isinstance(value, Mapping) else {name: value}
    return found


def _short(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
