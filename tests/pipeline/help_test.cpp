// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// --help: every program has one that fits a terminal, and its example works as typed.
#include <gmock/gmock.h>

#include <sstream>
#include <vector>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// The indented lines after "Example", joined where a backslash says so.
std::string example_in(const std::string& help) {
  const auto begin = help.find("\n  ", help.find("Example"));
  const auto end = help.find("\n\n", begin);
  std::string example = help.substr(begin + 1, end - begin - 1);
  for (auto at = example.find("\\\n"); at != std::string::npos; at = example.find("\\\n")) {
    example.replace(at, 2, " ");
  }
  return example;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The names on the left below "Subcommands:".
std::vector<std::string> subcommands_in(const std::string& help) {
  std::vector<std::string> commands;
  bool below = false;
  for (const std::string& line : lines_of(help)) {
    if (!line.starts_with(' ')) below = line == "Subcommands:" || line == "SUBCOMMANDS:";
    const bool name = below && line.starts_with("  ") && line.size() > 2 && line[2] != ' ';
    if (name) commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return commands;
}

class Help : public testing::TestWithParam<const char*> {};

TEST_P(Help, HasAnExampleThatWorksAsTyped) {
  const std::string program = GetParam();
  const auto help = run_program(program + " --help");
  ASSERT_EQ(help.exit_code, 0);
  std::string example = example_in(help.output);
  ASSERT_THAT(example, HasSubstr("build/bin/" + program));
  // From a copy of the project's folder: the example writes where it stands.
  const TemporaryFolder folder;
  std::filesystem::create_directory_symlink(VLP_SOURCE_DIR "/datasets", folder / "datasets");
  std::filesystem::create_directories(folder / "build");
  std::filesystem::create_directory_symlink(VLP_PROGRAMS_DIR, folder / "build/bin");
  const auto result = run_program("cd '" + (folder / "").string() + "' && " + example);
  EXPECT_EQ(result.exit_code, 0) << example << result.errors;
}

TEST_P(Help, FitsIn80Columns) {
  const std::string program = GetParam();
  std::vector<std::string> commands = subcommands_in(run_program(program + " --help").output);
  EXPECT_EQ(commands.empty(), program != "vlp-station");
  commands.emplace_back("");  // the program itself
  for (const std::string& command : commands) {
    const auto help = run_program(program + " " + command + " --help");
    ASSERT_EQ(help.exit_code, 0) << command;
    EXPECT_THAT(help.output, HasSubstr("--help")) << command;
    for (const std::string& line : lines_of(help.output)) {
      EXPECT_LE(line.size(), 80U) << command << ": " << line;
    }
  }
}

TEST_P(Help, NamesTheVersion) {
  const auto result = run_program(std::string(GetParam()) + " --version");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr(std::string(GetParam()) + " 0."));
}

INSTANTIATE_TEST_SUITE_P(
    Programs, Help,
    testing::Values("vlp-adjust", "vlp-board", "vlp-calibrate", "vlp-convert", "vlp-detect",
                    "vlp-dispersion", "vlp-evaluate", "vlp-intrinsics", "vlp-limits", "vlp-locate",
                    "vlp-rotation", "vlp-simulate", "vlp-station", "vlp-train"),
    [](const auto& instance) { return std::string(instance.param).substr(4); });

}  // namespace
}  // namespace vlp
