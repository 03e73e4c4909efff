// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/station_run.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>

#include "captures/printable.h"
#include "frontend/image_folder.h"
#include "program/app.h"
#include "program/station/station_guide.h"
#include "rig/input_error.h"
#include "station/records/golden_due.h"
#include "station/records/hook.h"
#include "station/records/publish_run.h"
#include "station/records/run_hooks.h"
#include "station/records/spool.h"
#include "station/unit/unit_record.h"
#include "station/unit/verify_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const ProgramVersion kProgram{"vlp-station", VLP_VERSION};

/// Updates the state of the golden unit. Reports errors only: the verdict is valid without it.
void note(const StationConfig& config, const RunRecord& record) {
  try {
    note_for_golden(config, record);
  } catch (const InputError& error) {
    spdlog::error("when the golden unit is due is not known: {}", error.what());
  }
}

/// Returns Spool::notice() and logs its details.
std::string spool_notice(Spool& spool) {
  std::string notice = spool.notice();
  if (const std::string state = spool.state(); state != notice) {
    spdlog::debug("{}", printable(state));
  }
  return notice;
}

/// Stores the run in the spool, prints the verdict, writes the files, delivers to the records,
/// which may be unavailable, and calls the hook.
void conclude(RunRecord measured, const std::vector<ReportPicture>& pictures, Spool& spool,
              const StationConfig& config, Terminal& terminal,
              const std::function<void()>& mark_kept, const std::function<void()>& put_away) {
  RunRecord record = printable_run(std::move(measured));  // in the form of the records
  auto lines = verdict_screen(record);
  std::optional<HookLock> lock;
  if (config.hook) {
    lock.emplace(spool.folder(), record.run);
    record.events.push_back(hook_wanted(*config.hook, record.operator_name));
  }
  // After a kill in between, the golden unit is due too early, not too late.
  const bool golden_passed = record.kind == "golden" && record.passed();
  if (!golden_passed) note(config, record);
  try {
    spool.keep(record);
  } catch (const InputError&) {
    lines.push_back({"NOT RECORDED: do it again when the run can be kept", Tone::bad});
    terminal.print(lines);
    throw;
  }
  mark_kept();
  terminal.print(lines);
  if (golden_passed) note(config, record);
  std::string undone, mend;
  try {
    mend = fmt::format("'vlp-station restore {} --station {}' writes the files", record.run,
                       config.file.string());
    const fs::path folder = publish_run(record, pictures, config.results);
    spdlog::info("run {}: {}", record.run, folder.string());
    mend = "move the folder there before the next run";
    put_away();
  } catch (const InputError& error) {
    undone = error.what();
  }
  spool.deliver();
  if (config.hook) {
    const std::string problem = call_hook(*config.hook, record, *lock, spool);
    if (!problem.empty()) spdlog::error("{}", problem);
    terminal.print(hook_lines(record));
  }
  terminal.print(spool_lines(spool_notice(spool)));
  if (undone.empty()) return;
  throw std::runtime_error(
      fmt::format("{}; the verdict {} is recorded: {}", undone, record.verdict, mend));
}

/// Checks the conditions that are known before the first image.
void prepare(Spool& spool, const StationConfig& config, const std::string& camera) {
  check_results(config.results, camera);
  spool.prepare();
  if (const auto notice = spool_notice(spool); !notice.empty()) {
    spdlog::warn("{}", printable(notice));
  }
}

void prepare(Unit& unit, Spool& spool, const StationConfig& config) {
  prepare(spool, config, unit.camera_id());
  unit.refuse_images_of_others([&spool, camera = unit.camera_id()](const std::string& sha256) {
    return spool.owner_of(sha256, camera);
  });
  unit.distrust(golden_problem(config));
}

/// Throws GateNotMet if the run failed, Undetermined if it is invalid.
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
    unit.add(step, list_images(folder / name_of(step)));
  }
  if (!any) throw InputError(folder, "has none of the folders boards, rotation, dispersion, check");
}

/// Makes the record of a unit that ends now. The run is invalid if the golden unit failed in the
/// meantime, but not if it only became due.
RunRecord record_now(Unit& unit, const std::string& run, const StationRunOptions& options,
                     Spool& spool) {
  if (unit.distrusted().empty()) {
    unit.distrust(golden_problem(unit.config(), GoldenAt::verdict));
    const std::string due = golden_problem(unit.config());
    if (unit.distrusted().empty() && !due.empty()) {
      spdlog::warn("{} before the next unit; this one was begun before it was", due);
    }
  }
  RunRecord record = make_unit_record(unit, run, kProgram);
  record.operator_name = options.operator_name;
  record.shift = options.shift;
  if (record.invalid()) return record;  // images of an invalid run may be used again
  const auto earlier = spool.repeated_run_of(record);
  if (earlier && !earlier->empty()) {
    reject_repetition(record, *earlier, options.station);
  } else if (!earlier) {
    const std::string unchecked =
        "the records are offline: whether an earlier run used the same images was not checked";
    record.events.push_back(new_event(kUnchecked, unchecked));
    spdlog::warn("{}", unchecked);
  }
  return record;
}

RunRecord run_batch(const StationRunOptions& options, const StationConfig& config, Spool& spool) {
  const std::string run = new_run();
  Unit unit(config, options.camera_id, kProgram, options.threads);
  prepare(unit, spool, config);
  if (!unit.distrusted().empty()) spdlog::warn("{}; no unit passes", unit.distrusted());
  add_folders(unit, options.batch);
  unit.advance(true);
  RunRecord record = record_now(unit, run, options, spool);
  Terminal terminal;
  conclude(
      record, unit.pictures(), spool, config, terminal, [] {}, [] {});
  return record;
}

RunRecord run_watched(const StationRunOptions& options, const StationConfig& config, Spool& spool) {
  StepSources sources(options.sources, config.type.imager_px);
  Unit unit(config, options.camera_id, kProgram, options.threads);
  prepare(unit, spool, config);
  WatchedRun watched(unit, spool);
  Terminal terminal;
  if (const auto& finished = watched.finished()) {
    terminal.print(verdict_screen(*finished));
    terminal.print(hook_lines(*finished));
    spdlog::info("run {} had its verdict before it was put away; the same command begins another",
                 finished->run);
    return *finished;
  }
  spdlog::info("run {}; images go to {}/STEP", watched.run(), watched.folder().string());
  if (!unit.distrusted().empty() && !terminal.interactive()) {
    spdlog::warn("{}; no unit passes", unit.distrusted());
  }
  guide_unit(options, unit, watched, sources, spool, terminal);
  unit.advance(true);
  RunRecord record = record_now(unit, watched.run(), options, spool);
  conclude(
      record, unit.pictures(), spool, config, terminal, [&] { watched.mark_kept(); },
      [&] { watched.put_away(); });
  return record;
}

}  // namespace

void run_unit(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  if (const std::string why = serial_problem(config, options.camera_id); !why.empty()) {
    throw std::invalid_argument("--camera-id: " + why);
  }
  Spool spool(config.spool, config.records);
  throw_unless_passed(options.batch.empty() ? run_watched(options, config, spool)
                                            : run_batch(options, config, spool));
}

void run_verify(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  if (!config.golden) throw InputError(options.station, "has no golden unit: add the key 'golden'");
  Spool spool(config.spool, config.records);
  prepare(spool, config, config.golden->camera_id);
  const fs::path arrived = config.captures / config.golden->camera_id;
  const bool batch = !options.batch.empty();
  auto [record, pictures] = verify_station(config, batch ? fs::path(options.batch) : arrived,
                                           new_run(), kProgram, options.threads);
  if (config.verify_due) {
    refuse_used_images(record,
                       [&](const std::string& sha256) { return spool.golden_run_of(sha256); });
  }
  record.operator_name = options.operator_name;
  record.shift = options.shift;
  Terminal terminal;
  conclude(
      record, pictures, spool, config, terminal, [] {},
      [&, run = record.run] {
        if (!batch) put_away(arrived, run);
      });
  throw_unless_passed(record, "station " + record.station + " has moved");
}

void run_hooks(const StationRunOptions& options) {
  const StationConfig config = read_station(options.station);
  if (!config.hook) throw InputError(options.station, "has no hook: add the key 'hook'");
  Spool spool(config.spool, config.records);
  spool.deliver();
  const HooksRun hooks =
      run_open_hooks(config, spool, [](const RunRecord& run, const std::string& outcome) {
        fmt::print("{}\n", printable_line(fmt::format("{} {} {}: {}", run.run, run.camera,
                                                      run.verdict, outcome)));
      });
  if (const auto notice = spool_notice(spool); !notice.empty()) {
    spdlog::warn("{}", printable(notice));
  }
  if (hooks.failed > 0) {
    throw std::runtime_error(
        fmt::format("the hook failed for {} of {} runs", hooks.failed, hooks.runs));
  }
}

}  // namespace vlp
