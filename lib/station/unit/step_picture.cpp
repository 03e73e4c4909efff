// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/step_picture.h"

#include "rig/input_error.h"

namespace vlp {

StepPlot render_async(std::function<Drawing()> drawing) {
  const auto draw = [drawing = std::move(drawing)]() -> std::optional<ReportPlot> {
    try {
      return make_report_plot(drawing());
    } catch (const InputError&) {  // no gnuplot: a report without it is better than none
      return std::nullopt;
    }
  };
  return std::async(std::launch::async, draw).share();
}

}  // namespace vlp
