// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/train_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "rig/input_error.h"

namespace vlp {
namespace {

/// Returns true if each lamp has enough lights; otherwise fails the step.
bool has_examples(std::span<const LabeledLight> lights, const LampMap& lamps,
                  TrainStepResult& result) {
  std::map<int, int> counts;
  for (const Lamp& lamp : lamps.lamps) counts[lamp.id] = 0;
  for (const LabeledLight& light : lights) {
    const auto lamp = counts.find(light.lamp);
    if (lamp == counts.end()) {
      throw std::invalid_argument(fmt::format(
          "the labels contain lamp {}, which is not in the lamp map: correct one of them",
          light.lamp));
    }
    ++lamp->second;
  }
  std::string few;
  for (const auto& [lamp, count] : counts) {
    if (count >= kMinExamples) continue;
    few += fmt::format("{}{} (has {})", few.empty() ? "" : ", ", lamp, count);
  }
  if (!few.empty()) {
    result.set_step_failure(
        StepFailure::undetermined,
        fmt::format("too few labeled lights of lamps {}: add captures in which they are "
                    "wholly in view, {} or more of each",
                    few, kMinExamples));
  } else if (counts.size() < 2) {
    result.set_step_failure(StepFailure::undetermined,
                            "a classifier needs two lamps or more; add lamps");
  }
  return result.has_succeeded();
}

/// Returns true if training kept enough lights of each lamp; otherwise fails the step.
bool has_kept_examples(const LampClassifier& classifier, TrainStepResult& result) {
  std::string few;
  for (const auto& lamp : classifier.lamps) {
    if (lamp.examples >= kMinExamples) continue;
    few += fmt::format("{}{}", few.empty() ? "" : ", ", lamp.lamp);
  }
  if (few.empty()) return true;
  result.set_step_failure(
      StepFailure::undetermined,
      fmt::format("the lights of lamps {} differ too much: are their labels right? Add "
                  "captures that show them clearly",
                  few));
  return false;
}

void warn_about_inseparable(const LampClassifier& classifier, TrainStepResult& result) {
  constexpr std::size_t max_lines = 10;
  const auto pairs = list_inseparable_lamps(classifier);
  for (std::size_t i = 0; i < std::min(pairs.size(), max_lines); ++i) {
    // [LAMP-11] `look alike`
    result.warnings.push_back(
        fmt::format("lamps {} and {} look alike ({:.1f} standard deviations apart) and may remain "
                    "unidentified: change a frequency or a duty",
                    pairs[i].first, pairs[i].second, pairs[i].distance));
  }
  if (pairs.size() > max_lines) {
    result.warnings.push_back(
        fmt::format("and {} more pairs that look alike", pairs.size() - max_lines));
  }
}

/// Warns if the labeled lamps contradict the row time of the calibration.
void warn_about_row_time(const DetectedLights& seen, const std::vector<std::vector<Frame>>& labels,
                         const LampMap& lamps, TrainStepResult& result) {
  if (!seen.camera.row_time_s) return;
  const auto measured =
      estimate_row_time(seen.by_folder(), labels, lamps, seen.camera.lens).row_time;
  if (!measured) return;
  std::string error =
      describe_wrong_row_time(*measured, {*seen.camera.row_time_s, "the calibration"});
  if (!error.empty()) result.warnings.push_back(std::move(error));
}

}  // namespace

TrainStepResult run_train_step(const DetectedLights& seen,
                               const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                               const std::filesystem::path& first_folder) {
  TrainStepResult result;
  LabeledLights& labeled = result.labeled;
  const auto folders = seen.by_folder();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    add_labeled_lights(folders[i], labels[i], labeled);
  }
  if (labeled.num_labels == 0) {
    throw InputError(first_folder,
                     "the table names none of the images that can be used: image names have to be "
                     "equal, with their endings");
  }
  if (!has_examples(labeled.lights, lamps, result)) return result;
  result.classifier = fit_classifier(labeled.lights);
  result.classifier.row_time_s = seen.camera.row_time_s;
  if (!has_kept_examples(result.classifier, result)) return result;
  result.confusion = cross_validate(labeled.lights, fit_classifier);
  warn_about_inseparable(result.classifier, result);
  warn_about_row_time(seen, labels, lamps, result);
  return result;
}

}  // namespace vlp
