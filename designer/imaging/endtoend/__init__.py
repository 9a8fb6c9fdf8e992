"""A design rendered, matched and reconstructed, against the truth."""
