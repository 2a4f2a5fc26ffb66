"""What every room stands on: values, errors, the rig's boundary, clocks."""
