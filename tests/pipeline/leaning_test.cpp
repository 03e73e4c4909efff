// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-locate on images of cameras with unknown tilt.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "captures/fixes_table.h"
#include "captures/truth_table.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

// clang-format off
const std::string kScene = R"(format: vlp-scene/1
seed: 3
room: {x_m: [-4, 4], y_m: [-4, 4], z_m: [0, 1.6]}
camera:
  id: hand
  imager_px: [800, 600]
  lens_model: LENSMODEL_OPENCV8
  intrinsics: [520, 520.6, 402.3, 297.4, -0.25, 0.08, 0.0002, -0.0001, -0.012, 0.01, 0.002, 0.0001]
  row_time_s: 3.0e-5
  readout: rows
optics: {blur_px: 0.7, vignetting_power: 4}
sensor: {bits: 8, gain_dn_per_e: 0.02, black_level_dn: 2, full_well_e: 13000, read_noise_e: 8, shot_noise: true}
mount: {tilt_deg: 0.4, tilt_azimuth_deg: 60, lever_arm_m: [0, 0]}
ambient_e_per_s: 1.0e+6
lamps:
  - {id: 1, position_m: [-0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 1600, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 2, position_m: [0, -0.32, 1.6], diameter_m: 0.18, frequency_hz: 2000, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 3, position_m: [0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 2500, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 4, position_m: [-0.6, 0.3, 1.6], diameter_m: 0.18, frequency_hz: 3100, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 5, position_m: [0, 0.28, 1.6], diameter_m: 0.18, frequency_hz: 3800, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 6, position_m: [0.6, 0.3, 1.6], diameter_m: 0.18, frequency_hz: 4700, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
captures:
)";
// clang-format on

struct Errors {
  int captures = 0, fixes = 0;
  double horizontal_m = 0, height_m = 0, worst_m = 0;
  /// Squared errors over their stated variances.
  double over_sd = 0;

  void check(double max_over_sd, double worst_allowed_m = 1e-3) const {
    EXPECT_LT(worst_m, worst_allowed_m);
    EXPECT_LT(std::sqrt(over_sd / fixes), max_over_sd);
  }
  std::string words() const {
    return fmt::format("{} of {} fixes, {:.3f} mm, height {:.3f} mm rms, error over sd {:.2f}",
                       fixes, captures, 1e3 * std::sqrt(horizontal_m / fixes),
                       1e3 * std::sqrt(height_m / fixes), std::sqrt(over_sd / fixes));
  }
};

class TiltedCamera : public testing::Test {
 protected:
  TemporaryFolder folder;
  std::string captures;

  /// Adds captures of a camera tilted by `tilt_deg` about x or y, with the lamps in view.
  void add_set(int tilt_deg) {
    constexpr double below_m = 1.3;
    const double aside_m = below_m * std::tan(tilt_deg * std::numbers::pi / 180);
    const std::array<const char*, 2> axes{"roll", "pitch"};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double x_m = axis == 1 ? -aside_m : 0, y_m = axis == 0 ? aside_m : 0;
      captures += fmt::format(
          "  - {{folder: {}{}, exposure_s: 5.0e-5, pivots_m: [[{:.3f}, {:.3f}], [{:.3f}, {:.3f}]], "
          "heights_m: [0.2, 0.4], yaws_deg: [{}], interval_s: 0.5, roll_pitch: {{{}_deg: [{}, "
          "{}]}}}}\n",
          axes[axis], tilt_deg, x_m + 0.1, y_m - 0.05, x_m - 0.1, y_m + 0.1, 0, axes[axis],
          tilt_deg, tilt_deg);
    }
  }
  void render(const std::string& scene = kScene) const {
    const auto file = folder.file("scene.yaml", scene + captures);
    const auto result =
        run_program("vlp-simulate " + file.string() + " -o " + (folder / "out").string());
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  ProgramResult locate(const std::string& set, const std::string& options) const {
    const auto path = [&](const char* name) { return (folder / "out" / name).string() + " "; };
    return run_program("vlp-locate " + path(set.c_str()) + "--lamps " + path("lamps.yaml") +
                       "--calibration " + path("true_calibration.yaml") + "-o " +
                       fixes_file(set).string() + " " + options);
  }
  std::filesystem::path fixes_file(const std::string& set) const {
    return folder / (set + "-fixes.csv");
  }
  void add_errors(const std::string& set, Errors& errors) const {
    const auto truth = read_truth_table(folder / "out" / set / "truth.csv");
    const auto fixes = read_fixes(fixes_file(set));
    ASSERT_EQ(fixes.size(), truth.size());
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const FixRow& row = fixes[i];
      ASSERT_EQ(row.image, truth[i].image);
      ++errors.captures;
      if (!row.fix) continue;
      ++errors.fixes;
      Eigen::Vector3d off_m = row.fix->pose.position_m;
      off_m -= Eigen::Vector3d(truth[i].xy_m.x(), truth[i].xy_m.y(), truth[i].z_m.value());
      errors.horizontal_m += off_m.head<2>().squaredNorm();
      errors.height_m += off_m.z() * off_m.z();
      errors.worst_m = std::max(errors.worst_m, off_m.norm());
      errors.over_sd += off_m.cwiseQuotient(row.fix->sd->head<3>()).squaredNorm() / 3;
    }
  }
  /// Every capture of both sets has a fix as good as it says; at 50 degrees one may have none.
  void check(int tilt_deg, const std::string& options, const std::string& property) const {
    SCOPED_TRACE(tilt_deg);
    Errors errors;
    for (const char* axis : {"roll", "pitch"}) {
      const std::string set = fmt::format("{}{}", axis, tilt_deg);
      const auto result = locate(set, options);
      EXPECT_EQ(result.exit_code, 0) << result.errors;
      add_errors(set, errors);
    }
    EXPECT_GE(errors.fixes, errors.captures - (tilt_deg < 50 ? 0 : 1));
    errors.check(1.5);
    RecordProperty(property, errors.words());
  }
};

TEST_F(TiltedCamera, FixesAreWithinOneMillimeterForUnknownTiltUpTo50Degrees) {
  for (const int tilt_deg : {5, 15, 30, 50}) add_set(tilt_deg);
  render();
  for (const int tilt_deg : {5, 15, 30, 50})
    check(tilt_deg, "--roll-pitch-sd-deg 90", fmt::format("deg_{}", tilt_deg));
}

/// A camera of 3 Mpx close to large lamps, which show enough stripes from aside.
TEST_F(TiltedCamera, FixesAreWithinThreeMillimetersForUnknownTiltUpTo80Degrees) {
  std::string scene = kScene;
  const auto replace = [&](const std::string& from, const std::string& to) {
    const auto at = scene.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    scene.replace(at, from.size(), to);
  };
  replace("[800, 600]", "[2000, 1500]");
  replace("[520, 520.6, 402.3, 297.4,", "[1300, 1301.5, 1003.3, 747.4,");
  replace("3.0e-5", "1.0e-5");
  constexpr std::array faster{4000, 4700, 5500, 6500, 7700, 9100};
  constexpr std::array frequencies{1600, 2000, 2500, 3100, 3800, 4700};
  for (std::size_t i = 0; i < faster.size(); ++i) {
    replace(fmt::format("diameter_m: 0.18, frequency_hz: {}", frequencies[i]),
            fmt::format("diameter_m: 0.3, frequency_hz: {}", faster[i]));
    replace("2.0e+8", "6.0e+8");
  }
  const std::array<std::pair<const char*, int>, 5> leans{
      {{"roll", 65}, {"pitch", 65}, {"roll", 70}, {"pitch", 75}, {"pitch", 80}}};
  for (const auto& [axis, degrees] : leans) {
    const double aside_m = 0.7 * std::tan(degrees * std::numbers::pi / 180);
    const bool rolls = std::string(axis) == "roll";
    captures += fmt::format(
        "  - {{folder: {}{}, exposure_s: 1.7e-5, pivots_m: [[{:.3f}, {:.3f}]], heights_m: [0.8, "
        "1.0], yaws_deg: [0], interval_s: 0.5, roll_pitch: {{{}_deg: [{}, {}]}}}}\n",
        axis, degrees, rolls ? 0.1 : 0.1 - aside_m, rolls ? aside_m - 0.05 : -0.05, axis, degrees,
        degrees);
  }
  render(scene);
  for (const auto& [axis, degrees] : leans) {
    const std::string set = fmt::format("{}{}", axis, degrees);
    SCOPED_TRACE(set);
    const auto result = locate(set, "--roll-pitch-sd-deg 90");
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    Errors errors;
    add_errors(set, errors);
    EXPECT_EQ(errors.fixes, errors.captures);
    errors.check(2, degrees == 80 ? 3e-3 : 1e-3);
    RecordProperty("steep_" + set, errors.words());
  }
}

/// Neither lean nor motion is known.
TEST_F(TiltedCamera, FixesAreWithinOneMillimeterWhileMovingWithUnknownTilt) {
  captures +=
      "  - {folder: drive, exposure_s: 5.0e-5, drive: {from_m: [-0.2, 0.35], to_m: [0.2, 0.4], "
      "speed_m_per_s: 1}, heights_m: [0.3], yaws_deg: [0], turn_rate_deg_per_s: 30, "
      "interval_s: 0.1, roll_pitch: {roll_deg: [15, 15]}}\n";
  render();
  for (const char* frames : {"", " --window 2"}) {
    const auto result =
        locate("drive", std::string("--roll-pitch-sd-deg 90 --max-speed-m-per-s 2") + frames);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    Errors errors;
    add_errors("drive", errors);
    EXPECT_EQ(errors.fixes, errors.captures);
    errors.check(2);
    RecordProperty(*frames == 0 ? "alone" : "two", errors.words());
  }
}

}  // namespace
}  // namespace vlp
