"""Calibration of a real camera: lens, pose over the floor, mark colours, latency.

Pixels are (u, v) with (0, 0) in the centre of the first pixel. Boards are described as they lie on
a floor face up: x right, y up, z out of the paper, origin in the lower left corner of the pattern.
"""
