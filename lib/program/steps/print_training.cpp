// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_training.h"

#include <fmt/core.h>

namespace vlp {
namespace {

void print_labeled_lights(const LabeledLights& labeled, const LampClassifier& classifier) {
  int used = 0;
  for (const auto& lamp : classifier.lamps) used += lamp.examples;
  const auto lights = static_cast<int>(labeled.lights.size());
  fmt::print("labels      {}\n  no light  {}\n  rejected  {} unlike the others of their lamp\n",
             labeled.num_labels, labeled.num_labels_without_light, lights - used);
  fmt::print("trained on  {} lights of {} lamps\n", used, classifier.lamps.size());
}

void print_confusion(const ConfusionMatrix& confusion) {
  fmt::print("identification of held-out lights (5-fold cross-validation over the images)\n  {:>8}",
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
  fmt::print("correct     {:.2f} %\n  wrong     {}\n  unknown   {}\n",
             100.0 * confusion.count_correct() / all, confusion.count_wrong(),
             confusion.count_unidentified());
}

}  // namespace

void print_training(const TrainStepResult& result) {
  print_labeled_lights(result.labeled, result.classifier);
  print_confusion(result.confusion);
}

void print_row_time(const RowTime& row_time, Readout readout) {
  fmt::print("row time    {:.5g} us\n  sd        {:.2g} us{}\n", 1e6 * row_time.row_time_s,
             1e6 * row_time.sd_s,
             row_time.lamps == 1 ? ", and the error of the one lamp's frequency" : "");
  fmt::print("based on    {} lights of {} lamps\nreadout     along {}\n", row_time.lights,
             row_time.lamps, readout == Readout::rows ? "rows" : "columns");
}

}  // namespace vlp
