// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/station_run.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>

#include "captures/printable.h"
#include "frontend/image_file.h"
#include "program/app.h"
#include "program/station/terminal.h"
#include "rig/input_error.h"
#include "station/records/golden_unit_schedule.h"
#include "station/records/hook.h"
#include "station/records/publish_run.h"
#include "station/records/spool.h"
#include "station/unit/camera_source.h"
#include "station/unit/station_screen.h"
#include "station/unit/unit_verdict.h"
#include "station/unit/verify_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

const ProgramVersion kProgram{"vlp-station", VLP_VERSION};

/// Updates the state of the golden unit. Reports errors only: the verdict is valid without it.
void update_golden_state(const StationConfig& config, const RunRecord& record) {
  try {
    record_golden_run(config, record);
  } catch (const InputError& error) {
    // [STATION-3] `due time of the golden unit`
    spdlog::error("the due time of the golden unit is unknown: {}", error.what());
  }
}

/// Returns Spool::make_operator_notice() and logs its details.
std::string make_spool_notice(Spool& spool) {
  std::string notice = spool.make_operator_notice();
  if (const std::string state = spool.describe_state(); state != notice) {
    spdlog::debug("{}", escape_for_terminal(state));
  }
  return notice;
}

/// Logs the arrived images and the completed steps, for use without a terminal. `num_done` is the
/// number of steps that were logged as completed.
void log_arrivals(const Unit& unit, const std::vector<WatchedRun::ImageChange>& arrivals,
                  std::size_t& num_done) {
  for (const auto& [step, image, is_removed] : arrivals) {
    if (!is_removed) spdlog::info("{}", describe_step_image(unit, step, image));
  }
  for (;
       num_done < kStationSteps.size() && unit.step_state(kStationSteps[num_done]).is_step_solved();
       ++num_done) {
    spdlog::info("{} is done", station_step_name(kStationSteps[num_done]));
  }
}

/// Returns true if an image arrived. Of the frames of a source, only used ones are considered.
bool has_image_arrived(const Unit& unit, const std::vector<WatchedRun::ImageChange>& arrivals,
                       bool of_source) {
  return std::ranges::any_of(arrivals, [&](const WatchedRun::ImageChange& arrival) {
    const auto& images = unit.step_state(arrival.step).images;
    const auto image = images.find(arrival.image);
    return !of_source || image == images.end() || image->second.is_image_used();
  });
}

/// Checks whether the golden unit is due. Called at the first image of a unit, which may arrive
/// long after its serial number was scanned.
void check_golden_unit(Unit& unit, const Terminal& terminal) {
  std::string why = describe_golden_problem(unit.station_config());
  if (!why.empty() && why != unit.invalid_reason() && !terminal.is_interactive()) {
    // [STATION-4] `no unit passes` | station changed, or golden unit due | `vlp-station show` of
    //   its run: cause
    spdlog::warn("{}; no unit passes", why);
  }
  unit.invalidate_verdict(std::move(why));
}

/// Processes the images of a unit as they arrive and guides the operator. Returns when the unit is
/// complete or cannot pass any more, the frames end, no image arrives for options.idle_s, or the
/// operator requests the verdict. Throws std::runtime_error if the operator leaves.
void guide_operator(const StationRunOptions& options, Unit& unit, WatchedRun& watched,
                    StepSources& sources, Spool& spool, Terminal& terminal) {
  using Clock = std::chrono::steady_clock;
  constexpr int poll_interval_ms = 50;
  Clock::time_point last = Clock::now();
  std::size_t num_done = 0;
  bool changed = true, has_begun = false;
  while (unit.first_incomplete() && !unit.can_no_longer_pass()) {
    const auto arrivals = watched.process_changes(static_cast<std::size_t>(options.threads));
    if (!has_begun && !arrivals.empty()) {
      has_begun = true;
      check_golden_unit(unit, terminal);
    }
    if (!terminal.is_interactive()) log_arrivals(unit, arrivals, num_done);
    changed = changed || !arrivals.empty();
    if (changed && terminal.is_interactive()) {
      auto lines = make_station_screen(unit);
      for (ScreenLine& line : make_notice_lines(spool.make_operator_notice()))
        lines.push_back(std::move(line));
      lines.push_back({"q: verdict now   Ctrl-C: leave, to go on later"});
      terminal.redraw(lines);
    }
    changed = false;
    if (has_image_arrived(unit, arrivals, sources.has_frame_sources())) last = Clock::now();
    sources.write_next_frame(unit, watched);
    if (sources.has_video_ended(unit)) {
      unit.end_early("the frames ended");
      break;
    }
    const std::chrono::duration<double> idle = Clock::now() - last;
    if (options.idle_s && idle.count() > *options.idle_s) {
      unit.end_early(fmt::format("no image came for {:g} s", *options.idle_s));
      break;
    }
    if (terminal.wait_for_key(arrivals.empty() ? poll_interval_ms : 0) == 'q') {
      unit.end_early("the operator ended the run");
      break;
    }
    if (was_interrupted()) {
      // [STATION-10] `left before`
      throw std::runtime_error("left before the verdict; the same command continues");
    }
    changed = terminal.was_resized();
  }
}

/// Stores the run in the spool, prints the verdict, writes the files, delivers to the records,
/// which may be unavailable, and calls the hook.
void store_and_report_run(
    RunRecord measured, const std::vector<ReportPlot>& pictures, Spool& spool,
    const StationConfig& config, Terminal& terminal,
    const std::function<void()>& mark_run_stored = [] {},
    const std::function<void()>& rename_finished = [] {}) {
  RunRecord record = escape_run(std::move(measured));  // in the form of the records
  auto lines = make_verdict_screen(record);
  std::optional<HookLock> lock;
  if (config.hook) {
    lock.emplace(spool.spool_folder(), record.run);
    record.events.push_back(make_requested_event(*config.hook, record.operator_name));
  }
  // After a kill in between, the golden unit is due too early, not too late.
  const bool golden_passed = record.kind == "golden" && record.has_run_passed();
  if (!golden_passed) update_golden_state(config, record);
  try {
    spool.store_run(record);
  } catch (const InputError&) {
    lines.push_back({"NOT RECORDED: repeat the run when it can be stored", ScreenLineStyle::fail});
    terminal.print_permanent_lines(lines);
    throw;
  }
  mark_run_stored();
  terminal.print_permanent_lines(lines);
  if (golden_passed) update_golden_state(config, record);
  std::string file_error, remedy;
  try {
    remedy = fmt::format("'vlp-station restore {} --station {}' writes the files", record.run,
                         config.file.string());
    const fs::path folder = publish_run_files(record, pictures, config.results);
    spdlog::info("run {}: {}", record.run, folder.string());
    remedy = "move the folder there before the next run";
    rename_finished();
  } catch (const InputError& error) {
    file_error = error.what();
  }
  spool.deliver_waiting();
  if (config.hook) {
    const std::string problem = run_and_record_hook(*config.hook, record, *lock, spool);
    if (!problem.empty()) spdlog::error("{}", problem);
    terminal.print_permanent_lines(make_hook_lines(record));
  }
  terminal.print_permanent_lines(make_notice_lines(make_spool_notice(spool)));
  if (file_error.empty()) return;
  // [STATION-20] `the verdict` | recorded, its files not written | `restore RUN`
  throw std::runtime_error(
      fmt::format("{}; the verdict {} is recorded: {}", file_error, record.verdict, remedy));
}

void warn_of_spool(Spool& spool) {
  if (const auto notice = make_spool_notice(spool); !notice.empty()) {
    spdlog::warn("{}", escape_for_terminal(notice));
  }
}

/// Checks the conditions that are known before the first image.
void prepare_run(Spool& spool, const StationConfig& config, const std::string& camera) {
  check_results_writable(config.results, camera);
  spool.check_can_store();
  warn_of_spool(spool);
}

void prepare_run(Unit& unit, Spool& spool, const StationConfig& config) {
  prepare_run(spool, config, unit.camera_id());
  unit.set_image_lookup([&spool, camera = unit.camera_id()](const std::string& sha256) {
    return spool.find_other_user(sha256, camera);
  });
  unit.invalidate_verdict(describe_golden_problem(config));
}

/// Throws GateNotMet if the run failed, Undetermined if it is invalid.
void require_passed(const RunRecord& record) {
  if (record.has_run_passed()) return;
  if (record.is_verdict_invalid()) {
    throw Undetermined(
        fmt::format("camera {} is not judged: {}", record.camera, record.first_cause()));
  }
  throw GateNotMet((record.kind == "golden" ? "station " + record.station + " has moved: "
                                            : "camera " + record.camera + " fails: ") +
                   record.first_cause());
}

void add_step_folders(Unit& unit, const fs::path& folder) {
  bool any = false;
  for (const StationStep step : kStationSteps) {
    if (!fs::is_directory(folder / station_step_name(step))) continue;
    any = true;
    unit.add_step_images(step, list_images(folder / station_step_name(step)));
  }
  if (!any) throw InputError(folder, "has none of the folders boards, rotation, dispersion, check");
}

/// Makes the record of a unit that ends now. The run is invalid if the golden unit failed in the
/// meantime, but not if it only became due.
RunRecord make_final_record(Unit& unit, const std::string& run, const StationRunOptions& options,
                            Spool& spool) {
  if (unit.invalid_reason().empty()) {
    unit.invalidate_verdict(
        describe_golden_problem(unit.station_config(), GoldenCheckTime::verdict));
    const std::string due = describe_golden_problem(unit.station_config());
    if (unit.invalid_reason().empty() && !due.empty()) {
      // [STATION-3] `before the next unit`
      spdlog::warn("{} before the next unit; this unit was started before", due);
    }
  }
  RunRecord record = make_unit_record(unit, run, kProgram);
  record.operator_name = options.operator_name;
  record.shift = options.shift;
  if (record.is_verdict_invalid()) return record;  // images of an invalid run may be used again
  const Spool::SameImages earlier = spool.search_same_images(record);
  if (earlier.run) {
    invalidate_reuse(record, *earlier.run, options.station);
  } else if (!earlier.is_complete) {
    // [STATION-1] `records are offline`
    const std::string unchecked =
        "the records are offline: whether an earlier run used the same images was not checked";
    record.events.push_back(make_run_event_now(kUnchecked, unchecked));
    spdlog::warn("{}", unchecked);
  }
  return record;
}

RunRecord run_with_given_folder(const StationRunOptions& options, const StationConfig& config,
                                Spool& spool) {
  const std::string run = make_run_id();
  Unit unit(config, options.camera_id, kProgram, options.threads);
  prepare_run(unit, spool, config);
  if (!unit.invalid_reason().empty()) spdlog::warn("{}; no unit passes", unit.invalid_reason());
  add_step_folders(unit, options.batch);
  unit.solve_completed(true);
  RunRecord record = make_final_record(unit, run, options, spool);
  Terminal terminal;
  store_and_report_run(record, unit.collect_plots(), spool, config, terminal);
  return record;
}

RunRecord run_with_watched_folders(const StationRunOptions& options, const StationConfig& config,
                                   Spool& spool) {
  StepSources sources(options.sources, config.nominal_camera.imager_px);
  Unit unit(config, options.camera_id, kProgram, options.threads);
  prepare_run(unit, spool, config);
  WatchedRun watched(unit, spool);
  Terminal terminal;
  if (const auto& finished = watched.finished_record()) {
    terminal.print_permanent_lines(make_verdict_screen(*finished));
    terminal.print_permanent_lines(make_hook_lines(*finished));
    spdlog::info("run {} has its verdict already; the same command starts another run",
                 finished->run);
    return *finished;
  }
  spdlog::info("run {}; images go to {}/STEP", watched.run_id(), watched.run_folder().string());
  if (!unit.invalid_reason().empty() && !terminal.is_interactive()) {
    spdlog::warn("{}; no unit passes", unit.invalid_reason());
  }
  guide_operator(options, unit, watched, sources, spool, terminal);
  unit.solve_completed(true);
  RunRecord record = make_final_record(unit, watched.run_id(), options, spool);
  store_and_report_run(
      record, unit.collect_plots(), spool, config, terminal, [&] { watched.mark_run_stored(); },
      [&] { watched.rename_finished(); });
  return record;
}

}  // namespace

void measure_unit(const StationRunOptions& options) {
  const StationConfig config = read_station_config(options.station);
  if (const std::string why = describe_serial_problem(config, options.camera_id); !why.empty()) {
    throw std::invalid_argument("--camera-id: " + why);
  }
  Spool spool(config.spool, config.records);
  require_passed(options.batch.empty() ? run_with_watched_folders(options, config, spool)
                                       : run_with_given_folder(options, config, spool));
}

void verify_with_golden(const StationRunOptions& options) {
  const StationConfig config = read_station_config(options.station);
  if (!config.golden_unit)
    throw InputError(options.station, "has no golden unit: add the key 'golden'");
  Spool spool(config.spool, config.records);
  prepare_run(spool, config, config.golden_unit->camera_id);
  const fs::path arrived = config.captures / config.golden_unit->camera_id;
  const bool batch = !options.batch.empty();
  auto [record, pictures] = verify_from_images(config, batch ? fs::path(options.batch) : arrived,
                                               make_run_id(), kProgram, options.threads);
  if (config.verification_interval) {
    invalidate_if_reused(record,
                         [&](const std::string& sha256) { return spool.find_golden_user(sha256); });
  }
  record.operator_name = options.operator_name;
  record.shift = options.shift;
  Terminal terminal;
  store_and_report_run(
      record, pictures, spool, config, terminal, [] {},
      [&, run = record.run] {
        if (!batch) rename_finished(arrived, run);
      });
  require_passed(record);
}

void rerun_hooks(const StationRunOptions& options) {
  const StationConfig config = read_station_config(options.station);
  if (!config.hook) throw InputError(options.station, "has no hook: add the key 'hook'");
  Spool spool(config.spool, config.records);
  spool.deliver_waiting();
  const auto runs = spool.list_run_summaries({.station = config.station, .has_open_hook = true});
  std::size_t failed = 0;
  for (const RunSummary& run : runs) {
    const auto report = [&](const std::string& outcome) {
      fmt::print("{}\n", escape_for_line(fmt::format("{} {} {}: {}", run.run, run.camera,
                                                     run.verdict, outcome)));
    };
    const HookLock lock(spool.spool_folder(), run.run);
    auto record = spool.find_run_by_id(run.run);
    // Another program can have called it.
    if (!record || !is_hook_pending(*record)) continue;
    if (!lock.is_holding()) {
      report("is being run");
      continue;
    }
    const std::string unrecorded = run_and_record_hook(*config.hook, *record, lock, spool);
    const std::string problem = describe_pending_hook(*record);
    if (!problem.empty()) ++failed;
    report(problem.empty() ? "done" : problem);
    if (!unrecorded.empty()) report(unrecorded);
  }
  warn_of_spool(spool);
  if (failed > 0) {
    // [STATION-9] `the hook failed for`
    throw std::runtime_error(fmt::format("the hook failed for {} of {} runs", failed, runs.size()));
  }
}

}  // namespace vlp
