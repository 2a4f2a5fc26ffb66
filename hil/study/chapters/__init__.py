"""The other chapters: quadrotor and underwater vehicles under the laws of hil.control."""
