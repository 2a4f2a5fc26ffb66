"""The wiring page says what the sketch does."""

import re

from hil.board.build import sketch_folder

# pins.h name -> row of the page.
ROWS = {
    "kLeftEncoderA": "left encoder A",
    "kLeftEncoderB": "left encoder B",
    "kRightEncoderA": "right encoder A",
    "kRightEncoderB": "right encoder B",
    "kBluetoothRx": "Bluetooth receive",
    "kLeftIn1": "left IN1",
    "kLeftIn2": "left IN2",
    "kRightIn3": "right IN3",
    "kRightIn4": "right IN4",
    "kLed": "lamp",
    "kLeftEnable": "left enable",
    "kRightEnable": "right enable",
}


def test_page_and_drawing_have_the_pins_of_the_sketch():
    """Port bit and Arduino pin of every signal, in table and drawing."""
    header = (sketch_folder() / "src/board/pins.h").read_text(encoding="utf-8")
    pins = dict(
        (name, (bit, pin))
        for name, bit, pin in re.findall(r"uint8_t (\w+) = (P[A-L]\d);\s*// pin (\d+)", header)
    )
    assert pins.keys() == ROWS.keys()
    docs = sketch_folder().parent / "docs"
    page = (docs / "wiring.md").read_text(encoding="utf-8")
    drawn = re.findall(r">(\w+)</text>", (docs / "wiring.svg").read_text(encoding="utf-8"))
    for name, (bit, pin) in pins.items():
        assert f"| {ROWS[name]} | {pin} | {bit} |" in page, name
        assert pin in drawn or name == "kLed", name
