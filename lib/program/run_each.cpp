// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/run_each.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "program/app.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

constexpr unsigned kMaxLimit_s = 86400;

struct Request {
  std::vector<std::string> arguments;
  unsigned limit_s;
};

Request parse_request(const std::string& line) {
  constexpr std::size_t max_bytes = 300;  // in the message
  try {
    const auto json = nlohmann::json::parse(line);
    const auto& limit_s = json.at("limit_s");
    if (limit_s.is_number_unsigned() && limit_s >= 1U && limit_s <= kMaxLimit_s) {
      return {json.at("arguments").get<std::vector<std::string>>(), limit_s.get<unsigned>()};
    }
  } catch (const nlohmann::json::exception&) {  // reported below
  }
  throw std::invalid_argument(
      "stdin: a line is not {\"arguments\": [\"...\"], \"limit_s\": 1 to 86400}: " +
      truncate_text(line, max_bytes));
}

/// Runs the program in the forked process, with stdout and stderr redirected to `output`.
[[noreturn]] void run_in_child(const char* name, Request request, std::FILE* output, pid_t parent,
                               const std::function<int(int, char**)>& program) {
  // The process ends with its parent: an orphan could write to the files of its successor.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) std::_Exit(kBadInput);
  // freopen() would also reset the read position of stdin of the parent.
  const int nothing = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const bool ready = ::dup2(nothing, STDIN_FILENO) >= 0 &&
                     ::dup2(::fileno(output), STDOUT_FILENO) >= 0 &&
                     ::dup2(::fileno(output), STDERR_FILENO) >= 0;
  if (!ready) std::_Exit(kBadInput);
  ::alarm(request.limit_s);
  request.arguments.insert(request.arguments.begin(), name);
  std::vector<char*> argv;
  for (std::string& argument : request.arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int code = program(static_cast<int>(request.arguments.size()), argv.data());
  std::fflush(nullptr);
  std::_Exit(code);
}

std::string read_end_of_file(std::FILE* output) {
  constexpr long max_bytes = 4096;
  std::fseek(output, 0, SEEK_END);
  std::fseek(output, std::max(0L, std::ftell(output) - max_bytes), SEEK_SET);
  std::string text(max_bytes, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), output));
  return text;
}

double to_seconds(const timeval& time) {
  constexpr double microsecond = 1e-6;
  return static_cast<double>(time.tv_sec) + microsecond * static_cast<double>(time.tv_usec);
}

std::string run_request(const char* name, const Request& request,
                        const std::function<int(int, char**)>& program) {
  const int memory = ::memfd_create("output", MFD_CLOEXEC);
  const File output(memory < 0 ? nullptr : ::fdopen(memory, "w+"), &std::fclose);
  if (!output) throw std::runtime_error("there is not enough memory for the output of a process");
  const pid_t parent = ::getpid(), process = ::fork();
  // [STATION-10]
  if (process < 0) throw std::runtime_error("a process cannot be started");
  if (process == 0) run_in_child(name, request, output.get(), parent, program);
  int status = 0;
  rusage used{};
  while (::wait4(process, &status, 0, &used) < 0) {
    if (errno != EINTR) throw std::runtime_error("the exit code of a process is not available");
  }
  const nlohmann::json answer{
      {"exit_code", WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status)},
      {"cpu_s", to_seconds(used.ru_utime) + to_seconds(used.ru_stime)},
      {"output", read_end_of_file(output.get())}};
  return answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void run_each_line(const char* name, const std::function<int(int argc, char** argv)>& program) {
  std::string line;
  while (std::getline(std::cin, line)) {
    fmt::print("{}\n", run_request(name, parse_request(line), program));
    if (std::fflush(stdout) != 0) break;  // which parse_and_run() reports
  }
}

}  // namespace vlp
