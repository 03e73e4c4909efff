// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "lamps/signal/lamp_classifier.h"

namespace vlp {

/// Confusion matrix of a classifier for lights of known lamps.
struct Confusion {
  /// Ids of the lamps, sorted.
  std::vector<int> lamps;
  /// Number of lights by lamp (row) and by result (column); the last column is "unknown".
  Eigen::MatrixXi counts;

  int right() const;
  /// Returns the number of lights that are identified as another lamp.
  int wrong() const;
  int unknown() const;
};

/// Computes the confusion matrix for lights that the classifier was not trained on. Their lamps may
/// differ from those of the classifier.
Confusion compute_confusion(const LampClassifier& classifier, std::span<const LabeledLight> lights);

/// Number of folds of the cross-validation.
inline constexpr int kFolds = 5;

using TrainClassifier = std::function<LampClassifier(std::span<const LabeledLight>)>;

/// Computes the confusion matrix by cross-validation. `train` makes a classifier of all images but
/// every fifth one; this classifier is applied to the lights of the held-out images. The folds are
/// deterministic. `lights` as for train_classifier().
Confusion cross_validate(std::span<const LabeledLight> lights, const TrainClassifier& train);

}  // namespace vlp
