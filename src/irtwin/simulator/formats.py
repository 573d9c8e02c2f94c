"""A model's file in each of the formats that are read."""

from __future__ import annotations

from pathlib import Path

from irtwin.errors import InputError
from irtwin.simulator.model_file import ModelFile, check_inside, read_xml
from irtwin.simulator.sdf_file import read_sdf

_OF_USD = (".usd", ".usda", ".usdc", ".usdz")


def read_model_file(path: Path) -> ModelFile:
    """Read a model file, MJCF, URDF, SDF or USD, and look at those that it names.

    Raises InputError where one is none of these, has entities or is too large, or names a file outside the folder, and
    where it is a USD and `pxr` is not installed.
    """
    if path.suffix.lower() in _OF_USD:
        try:
            from irtwin.simulator.usd_file import read_usd
        except ModuleNotFoundError as error:
            raise InputError(f"{path}: reading USD needs its package; install irtwin[usd]") from error
        return read_usd(path)
    file = read_xml(path)
    match file.elements[0].tag:
        case "robot":
            return file  # files that it names are meshes: nobody loads them
        case "sdf":
            return read_sdf(file)  # the same
        case "mujoco":
            check_inside(file, path.parent, {})
            return file
        case other:
            raise InputError(f"{path}: outermost element is <{other}>; give an MJCF, <mujoco>, a URDF, an SDF or a USD")
