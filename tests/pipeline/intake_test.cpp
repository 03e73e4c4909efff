// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The station and vlp-calibrate keep the same images of a folder, for the same reasons, and
/// calibrate from them to the same digit.
#include <gmock/gmock.h>

#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "small_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

/// Reasons by image, "boards/0003b-dark.png".
using Reasons = std::map<std::string, std::string>;

class Intake : public SmallStation {
 protected:
  fs::path image(const std::string& name) const { return folder / ("unit/" + name); }
  cv::Mat read(const std::string& name) const {
    return cv::imread(image(name).string(), cv::IMREAD_GRAYSCALE);
  }
  void write(const std::string& name, const cv::Mat& pixels) const {
    ASSERT_TRUE(cv::imwrite(image(name).string(), pixels));
  }
  static cv::Mat scaled(const cv::Mat& pixels, double factor) {
    cv::Mat result;
    pixels.convertTo(result, CV_8U, factor);
    return result;
  }
  static cv::Mat moved(const cv::Mat& pixels, double by_px) {
    cv::Mat result;
    cv::warpAffine(pixels, result, cv::Mat(cv::Matx23d(1, 0, by_px, 0, 1, 0)), pixels.size(),
                   cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    return result;
  }

  /// Adds images of every kind that is rejected to a folder. Their names follow that of an image
  /// that is kept.
  void spoil(const std::string& step) const {
    const cv::Mat good = read(step + "/0003.png");
    ASSERT_FALSE(good.empty());
    write(step + "/0003b-dark.png", scaled(good, 0.01));
    write(step + "/0003c-white.png", scaled(cv::Mat(good + 40), 6));
    write(step + "/0003d-small.png", good(cv::Rect(0, 0, 640, 480)));
    fs::copy_file(image(step + "/0003.png"), image(step + "/0003e-copy.png"));
    ASSERT_TRUE(cv::imwrite(image(step + "/0003f-saved-again.png").string(), good,
                            {cv::IMWRITE_PNG_COMPRESSION, 1}));
    folder.file("unit/" + step + "/0003g-text.png", "no image");
  }

  /// Images of a board whose tags have other ids.
  void add_foreign_board() const {
    std::string scene = TemporaryFolder::read_content(folder / "station/scene.yaml");
    const std::string ids = "first_id: 0";
    ASSERT_NE(scene.find(ids), std::string::npos);
    scene.replace(scene.find(ids), ids.size(), "first_id: 100");
    const fs::path file = folder.file("station/foreign.yaml", scene);
    const fs::path rendered = folder / "foreign";
    const auto result =
        run_program("vlp-simulate -q " + file.string() + " --only boards -o " + rendered.string());
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    fs::copy_file(rendered / "boards/0001.png", image("boards/0003h-foreign.png"));
  }

  Reasons reasons_of_station() const {
    const fs::path file = folder / "runs.json";
    const auto result = records("export --last 1 -o " + file.string());
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    Reasons reasons;
    const json runs = json::parse(TemporaryFolder::read_content(file));
    for (const json& image : runs.at(0).at("images")) {
      const std::string refused = image.at("rejection");
      if (refused.empty()) continue;
      reasons[image.at("step").get<std::string>() + "/" + image.at("image").get<std::string>()] =
          refused;
    }
    return reasons;
  }
  Reasons reasons_of_session() const {
    Reasons reasons;
    const json session =
        json::parse(TemporaryFolder::read_content(folder / "results/session.json"));
    for (const json& step : session.at("steps")) {
      const std::string name = step.at("name") == "lens" ? "boards" : step.at("name");
      if (!step.contains("skipped")) continue;
      for (const json& image : step.at("skipped")) {
        reasons[name + "/" + image.at("image").get<std::string>()] = image.at("reason");
      }
    }
    return reasons;
  }
  /// The row time is measured from the rotation in a session, from all steps at the station.
  void expect_same_metrics() const {
    const json runs = json::parse(TemporaryFolder::read_content(folder / "runs.json"));
    const json session =
        json::parse(TemporaryFolder::read_content(folder / "results/session.json"));
    int same = 0;
    for (const json& metric : session.at("metrics")) {
      const auto name = metric.at("name").get<std::string>();
      const json& of_station = runs.at(0).at("metrics");
      if (!of_station.contains(name) || name.starts_with("row_time")) continue;
      EXPECT_EQ(of_station.at(name).at("value"), metric.at("value")) << name;
      ++same;
    }
    EXPECT_EQ(same, 20) << "of lens, sharpness, rotation and dispersion";
  }
};

/// Returns a calibration without what differs by definition: the history, and the keys of the
/// camera that only the station's camera type states.
std::string without_origin(const std::string& calibration) {
  std::istringstream lines(calibration);
  std::string kept;
  bool is_history = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line[0] != ' ') is_history = line.starts_with("history:");
    if (is_history || line.starts_with("  id:") || line.starts_with("  pixel_pitch_m:")) continue;
    kept += line + "\n";
  }
  return kept;
}

TEST_F(Intake, RejectionsAndCalibrationAreEqualAtStationAndInSession) {
  render();
  spoil("boards");
  spoil("rotation");
  spoil("dispersion");
  spoil("check");
  cv::Mat blurred;
  cv::GaussianBlur(read("boards/0003.png"), blurred, {}, 4);
  write("boards/0003i-blurred.png", blurred);
  write("boards/0003j-near.png", moved(read("boards/0003.png"), 3));
  write("rotation/0003i-near.png", moved(read("rotation/0003.png"), 3));
  add_foreign_board();

  const auto unit = run_program(batch());
  EXPECT_EQ(unit.exit_code, 0) << unit.errors;
  EXPECT_THAT(unit.output, HasSubstr("PASS"));
  const auto session =
      run_program("vlp-calibrate " + (folder / "unit").string() + " -o " +
                  (folder / "results").string() + " --row-time-s 3e-5 --readout rows --no-report");
  EXPECT_EQ(session.exit_code, 0) << session.errors;

  const Reasons reasons = reasons_of_station();
  EXPECT_EQ(reasons, reasons_of_session());
  EXPECT_EQ(reasons.size(), 4U * 6 + 4) << "six of each folder, four more";
  for (const std::string step : {"boards", "rotation", "dispersion", "check"}) {
    const auto reason = [&](const char* name) {
      const auto found = reasons.find(step + "/" + name);
      return found == reasons.end() ? std::string("kept") : found->second;
    };
    EXPECT_THAT(reason("0003b-dark.png"), testing::StartsWith("too dark: ")) << step;
    EXPECT_THAT(reason("0003c-white.png"), testing::StartsWith("overexposed: ")) << step;
    EXPECT_EQ(reason("0003d-small.png"), "is 640 x 480 px, the camera's images are 800 x 600 px")
        << step;
    EXPECT_EQ(reason("0003e-copy.png"), "is the same image as 0003.png") << step;
    EXPECT_EQ(reason("0003f-saved-again.png"), "is the same image as 0003.png") << step;
    EXPECT_THAT(reason("0003g-text.png"), testing::StartsWith("cannot be read as an image"))
        << step;
  }
  EXPECT_THAT(reasons.at("boards/0003h-foreign.png"), HasSubstr("tags that the board does not"));
  EXPECT_THAT(reasons.at("boards/0003i-blurred.png"), HasSubstr("blurred: "));
  EXPECT_THAT(reasons.at("boards/0003j-near.png"), HasSubstr("the same view as 0003.png"));
  EXPECT_THAT(reasons.at("rotation/0003i-near.png"), HasSubstr("the same view as 0003.png"));

  expect_same_metrics();
  const std::string by_station = without_origin(result("0001", "calibration.yaml"));
  EXPECT_THAT(by_station, HasSubstr("dispersion:"));
  EXPECT_EQ(by_station,
            without_origin(TemporaryFolder::read_content(folder / "results/calibration.yaml")));
}

}  // namespace
}  // namespace vlp
