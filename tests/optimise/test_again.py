"""What neighbours tell each other: a design in a poor optimum is left for a neighbour's, and nothing gets worse."""

from dataclasses import replace

import pytest

from designer.configurations import CONFIGURATIONS
from designer.optimise.again import WORTH_A_CHANGE, Fresh, search_again
from designer.optimise.branch import random_of
from designer.optimise.search import search
from designer.requirement import requirement_from_json, set_key
from support.traps import trap_at

NAME = "folded-HyHy-Hy-upper_inner"


def configuration_of(requirement):
    (found,) = [each for each in requirement.configurations if each.name == NAME]
    return found
