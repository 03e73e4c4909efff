// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "session/session_folder.h"
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

/// What became of the images of a step that did not come to its end.
struct Refusals {
  /// "12 of 36 images refused: 10 blurred, 2 too dark"; empty when most are used.
  std::string text = {};
  /// More are blurred than all else, so many that it is not a shaky hand.
  bool blurred = false;
};

/// So many images tell of the camera; fewer may be an accident.
int enough_to_blame(const StationConfig& config) {
  return std::min(config.refuse.in_a_row, (config.enough.board_views + 1) / 2);
}

Refusals refusals(const UnitStep& state, const StationConfig& config) {
  std::map<std::string, int> reasons;
  int refused = 0;
  for (const auto& [name, image] : state.images) {
    if (image.refused.empty() || image.superfluous == Superfluous::enough) continue;
    ++refused;
    ++reasons[kind_of(image)];
  }
  if (refused == 0 || refused < state.used()) return {};
  std::string text;
  for (const auto& [reason, count] : reasons) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, reason);
  }
  const int blurred = reasons.contains("blurred") ? reasons.at("blurred") : 0;
  return {fmt::format("{} of {} images refused: {}", refused, state.images.size(), text),
          2 * blurred > refused && blurred >= enough_to_blame(config)};
}

/// That the lights of images that were refused are the lamps, with another row time; empty
/// otherwise.
std::string row_time_fault(const UnitStep& state, const StationConfig& config) {
  std::vector<double> frequencies_hz;
  for (const auto& [name, image] : state.images) {
    if (image.refused.empty()) continue;
    frequencies_hz.insert(frequencies_hz.end(), image.unknown_hz.begin(), image.unknown_hz.end());
  }
  constexpr std::size_t least = 6;
  if (frequencies_hz.size() < least) return "";
  const double row_time_s = config.type.row_time_s.value_or(0);
  const auto found_s = row_time_that_fits(frequencies_hz, config.lamps, row_time_s);
  constexpr double microseconds = 1e6;
  if (!found_s) return "";
  return fmt::format(
      "the row time of the camera's type, {:.2f} us, is not this camera's: with {:.2f} us its "
      "lights "
      "are the lamps of the map",
      microseconds * row_time_s, microseconds * *found_s);
}

/// What stands in the way of a step that did not end well.
void add_problems(const Unit& unit, StationStep step, const std::string& ended,
                  std::vector<Cause>& causes) {
  const UnitStep& state = unit.step(step);
  if (state.done()) return;
  const Refusals refused = refusals(state, unit.config());
  if (std::string fault = row_time_fault(state, unit.config()); !fault.empty()) {
    causes.push_back({std::move(fault)});
  }
  if (!refused.text.empty()) {
    causes.push_back({fmt::format("{} ({}): {}", name_of(step), count_of(unit, step), refused.text),
                      refused.blurred});
  }
  const bool failed = state.result && !state.result->ok() && state.used() > 0;
  if (failed) causes.push_back({fmt::format("{}: {}", name_of(step), state.result->why)});
  const bool said = failed || !refused.text.empty();
  if (state.enough || (said && ended.empty())) return;
  const std::string count = count_of(unit, step);
  causes.push_back(
      {ended.empty()
           ? fmt::format("{}: not enough images, or too much alike ({})", name_of(step), count)
           : fmt::format("{}: {} before there was enough ({})", name_of(step), ended, count)});
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

/// Whether there are views enough to tell blur from a shaky hand.
bool blur_is_known(const UnitStep& boards, const StationConfig& config) {
  return boards.enough ||
         std::count_if(boards.images.begin(), boards.images.end(), [](const auto& image) {
           return image.second.blur_px.has_value();
         }) >= enough_to_blame(config);
}

/// What a step lacks, then what of its figures misses its gate, that of the station first. Whether
/// it was solved.
bool add_causes_of(const Unit& unit, StationStep step, const std::vector<CheckedMetric>& figures,
                   const std::string& ended, std::vector<Cause>& causes) {
  add_problems(unit, step, ended, causes);
  const auto& result = unit.step(step).result;
  if (!result || !result->ok()) return false;
  for (const bool of_camera : {false, true}) {
    for (const CheckedMetric& figure : figures) {
      const bool missed = has_value(*result, figure.name) && !figure.met();
      if (missed && metric_kind(figure.name)->of_camera == of_camera) {
        causes.push_back({cause_of(figure), of_camera});
      }
    }
  }
  return true;
}

/// What the captures of all steps tell of the lamps, and those of the check of its points.
std::vector<std::string> station_faults_of(const Unit& unit) {
  const auto known = unit.calibration();
  if (!known) return {};
  std::vector<Frame> frames;
  for (const StationStep each :
       {StationStep::rotation, StationStep::dispersion, StationStep::check}) {
    for (Frame& frame : frames_of(unit.step(each))) frames.push_back(std::move(frame));
  }
  auto faults = lamp_faults(frames, unit.config().lamps, *known);
  auto unseen = unseen_lamps(frames, unit.config().lamps);
  std::move(unseen.begin(), unseen.end(), std::back_inserter(faults));
  const UnitStep& check = unit.step(StationStep::check);
  if (!faults.empty() || !check.result || !check.result->ok()) return faults;
  return place_faults(frames_of(check), unit.config().lamps, *known, captures_in(check.folder));
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

std::vector<Cause> Unit::causes() const {
  auto causes = causes_of_images();
  if (!distrusted_.empty()) causes.insert(causes.begin(), {distrusted_});
  return causes;
}

std::vector<Cause> Unit::causes_of_images() const {
  std::vector<Cause> causes;
  const auto figures = this->figures();
  const UnitStep& boards = step(StationStep::boards);
  if (other_board(boards)) causes.push_back({"wrong board: the tags have other ids"});
  for (const CheckedMetric& figure : figures) {
    const bool blur = figure.name == "blur_px" && figure.value && !figure.met();
    if (blur && blur_is_known(boards, config_)) causes.push_back({cause_of(figure), true});
  }
  bool solved = add_causes_of(*this, StationStep::boards, figures, ended_, causes);
  const auto of_boards = static_cast<std::ptrdiff_t>(causes.size());
  for (const StationStep each :
       {StationStep::rotation, StationStep::dispersion, StationStep::check}) {
    solved = solved && add_causes_of(*this, each, figures, ended_, causes);
  }
  for (const CheckedMetric& figure : figures) {
    if (!current() && !figure.value) causes.push_back({cause_of(figure)});
  }
  if (causes.empty()) return causes;
  // The lens was measured without the lamps.
  std::vector<Cause> faults;
  for (std::string& fault : station_faults_of(*this)) faults.push_back({std::move(fault)});
  causes.insert(causes.begin() + of_boards, faults.begin(), faults.end());
  return causes;
}

}  // namespace vlp
