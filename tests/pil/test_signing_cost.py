"""SHA-256 on the board's processor: right, and as quick as docs/firmware.md says."""

from __future__ import annotations

from tests.pil.rigs import needs_toolchain
from tests.pil.signing_cost import expected, measure, texts_drawn

pytestmark = needs_toolchain


def test_the_processor_makes_the_digests_of_the_standard_in_so_many_cycles():
    """Texts of two blocks, drawn: hashlib's digests; half the cycles that C takes, in slices."""
    texts = texts_drawn(40)
    cost = measure(texts)
    assert cost.digests == expected(texts)
    assert 18_000 < cost.block < 23_000
    assert cost.slice < 3_300  # 0.2 ms: a tick that is due waits for no more


def test_a_digest_that_is_none_is_found():
    """Negative control: with another constant no digest is right."""
    texts = texts_drawn(3)
    found = measure(texts, "0x428a2f99").digests
    assert all(a != b for a, b in zip(found, expected(texts), strict=True))
