// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "lamps/signal/lamp_classifier.h"

namespace vlp {

/// What a classifier answers about lights whose lamps are known.
struct Confusion {
  /// By id.
  std::vector<int> lamps;
  /// Lights by their lamp (row) and by the answer (column); the last column is "unknown".
  Eigen::MatrixXi counts;

  int right() const;
  /// Taken for another lamp.
  int wrong() const;
  int unknown() const;
};

/// Of lights that the classifier was not trained on; their lamps may be others than its own.
Confusion confusion_of(const LampClassifier& classifier, std::span<const LabelledLight> lights);

/// Parts that the lights are held out in.
inline constexpr int kFolds = 5;

using TrainClassifier = std::function<LampClassifier(std::span<const LabelledLight>)>;

/// Each fifth of the images (every fifth one, so that the answer is always the same) judged by a
/// classifier that `train` made of the others. `lights` as for train_classifier().
Confusion cross_validated(std::span<const LabelledLight> lights, const TrainClassifier& train);

}  // namespace vlp
