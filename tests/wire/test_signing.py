"""The host's signing: pymavlink as its peer, key files, what it says of a wrong key, what it records."""

from __future__ import annotations

import base64
import hashlib
import os
import stat

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.cli.firmware import command
from hil.config.load import load_scenario
from hil.core.errors import BadInput, RigFault
from hil.replays.exact import replay
from hil.rigs.key_file import new_key, read_key
from hil.rigs.opening import open_rig
from hil.rigs.signed import SignedRig, SignedStream
from hil.runs.execute import RunSpec, execute
from hil.wire import dialect, handshake
from hil.wire.framing import FrameWriter
from hil.wire.link import BoardLink
from hil.wire.signing import (
    EPOCH_UNIX_S,
    STAMP_MOST,
    FrameChecker,
    FrameCutter,
    FrameSigner,
    Key,
    stamp_at,
)

KEY = Key(bytes(range(1, 33)), "key.txt")
OTHER = Key(bytes(range(101, 133)), "other.txt")
STAMP = 36_000_000_000_000
TEXT = dialect.MAVLink_statustext_message(6, b"armed")


def peer(key: Key, stamp: int = STAMP, link_id: int = 0, system: int = 1) -> dialect.MAVLink:
    """Return pymavlink's own signing."""
    mav = dialect.MAVLink(None, system, 1)
    mav.robust_parsing = True
    mav.signing.secret_key, mav.signing.timestamp = key.secret, stamp
    mav.signing.link_id, mav.signing.sign_outgoing = link_id, True
    return mav


def checker(key: Key = KEY, stamp: int = STAMP) -> FrameChecker:
    """Return a checker whose own stamp is this."""
    signer = FrameSigner(key)
    signer.stamp = stamp
    return FrameChecker(key, signer)


MESSAGES = st.one_of(
    st.builds(dialect.MAVLink_wheel_setpoint_message, st.floats(width=32, allow_nan=False),
              st.floats(width=32, allow_nan=False), st.integers(0, 65535)),
    st.builds(dialect.MAVLink_statustext_message, st.integers(0, 7), st.binary(max_size=50)),
    st.builds(dialect.MAVLink_timesync_message, st.integers(0, 2**62), st.integers(0, 2**62)),
)  # fmt: skip


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.lists(MESSAGES, max_size=6), st.integers(0, 255), st.integers(1, 40))
def test_pymavlink_takes_what_is_signed_here(messages, link_id, piece):
    """Every frame is good to it, and says what it said."""
    theirs = peer(KEY)
    signer, writer = FrameSigner(KEY, link_id), FrameWriter()
    data = b"".join(signer.sign(writer.encode(m), STAMP) for m in messages)
    found = []
    for at in range(0, len(data), piece):
        found += theirs.parse_buffer(bytearray(data[at : at + piece])) or []
    assert [m.get_type() for m in found] == [m.get_type() for m in messages]
    assert theirs.signing.goodsig_count == len(messages)
    assert theirs.signing.badsig_count == 0


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.lists(MESSAGES, max_size=6), st.integers(1, 40), st.binary(max_size=20))
def test_what_pymavlink_signs_is_handed_on_bare(messages, piece, noise):
    """Cut anywhere, behind noise: the frames that it would have sent without a key, in order."""
    signed, bare = peer(KEY), dialect.MAVLink(None, 1, 1)
    data = noise + b"".join(m.pack(signed) for m in messages) + TEXT.pack(signed)
    want = b"".join(m.pack(bare) for m in messages)
    check = checker()
    got = b"".join(check.feed(data[at : at + piece]) for at in range(0, len(data), piece))
    assert got.startswith(want) or 0xFD in noise
    assert check.counts.refused == 0


@pytest.mark.parametrize(
    ("frame", "count"),
    [
        (TEXT.pack(dialect.MAVLink(None, 1, 1)), "unsigned"),
        (TEXT.pack(peer(OTHER)), "other_key"),
        (TEXT.pack(peer(KEY, STAMP - 6_000_002)), "old"),
    ],
)
def test_what_is_not_good_is_left_out_and_counted(frame, count):
    """Unsigned, of another key, more than a minute old."""
    check = checker()
    assert check.feed(bytes(frame)) == b""
    assert getattr(check.counts, count) == check.counts.refused == 1


def test_a_frame_sent_again_is_old_and_a_new_link_may_be_a_minute_behind():
    """The rules of the standard, to the last stamp."""
    check = checker()
    frame = bytes(TEXT.pack(peer(KEY)))
    assert check.feed(frame)
    assert check.feed(frame) == b""
    assert check.feed(bytes(TEXT.pack(peer(KEY, STAMP - 6_000_000, link_id=2))))
    assert check.feed(bytes(TEXT.pack(peer(KEY, STAMP - 6_000_001, link_id=3)))) == b""


def test_the_stamp_follows_the_one_who_is_ahead():
    """What is sent after a good frame from the future is newer than that."""
    signer = FrameSigner(KEY)
    FrameChecker(KEY, signer).feed(bytes(TEXT.pack(peer(KEY, STAMP + 1_000))))
    (cut,) = FrameCutter().feed(signer.sign(FrameWriter().encode(TEXT), STAMP))
    assert int.from_bytes(cut.block[1:7], "little") == STAMP + 1_001


def test_stamps_count_ten_microseconds_since_2015():
    """A second after the epoch."""
    assert stamp_at((EPOCH_UNIX_S + 1) * 1_000_000_000) == 100_000


@pytest.mark.parametrize("unix_s", [0, EPOCH_UNIX_S - 1, 2**33, 2**40])
def test_a_clock_that_was_never_set_or_is_past_all_others_signs(unix_s):
    """1970 and long after 2104: frames go out, each newer than the one before."""
    now = stamp_at(unix_s * 1_000_000_000)
    signer = FrameSigner(KEY)
    signer.stamp = now
    sent = b"".join(signer.sign(FrameWriter().encode(TEXT), now) for _ in range(3))
    stamps = [int.from_bytes(cut.block[1:7], "little") for cut in FrameCutter().feed(sent)]
    assert stamps == [now + 1, now + 2, now + 3]


@pytest.mark.parametrize("stamp", [STAMP_MOST + 1, 2**48 - 1])
def test_a_stamp_past_all_clocks_is_refused(stamp):
    """Nothing could be newer than it, and 48 bits would end: it moves no stamp."""
    check = checker()
    assert check.feed(bytes(TEXT.pack(peer(KEY, stamp)))) == b""
    assert check.counts.old == 1
    assert check.feed(bytes(TEXT.pack(peer(KEY, STAMP))))
    assert check.feed(bytes(TEXT.pack(peer(KEY, STAMP_MOST))))


# ---- the key and its file ----


def test_a_new_key_is_for_its_owner_alone(tmp_path):
    """Mode 0600, 32 bytes, drawn anew each time; a file that is there is left alone."""
    new_key(tmp_path / "a")
    new_key(tmp_path / "b")
    assert stat.S_IMODE(os.stat(tmp_path / "a").st_mode) == 0o600
    a, b = read_key(tmp_path / "a"), read_key(tmp_path / "b")
    assert len(a.secret) == 32
    assert a.secret != b.secret
    with pytest.raises(BadInput, match="is there already"):
        new_key(tmp_path / "a")
    assert read_key(tmp_path / "a").secret == a.secret


def test_a_passphrase_gives_the_key_that_mavproxy_makes_of_it(tmp_path):
    """SHA-256 of the passphrase, as its `signing key` has it."""
    result = CliRunner().invoke(
        command, ["key", "new", str(tmp_path / "k"), "--passphrase"], input="robot\nrobot\n"
    )
    assert result.exit_code == 0
    assert read_key(tmp_path / "k").secret == hashlib.sha256(b"robot").digest()
    assert "robot" not in result.output


def test_a_passphrase_that_is_no_text_is_refused_in_a_line(tmp_path):
    """Bytes of a terminal in another encoding: no traceback, no file."""
    with pytest.raises(BadInput, match="passphrase: is no UTF-8 text"):
        new_key(tmp_path / "k", b"\xff\xfe".decode(errors="surrogateescape"))
    assert not (tmp_path / "k").exists()


@pytest.mark.parametrize(
    "text", ["", "00" * 32, "zz" * 32, "11" * 31, "11" * 33, "11" * 32 + " " * 200 + "zz"]
)
def test_what_is_no_key_is_refused_in_a_line(tmp_path, text):
    """And the line does not show what is in the file."""
    path = tmp_path / "k"
    path.write_text(text)
    path.chmod(0o600)
    with pytest.raises(BadInput, match="64 hexadecimal digits") as refused:
        read_key(path)
    assert "1111" not in str(refused.value)


@pytest.mark.skipif(os.name != "posix", reason="modes of files")
def test_a_key_that_others_may_read_is_refused(tmp_path):
    """A key everybody has is none."""
    new_key(tmp_path / "k")
    (tmp_path / "k").chmod(0o640)
    with pytest.raises(BadInput, match="others may read it"):
        read_key(tmp_path / "k")


def test_a_key_never_shows_itself():
    """Neither printed nor in a traceback."""
    for shown in (repr(KEY), str(KEY), f"{KEY}"):
        assert KEY.secret.hex() not in shown
        assert repr(KEY.secret) not in shown


# ---- on a board ----


def fault_of(host: Key | None, board: Key | None) -> str:
    """Return what a host with a key says of a twin whose board has another, or none."""
    rig = open_rig("twin", load_scenario("scenario-1"), "pose", 1, board)
    bare = rig._rig if isinstance(rig, SignedRig) else rig
    stream = bare.stream if host is None else SignedStream(bare.stream, host)
    link = BoardLink(stream)
    begin_s = rig.now_s()
    with pytest.raises(RigFault) as fault:
        handshake.finish(link, rig, handshake.connect(link, {}))
    assert "\n" not in str(fault.value)
    assert rig.now_s() - begin_s < 2.0
    return str(fault.value)


def test_a_wrong_key_is_named():
    """Host and board have different ones."""
    assert fault_of(OTHER, KEY).startswith("board: signs with another key than other.txt")


def test_a_board_without_a_key_is_named():
    """The host has one."""
    assert fault_of(KEY, None).startswith("board: does not sign, so it has no key")


def test_a_host_without_a_key_is_named():
    """The board has one."""
    assert fault_of(None, KEY).startswith("board: signs what it says, so it has a key")


@pytest.fixture(scope="module")
def signed_run(tmp_path_factory):
    """Return a run with a key, recorded."""
    out = tmp_path_factory.mktemp("signed") / "run"
    scenario = load_scenario("scenario-1", ["duration_s=3.0"])
    spec = RunSpec(scenario, "twin", "pose", "asg-ism", "asg-ism", 1, out, key=KEY)
    return execute(spec)


def test_a_signed_run_is_whole_and_its_record_holds_no_key(signed_run):
    """Neither raw nor in hexadecimal digits nor in base64, in no file of it, and no signature."""
    assert signed_run.manifest.outcome == "complete"
    assert signed_run.manifest.signed
    shapes = [
        KEY.secret, KEY.secret[:16], KEY.secret.hex().encode(), KEY.secret.hex().upper().encode(),
        base64.b64encode(KEY.secret), base64.b64encode(KEY.secret)[:20],
    ]  # fmt: skip
    files = [path for path in signed_run.path.rglob("*") if path.is_file()]
    assert len(files) >= 5
    for path in files:
        data = path.read_bytes()
        assert not any(shape in data for shape in shapes), path.name
    cuts = list(FrameCutter().feed((signed_run.path / "link.tlog").read_bytes()))
    assert len(cuts) > 100
    assert all(cut.block == b"" for cut in cuts)


def test_a_signed_run_is_replayed_bit_for_bit_without_its_key(signed_run):
    """The tape holds what was found good."""
    report = replay(signed_run.path)
    assert report.kind == "exact"
    assert report.identical
