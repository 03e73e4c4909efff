// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_run.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <functional>
#include <stdexcept>

#include "app.h"
#include "captures/printable.h"
#include "detection/image_file.h"
#include "rig/input_error.h"
#include "station/publish_run.h"
#include "station/spool.h"
#include "station/verify_station.h"
#include "station_guide.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const ProgramVersion kProgram{"vlp-station", VLP_VERSION};

/// Keeps the run, says the verdict, writes its files; then the records, which may be away.
void conclude(const RunRecord& record, const std::vector<ReportPicture>& pictures, Spool& spool,
              const StationConfig& config, Terminal& terminal,
              const std::function<void()>& mark_kept, const std::function<void()>& put_away) {
  auto lines = verdict_screen(record);
  try {
    spool.keep(record);
  } catch (const InputError&) {
    lines.push_back({"NOT RECORDED: do it again when the run can be kept", Tone::bad});
    terminal.print(lines);
    throw;
  }
  mark_kept();
  terminal.print(lines);
  std::string undone, mend;
  try {
    mend = fmt::format("'vlp-station restore {}' writes the files", record.run);
    const fs::path folder = publish_run(record, pictures, config.results);
    spdlog::info("run {}: {}", record.run, folder.string());
    mend = "move the folder there before the next run";
    put_away();
  } catch (const InputError& error) {
    undone = error.what();
  }
  spool.deliver();
  terminal.print(spool_lines(spool.state()));
  if (undone.empty()) return;
  throw std::runtime_error(
      fmt::format("{}; the verdict {} is recorded: {}", undone, record.verdict, mend));
}

/// What can be known before the first image.
void prepare(Spool& spool, const StationConfig& config, const std::string& camera) {
  check_results(config.results, camera);
  spool.prepare();
  if (const std::string state = spool.state(); !state.empty()) spdlog::warn("{}", printable(state));
}

void prepare(Unit& unit, Spool& spool, const StationConfig& config) {
  prepare(spool, config, unit.camera_id());
  unit.refuse_images_of_others([&spool, camera = unit.camera_id()](const std::string& sha256) {
    return spool.owner_of(sha256, camera);
  });
}

/// Throws GateNotMet or Undetermined, by the verdict.
void throw_unless_passed(const RunRecord& record, const std::string& failed) {
  if (record.passed()) return;
  if (!record.invalid()) throw GateNotMet(failed + ": " + record.first_cause());
  throw Undetermined(
      fmt::format("camera {} is not judged: {}", record.camera, record.first_cause()));
}
void throw_unless_passed(const RunRecord& record) {
  throw_unless_passed(record, "camera " + record.camera + " fails");
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

void run_batch(const StationRunOptions& options, const StationConfig& config, Spool& spool) {
  const std::string run = new_run();
  Unit unit(config, options.camera_id, kProgram, options.threads);
  prepare(unit, spool, config);
  add_folders(unit, options.batch);
  unit.advance(true);
  const RunRecord record = record_of(unit, run, kProgram);
  Terminal terminal;
  conclude(
      record, unit.pictures(), spool, config, terminal, [] {}, [] {});
  throw_unless_passed(record);
}

void run_watched(const StationRunOptions& options, const StationConfig& config, Spool& spool) {
  StepSources sources(options.sources, config.type.imager_px);
  Unit unit(config, options.camera_id, kProgram, options.threads);
  prepare(unit, spool, config);
  WatchedRun watched(unit, spool);
  Terminal terminal;
  if (const auto& finished = watched.finished()) {
    terminal.print(verdict_screen(*finished));
    spdlog::info("run {} had its verdict before it was put away; the same command begins another",
                 finished->run);
    return throw_unless_passed(*finished);
  }
  spdlog::info("run {}; images go to {}/STEP", watched.run(), watched.folder().string());
  guide_unit(options, unit, watched, sources, spool, terminal);
  unit.advance(true);
  const RunRecord record = record_of(unit, watched.run(), kProgram);
  conclude(
      record, unit.pictures(), spool, config, terminal, [&] { watched.mark_kept(); },
      [&] { watched.put_away(); });
  throw_unless_passed(record);
}

}  // namespace

void run_unit(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  Spool spool(config.spool, config.records);
  if (options.batch.empty()) return run_watched(options, config, spool);
  run_batch(options, config, spool);
}

void run_verify(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  if (!config.golden) throw InputError(options.station, "has no golden unit: add the key 'golden'");
  Spool spool(config.spool, config.records);
  prepare(spool, config, config.golden->camera_id);
  const fs::path arrived = config.captures / config.golden->camera_id;
  const bool batch = !options.batch.empty();
  const auto [record, pictures] = verify_station(config, batch ? fs::path(options.batch) : arrived,
                                                 new_run(), kProgram, options.threads);
  Terminal terminal;
  conclude(
      record, pictures, spool, config, terminal, [] {},
      [&, run = record.run] {
        if (!batch) put_away(arrived, run);
      });
  throw_unless_passed(record, "station " + record.station + " has moved");
}

}  // namespace vlp
