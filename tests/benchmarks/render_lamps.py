#!/usr/bin/python3
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Renders ceiling lamps independently of lib/simulation, and scores the detections of vlp-detect in the images.

  render_lamps.py render KIND OUT [--images N] [--seed S]
  render_lamps.py score DIR... [--programs BIN] [--json] [--max-rms-px LIMIT]
  render_lamps.py self-test

render writes images, lamps.yaml, calibration.yaml (true lens and tilt) and truth.csv to OUT; KIND `all` writes a folder
for each kind. truth.csv: center in the ceiling plane, of a moving camera at the readout of its row; visible fraction of
the face; kind (`hidden`, `cut`: partly by an obstacle or the image border); radius_px, largest distance of the outline
from the center; stripes, periods on the face. score prints for each folder and kind: lamps (two stripes or more, 5 %
visible), lamps found, detections more than 5 px outside of their lamp (wrong), distances of found centers from the
truth, mean squared distance / (2 sigma_px^2) (expected 1), gross errors (distance above 1 px and above 3 sigma_px).
With --max-rms-px it fails if the RMS distance of a kind is larger, if less than 95 % are found, or if one is wrong.

Model: radiance along the ray of each subpixel, area coverage at outlines, cos^4 vignetting, Gaussian blur of subpixels,
mean over each pixel, lit time of a square wave in the exposure of each row, Poisson noise, full well, read noise, black
level, tone curve, unsharp mask, quantization, JPEG. The ceiling is not blurred. The camera moves between rows, not in
an exposure. Points of the ceiling, of the normalized image (x/z, y/z) and pixels (u, v) are complex numbers.
"""

import argparse
import csv
import dataclasses
import json
import pathlib
import subprocess

import numpy as np
from PIL import Image

WIDTH_PX, HEIGHT_PX, ROW_TIME_S = 800, 600, 3e-5
FREQUENCIES_HZ = (1180, 1570, 2090, 2780, 3700)  # stripes of 28.2 to 9.0 rows
# OpenCV's rational model: parameters of LENSMODEL_OPENCV8. The smallest rotation of (0, 0, 1) to the zenith.
INTRINSICS = (514.7, 515.9, 404.2, 296.8, -0.19, 0.05, 0.0004, -0.0003, 0.001, 0.03, 0.02, 0.0006)
FX, FY, CX, CY, K1, K2, P1, P2, K3, K4, K5, K6 = INTRINSICS
ZENITH_IN_CAMERA = A, B, C = np.array([0.013, -0.009, 1]) / np.linalg.norm([0.013, -0.009, 1])
CAMERA_FROM_LEVEL = np.array([[1 - A * A / (1 + C), -A * B / (1 + C), A], [-A * B / (1 + C), 1 - B * B / (1 + C), B],
                              [-A, -B, C]])
X_PATTERN = np.array([-0.55 - 0.4j, 0.55 - 0.42j, 0.02 + 0.03j, -0.53 + 0.4j, 0.56 + 0.38j])
STAGGERED = np.array([-0.5 - 0.5j, 0.45 - 0.22j, -0.42 + 0.06j, 0.5 + 0.33j, -0.4 + 0.56j])
STATISTICS = {"rms_px": lambda error, sd: np.sqrt(np.mean(error**2)), "median_px": lambda error, sd: np.median(error),
              "worst_px": lambda error, sd: error.max(), "sq/var": lambda error, sd: np.mean(error**2 / (2 * sd**2))}
DISCS = ("discs", "chips", "hidden", "saturated", "low-light", "gamma-jpeg", "motion")
# Half sizes (one: a disc), height and positions of the lamps of each kind of folder.
SCENES = {**{kind: ((0.09,), 1.8, X_PATTERN) for kind in DISCS}, "recessed": ((0.13,), 1.8, X_PATTERN),
          "panels": ((0.15, 0.1), 1.9, X_PATTERN), "tubes": ((0.3, 0.02), 2.0, STAGGERED),
          "cut": ((0.18,), 1.8, X_PATTERN), "wide-lamp": ((0.36,), 1.0, X_PATTERN[:4] * 2)}


def compute_distortion(p):
    """Returns the radial factor and the tangential offset of a normalized point."""
    r2 = abs(p)**2
    factor = (1 + r2 * (K1 + r2 * (K2 + r2 * K3))) / (1 + r2 * (K4 + r2 * (K5 + r2 * K6)))
    return factor, (P2 + 1j * P1) * r2 + 2 * p * (P2 * p.real + P1 * p.imag)


def distort(p):
    """Returns the pixel of a normalized point."""
    factor, offset = compute_distortion(p)
    q = p * factor + offset
    return FX * q.real + CX + 1j * (FY * q.imag + CY)


def undistort(pixel):
    """Returns the normalized point of a pixel: the radial part by interpolation, the tangential part iteratively."""
    radii = np.linspace(0, 5, 60001)
    distorted_radii = radii * compute_distortion(radii)[0]
    radial = q = (pixel.real - CX) / FX + 1j * (pixel.imag - CY) / FY
    for _ in range(3):
        p = radial * np.interp(abs(radial), distorted_radii, radii) / np.maximum(abs(radial), 1e-12)
        radial = q - compute_distortion(p)[1]
    return p


@dataclasses.dataclass
class Camera:
    """Pose in the plane z = 0 at the readout of the middle row; constant velocity in the world and yaw rate."""
    position_m: complex
    yaw_rad: float
    velocity_m_per_s: complex = 0
    yaw_rate_rad_per_s: float = 0

    def pose(self, v):
        """Returns position and rotation at the readout of row v."""
        time_s = (v - HEIGHT_PX / 2) * ROW_TIME_S
        yaw_rad = self.yaw_rad + self.yaw_rate_rad_per_s * time_s
        return self.position_m + self.velocity_m_per_s * time_s, np.exp(1j * yaw_rad)

    def project(self, points_m, height_m):
        """Returns the pixels of world points, each at the readout of its own row."""
        pixels = np.full(len(points_m), 0.5j * HEIGHT_PX)
        for _ in range(6):
            position_m, rotation = self.pose(pixels.imag)
            level = (points_m - position_m) / rotation / height_m
            x, y, z = CAMERA_FROM_LEVEL @ [level.real, level.imag, np.ones(len(level))]
            pixels = distort((x + 1j * y) / z)
        return pixels

    def trace(self, pixels):
        """Returns the rays of pixels, as slopes (dx + j dy)/dz and positions at z = 0, and cos^4 of their angles."""
        p = undistort(pixels)
        x, y, z = np.tensordot(CAMERA_FROM_LEVEL.T, [p.real, p.imag, np.ones(p.shape)], 1)
        position_m, rotation = self.pose(pixels.imag)
        return rotation * (x + 1j * y) / z, position_m, (1 + abs(p)**2)**-2


@dataclasses.dataclass
class Lamp:
    """Disc or rectangle in a horizontal plane, also an obstacle."""
    id: int
    center_m: complex
    height_m: float
    half_size_m: tuple  # of a disc its radius
    yaw_rad: float = 0
    frequency_hz: float = 2000
    duty: float = 0.5
    phase: float = 0
    kind: str = "discs"
    radiance_e: float = 6000  # electrons per pixel in an exposure, on the axis, permanently lit
    edge_drop: float = 0  # relative radiance drop from center to outline
    edge_exponent: float = 2
    chips: tuple = ()  # relative to the radius
    chip_sd: float = 0.2
    chip_contrast: float = 0  # (max - min) / (max + min)
    halo: float = 0  # radiance of the ceiling at the outline relative to the lamp
    halo_decay_m: float = 0.05
    depth_m: float = 0  # of the source of a recessed lamp
    source_radius: float = 0.3  # relative to the rim
    back_radius: float = 0.5
    wall_ratio: float = 30  # source to mean of the walls

    def outline(self, num=64, margin_m=0.0):
        """Returns points of the outline, moved outwards by margin_m, in the world."""
        points = np.exp(2j * np.pi * np.arange(num) / num)
        if len(self.half_size_m) > 1:
            points = points / np.maximum(abs(points.real), abs(points.imag))
        points = points.real * (self.half_size_m[0] + margin_m) + 1j * points.imag * (self.half_size_m[-1] + margin_m)
        return self.center_m + points * np.exp(1j * self.yaw_rad)

    def cover_face(self, slopes, positions_m):
        """Returns where rays intersect the plane, along the lamp's axes, coverage by the face, and distance outside."""
        p = (positions_m + slopes * self.height_m - self.center_m) * np.exp(-1j * self.yaw_rad)
        if len(self.half_size_m) == 1:
            outside = abs(p) - self.half_size_m[0]
            return p, cover(-outside), np.maximum(outside, 0)
        dx, dy = abs(p.real) - self.half_size_m[0], abs(p.imag) - self.half_size_m[1]
        return p, cover(-dx) * cover(-dy), np.hypot(np.maximum(dx, 0), np.maximum(dy, 0))

    def face_radiance(self, points):
        """Returns the relative radiance of the face at points."""
        radiance, x, y = 1.0, points.real / self.half_size_m[0], points.imag / self.half_size_m[-1]
        for c in [abs(x), abs(y)] if len(self.half_size_m) > 1 else [np.hypot(x, y)]:
            radiance = radiance * (1 - self.edge_drop * np.minimum(c, 1)**self.edge_exponent)
        if len(self.chips):
            blobs, peaks = [np.sum(np.exp(-0.5 * abs(np.subtract.outer(self.chips, p) / self.chip_sd)**2), axis=0)
                            for p in (x + 1j * y, self.chips)]
            low = (1 - self.chip_contrast) / (1 + self.chip_contrast)
            radiance = radiance * (low + (1 - low) * blobs / peaks.max())
        return radiance

    def recess_radiance(self, points, slopes):
        """Traces rays into a cone with a small Lambertian source in the middle of its back and Lambertian walls."""
        rim, depth = self.half_size_m[0], self.depth_m
        taper = rim * (1 - self.back_radius) / depth
        # Depth at which the ray p + slope t meets the wall, |p + slope t| = rim - taper t.
        a = abs(slopes)**2 - taper**2 + 1e-12  # not 0
        b = (points * slopes.conj()).real + taper * rim
        root = np.sqrt(np.maximum(b * b - a * np.minimum(abs(points)**2 - rim * rim, 0), 0))
        roots = np.array([(-b - root) / a, (-b + root) / a])
        hit = np.minimum(np.where(roots > 0, roots, np.inf).min(axis=0), depth)
        # Irradiance of the wall: cos(source) cos(wall) / distance^2, up to a factor.
        irradiance, others = [(depth - t) / ((rim - taper * t)**2 + (depth - t)**2)**2
                              for t in (hit, np.linspace(0, depth, 100))]
        walls = (0.3 + 0.7 * irradiance / others.mean()) / self.wall_ratio  # 30 % by repeated reflection
        radius = abs(points + slopes * depth) / (self.source_radius * rim)
        walls += 0.2 * np.exp(-4 * np.maximum(radius - 1, 0))  # scattered around the source
        source = cover(1 - radius)
        return source * (1 - self.edge_drop * np.minimum(radius, 1)**2) + (1 - source) * walls

    def lit_fraction(self, rows, exposure_s):
        """Returns the fraction of the exposure of each row during which the lamp is lit."""
        cycles = [self.frequency_hz * (rows * ROW_TIME_S + t) + self.phase for t in (0, exposure_s)]
        start, end = [np.floor(c) * self.duty + np.minimum(c % 1, self.duty) for c in cycles]
        return (end - start) / (self.frequency_hz * exposure_s)


@dataclasses.dataclass
class Sensor:
    exposure_s: float = 9e-5
    blur_sd_px: float = 0.7
    white_e: float = 9000  # electrons of the largest gray value
    full_well_e: float = 10000
    read_noise_e: float = 5
    bits: int = 8
    ambient_e: float = 40
    gamma: float = 1
    sharpening: float = 0
    jpeg_quality: int = 0


def cover(distance):
    """Returns the fraction of each sample's cell in which a function, linear across the cell, is positive."""
    dv, du = np.gradient(distance)
    return np.clip(distance / np.maximum(abs(du) + abs(dv), 1e-12) + 0.5, 0, 1)


def blur(image, sd):
    radius = int(np.ceil(4 * sd))
    kernel = np.exp(-0.5 * (np.arange(-radius, radius + 1) / sd)**2)
    for _ in range(2):
        padded = np.pad(image, [(radius, radius), (0, 0)], mode="edge")
        image = sum(w * padded[i:i + len(image)] for i, w in enumerate(kernel / kernel.sum())).T
    return image


def is_in_image(pixels, margin_px=-0.5):
    u, v = pixels.real, pixels.imag
    return (u > margin_px) & (v > margin_px) & (u < WIDTH_PX - 1 - margin_px) & (v < HEIGHT_PX - 1 - margin_px)


def uncovered_fraction(bars, slopes, positions_m):
    return np.prod([1 - bar.cover_face(slopes, positions_m)[1] for bar in bars] or [1.0], axis=0)


def render_lamp(camera, lamp, bars, sensor):
    """Returns the pixels around a lamp, their electrons while it is lit, and the visible fraction of its face."""
    outline = camera.project(lamp.outline(margin_m=5 * lamp.halo_decay_m if lamp.halo else 0), lamp.height_m)
    ranges = [(int(c.min() - 10), int(c.max() + 11)) for c in (outline.real, outline.imag)]
    subpixels = 4 if max(last - first for first, last in ranges) < 150 else 2
    u, v = [np.arange(first - 0.5 + 0.5 / subpixels, last - 0.5, 1 / subpixels) for first, last in ranges]
    pixels = u + 1j * v[:, None]
    slopes, positions_m, cos4 = camera.trace(pixels)
    points, face, distance_m = lamp.cover_face(slopes, positions_m)
    uncovered = uncovered_fraction(bars, slopes, positions_m)
    halo = lamp.halo * (1 - lamp.edge_drop) * np.exp(-distance_m / lamp.halo_decay_m)
    radiance = lamp.recess_radiance(points, slopes) if lamp.depth_m else lamp.face_radiance(points)
    light = (face * radiance + (1 - face) * halo) * cos4 * uncovered * lamp.radiance_e
    visible = (face * uncovered * is_in_image(pixels)).sum() / face.sum()
    return [c.reshape(v.size // subpixels, subpixels, u.size // subpixels, subpixels).mean(axis=(1, 3))
            for c in (pixels, blur(light, sensor.blur_sd_px * subpixels))] + [visible]


def render_electrons(camera, lamps, bars, sensor):
    """Returns the mean electrons of each pixel, and the rows of truth.csv without the name of the image."""
    slopes, positions_m, cos4 = camera.trace(np.arange(WIDTH_PX) + 1j * np.arange(HEIGHT_PX)[:, None])
    image = sensor.ambient_e * cos4 * (1 + 0.2 * slopes.real - 0.1 * slopes.imag)
    image *= 0.3 + 0.7 * uncovered_fraction(bars, slopes, positions_m)
    truth = []
    for lamp in lamps:
        outline = camera.project(lamp.outline(), lamp.height_m)
        if not is_in_image(outline, -100).any():
            continue
        pixels, light, visible = render_lamp(camera, lamp, bars, sensor)
        light, inside = light * lamp.lit_fraction(pixels.imag, sensor.exposure_s), is_in_image(pixels)
        image[pixels.imag[inside].astype(int), pixels.real[inside].astype(int)] += light[inside]
        if visible > 0.001:
            center = camera.project([lamp.center_m], lamp.height_m)[0]
            kind = "cut" if not is_in_image(outline).all() else "hidden" if visible < 0.999 else lamp.kind
            stripes = np.ptp(np.clip(outline.imag, 0, HEIGHT_PX - 1)) * lamp.frequency_hz * ROW_TIME_S
            truth.append((lamp.id, center.real.round(4), center.imag.round(4), visible.round(4), kind,
                          abs(outline - center).max().round(1), stripes.round(2)))
    return image, truth


def expose(electrons, sensor, rng):
    """Returns the image of a sensor with in-camera processing, 8 bits, or 16 bits of which the first `bits` count."""
    value = np.minimum(rng.poisson(electrons), sensor.full_well_e) + rng.normal(0, sensor.read_noise_e, electrons.shape)
    # A black level of 2 %, or a tone curve.
    value = 0.02 + 0.98 * value / sensor.white_e if sensor.gamma == 1 else \
        np.clip(value / sensor.white_e, 0, 1)**(1 / sensor.gamma)
    if sensor.sharpening:
        value = value + sensor.sharpening * (value - blur(value, 1.0))
    value = np.rint(np.clip(value, 0, 1) * (2**sensor.bits - 1)).astype(np.uint16)
    return value.astype(np.uint8) if sensor.bits == 8 else value << (16 - sensor.bits)


def randomize_lamp(lamp, sensor, rng):
    """Returns a lamp of the map with random phase and appearance."""
    radius, kind = lamp.half_size_m[0], lamp.kind
    values = {"phase": rng.uniform(), "radiance_e": rng.uniform(0.45, 0.9) * sensor.white_e,
              "edge_drop": rng.choice([0, rng.uniform(0.1, 0.5)]), "edge_exponent": rng.uniform(1.5, 4)}
    if kind == "chips" or kind in ("gamma-jpeg", "saturated") and rng.uniform() < 0.4:
        angle = np.linspace(0, 2 * np.pi, rng.integers(4, 9), endpoint=False) + rng.uniform(0, 2 * np.pi)
        ring = rng.uniform(0.5, 0.7) + rng.normal(0, 0.04, len(angle))
        values.update(chips=np.array([0, *(ring * np.exp(1j * angle))]), chip_sd=rng.uniform(0.14, 0.24),
                      chip_contrast=rng.uniform(0.2, 0.8), edge_drop=0)
    if kind in ("chips", "gamma-jpeg", "saturated", "panels"):
        values.update(halo=rng.uniform(0.08, 0.15), halo_decay_m=radius * rng.uniform(0.2, 0.5))
    if kind == "recessed":
        back = rng.uniform(0.45, 1)
        values.update(depth_m=radius * rng.uniform(0.8, 1.8), back_radius=back, wall_ratio=rng.uniform(15, 50),
                      source_radius=back * rng.uniform(0.5, 0.9), radiance_e=rng.uniform(0.7, 1.2) * sensor.white_e,
                      edge_drop=rng.uniform(0, 0.8))
    if kind == "saturated":
        values["radiance_e"] = rng.uniform(1.2, 4) * sensor.white_e
    return dataclasses.replace(lamp, **values)


def randomize_sensor(kind, rng):
    values = {"exposure_s": rng.uniform(4e-5, 1.4e-4), "blur_sd_px": rng.uniform(0.5, 1.1),
              "ambient_e": rng.uniform(10, 150), "bits": 10 if kind == "chips" else 8}
    if kind == "low-light":
        values.update(white_e=rng.uniform(120, 400), read_noise_e=rng.uniform(2, 6), ambient_e=2, bits=12)
    elif kind == "saturated":
        values.update(full_well_e=Sensor.white_e * rng.uniform(0.95, 1.2))
    elif kind == "gamma-jpeg":
        values.update(gamma=2.2, sharpening=rng.uniform(0, 0.8), jpeg_quality=int(rng.integers(75, 95)))
    return Sensor(**values)


def randomize_camera(kind, lamps, rng):
    """Returns a camera that sees four lamps or more completely and cuts none; kinds cut and wide-lamp differ."""
    while True:
        position_m = complex(*rng.uniform(-1, 1, 2)) * {"wide-lamp": 0.12, "cut": 0.75}.get(kind, 0.3)
        if kind == "wide-lamp":
            position_m += rng.choice(lamps).center_m
        camera = Camera(position_m, rng.uniform(-np.pi, np.pi))
        if kind == "motion":
            camera.velocity_m_per_s = rng.uniform(0.2, 1.2) * np.exp(1j * rng.uniform(-np.pi, np.pi))
            camera.yaw_rate_rad_per_s = rng.uniform(-0.6, 0.6)
        inside = [is_in_image(camera.project(lamp.outline(), lamp.height_m), 10).mean() for lamp in lamps]
        num_cut, num_complete = sum(0 < f < 1 for f in inside), sum(f == 1 for f in inside)
        if {"wide-lamp": num_complete, "cut": num_cut and num_complete > 1}.get(kind, num_complete > 3 and not num_cut):
            return camera


def render_folder(kind, folder, num_images, seed):
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([seed, *kind.encode()])
    half_size_m, height_m, centers_m = SCENES[kind]
    yaws_rad = rng.choice([0, np.pi / 2], 5) * (kind == "panels") + rng.normal(0, 0.1, 5) * (len(half_size_m) > 1)
    heights_m, lamp_kind = height_m + rng.uniform(-0.03, 0.03, 5), "discs" if kind in ("hidden", "cut") else kind
    lamps = [Lamp(i + 1, complex(center_m), heights_m[i].round(3), half_size_m, yaws_rad[i].round(4), FREQUENCIES_HZ[i],
                  kind=lamp_kind) for i, center_m in enumerate(centers_m)]
    text = "format: vlp-lamps/1\nlamps:\n"
    for lamp in lamps:
        size = [2 * s for s in lamp.half_size_m]
        shape = f"shape: rectangle, size_m: {size}, yaw_rad: {lamp.yaw_rad}" if size[1:] else f"diameter_m: {size[0]}"
        text += f"  - {{id: {lamp.id}, position_m: [{lamp.center_m.real}, {lamp.center_m.imag}, {lamp.height_m}], " \
            f"frequency_hz: {lamp.frequency_hz}, duty: {lamp.duty}, {shape}}}\n"
    (folder / "lamps.yaml").write_text(text)
    (folder / "calibration.yaml").write_text(
        "format: vlp-calibration/1\nrotation_center:\n  model: tilt\n"
        f"  center_px: [{CX + FX * A / C}, {CY + FY * B / C}]\n  zenith_in_camera: [{A}, {B}, {C}]\n"
        f"camera:\n  id: rendered\n  row_time_s: {ROW_TIME_S:.8f}\n  readout: rows\n"
        f"  imager_px: [{WIDTH_PX}, {HEIGHT_PX}]\n  lens_model: LENSMODEL_OPENCV8\n  intrinsics: {list(INTRINSICS)}\n")
    text = "image,lamp,u_px,v_px,visible_fraction,kind,radius_px,stripes\n"
    for i in range(num_images):
        sensor, camera = randomize_sensor(kind, rng), randomize_camera(kind, lamps, rng)
        bars = []
        if kind == "hidden":  # an opaque bar between camera and a lamp covers a part of the lamp
            lamp, nearness, radius_m = rng.choice(lamps), rng.uniform(0.5, 0.95), half_size_m[0]
            target_m = lamp.center_m + complex(*rng.uniform(-0.9, 0.9, 2)) * radius_m
            bars = [Lamp(0, camera.position_m * (1 - nearness) + target_m * nearness, lamp.height_m * nearness,
                         (1.0, radius_m * rng.uniform(0.1, 0.5) * nearness), rng.uniform(0, np.pi))]
        electrons, truth = render_electrons(camera, [randomize_lamp(lamp, sensor, rng) for lamp in lamps], bars, sensor)
        name = f"{i:04d}.{'jpg' if sensor.jpeg_quality else 'png'}"
        Image.fromarray(expose(electrons, sensor, rng)).save(folder / name, quality=sensor.jpeg_quality)
        text += "".join(",".join(map(str, (name, *row))) + "\n" for row in truth)
    (folder / "truth.csv").write_text(text)


def score_folder(folder, programs):
    """Runs vlp-detect, which writes detections.csv to the folder, and returns statistics for each kind of lamp."""
    output = folder / "detections.csv"
    output.unlink(missing_ok=True)  # without any lamp the program writes none and exits with 3
    command = [programs / "vlp-detect", folder, "--lamps", folder / "lamps.yaml", "--calibration",
               folder / "calibration.yaml", "-o", output, "--threads", "1", "--quiet"]
    if subprocess.run(command, check=False).returncode not in (0, 3):
        raise SystemExit(f"{folder}: vlp-detect failed")
    detections, truth = [[{k: v if k in ("image", "lamp", "kind") else float(v) for k, v in row.items()}
                          for row in csv.DictReader(path.read_text().splitlines() if path.exists() else [])]
                         for path in (output, folder / "truth.csv")]
    for d in detections:
        in_image = [t for t in truth if t["image"] == d["image"]]
        distances = [np.hypot(d["u_px"] - t["u_px"], d["v_px"] - t["v_px"]) for t in in_image]
        own = [(t, e) for t, e in zip(in_image, distances) if t["lamp"] == d["lamp"] and e < t["radius_px"] + 5]
        if own:
            own[0][0].update(error=own[0][1], sd=d["sigma_px"])
        else:
            nearest = in_image[np.argmin(distances)] if in_image else truth[0]
            nearest.setdefault("wrong", []).append(d["lamp"])
    rows = []
    for kind in sorted({t["kind"] for t in truth}):
        of_kind = [t for t in truth if t["kind"] == kind]
        error, sd = np.array([(t["error"], t["sd"]) for t in of_kind if "error" in t]).reshape(-1, 2).T
        num_lamps = sum("error" in t or t["stripes"] >= 2 and t["visible_fraction"] >= 0.05 for t in of_kind)
        values = [f(error, sd).round(4) for f in STATISTICS.values()] if len(error) else [None] * 4
        rows.append({"scene": folder.name, "kind": kind, "lamps": num_lamps, "found": len(error),
                     "wrong": sum(len(t.get("wrong", ())) for t in of_kind),
                     **dict(zip(STATISTICS, values)), "gross": int(np.sum((error > 1) & (error > 3 * sd)))})
    return rows


def self_test():
    """Checks the renderer against projections, areas and statistics that it does not use."""
    rng = np.random.default_rng(1)
    p = rng.uniform(-0.85, 0.85, 500) + 1j * rng.uniform(-0.85, 0.85, 500)
    assert np.allclose(undistort(distort(p)), p, atol=1e-7), "lens"

    def compare_with_polygon(lamp, camera, blur_sd_px=0.7):
        pixels, image, _ = render_lamp(camera, lamp, [], Sensor(blur_sd_px=blur_sd_px))
        image /= camera.trace(pixels)[2]
        centroid = (image * pixels).sum() / image.sum()
        p = camera.project(lamp.outline(4000), lamp.height_m)
        area = (p.conj() * np.roll(p, -1)).imag / 2  # of triangles with the origin
        assert abs(image.sum() / (lamp.radiance_e * abs(area.sum())) - 1) < 3e-3, "flux and area"
        assert abs(centroid - (area * (p + np.roll(p, -1))).sum() / 3 / area.sum()) < 0.01, "centroid and outline"
        return abs(centroid - camera.project([lamp.center_m], lamp.height_m)[0])
    for i in range(6):
        camera = Camera(complex(*rng.uniform(-0.3, 0.3, 2)), rng.uniform(-3, 3), (0.9 - 0.7j) * (i % 2), 0.5 * (i % 2))
        assert compare_with_polygon(Lamp(1, 0.2 - 0.3j, 1.8, (0.008,)), camera) < 0.01, "small disc"
        compare_with_polygon(Lamp(1, -0.3 + 0.3j, 1.8, (0.09,)), camera, 0.5 + 0.1 * i)
        compare_with_polygon(Lamp(1, 0.5 + 0.1j, 1.8, (0.2, 0.01), 0.4 * i), camera)
    lamp = Lamp(1, 0, 1.8, (0.1,), frequency_hz=1 / (20 * ROW_TIME_S), duty=0.35, phase=0.13)
    lit = lamp.lit_fraction(np.arange(40), 7.7e-5)
    times_s = np.arange(40)[:, None] * ROW_TIME_S + 7.7e-5 * (np.arange(4000) + 0.5) / 4000
    assert abs(lit.mean() - 0.35) < 1e-9 and np.allclose((lit.min(), lit.max()), (0, 1)), "duty"
    assert np.allclose(lit, ((times_s * lamp.frequency_hz + 0.13) % 1 < 0.35).mean(axis=1), atol=1e-3), "exposure"
    # Seen along a slope, the source moves in the plane of the rim by slope times depth.
    p = np.linspace(-0.099, 0.099, 199) + 1j * np.linspace(-0.099, 0.099, 199)[:, None]
    for slope in (0, 0.3):
        radiance = dataclasses.replace(lamp, depth_m=0.1, back_radius=0.8).recess_radiance(p, slope + 0 * p)
        assert abs(p[(radiance > 0.9) & (abs(p) < 0.1)].mean() + slope * 0.1) < 1e-3, "parallax"
        assert 1 / 200 < radiance[(abs(p) < 0.095) & (abs(p + slope * 0.1) > 0.035)].mean() < 1 / 8, "walls"
    sensor = Sensor(white_e=0.98 * 4095, full_well_e=3000, bits=12, ambient_e=0)  # one electron per gray value
    for electrons, mean, sd in (0, 0, 5), (400, 400, np.sqrt(425)), (1e5, 3000, 5):
        values = expose(np.full((200, 200), float(electrons)), sensor, rng) / 16
        assert abs(values.mean() - 0.02 * 4095 - mean) < 0.5 and abs(values.std() / sd - 1) < 0.02, "noise"
    # A bar over x > 0 hides one half.
    camera, bar = Camera(0, 0), Lamp(0, 0.5, 0.9, (0.5, 0.5))
    image, truth = render_electrons(camera, [dataclasses.replace(lamp, duty=1)], [bar], sensor)
    assert abs(truth[0][3] - 0.5) < 0.01 and truth[0][4] == "hidden", "bar"
    assert image[:, :int(truth[0][1]) + 3].sum() > 0.97 * image.sum() > 0, "side of the bar"
    print("self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    render = commands.add_parser("render", help="render a folder of images")
    render.add_argument("kind", choices=[*SCENES, "all"])
    render.add_argument("out", type=pathlib.Path)
    render.add_argument("--images", type=int, default=24)
    render.add_argument("--seed", type=int, default=1)
    score = commands.add_parser("score", help="score the detections of vlp-detect")
    score.add_argument("folders", type=pathlib.Path, nargs="+", metavar="DIR")
    score.add_argument("--programs", type=pathlib.Path, default=pathlib.Path(__file__).parents[2] / "build/bin")
    score.add_argument("--json", action="store_true", help="print JSON")
    score.add_argument("--max-rms-px", type=float, help="largest RMS distance")
    commands.add_parser("self-test", help="check the renderer without the detector")
    args = parser.parse_args()
    if args.command == "self-test":
        self_test()
    elif args.command == "render":
        for kind in SCENES if args.kind == "all" else [args.kind]:
            render_folder(kind, args.out / kind if args.kind == "all" else args.out, args.images, args.seed)
    else:
        scenes = [path.parent for folder in args.folders for path in sorted(folder.glob("**/truth.csv"))]
        rows = [row for scene in scenes for row in score_folder(scene, args.programs)]
        lines = [" ".join(f"{'-' if value is None else value:>10}" for value in row.values()) for row in rows]
        print(json.dumps(rows, indent=1) if args.json else "\n".join([" ".join(f"{n:>10}" for n in rows[0]), *lines]))
        for row in rows if args.max_rms_px else ():
            if row["wrong"] or row["found"] < max(1, 0.95 * row["lamps"]) or row["rms_px"] > args.max_rms_px:
                raise SystemExit(f"{row['scene']}: {row['kind']}: {row['found']} of {row['lamps']} lamps, "
                                 f"{row['wrong']} wrong, rms {row['rms_px']} px; at least 95 %, none wrong, and "
                                 f"at most {args.max_rms_px} px were expected")


if __name__ == "__main__":
    main()
