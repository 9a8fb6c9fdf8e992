"""Images: what a design's camera records, and the points that are reconstructed from it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from designer.extras import needs
from designer.files import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from designer.design import Camera, Design
    from designer.imaging.endtoend.check import EndToEndCheck
    from designer.imaging.endtoend.equalisation_experiment import EqualisationComparison
    from designer.imaging.images import Image
    from designer.imaging.stereo.placement import ImagePlacement, Placement, ViewPlacements
    from designer.imaging.stereo.reconstruction import PointCloud
    from designer.imaging.stereo.results import StereoResult
    from designer.imaging.stereo.rig import StereoRig
    from designer.imaging.stereo.view_centring import FoundCentres


@needs("imaging")
def render(
    design: Design,
    scene: str = "auto",
    *,
    texture: str = "rich",
    samples: int | None = None,
    aperture: bool = False,
    read_noise_electrons: float | None = None,
    full_well_electrons: float = 10_000.0,
    sensor_height_mm: float | None = None,
    seed: int = 0,
) -> Image:
    """The raw image (height, width), 8 bits, that a design's camera records of a scene.

    Parameters
    ----------
    scene
        office, pipe, hall, sky or cylinder, auto (by the working volume), or the path of a mesh.
    texture
        rich, poor, repetitive, or natural: each surface's own material, which cylinder and meshes have not.
    samples
        Rays along each side of a pixel; 2 by default, 3 with ``aperture``.
    aperture
        Whether rays fill the pupil of the lens, with its focus, the light that glass and mirrors lose, and diffraction;
        else they pass through the middle of the pupil and lose nothing.
    read_noise_electrons, full_well_electrons
        The detector's noise; no noise at all by default.
    sensor_height_mm
        Height above the floor; the scene's own by default.
    seed
        Of textures and noise.

    Raises
    ------
    InputError
        There is no such scene or texture, or the detector cannot exist.
    """
    import numpy as np

    from designer.imaging.render.detector import Detector, expose
    from designer.imaging.render.lens import RenderedLens, default_samples
    from designer.imaging.render.raytracing import render as render_radiance
    from designer.imaging.render.scenes.library import build_world

    if read_noise_electrons is not None and not (read_noise_electrons >= 0.0 and full_well_electrons >= 1.0):
        raise InputError("a detector needs a read noise of at least 0 and a full well of at least 1 electron")
    world = build_world(scene, design, texture, seed, sensor_height_mm)
    lens = RenderedLens() if aperture else None
    samples = default_samples(lens) if samples is None else samples
    radiance = render_radiance(design, world, samples=samples, aperture=aperture, seed=seed, lens=lens)
    detector = None if read_noise_electrons is None else Detector(full_well_electrons, read_noise_electrons)
    return np.asarray(expose(radiance, detector, seed=seed), dtype=np.uint8)


@needs("imaging")
def write_image(path: str | Path, image: Image) -> None:
    """Write an image as PNG; colour in OpenCV's order (blue, green, red)."""
    from designer.imaging.images import write_image as write

    write(Path(path), image)


def placement(
    design: Design, center_px: tuple[float, float] | None = None, rotation_deg: float = 0.0, scale: float = 1.0
) -> ImagePlacement:
    """How the image of a real camera lies relative to the design: the axis's pixel, its rotation, its magnification."""
    from math import radians

    from designer.imaging.stereo.placement import ImagePlacement

    return ImagePlacement(center_px or design.camera.principal_point_px, radians(rotation_deg), scale)


def view_placements(upper: ImagePlacement, lower: ImagePlacement) -> ViewPlacements:
    """How the image of each view lies, each a :func:`placement`: for mirrors that do not share an axis."""
    from designer.imaging.stereo.placement import ViewPlacements

    return ViewPlacements(upper=upper, lower=lower)


def read_placement(path: str | Path) -> Placement:
    """The placements of a file such as the ``placement.toml`` that ``designer stereo`` writes.

    Raises
    ------
    InputError
        The file cannot be read or used.
    """
    from designer.imaging.stereo.placement_file import read_placement as read

    return read(Path(path))


def write_placement(path: str | Path, placement: Placement) -> None:
    """Write placements to a file for :func:`read_placement` and ``designer stereo --placement``."""
    from designer.imaging.stereo.placement_file import write_placement as write

    write(Path(path), placement)


@needs("imaging")
def find_center(
    design: Design,
    image: ArrayLike | str | Path,
    start: ImagePlacement | None = None,
    distances_mm: tuple[float, float] | None = None,
) -> ImagePlacement:
    """The placement, common to both views, whose centre fits an image best, within 8 pixels of where it starts.

    Raises
    ------
    InputError
        The image cannot be used, or no centre near the start matches the two views.
    """
    from designer.imaging.stereo.centring import find_centre
    from designer.imaging.stereo.rig import in_grey

    raw = image_of(image, design.camera)
    return find_centre(design, in_grey(raw), start or placement(design), distances_mm=distances_mm)


@needs("imaging")
def find_centers(
    design: Design,
    image: ArrayLike | str | Path,
    start: Placement | None = None,
    distances_mm: tuple[float, float] | None = None,
) -> FoundCentres:
    """The centre of each view, the turn of the lower view against the upper one, and their standard errors.

    The placement found is common to both views where the image does not show two centres.

    Raises
    ------
    InputError
        The image cannot be used, or no centres near the start match the two views.
    """
    from designer.imaging.stereo.rig import in_grey
    from designer.imaging.stereo.view_centring import find_centres

    raw = image_of(image, design.camera)
    return find_centres(design, in_grey(raw), start or placement(design), distances_mm=distances_mm)


@needs("imaging")
def stereo_rig(
    design: Design,
    *,
    placement: Placement | None = None,
    sampling: Literal["spherical", "cylindrical"] = "spherical",
    columns: int = 1800,
    elevation_deg: tuple[float, float] | None = None,
    distances_mm: tuple[float, float] | None = None,
    equalise: bool = True,
    mirror_reflectivity: float | None = None,
    as_built: bool = False,
) -> StereoRig:
    """A design's tables, built once, from which :func:`reconstruct` takes any number of images.

    Parameters
    ----------
    placement
        How the image of the real camera lies, or that of each view; as designed by default.
    sampling, columns, elevation_deg
        Of the panoramas; each view's own elevations by default.
    distances_mm
        Nearest and farthest distance to match; the working volume's, with a tenth more at either end, by default.
    equalise
        Whether to equalise the resolution of the two views.
    mirror_reflectivity
        Even out the views by the light lost at mirrors of this reflectivity and towards the rim of the lens.
    as_built
        Trace the sensor of the design's ``as_built`` table, which says where its image lies, in place of the design.

    Raises
    ------
    InputError
        Neither view images any of the panorama, the tables would take more memory than they may, or a view of the built
        sensor is blind.
    """
    from designer.imaging.stereo.rig import build_rig

    return build_rig(
        design,
        sampling=sampling,
        columns=columns,
        elevation_deg=elevation_deg,
        placement=placement,
        distances_mm=distances_mm,
        equalise=equalise,
        mirror_reflectivity=mirror_reflectivity,
        as_built=as_built,
    )


@needs("imaging")
def reconstruct(
    rig: StereoRig | Design,
    image: ArrayLike | str | Path,
    *,
    matcher: Literal["sad", "semi_global"] = "sad",
    window: int = 9,
    level_brightness: bool = False,
    noise_px: float | None = None,
    slab_mm: tuple[float, float] | None = None,
) -> StereoResult:
    """Panoramas, disparities, distances and points of one raw image.

    Parameters
    ----------
    rig
        What :func:`stereo_rig` built, for many images; or a design, whose rig is built for this image alone.
    image
        Pixels, 8 bits, (height, width) or (height, width, 3) in OpenCV's order; or the path of an image file.
    matcher, window, level_brightness
        How to match: block matching or semi-global, the odd side of the window, and whether the views differ in
        brightness.
    noise_px
        Standard deviation of an image point, for the uncertainties; the design's own by default.
    slab_mm
        Heights z of the floor plan; what the working volume holds at every distance by default.

    Raises
    ------
    InputError
        The image cannot be read, or is not of the design's camera.
    """
    from designer.design import Design
    from designer.imaging.stereo.results import StereoRequest, process

    rig = stereo_rig(rig) if isinstance(rig, Design) else rig
    request = StereoRequest(
        matcher=matcher, window=window, level_brightness=level_brightness, noise_px=noise_px, slab_mm=slab_mm
    )
    return process(rig, image_of(image, rig.design.camera), request)


@needs("imaging")
def check(design: Design, scene: str = "auto", seed: int = 0, *, pinhole: bool = False) -> EndToEndCheck:
    """A design tried end to end: a scene rendered, turned into panoramas, matched, and compared with the truth.

    Through the design's own lens; with ``pinhole`` through a pinhole, which proves the geometry alone.

    Parameters
    ----------
    scene
        office, pipe, hall, sky or cylinder, auto (by the working volume), or the path of a mesh.
    seed
        Of textures and noise.
    pinhole
        Whether rays pass a pinhole instead of filling the pupil of the lens.
    """
    from dataclasses import replace

    from designer.imaging.endtoend.check import CheckOptions, check_design

    options = CheckOptions(scene=scene, seed=seed)
    return check_design(design, replace(options, lens=None) if pinhole else options)


@needs("imaging")
def point_cloud(found: EndToEndCheck) -> PointCloud:
    """The points that a check reconstructed, in the frame of the pinhole, each with its standard deviations."""
    from designer.imaging.stereo.rig import point_cloud as cloud_of

    return cloud_of(found.rig, found.raw, found.matches)


def write_point_cloud(path: str | Path, cloud: PointCloud) -> None:
    """Write points as binary PLY: position (mm), colour and standard deviations (mm)."""
    from designer.imaging.stereo.ply import write_ply

    write_ply(Path(path), cloud)


@needs("imaging")
def compare_equalisation(rig: StereoRig, image: ArrayLike | str | Path) -> EqualisationComparison:
    """One image matched three times: sampled bilinearly, smoothed alike in both views, and equalised.

    Parameters
    ----------
    rig
        A rig that equalises.

    Raises
    ------
    InputError
        The rig does not equalise, or the image cannot be used.
    """
    from designer.imaging.endtoend.equalisation_experiment import compare_methods, sampling_methods
    from designer.imaging.stereo.rig import in_grey

    if rig.equalisers is None:
        raise InputError("this rig was built without equalisation: use equalise=True")
    return compare_methods(sampling_methods(rig), in_grey(image_of(image, rig.design.camera)))


def image_of(image: ArrayLike | str | Path, camera: Camera) -> Image:
    """The pixels of an image or of its file, of the size of the camera."""
    import numpy as np

    from designer.imaging.images import read_raw_image

    if isinstance(image, str | Path):
        return read_raw_image(Path(image), camera)
    pixels: NDArray[np.uint8] = np.asarray(image)
    size = (camera.height_px, camera.width_px)
    if pixels.shape not in {size, (*size, 3)} or pixels.dtype != np.uint8:
        raise InputError(
            f"image: has shape {pixels.shape} and type {pixels.dtype}; the design's camera gives 8-bit images (uint8) "
            f"of shape {size} or {(*size, 3)}"
        )
    return pixels
