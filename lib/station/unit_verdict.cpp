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

/// The middle blur of the views, refused ones too: a blurred lens has no others.
std::optional<double> typical_blur_px(const UnitStep& boards) {
  std::vector<double> blurs_px;
  for (const auto& [name, image] : boards.images) {
    if (image.blur_px) blurs_px.push_back(*image.blur_px);
  }
  if (blurs_px.empty()) return std::nullopt;
  const auto middle = blurs_px.begin() + static_cast<std::ptrdiff_t>(blurs_px.size() / 2);
  std::nth_element(blurs_px.begin(), middle, blurs_px.end());
  return *middle;
}

/// "12 of 36 images refused: 10 blurred, 2 too dark"; empty when most are used.
std::string refusals(StationStep step, const UnitStep& state) {
  std::map<std::string, int> reasons;
  int refused = 0;
  for (const auto& [name, image] : state.images) {
    if (image.refused.empty() || image.refused.starts_with("not needed")) continue;
    ++refused;
    ++reasons[image.refused.substr(0, image.refused.find(':'))];
  }
  if (refused == 0 || refused < state.used()) return "";
  std::string text;
  for (const auto& [reason, count] : reasons) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, reason);
  }
  return fmt::format("{}: {} of {} images refused: {}", name_of(step), refused, state.images.size(),
                     text);
}

/// What stands in the way of the first step that did not end well; those after it rest on it.
void add_step_problems(const Unit& unit, std::vector<std::string>& causes) {
  for (const StationStep each : kStationSteps) {
    const UnitStep& state = unit.step(each);
    if (state.done()) continue;
    const std::string refused = refusals(each, state);
    if (!refused.empty()) causes.push_back(refused);
    if (state.result && !state.result->problem.empty() && state.used() > 0) {
      causes.push_back(fmt::format("{}: {}", name_of(each), state.result->problem));
      return;
    }
    if (!state.enough && refused.empty()) {
      causes.push_back(fmt::format("{}: not enough images, or too much alike ({})", name_of(each),
                                   count_of(unit, each)));
    }
    if (!state.result || !state.result->problem.empty()) return;
  }
}

/// Whether most of the board images show another board.
bool other_board(const UnitStep& boards) {
  const auto other = std::count_if(boards.images.begin(), boards.images.end(), [](const auto& i) {
    return i.second.view && i.second.view->seen.foreign > 0;
  });
  return 2 * other > static_cast<std::ptrdiff_t>(boards.images.size());
}

std::size_t part_of(double pixel, int size_px, std::size_t parts) {
  const double share = std::clamp(pixel / size_px, 0.0, 0.999);
  return static_cast<std::size_t>(share * static_cast<double>(parts));
}

}  // namespace

std::vector<Frame> frames_of(const UnitStep& step) {
  std::vector<Frame> frames;
  for (const auto& [name, image] : step.images) {
    if (image.refused.empty()) frames.push_back({name, image.lamps});
  }
  return frames;
}

double board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px) {
  constexpr std::size_t cols = 8, rows = 6;
  std::array<bool, cols * rows> covered{};
  for (const auto& [name, image] : step.images) {
    if (!image.refused.empty() || !image.view) continue;
    for (const SeenTag& tag : image.view->seen.tags) {
      for (const auto& corner : tag.corners_px) {
        const std::size_t col = part_of(corner.x(), imager_px[0], cols);
        covered[part_of(corner.y(), imager_px[1], rows) * cols + col] = true;
      }
    }
  }
  const auto there = static_cast<double>(std::count(covered.begin(), covered.end(), true));
  return there / static_cast<double>(covered.size());
}

std::optional<Calibration> Unit::calibration() const {
  std::optional<Calibration> last;
  for (const UnitStep& state : steps_) {
    if (state.result && state.result->problem.empty()) last = state.result->calibration;
  }
  return last;
}

std::vector<StationFigure> Unit::figures() const {
  std::vector<NamedValue> values;
  if (const auto blur_px = typical_blur_px(step(StationStep::boards))) {
    values.push_back({"blur_px", *blur_px});
  }
  for (const UnitStep& state : steps_) {
    if (!state.result) continue;
    values.insert(values.end(), state.result->values.begin(), state.result->values.end());
  }
  return with_gates(values, config_.gates);
}

std::vector<std::string> Unit::causes() const {
  std::vector<std::string> causes;
  const auto add = [&](const std::string& cause) {
    if (!cause.empty()) causes.push_back(cause);
  };
  if (other_board(step(StationStep::boards))) add("wrong board: the tags have other ids");
  const auto figures = this->figures();
  for (const StationFigure& figure : figures) {
    if (figure.name == "blur_px" && figure.value && !figure.met()) add(cause_of(figure));
  }
  add_step_problems(*this, causes);
  // What is known comes first; what is not may be its consequence.
  for (const bool known : {true, false}) {
    if (!known && current()) break;
    for (const StationFigure& figure : figures) {
      if (figure.name == "blur_px" || figure.value.has_value() != known) continue;
      if (!figure.met()) add(cause_of(figure));
    }
  }
  if (causes.empty()) return causes;
  std::vector<Frame> frames;
  std::optional<Calibration> known;
  for (const StationStep each :
       {StationStep::rotation, StationStep::dispersion, StationStep::check}) {
    for (Frame& frame : frames_of(step(each))) frames.push_back(std::move(frame));
  }
  if ((known = calibration())) {
    const auto faults = lamp_faults(frames, config_.lamps, *known);
    causes.insert(causes.begin(), faults.begin(), faults.end());
  }
  return causes;
}

}  // namespace vlp
