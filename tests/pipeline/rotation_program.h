// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {

/// Tests of vlp-rotation on the turn of the example, as it is or changed.
class VlpRotation : public testing::Test {
 protected:
  ProgramResult rotation(const std::string& captures, const std::string& options = "") const {
    return run_program("vlp-rotation '" + captures + "' --lamps " + kExample +
                       "lamps.yaml --calibration " + kExample + "calibration.yaml -o " +
                       output.string() + " " + options);
  }
  RotationCenter found() const { return *read_calibration(output).rotation_center; }

  /// The captures of the example that `keep` accepts, by their number.
  template <typename Keep>
  std::string captures(const Keep& keep) const {
    std::vector<Frame> kept;
    const auto frames = read_detections(kExample + "turning.csv");
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (keep(i)) kept.push_back(frames[i]);
    }
    return written(kept);
  }
  std::string written(const std::vector<Frame>& frames) const {
    write_detections(folder / "detections.csv", frames);
    return (folder / "detections.csv").string();
  }
  void expect_refusal(const ProgramResult& result, int exit_code, const std::string& message) {
    EXPECT_EQ(result.exit_code, exit_code);
    EXPECT_THAT(result.errors, testing::HasSubstr(message));
    EXPECT_FALSE(std::filesystem::exists(output));
  }

  const TemporaryFolder folder;
  const std::filesystem::path output = folder / "rotated.yaml";
  const RotationCenter truth = *read_calibration(kExample + "calibration.yaml").rotation_center;
};

}  // namespace vlp
