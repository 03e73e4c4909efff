// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/confusion.h"

#include <algorithm>
#include <set>
#include <utility>

namespace vlp {
namespace {

/// Returns an empty confusion matrix for `lamps` and the lamps of `lights`.
Confusion empty_confusion(std::span<const LabeledLight> lights, std::set<int> lamps = {}) {
  for (const LabeledLight& light : lights) lamps.insert(light.lamp);
  Confusion confusion{{lamps.begin(), lamps.end()}, {}};
  const auto count = static_cast<Eigen::Index>(lamps.size());
  confusion.counts = Eigen::MatrixXi::Zero(count, count + 1);
  return confusion;
}

Eigen::Index find_index(const Confusion& confusion, int lamp) {
  return std::lower_bound(confusion.lamps.begin(), confusion.lamps.end(), lamp) -
         confusion.lamps.begin();
}

void count_answer(const LampClassifier& classifier, const LabeledLight& light,
                  Confusion& confusion) {
  const auto answer = identify_lamp(classifier, light.stripes);
  const auto unknown = static_cast<Eigen::Index>(confusion.lamps.size());
  ++confusion.counts(find_index(confusion, light.lamp),
                     answer ? find_index(confusion, *answer) : unknown);
}

}  // namespace

int Confusion::right() const { return counts.diagonal().sum(); }

int Confusion::unknown() const { return counts.rightCols<1>().sum(); }

int Confusion::wrong() const { return counts.sum() - right() - unknown(); }

Confusion compute_confusion(const LampClassifier& classifier,
                            std::span<const LabeledLight> lights) {
  std::set<int> known;
  for (const auto& lamp : classifier.lamps) known.insert(lamp.lamp);
  Confusion confusion = empty_confusion(lights, std::move(known));
  for (const LabeledLight& light : lights) count_answer(classifier, light, confusion);
  return confusion;
}

Confusion cross_validate(std::span<const LabeledLight> lights, const TrainClassifier& train) {
  Confusion confusion = empty_confusion(lights);
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<LabeledLight> others, held_out;
    for (const LabeledLight& light : lights) {
      (light.image % kFolds == std::size_t(fold) ? held_out : others).push_back(light);
    }
    const LampClassifier classifier = train(others);
    for (const LabeledLight& light : held_out) count_answer(classifier, light, confusion);
  }
  return confusion;
}

}  // namespace vlp
