"""Design of single-camera catadioptric stereo systems with conic mirrors and two single viewpoints."""

__version__ = "0.2.0"
