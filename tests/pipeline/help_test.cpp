// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// --help: every program has one that fits a terminal, and its example works as typed. Its manual
/// page and what the shells complete say the same.
#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "program/steps/step_outcome.h"
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

std::vector<std::string> split_lines(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The names on the left below "Subcommands:".
std::vector<std::string> subcommands_in(const std::string& help) {
  std::vector<std::string> commands;
  bool below = false;
  for (const std::string& line : split_lines(help)) {
    if (!line.starts_with(' ')) below = line == "Subcommands:" || line == "SUBCOMMANDS:";
    const bool name = below && line.starts_with("  ") && line.size() > 2 && line[2] != ' ';
    if (name) commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return commands;
}

class Help : public testing::TestWithParam<const char*> {};

TEST_P(Help, ExampleInHelpRunsAsTyped) {
  const std::string program = GetParam();
  const std::string example = example_in(run_program(program + " --help").output);
  ASSERT_THAT(example, HasSubstr("build/bin/" + program));
  // From a copy of the project's folder: the example writes where it stands.
  const TemporaryFolder folder;
  std::filesystem::create_directory_symlink(VLP_SOURCE_DIR "/datasets", folder / "datasets");
  std::filesystem::create_directories(folder / "build");
  std::filesystem::create_directory_symlink(VLP_PROGRAMS_DIR, folder / "build/bin");
  const auto result = run_program("cd '" + (folder / "").string() + "' && " + example);
  EXPECT_EQ(result.exit_code, 0) << example << result.errors;
}

/// Returns the --help of a program, with an empty name, and of its commands, each run once.
const std::map<std::string, std::string>& read_help(const std::string& program) {
  static std::map<std::string, std::map<std::string, std::string>> read;
  auto& help = read[program];
  if (!help.empty()) return help;
  help[""] = run_program(program + " --help").output;
  for (const std::string& command : subcommands_in(help[""])) {
    help[command] = run_program(program + " " + command + " --help").output;
  }
  return help;
}

TEST_P(Help, LinesFitIn80Columns) {
  const std::string program = GetParam();
  const auto& help = read_help(program);
  EXPECT_EQ(help.size() == 1, program != "vlp-station");
  for (const auto& [command, text] : help) {
    EXPECT_THAT(text, HasSubstr("--help")) << command;
    for (const std::string& line : split_lines(text)) {
      EXPECT_LE(line.size(), 80U) << command << ": " << line;
    }
  }
  EXPECT_THAT(run_program(program + " --version").output, HasSubstr(program + " 0."));
}

/// The codecs of images and the board modules of OpenCV are loaded at the first image and board.
TEST_P(Help, ProgramLinksNoImageCodecsOrBoardModules) {
  const auto libraries =
      run_program(std::string("ldd " VLP_PROGRAMS_DIR "/") + GetParam() + " | sort");
  ASSERT_EQ(libraries.exit_code, 0) << libraries.errors;
  EXPECT_THAT(libraries.output, HasSubstr("libc.so"));
  for (const char* library : {"libopencv_imgcodecs", "libopencv_videoio", "libgdal", "libavcodec",
                              "libopencv_calib3d", "libopencv_aruco", "libopencv_objdetect"}) {
    EXPECT_THAT(libraries.output, testing::Not(HasSubstr(library)));
  }
}

/// "-o", "--output" from lines of --help that begin with an option.
std::vector<std::string> options_in(const std::string& help) {
  const std::regex name("(--?[a-z][a-z0-9-]*)[,{ ]?");
  std::vector<std::string> options;
  for (const std::string& line : split_lines(help)) {
    if (!line.starts_with("  -")) continue;
    const std::string names = line.substr(2, line.find(' ', 2) - 2);
    for (std::sregex_iterator at(names.begin(), names.end(), name), end; at != end; ++at) {
      options.push_back((*at)[1]);
    }
  }
  return options;
}

/// Returns the completions of bash for the last of these words.
std::vector<std::string> completed(const std::string& program, const std::string& words) {
  std::string function = "_" + program;
  std::replace(function.begin(), function.end(), '-', '_');
  const auto offered =
      run_program("bash -c 'source <(" + program + " --reference bash); COMP_WORDS=(" + program +
                  " " + words + "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); " + function +
                  "; printf \"%s\\n\" \"${COMPREPLY[@]}\"'");
  EXPECT_EQ(offered.errors, "");
  return split_lines(offered.output);
}

TEST_P(Help, ManualPageAndBashCompletionHaveAllOptions) {
  const std::string program = GetParam();
  const auto page = run_program(program + " --reference man | sed 's/\\\\-/-/g'");
  ASSERT_EQ(page.exit_code, 0) << page.errors;
  EXPECT_THAT(page.output, HasSubstr(".TH " + program + " 1"));
  EXPECT_THAT(page.output, HasSubstr(".SH NAME\n" + program + " - "));
  EXPECT_THAT(page.output, testing::Not(HasSubstr("build/bin")));
  for (const auto& [command, help] : read_help(program)) {
    if (!command.empty()) {
      EXPECT_THAT(page.output, HasSubstr(".SH COMMAND " + command + "\n"));
    }
    const auto options = options_in(help);
    EXPECT_GE(options.size(), 2U) << command;
    for (const std::string& option : options) EXPECT_THAT(page.output, HasSubstr(option));
  }
  const auto offered = completed(program, "-");
  for (const std::string& option : options_in(read_help(program).at(""))) {
    EXPECT_THAT(offered, testing::Contains(option));
  }
  const TemporaryFolder folder;
  const std::string file = "'" + (folder / "completion.zsh").string() + "'";
  const auto checked =
      run_program("command -v groff >/dev/null && " + program +
                  " --reference man | groff -man -Tutf8 -ww >/dev/null; command -v "
                  "zsh >/dev/null && " +
                  program + " --reference zsh >" + file + " && zsh -n " + file);
  EXPECT_EQ(checked.errors, "");
}

TEST(BashCompletion, CompletesChoicesCommandsAndFiles) {
  EXPECT_THAT(completed("vlp-locate", "--correction \"\""),
              testing::ElementsAre("none", "rotation", "dispersion", "all"));
  EXPECT_THAT(completed("vlp-board", "--family tag36"), testing::ElementsAre("tag36h11"));
  EXPECT_THAT(completed("vlp-station", "tr"), testing::ElementsAre("trend"));
  EXPECT_THAT(completed("vlp-station", "run --cam"), testing::ElementsAre("--camera-id"));
  const TemporaryFolder folder;
  folder.file("lamps.yaml", "");
  const std::string begin = (folder / "lam").string();
  EXPECT_THAT(completed("vlp-locate", "--lamps " + begin),
              testing::ElementsAre((folder / "lamps.yaml").string()));
  EXPECT_THAT(completed("vlp-locate", begin), testing::SizeIs(1));
  EXPECT_THAT(completed("vlp-locate", "--sigma-px " + begin), testing::ElementsAre(""));
}

/// An option that was renamed would be recorded.
TEST(ListOmittedOptions, ReturnsOnlyOptionsThatExistInHelp) {
  std::vector<std::string> options;
  for (const char* program : {"vlp-adjust", "vlp-convert", "vlp-dispersion", "vlp-evaluate",
                              "vlp-intrinsics", "vlp-rotation", "vlp-train"}) {
    const auto more = options_in(read_help(program).at(""));
    options.insert(options.end(), more.begin(), more.end());
  }
  for (const std::string_view option : list_omitted_options()) {
    EXPECT_THAT(options, testing::Contains(option));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Programs, Help,
    testing::Values("vlp-adjust", "vlp-board", "vlp-calibrate", "vlp-convert", "vlp-detect",
                    "vlp-dispersion", "vlp-evaluate", "vlp-intrinsics", "vlp-limits", "vlp-locate",
                    "vlp-rotation", "vlp-simulate", "vlp-station", "vlp-train"),
    [](const auto& instance) { return std::string(instance.param).substr(4); });

}  // namespace
}  // namespace vlp
