# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Types of the module vlp, for editors and for mypy; help(vlp) describes each of them."""

import os
from typing import Sequence, TypedDict

import numpy as np
import numpy.typing as npt

_File = str | os.PathLike[str]
_Doubles = npt.NDArray[np.float64]
_Integers = npt.NDArray[np.int32]

__version__: str
STATUSES: tuple[str, ...]

class InputError(ValueError): ...

class LampMap:
    def __init__(self, file: _File, room: str | None = None) -> None: ...
    def __len__(self) -> int: ...
    @property
    def ids(self) -> _Integers: ...
    @property
    def positions_m(self) -> _Doubles: ...

class Lens:
    def __init__(self, model: str, intrinsics: Sequence[float] | _Doubles) -> None: ...
    def project(self, points: npt.ArrayLike) -> _Doubles: ...
    def unproject(self, pixels: npt.ArrayLike) -> _Doubles: ...

class Calibration:
    def __init__(self, file: _File) -> None: ...
    @property
    def camera_id(self) -> str: ...
    @property
    def imager_px(self) -> list[int]: ...
    @property
    def lens_model(self) -> str: ...
    @property
    def intrinsics(self) -> _Doubles: ...
    @property
    def row_time_s(self) -> float | None: ...
    @property
    def lens(self) -> Lens: ...

class Sensors:
    def __init__(
        self,
        *,
        inclination_rad: tuple[float, float] | None = None,
        inclination_sigma_rad: float = 0.0,
        height_and_yaw: tuple[float, float] | None = None,
        height_and_yaw_sd: tuple[float, float] = (0.0, 0.0),
        velocity_m_per_s: tuple[float, float] | None = None,
        velocity_sd_m_per_s: float = 0.0,
        yaw_rate_rad_per_s: float = 0.0,
        yaw_rate_sd_rad_per_s: float = 0.0,
        height_m: tuple[float, float] | None = None,
        time_s: float | None = None,
        prior: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    ) -> None: ...

class Fix:
    @property
    def ok(self) -> bool: ...
    @property
    def status(self) -> str: ...
    @property
    def explanation(self) -> str: ...
    @property
    def position_m(self) -> _Doubles: ...
    @property
    def yaw_rad(self) -> float: ...
    @property
    def state(self) -> _Doubles: ...
    @property
    def covariance(self) -> _Doubles: ...
    @property
    def noise_covariance(self) -> _Doubles: ...
    @property
    def candidates(self) -> list[tuple[_Doubles, float]]: ...
    @property
    def chi_squared(self) -> float: ...
    @property
    def redundancy(self) -> float: ...
    @property
    def residual_px(self) -> float: ...
    @property
    def lamps(self) -> int: ...
    @property
    def rejected_lamps(self) -> int: ...
    @property
    def rejected_ids(self) -> list[int]: ...
    @property
    def unknown_lamps(self) -> int: ...
    @property
    def time_s(self) -> float | None: ...

class Fixes(TypedDict):
    """Result of locate_frames(). It exists in stubs only, as the tables below."""

    frame: _Integers
    status: _Integers
    position_m: _Doubles
    yaw_rad: _Doubles
    covariance: _Doubles
    residual_px: _Doubles
    lamps: _Integers

class Residuals(TypedDict):
    """Result of residuals()."""

    use: list[str]
    predicted_px: _Doubles
    residual_px: _Doubles
    jacobian: _Doubles

class Positioner:
    def __init__(
        self,
        lamp_map: LampMap,
        calibration: Calibration,
        *,
        correction: str = "all",
        mount: tuple[float, float, float, float] | None = None,
        unstated_sigma_px: float = 1.0,
        max_residual_fraction: float = 0.1,
    ) -> None: ...
    def locate(
        self,
        lamps: npt.ArrayLike,
        pixels: npt.ArrayLike,
        sigma_px: npt.ArrayLike | None = None,
        sensors: Sensors = ...,
        *,
        earlier: list[tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike | None, float]] = ...,
    ) -> Fix: ...
    def locate_frames(
        self,
        frames: npt.ArrayLike,
        lamps: npt.ArrayLike,
        pixels: npt.ArrayLike,
        sigma_px: npt.ArrayLike | None = None,
        sensors: Sensors = ...,
    ) -> Fixes: ...
    def locate_image(
        self,
        detector: LampDetector,
        image: npt.NDArray[np.uint8] | npt.NDArray[np.uint16],
        sensors: Sensors = ...,
    ) -> tuple[Fix, tuple[_Integers, _Doubles, _Doubles]]: ...
    def project(self, lamp: int, state: npt.ArrayLike) -> tuple[_Doubles, _Doubles]: ...
    def residuals(self, lamps: npt.ArrayLike, pixels: npt.ArrayLike, fix: Fix) -> Residuals: ...

class LampDetector:
    def __init__(
        self, lamp_map: LampMap, calibration: Calibration, classifier: _File | None = None
    ) -> None: ...
    def detect(
        self, image: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
    ) -> tuple[_Integers, _Doubles, _Doubles]: ...

class DetectionsTable(TypedDict):
    images: list[str]
    frames: _Integers
    lamps: _Integers
    pixels: _Doubles
    sigma_px: _Doubles

class FixesTable(TypedDict):
    images: list[str]
    statuses: list[str]
    position_m: _Doubles
    yaw_rad: _Doubles
    sd: _Doubles

class TruthTable(TypedDict):
    images: list[str]
    position_m: _Doubles
    yaw_rad: _Doubles

def explanation(status: int) -> str: ...
def read_detections(file: _File) -> DetectionsTable: ...
def read_fixes(file: _File) -> FixesTable: ...
def read_truth(file: _File) -> TruthTable: ...
