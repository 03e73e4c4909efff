// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Functions vlp_detect() and vlp_open_room() of the C interface, with rendered and random images.
#include <gmock/gmock.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/lamp_detector.h"
#include "positioning/image_fix.h"
#include "positioning/vlp.h"
#include "support/random.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using Handle = std::unique_ptr<vlp_positioner, void (*)(vlp_positioner*)>;
using Detections = std::array<vlp_detection, VLP_MAX_LAMPS>;

const std::string kRendered = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/";

Calibration calibration() { return read_calibration(kRendered + "true_calibration.yaml"); }
cv::Mat sample() { return read_image(kRendered + "sample/0000.png"); }

vlp_image c_image(const ImageView& view) {
  return {view.data, view.width, view.height, view.stride, view.bits};
}

Handle open(const Calibration& calibration) {
  const TemporaryFolder folder;
  const std::string file = folder / "calibration.yaml";
  write_calibration(file, calibration);
  vlp_positioner* positioner = nullptr;
  EXPECT_EQ(vlp_open((kRendered + "lamps.yaml").c_str(), file.c_str(), nullptr, &positioner),
            VLP_OK)
      << vlp_last_error();
  return {positioner, &vlp_close};
}

TEST(CFunctionVlpDetect, ReturnsSameLampsAsLampDetector) {
  const cv::Mat image = sample();
  const auto expected = LampDetector(read_lamp_map(kRendered + "lamps.yaml"), calibration())
                            .detect_lamps(to_image_view(image));
  ASSERT_EQ(expected.size(), 6U);
  const Handle positioner = open(calibration());
  // Rows without padding, and rows with padding.
  cv::Mat wide(image.rows, image.cols + 13, CV_8U, cv::Scalar(255));
  image.copyTo(wide(cv::Rect(0, 0, image.cols, image.rows)));
  vlp_image without_gap = c_image(to_image_view(image));
  without_gap.stride = 0;
  for (const vlp_image& given :
       {without_gap, c_image(to_image_view(wide(cv::Rect(0, 0, image.cols, image.rows))))}) {
    Detections detections;
    std::size_t count = 0;
    ASSERT_EQ(vlp_detect(positioner.get(), &given, detections.data(), detections.size(), &count),
              VLP_OK);
    ASSERT_EQ(count, expected.size());
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(detections[i].lamp, expected[i].lamp);
      EXPECT_EQ(Eigen::Vector2d(detections[i].u_px, detections[i].v_px), expected[i].pixel);
      EXPECT_EQ(detections[i].sigma_px, expected[i].sigma_px);
    }
  }
}

TEST(CFunctionVlpLocateImage, EqualsCppFixForUnknownTilt) {
  const cv::Mat image = sample();
  const LampMap lamps = read_lamp_map(kRendered + "lamps.yaml");
  Sensors same;
  same.inclination_sigma_rad = 0.2;
  const auto expected =
      locate_camera_in_image(Positioner(lamps, calibration()), LampDetector(lamps, calibration()),
                             to_image_view(image), same);
  ASSERT_TRUE(expected.fix.has_succeeded());
  ASSERT_GE(expected.repetition, 2U);
  const Handle positioner = open(calibration());
  const vlp_image given = c_image(to_image_view(image));
  vlp_sensors sensors = {};
  sensors.inclination_sigma_rad = 0.2;
  sensors.stamp = 7;
  Detections detections;
  std::size_t count = 0;
  vlp_fix fix;
  ASSERT_EQ(vlp_locate_image(positioner.get(), &given, &sensors, detections.data(),
                             detections.size(), &count, &fix),
            VLP_OK);
  EXPECT_EQ(fix.stamp, 7);
  EXPECT_EQ(Eigen::Vector3d(fix.state.position_m), expected.fix.state.pose.position_m);
  ASSERT_EQ(count, expected.detections.size());
  EXPECT_EQ(detections[0].u_px, expected.detections[0].pixel.x());
  vlp_image wrong = given;
  wrong.width = 5;
  EXPECT_EQ(vlp_locate_image(positioner.get(), &wrong, nullptr, detections.data(),
                             detections.size(), &count, &fix),
            VLP_BAD_ARGUMENT);
  EXPECT_EQ(fix.status, VLP_BAD_ARGUMENT);
}

TEST(CFunctionVlpDetect, ReturnsRequiredCountWhenArrayIsTooSmall) {
  const cv::Mat image = sample();
  const Handle positioner = open(calibration());
  const vlp_image given = c_image(to_image_view(image));
  for (const std::size_t capacity : {0U, 1U, 5U, 6U}) {
    std::vector<vlp_detection> detections(capacity);  // of exactly this size, for the sanitizers
    std::size_t count = 99;
    EXPECT_EQ(vlp_detect(positioner.get(), &given, detections.data(), capacity, &count),
              capacity < 6 ? VLP_TOO_SMALL : VLP_OK);
    EXPECT_EQ(count, 6U);
    for (const vlp_detection& detection : detections) EXPECT_GT(detection.sigma_px, 0);
  }
  EXPECT_NE(vlp_describe_status(VLP_TOO_SMALL), std::string(vlp_describe_status(-99)));
}

TEST(CFunctionVlpDetect, ReturnsBadArgumentForInvalidPointersOrImages) {
  const cv::Mat image = sample();
  const Handle positioner = open(calibration());
  const vlp_image valid_image = c_image(to_image_view(image));
  Detections detections;
  std::size_t count = 99;
  const auto detect = [&](const vlp_positioner* with, const vlp_image* given, vlp_detection* to) {
    count = 99;
    return vlp_detect(with, given, to, detections.size(), &count);
  };
  EXPECT_EQ(detect(positioner.get(), &valid_image, detections.data()), VLP_OK);
  EXPECT_EQ(detect(nullptr, &valid_image, detections.data()), VLP_BAD_ARGUMENT);
  EXPECT_EQ(count, 0U);
  EXPECT_EQ(detect(positioner.get(), nullptr, detections.data()), VLP_BAD_ARGUMENT);
  EXPECT_EQ(detect(positioner.get(), &valid_image, nullptr), VLP_BAD_ARGUMENT);
  EXPECT_EQ(
      vlp_detect(positioner.get(), &valid_image, detections.data(), detections.size(), nullptr),
      VLP_BAD_ARGUMENT);
  const auto refused = [&](auto change) {
    vlp_image bad = valid_image;
    change(bad);
    const int code = detect(positioner.get(), &bad, detections.data());
    return code == VLP_BAD_ARGUMENT && count == 0 && std::strlen(vlp_last_error()) > 0;
  };
  EXPECT_TRUE(refused([](vlp_image& bad) { bad = {}; }));
  EXPECT_TRUE(refused([](vlp_image& bad) { bad.data = nullptr; }));
  for (const int size : {0, -1, -800, 1, 801, 2147483647, -2147483647 - 1}) {
    EXPECT_TRUE(refused([&](vlp_image& bad) { bad.width = size; })) << size;
    EXPECT_TRUE(refused([&](vlp_image& bad) { bad.height = size; })) << size;
    EXPECT_TRUE(refused([&](vlp_image& bad) { bad.width = bad.height = size; })) << size;
  }
  for (const int bits : {0, 1, 10, 12, 32, -8, -16, 2147483647}) {
    EXPECT_TRUE(refused([&](vlp_image& bad) { bad.bits = bits; })) << bits;
  }
  for (const int stride : {1, 799, -1, -800}) {
    EXPECT_TRUE(refused([&](vlp_image& bad) { bad.stride = stride; })) << stride;
  }
  EXPECT_TRUE(refused([](vlp_image& bad) {
    bad.bits = 16, bad.stride = 1600, bad.data = static_cast<const char*>(bad.data) + 1;
  }));
}

TEST(CFunctionVlpDetect, ReturnsRowTimeUnknownWithoutRowTime) {
  const cv::Mat image = sample();
  const vlp_image given = c_image(to_image_view(image));
  Calibration without = calibration();
  without.camera.row_time_s.reset();
  Detections detections;
  std::size_t count = 99;
  EXPECT_EQ(vlp_detect(open(without).get(), &given, detections.data(), detections.size(), &count),
            VLP_ROW_TIME_UNKNOWN);
  EXPECT_EQ(count, 0U);
  EXPECT_THAT(vlp_last_error(), HasSubstr("row_time_s"));
}

/// Lamps of the sample in the room hall, and lamps with the same frequencies in the room office.
std::string two_rooms() {
  std::string text = TemporaryFolder::read_content(kRendered + "lamps.yaml");
  std::string office = text.substr(text.find("  - "));
  for (std::size_t at = 0; (at = text.find("{id: ", at)) != text.npos;) {
    text.insert(++at, "room: hall, ");
  }
  for (std::size_t at = 0; (at = office.find("id: ", at)) != office.npos; at += 4) {
    office.insert(at + 4, "1");
    office.insert(at, "room: office, ");
    at += 14;
  }
  for (std::size_t at = 0; (at = office.find(", 1.6]", at)) != office.npos;) {
    office.replace(at, 6, ", 1.7]");
  }
  return text + office;
}

TEST(CFunctionVlpOpenRoom, YieldsOnlyLampsOfChosenRoomAndRequiresOne) {
  const TemporaryFolder folder;
  const std::string lamps = folder.file("lamps.yaml", two_rooms());
  const std::string camera = kRendered + "true_calibration.yaml";
  const cv::Mat image = sample();
  const vlp_image given = c_image(to_image_view(image));
  Detections detections;
  const auto detect_in = [&](const char* room, std::size_t& count) {
    vlp_positioner* opened = nullptr;
    EXPECT_EQ(vlp_open_room(lamps.c_str(), room, camera.c_str(), nullptr, &opened), VLP_OK)
        << vlp_last_error();
    const Handle positioner{opened, &vlp_close};
    return vlp_detect(opened, &given, detections.data(), detections.size(), &count);
  };
  std::size_t count = 0;
  for (const auto& [room, first_id] : {std::pair{"hall", 1}, {"office", 11}}) {
    ASSERT_EQ(detect_in(room, count), VLP_OK) << vlp_last_error();
    ASSERT_EQ(count, 6U);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_GE(detections[i].lamp, first_id);
      EXPECT_LT(detections[i].lamp, first_id + 6);
    }
  }
  for (const char* no_room : {static_cast<const char*>(nullptr), ""}) {
    EXPECT_EQ(detect_in(no_room, count), VLP_BAD_FILE);
    EXPECT_EQ(count, 0U);
    EXPECT_THAT(
        vlp_last_error(),
        HasSubstr("lamps.yaml: lamps 1 and 11 share a frequency in two rooms: choose a room with "
                  "the argument room of vlp_open_room(); the map has: hall, office"));
  }
  vlp_positioner* none = nullptr;
  EXPECT_EQ(vlp_open_room(lamps.c_str(), "attic", camera.c_str(), nullptr, &none), VLP_BAD_FILE);
  EXPECT_EQ(none, nullptr);
  EXPECT_THAT(vlp_last_error(), HasSubstr("has no lamp with 'room: attic'"));
}

/// Returns pixels in a buffer without spare bytes: rows have padding, the last one has none.
template <typename Level, typename Next>
std::vector<Level> pixels(int width, int height, int row, Next&& next) {
  std::vector<Level> pixels(std::size_t((height - 1) * row + width));
  for (Level& level : pixels) level = static_cast<Level>(next());
  return pixels;
}

TEST(CFunctionVlpDetect, ReturnsOkForRandomImagesOfAnySize) {
  Random random(1);
  for (const Readout readout : {Readout::rows, Readout::columns}) {
    for (const auto& [width, height] : {std::array{1, 1}, {2, 100}, {65, 3}, {127, 129}}) {
      Calibration small = calibration();
      small.camera.imager_px = {width, height};
      small.camera.readout = readout;
      const Handle positioner = open(small);
      ASSERT_NE(positioner, nullptr);
      const auto expect_detected = [&, w = width, h = height]<typename Level>(
                                       Level white, const char* content, bool is_even, auto next) {
        SCOPED_TRACE(testing::Message()
                     << w << " x " << h << ", white " << white << ": " << content);
        const int row = w + 3;
        const auto all = pixels<Level>(w, h, row, next);
        const vlp_image given{all.data(), w, h, std::ptrdiff_t(sizeof(Level)) * row,
                              8 * int(sizeof(Level))};
        Detections detections;
        std::size_t count = 99;
        EXPECT_EQ(
            vlp_detect(positioner.get(), &given, detections.data(), detections.size(), &count),
            VLP_OK)
            << vlp_last_error();
        if (is_even) {
          EXPECT_EQ(count, 0U);
        }
      };
      const auto expect_all = [&]<typename Level>(Level white) {
        expect_detected(white, "black", true, [] { return 0; });
        expect_detected(white, "white", true, [&] { return white; });
        expect_detected(white, "noise", false, [&] { return random.uniform(0, white); });
        expect_detected(white, "spots", false,
                        [&] { return random.uniform(0, 1) > 0.97 ? white : 9; });
        int i = 0;
        expect_detected(white, "bars", false, [&] { return ++i / 200 % 2 == 0 ? white : 9; });
      };
      expect_all(std::uint8_t{255});
      expect_all(std::uint16_t{65535});
    }
  }
}

}  // namespace
}  // namespace vlp
