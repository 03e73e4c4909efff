// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/train_report.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>

#include "program/app.h"

namespace vlp {

void check_examples(std::span<const LabelledLight> lights, const LampMap& lamps) {
  std::map<int, int> counts;
  for (const Lamp& lamp : lamps.lamps) counts[lamp.id] = 0;
  for (const LabelledLight& light : lights) {
    const auto lamp = counts.find(light.lamp);
    if (lamp == counts.end()) {
      throw std::invalid_argument(fmt::format(
          "the labels name lamp {}, which is not in the lamp map: correct one of the two",
          light.lamp));
    }
    ++lamp->second;
  }
  std::string few;
  for (const auto& [lamp, count] : counts) {
    if (count >= kLeastExamples) continue;
    few += fmt::format("{}{} (has {})", few.empty() ? "" : ", ", lamp, count);
  }
  if (!few.empty()) {
    throw Undetermined(fmt::format(
        "too few labelled lights of lamps {}: add captures in which they are wholly in view, {} or "
        "more of each",
        few, kLeastExamples));
  }
  if (counts.size() < 2) throw Undetermined("one lamp: there is nothing to tell apart; add lamps");
}

void check_kept(const LampClassifier& classifier) {
  std::string few;
  for (const auto& lamp : classifier.lamps) {
    if (lamp.examples >= kLeastExamples) continue;
    few += fmt::format("{}{}", few.empty() ? "" : ", ", lamp.lamp);
  }
  if (few.empty()) return;
  throw Undetermined(fmt::format(
      "the lights of lamps {} have too little in common: are their labels right? Add captures that "
      "show them clearly",
      few));
}

void print_labelled(const Labelled& labelled, const LampClassifier& classifier) {
  int used = 0;
  for (const auto& lamp : classifier.lamps) used += lamp.examples;
  const auto lights = static_cast<int>(labelled.lights.size());
  fmt::print("labels      {}\n  no light  {}\n  left out  {} unlike their lamp's others\n",
             labelled.labels, labelled.without_light, lights - used);
  fmt::print("trained on  {} lights of {} lamps\n", used, classifier.lamps.size());
}

void print_confusion(const Confusion& confusion) {
  fmt::print("answers to lights that were held out, one fifth of the images at a time\n  {:>8}",
             "lamp");
  for (const int lamp : confusion.lamps) fmt::print(" {:>6}", lamp);
  fmt::print(" unknown\n");
  for (std::size_t row = 0; row < confusion.lamps.size(); ++row) {
    fmt::print("  {:>8}", confusion.lamps[row]);
    for (Eigen::Index column = 0; column < confusion.counts.cols(); ++column) {
      fmt::print(" {:>6}", confusion.counts(static_cast<Eigen::Index>(row), column));
    }
    fmt::print("\n");
  }
  const int all = confusion.counts.sum();
  fmt::print("right       {:.2f} %\n  wrong     {}\n  unknown   {}\n",
             100.0 * confusion.right() / all, confusion.wrong(), confusion.unknown());
}

void warn_of_inseparable(const LampClassifier& classifier) {
  constexpr std::size_t most_lines = 10;
  const auto pairs = inseparable(classifier);
  for (std::size_t i = 0; i < std::min(pairs.size(), most_lines); ++i) {
    spdlog::warn(
        "lamps {} and {} look alike ({:.1f} standard deviations apart) and may be left unknown: "
        "change a frequency or a duty",
        pairs[i].first, pairs[i].second, pairs[i].distance);
  }
  if (pairs.size() > most_lines) {
    spdlog::warn("and {} more pairs that look alike", pairs.size() - most_lines);
  }
}

void print_row_time(const RowTime& row_time, Readout readout) {
  fmt::print("row time    {:.5g} us\n  sd        {:.2g} us{}\n", 1e6 * row_time.row_time_s,
             1e6 * row_time.sd_s,
             row_time.lamps == 1 ? ", and the error of the one lamp's frequency" : "");
  fmt::print("rests on    {} lights of {} lamps\nread-out    along {}\n", row_time.lights,
             row_time.lamps, readout == Readout::rows ? "rows" : "columns");
}

}  // namespace vlp
