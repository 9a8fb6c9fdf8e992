"""The paper's claim about resolution equalisation, on a small sensor; ten seeds are in benchmarks/equalisation.py."""

import numpy as np
import pytest

from designer.imaging.endtoend.equalisation_experiment import compare_methods, noise_gain, sampling_methods
from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.imaging.stereo.rig import build_rig
from support.imaging_designs import coarse_prototype


@pytest.mark.slow
def test_equalising_rejects_fewer_pixels_than_bilinear_sampling_and_than_smoothing_alike() -> None:
    design = coarse_prototype()
    methods = sampling_methods(build_rig(design, equalise=True, columns=900))
    gains = {method: noise_gain(rig) for method, rig in methods.items()}
    assert gains["smoothed_alike"] == pytest.approx(gains["equalised"], rel=0.01)
    assert gains["equalised"] < gains["bilinear"]
    for seed in (0, 1):
        radiance = render(design, build_world("office", design, seed=seed))
        raw = np.asarray(expose(radiance, Detector(1_000.0, 20.0), seed=seed), dtype=np.uint8)
        rejected = compare_methods(methods, raw).rejected
        assert rejected["equalised"] < rejected["smoothed_alike"]
        assert rejected["equalised"] < rejected["bilinear"]
