// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/rotation_in_place.h"

#include <map>

#include "program/app.h"
#include "program/steps/history.h"
#include "program/steps/print_rotation.h"
#include "program/steps/step_outcome.h"
#include "report/plots/gnuplot.h"
#include "session/rotation_step.h"

namespace vlp {
namespace {

const std::map<std::string, RotationMethod> kMethods{{"axis", RotationMethod::axis},
                                                     {"joint", RotationMethod::joint},
                                                     {"circle", RotationMethod::circle}};

}  // namespace

void run_rotation_in_place(const CLI::App& app, CaptureOptions images, const std::string& method,
                           const std::string& plot) {
  const std::vector<std::string> inputs = list_inputs(images);
  check_outputs({{"--output", images.output}, {"--plot", plot}}, inputs);
  images.captures.emplace();  // inclinations are ignored: the axis defines the level direction
  const LampCaptures input = read_lamp_captures(images, ImageUse::turn);
  const RotationResult found =
      solve_rotation(input, kMethods.at(method), make_program_history_entry(app, inputs));
  print_remarks(found);
  throw_if_failed(found);
  if (!plot.empty()) draw(plot, found.drawing());
  write_calibration(images.output, found.calibration);
  print_summary(found.fit, found.spot, found.circles, input.calibration.camera);
}

}  // namespace vlp
