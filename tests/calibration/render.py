"""Boards and tags drawn as a camera sees them, as the samples of `hil twin samples` are."""

from sim_twin.board_pictures import LENS, TagFloor, at_floor, board_image, hand_held

__all__ = ["LENS", "TagFloor", "at_floor", "board_image", "hand_held"]
