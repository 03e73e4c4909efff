// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-convert, there and back.
#include <gmock/gmock.h>

#include "camera/lens.h"
#include "rig/calibration.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

class VlpConvert : public testing::Test {
 protected:
  VlpConvert() {
    calibration_.camera = {
        "cam 7",
        {800, 600},
        LensModel::opencv8,
        {520.25, 521, 402.3, 297.4, -0.2, 0.05, 1e-4, -2e-4, 0.01, 0.02, -0.003, 0.001},
        {},
        {},
        {}};
  }
  void has_lens(LensModel model, std::vector<double> intrinsics) {
    calibration_.camera.lens_model = model;
    calibration_.camera.intrinsics = std::move(intrinsics);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  /// Converts a file and returns the printed text.
  std::string convert(const std::string& from, const std::string& to,
                      const std::string& options = "") const {
    const auto result =
        run_program("vlp-convert " + path(from) + " -o " + path(to) + " " + options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.output;
  }
  /// To a format and back.
  Calibration round_trip(const std::string& format) {
    write_calibration(folder_ / "camera.yaml", calibration_);
    convert("camera.yaml", format, "--to " + format);
    convert(format, "back.yaml");
    return read_calibration(folder_ / "back.yaml");
  }

  const TemporaryFolder folder_;
  Calibration calibration_;
};

TEST_F(VlpConvert, RoundTripThroughEachFormatKeepsCameraExactly) {
  const Camera& camera = calibration_.camera;
  const auto expect_back = [&](const char* format) {
    const Camera back = round_trip(format).camera;
    EXPECT_EQ(back.lens_model, camera.lens_model) << format;
    EXPECT_EQ(back.intrinsics, camera.intrinsics) << format;
    EXPECT_EQ(back.imager_px, camera.imager_px) << format;
  };
  for (const char* format : {"mrcal", "opencv", "ros"}) expect_back(format);
  EXPECT_EQ(round_trip("ros").camera.id, "cam 7");
  has_lens(LensModel::fisheye, {290, 291, 402, 297, 0.03, -0.012, 0.004, -0.0006});
  for (const char* format : {"opencv", "ros", "kalibr"}) expect_back(format);
}

}  // namespace
}  // namespace vlp
