"""The digital twin: robot, link, camera and renderer, on virtual time; the board under simavr."""
