// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <map>

#include "station/guidance.h"
#include "station/lamp_faults.h"
#include "station/unit.h"

namespace vlp {
namespace {

/// A reason in the plural, without figures and names.
std::string kind_of(const UnitImage& image) {
  if (image.superfluous == Superfluous::same_pose) return "the same pose again";
  return image.refused.substr(0, image.refused.find(':'));
}

/// "12 of 36 images refused: 10 blurred, 2 too dark"; empty when most are used.
std::string refusals(const UnitStep& state) {
  std::map<std::string, int> reasons;
  int refused = 0;
  for (const auto& [name, image] : state.images) {
    if (image.refused.empty() || image.superfluous == Superfluous::enough) continue;
    ++refused;
    ++reasons[kind_of(image)];
  }
  if (refused == 0 || refused < state.used()) return "";
  std::string text;
  for (const auto& [reason, count] : reasons) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, reason);
  }
  return fmt::format("{} of {} images refused: {}", refused, state.images.size(), text);
}

/// What stands in the way of a step that did not end well.
void add_problems(const Unit& unit, StationStep step, std::vector<std::string>& causes) {
  const UnitStep& state = unit.step(step);
  if (state.done()) return;
  const std::string refused = refusals(state);
  if (!refused.empty()) {
    causes.push_back(fmt::format("{} ({}): {}", name_of(step), count_of(unit, step), refused));
  }
  if (state.result && !state.result->ok() && state.used() > 0) {
    causes.push_back(fmt::format("{}: {}", name_of(step), state.result->why));
  } else if (!state.enough && refused.empty()) {
    causes.push_back(fmt::format("{}: not enough images, or too much alike ({})", name_of(step),
                                 count_of(unit, step)));
  }
}

/// Whether most of the board images show another board.
bool other_board(const UnitStep& boards) {
  const auto other = std::count_if(boards.images.begin(), boards.images.end(), [](const auto& i) {
    return i.second.view && !i.second.view->seen.foreign.empty();
  });
  return 2 * other > static_cast<std::ptrdiff_t>(boards.images.size());
}

bool has_value(const StepResult& result, const std::string& figure) {
  return value_of(result.metrics, figure).has_value();
}

/// What the captures of all steps tell of the lamps.
std::vector<std::string> lamp_faults_of(const Unit& unit) {
  const auto known = unit.calibration();
  if (!known) return {};
  std::vector<Frame> frames;
  for (const StationStep each :
       {StationStep::rotation, StationStep::dispersion, StationStep::check}) {
    for (Frame& frame : frames_of(unit.step(each))) frames.push_back(std::move(frame));
  }
  return lamp_faults(frames, unit.config().lamps, *known);
}

}  // namespace

std::optional<Calibration> Unit::calibration() const {
  std::optional<Calibration> last;
  for (const UnitStep& state : steps_) {
    if (state.result && state.result->ok()) last = state.result->calibration;
  }
  return last;
}

std::vector<CheckedMetric> Unit::figures() const {
  std::vector<Metric> values;
  if (const auto blur_px = typical_blur_px(step(StationStep::boards))) {
    values.push_back({"blur_px", *blur_px});
  }
  for (const UnitStep& state : steps_) {
    if (!state.result) continue;
    values.insert(values.end(), state.result->metrics.begin(), state.result->metrics.end());
  }
  return check_all(config_.gates, values, unit_metrics());
}

std::vector<std::string> Unit::causes() const {
  std::vector<std::string> causes;
  const auto figures = this->figures();
  const auto add_gate = [&](const CheckedMetric& figure) {
    if (!figure.met()) causes.push_back(cause_of(figure));
  };
  const auto blur = [](const CheckedMetric& figure) { return figure.name == "blur_px"; };
  if (other_board(step(StationStep::boards))) {
    causes.emplace_back("wrong board: the tags have other ids");
  }
  for (const CheckedMetric& figure : figures) {
    if (blur(figure) && figure.value) add_gate(figure);
  }
  // What a step lacks comes before its figures, and both before the steps that rest on it.
  for (const StationStep each : kStationSteps) {
    add_problems(*this, each, causes);
    const auto& result = step(each).result;
    if (!result || !result->ok()) break;
    for (const CheckedMetric& figure : figures) {
      if (has_value(*result, figure.name)) add_gate(figure);
    }
  }
  for (const CheckedMetric& figure : figures) {
    if (!current() && !figure.value) add_gate(figure);
  }
  if (causes.empty()) return causes;
  const auto faults = lamp_faults_of(*this);
  causes.insert(causes.begin(), faults.begin(), faults.end());
  return causes;
}

}  // namespace vlp
