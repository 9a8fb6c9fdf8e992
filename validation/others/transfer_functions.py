"""Closed forms of a lens's transfer in thirty digits: python -m validation.others.transfer_functions."""

import mpmath as mp

mp.mp.dps = 30
half = mp.mpf("0.5")
print("mpmath", mp.__version__)
print("diffraction", mp.nstr(2 / mp.pi * (mp.acos(half) - half * mp.sqrt(1 - half**2)), 16))
print("first_zero", mp.nstr(mp.besseljzero(1, 1) / mp.pi, 16))
