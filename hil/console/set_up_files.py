"""What the set-up folder of the records holds, by name: pictures in their sets, and the camera's file."""

from __future__ import annotations

import re

PICTURES, CAMERA_FILE, DRAWN = "pictures", "camera.toml", "drawn"
SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".webp", ".tif", ".tiff")
BOARD = re.compile(r"(charuco|charuco-old|chess):\d{1,2}x\d{1,2}:[\d.]{1,8}(:[\d.]{1,8})?")
SETS = ("lens", "floor", "colours")
