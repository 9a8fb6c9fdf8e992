"""The requirement and the configuration that the optimiser is compared on."""

from pathlib import Path

from designer.configurations import Configuration
from designer.requirement import Requirement, read_requirement, set_key

_SHIPPED = read_requirement(Path(__file__).parents[1] / "configs" / "indoor_robot.toml")
REQUIREMENT: Requirement = set_key(set_key(_SHIPPED, "noise_px", 0.1), "scale_uncertainty_percent", 0.0)
"""The paper's prototype with its constant noise."""
(CONFIGURATION,) = (each for each in REQUIREMENT.configurations if each.name == "folded-HyPl-Hy-upper_outer")
CONFIGURATION: Configuration
"""The paper's own."""
