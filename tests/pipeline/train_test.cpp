// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-train end to end, and what the other programs do with its results.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>

#include "rig/calibration.h"
#include "support/csv_cells.h"
#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string kLamps = " --lamps " + kRig + "/lamps.yaml";
const std::string kCalibration = " --calibration " + kRig + "/true_calibration.yaml";

class VlpTrain : public testing::Test {
 protected:
  /// Three places, turning, of the paper's rig; about 0.3 s.
  std::string captures(const std::string& name = "rotation") {
    const auto result =
        run_program("vlp-simulate " VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml -q --only " +
                    name + " -o " + (folder / "set").string());
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return (folder / "set" / name).string();
  }
  ProgramResult train(const std::string& options) const {
    return run_program("vlp-train " + options + " -o " + output.string());
  }
  fs::path without(const std::string& line) const {
    std::string calibration = TemporaryFolder::read_content(kRig + "/true_calibration.yaml");
    const auto begin = calibration.find(line);
    calibration.erase(begin, calibration.find('\n', begin) + 1 - begin);
    return folder.file("without.yaml", calibration);
  }
  const TemporaryFolder folder;
  const fs::path output = folder / "trained.yaml";
};

TEST_F(VlpTrain, ClassifierIdentifiesAllLampsInVlpDetectAndVlpLocate) {
  const auto trained = train(captures() + kLamps + kCalibration);
  ASSERT_EQ(trained.exit_code, 0) << trained.errors;
  EXPECT_THAT(trained.output, HasSubstr("correct     100.00 %\n  wrong     0\n  unknown   0\n"));
  // On captures that it has not seen, without the map's frequencies and the row time.
  std::string map = TemporaryFolder::read_content(kRig + "/lamps.yaml");
  for (auto at = map.find(", frequency_hz"); at != std::string::npos;
       at = map.find(", frequency_hz")) {
    map.erase(at, map.find(", duty", at) - at);
  }
  const std::string rest = " --lamps " + folder.file("lamps.yaml", map).string() +
                           " --calibration " + without("  row_time_s").string();
  const auto detected = run_program("vlp-detect " + kRig + "/sample" + rest + " --classifier " +
                                    output.string() + " -o " + (folder / "found.csv").string());
  ASSERT_EQ(detected.exit_code, 0) << detected.errors;
  const CsvTable found(folder / "found.csv"), truth(kRig + "/sample/true_detections.csv");
  ASSERT_EQ(found.num_rows(), 12);
  for (std::size_t row = 0; row < found.num_rows(); ++row) {
    const auto matches = [&](std::size_t other) {
      return read_text(found, row, "image") == read_text(truth, other, "image") &&
             found.get_cell_integer(row, found.get_required_column("lamp")) ==
                 truth.get_cell_integer(other, truth.get_required_column("lamp")) &&
             std::abs(read_number(found, row, "u_px") - read_number(truth, other, "u_px")) < 0.5;
    };
    int matching = 0;
    for (std::size_t other = 0; other < truth.num_rows(); ++other) matching += matches(other);
    EXPECT_EQ(matching, 1) << row;
  }
  const auto located = run_program("vlp-locate " + kRig + "/sample" + rest + " --classifier " +
                                   output.string() + " -o " + (folder / "fixes.csv").string());
  EXPECT_EQ(located.exit_code, 0) << located.errors;
  EXPECT_THAT(located.output, HasSubstr("fixes       2\n"));
}

TEST_F(VlpTrain, WritesTrueRowTimeAndReadoutFromUnlabeledImages) {
  // Nothing but the images is there.
  fs::create_directory(folder / "images");
  for (const auto& entry : fs::directory_iterator(captures())) {
    if (entry.path().extension() == ".png") fs::copy(entry.path(), folder / "images");
  }
  const auto bare = run_program("vlp-train --row-time " + (folder / "images").string() + kLamps);
  ASSERT_EQ(bare.exit_code, 0) << bare.errors;
  EXPECT_THAT(bare.output, HasSubstr("readout     along rows"));
  std::string calibration = TemporaryFolder::read_content(without("  row_time_s"));
  calibration.erase(calibration.find("  readout"), 16);
  const auto result = train("--row-time " + (folder / "images").string() + kLamps +
                            " --calibration " + folder.file("bare.yaml", calibration).string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const Calibration found = read_calibration(output);
  const Calibration truth = read_calibration(kRig + "/true_calibration.yaml");
  EXPECT_NEAR(found.camera.row_time_s.value() / *truth.camera.row_time_s, 1, 0.001);
  EXPECT_EQ(found.camera.readout, Readout::rows);
  EXPECT_EQ(found.camera.intrinsics, truth.camera.intrinsics);
  EXPECT_EQ(found.rotation_center.value().center_px, truth.rotation_center->center_px);
  ASSERT_FALSE(found.history.empty());
  EXPECT_EQ(found.history.back().program, "vlp-train");
}

/// Without its first lamp, which shows too few stripes, the frequencies of this scene fit two row
/// times.
TEST_F(VlpTrain, LampPositionsDecideBetweenTwoFittingRowTimes) {
  const fs::path set = folder / "archive";
  const auto simulated = run_program("vlp-simulate " VLP_SOURCE_DIR
                                     "/datasets/archive/scene.yaml -q --only rotation -o " +
                                     set.string());
  ASSERT_EQ(simulated.exit_code, 0) << simulated.errors;
  const std::string command = "vlp-train --row-time " + (set / "rotation").string() + " --lamps ";
  const std::string lamps = (set / "lamps.yaml").string();
  const std::string calibration = " --calibration " + (set / "true_calibration.yaml").string();
  for (const std::string& camera : {calibration, std::string()}) {
    const auto result = run_program(command + lamps + camera);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_THAT(result.output, testing::ContainsRegex("row time    (29[.]9|30[.]0)"));
    EXPECT_THAT(result.output, HasSubstr("of 5 lamps"));
  }
  // Frequencies elsewhere in the room: the places fit neither row time.
  std::string map = TemporaryFolder::read_content(lamps);
  map.replace(map.find("[-0.6, 0.3"), 10, "[0.6, 0.32");
  map.replace(map.find("[0.6, 0.3,"), 10, "[-0.6, 0.3,");
  const auto swapped = run_program(command + folder.file("swapped.yaml", map).string());
  EXPECT_EQ(swapped.exit_code, 3) << swapped.output;
  EXPECT_THAT(swapped.errors, HasSubstr("fit a row time of"));
  EXPECT_THAT(swapped.errors, HasSubstr("neither duties nor positions of the lamps decide"));
}

TEST_F(VlpTrain, VlpDetectEstimatesColumnReadoutWhenCalibrationHasNone) {
  const std::string wide = VLP_SOURCE_DIR "/datasets/wide/rendered";
  std::string calibration = TemporaryFolder::read_content(wide + "/true_calibration.yaml");
  calibration.erase(calibration.find("  readout: columns\n"), 19);
  const std::string command = "vlp-detect " + wide + "/sample --lamps " + wide + "/lamps.yaml -o " +
                              (folder / "found.csv").string() + " --calibration " +
                              folder.file("c.yaml", calibration).string();
  const auto found = run_program(command);
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_THAT(found.errors, HasSubstr("the images show stripes along columns"));
  const auto lamps = CsvTable(folder / "found.csv").num_rows();
  EXPECT_GE(lamps, 6);
  ASSERT_EQ(run_program(command + " --readout columns").exit_code, 0);
  EXPECT_EQ(CsvTable(folder / "found.csv").num_rows(), lamps);
  EXPECT_EQ(run_program(command + " --readout rows").exit_code, 3);
  EXPECT_EQ(run_program(command + " --readout diagonal").exit_code, 2);
}

TEST_F(VlpTrain, VlpDetectWarnsOfInseparableLampsWithoutClassifier) {
  std::string map = TemporaryFolder::read_content(kRig + "/lamps.yaml");
  map.replace(map.find("2000"), 4, "1620");
  const std::string command = "vlp-detect " + kRig + "/sample" + kCalibration + " --lamps " +
                              folder.file("alike.yaml", map).string() + " -o " +
                              (folder / "found.csv").string();
  const auto result = run_program(command);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("lamps 1 and 2 may remain unidentified from z = 0"));
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
}

}  // namespace
}  // namespace vlp
