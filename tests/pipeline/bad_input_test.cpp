// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Bad input to a program: one line that names file, line and key or column; exit code 2; nothing
/// written. What each reader refuses is tested beside it; this is the way through the program.
#include <gmock/gmock.h>

#include <algorithm>
#include <vector>

#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

struct Bad {
  std::string name;     // of the test
  std::string file;     // of the example that is replaced
  std::string find;     // in that file; the first one is replaced ...
  std::string replace;  // ... by this
  std::string message;
};

void PrintTo(const Bad& bad, std::ostream* out) { *out << bad.name; }

class BadInputFile : public testing::TestWithParam<Bad> {};

TEST_P(BadInputFile, IsReportedByVlpLocateInOneLineWithoutOutput) {
  const TemporaryFolder folder;
  for (const std::string name : {"lamps.yaml", "calibration.yaml", "detections.csv"}) {
    std::string content = TemporaryFolder::read_content(kExample + name);
    if (name == GetParam().file) {
      const auto at = content.find(GetParam().find);
      ASSERT_NE(at, std::string::npos);
      content.replace(at, GetParam().find.size(), GetParam().replace);
    }
    folder.file(name, content);
  }
  const auto path = [&](const char* name) { return (folder / name).string() + " "; };
  const std::string command = "vlp-locate " + path("detections.csv") + "--lamps " +
                              path("lamps.yaml") + "--calibration " + path("calibration.yaml") +
                              "-o ";
  const auto old = folder.file("old.csv", "old\n");
  for (const auto& output : {old, folder / "new.csv"}) {
    const auto result = run_program(command + output.string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors, HasSubstr(GetParam().file));
    EXPECT_THAT(result.errors, HasSubstr(GetParam().message));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_EQ(result.output, "");
  }
  EXPECT_EQ(TemporaryFolder::read_content(old), "old\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "new.csv"));
}

INSTANTIATE_TEST_SUITE_P(
    Files, BadInputFile,
    testing::Values(
        Bad{"MissingKey", "lamps.yaml", "position_m: [-0.6, -0.35, 1.6], ", "", ":3: lamps[0]: "},
        Bad{"UnknownKey", "lamps.yaml", "diameter_m", "diameter_mm", ":3: lamps[0]: "},
        Bad{"WrongUnit", "lamps.yaml", "1.6]", "1600]", ":3: lamps[0].position_m[2]: 1600 m"},
        Bad{"DuplicateLamp", "lamps.yaml", "id: 2", "id: 1", ":4: lamps[1]: "},
        Bad{"NotANumber", "calibration.yaml", "520,", ".nan,", "camera.intrinsics[0]: "},
        Bad{"LensModel", "calibration.yaml", "OPENCV8", "OPENCV5", "camera.intrinsics: "},
        Bad{"Truncated", "calibration.yaml", "\nrotation_center", "", ""},
        Bad{"Binary", "lamps.yaml", "format", std::string("\0\1\2", 3), ":1: "},
        Bad{"MissingColumn", "detections.csv", "u_px", "u", ":1: u_px: "},
        Bad{"BadField", "detections.csv", "spot_00.png,2,", "spot_00.png,two,", ":3: lamp: "},
        Bad{"OpenQuote", "detections.csv", "spot_00.png,2,", "\"spot_00.png,2,", ":3: "},
        Bad{"RowCutShort", "detections.csv", "spot_00.png,2,", "spot_00.png,", ":3: "},
        Bad{"CarriageReturnInAField", "detections.csv", "spot_00.png,2,", "spot_00\r.png,2,",
            ":3: "}),
    [](const auto& instance) { return instance.param.name; });

TEST(VlpLocateInput, ErrorNamesMissingFile) {
  const auto result =
      run_program("vlp-locate no.csv --lamps no.yaml --calibration no.yaml -o a.csv");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("no.yaml: cannot be opened: No such file or directory"));
}

TEST(VlpLocateOutput, ErrorNamesOutputFileThatCannotBeWritten) {
  const auto result = run_program("vlp-locate " + kExample + "detections.csv --lamps " + kExample +
                                  "lamps.yaml --calibration " + kExample +
                                  "calibration.yaml -o /no/such/folder/fixes.csv");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("/no/such/folder/fixes.csv: cannot be written"));
}

TEST(VlpLocateUsage, ReportsErrorInOneLineThatPointsToHelp) {
  for (const std::string options : {"", "--nonsense", "a b c", "--correction some"}) {
    const auto result = run_program("vlp-locate " + options);
    EXPECT_EQ(result.exit_code, 2) << options;
    EXPECT_THAT(result.errors, HasSubstr("see vlp-locate --help"));
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
  EXPECT_THAT(run_program("vlp-locate --nonsense").errors, HasSubstr("unknown: --nonsense; see"));
}

/// Command line with all required arguments but one.
struct MissingArgument {
  std::string command;
  std::string argument;
};

TEST(ProgramUsage, ErrorNamesMissingRequiredArgumentInOneLine) {
  for (const auto& [command, argument] : std::vector<MissingArgument>{
           {"vlp-adjust --calibration c -o o", "--lamps"},
           {"vlp-adjust --lamps l -o o", "--calibration"},
           {"vlp-adjust --lamps l --calibration c", "--output"},
           {"vlp-board", "--output"},
           {"vlp-calibrate -o o", "session"},
           {"vlp-calibrate s", "--output"},
           {"vlp-convert -o o", "input"},
           {"vlp-convert i", "--output"},
           {"vlp-detect --lamps l -o o", "images"},
           {"vlp-detect i -o o", "--lamps"},
           {"vlp-detect i --lamps l", "--output"},
           {"vlp-dispersion --lamps l --calibration c -o o", "images"},
           {"vlp-dispersion i --calibration c -o o", "--lamps"},
           {"vlp-dispersion i --lamps l -o o", "--calibration"},
           {"vlp-dispersion i --lamps l --calibration c", "--output"},
           {"vlp-evaluate --truth t", "fixes"},
           {"vlp-intrinsics --board b -o o", "images"},
           {"vlp-intrinsics i -o o", "--board"},
           {"vlp-intrinsics i --board b", "--output"},
           {"vlp-limits --calibration c --height-m 0 --noise-px 1", "--lamps"},
           {"vlp-limits --lamps l --height-m 0 --noise-px 1", "--calibration"},
           {"vlp-limits --lamps l --calibration c --noise-px 1", "--height-m"},
           {"vlp-limits --lamps l --calibration c --height-m 0", "--noise-px"},
           {"vlp-locate --lamps l --calibration c -o o", "images"},
           {"vlp-locate i --calibration c -o o", "--lamps"},
           {"vlp-locate i --lamps l -o o", "--calibration"},
           {"vlp-locate i --lamps l --calibration c", "--output"},
           {"vlp-rotation --lamps l --calibration c -o o", "images"},
           {"vlp-rotation i --calibration c -o o", "--lamps"},
           {"vlp-rotation i --lamps l -o o", "--calibration"},
           {"vlp-rotation i --lamps l --calibration c", "--output"},
           {"vlp-simulate -o o", "scene"},
           {"vlp-simulate s", "--output"},
           {"vlp-station run", "--station"},
           {"vlp-station verify", "--station"},
           {"vlp-station hook", "--station"},
           {"vlp-station restore", "run"},
           {"vlp-station certificate", "run"},
           {"vlp-station clean", "--station"},
           {"vlp-station void --operator o --reason r", "run"},
           {"vlp-station void 1 --reason r", "--operator"},
           {"vlp-station void 1 --operator o", "--reason"},
           {"vlp-station export", "--output"},
           {"vlp-station import --records r.db", "results"},
           {"vlp-station import r", "--records"},
           {"vlp-station trend", "metric"},
           {"vlp-station study", "metric"},
           {"vlp-train --lamps l", "folders"},
           {"vlp-train f", "--lamps"}}) {
    const auto result = run_program(command);
    const std::string program = command.substr(0, command.find(' '));
    EXPECT_EQ(result.exit_code, 2) << command;
    EXPECT_EQ(result.output, "") << command;
    EXPECT_EQ(result.errors,
              program + ": error: " + argument + " is required; see " + program + " --help\n")
        << command;
  }
}

}  // namespace
}  // namespace vlp
