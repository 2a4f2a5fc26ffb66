"""The comparison of the vision bench: every detector on the same frames, and the page of the worst."""

import pytest

from hil.tools import bench_peers


def test_all_detectors_find_a_clean_robot_and_the_marks_are_best():
    """Six methods (AprilTag where installed) within 1 mm and 1 deg; the marks at a tenth of ArUco's."""
    lines, worst = bench_peers.compare("ceiling", "clean", 2)
    by_name = {line.method: line for line in lines}
    assert {"marks, tracking", "marks, first find", "cv2.aruco", "threshold"} <= set(by_name)
    for line in lines:
        assert (line.found_ratio, line.wrong_ratio) == (1.0, 0.0)
        assert line.rms_mm < 1.0
        assert line.rms_deg < 1.0
    assert by_name["marks, tracking"].rms_mm < 0.5 * by_name["cv2.aruco"].rms_mm
    page = bench_peers.as_page(lines, [worst])
    assert page.count("<img") == 1
    assert page.count("<tr>") == 1 + len(lines)
    assert "ceiling, clean" in page


def test_a_detector_that_sees_nothing_is_counted_so(monkeypatch):
    """Negative control: with another tag's number ArUco and AprilTag find none, the marks all."""
    sought = bench_peers.TAG.model_copy(update={"tag_id": 9})
    drawn, compare = bench_peers.TAG, bench_peers.methods

    def methods(camera):
        monkeypatch.setattr(bench_peers, "TAG", sought)
        return compare(camera)

    monkeypatch.setattr(bench_peers, "methods", methods)
    lines, _ = bench_peers.compare("ceiling", "clean", 1)
    assert drawn.tag_id != sought.tag_id
    found = {line.method: line.found_ratio for line in lines}
    assert found["marks, tracking"] == 1.0
    assert found["cv2.aruco"] == pytest.approx(0.0)
