"""What machines and workshops read: a design in the formats of other programs. All lengths in mm."""
