// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-convert, there and back.
#include <gmock/gmock.h>

#include <algorithm>
#include <regex>

#include "camera/lens.h"
#include "rig/calibration.h"
#include "support/program.h"
#include "support/random.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

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

TEST_F(VlpConvert, KeepsCalibratedRegionOnlyThroughMrcalFormat) {
  IntrinsicsReport report{20, 2000, 3, 0.1, {}, 0.05, {}};
  report.region_px = {{0, 0}, {500.25, 0}, {512, 300.125}, {500, 599}, {0, 599}};
  calibration_.intrinsics_report = report;
  const Calibration back = round_trip("mrcal");
  ASSERT_TRUE(back.intrinsics_report);
  EXPECT_EQ(back.intrinsics_report->region_px, report.region_px);
  EXPECT_EQ(back.intrinsics_report->views, 0);
  EXPECT_FALSE(back.intrinsics_report->expected_max_error_px);
  EXPECT_THAT(convert("camera.yaml", "out", "--to mrcal"),
              HasSubstr("% of the image, which is kept"));
  EXPECT_THAT(convert("camera.yaml", "out", "--to ros"), HasSubstr("the format does not support"));

  calibration_.intrinsics_report->region_px.clear();
  EXPECT_FALSE(round_trip("mrcal").intrinsics_report);
  EXPECT_THAT(convert("camera.yaml", "out", "--to ros"), testing::Not(HasSubstr("known")));
}

/// Compares the reported error of a fit with the rays of 1,000 pixels.
TEST_F(VlpConvert, PrintsLargestPixelErrorOfFittedLens) {
  write_calibration(folder_ / "camera.yaml", calibration_);
  const std::string said =
      convert("camera.yaml", "kalibr.yaml", "--to kalibr --lens OPENCV_FISHEYE");
  std::smatch match;
  ASSERT_TRUE(std::regex_search(
      said, match,
      std::regex("OPENCV_FISHEYE, fitted to LENSMODEL_OPENCV8: ([0-9.e-]+) px apart at worst, "
                 "over 100.0 % of the image")))
      << said;
  const double stated_px = std::stod(match[1]);
  convert("kalibr.yaml", "back.yaml");
  const Camera fitted = read_calibration(folder_ / "back.yaml").camera;
  ASSERT_EQ(fitted.lens_model, LensModel::fisheye);
  const Camera& camera = calibration_.camera;
  const Lens was(camera.lens_model, camera.intrinsics), lens(fitted.lens_model, fitted.intrinsics);
  Random random(4);
  double worst_px = 0;
  for (int i = 0; i < 1000; ++i) {
    // Some on the image's edges, and its corners.
    const double v = std::clamp(random.uniform(-30, 629), 0.0, 599.0),
                 u = std::clamp(random.uniform(-40, 839), 0.0, 799.0);
    const Eigen::Vector2d pixel =
        i < 4 ? Eigen::Vector2d(799.0 * (i % 2), i < 2 ? 0 : 599) : Eigen::Vector2d(u, v);
    const auto there = lens.project_point(was.unproject_pixel(pixel).value().direction);
    worst_px = std::max(worst_px, (there.value() - pixel).norm());
  }
  constexpr double three_digits = 1.005;
  EXPECT_LE(worst_px, three_digits * stated_px);
  EXPECT_GE(worst_px, 0.95 * stated_px);
}

}  // namespace
}  // namespace vlp
