// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_steps.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "calibration/intrinsics/mrcal_files.h"
#include "evaluation/evaluation_files.h"
#include "frontend/board_intake.h"
#include "frontend/image_file.h"
#include "frontend/lamp_intake.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"
#include "session/camera_options.h"
#include "session/check_outliers.h"
#include "session/dispersion_step.h"
#include "session/evaluate_step.h"
#include "session/lens_step.h"
#include "session/locate_step.h"
#include "session/rotation_step.h"
#include "session/row_time_step.h"
#include "session/session_gates.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Returns the plots that the steps of the calibration made for the report.
std::vector<fs::path> list_plots(const SessionState& state) {
  std::vector<fs::path> plots;
  if (!state.options.report) return plots;
  for (const char* name : {"lens.svg", "rotation.svg", "dispersion.svg"}) {
    if (const fs::path plot = state.output_file(name); fs::exists(plot)) plots.push_back(plot);
  }
  return plots;
}

/// Returns the tables of captures in a folder.
std::vector<fs::path> list_capture_tables(const fs::path& folder) {
  std::vector<fs::path> tables{folder / "captures.csv", folder / "truth.csv"};
  std::erase_if(tables, [](const fs::path& table) { return !fs::exists(table); });
  return tables;
}

void append_paths(const std::vector<fs::path>& more, std::vector<fs::path>& paths) {
  paths.insert(paths.end(), more.begin(), more.end());
}

fs::path lamps_file(const SessionState& state) { return state.session.lamp_map_file(); }
LampMap read_lamps(const SessionState& state) {
  return read_overhead_lamps(lamps_file(state), state.options.frontend.room);
}
fs::path fixes_file_path(const SessionState& state, const fs::path& captures) {
  return state.output_file(captures.filename().string() + "-fixes.csv");
}

HistoryEntry make_session_entry(SessionState& state, const std::string& options,
                                const std::vector<fs::path>& inputs) {
  return make_history_entry(state.options.program, options, inputs, state.digests);
}

std::vector<std::string> list_lens_files(const SessionOptions& options) {
  if (options.choose_lens_model || can_mrcal_solve(options.lens_model)) return {"lens.cameramodel"};
  return {};
}

std::vector<std::string> list_evaluation_files(const SessionOptions& options) {
  if (options.report) return {"evaluation.json", "report.html"};
  return {"evaluation.json"};
}

bool is_row_time_estimated(const SessionState& state) {
  return std::ranges::find(state.result.steps, "row-time", &SessionStep::name) !=
         state.result.steps.end();
}

/// Returns the name of the file or the option that gives the row time.
std::string describe_source(const SessionState& state) {
  if (is_row_time_estimated(state)) return "camera.yaml of the results";
  return state.session.camera_calibration_path() ? "camera.yaml" : "--row-time-s";
}

std::string format_plot_setting(const SessionState& state) {
  return state.options.report ? "picture" : "";
}

FrontendOptions make_lamp_options(const SessionState& state) {
  FrontendOptions options = state.options.frontend;
  options.readout.reset();  // already part of the calibration
  if (const auto classifier = state.session.classifier_path()) options.classifier = *classifier;
  return options;
}

StepInputs list_given_camera_inputs(const SessionState& state, const SessionStepPlan& /*step*/) {
  return {{*state.session.camera_calibration_path()}, list_changed_camera_options(state.options)};
}

StepWork read_given_camera(SessionState& state, const SessionStepPlan& /*step*/,
                           const std::vector<fs::path>& inputs) {
  const auto report = read_calibration(inputs.front()).intrinsics_report;
  StepWork work;
  if (report && report->views > 0) work.result.metrics = {{"rms_px", report->rms_px}};
  if (const std::string unused = list_changed_camera_options(state.options); !unused.empty()) {
    work.result.warnings.push_back(
        "camera.yaml takes precedence over options of the camera; ignored: " + unused);
  }
  return work;
}

StepInputs list_board_inputs(const SessionState& state, const SessionStepPlan& step) {
  return {{step.captures, state.session.board_file()},
          fmt::format("{} {}", format_camera_options(state.options), state.options.report)};
}

StepWork estimate_lens(SessionState& state, const SessionStepPlan& step,
                       const std::vector<fs::path>& /*inputs*/) {
  LensInput input;
  input.board = read_board(state.session.board_file());
  input.board_file = state.session.board_file();
  FrontendOptions options = state.options.frontend;
  options.corner_cache = state.results.cache_folder();
  input.observations = detect_boards(list_images(step.captures), input.board,
                                     state.session.board_file(), options, state.observer.progress);
  input.camera.id = state.options.camera_id;
  input.camera.lens_model = state.options.lens_model;
  input.camera.row_time_s = state.options.frontend.row_time_s;
  input.camera.readout = state.options.frontend.readout;
  input.choose_lens_model = state.options.choose_lens_model;
  LensResult lens = run_lens_step(std::move(input),
                                  make_session_entry(state, format_camera_options(state.options),
                                                     {state.session.board_file(), step.captures}));
  if (lens.lens.choice)
    lens.notes.push_back("lens model: " + describe_lens_choice(*lens.lens.choice));
  return {lens, [&state, lens] {
            if (!can_mrcal_solve(lens.calibration.camera.lens_model)) return;
            write_cameramodel(state.output_file("lens.cameramodel"), lens.lens.solution,
                              lens.lens.report.region);
          }};
}

StepInputs list_lamp_inputs(const SessionState& state, const SessionStepPlan& step) {
  StepInputs inputs{{step.captures, lamps_file(state), state.calibration_file,
                     state.session.classifier_path().value_or("")}};
  if (!step.plot.empty())
    inputs.options = format_plot_setting(state) + " " + describe_source(state);
  return inputs;
}

StepWork estimate_row_time(SessionState& state, const SessionStepPlan& step,
                           const std::vector<fs::path>& /*inputs*/) {
  const LampMap lamps = read_lamps(state);
  const Calibration camera = read_calibration(state.calibration_file);
  const DetectedLights seen = detect_in_folders({step.captures}, lamps, camera, false,
                                                make_lamp_options(state), state.observer.progress);
  StepResult result = run_row_time_step(
      seen, {{}}, lamps, lamps_file(state), camera,
      make_session_entry(state, "--row-time", {step.captures, lamps_file(state)}));
  add_intake_remarks(seen.observations, result);
  return {result};
}

/// Detects the lamps in the captures of a step, solves it, and adds the remarks on its images.
StepResult solve_from_lamps(const SessionState& state, const SessionStepPlan& step, ImageUse use,
                            const std::function<StepResult(const LampCaptures&)>& solve) {
  LampCaptures captures{
      {}, read_lamps(state), lamps_file(state), read_calibration(state.calibration_file)};
  LampImages images{step.captures, captures.lamps, captures.lamps_file, captures.calibration,
                    state.calibration_file};
  // The inclinations of a rotation are ignored: its axis is level.
  if (use == ImageUse::rotation) images.captures.emplace();
  const Observations seen =
      detect_lamps(images, use, make_lamp_options(state), state.observer.progress);
  captures.frames = collect_lamp_frames(seen.images);
  StepResult result;
  if (!seen.failure) result = solve(captures);
  add_intake_remarks(seen, result);
  if (state.session.classifier_path()) return result;  // lamps are not identified by frequency
  const DetectorCamera camera = make_detector_camera(captures.calibration);
  add_row_time_remark(seen.images, captures.lamps, camera, describe_source(state), result);
  if (use == ImageUse::rotation && !is_row_time_estimated(state)) {
    const auto metrics = make_row_time_metrics(
        check_row_time(seen.images, captures.lamps, {*camera.row_time_s, describe_source(state)}));
    result.metrics.insert(result.metrics.end(), metrics.begin(), metrics.end());
  }
  return result;
}

StepWork estimate_rotation(SessionState& state, const SessionStepPlan& step,
                           const std::vector<fs::path>& inputs) {
  return {solve_from_lamps(state, step, ImageUse::rotation, [&](const LampCaptures& captures) {
    return run_rotation_step(captures, RotationMethod::axis, make_session_entry(state, "", inputs));
  })};
}

StepWork estimate_dispersion(SessionState& state, const SessionStepPlan& step,
                             const std::vector<fs::path>& inputs) {
  std::vector<fs::path> all_inputs = inputs;
  append_paths(list_capture_tables(step.captures), all_inputs);
  const CapturesTable table = read_captures_with_truth(step.captures);
  return {
      solve_from_lamps(state, step, ImageUse::known_positions, [&](const LampCaptures& captures) {
        const KnownPositions places = collect_known_captures(captures.frames, table);
        StepResult result = check_known_positions(places.captures.size(), captures.frames.size());
        if (!result.has_succeeded()) return result;
        return StepResult(run_dispersion_step(captures, places, DispersionMethod::camera,
                                              DispersionCircle::mean,
                                              make_session_entry(state, "", all_inputs)));
      })};
}

StepWork locate_captures(SessionState& state, const SessionStepPlan& step,
                         const std::vector<fs::path>& /*inputs*/) {
  const bool is_check = state.session.accuracy_check_folder() == step.captures;
  LocateInput input{{},
                    read_lamps(state),
                    read_calibration(state.calibration_file),
                    read_folder_captures(step.captures)};
  input.compute_lamp_offsets = is_check;
  const LampImages images{step.captures, input.lamps, lamps_file(state), input.calibration,
                          state.calibration_file};
  LocateResult found =
      locate_from_images(images, is_check ? ImageUse::known_positions : ImageUse::fixes,
                         std::move(input), make_lamp_options(state), state.observer.progress);
  return {found, [&state, file = step.captures, rows = found.rows] {
            write_fixes(fixes_file_path(state, file), rows);
          }};
}

StepInputs list_evaluation_inputs(const SessionState& state, const SessionStepPlan& /*step*/) {
  StepInputs inputs{
      {state.output_file("check-fixes.csv"), lamps_file(state), state.calibration_file},
      format_plot_setting(state)};
  if (const auto check = state.session.accuracy_check_folder())
    append_paths(list_capture_tables(*check), inputs.files);
  append_paths(list_plots(state), inputs.files);
  for (const fs::path& line : state.list_line_drives()) {
    inputs.files.push_back(fixes_file_path(state, line));
    append_paths(list_capture_tables(line), inputs.files);
  }
  for (const Gate& gate : state.gates)
    inputs.options += fmt::format("{} {}\n", gate.metric, gate.limit);
  return inputs;
}

StepWork evaluate_check(SessionState& state, const fs::path& truth,
                        const std::vector<fs::path>& inputs) {
  auto input = std::make_shared<EvaluationInput>();
  input->fixes = {state.output_file("check-fixes.csv"),
                  read_fixes(state.output_file("check-fixes.csv"))};
  input->truth = {truth, read_truth_positions(truth.parent_path())};
  input->reference_point_radius_m = compute_same_position_radius_m(*state.result.calibration);
  input->threads = state.options.frontend.threads;
  EvaluateResult found = evaluate_with_truth(*input, select_step_gates(state.gates, "evaluate"));
  std::vector<Drive> drives;
  for (const fs::path& line : state.list_line_drives()) {
    const fs::path places = *find_truth_file(line), fixes = fixes_file_path(state, line);
    drives.push_back(
        {{fixes, read_fixes(fixes)}, read_end_points(places, read_truth_positions(line))});
    if (fit_line_to_fixes(drives.back().fixes.rows, drives.back().commanded_m)) continue;
    throw InputError(fixes, "no line can be fitted to its fixes: they have no direction");
  }
  if (!found.has_succeeded()) return {found};
  const auto offset = find_common_offset(*input);
  if (offset && offset->in_camera) {  // others are Evaluation::systematic_errors
    found.warnings.push_back(describe_common_offset(*offset));
  } else if (std::string outliers = describe_wrong_positions(*input); !outliers.empty()) {
    found.warnings.push_back(std::move(outliers));
  }
  state.add_warnings_metric(found);
  found.gates = state.check_step_gates("evaluate", found.metrics);
  return {found, [=, &state] {
            write_file(state.output_file("evaluation.json"),
                       format_evaluation(found.evaluation, found.gates));
            if (!state.options.report) return;
            Report page;
            page.gates = state.result.gates;
            page.gates.insert(page.gates.end(), found.gates.begin(), found.gates.end());
            page.calibration = state.result.calibration;
            for (const fs::path& plot : list_plots(state))
              page.plots.push_back(read_report_plot(plot));
            page.evaluation = make_session_entry(state, "", inputs);
            write_file(state.output_file("report.html"),
                       render_evaluation_html({*input, found, read_lamps(state), drives, page}));
          }};
}

StepWork evaluate_fixes(SessionState& state, const SessionStepPlan& /*step*/,
                        const std::vector<fs::path>& inputs) {
  const auto check = state.session.accuracy_check_folder();
  const auto truth = check ? find_truth_file(*check) : std::nullopt;
  StepWork work = truth ? evaluate_check(state, *truth, inputs) : StepWork();
  if (!truth) {
    work.result.notes.emplace_back(check ? "no errors and no report: check has neither truth.csv "
                                           "nor positions in captures.csv"
                                         : "no errors and no report: there is no check");
  }
  if (!state.session.dispersion_folder()) {
    work.result.notes.emplace_back("no dispersion offset: the session has no folder dispersion");
  }
  return work;
}

}  // namespace

fs::path SessionState::output_file(const std::string& name) const {
  return results.results_file_path(name);
}

std::vector<fs::path> SessionState::list_line_drives() const {
  return options.report ? session.line_drive_folders() : std::vector<fs::path>();
}

std::vector<CheckedMetric> SessionState::check_step_gates(
    const std::string& step, const std::vector<Metric>& metrics) const {
  return check_gates(merge_gates(make_step_gates(metrics), select_step_gates(gates, step)),
                     metrics);
}

void SessionState::add_warnings_metric(StepResult& last) const {
  std::size_t warnings = last.warnings.size();
  for (const SessionStep& step : result.steps) warnings += step.result.warnings.size();
  std::erase_if(last.metrics, [](const Metric& metric) { return metric.name == "warnings"; });
  last.metrics.push_back({"warnings", static_cast<double>(warnings)});
}

std::vector<SessionStepPlan> plan_session_steps(const SessionState& state) {
  const SessionFolder& session = state.session;
  const bool is_camera_given = session.camera_calibration_path().has_value();
  std::vector<SessionStepPlan> steps{
      is_camera_given
          ? SessionStepPlan{"lens", {}, list_given_camera_inputs, read_given_camera}
          : SessionStepPlan{"lens", session.boards_folder(), list_board_inputs, estimate_lens,
                            "lens.yaml", "lens.svg", list_lens_files(state.options)},
      {"row-time", session.rotation_folder(), list_lamp_inputs, estimate_row_time, "camera.yaml"},
      {"rotation", session.rotation_folder(), list_lamp_inputs, estimate_rotation, "rotated.yaml",
       "rotation.svg"},
      {"dispersion", session.dispersion_folder().value_or(""), list_lamp_inputs,
       estimate_dispersion, "calibration.yaml", "dispersion.svg"}};
  std::vector<fs::path> drives = state.list_line_drives();
  if (const auto check = session.accuracy_check_folder()) drives.insert(drives.begin(), *check);
  for (const fs::path& drive : drives) {
    steps.push_back({drive.filename().string(),
                     drive,
                     list_lamp_inputs,
                     locate_captures,
                     "",
                     "",
                     {fixes_file_path(state, drive).filename().string()}});
  }
  steps.push_back({"evaluate",
                   {},
                   list_evaluation_inputs,
                   evaluate_fixes,
                   "",
                   "",
                   list_evaluation_files(state.options)});
  return steps;
}

bool is_step_needed(const SessionState& state, const SessionStepPlan& step) {
  if (step.name == "dispersion") return !step.captures.empty();
  return step.name != "row-time" ||
         !(state.result.calibration->camera.row_time_s || state.session.classifier_path());
}

void add_readout_remark(const SessionState& state, StepResult& result) {
  if (state.result.steps.empty() || state.session.classifier_path()) return;
  const Camera& camera = state.result.calibration->camera;
  if (!camera.readout) return;
  const std::string error =
      describe_wrong_readout(list_images(state.session.rotation_folder()), *camera.readout,
                             state.session.camera_calibration_path() ? "camera.yaml" : "--readout",
                             make_lamp_options(state), camera.imager_px);
  if (!error.empty()) result.set_step_failure(StepFailure::bad_input, error);
}

}  // namespace vlp
