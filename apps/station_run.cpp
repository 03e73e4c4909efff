// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_run.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <filesystem>

#include "app.h"
#include "detection/image_file.h"
#include "rig/input_error.h"
#include "station/publish_run.h"
#include "station/verify_station.h"
#include "station_guide.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const ProgramVersion kProgram{"vlp-station", VLP_VERSION};

/// Record, files, and what the operator and the caller get to know.
void conclude(const RunRecord& record, const std::vector<ReportPicture>& pictures, Records& records,
              const StationConfig& config, Terminal& terminal) {
  finish_run(record, pictures, records, config.results);
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
  conclude(record, unit.pictures(), records, config, terminal);
  fail_unless_passed(record);
}

void run_watched(const StationRunOptions& options, const StationConfig& config, Records& records) {
  StepSources sources(options.sources, config.type.imager_px);
  Unit unit(config, options.camera_id, kProgram, options.threads);
  WatchedRun watched(unit, records);
  Terminal terminal;
  if (const auto& finished = watched.finished()) {
    terminal.print(verdict_screen(*finished));
    spdlog::info("run {} had its verdict before it was put away; the same command begins another",
                 finished->run);
    return fail_unless_passed(*finished);
  }
  spdlog::info("run {}; images go to {}/STEP", watched.run(), watched.folder().string());
  guide_unit(options, unit, watched, sources, terminal);
  unit.advance(true);
  const RunRecord record = record_of(unit, watched.run(), kProgram);
  conclude(record, unit.pictures(), records, config, terminal);
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
  const fs::path arrived = config.captures / config.golden->camera_id;
  const bool batch = !options.batch.empty();
  const auto [record, pictures] = verify_station(config, batch ? fs::path(options.batch) : arrived,
                                                 new_run(), kProgram, options.threads);
  Terminal terminal;
  conclude(record, pictures, records, config, terminal);
  if (!batch) put_away(arrived, record.run);
  if (record.passed()) return;
  throw GateNotMet(fmt::format("station {} has moved: {}", record.station,
                               record.causes.substr(0, record.causes.find('\n'))));
}

}  // namespace vlp
