// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/station_run.h"

#include <fmt/core.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <map>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include "captures/printable.h"
#include "program/app.h"
#include "program/station/terminal.h"
#include "rig/input_error.h"
#include "station/records/golden_unit_schedule.h"

namespace vlp {
namespace {

constexpr const char* kQuit = "q";

/// Reads a line in the form in which records store it; std::nullopt at the end of the input.
std::optional<std::string> read_word(const std::string& label, Terminal& terminal) {
  constexpr std::size_t longest = 64;
  const auto line = terminal.read_input_line({{label}});
  return line ? std::optional(escape_for_terminal(truncate_utf8_text(*line, longest)))
              : std::nullopt;
}

/// Reads the names of operator and shift if they are empty. Returns false if the input ended or the
/// operator quit.
bool begin_work_shift(std::string& operator_name, std::string& shift, Terminal& terminal) {
  while (operator_name.empty()) {
    const auto name = read_word("Operator ", terminal);
    if (!name || *name == kQuit) return false;
    operator_name = *name;
  }
  if (!shift.empty()) return true;
  const auto name = read_word("Shift    ", terminal);
  if (name) shift = *name;
  return name.has_value() && shift != kQuit;
}

/// Reads the id of the next unit, or of the golden unit, until it is one that the station accepts.
/// Returns std::nullopt for `q` and at the end of the input.
std::optional<std::string> read_serial(const StationConfig& config, Terminal& terminal) {
  const std::string golden = describe_golden_problem(config);
  std::string problem;
  for (;;) {
    std::vector<ScreenLine> prompt;
    if (!golden.empty()) prompt.push_back({"Station  " + golden, ScreenLineStyle::fail});
    if (!problem.empty()) prompt.push_back({"Wrong    " + problem, ScreenLineStyle::fail});
    prompt.push_back({"Next     scan a unit's serial; q: end"});
    prompt.push_back({"Serial   "});
    auto line = terminal.read_input_line(prompt);
    if (!line || *line == kQuit) return std::nullopt;
    if (line->empty()) continue;
    const bool is_golden = config.golden_unit && *line == config.golden_unit->camera_id;
    problem = is_golden ? "" : describe_serial_problem(config, *line);
    if (problem.empty()) return line;
    // Without a screen, the prompt does not print the problem.
    if (!terminal.is_interactive()) spdlog::error("{}", problem);
  }
}

/// Returns the command line of the process for a unit.
std::vector<std::string> make_command(const StationRunOptions& options, bool golden) {
  std::vector<std::string> command{
      "vlp-station", golden ? "verify" : "run", "--station=" + options.station,
      "--threads=" + std::to_string(options.threads), "--operator=" + options.operator_name};
  if (!options.shift.empty()) command.push_back("--shift=" + options.shift);
  if (spdlog::get_level() == spdlog::level::err) command.emplace_back("--quiet");
  if (spdlog::get_level() == spdlog::level::debug) command.emplace_back("--verbose");
  if (golden) return command;
  command.push_back("--camera-id=" + options.camera_id);
  if (options.idle_s) command.push_back(fmt::format("--idle-s={}", *options.idle_s));
  for (const std::string& source : options.sources) command.push_back("--source=" + source);
  return command;
}

/// Runs this program with these arguments in a new process and returns its exit code. Reports an
/// error and returns kBadInput if the process crashes.
int run_process(const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t process = 0;
  std::signal(SIGCHLD, SIG_DFL);  // if inherited as ignored, waitpid() returns no status
  if (const int error =
          ::posix_spawn(&process, "/proc/self/exe", nullptr, nullptr, arguments.data(), environ)) {
    // [STATION-10] `cannot be started` | interrupted, killed or out of memory (signal 9) | scan the
    //   unit again: it continues
    throw std::runtime_error("the unit's process cannot be started: " +
                             std::generic_category().message(error));
  }
  int status = 0;
  bool is_signaled = false;
  for (;;) {
    const pid_t ended = ::waitpid(process, &status, WNOHANG);
    if (ended == process) break;
    if (ended < 0 && errno != EINTR) {
      spdlog::error("the exit code of the unit's process is unknown: {}",
                    std::generic_category().message(errno));
      return kBadInput;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (was_interrupted() && !is_signaled) is_signaled = ::kill(process, SIGTERM) == 0;
  }
  if (WIFEXITED(status)) return WEXITSTATUS(status);
  // [STATION-10] `ended by signal`
  spdlog::error("the unit's process was ended by signal {}", WTERMSIG(status));
  return kBadInput;
}

}  // namespace

void measure_scanned_units(StationRunOptions options) {
  StationConfig config = read_station_config(options.station);
  Terminal terminal;
  std::map<int, int> exit_counts;  // number of units by exit code
  int units = 0;
  const bool has_begun = begin_work_shift(options.operator_name, options.shift, terminal);
  while (has_begun) {
    try {
      config = read_station_config(options.station);  // as the process of each unit does
    } catch (const InputError&) {                     // the process of the unit reports the error
    }
    const auto serial = read_serial(config, terminal);
    if (!serial) break;
    options.camera_id = *serial;
    const bool golden = config.golden_unit && *serial == config.golden_unit->camera_id;
    const int code = run_process(make_command(options, golden));
    terminal.discard_typed_keys();
    if (!golden) {
      ++units;
      ++exit_counts[code];
    }
    const bool judged = code == kDone || code == kGateNotMet || code == kUndetermined;
    if (was_interrupted() && !judged) {
      // [STATION-10] `left in the middle`
      throw std::runtime_error("the shift was left in the middle of a unit");
    }
  }
  const int judged = exit_counts[kDone] + exit_counts[kGateNotMet] + exit_counts[kUndetermined];
  fmt::print("{} units: {} passed, {} failed, {} invalid{}\n", units, exit_counts[kDone],
             exit_counts[kGateNotMet], exit_counts[kUndetermined],
             judged == units ? "" : fmt::format(", {} with an error", units - judged));
}

}  // namespace vlp
