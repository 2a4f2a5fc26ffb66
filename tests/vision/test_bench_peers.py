"""The comparison of the vision bench: every detector on the same frames, and the page of the worst."""

from hil.tools import bench_peers
from hil.tools import vision_conditions as scenes


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


def test_another_tag_is_not_the_robot():
    """Negative control: where tag 9 is drawn, ArUco and AprilTag find no tag 7; the marks are seen."""
    other = bench_peers.TAG.model_copy(update={"tag_id": 9})
    setting = scenes.CONDITIONS["clean"]
    camera = scenes.camera_of("ceiling", bench_peers.SIZE_PX, setting, tag=other)
    frame = next(scenes.frames("ceiling", bench_peers.SIZE_PX, setting, 1, tag=other))
    seen = {name: find(frame.image, frame) for name, find in bench_peers.methods(camera).items()}
    assert seen["cv2.aruco"].pose is None
    assert seen.get("AprilTag", seen["cv2.aruco"]).pose is None
    assert seen["marks, tracking"].pose is not None
