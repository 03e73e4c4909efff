// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/app.h"

#include <fmt/core.h>
#include <malloc.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>

#include "captures/printable.h"

#include "program/help_formatter.h"
#include "program/reference.h"

namespace vlp {
namespace {

/// Formatter of messages that escapes control characters, which file names may contain.
class PrintableMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    const std::string text = escape_for_line({message.payload.data(), message.payload.size()});
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableMessage>();
  }
};

void log_to_stderr(const std::string& program, bool quiet, bool verbose) {
  auto logger = std::make_shared<spdlog::logger>(
      program, std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableMessage>('*').set_pattern("%n: %^%l%$: %*");
  logger->set_formatter(std::move(formatter));
  logger->set_level(quiet     ? spdlog::level::err
                    : verbose ? spdlog::level::debug
                              : spdlog::level::info);
  spdlog::set_default_logger(logger);
}

CLI::Validator make_number_validator(const std::string& name, bool (*accepts)(double)) {
  return CLI::Validator(
      [name, accepts](const std::string& text) {
        double value = 0;
        const bool is_valid =
            CLI::detail::lexical_cast(text, value) && std::isfinite(value) && accepts(value);
        return is_valid ? std::string() : "'" + text + "' should be a " + name + " number";
      },
      "");
}

CLI::Validator make_ending_validator(const std::vector<std::string>& endings,
                                     const std::string& problem) {
  return CLI::Validator(
      [endings, problem](const std::string& name) {
        const bool is_valid = std::ranges::any_of(
            endings, [&](const std::string& ending) { return name.ends_with(ending); });
        return is_valid ? std::string() : problem;
      },
      "");
}

/// Describes the unknown options of the command line; returns an empty string if there are none.
std::string describe_unknown_options(const CLI::App& app) {
  std::string names;
  for (const std::string& word : app.remaining(true)) {
    if (!word.starts_with("--")) continue;
    names.append(names.empty() ? "unknown: " : ", ").append(word);
  }
  return names;
}

/// Returns an error about an unknown or missing command, with the list of commands; empty if a
/// command was given.
std::string describe_command_problem(const CLI::App& app) {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  if (commands.empty() || !app.get_subcommands().empty()) return "";
  std::string names;
  for (const CLI::App* command : commands) {
    names.append(names.empty() ? "" : ", ").append(command->get_name());
  }
  const std::vector<std::string> words = app.remaining();
  if (words.empty()) return "a command is missing; the commands are: " + names;
  if (words.front().starts_with('-')) return "";
  return "there is no command '" + words.front() + "'; the commands are: " + names;
}

/// Discards everything printed to stdout. The descriptor stays open for `--output /dev/stdout`.
bool discard_stdout() {
  std::FILE* nowhere = std::fopen("/dev/null", "w");
  if (nowhere == nullptr) return false;
  stdout = nowhere;
  return true;
}

/// Returns `exit_code`; reports an error and returns kBadInput if stdout could not be written.
int check_stdout_written(int exit_code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  // [FILE-1]
  spdlog::error("stdout cannot be written");
  return kBadInput;
}

/// Returns true if two outputs, which need not exist, are the same file; false for an empty name.
bool are_same_file(const std::string& one, const std::string& other) {
  const auto canonical_path = [](const std::string& file) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file));
  };
  return !one.empty() && !other.empty() && canonical_path(one) == canonical_path(other);
}

}  // namespace

std::unique_ptr<CLI::App> make_app(const std::string& description, const std::string& name) {
  return std::make_unique<CLI::App>(description, name);
}

int count_cpu_cores() {
  return static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

CLI::Validator make_finite_validator() {
  return make_number_validator("finite", [](double) { return true; });
}
CLI::Validator make_positive_validator() {
  return make_number_validator("finite positive", [](double value) { return value > 0; });
}
CLI::Validator make_non_negative_validator() {
  return make_number_validator("finite and not negative", [](double value) { return value >= 0; });
}

CLI::Validator make_extension_validator(const std::string& ending) {
  return make_ending_validator({ending}, "the file's name should end in " + ending);
}

CLI::Validator make_plot_file_validator() {
  return make_ending_validator({".png", ".svg"}, "a picture's name should end in .png or .svg");
}

void add_threads_option(CLI::App& app, int& threads, const std::string& description) {
  app.add_option("--threads", threads, description + " (default: one per core)")
      ->check(CLI::Range(1, 1024));
}

void check_output_is_no_input(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code missing;
    if (std::filesystem::equivalent(output, input, missing)) {
      throw std::invalid_argument(output + ": is also an input and would be overwritten");
    }
  }
}

void check_outputs_distinct(const std::vector<std::pair<std::string, std::string>>& outputs,
                            const std::vector<std::string>& inputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto& [option, file] = outputs[i];
    check_output_is_no_input(file, inputs);
    for (std::size_t k = 0; k < i; ++k) {
      if (!are_same_file(file, outputs[k].second)) continue;
      throw std::invalid_argument(
          fmt::format("{} and {} are the same file; use another name", outputs[k].first, option));
    }
  }
}

namespace {

/// Keeps freed memory for the next allocation. Solvers allocate and free large matrices in each
/// iteration; the system would clear their pages each time, 10 % of the time of a calibration.
/// Setting one threshold alone would only disable the dynamic thresholds of glibc.
void keep_freed_memory() {
  constexpr int min_mmap_bytes = 32 << 20, max_free_top_bytes = 256 << 20;
  ::mallopt(M_MMAP_THRESHOLD, min_mmap_bytes);
  ::mallopt(M_TRIM_THRESHOLD, max_free_top_bytes);
}

}  // namespace

std::string read_option_value(int argc, char** argv,
                              std::initializer_list<std::string_view> names) {
  for (int i = 1; i < argc; ++i) {
    for (const std::string_view name : names) {
      std::string_view word(argv[i]);
      if (!word.starts_with(name)) continue;
      word.remove_prefix(name.size());
      if (word.empty()) {
        const bool has_value = i + 1 < argc && !std::string_view(argv[i + 1]).starts_with('-');
        return has_value ? argv[i + 1] : "";
      }
      if (word.starts_with('=')) return std::string(word.substr(1));
      if (!name.starts_with("--")) return std::string(word);
    }
  }
  return "";
}

int parse_and_run(CLI::App& app, int argc, char** argv, const std::function<void()>& run,
                  const std::function<void(const std::string&)>& report_bad_usage) {
  keep_freed_memory();
  bool quiet = false, verbose = false;
  const auto formatter = std::make_shared<HelpFormatter>();
  app.formatter(formatter);
  const std::function<bool(CLI::App*)> every = [](CLI::App*) { return true; };
  for (CLI::App* command : app.get_subcommands(every)) command->formatter(formatter);
  auto* quiet_flag =
      app.add_flag("-q,--quiet", quiet, "Print errors only, to stderr, and nothing to stdout");
  app.add_flag("-v,--verbose", verbose, "Print details to stderr")->excludes(quiet_flag);
  app.set_version_flag("--version", app.get_name() + " " + VLP_VERSION);
  log_to_stderr(app.get_name(), false, false);
  std::signal(SIGXFSZ,
              SIG_IGN);  // a write beyond the size limit fails; temporary files are removed
  if (argc == 3 && std::string_view(argv[1]) == "--reference") {
    const std::string text = format_reference(app, argv[2]);
    if (!text.empty()) {  // the parser reports other names
      std::fputs(text.c_str(), stdout);
      return check_stdout_written(kDone);
    }
  }
  try {
    app.parse(argc, argv);
    log_to_stderr(app.get_name(), quiet, verbose);
    if (quiet && !discard_stdout()) return kBadInput;
    run();
    return check_stdout_written(kDone);
  } catch (const CLI::Success& success) {  // --help, --version
    return check_stdout_written(app.exit(success));
  } catch (const CLI::ParseError& error) {
    std::string problem = describe_command_problem(app);
    // A misspelled option is more informative than a missing one.
    if (problem.empty()) problem = describe_unknown_options(app);
    if (problem.empty()) problem = error.what();
    problem += "; see " + app.get_name() + " --help";
    spdlog::error("{}", problem);
    if (report_bad_usage) report_bad_usage(problem);
    return kBadInput;
  } catch (const GateNotMet& error) {
    spdlog::error("{}", error.what());
    return check_stdout_written(kGateNotMet);
  } catch (const Undetermined& error) {
    spdlog::error("{}", error.what());
    return check_stdout_written(kUndetermined);
  } catch (const std::filesystem::filesystem_error& error) {  // such as a folder without permission
    spdlog::error("{}: {}", error.path1().string(), error.code().message());
    return kBadInput;
  } catch (const std::exception& error) {  // includes InputError and std::invalid_argument
    spdlog::error("{}", error.what());
    return kBadInput;
  }
}

}  // namespace vlp
