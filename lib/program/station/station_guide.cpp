// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/station_guide.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "station/records/golden_unit_schedule.h"
#include "station/unit/station_screen.h"

namespace vlp {
namespace {

/// Log of the arrived images, line by line, for use without a terminal.
class Log {
 public:
  explicit Log(bool quiet) : quiet_(quiet) {}

  void report(const Unit& unit, const std::vector<WatchedRun::Arrival>& arrivals) {
    if (quiet_) return;
    for (const auto& [step, image, gone] : arrivals) {
      if (!gone) spdlog::info("{}", make_last_image_line(unit, step, image));
    }
    for (; done_ < kStationSteps.size() && unit.step(kStationSteps[done_]).done(); ++done_) {
      spdlog::info("{} is done", to_string(kStationSteps[done_]));
    }
  }

 private:
  bool quiet_;
  std::size_t done_ = 0;  // number of steps reported as done
};

/// Returns true if an image arrived. Of the frames of a source, only used ones are considered.
bool has_arrived(const Unit& unit, const std::vector<WatchedRun::Arrival>& arrivals,
                 bool of_source) {
  return std::any_of(arrivals.begin(), arrivals.end(), [&](const WatchedRun::Arrival& arrival) {
    const auto& images = unit.step(arrival.step).images;
    const auto image = images.find(arrival.image);
    return !of_source || image == images.end() || image->second.is_used();
  });
}

/// Checks whether the golden unit is due. Called at the first image of a unit, which may arrive
/// long after its serial number was scanned.
void check_golden_unit(Unit& unit, const Terminal& terminal) {
  std::string why = golden_problem(unit.config());
  if (!why.empty() && why != unit.invalid_reason() && !terminal.interactive()) {
    spdlog::warn("{}; no unit passes", why);
  }
  unit.invalidate(std::move(why));
}

}  // namespace

void guide_unit(const StationRunOptions& options, Unit& unit, WatchedRun& watched,
                StepSources& sources, Spool& spool, Terminal& terminal) {
  using Clock = std::chrono::steady_clock;
  constexpr int poll_interval_ms = 50;
  Clock::time_point last = Clock::now();
  Log log(terminal.interactive());
  bool changed = true, has_begun = false;
  while (unit.current() && !unit.is_hopeless()) {
    const auto arrivals = watched.poll_changes(static_cast<std::size_t>(options.threads));
    if (!has_begun && !arrivals.empty()) {
      has_begun = true;
      check_golden_unit(unit, terminal);
    }
    log.report(unit, arrivals);
    changed = changed || !arrivals.empty();
    if (changed && terminal.interactive()) {
      auto lines = make_station_screen(unit);
      for (ScreenLine& line : make_spool_lines(spool.notice())) lines.push_back(std::move(line));
      lines.push_back({"q: verdict now   Ctrl-C: leave, to go on later"});
      terminal.draw(lines);
    }
    changed = false;
    if (has_arrived(unit, arrivals, sources.any())) last = Clock::now();
    sources.feed(unit, watched);
    if (sources.ended(unit)) {
      unit.end_early("the frames ended");
      break;
    }
    const std::chrono::duration<double> idle = Clock::now() - last;
    if (options.idle_s && idle.count() > *options.idle_s) {
      unit.end_early(fmt::format("no image came for {:g} s", *options.idle_s));
      break;
    }
    if (terminal.key(arrivals.empty() ? poll_interval_ms : 0) == 'q') {
      unit.end_early("the operator ended the run");
      break;
    }
    if (interrupted()) {
      throw std::runtime_error("left before the verdict; the same command goes on where it was");
    }
    changed = terminal.resized();
  }
}

}  // namespace vlp
