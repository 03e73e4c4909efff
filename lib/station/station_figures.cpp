// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/station_figures.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace vlp {
namespace {

constexpr std::array kFigures{
    FigureKind{"blur_px", "px", false, "the lens is blurred: out of focus, or dirty",
               "blur of the board's edges, the median view's sigma"},
    FigureKind{"focal_percent", "%", false, "wrong lens: another focal length than the type's",
               "difference of the focal length from the nominal one"},
    FigureKind{"center_px", "px", false, "the lens is decentred",
               "distance of the image centre from the nominal one"},
    FigureKind{"nominal_px", "px", false, "the lens is not of the type",
               "worst difference of the projection from the nominal one, but for a turn"},
    FigureKind{"rms_px", "px", false, "the board's corners do not fit the lens model",
               "residuals of the corners, rms per axis"},
    FigureKind{"uncertainty_px", "px", false,
               "the lens is not known well enough: other board views",
               "worst standard deviation of a projection over the image"},
    FigureKind{"halves_px", "px", false, "two halves of the board views give two lenses",
               "difference of the lenses of every other view, rms per axis"},
    FigureKind{"coverage", "", true, "the board was not shown all over the image",
               "share of the image in which there are corners"},
    FigureKind{"rotation_px", "px", false, "the lamps do not turn about one axis",
               "residuals of the turn on the spot, rms"},
    FigureKind{"rotation_spread_px", "px", false, "the circles of the turn have no common centre",
               "spread of the centres of the lamps' circles, of the level camera"},
    FigureKind{"rotation_sd_px", "px", false, "the rotation centre is not known well enough",
               "standard deviation of the rotation centre"},
    FigureKind{"tilt_deg", "degrees", false, "the camera leans on its mount",
               "angle between the camera and the axis of rotation"},
    FigureKind{"lever_arm_mm", "mm", false, "the camera sits beside its axis of rotation",
               "distance of the camera from the axis of rotation"},
    FigureKind{"dispersion_mm", "mm", false, "the fixes at the station scatter too widely",
               "radius of the dispersion circle, before its offset is taken off"},
    FigureKind{"dispersion_offset_px", "px", false, "the fixes at the station turn with the camera",
               "length of the dispersion's offset"},
    FigureKind{"world_mm", "mm", false, "the station or its lamp map is off",
               "offset of the fixes that does not turn with the camera"},
    FigureKind{"check_fixes", "", true, "captures of the check have no fix",
               "share of the check captures that have a fix"},
    FigureKind{"check_lamps", "", true, "lamps contradict their map",
               "share of the lamps seen in the check captures that the fixes rest on"},
    FigureKind{"check_lamps_seen", "", true, "a lamp is not seen",
               "share of the map's lamps that the check captures show"},
    FigureKind{"check_mean_mm", "mm", false, "the fixes at the known points are off",
               "mean horizontal error at the known points"},
    FigureKind{"check_worst_mm", "mm", false, "a fix at a known point is off",
               "largest horizontal error at the known points"},
    FigureKind{"check_offset_mm", "mm", false, "the known points or the lamps have moved",
               "length of the mean horizontal error"},
    FigureKind{"check_height_mm", "mm", false, "the heights at the known points are off",
               "rms error of the height at the known points"},
    FigureKind{"check_residual_px", "px", false, "the lamps do not fit their map",
               "median residual of the fixes at the known points"},
};

}  // namespace

std::span<const FigureKind> station_figures() { return kFigures; }

bool StationFigure::met() const {
  if (!limit) return true;
  if (!value) return false;
  return at_least ? *value >= *limit : *value <= *limit;
}

std::vector<StationFigure> with_gates(std::span<const Metric> values,
                                      std::span<const StationGate> gates) {
  std::vector<StationFigure> figures;
  for (const FigureKind& kind : kFigures) {
    StationFigure figure{kind.name, {}, {}, kind.at_least};
    for (const auto& [name, value] : values) {
      if (name == kind.name && std::isfinite(value)) figure.value = value;
    }
    for (const auto& [name, limit] : gates) {
      if (name == kind.name) figure.limit = limit;
    }
    if (figure.value || figure.limit) figures.push_back(figure);
  }
  return figures;
}

std::string cause_of(const StationFigure& figure) {
  const auto kind = std::find_if(kFigures.begin(), kFigures.end(),
                                 [&](const auto& known) { return known.name == figure.name; });
  const std::string cause = kind == kFigures.end() ? "a gate is not met" : kind->cause;
  const std::string value = figure.value ? fmt::format("is {:.3g}", *figure.value) : "is not known";
  return fmt::format("{} ({} {}, the gate is {:.3g})", cause, figure.name, value,
                     figure.limit.value_or(0));
}

}  // namespace vlp
