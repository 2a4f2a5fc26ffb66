"""How the robot is found in a frame: camera model, localisers, tracker, calibration."""
