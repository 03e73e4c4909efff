// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Centers of ellipses in the image compared with the images of discs' centers.
#include "lamps/shape/light_center_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "camera/lens.h"
#include "geometry/angles.h"
#include "lamps/rendered_captures.h"

namespace vlp {
namespace {

constexpr ImageSize kUnknownLensImage{800, 600};
constexpr double kHalf_px = 500;  // half of its diagonal

/// Image of a disc on a ceiling, for a camera tilted towards x, with a lens whose axis is at the
/// image center. Positions and radii on the ceiling are slopes.
struct DiscProjection {
  Eigen::Vector2d shift_px, pixel;
  double radius_px;
};

std::optional<DiscProjection> project_disc(const Lens& lens, double tilt_rad,
                                           const Eigen::Vector2d& place, double radius) {
  const Eigen::Matrix3d camera_from_level =
      Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const auto project_to_pixel = [&](const Eigen::Vector2d& on_ceiling) {
    return lens.project_point(camera_from_level * on_ceiling.homogeneous());
  };
  std::vector<Eigen::Vector2d> rim;
  for (int i = 0; i < 200; ++i) {
    const double angle = 2 * std::numbers::pi * i / 200;
    const auto pixel =
        project_to_pixel(place + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    if (!pixel) return std::nullopt;
    rim.push_back(*pixel);
  }
  const auto center = project_to_pixel(place);
  if (!center) return std::nullopt;
  // Conic a x^2 + b x y + c y^2 + d x + e y = 1 about the projected center.
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(rim.size()), 5);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Eigen::Vector2d at = rim[static_cast<std::size_t>(i)] - *center;
    rows.row(i) << at.x() * at.x(), at.x() * at.y(), at.y() * at.y(), at.x(), at.y();
  }
  const Eigen::VectorXd conic =
      rows.colPivHouseholderQr().solve(Eigen::VectorXd::Ones(rows.rows()));
  Eigen::Matrix2d square;
  square << conic[0], conic[1] / 2, conic[1] / 2, conic[2];
  const Eigen::Vector2d shift = -square.inverse() * conic.tail<2>() / 2;
  const double scale = 1 + shift.dot(square * shift);
  return DiscProjection{shift, *center + shift, std::sqrt(scale / std::sqrt(square.determinant()))};
}

/// Returns the bound on the shift: the standard deviation is per axis.
double bound_px(const DiscProjection& disc) {
  MeasuredLight light{};
  light.pixel = disc.pixel;
  light.radius_px = disc.radius_px;
  return std::numbers::sqrt2 * predict_center_sd_without_lens_px(light, kUnknownLensImage);
}

Lens make_lens(LensModel model, double focal_px, std::vector<double> coefficients) {
  std::vector<double> parameters = {focal_px, focal_px, (kUnknownLensImage.width - 1) / 2.0,
                                    (kUnknownLensImage.height - 1) / 2.0};
  parameters.insert(parameters.end(), coefficients.begin(), coefficients.end());
  return Lens(model, parameters);
}

TEST(PredictCenterSdWithoutLens, BoundsCenterShiftOfEquidistantLens) {
  const Lens equidistant = make_lens(LensModel::fisheye, kHalf_px, {0, 0, 0, 0});
  int discs = 0;
  for (const double off_axis : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    for (const double radius : {0.02, 0.05, 0.08}) {
      const auto disc = project_disc(equidistant, 0, {std::tan(off_axis), 0}, radius);
      ASSERT_TRUE(disc) << off_axis;
      EXPECT_LT(disc->shift_px.norm(), bound_px(*disc)) << off_axis << ", " << radius;
      if (off_axis > 0.3) {
        EXPECT_GT(disc->shift_px.norm(), bound_px(*disc) / 1.5) << off_axis << ", " << radius;
      }
      EXPECT_LT(disc->shift_px.x(), 0) << "towards the axis";
      ++discs;
    }
  }
  EXPECT_EQ(discs, 15);
}

TEST(PredictCenterSdWithoutLens, BoundsCenterShiftOfTiltedPinholeCamera) {
  const Lens pinhole = make_lens(LensModel::pinhole, kHalf_px, {});
  for (const double tilt_deg : {2.0, 5.0, 10.0}) {
    const double tilt_rad = rad_from_deg(tilt_deg);
    // The disc is at the image center.
    const auto disc = project_disc(pinhole, tilt_rad, {-std::tan(tilt_rad), 0}, 0.06);
    ASSERT_TRUE(disc);
    EXPECT_LT(disc->shift_px.norm(), 1.03 * bound_px(*disc));
    const double expected_px = std::pow(disc->radius_px, 2) * std::tan(tilt_rad) / kHalf_px;
    EXPECT_NEAR(disc->shift_px.norm() / expected_px, 1, 0.03);
  }
}

TEST(PredictCenterSdWithoutLens, IncreasesWithRadiusAndDistanceFromImageCenter) {
  MeasuredLight light{};
  light.pixel = {399.5, 299.5};
  light.radius_px = 30;
  const double in_the_middle = predict_center_sd_without_lens_px(light, kUnknownLensImage);
  light.pixel.x() += 300;
  const double off_axis = predict_center_sd_without_lens_px(light, kUnknownLensImage);
  EXPECT_GT(off_axis, 3 * in_the_middle);
  light.radius_px = 60;
  EXPECT_DOUBLE_EQ(predict_center_sd_without_lens_px(light, kUnknownLensImage), 4 * off_axis);
  light.outline_kind = LightOutline::rectangle;
  EXPECT_EQ(predict_center_sd_without_lens_px(light, kUnknownLensImage), 0)
      << "a rectangle's edges say it";
}

/// Returns the score of a scene without its lens: errors relative to the reported sigma.
Score without_lens(const std::string& scene, std::size_t step) {
  const Captures captures(scene, "check");
  DetectorCamera camera = make_detector_camera(captures.calibration());
  camera.lens.reset();
  return captures.score(step, LightDetector(captures.lamps(), camera));
}

TEST(LightDetector, SigmaMatchesCenterErrorsForUnknownLens) {
  for (const auto& [scene, step] :
       {std::pair("paper-rig", 12), {"paper-rig-faulty", 24}, {"wide", 16}}) {
    const Score score = without_lens(scene, std::size_t(step));
    EXPECT_GT(score.lamps, 80) << scene;
    EXPECT_EQ(score.wrong, 0) << scene;
    EXPECT_GT(score.rms_px(), 0.3) << scene << ": there is something to state";
    EXPECT_GT(score.chi_square / score.lamps, 0.3) << scene;
    EXPECT_LT(score.chi_square / score.lamps, 1.5) << scene;
  }
}

}  // namespace
}  // namespace vlp
