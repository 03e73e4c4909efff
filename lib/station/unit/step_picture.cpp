// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/step_picture.h"

#include "rig/input_error.h"

namespace vlp {

StepPicture draw_aside(std::function<Drawing()> drawing) {
  const auto draw = [drawing = std::move(drawing)]() -> std::optional<ReportPicture> {
    try {
      return report_picture(drawing());
    } catch (const InputError&) {  // no gnuplot: a report without it is better than none
      return std::nullopt;
    }
  };
  return std::async(std::launch::async, draw).share();
}

}  // namespace vlp
