"""What is made of a raw image: panoramas, matches, points; the rig as its user has it."""
