"""What tests of several rooms share: data, requirements, designs from closed forms, a room with exact answers."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
CONFIGS = ROOT / "configs"
