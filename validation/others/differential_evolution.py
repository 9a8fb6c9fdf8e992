"""SciPy's differential evolution on one configuration: python -m validation.others.differential_evolution.

The exception in this folder: objective and constraints are the designer's, evaluated in NumPy; nothing of its solver.
"""

import scipy

from benchmarks.evolution import evolve
from benchmarks.problems import problems_of
from validation.problem import CONFIGURATION, REQUIREMENT

print("SciPy", scipy.__version__)
for seed in (1, 2):
    for problem in problems_of(REQUIREMENT, CONFIGURATION):
        best = evolve(problem, "depth_error", 40.0, seed)
        print(f"seed {seed}: {best.merit:.10f}, {best.evaluations} evaluations")
