"""Worlds that a sensor looks at, with exact ground truth: analytic shapes, textured, and how rays meet them."""
