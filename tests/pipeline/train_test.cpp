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
             found.get_cell_integer(row, found.require_column("lamp")) ==
                 truth.get_cell_integer(other, truth.require_column("lamp")) &&
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
