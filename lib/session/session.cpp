// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <utility>

#include "calibration/intrinsics/mrcal_files.h"
#include "captures/digest.h"
#include "evaluation/evaluation_files.h"
#include "frontend/board_intake.h"
#include "frontend/image_file.h"
#include "frontend/lamp_intake.h"
#include "lamps/signal/frequency_identification.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"
#include "session/check_outliers.h"
#include "session/dispersion_step.h"
#include "session/evaluate_step.h"
#include "session/lens_step.h"
#include "session/locate_step.h"
#include "session/rotation_step.h"
#include "session/row_time_step.h"
#include "session/session_file.h"
#include "session/session_results.h"
#include "session/step_result.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Returns a text that identifies the build of the program: results may differ between builds.
std::string describe_build(const ProgramVersion& program) {
  std::error_code unknown;
  const fs::path file = fs::read_symlink("/proc/self/exe", unknown);
  const auto changed = fs::last_write_time(file, unknown).time_since_epoch().count();
  return fmt::format("{} {} {} {}", program.program, program.version, fs::file_size(file, unknown),
                     changed);
}

/// Removes the path of a folder from the beginnings of file names in a text: results must not
/// depend on it.
std::string remove_folder(std::string text, const fs::path& named) {
  const std::string folder = (named / "").string();
  for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder, at)) {
    const bool begins = at == 0 || text[at - 1] == ' ' || text[at - 1] == '\'';
    if (begins) {
      text.erase(at, folder.size());
    } else {
      ++at;
    }
  }
  return text;
}

/// Steps whose metrics can have gates.
constexpr std::array<std::pair<MetricSource, std::string_view>, 4> kStepsOfMetrics{
    {{MetricSource::lens, "lens"},
     {MetricSource::rotation, "rotation"},
     {MetricSource::dispersion, "dispersion"},
     {MetricSource::evaluation, "evaluate"}}};

constexpr std::array kPlots{"lens.svg", "rotation.svg", "dispersion.svg"};

/// Returns the gates of the session: those of the lens, if it is estimated, and those of its file.
std::vector<Gate> read_session_gates(const SessionFolder& session, const SessionOptions& options) {
  std::vector<Gate> gates;
  if (!session.camera_calibration_path()) gates = make_lens_gates();
  const fs::path file = session.gates_file().value_or(options.gates_file);
  if (!file.empty())
    gates = merge_gates(std::move(gates), read_gates(file, list_session_metrics()));
  return options.strict ? merge_gates(std::move(gates), {{"warnings", 0}}) : gates;
}

/// Result of a step, and the function that writes its outputs.
struct Work {
  StepResult result;
  std::function<void()> write = [] {};
};

/// Writes the summaries, session.json last: without it the results are those of a killed run.
void write_summaries(const SessionResults& results, const SessionResult& result,
                     const SessionOptions& options) {
  write_file(results.results_file_path("junit.xml"), format_session_junit(result));
  write_file(results.results_file_path("session.json"), format_session(result, options));
}

class SessionRun {
 public:
  SessionRun(const SessionFolder& session, std::vector<Gate> gates, SessionResults& results,
             const SessionOptions& options, const SessionObserver& observer)
      : session_(session),
        results_(results),
        options_(options),
        observer_(observer),
        build_(describe_build(options.program)),
        gates_(std::move(gates)) {}

  SessionResult run() {
    check_redo_option();
    results_.set_steps(list_outputs());
    if (run_steps() && locate_drives()) {
      add_dispersion_gates();
      evaluate_session_fixes();
    }
    finish_session();
    return std::move(result_);
  }

 private:
  void check_redo_option() const {
    std::vector<std::string> names;
    for (const auto& [step, files] : list_outputs()) names.push_back(step);
    for (const std::string& name : options_.steps_to_redo) {
      if (std::ranges::find(names, name) != names.end()) continue;
      throw std::invalid_argument(
          fmt::format("no step {}; the steps are: {}", name, fmt::join(names, ", ")));
    }
  }

  bool is_redo_requested(const std::string& step) const {
    return std::ranges::find(options_.steps_to_redo, step) != options_.steps_to_redo.end();
  }

  fs::path output_file_path(const std::string& name) const {
    return results_.results_file_path(name);
  }
  fs::path fixes_file_path(const fs::path& captures) const {
    return output_file_path(captures.filename().string() + "-fixes.csv");
  }
  fs::path lamps_file() const { return session_.lamp_map_file(); }
  LampMap read_lamps() const { return read_overhead_lamps(lamps_file(), options_.frontend.room); }

  std::string remove_folder(std::string text) const {
    for (const fs::path& folder :
         {session_.path(), results_.new_outputs_folder(), results_.path()}) {
      text = vlp::remove_folder(std::move(text), folder);
    }
    return text;
  }

  std::vector<fs::path> line_drive_folders() const {
    return options_.report ? session_.line_drive_folders() : std::vector<fs::path>();
  }

  /// Returns the steps of this session with their outputs.
  std::vector<StepOutputs> list_outputs() const {
    const auto with_picture = [&](std::vector<std::string> names, const char* picture) {
      if (options_.report) names.emplace_back(picture);
      return names;
    };
    std::vector<std::string> lens;
    if (!session_.camera_calibration_path()) lens = with_picture({"lens.yaml"}, "lens.svg");
    if (!session_.camera_calibration_path() &&
        (options_.choose_lens_model || can_mrcal_solve(options_.lens_model))) {
      lens.insert(lens.begin() + 1, "lens.cameramodel");
    }
    std::vector<StepOutputs> steps{
        {"lens", lens},
        {"row-time", {"camera.yaml"}},
        {"rotation", with_picture({"rotated.yaml"}, "rotation.svg")},
        {"dispersion", with_picture({"calibration.yaml"}, "dispersion.svg")}};
    if (session_.accuracy_check_folder()) steps.push_back({"check", {"check-fixes.csv"}});
    for (const fs::path& line : line_drive_folders()) {
      steps.push_back({line.filename().string(), {fixes_file_path(line).filename().string()}});
    }
    steps.push_back({"evaluate", with_picture({"evaluation.json"}, "report.html")});
    return steps;
  }

  std::string compute_step_key(const std::vector<fs::path>& inputs, const std::string& options) {
    std::string text = build_ + "\n" + options + "\n" + options_.frontend.room + "\n";
    for (const fs::path& input : inputs) {
      if (input.empty()) continue;
      text += input.filename().string() + " ";
      try {
        text += fs::is_directory(input) ? digests_.digest_folder(input) : hash_file(input);
      } catch (const InputError&) {
        text += "cannot be read";
      }
      text += "\n";
    }
    return hash_text(text);
  }

  /// Runs a step unless inputs, options, program and outputs are unchanged since it last ended.
  /// Returns false if the step failed.
  bool run_or_reuse_step(const std::string& name, const std::vector<fs::path>& inputs,
                         const std::string& options, const std::function<Work()>& work) {
    if (observer_.on_step_started) observer_.on_step_started(name);
    const std::string key = compute_step_key(inputs, options);
    SessionStep done{name, false, {}};
    if (auto cached_result = results_.find_cached(name, key);
        cached_result && !is_redo_requested(name)) {
      done.is_up_to_date = true;
      done.result = std::move(*cached_result);
    } else {
      results_.remove_outputs(name);
      done.result = run_step_work(work);
      results_.store_step_result(name, key, done.result);
    }
    if (done.result.has_succeeded()) {
      if (name == "evaluate") add_warnings_metric(done.result);
      done.result.gates = check_step_gates(name, done.result.metrics);
    }
    result_.gates.insert(result_.gates.end(), done.result.gates.begin(), done.result.gates.end());
    result_.steps.push_back(std::move(done));
    if (observer_.on_step_finished) observer_.on_step_finished(result_.steps.back());
    return result_.steps.back().result.has_succeeded();
  }

  bool has_step(std::string_view name) const {
    return std::ranges::find(result_.steps, name, &SessionStep::name) != result_.steps.end();
  }

  /// Adds the gates of the dispersion if the session has no captures for it: they fail, because
  /// their metrics have no value.
  void add_dispersion_gates() {
    if (has_step("dispersion")) return;
    const auto gates = check_gates(select_step_gates("dispersion"), {});
    result_.gates.insert(result_.gates.end(), gates.begin(), gates.end());
  }

  /// Sets the metric `warnings` of the last step to the number of warnings of all steps.
  void add_warnings_metric(StepResult& last) const {
    std::size_t warnings = last.warnings.size();
    for (const SessionStep& step : result_.steps) warnings += step.result.warnings.size();
    std::erase_if(last.metrics, [](const Metric& metric) { return metric.name == "warnings"; });
    last.metrics.push_back({"warnings", static_cast<double>(warnings)});
  }

  std::vector<CheckedMetric> check_step_gates(const std::string& step,
                                              const std::vector<Metric>& metrics) const {
    return check_gates(merge_gates(make_step_gates(metrics), select_step_gates(step)), metrics);
  }

  /// Returns the gates of the metrics of a step.
  std::vector<Gate> select_step_gates(const std::string& step) const {
    std::vector<Gate> gates;
    for (const Gate& gate : gates_) {
      const std::pair gated(find_metric_kind(gate.metric)->source, std::string_view(step));
      if (std::ranges::find(kStepsOfMetrics, gated) != kStepsOfMetrics.end()) gates.push_back(gate);
    }
    return gates;
  }

  /// Runs the work of a step and writes its outputs. A bad input becomes the failure bad_input;
  /// errors of writing are thrown.
  StepResult run_step_work(const std::function<Work()>& work) const {
    Work done;
    try {
      done = work();
      if (!done.result.has_succeeded()) add_readout_remark(done.result);
    } catch (const InputError& error) {
      done.result.set_step_failure(StepFailure::bad_input, error.what());
    } catch (const std::invalid_argument& error) {
      done.result.set_step_failure(StepFailure::bad_input, error.what());
    }
    StepResult& result = done.result;
    result.set_step_failure(result.failure, remove_folder(format_failure_message(result)));
    for (std::string& warning : result.warnings) warning = remove_folder(std::move(warning));
    for (auto& [image, reason] : result.skipped) reason = remove_folder(std::move(reason));
    if (result.has_succeeded()) done.write();
    return std::move(result);
  }

  HistoryEntry make_step_history(const std::string& options, const std::vector<fs::path>& inputs) {
    return vlp::make_history_entry(options_.program, options, inputs, digests_);
  }

  void write_picture(const StepResult& result, const std::string& name) const {
    if (options_.report && result.drawing) write_plot(output_file_path(name), result.drawing());
  }

  /// Returns the options of the camera as text for the history.
  std::string format_camera_options() const {
    std::string text = "--camera-id " + options_.camera_id;
    if (options_.frontend.row_time_s)
      text += fmt::format(" --row-time-s {}", *options_.frontend.row_time_s);
    if (options_.frontend.readout) {
      text += options_.frontend.readout == Readout::rows ? " --readout rows" : " --readout columns";
    }
    const FrontendOptions defaults;
    const FrontendOptions& limits = options_.frontend;
    if (limits.max_blur_fraction != defaults.max_blur_fraction) {
      text += fmt::format(" --max-blur-fraction {}", limits.max_blur_fraction);
    }
    if (limits.max_white_fraction != defaults.max_white_fraction) {
      text += fmt::format(" --max-white-fraction {}", limits.max_white_fraction);
    }
    text += " --lens ";
    return text.append(options_.choose_lens_model ? "auto" : lens_model_name(options_.lens_model));
  }

  bool run_lens() {
    const std::string settings = fmt::format("{} {}", format_camera_options(), options_.report);
    return run_or_reuse_step(
        "lens", {session_.boards_folder(), session_.board_file()}, settings, [&] {
          LensInput input;
          input.board = read_board(session_.board_file());
          input.board_file = session_.board_file();
          FrontendOptions options = options_.frontend;
          options.corner_cache = results_.cache_folder();
          input.observations = detect_boards(list_images(session_.boards_folder()), input.board,
                                             session_.board_file(), options, observer_.progress);
          input.camera.id = options_.camera_id;
          input.camera.lens_model = options_.lens_model;
          input.camera.row_time_s = options_.frontend.row_time_s;
          input.camera.readout = options_.frontend.readout;
          input.choose_lens_model = options_.choose_lens_model;
          LensResult lens =
              run_lens_step(std::move(input),
                            make_step_history(format_camera_options(),
                                              {session_.board_file(), session_.boards_folder()}));
          if (lens.lens.choice)
            lens.notes.push_back("lens model: " + describe_choice(*lens.lens.choice));
          return Work{lens, [this, lens] {
                        if (can_mrcal_solve(lens.calibration.camera.lens_model)) {
                          write_cameramodel(output_file_path("lens.cameramodel"),
                                            lens.lens.solution, lens.lens.report.region);
                        }
                        write_picture(lens, "lens.svg");
                        write_calibration(output_file_path("lens.yaml"), lens.calibration);
                      }};
        });
  }

  bool run_row_time(const fs::path& camera_file) {
    return run_or_reuse_step(
        "row-time", {session_.rotation_folder(), lamps_file(), camera_file}, "", [&] {
          const LampMap lamps = read_lamps();
          const Calibration camera = read_calibration(camera_file);
          FrontendOptions options = options_.frontend;
          options.readout.reset();
          const DetectedLights seen = detect_in_folders({session_.rotation_folder()}, lamps, camera,
                                                        false, options, observer_.progress);
          RowTimeStepResult found = vlp::run_row_time_step(
              seen, {{}}, lamps, lamps_file(), camera,
              make_step_history("--row-time", {session_.rotation_folder(), lamps_file()}));
          add_intake_remarks(seen.observations, found);
          return Work{found, [this, found] {
                        write_calibration(output_file_path("camera.yaml"), found.calibration);
                      }};
        });
  }

  FrontendOptions make_lamp_options() const {
    FrontendOptions options = options_.frontend;
    options.readout.reset();  // already part of the calibration
    if (const auto classifier = session_.classifier_path()) options.classifier = *classifier;
    return options;
  }

  /// Detects the lamps in the captures of a step. Returns the remarks, the metrics of the row time,
  /// and the failure if no image can be used.
  StepResult observe_lamp_images(const LampImages& images, ImageUse use, LampCaptures& captures,
                                 std::vector<Observation>& seen) const {
    Observations observed = detect_lamps(images, use, make_lamp_options(), observer_.progress);
    captures.frames = collect_lamp_frames(observed.images);
    StepResult result;
    add_intake_remarks(observed, result);
    seen = std::move(observed.images);
    add_row_time_remark(captures, seen, result);
    const auto& row_time_s = captures.calibration.camera.row_time_s;
    if (use == ImageUse::rotation && is_row_time_given() && row_time_s) {
      result.metrics = make_row_time_metrics(
          check_row_time(seen, captures.lamps, {*row_time_s, describe_source()}));
    }
    return result;
  }

  /// Adds a contradiction of the row time to the result of a step
  /// (add_row_time_remark()).
  void add_row_time_remark(const LampCaptures& captures, const std::vector<Observation>& images,
                           StepResult& result) const {
    if (session_.classifier_path()) return;  // the lamps are not identified by frequency
    vlp::add_row_time_remark(images, captures.lamps, make_detector_camera(captures.calibration),
                             describe_source(), result);
  }

  /// Replaces the reason of a step with lamps that failed if the images show stripes along another
  /// direction than the readout direction of the camera.
  void add_readout_remark(StepResult& result) const {
    if (result_.steps.empty() || session_.classifier_path()) return;
    const Camera& camera = result_.calibration->camera;
    Observations remarks;
    const Readout shown = estimate_readout(list_images(session_.rotation_folder()), {},
                                           make_lamp_options(), camera.imager_px, remarks);
    if (!camera.readout || shown == *camera.readout || !remarks.warnings.empty()) return;
    // [LAMP-12] `stripes along`
    result.set_step_failure(
        StepFailure::bad_input,
        fmt::format("the readout is along {} in {}, but the images show stripes along {}; correct "
                    "it",
                    shown == Readout::rows ? "columns" : "rows",
                    session_.camera_calibration_path() ? "camera.yaml" : "--readout",
                    shown == Readout::rows ? "rows" : "columns"));
  }

  /// Returns true if camera.yaml or --row-time-s gives the row time and lamps are identified by
  /// frequency.
  bool is_row_time_given() const { return !session_.classifier_path() && !has_step("row-time"); }

  /// Returns the name of the file or the option that gives the row time.
  std::string describe_source() const {
    if (has_step("row-time")) return "camera.yaml of the results";
    return session_.camera_calibration_path() ? "camera.yaml" : "--row-time-s";
  }

  /// Adds the remarks and metrics of the images to the result of a step.
  static void add_image_remarks(const StepResult& remarks, StepResult& result) {
    result.metrics.insert(result.metrics.end(), remarks.metrics.begin(), remarks.metrics.end());
    result.skipped = remarks.skipped;
    result.notes.insert(result.notes.begin(), remarks.notes.begin(), remarks.notes.end());
    result.warnings.insert(result.warnings.begin(), remarks.warnings.begin(),
                           remarks.warnings.end());
  }

  static LampImages make_lamp_images(const fs::path& folder, const LampCaptures& captures,
                                     const fs::path& calibration_file) {
    return {folder, captures.lamps, captures.lamps_file, captures.calibration, calibration_file};
  }

  std::vector<fs::path> list_lamp_inputs(const fs::path& folder,
                                         const fs::path& calibration) const {
    return {folder, lamps_file(), calibration, session_.classifier_path().value_or("")};
  }

  std::string format_plot_setting() const { return options_.report ? "picture" : ""; }
  std::string format_lamp_settings() const {
    return format_plot_setting() + " " + describe_source();
  }

  bool run_rotation(const fs::path& camera_file) {
    const auto inputs = list_lamp_inputs(session_.rotation_folder(), camera_file);
    return run_or_reuse_step("rotation", inputs, format_lamp_settings(), [&] {
      LampCaptures captures{{}, read_lamps(), lamps_file(), read_calibration(camera_file)};
      LampImages images = make_lamp_images(session_.rotation_folder(), captures, camera_file);
      images.captures.emplace();  // inclinations are ignored: the axis is level
      std::vector<Observation> seen;
      const StepResult remarks = observe_lamp_images(images, ImageUse::rotation, captures, seen);
      if (!remarks.has_succeeded()) return Work{remarks};
      RotationResult found =
          run_rotation_step(captures, RotationMethod::axis, make_step_history("", inputs));
      if (!found.has_succeeded()) add_row_time_remark(captures, seen, found);
      add_image_remarks(remarks, found);
      return Work{found, [this, found] {
                    write_picture(found, "rotation.svg");
                    write_calibration(output_file_path("rotated.yaml"), found.calibration);
                  }};
    });
  }

  bool run_dispersion() {
    const fs::path folder = *session_.dispersion_folder(),
                   rotated = output_file_path("rotated.yaml");
    const auto inputs = list_lamp_inputs(folder, rotated);
    return run_or_reuse_step("dispersion", inputs, format_lamp_settings(), [&] {
      LampCaptures captures{{}, read_lamps(), lamps_file(), read_calibration(rotated)};
      std::vector<Observation> seen;
      const StepResult remarks = observe_lamp_images(make_lamp_images(folder, captures, rotated),
                                                     ImageUse::known_positions, captures, seen);
      if (!remarks.has_succeeded()) return Work{remarks};
      const KnownPositions places =
          collect_known_captures(captures.frames, read_captures_with_truth(folder));
      if (places.captures.empty()) {
        throw InputError(folder,
                         "its captures have no positions; add x_m and y_m to captures.csv, with "
                         "the names of the images");
      }
      DispersionResult found =
          run_dispersion_step(captures, places, DispersionMethod::camera, DispersionCircle::mean,
                              make_step_history("", add_capture_tables(inputs, folder)));
      if (!found.has_succeeded()) add_row_time_remark(captures, seen, found);
      add_image_remarks(remarks, found);
      if (places.captures_without_position > 0) {
        found.warnings.push_back(
            fmt::format("{} of {} captures ignored: they have no position; add it to captures.csv",
                        places.captures_without_position, captures.frames.size()));
      }
      return Work{found, [this, found] {
                    write_picture(found, "dispersion.svg");
                    write_calibration(output_file_path("calibration.yaml"), found.calibration);
                  }};
    });
  }

  static std::vector<fs::path> add_capture_tables(std::vector<fs::path> inputs,
                                                  const fs::path& folder) {
    for (const char* table : {"captures.csv", "truth.csv"}) {
      if (fs::exists(folder / table)) inputs.push_back(folder / table);
    }
    return inputs;
  }

  bool run_steps() {
    const auto given = session_.camera_calibration_path();
    if (given ? !read_given_camera(*given) : !run_lens()) return false;
    fs::path camera = given ? *given : output_file_path("lens.yaml");
    result_.calibration = read_calibration(camera);
    if (result_.calibration->camera.row_time_s || session_.classifier_path()) {
      results_.remove_outputs("row-time");
      if (is_redo_requested("row-time")) {
        throw std::invalid_argument(
            "there is no step row-time in this session, as the row time is known or there is a "
            "classifier; leave it out of --redo");
      }
    } else if (!run_row_time(camera)) {
      return false;
    } else {
      camera = output_file_path("camera.yaml");
    }
    if (!run_rotation(camera)) return false;
    result_.calibration = read_calibration(output_file_path("rotated.yaml"));
    if (!session_.dispersion_folder()) {
      results_.remove_outputs("dispersion");
      write_calibration(output_file_path("calibration.yaml"), *result_.calibration);
      return true;
    }
    if (!run_dispersion()) return false;
    result_.calibration = read_calibration(output_file_path("calibration.yaml"));
    return true;
  }

  /// Runs the step lens for a given camera.yaml, which fails if the file cannot be read.
  bool read_given_camera(const fs::path& camera) {
    const std::string unused = list_camera_options();
    return run_or_reuse_step("lens", {camera}, unused, [&] {
      const auto report = read_calibration(camera).intrinsics_report;
      Work work;
      if (report && report->views > 0) work.result.metrics = {{"rms_px", report->rms_px}};
      if (!unused.empty()) {
        work.result.warnings.push_back(
            "camera.yaml takes precedence over options of the camera; ignored: " + unused);
      }
      return work;
    });
  }

  /// Returns the changed options of the camera, such as "name, row time"; empty if none is changed.
  std::string list_camera_options() const {
    const SessionOptions unstated;
    std::string stated;
    const auto add = [&](bool is_stated, const char* what) {
      if (is_stated) stated.append(stated.empty() ? "" : ", ").append(what);
    };
    add(options_.camera_id != unstated.camera_id, "name");
    add(options_.choose_lens_model || options_.lens_model != unstated.lens_model, "lens model");
    add(options_.frontend.row_time_s.has_value(), "row time");
    add(options_.frontend.readout.has_value(), "readout");
    const FrontendOptions &limits = options_.frontend, &defaults = unstated.frontend;
    add(limits.max_blur_fraction != defaults.max_blur_fraction ||
            limits.max_white_fraction != defaults.max_white_fraction,
        "limits of board images");
    return stated;
  }

  bool locate_drives() {
    if (const auto check = session_.accuracy_check_folder(); check && !locate_folder(*check))
      return false;
    for (const fs::path& line : line_drive_folders()) {
      if (!locate_folder(line)) return false;
    }
    return true;
  }

  bool locate_folder(const fs::path& folder) {
    const fs::path calibration = output_file_path("calibration.yaml");
    return run_or_reuse_step(
        folder.filename().string(), list_lamp_inputs(folder, calibration), "", [&] {
          LocateInput input{
              {}, read_lamps(), read_calibration(calibration), read_folder_captures(folder)};
          input.compute_lamp_offsets = session_.accuracy_check_folder() == folder;
          const LampImages images{folder, input.lamps, lamps_file(), input.calibration,
                                  calibration};
          const ImageUse use = session_.accuracy_check_folder() == folder
                                   ? ImageUse::known_positions
                                   : ImageUse::fixes;
          LocateResult found = locate_from_images(images, use, std::move(input),
                                                  make_lamp_options(), observer_.progress);
          return Work{found, [this, folder, rows = found.rows] {
                        write_fixes(fixes_file_path(folder), rows);
                      }};
        });
  }

  void evaluate_session_fixes() {
    std::optional<fs::path> truth;
    std::vector<fs::path> inputs{output_file_path("check-fixes.csv"), lamps_file(),
                                 output_file_path("calibration.yaml")};
    if (const auto check = session_.accuracy_check_folder()) {
      for (const fs::path& table : add_capture_tables({}, *check)) inputs.push_back(table);
    }
    for (const char* plot : kPlots) {
      if (options_.report && fs::exists(output_file_path(plot)))
        inputs.push_back(output_file_path(plot));
    }
    for (const fs::path& line : line_drive_folders()) {
      inputs.push_back(fixes_file_path(line));
      for (const fs::path& table : add_capture_tables({}, line)) inputs.push_back(table);
    }
    const std::vector<Gate> gates = select_step_gates("evaluate");
    std::string limits;
    for (const Gate& gate : gates_) limits += fmt::format("{} {}\n", gate.metric, gate.limit);
    run_or_reuse_step("evaluate", inputs, format_plot_setting() + limits, [&] {
      const auto check = session_.accuracy_check_folder();
      if (check) truth = find_truth_file(*check);
      Work work = truth ? evaluate_check(*truth, inputs, gates) : Work();
      if (!truth) {
        work.result.notes.emplace_back(check
                                           ? "no errors and no report: check has neither truth.csv "
                                             "nor positions in captures.csv"
                                           : "no errors and no report: there is no check");
      }
      if (!session_.dispersion_folder()) {
        work.result.notes.emplace_back(
            "no dispersion offset: the session has no folder dispersion");
      }
      return work;
    });
  }

  Work evaluate_check(const fs::path& truth, const std::vector<fs::path>& inputs,
                      const std::vector<Gate>& gates) {
    auto input = std::make_shared<EvaluationInput>();
    input->fixes = {output_file_path("check-fixes.csv"),
                    read_fixes(output_file_path("check-fixes.csv"))};
    input->truth = {truth, read_truth_positions(truth.parent_path())};
    input->reference_point_radius_m = compute_same_position_radius_m(*result_.calibration);
    input->threads = options_.frontend.threads;
    EvaluateResult found = evaluate_with_truth(*input, gates);
    std::vector<Drive> drives;
    for (const fs::path& line : line_drive_folders()) {
      const fs::path places = *find_truth_file(line), fixes = fixes_file_path(line);
      drives.push_back(
          {{fixes, read_fixes(fixes)}, read_end_points(places, read_truth_positions(line))});
      if (fit_line_to_fixes(drives.back().fixes.rows, drives.back().commanded_m)) continue;
      throw InputError(fixes, "no line can be fitted to its fixes: they have no direction");
    }
    if (!found.has_succeeded()) return {found};
    std::vector<CaptureError> errors;
    for (const FixError& error : compute_fix_errors(*input, input->fixes).errors) {
      const FixRow& row = input->fixes.rows[error.fix];
      constexpr int min_lamps =
          3;  // fixes of two lamps may have large errors at the edge of a room
      if (row.lamps < min_lamps) continue;
      errors.push_back({row.image, error.horizontal_m.norm(), error.fix});
    }
    if (std::string outliers = describe_error_outliers(errors); !outliers.empty()) {
      found.warnings.push_back(std::move(outliers));
    }
    add_warnings_metric(found);
    found.gates = check_step_gates("evaluate", found.metrics);
    return {found, [=, this] {
              write_file(output_file_path("evaluation.json"),
                         format_evaluation(found.evaluation, found.gates));
              if (!options_.report) return;
              Report page;
              page.gates = result_.gates;
              page.gates.insert(page.gates.end(), found.gates.begin(), found.gates.end());
              page.calibration = result_.calibration;
              for (const char* plot : kPlots) {
                if (fs::exists(output_file_path(plot)))
                  page.plots.push_back(read_report_plot(output_file_path(plot)));
              }
              page.evaluation = make_step_history("", inputs);
              write_file(output_file_path("report.html"),
                         render_evaluation_html({*input, found, read_lamps(), drives, page}));
            }};
  }

  /// Sets the verdict, removes outputs of later steps if the run failed, and writes the summaries.
  void finish_session() {
    const SessionStep& last = result_.steps.back();
    if (!last.result.has_succeeded()) {
      result_.verdict = Verdict::invalid;
      result_.failure = last.result.failure;
      result_.reason = last.name + ": " + last.result.message;
      results_.remove_later_outputs(last.name);
    }
    const std::string missed = describe_failed_gates(result_.gates);
    if (!missed.empty() && last.result.has_succeeded()) {
      result_.verdict = Verdict::fail;
      result_.reason = missed;
    }
    results_.publish_outputs();
    write_summaries(results_, result_, options_);
  }

  const SessionFolder& session_;
  SessionResults& results_;
  const SessionOptions& options_;
  const SessionObserver& observer_;
  std::string build_;
  std::vector<Gate> gates_;
  InputDigests digests_;
  SessionResult result_;
};

}  // namespace

std::vector<Gate> make_step_gates(const std::vector<Metric>& metrics) {
  constexpr double max_reference_error_mm = 5;
  const auto exceeds_reference_error = [&](const char* error) {
    return find_metric_value(metrics, error).value_or(max_reference_error_mm) >=
           max_reference_error_mm;
  };
  std::vector<Gate> gates{{"row_time_error_percent", 100 * kLampDrift},
                          {"dispersion_offset_px", 3}};
  if (exceeds_reference_error("rms_mm")) gates.push_back({"normalized_error_rms", 5});
  if (exceeds_reference_error("height_rms_mm")) {
    gates.push_back({"normalized_height_error_rms", 10});
  }
  constexpr double max_yaw_error_deg = 5;  // of a heading that is set by hand
  if (find_metric_value(metrics, "yaw_rms_deg").value_or(max_yaw_error_deg) >= max_yaw_error_deg) {
    gates.push_back({"normalized_yaw_error_rms", 10});
  }
  std::erase_if(gates, [&](const Gate& gate) { return !find_metric_value(metrics, gate.metric); });
  return gates;
}

std::vector<MetricKind> list_session_metrics() {
  return list_metric_kinds({MetricSource::lens, MetricSource::rotation, MetricSource::dispersion,
                            MetricSource::evaluation});
}

SessionResult run_session(const fs::path& session, const fs::path& results,
                          const SessionOptions& options, const SessionObserver& observer) {
  if (!options.gates_file.empty()) read_gates(options.gates_file, list_session_metrics());
  if (!fs::is_directory(session)) throw InputError(session, "is not a folder of captures");
  if (is_session_folder(session, results)) {
    throw InputError(results, "contains captures: choose another folder for the results");
  }
  SessionResults session_results(results, session);
  std::optional<SessionFolder> folder;
  std::vector<Gate> gates;
  try {
    folder.emplace(session);
    gates = read_session_gates(*folder, options);
  } catch (const InputError& error) {
    SessionResult result;
    result.verdict = Verdict::invalid;
    result.failure = StepFailure::bad_input;
    result.reason = remove_folder(error.what(), session);
    if (folder) {
      session_results.remove_evaluation();  // other results remain valid
    } else {
      session_results.remove_all_outputs();
    }
    write_summaries(session_results, result, options);
    return result;
  }
  return SessionRun(*folder, std::move(gates), session_results, options, observer).run();
}

}  // namespace vlp
