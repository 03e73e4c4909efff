// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <utility>

#include "captures/digest.h"
#include "report/plots/gnuplot.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "session/session_file.h"
#include "session/session_gates.h"
#include "session/session_results.h"
#include "session/session_steps.h"

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

/// Writes the summaries, session.json last: without it the results are those of a killed run.
void write_summaries(const SessionResults& results, const SessionResult& result,
                     const SessionOptions& options) {
  write_file(results.results_file_path("junit.xml"), format_session_junit(result));
  write_file(results.results_file_path("session.json"), format_session(result, options));
}

class SessionRun {
 public:
  explicit SessionRun(SessionState state)
      : build_(describe_build(state.options.program)), state_(std::move(state)) {}

  SessionResult run() {
    const std::vector<SessionStepPlan> steps = plan_session_steps(state_);
    check_redo_option(steps);
    state_.results.set_steps(list_outputs(steps));
    for (const SessionStepPlan& step : steps) {
      if (!is_step_needed(state_, step)) {
        skip_step(step);
      } else if (!run_or_reuse_step(step)) {
        break;
      }
    }
    finish_session();
    return std::move(state_.result);
  }

 private:
  std::vector<StepOutputs> list_outputs(const std::vector<SessionStepPlan>& steps) const {
    std::vector<StepOutputs> outputs;
    for (const SessionStepPlan& step : steps) {
      outputs.push_back({step.name, step.files});
      if (!step.calibration.empty()) outputs.back().files.push_back(step.calibration);
      if (!step.plot.empty() && state_.options.report) outputs.back().files.push_back(step.plot);
    }
    return outputs;
  }

  void check_redo_option(const std::vector<SessionStepPlan>& steps) const {
    for (const std::string& name : state_.options.steps_to_redo) {
      if (std::ranges::find(steps, name, &SessionStepPlan::name) != steps.end()) continue;
      std::vector<std::string> names;
      names.reserve(steps.size());
      for (const SessionStepPlan& step : steps) names.push_back(step.name);
      throw std::invalid_argument(
          fmt::format("no step {}; the steps are: {}", name, fmt::join(names, ", ")));
    }
  }

  bool is_redo_requested(const std::string& step) const {
    return std::ranges::find(state_.options.steps_to_redo, step) !=
           state_.options.steps_to_redo.end();
  }

  void skip_step(const SessionStepPlan& step) {
    state_.results.remove_outputs(step.name);
    if (step.name == "dispersion") {
      write_calibration(state_.output_file(step.calibration), *state_.result.calibration);
      state_.calibration_file = state_.output_file(step.calibration);
      // Gates of the dispersion fail: their metrics have no value.
      append_gates(check_gates(select_step_gates(state_.gates, step.name), {}));
    } else if (is_redo_requested(step.name)) {
      throw std::invalid_argument(
          "there is no step row-time in this session, as the row time is known or there is a "
          "classifier; leave it out of --redo");
    }
  }

  std::string remove_folder(std::string text) const {
    for (const fs::path& folder :
         {state_.session.path(), state_.results.new_outputs_folder(), state_.results.path()}) {
      text = vlp::remove_folder(std::move(text), folder);
    }
    return text;
  }

  std::string compute_step_key(const std::vector<fs::path>& inputs, const std::string& options) {
    std::string text = build_ + "\n" + options + "\n" + state_.options.frontend.room + "\n";
    for (const fs::path& input : inputs) {
      if (input.empty()) continue;
      text += input.filename().string() + " ";
      try {
        text += fs::is_directory(input) ? state_.digests.digest_folder(input) : hash_file(input);
      } catch (const InputError&) {
        text += "cannot be read";
      }
      text += "\n";
    }
    return hash_text(text);
  }

  /// Runs a step unless inputs, options, program and outputs are unchanged since it last ended.
  /// Returns false if the step failed.
  bool run_or_reuse_step(const SessionStepPlan& step) {
    if (state_.observer.on_step_started) state_.observer.on_step_started(step.name);
    const StepInputs inputs = step.list_inputs(state_, step);
    const std::string key = compute_step_key(inputs.files, inputs.options);
    SessionStep done{step.name, false, {}};
    if (auto cached_result = state_.results.find_cached(step.name, key);
        cached_result && !is_redo_requested(step.name)) {
      done.is_up_to_date = true;
      done.result = std::move(*cached_result);
    } else {
      state_.results.remove_outputs(step.name);
      done.result = run_step(step, inputs.files);
      state_.results.store_step_result(step.name, key, done.result);
    }
    if (done.result.has_succeeded()) {
      if (step.name == "evaluate") state_.add_warnings_metric(done.result);
      done.result.gates = state_.check_step_gates(step.name, done.result.metrics);
      if (!step.calibration.empty()) state_.calibration_file = state_.output_file(step.calibration);
      state_.result.calibration = read_calibration(state_.calibration_file);
    }
    append_gates(done.result.gates);
    state_.result.steps.push_back(std::move(done));
    if (state_.observer.on_step_finished)
      state_.observer.on_step_finished(state_.result.steps.back());
    return state_.result.steps.back().result.has_succeeded();
  }

  void append_gates(const std::vector<CheckedMetric>& gates) {
    state_.result.gates.insert(state_.result.gates.end(), gates.begin(), gates.end());
  }

  /// Runs the work of a step and writes its outputs. A bad input becomes the failure bad_input;
  /// errors of writing are thrown.
  StepResult run_step(const SessionStepPlan& step, const std::vector<fs::path>& inputs) {
    StepWork done;
    try {
      done = step.solve(state_, step, inputs);
      if (!done.result.has_succeeded()) add_readout_remark(state_, done.result);
    } catch (const InputError& error) {
      done.result.set_step_failure(StepFailure::bad_input, error.what());
    } catch (const std::invalid_argument& error) {
      done.result.set_step_failure(StepFailure::bad_input, error.what());
    }
    StepResult& result = done.result;
    result.set_step_failure(result.failure, remove_folder(format_failure_message(result)));
    for (std::string& warning : result.warnings) warning = remove_folder(std::move(warning));
    for (auto& [image, reason] : result.skipped) reason = remove_folder(std::move(reason));
    if (!result.has_succeeded()) return std::move(result);
    done.write();
    if (!step.plot.empty() && state_.options.report && result.drawing)
      write_plot(state_.output_file(step.plot), result.drawing());
    if (!step.calibration.empty())
      write_calibration(state_.output_file(step.calibration), result.calibration);
    return std::move(result);
  }

  /// Sets the verdict, removes outputs of later steps if the run failed, and writes the summaries.
  void finish_session() {
    const SessionStep& last = state_.result.steps.back();
    if (!last.result.has_succeeded()) {
      state_.result.verdict = Verdict::invalid;
      state_.result.failure = last.result.failure;
      state_.result.reason = last.name + ": " + last.result.message;
      state_.results.remove_later_outputs(last.name);
    }
    const std::string missed = describe_failed_gates(state_.result.gates);
    if (!missed.empty() && last.result.has_succeeded()) {
      state_.result.verdict = Verdict::fail;
      state_.result.reason = missed;
    }
    state_.results.publish_outputs();
    write_summaries(state_.results, state_.result, state_.options);
  }

  std::string build_;
  SessionState state_;
};

}  // namespace

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
  return SessionRun({*folder, session_results, options, observer, std::move(gates),
                     folder->camera_calibration_path().value_or("")})
      .run();
}

}  // namespace vlp
