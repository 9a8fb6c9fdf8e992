"""The paper's claim about resolution equalisation, measured: ``python -m benchmarks.equalisation [--texture KIND]``.

Office renders of the prototype design, textures and noise of ten seeds, two detectors. Each raw image is sampled
bilinearly, with both views smoothed alike to the same noise gain, and equalised, and matched in the same way; the
pixels that reverse verification rejects are counted. Writes a table and a figure under ``benchmarks/results/``.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from designer.design import Design, read_design
from designer.imaging.endtoend.equalisation_experiment import METHODS, compare_methods, noise_gain, sampling_methods
from designer.imaging.render.detector import Detector, expose
from designer.imaging.render.raytracing import render
from designer.imaging.render.scenes.library import build_world
from designer.imaging.render.textures import TEXTURE_KINDS
from designer.imaging.stereo.rig import build_rig
from designer.report.figures.equalisation import draw_rejections
from designer.report.figures.style import report_style, svg_bytes

DESIGN = Path(__file__).parents[1] / "tests" / "data" / "folded_hypl_hy.json"
RESULTS = Path(__file__).parent / "results"
DETECTORS = {
    "good light (10 000 electrons)": Detector(10_000.0, 8.0),
    "dim light (1000 electrons)": Detector(1_000.0, 20.0),
}


def measure(design: Design, texture: str, seeds: int, samples: int) -> pd.DataFrame:
    """One row for each seed and detector: the percentage of pixels rejected, for each way of sampling."""
    methods = sampling_methods(build_rig(design, equalise=True))
    for method, rig in methods.items():
        print(f"{method}: noise gain {noise_gain(rig):.3f}, sigma {rig.sigma_px or 0.0:.3f} px", flush=True)
    rows = []
    for seed in range(seeds):
        radiance = render(design, build_world("office", design, texture, seed), samples=samples)
        for light, detector in DETECTORS.items():
            raw = np.asarray(expose(radiance, detector, seed=seed), dtype=np.uint8)
            compared = compare_methods(methods, raw)
            pixels = compared.matches["equalised"].outcomes.size
            percent = {method: 100.0 * count / pixels for method, count in compared.rejected.items()}
            rows.append({"seed": seed, "detector": light} | percent)
            print(
                ", ".join(f"{key} {value:.3f}" for key, value in percent.items()), f"(seed {seed}, {light})", flush=True
            )
    return pd.DataFrame(rows)


def main() -> None:
    """Measure, and write table and figure."""
    parser = argparse.ArgumentParser(description="Rejected pixels with and without resolution equalisation.")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--texture", choices=TEXTURE_KINDS, default="rich")
    parser.add_argument("--samples", type=int, default=2, help="rays along a pixel's side")
    parser.add_argument("--out", type=Path, default=RESULTS)
    asked = parser.parse_args()
    table = measure(read_design(DESIGN), asked.texture, asked.seeds, asked.samples)
    name = "equalisation" if asked.texture == "rich" else f"equalisation_{asked.texture}"
    asked.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(asked.out / f"{name}.csv", index=False, float_format="%.4f")
    groups = dict(list(table.groupby("detector", sort=False)))
    with report_style():
        drawn = {light: {method: rows[method].to_numpy() for method in METHODS} for light, rows in groups.items()}
        (asked.out / f"{name}.svg").write_bytes(svg_bytes(draw_rejections(drawn, 160.0, 62.0)))
    for light, rows in groups.items():
        for other in ("bilinear", "smoothed_alike"):
            fewer = int((rows["equalised"] < rows[other]).sum())
            print(f"{light}: equalised rejects fewer than {other} in {fewer} of {len(rows)} seeds")


if __name__ == "__main__":
    main()
