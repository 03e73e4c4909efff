// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Detector on photographs of real lamps, if they are available.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "captures/csv_reader.h"
#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/light_detector.h"
#include "lamps/readout.h"
#include "lamps/signal/row_time.h"
#include "support/real_data.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::map<int, Light> lamps_in(const LightDetector& detector, const cv::Mat& image) {
  std::map<int, Light> lamps;
  for (Light& light : detector.detect_lights(to_image_view(image))) {
    if (light.kind == LightKind::lamp) lamps.emplace(*light.lamp, std::move(light));
  }
  return lamps;
}

cv::Mat encode_image(const cv::Mat& image, const char* ending, int quality = -1) {
  std::vector<unsigned char> bytes;
  const std::vector<int> options =
      quality < 0 ? std::vector<int>() : std::vector<int>{cv::IMWRITE_JPEG_QUALITY, quality};
  cv::imencode(ending, image, bytes, options);
  return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
}

/// Five recessed downlights in five photographs.
class LightDetectorOnRealDownlights : public testing::Test {
 protected:
  const fs::path data = real_data("downlights");

  void SetUp() override {
    if (data.empty()) GTEST_SKIP() << "no real captures here";
  }
  LampMap map() const { return read_lamp_map(data / "lamps.yaml"); }
  fs::path image(int number) const { return data / ("a0" + std::to_string(number) + ".jpg"); }
};

/// Number of lamps found in all photographs, and number of those at wrong positions.
struct Identified {
  int lamps = 0, wrong = 0;
};

template <typename ImageProcessing>
Identified identified(const fs::path& data, const ImageProcessing& picture) {
  const LightDetector detector(read_lamp_map(data / "lamps.yaml"), {Readout::columns, 15.1e-6, {}});
  const CsvTable table(data / "expected.csv");
  const auto image_column = table.require_column("image"),
             lamp_column = table.require_column("lamp");
  const auto u_column = table.require_column("u_px"), v_column = table.require_column("v_px");
  const auto size_column = table.require_column("size_px");
  std::map<std::string, std::map<int, Light>> found;
  Identified result;
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    const std::string image(table.get_cell_text(row, image_column));
    if (!found.contains(image)) found[image] = lamps_in(detector, picture(data / image));
    const auto lamp = found[image].find(table.get_cell_integer(row, lamp_column));
    if (lamp == found[image].end()) continue;
    // Expected positions are those of the lit area, accurate to about 20 px. It may be anywhere
    // within the rim.
    const Eigen::Vector2d expected(table.get_cell_number(row, u_column),
                                   table.get_cell_number(row, v_column));
    const double apart_px = (lamp->second.pixel - expected).norm();
    ++result.lamps;
    result.wrong += apart_px > std::max(table.get_cell_number(row, size_column) / 2,
                                        !has_outline(lamp->second) ? 0 : lamp->second.radius_px);
  }
  return result;
}

TEST_F(LightDetectorOnRealDownlights, IdentifiesAllLamps) {
  const Identified found = identified(data, [](const fs::path& file) { return read_image(file); });
  EXPECT_EQ(found.wrong, 0);
  EXPECT_EQ(found.lamps, 25);
}

TEST_F(LightDetectorOnRealDownlights, IdentifiesAllLampsInEachImageFormat) {
  for (const auto& [ending, quality] :
       {std::pair(".png", -1), {".jpg", 100}, {".jpg", 90}, {".jpg", 80}}) {
    const Identified found = identified(data, [&, &e = ending, &q = quality](const fs::path& file) {
      return encode_image(
          cv::imread(file.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION), e, q);
    });
    EXPECT_EQ(found.wrong, 0) << ending << quality;
    EXPECT_EQ(found.lamps, 25) << ending << quality;
  }
}

TEST_F(LightDetectorOnRealDownlights, IdentifiesMostLampsAtTwiceTheBrightness) {
  const Identified found = identified(data, [](const fs::path& file) {
    cv::Mat brighter;
    cv::imread(file.string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION)
        .convertTo(brighter, -1, 2);
    return encode_image(brighter, ".png");
  });
  EXPECT_EQ(found.wrong, 0);
  EXPECT_GE(found.lamps, 22);  // measured: 23
}

TEST_F(LightDetectorOnRealDownlights, StripePeriodsYieldTrueRowTime) {
  const LightDetector detector(map(), {Readout::columns, {}, {}});
  std::vector<MeasuredPeriod> periods;
  for (int number = 1; number <= 5; ++number) {
    for (const Light& light : detector.detect_lights(to_image_view(read_image(image(number))))) {
      if (are_stripes_reliable(light.stripes)) periods.push_back({light.stripes.period_lines, {}});
    }
  }
  const RowTimeResult result = select_row_time(list_row_time_candidates(periods, map()));
  ASSERT_TRUE(result.row_time) << result.problem;
  EXPECT_NEAR(result.row_time->row_time_s / 15.10e-6, 1, 0.002);
}

/// Same lamps from the side: a bright core near one edge, and crescents of the rim.
TEST(LightDetectorOnRealObliqueDownlights, IdentifiesAllLamps) {
  const fs::path data = real_data("downlights-oblique");
  if (data.empty()) GTEST_SKIP() << "no real captures here";
  const Identified found = identified(data, [](const fs::path& file) { return read_image(file); });
  EXPECT_EQ(found.wrong, 0);
  EXPECT_EQ(found.lamps, 12);
}

TEST(LightDetectorOnRealObliqueDownlights, LocatesRimsWithoutLens) {
  const fs::path data = real_data("downlights-oblique");
  if (data.empty()) GTEST_SKIP() << "no real captures here";
  constexpr double accuracy_px = 8;  // of positions measured by eye
  const LightDetector detector(read_lamp_map(data / "lamps.yaml"), {Readout::columns, 15.1e-6, {}});
  int num_rims = 0;
  for (const auto& [name, lamp, u_px, v_px] :
       {std::tuple("e548.jpg", 1, 1303.0, 1921.0), std::tuple("e548.jpg", 2, 331.0, 2003.0),
        std::tuple("e548.jpg", 3, 282.0, 1137.0), std::tuple("e548.jpg", 4, 1322.0, 1156.0),
        std::tuple("e548.jpg", 5, 770.0, 1484.0), std::tuple("e608.jpg", 1, 505.0, 1775.0),
        std::tuple("e608.jpg", 2, 508.0, 878.0)}) {
    const auto lamps = lamps_in(detector, read_image(data / name));
    ASSERT_TRUE(lamps.contains(lamp)) << name << lamp;
    if (!has_outline(lamps.at(lamp))) continue;
    ++num_rims;
    EXPECT_LT((lamps.at(lamp).pixel - Eigen::Vector2d(u_px, v_px)).norm(), accuracy_px)
        << name << lamp;
  }
  EXPECT_GE(num_rims, 6);
}

/// Photographs with readout along rows and along columns, without a given readout direction.
TEST(DetectBothReadouts, ReturnsReadoutAndAllLampsOfRealGlows) {
  const fs::path data = real_data("luxapose");
  if (data.empty()) GTEST_SKIP() << "no real captures here";
  const LightDetector by_rows(read_lamp_map(data / "lamps.yaml"), {Readout::rows, 1 / 47540.0, {}});
  for (const LightDetector& detector : {by_rows, by_rows.copy_with_readout(Readout::columns)}) {
    for (const auto& [name, readout, count] :
         {std::tuple("x_0_y_1.27.jpg", Readout::rows, 5),
          std::tuple("2014-02-27--18-15-03-62.jpg", Readout::columns, 3),
          std::tuple("small_blob.jpg", Readout::rows, 5)}) {
      const cv::Mat image = read_image(data / name);
      const LightsWithReadout found = detect_both_readouts(detector, to_image_view(image));
      EXPECT_EQ(found.readout, readout) << name;
      EXPECT_EQ(std::count_if(found.lights.begin(), found.lights.end(),
                              [](const Light& light) { return light.kind == LightKind::lamp; }),
                count)
          << name;
    }
  }
}

/// Glowing bulbs, in the original JPEG files of a phone and in the same images in other formats.
TEST(LightDetectorOnRealGlows, ReturnsSameCentersInEachImageFormat) {
  const fs::path data = real_data("luxapose");
  if (data.empty()) GTEST_SKIP() << "no real captures here";
  const LampMap map = read_lamp_map(data / "lamps.yaml");
  for (const auto& [name, readout, count] :
       {std::tuple("x_0_y_1.27.jpg", Readout::rows, 5U),
        std::tuple("2014-02-27--18-15-03-62.jpg", Readout::columns, 3U)}) {
    const LightDetector detector(map, {readout, 1 / 47540.0, {}});
    const auto original = lamps_in(detector, read_image(data / name));
    EXPECT_EQ(original.size(), count);
    const cv::Mat picture =
        cv::imread((data / name).string(), cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    cv::Mat dimmed;
    picture.convertTo(dimmed, -1, 0.5);
    for (const cv::Mat& image :
         {encode_image(picture, ".png"), encode_image(picture, ".bmp"),
          encode_image(picture, ".jpg", 100), encode_image(picture, ".jpg", 95),
          encode_image(picture, ".jpg", 90), encode_image(picture, ".jpg", 80),
          encode_image(dimmed, ".png")}) {
      const auto lamps = lamps_in(detector, image);
      EXPECT_EQ(lamps.size(), count);
      for (const auto& [id, lamp] : lamps) {
        ASSERT_TRUE(original.contains(id));
        const double apart_px = (lamp.pixel - original.at(id).pixel).norm();
        EXPECT_LT(apart_px, 2 * std::max(lamp.sigma_px, original.at(id).sigma_px)) << name << id;
      }
    }
  }
}

}  // namespace
}  // namespace vlp
