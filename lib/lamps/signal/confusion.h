// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "lamps/signal/lamp_classifier.h"

namespace vlp {

/// Confusion matrix of a classifier for lights whose lamps are known.
struct Confusion {
  /// Ids, sorted.
  std::vector<int> lamps;
  /// Lights by their lamp (row) and by the answer (column); the last column is "unknown".
  Eigen::MatrixXi counts;

  int right() const;
  /// Number of lights that are identified as another lamp.
  int wrong() const;
  int unknown() const;
};

/// Computes the confusion matrix for lights that the classifier was not trained on. Their lamps may
/// be others than its own.
Confusion confusion_of(const LampClassifier& classifier, std::span<const LabelledLight> lights);

/// Number of parts for cross-validation.
inline constexpr int kFolds = 5;

using TrainClassifier = std::function<LampClassifier(std::span<const LabelledLight>)>;

/// Cross-validates: each fifth of the images (every fifth one, so that the result is deterministic)
/// is judged by a classifier that `train` makes of the others. `lights` as for train_classifier().
Confusion cross_validated(std::span<const LabelledLight> lights, const TrainClassifier& train);

}  // namespace vlp
