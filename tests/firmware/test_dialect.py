"""The dialect: standard messages as the standard has them, generated code as the XML has it."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import common

from hil.board import _firmware, codegen
from hil.wire import dialect, identity

STANDARD = {
    "HEARTBEAT": 0, "SYS_STATUS": 1, "PARAM_REQUEST_READ": 20, "PARAM_REQUEST_LIST": 21,
    "PARAM_VALUE": 22, "PARAM_SET": 23, "COMMAND_LONG": 76, "COMMAND_ACK": 77, "TIMESYNC": 111,
    "STATUSTEXT": 253, "SETUP_SIGNING": 256,
}  # fmt: skip
OWN = {"WHEEL_SETPOINT", "WHEEL_STATE", "BOARD_INFO"}


def test_the_dialect_holds_what_is_needed_and_no_more():
    """Eleven standard messages and three own: the board's tables cost RAM."""
    assert {m.msgname for m in dialect.mavlink_map.values()} == OWN | set(STANDARD)


@pytest.mark.parametrize("name", STANDARD)
def test_standard_messages_are_the_standard_ones(name):
    """Id, CRC_EXTRA and field order equal pymavlink's common dialect, so any tool reads them."""
    ours, theirs = dialect.mavlink_map[STANDARD[name]], common.mavlink_map[STANDARD[name]]
    assert ours.msgname == theirs.msgname == name
    assert ours.crc_extra == theirs.crc_extra
    assert theirs.ordered_fieldnames[: len(ours.ordered_fieldnames)] == ours.ordered_fieldnames


def test_own_messages_collide_with_no_known_one():
    """Ids of own messages are free in every dialect pymavlink brings (common is in all of them)."""
    own = {key for key, m in dialect.mavlink_map.items() if m.msgname in OWN}
    assert not own & set(common.mavlink_map)


@pytest.mark.parametrize("enum", ["MAV_CMD", "MAV_RESULT", "MAV_SEVERITY", "MAV_PARAM_TYPE",
                                  "MAV_SYS_STATUS_SENSOR"])  # fmt: skip
def test_standard_enums_keep_their_values(enum):
    """Every entry taken over has the standard's name and value."""
    theirs = {entry.name: value for value, entry in common.enums[enum].items()}
    for value, entry in dialect.enums[enum].items():
        if not entry.name.endswith("ENUM_END"):
            assert theirs[entry.name] == value


def test_generated_files_are_what_the_xml_generates():
    """Regenerating changes nothing but the build date."""
    assert codegen.differences() == []


def test_the_check_names_stale_missing_and_left_over_files(tmp_path):
    """Negative control of the check: damage is found and named; writing mends it."""
    codegen.write(tmp_path)
    assert codegen.differences(tmp_path) == []
    version = tmp_path / codegen.C_OUT / "hil" / "version.h"
    version.write_text(version.read_text().replace("BUILD_DATE", "BUILD_DATE", 1))
    (tmp_path / codegen.PYTHON_OUT).unlink()
    (tmp_path / codegen.C_OUT / "checksum.h").write_text("// stale")
    (tmp_path / codegen.C_OUT / "old.h").write_text("")
    found = codegen.differences(tmp_path)
    assert [line.split(": ")[1].split(" ")[0] for line in found] == ["missing", "differs", "not"]
    assert len(codegen.write(tmp_path)) == 2


def test_both_worlds_derive_the_same_dialect_hash():
    """C from the generated CRC table, Python from the generated module."""
    assert _firmware.dialect_hash() == identity.dialect_hash()


def test_the_hash_of_parameters_covers_names_and_values():
    """A changed value, two values exchanged: other hashes; the board agrees with the host."""
    defaults = {entry.name: entry.default for entry in _firmware.parameter_table()}
    exchanged = defaults | {"ISM_GAM0": defaults["ISM_K0"], "ISM_K0": 1.0}
    hashes = {identity.parameter_hash(values) for values in (defaults, exchanged)}
    assert len(hashes) == 2
    assert _firmware.parameter_hash({"ISM_K0": 1.0}) == identity.parameter_hash(
        defaults | {"ISM_K0": 1.0}
    )
    assert _firmware.parameter_hash({}) == identity.parameter_hash(defaults)
