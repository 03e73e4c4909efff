// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "detection/lamp_detector.h"

namespace vlp {

/// Warns of lamps of the map that can hardly be identified from the floor (z = 0): by two that are
/// too much alike, and by one that shows too few stripes, too fine or too smeared ones; a few lines
/// at most. The camera has a row time; without a calibration lamps' sizes in the image are not
/// known.
void warn_of_lamps(const LampMap& lamps, const DetectorCamera& detector,
                   const std::optional<Calibration>& calibration,
                   const std::optional<double>& exposure_s);

}  // namespace vlp
