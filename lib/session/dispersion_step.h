// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "captures/captures_table.h"
#include "session/rotation_step.h"

namespace vlp {

/// Captures at known places, and how many have none.
struct KnownPlaces {
  std::vector<StationCapture> captures;
  /// Of each, whose place it is.
  std::vector<PlaceOf> of = {};
  std::size_t without = 0;
};

/// A capture is where the table says it is, or else at `place_m`, if that is given, a place of
/// `place_of`. The inclination is the table's.
KnownPlaces at_known_places(std::span<const Frame> frames, const CapturesTable& table,
                            const std::optional<Eigen::Vector2d>& place_m = {},
                            PlaceOf place_of = PlaceOf::camera);

struct DispersionResult : StepResult {
  DispersionFit fit;
};

/// What fixes at known places still lack. Places of the axis are taken to the camera by the
/// calibration's lever arm and the fixes' yaws; without a lever arm: undetermined. Warns of an
/// offset that equals the lever arm, as places of the axis make it that are taken for the camera's.
/// Metrics: dispersion_mm, dispersion_offset_px, and where it is known world_mm. wrong_map,
/// wrong_place, undetermined. Precondition: there is a capture.
DispersionResult solve_dispersion(const LampCaptures& input, const KnownPlaces& places,
                                  DispersionMethod method, DispersionCircle circle,
                                  HistoryEntry entry);

}  // namespace vlp
