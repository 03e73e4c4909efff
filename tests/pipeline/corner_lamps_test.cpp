// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// From the corners of a board to poses of the camera: vlp-convert and vlp-locate on computed
/// views.
#include <fmt/core.h>
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fstream>
#include <set>

#include "camera/lens.h"
#include "captures/detections_table.h"
#include "captures/fixes_table.h"
#include "geometry/frames.h"
#include "rig/board_layout.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "support/csv_cells.h"
#include "support/matchers.h"
#include "support/program.h"
#include "support/random.h"
#include "support/synthetic_rig.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

constexpr int kViews = 120;
constexpr double kNoise_px = 0.05;
const std::string kTagBoard =
    "target_type: 'aprilgrid'\ntag_cols: 6\ntag_rows: 5\ntag_size: 0.088\ntag_spacing: 0.3\n";
const std::string kChessboard =
    "format: vlp-board/1\nkind: chessboard\ncols: 10\nrows: 7\nsquare_size_m: 0.06\n";

struct PoseOfView {
  Eigen::Vector3d position_m;
  Eigen::Matrix3d world_from_camera;
  Eigen::Matrix<double, 6, 6> covariance;
};

/// Reads poses.csv by its column names.
std::map<std::string, PoseOfView> read_poses(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto number = [&](std::size_t row, const std::string& column) {
    return read_number(csv, row, column);
  };
  const std::array<std::string, 6> names{"x", "y", "z", "rx", "ry", "rz"};
  std::map<std::string, PoseOfView> poses;
  for (std::size_t row = 0; row < csv.num_rows(); ++row) {
    const Eigen::Quaterniond q(number(row, "qw"), number(row, "qx"), number(row, "qy"),
                               number(row, "qz"));
    EXPECT_NEAR(q.norm(), 1, 1e-8);
    PoseOfView pose{{number(row, "x_m"), number(row, "y_m"), number(row, "z_m")},
                    q.normalized().toRotationMatrix(),
                    {}};
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t k = i; k < 6; ++k) {
        const char* unit = k < 3 ? "_m2" : i < 3 ? "_m_rad" : "_rad2";
        const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(k);
        pose.covariance(a, b) = pose.covariance(b, a) =
            number(row, "cov_" + names[i] + "_" + names[k] + unit);
      }
    }
    poses.emplace(read_text(csv, row, "image"), pose);
  }
  return poses;
}

/// A hand-held camera 0.9 to 1.4 m in front of a board whose printed side is at z > 0.
class CornersToPoses : public testing::Test {
 protected:
  const TemporaryFolder folder;
  Calibration calibration{synthetic_camera(), {}, {}, {}, {}};
  std::map<std::string, PoseOfView> truth;
  Random random{5};

  CornersToPoses() {
    write_calibration(folder / "camera.yaml", calibration);
    for (int i = 0; i < kViews; ++i) {
      const Eigen::Vector3d middle_m(0.33 + random.uniform(-0.1, 0.1),
                                     0.27 + random.uniform(-0.1, 0.1), 0);
      const double tilt_rad = random.uniform(0, 0.7), azimuth_rad = random.uniform(-3, 3);
      const Eigen::Vector3d towards(std::sin(tilt_rad) * std::cos(azimuth_rad),
                                    std::sin(tilt_rad) * std::sin(azimuth_rad), std::cos(tilt_rad));
      Eigen::Matrix3d world_from_camera;
      world_from_camera.col(2) = -towards;
      const double roll_rad = random.uniform(-3, 3);
      world_from_camera.col(0) =
          Eigen::Vector3d(std::cos(roll_rad), std::sin(roll_rad), 0).cross(towards).normalized();
      world_from_camera.col(1) = world_from_camera.col(2).cross(world_from_camera.col(0));
      truth.emplace(
          fmt::format("{:04}.png", i),
          PoseOfView{middle_m + random.uniform(0.9, 1.4) * towards, world_from_camera, {}});
    }
  }

  std::string path(const std::string& name) const { return (folder / name).string(); }

  std::optional<Eigen::Vector2d> pixel_of(const PoseOfView& view, const Eigen::Vector3d& point_m,
                                          double noise_px) {
    const Camera& camera = calibration.camera;
    const auto pixel =
        Lens(camera.lens_model, camera.intrinsics)
            .project_point(view.world_from_camera.transpose() * (point_m - view.position_m));
    if (!pixel || !(pixel->minCoeff() > 1) || !(pixel->x() < 798) || !(pixel->y() < 598))
      return std::nullopt;
    return *pixel + noise_px * Eigen::Vector2d(random.normal(), random.normal());
  }

  /// Writes board.yaml and corners.csv of tags. Tag 0 is at the bottom left and x to the right.
  void see_tags(double noise_px) {
    folder.file("board.yaml", kTagBoard);
    std::ofstream csv(folder / "corners.csv");
    csv << "image,tag,corner,u_px,v_px,sd_px\n";
    for (const auto& [image, view] : truth) {
      for (int tag = 0; tag < 30; ++tag) {
        for (int corner = 0; corner < 4; ++corner) {
          const double right = corner == 1 || corner == 2 ? 1 : 0, up = corner >= 2 ? 1 : 0;
          const Eigen::Vector3d point_m(0.088 * (1.3 * (tag % 6) + right),
                                        0.088 * (1.3 * (tag / 6) + up), 0);
          if (const auto pixel = pixel_of(view, point_m, noise_px))
            csv << fmt::format("{},{},{},{},{},{}\n", image, tag, corner, pixel->x(), pixel->y(),
                               noise_px);
        }
      }
    }
  }
  /// Writes board.yaml, and the corners of a chessboard as corners.csv and corners.vnl.
  void see_squares() {
    folder.file("board.yaml", kChessboard);
    std::ofstream csv(folder / "corners.csv"), vnl(folder / "corners.vnl");
    csv << "image,corner,u_px,v_px\n";
    vnl << "# filename x y level\n";
    for (const auto& [image, view] : truth) {
      for (int corner = 0; corner < 54; ++corner) {
        const Eigen::Vector3d point_m(0.06 * (corner % 9), 0.06 * (5 - corner / 9), 0);
        const auto pixel = pixel_of(view, point_m, 0);
        vnl << image << (pixel ? fmt::format(" {} {} 1\n", pixel->x(), pixel->y()) : " - - -\n");
        if (pixel) csv << fmt::format("{},{},{},{}\n", image, corner, pixel->x(), pixel->y());
      }
    }
  }

  std::string convert(const std::string& corners, const std::string& options = "") const {
    const auto result =
        run_program("vlp-convert " + path(corners) + " --board " + path("board.yaml") +
                    " --to lamps -o " + path("points") + " " + options);
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.output;
  }
  void locate(const std::string& lamps = "points/lamps.yaml") const {
    const auto result =
        run_program("vlp-locate " + path("points/detections.csv") + " --lamps " + path(lamps) +
                    " --calibration " + path("camera.yaml") + " --roll-pitch-sd-deg 90 -o " +
                    path("fixes.csv") + " --poses " + path("poses.csv"));
    EXPECT_EQ(result.exit_code, 0) << result.errors;
  }
  void expect_exact_poses(double tolerance_m) const {
    const auto poses = read_poses(folder / "poses.csv");
    ASSERT_EQ(poses.size(), truth.size());
    for (const auto& [image, pose] : poses) {
      const PoseOfView& expected = truth.at(image);
      EXPECT_THAT(pose.position_m, IsNear(expected.position_m, tolerance_m)) << image;
      EXPECT_LT((pose.world_from_camera - expected.world_from_camera).norm(), tolerance_m) << image;
    }
  }
  /// Returns the mean of e' C^-1 e / 6 over the views.
  double compute_normalized_squared_error() const {
    const auto poses = read_poses(folder / "poses.csv");
    EXPECT_EQ(poses.size(), truth.size());
    double sum = 0;
    for (const auto& [image, pose] : poses) {
      const PoseOfView& expected = truth.at(image);
      const Eigen::AngleAxisd rotation(pose.world_from_camera *
                                       expected.world_from_camera.transpose());
      Eigen::Matrix<double, 6, 1> error;
      error << pose.position_m - expected.position_m, rotation.angle() * rotation.axis();
      sum += error.dot(pose.covariance.inverse() * error) / 6;
    }
    return sum / static_cast<double>(poses.size());
  }
};

TEST_F(CornersToPoses, PosesOfTagBoardEqualTruth) {
  see_tags(0);
  EXPECT_THAT(convert("corners.csv", "--sigma-px 0.1"), HasSubstr("0 from sd_px, "));
  const LampMap map = read_lamp_map(folder / "points/lamps.yaml");
  EXPECT_TRUE(map.lamps_below_camera);
  ASSERT_EQ(map.lamps.size(), 120U);
  for (const Lamp& lamp : map.lamps) {
    if (lamp.id == 4 * 7 + 2) {
      EXPECT_THAT(lamp.position_m, IsNear(Eigen::Vector3d(0.088 * 2.3, 0.088 * 2.3, 0), 1e-12));
    }
    EXPECT_FALSE(lamp.sd_m);
  }
  locate();
  expect_exact_poses(1e-5);
  for (const FixRow& row : read_fixes(folder / "fixes.csv")) {
    ASSERT_TRUE(row.fix && row.fix->inclination) << row.image;
    EXPECT_THAT(row.fix->pose.position_m, IsNear(truth.at(row.image).position_m, 1e-5));
    const Eigen::Matrix3d world_from_camera =
        rotation_about_z(row.fix->pose.yaw_rad) *
        level_rotation_from_inclination(*row.fix->inclination) *
        Eigen::Vector3d(1, -1, -1).asDiagonal();
    EXPECT_LT((world_from_camera - truth.at(row.image).world_from_camera).norm(), 1e-5);
  }
}

/// A chessboard rotated by 180 degrees looks the same: its rows point to the right in the image.
TEST_F(CornersToPoses, PosesOfChessboardEqualTruthFromBothFormats) {
  std::erase_if(truth,
                [](const auto& view) { return !(view.second.world_from_camera(0, 0) > 0.2); });
  ASSERT_GT(truth.size(), 30U);
  see_squares();
  for (const char* corners : {"corners.csv", "corners.vnl"}) {
    SCOPED_TRACE(corners);
    convert(corners, "--sigma-px 0.1 --sd-m 0.0001");
    const LampMap map = read_lamp_map(folder / "points/lamps.yaml");
    ASSERT_EQ(map.lamps.size(), 54U);
    EXPECT_EQ(map.lamps[0].sd_m, 0.0001);
    // Level 1 of mrcal halves the weight.
    const auto frames = read_detections(folder / "points/detections.csv");
    ASSERT_EQ(frames.size(), truth.size());
    EXPECT_EQ(frames[0].detections[0].sigma_px, corners[8] == 'c' ? 0.1 : 0.2);
    locate();
    expect_exact_poses(1e-5);
  }
}

TEST_F(CornersToPoses, CovarianceMatchesErrorsOfCameraThatLooksDown) {
  see_tags(kNoise_px);
  const std::string printed = convert("corners.csv");
  EXPECT_THAT(printed, HasSubstr("sigma_px      14400 from sd_px\n"));
  locate();
  // 720 squares: three standard deviations of their mean are 0.16.
  EXPECT_NEAR(compute_normalized_squared_error(), 1, 0.16);
}

/// A fix takes at most 256 lamps; the lamps that are left are spread over the board.
TEST_F(CornersToPoses, KeepsEveryNthCornerOfLargeBoard) {
  folder.file("board.yaml",
              "format: vlp-board/1\nkind: chessboard\ncols: 21\nrows: 20\nsquare_size_m: 0.02\n");
  {
    std::ofstream csv(folder / "corners.csv");
    csv << "image,corner,u_px,v_px\n";
    for (int corner = 0; corner < 380; ++corner)
      csv << fmt::format("a.png,{},{},{}\n", corner, 30 * (corner % 20), 30 * (corner / 20));
  }
  const std::string printed = convert("corners.csv", "--sigma-px 0.1");
  EXPECT_THAT(printed, HasSubstr("detections    190 in 1 images, in detections.csv\n"
                                 "sigma_px      0 from sd_px, 190 of 0.1 px from --sigma-px\n"
                                 "left out      190 corners: a fix takes at most 256"));
  const auto frames = read_detections(folder / "points/detections.csv");
  ASSERT_EQ(frames.size(), 1U);
  ASSERT_EQ(frames[0].detections.size(), 190U);
  EXPECT_EQ(frames[0].detections[0].lamp, 0);
  EXPECT_EQ(frames[0].detections[189].lamp, 378);
}

}  // namespace
}  // namespace vlp
