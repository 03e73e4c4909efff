// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "frontend/labeled_lights.h"
#include "lamps/signal/lamp_classifier.h"
#include "session/row_time_step.h"

namespace vlp {

/// Result of run_train_step().
struct TrainStepResult : StepResult {
  LabeledLights labeled;
  LampClassifier classifier;
  /// Confusion matrix by cross-validation: identified lamp against labeled lamp. Each light is
  /// identified by a classifier that was trained without its image.
  ConfusionMatrix confusion;
};

/// Trains the lamp classifier with the lights that the labels of each folder identify. Warns of
/// inseparable lamps, and if lamps with known frequencies contradict the row time of the
/// calibration (describe_wrong_row_time()). Failure: undetermined, if there is one lamp
/// only, or a lamp has too few lights or too dissimilar ones.
///
/// @param first_folder  folder named in the error about labels
/// @throws InputError if the labels name no usable image of any folder
/// @throws std::invalid_argument if the labels name a lamp that is not in the map
TrainStepResult run_train_step(const DetectedLights& seen,
                               const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                               const std::filesystem::path& first_folder);

}  // namespace vlp
