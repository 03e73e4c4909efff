// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "frontend/labelled_lights.h"
#include "lamps/signal/confusion.h"
#include "session/row_time_step.h"

namespace vlp {

struct TrainStepResult : StepResult {
  Labelled labelled;
  LampClassifier classifier;
  /// What classifiers answer to the lights that were held out of their training.
  Confusion confusion;
};

/// The lamp classifier from lights whose lamps the labels of each folder name. Warns of lamps that
/// look alike, and if lamps with known frequencies contradict the row time of the calibration
/// (compare_row_times()). undetermined: one lamp, or too few lights of a lamp, or lights of a lamp
/// that have too little in common. Throws InputError, of the first folder, when the labels name
/// none of its images; std::invalid_argument when they name a lamp that is not in the map.
TrainStepResult train_lamps(const SeenLights& seen, const std::vector<std::vector<Frame>>& labels,
                            const LampMap& lamps, const std::filesystem::path& first_folder);

}  // namespace vlp
