// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/app.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <system_error>

#include <CLI/CLI.hpp>

#include "rig/input_error.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// Returns the exit code of a program that executes `run`, and its stderr.
std::pair<int, std::string> run_and_capture(const std::function<void()>& run) {
  std::string name = "vlp-something";
  char* argv[] = {name.data(), nullptr};
  CLI::App app("Something", name);
  testing::internal::CaptureStderr();
  const int code = parse_and_run(app, 1, argv, run);
  return {code, testing::internal::GetCapturedStderr()};
}

TEST(ParseAndRun, ReturnsExitCodeOfThrownException) {
  EXPECT_EQ(run_and_capture([] {}).first, kDone);
  EXPECT_EQ(run_and_capture([] { throw GateNotMet("mean_mm"); }).first, kGateNotMet);
  EXPECT_EQ(run_and_capture([] { throw InputError("lamps.yaml", "is empty"); }).first, kBadInput);
  EXPECT_EQ(run_and_capture([] { throw std::invalid_argument("no such lens"); }).first, kBadInput);
  EXPECT_EQ(run_and_capture([] { throw Undetermined("add lamps"); }).first, kUndetermined);
}

TEST(ParseAndRun, PrintsErrorInOneLineWithoutControlCharacters) {
  const std::string said =
      run_and_capture([] { throw Undetermined("lamp \x1b[2J is dark"); }).second;
  EXPECT_THAT(said, HasSubstr("vlp-something: error: lamp "));
  EXPECT_EQ(said.find('\x1b'), std::string::npos);
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1);
}

TEST(ParseAndRun, NamesPathThatFileSystemRefuses) {
  const auto refused = std::make_error_code(std::errc::permission_denied);
  const auto [code, said] = run_and_capture(
      [&] { throw std::filesystem::filesystem_error("status", "check/captures.csv", refused); });
  EXPECT_EQ(code, kBadInput);
  EXPECT_THAT(said, HasSubstr("error: check/captures.csv: Permission denied"));
}

/// Runs a program whose stdout is full. Returns its exit code and messages.
std::pair<int, std::string> end_with_full_stdout(const std::function<void()>& run) {
  const int kept = ::dup(STDOUT_FILENO), full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  std::fflush(stdout);
  ::dup2(full, STDOUT_FILENO);
  const auto end = run_and_capture([&] {
    std::fputs("figures\n", stdout);
    run();
  });
  std::clearerr(stdout);
  ::dup2(kept, STDOUT_FILENO);
  ::close(kept);
  ::close(full);
  return end;
}

TEST(ParseAndRun, ReturnsBadInputWhenStdoutCannotBeWritten) {
  for (const std::function<void()>& run : std::vector<std::function<void()>>{
           [] {}, [] { throw GateNotMet("mean_mm"); }, [] { throw Undetermined("add lamps"); }}) {
    const auto [code, said] = end_with_full_stdout(run);
    EXPECT_EQ(code, kBadInput);
    EXPECT_THAT(said, HasSubstr("stdout cannot be written"));
  }
}

TEST(CheckOutputIsNoInput, RejectsOutputThatIsAlsoInput) {
  const TemporaryFolder folder;
  const std::string lamps = folder.file("lamps.yaml", "x").string();
  const std::string again = (folder / ".").string() + "/lamps.yaml";
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] {
                check_output_is_no_input(again, {"", lamps});
              }),
              HasSubstr("is also an input"));
  check_output_is_no_input((folder / "other.yaml").string(), {lamps});
}

TEST(CheckOutputsDistinct, RejectsTwoOptionsWithSameFile) {
  const TemporaryFolder folder;
  const std::string file = (folder / "a").string(), same = (folder / "b/../a").string();
  check_outputs_distinct({{"--output", file}, {"--ros", ""}, {"--plot", ""}}, {});
  EXPECT_EQ(rejection_message<std::invalid_argument>([&] {
              check_outputs_distinct({{"--output", file}, {"--ros", ""}, {"--plot", same}}, {});
            }),
            "--output and --plot are the same file; use another name");
}

TEST(OptionValidators, RejectInvalidNumbersAndFileExtensions) {
  EXPECT_EQ(make_finite_validator()("-1e3"), "");
  EXPECT_NE(make_finite_validator()("inf"), "");
  EXPECT_NE(make_finite_validator()("1 m"), "");
  EXPECT_EQ(make_non_negative_validator()("0"), "");
  EXPECT_NE(make_positive_validator()("0"), "");
  EXPECT_EQ(make_plot_file_validator()("a.svg"), "");
  EXPECT_NE(make_plot_file_validator()("a.pdf"), "");
  EXPECT_EQ(make_extension_validator(".csv")("corners.csv"), "");
  EXPECT_EQ(make_extension_validator(".csv")("corners.vnl"), "the file's name should end in .csv");
}

}  // namespace
}  // namespace vlp
