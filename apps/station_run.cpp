// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_run.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>

#include "app.h"
#include "detection/image_file.h"
#include "rig/input_error.h"
#include "station/frame_source.h"
#include "station/verify_station.h"
#include "station/watched_run.h"
#include "terminal.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const ProgramVersion kProgram{"vlp-station", VLP_VERSION};

/// Record, files, and what the operator and the caller get to know.
void conclude(const RunRecord& record, Records& records, const StationConfig& config,
              Terminal& terminal) {
  finish_run(record, records, config.results);
  terminal.print(verdict_screen(record));
  spdlog::info("run {}: {}", record.run, (config.results / record.camera / record.run).string());
}

void fail_unless_passed(const RunRecord& record) {
  if (record.passed()) return;
  throw GateNotMet(fmt::format("camera {} fails: {}", record.camera,
                               record.causes.substr(0, record.causes.find('\n'))));
}

void add_folders(Unit& unit, const fs::path& folder) {
  bool any = false;
  for (const StationStep step : kStationSteps) {
    if (!fs::is_directory(folder / name_of(step))) continue;
    any = true;
    unit.add(step, images_in(folder / name_of(step)));
  }
  if (!any) throw InputError(folder, "has none of the folders boards, rotation, dispersion, check");
}

void run_batch(const StationRunOptions& options, const StationConfig& config, Records& records) {
  const std::string run = new_run();
  Unit unit(config, options.camera_id, kProgram, options.threads);
  add_folders(unit, options.batch);
  unit.advance(true);
  const RunRecord record = record_of(unit, run, kProgram);
  Terminal terminal;
  conclude(record, records, config, terminal);
  fail_unless_passed(record);
}

/// The cameras and videos of --source, by step.
class Sources {
 public:
  explicit Sources(const std::vector<std::string>& sources) {
    for (const std::string& source : sources) {
      std::shared_ptr<FrameSource> opened;
      for (const StationStep step : kStationSteps) {
        const std::string prefix = std::string(name_of(step)) + "=";
        const bool named = source.starts_with(prefix);
        if (named) opened = std::make_shared<FrameSource>(source.substr(prefix.size()));
        if (named) by_step_[step] = opened;
      }
      if (opened) continue;
      opened = std::make_shared<FrameSource>(source);
      for (const StationStep step : kStationSteps) by_step_.emplace(step, opened);
    }
  }

  /// Puts the next frame into the folder of the present step, once the one before is judged; takes
  /// away one that shows nothing new.
  void feed(const Unit& unit, const fs::path& folder) {
    const auto step = unit.current();
    if (!step || !by_step_.contains(*step)) return;
    if (!last_.empty() && fs::exists(last_)) {
      const auto& images = unit.step(last_step_).images;
      const auto image = images.find(last_.filename().string());
      if (image == images.end()) return;
      // A moving camera blurs; what shows nothing new is of no use to keep.
      if (!image->second.refused.empty()) fs::remove(last_);
    }
    last_ = by_step_.at(*step)->save_next(folder / name_of(*step));
    last_step_ = *step;
  }

  /// Whether the present step's video is at its end, and all of it is judged.
  bool ended(const Unit& unit) const {
    const auto step = unit.current();
    return step && last_.empty() && by_step_.contains(*step) && by_step_.at(*step)->ended();
  }

 private:
  std::map<StationStep, std::shared_ptr<FrameSource>> by_step_;
  fs::path last_;
  StationStep last_step_ = StationStep::boards;
};

void run_watched(const StationRunOptions& options, const StationConfig& config, Records& records) {
  using Clock = std::chrono::steady_clock;
  constexpr int look_every_ms = 50;
  Unit unit(config, options.camera_id, kProgram, options.threads);
  WatchedRun watched(unit, records);
  Sources sources(options.sources);
  Terminal terminal;
  spdlog::info("run {}; images go to {}/STEP", watched.run(), watched.folder().string());
  Clock::time_point last = Clock::now();
  std::size_t told = 0;  // steps that were said to be done
  while (unit.current() && !unit.hopeless()) {
    const auto arrivals = watched.look(static_cast<std::size_t>(options.threads));
    if (!terminal.interactive()) {
      for (const auto& [step, image, gone] : arrivals) {
        if (!gone) spdlog::info("{}", last_image_line(unit, step, image));
      }
      for (; told < kStationSteps.size() && unit.step(kStationSteps[told]).done(); ++told) {
        spdlog::info("{} is done", name_of(kStationSteps[told]));
      }
    }
    auto lines = station_screen(unit);
    lines.push_back({"q: verdict now   Ctrl-C: leave, to go on later"});
    terminal.draw(lines);
    if (!arrivals.empty()) last = Clock::now();
    sources.feed(unit, watched.folder());
    if (sources.ended(unit)) break;
    const std::chrono::duration<double> idle = Clock::now() - last;
    if (options.idle_s && idle.count() > *options.idle_s) break;
    if (terminal.key(arrivals.empty() ? look_every_ms : 0) == 'q') break;
    if (interrupted()) {
      throw std::runtime_error("left before the verdict; the same command goes on where it was");
    }
  }
  unit.advance(true);
  const RunRecord record = record_of(unit, watched.run(), kProgram);
  conclude(record, records, config, terminal);
  watched.put_away();
  fail_unless_passed(record);
}

}  // namespace

void run_unit(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  Records records(config.records);
  if (options.batch.empty()) return run_watched(options, config, records);
  run_batch(options, config, records);
}

void run_verify(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  if (!config.golden) throw InputError(options.station, "has no golden unit: add the key 'golden'");
  Records records(config.records);
  const RunRecord record = verify_station(config, options.batch, kProgram, options.threads);
  Terminal terminal;
  conclude(record, records, config, terminal);
  if (record.passed()) return;
  throw GateNotMet(fmt::format("station {} has moved: {}", record.station,
                               record.causes.substr(0, record.causes.find('\n'))));
}

}  // namespace vlp
