// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Choice between errors that may explain captures: moved lamps, swapped lamps, a mirrored map, or
/// the map of another room.
#include <gmock/gmock.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "calibration/map/map_errors.h"
#include "camera/lens.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// Captures without noise of a room, and a map that differs from the room.
class ChooseMapError : public testing::Test {
 protected:
  ChooseMapError() {
    room.map = make_lamp_map({{-0.8, -0.4, 1.6},
                              {0.8, -0.4, 1.6},
                              {0.7, 0.4, 1.6},
                              {-0.8, 0.5, 1.6},
                              {0.1, 0.5, 1.6},
                              {-0.3, -0.5, 1.6},
                              {0.5, 0.05, 1.6},
                              {-0.4, 0.1, 1.6}});
    room.calibration.camera = synthetic_camera();
    room.calibration.rotation_center = tilted_by(room.calibration.camera, 0.05, 1);
    options.min_offset_px = 0.02;
    map = room.map;
    take_captures(12);
  }

  void take_captures(int count) {
    frames.clear();
    for (int k = 0; k < count; ++k) {
      room.camera = {{0.15 * (k % 5) - 0.3, 0.1 * (k % 4) - 0.1, k % 2 ? 0.3 : 0.0}, 1.1 * k};
      frames.push_back({std::to_string(k), seen_from(room)});
    }
  }
  MapErrors detect() const { return detect_map_errors(frames, map, room.calibration, options); }
  Eigen::Vector3d& place(std::size_t lamp) { return map.lamps[lamp].position_m; }
  void set_survey_sd(double sd_m) {
    for (Lamp& lamp : map.lamps) lamp.sd_m = sd_m;
  }
  /// Adds errors to the room's positions, in the map, that no similarity and no lamp explains.
  void add_survey_errors(double size_m) {
    for (std::size_t i = 0; i < map.lamps.size(); ++i) {
      const double n = static_cast<double>(i);
      place(i) += size_m * Eigen::Vector3d(std::sin(9 * n + 1), std::cos(7 * n), 0);
    }
  }

  /// Columns: derivatives of the lamp positions with respect to shift, rotation and scale.
  static Eigen::MatrixXd make_similarity_columns(const LampMap& lamps) {
    Eigen::MatrixXd columns(2 * std::ssize(lamps.lamps), 4);
    for (std::size_t i = 0; i < lamps.lamps.size(); ++i) {
      const Eigen::Vector3d& p = lamps.lamps[i].position_m;
      columns.middleRows(2 * static_cast<Eigen::Index>(i), 2) << 1, 0, -p.y(), p.x(),  //
          0, 1, p.x(), p.y();
    }
    return columns;
  }
  static Eigen::VectorXd stack_positions(const LampMap& lamps) {
    Eigen::VectorXd stacked(2 * std::ssize(lamps.lamps));
    for (std::size_t i = 0; i < lamps.lamps.size(); ++i) {
      stacked.segment<2>(2 * static_cast<Eigen::Index>(i)) = lamps.lamps[i].position_m.head<2>();
    }
    return stacked;
  }
  static Eigen::MatrixXd make_projector(const LampMap& lamps) {
    const Eigen::MatrixXd columns = make_similarity_columns(lamps);
    return Eigen::MatrixXd::Identity(columns.rows(), columns.rows()) -
           columns * (columns.transpose() * columns).inverse() * columns.transpose();
  }
  /// Returns a similarity of the room minus the map, orthogonal to all similarities of the map.
  Eigen::VectorXd compute_displacement_m(const LampMap& other) const {
    const Eigen::MatrixXd of_map = make_similarity_columns(other);
    const Eigen::MatrixXd of_room = make_similarity_columns(room.map);
    const Eigen::VectorXd map_m = stack_positions(other);
    const Eigen::Matrix4d product = of_map.transpose() * of_room;
    return of_room * product.inverse() * (of_map.transpose() * map_m) - map_m;
  }
  double compute_squares_m2() const { return compute_displacement_m(map).squaredNorm(); }

  /// Returns chi^2 of the displacements without the offsets of `free` lamps, with the standard
  /// deviations of the map.
  double compute_chi_squared(const std::vector<std::size_t>& free) const {
    const Eigen::VectorXd displacement_m = compute_displacement_m(map);
    const Eigen::MatrixXd weights = compute_weights();
    double chi_squared = displacement_m.dot(weights * displacement_m);
    if (free.empty()) return chi_squared;
    const Eigen::MatrixXd columns = select_columns(free);
    const Eigen::VectorXd gradient = columns.transpose() * weights * displacement_m;
    const Eigen::MatrixXd normal = columns.transpose() * weights * columns;
    return chi_squared - gradient.dot(normal.inverse() * gradient);
  }
  /// Returns the covariance of the offsets of `free` lamps.
  Eigen::MatrixXd compute_offset_covariance_m2(const std::vector<std::size_t>& free) const {
    const Eigen::MatrixXd columns = select_columns(free);
    return (columns.transpose() * compute_weights() * columns).inverse();
  }
  Eigen::MatrixXd select_columns(const std::vector<std::size_t>& lamps) const {
    Eigen::MatrixXd columns =
        Eigen::MatrixXd::Zero(2 * std::ssize(map.lamps), 2 * std::ssize(lamps));
    for (std::size_t k = 0; k < lamps.size(); ++k) {
      columns.block<2, 2>(2 * static_cast<Eigen::Index>(lamps[k]), 2 * static_cast<Eigen::Index>(k))
          .setIdentity();
    }
    return columns;
  }
  /// Returns the pseudoinverse of the covariance of the displacements.
  Eigen::MatrixXd compute_weights() const {
    Eigen::VectorXd variances_m2(2 * std::ssize(map.lamps));
    for (std::size_t i = 0; i < map.lamps.size(); ++i) {
      const double sd_m = map.lamps[i].sd_m.value();
      variances_m2.segment<2>(2 * static_cast<Eigen::Index>(i)).setConstant(sd_m * sd_m);
    }
    const Eigen::MatrixXd projector = make_projector(map);
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(1e-9);
    decomposition.compute(projector * variances_m2.asDiagonal() * projector);
    return decomposition.pseudoInverse();
  }

  SyntheticRig room{{}, {}, {{0, 0, 0}, 0}, {}};
  LampMap map;
  std::vector<Frame> frames;
  MapErrorOptions options;
};

/// Returns the argument, between two bounds, at which an increasing function has a value.
template <typename Function>
double find_argument(double low, double high, double value, const Function& function) {
  for (int iteration = 0; iteration < 50; ++iteration) {
    const double middle = (low + high) / 2;
    (function(middle) < value ? low : high) = middle;
  }
  return (low + high) / 2;
}

TEST_F(ChooseMapError, OffsetsOfTwoMovedLampsHaveSdsFromSurveySdOfEachLamp) {
  for (std::size_t i = 0; i < 8; ++i) map.lamps[i].sd_m = 1e-4 * static_cast<double>(1 + i % 5);
  place(2) += Eigen::Vector3d(-0.02, 0.03, 0);
  place(5) += Eigen::Vector3d(0.01, 0.02, 0);
  const Eigen::MatrixXd covariance_m2 = compute_offset_covariance_m2({2, 5});
  const MapErrors found = detect();
  ASSERT_THAT(found.errors, SizeIs(2)) << describe_map_errors(found.errors);
  for (const MapError& error : found.errors) {
    EXPECT_EQ(error.kind, MapErrorKind::moved);
    ASSERT_THAT(error.lamps, SizeIs(1));
    const bool is_third = error.lamps[0] == 3;
    if (!is_third) EXPECT_EQ(error.lamps[0], 6);
    EXPECT_THAT(error.offset_m, IsNear(is_third ? Eigen::Vector3d(0.02, -0.03, 0)
                                                : Eigen::Vector3d(-0.01, -0.02, 0),
                                       2e-6));
    const Eigen::Vector2d sd_m = covariance_m2.diagonal().segment<2>(is_third ? 0 : 2).cwiseSqrt();
    EXPECT_THAT(error.sd_m.head<2>(), IsNear(sd_m, 0.002 * sd_m.norm()));
    EXPECT_EQ(error.sd_m.z(), 0);
  }
}

/// With two free lamps of eight, 28 pairs are tested together.
TEST_F(ChooseMapError, SecondMovedLampIsReportedAboveBoundForAllPairs) {
  constexpr std::size_t first = 1, second = 4;
  const double bound = -2 * std::log(0.01 / 28);
  for (std::size_t i = 0; i < 8; ++i) map.lamps[i].sd_m = 1e-4 * static_cast<double>(2 + i % 3);
  const auto move = [&](double offset_m) {
    place(first) = room.map.lamps[first].position_m + Eigen::Vector3d(0.03, 0.01, 0);
    place(second) = room.map.lamps[second].position_m + offset_m * Eigen::Vector3d(0.6, -0.8, 0);
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t other = 0; other < 8; ++other) {
      if (other == first || other == second) continue;
      smallest = std::min(smallest, compute_chi_squared({first, other}));
    }
    return smallest;
  };
  for (const double fraction : {0.997, 1.003}) {
    move(find_argument(0, 0.02, fraction * bound, move));
    ASSERT_NEAR(compute_chi_squared({first, second}), 0, 1e-3);
    std::vector<int> lamps;
    for (const MapError& error : detect().errors) {
      EXPECT_EQ(error.kind, MapErrorKind::moved);
      lamps.insert(lamps.end(), error.lamps.begin(), error.lamps.end());
    }
    if (fraction < 1) {
      EXPECT_THAT(lamps, ElementsAre(2));
    } else {
      EXPECT_THAT(lamps, testing::UnorderedElementsAre(2, 5));
    }
  }
}

/// Survey errors far above the standard deviations increase the variance of all lamps. The bound is
/// that of chi-squared if the map has the standard deviations of all lamps.
TEST_F(ChooseMapError, TooSmallSurveySdsAreIncreasedAndBoundDependsOnAllLamps) {
  constexpr std::size_t lamp = 6;
  for (const bool is_each_sd_known : {true, false}) {
    const double bound =
        is_each_sd_known ? 1 - 2 * std::log(0.01 / 8) / 10 : std::pow(0.01 / 8, -0.2);
    const auto move = [&](double offset_m) {
      map = room.map;
      set_survey_sd(1e-6);
      add_survey_errors(3e-4);
      place(lamp) += offset_m * Eigen::Vector3d(0.6, 0.8, 0);
      double smallest = std::numeric_limits<double>::infinity();
      for (std::size_t other = 0; other < 8; ++other) {
        if (other != lamp) smallest = std::min(smallest, compute_chi_squared({other}));
      }
      return smallest / compute_chi_squared({lamp});
    };
    for (const double fraction : {0.995, 1.005}) {
      move(find_argument(1e-3, 0.02, fraction * bound, move));
      const double added_m2 = 1e-12 * compute_chi_squared({lamp}) / 10;
      const double sd_m = std::sqrt(added_m2 / make_projector(map)(2 * lamp, 2 * lamp));
      if (!is_each_sd_known) map.lamps[3].sd_m.reset();
      const MapErrors found = detect();
      ASSERT_THAT(found.offsets, SizeIs(8));
      ASSERT_THAT(found.errors, SizeIs(fraction > 1 ? 1 : 0)) << is_each_sd_known;
      if (fraction < 1) continue;
      EXPECT_THAT(found.errors[0].lamps, ElementsAre(7));
      EXPECT_THAT(found.errors[0].sd_m, IsNear(Eigen::Vector3d(sd_m, sd_m, 0), 0.01 * sd_m));
    }
  }
}

/// Without known standard deviations, chi-squared of the original map has to exceed that of the
/// swapped one, with 12 degrees of freedom, by the factor (0.01 / 29)^(-2 / 12).
TEST_F(ChooseMapError, SwappedLampsAreReportedAboveBoundOfFDistribution) {
  const double bound = std::pow(0.01 / 29, -2.0 / 12);
  const auto swap_lamps = [&](double distance_m) {
    room.map.lamps[5].position_m =
        room.map.lamps[7].position_m + distance_m * Eigen::Vector3d(0.8, -0.6, 0);
    map = room.map;
    add_survey_errors(3e-4);
    const double squares_m2 = compute_squares_m2();
    std::swap(place(5), place(7));
    return compute_squares_m2() / squares_m2;
  };
  for (const double fraction : {0.998, 1.002}) {
    swap_lamps(find_argument(5e-4, 5e-3, fraction * bound, swap_lamps));
    take_captures(12);
    const MapErrors found = detect();
    const bool is_swapped = !found.errors.empty() && found.errors[0].kind == MapErrorKind::swapped;
    EXPECT_EQ(is_swapped, fraction > 1);
    if (is_swapped) EXPECT_THAT(found.errors[0].lamps, ElementsAre(6, 8));
  }
}

/// Lamps near an axis, and two beside it: the mirror image of the room is nearly the room with both
/// swapped. No other pair explains the captures.
TEST_F(ChooseMapError, SwappedLampsAreReportedEvenIfMirroredMapFitsWithinNoise) {
  room.map = make_lamp_map({{-0.9, 1e-3, 1.6},
                            {-0.6, -2e-3, 1.6},
                            {-0.2, 2e-3, 1.6},
                            {0.4, -2e-3, 1.6},
                            {0.9, 1e-3, 1.6},
                            {0.1, 0.15, 1.6},
                            {0.1, -0.15, 1.6}});
  take_captures(12);
  map = room.map;
  set_survey_sd(2e-3);
  LampMap mirrored = map;
  std::swap(place(5), place(6));
  for (std::size_t i = 0; i < 7; ++i) {
    mirrored.lamps[i].position_m = place(i).cwiseProduct(Eigen::Vector3d(1, -1, 1));
  }
  const double chi_squared = compute_displacement_m(mirrored).squaredNorm() / (2e-3 * 2e-3);
  EXPECT_GT(chi_squared, 4);
  EXPECT_LT(chi_squared, -2 * std::log(0.01 / 22));
  const MapErrors found = detect();
  ASSERT_THAT(found.errors, SizeIs(1)) << describe_map_errors(found.errors);
  EXPECT_EQ(found.errors[0].kind, MapErrorKind::swapped);
  EXPECT_THAT(found.errors[0].lamps, ElementsAre(6, 7));
}

/// With little noise the adjustment may reject all detections of both lamps.
TEST_F(ChooseMapError, SwappedLampsAreNamedInEachPairOfEight) {
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      map = room.map;
      std::swap(place(i), place(k));
      const MapErrors found = detect();
      ASSERT_THAT(found.errors, SizeIs(1)) << i << " " << k;
      EXPECT_EQ(found.errors[0].kind, MapErrorKind::swapped);
      EXPECT_THAT(found.errors[0].lamps,
                  testing::UnorderedElementsAre(map.lamps[i].id, map.lamps[k].id));
    }
  }
}

/// A square with two opposite corners swapped is its mirror image, and the square with the other
/// two swapped. A parallelogram has no such mirror image.
TEST_F(ChooseMapError, EquallyGoodSwapsOfContradictedMapAreNotNamed) {
  for (const double shear_m : {0.0, 0.2}) {
    room.map = make_lamp_map({{-0.5, -0.5, 1.6},
                              {0.5 - shear_m, -0.5, 1.6},
                              {0.5, 0.5, 1.6},
                              {-0.5 + shear_m, 0.5, 1.6}});
    map = room.map;
    std::swap(place(0), place(2));
    Random random(5);
    for (int draw = 0; draw < 8; ++draw) {
      take_captures(12);
      for (Frame& frame : frames) {
        for (Detection& detection : frame.detections) detection.sigma_px = 0.1;
        frame.detections = with_noise(frame.detections, random);
      }
      const MapErrors found = detect();
      ASSERT_THAT(found.errors, SizeIs(1));
      EXPECT_EQ(found.errors[0].kind,
                shear_m == 0 ? MapErrorKind::mirrored : MapErrorKind::other_room)
          << describe_map_errors(found.errors);
      if (shear_m == 0) EXPECT_THAT(found.offsets, IsEmpty()) << "contradicted";
    }
  }
}

/// No mirrored map explains captures of a map with two lamps swapped, and no alternative those of
/// another room.
TEST_F(ChooseMapError, OtherMapsWhoseAdjustmentFailsAreNotNamed) {
  std::swap(place(0), place(5));
  const MapErrors swapped = detect();
  ASSERT_THAT(swapped.errors, SizeIs(1)) << describe_map_errors(swapped.errors);
  EXPECT_EQ(swapped.errors[0].kind, MapErrorKind::swapped);
  EXPECT_THAT(swapped.errors[0].lamps, testing::UnorderedElementsAre(1, 6));
  for (std::size_t i = 0; i < 8; ++i)
    place(i) = {std::sin(9. * double(i)), std::cos(7. * double(i)), 1.6};
  const MapErrors other = detect();
  ASSERT_THAT(other.errors, SizeIs(1)) << describe_map_errors(other.errors);
  EXPECT_EQ(other.errors[0].kind, MapErrorKind::other_room);
}

TEST_F(ChooseMapError, OtherRoomIsNotReportedIfMovedLampExplainsLargeDisplacements) {
  place(2).head<2>() -= Eigen::Vector2d(0.5, 0.3);
  const MapErrors found = detect();
  ASSERT_GT(std::sqrt(compute_squares_m2() / 8), 0.1) << "more than a tenth of the map size";
  ASSERT_THAT(found.errors, SizeIs(1)) << describe_map_errors(found.errors);
  EXPECT_EQ(found.errors[0].kind, MapErrorKind::moved);
  EXPECT_THAT(found.errors[0].lamps, ElementsAre(3));
  EXPECT_THAT(found.errors[0].offset_m, IsNear(Eigen::Vector3d(0.5, 0.3, 0), 1e-5));
}

/// Three captures of all lamps, and captures of three lamps with a wrong detection in opposite
/// directions. These are rejected as a whole, the larger errors first.
TEST_F(ChooseMapError, OffsetsAreClearedIfMoreThanHalfOfDetectionsAreRejected) {
  take_captures(3);
  const std::vector<Frame> all = frames;
  for (const int pairs : {4, 5}) {
    frames = all;
    for (int k = 0; k < 2 * pairs; ++k) {
      Frame frame = all[1];
      frame.detections = {all[1].detections[0], all[1].detections[2], all[1].detections[4]};
      frame.detections[1].pixel.y() += (k % 2 == 0 ? 1 : -1) * (k / 2 % 2 == 0 ? 40.0 : 2.0);
      frames.push_back(frame);
    }
    const MapErrors found = detect();
    if (pairs == 4) {
      EXPECT_THAT(found.offsets, SizeIs(8)) << "24 of 48 detections are left";
      for (const LampOffset& offset : found.offsets) EXPECT_EQ(offset.captures, 3);
      EXPECT_TRUE(found.errors.empty() || found.errors[0].kind != MapErrorKind::other_room);
    } else {
      EXPECT_THAT(found.offsets, IsEmpty()) << "24 of 54";
      ASSERT_THAT(found.errors, SizeIs(1));
      EXPECT_EQ(found.errors[0].kind, MapErrorKind::other_room);
    }
  }
}

/// The detections of a lamp in its three captures contradict each other.
TEST_F(ChooseMapError, LampWithoutAnyConsistentCaptureIsReported) {
  for (std::size_t k = 0; k < frames.size(); ++k) {
    Detection& detection = frames[k].detections[3];
    ASSERT_EQ(detection.lamp, 4);
    if (k >= 3) {
      frames[k].detections.erase(frames[k].detections.begin() + 3);
    } else {
      const double angle = 2 * static_cast<double>(k);
      detection.pixel += 40 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    }
  }
  const MapErrors found = detect();
  EXPECT_THAT(found.offsets, SizeIs(7));
  ASSERT_THAT(found.errors, SizeIs(1)) << describe_map_errors(found.errors);
  EXPECT_EQ(found.errors[0].kind, MapErrorKind::inconsistent);
  EXPECT_THAT(found.errors[0].lamps, ElementsAre(4));
  EXPECT_EQ(found.errors[0].captures, found.errors[0].contradicting_captures);
  EXPECT_GE(found.errors[0].captures, 2);
}

TEST_F(ChooseMapError, MovedLampWithOutliersIsReportedOnce) {
  take_captures(20);
  place(3).x() += 0.05;
  for (std::size_t k = 0; k < 4; ++k) frames[5 * k].detections[3].pixel.y() += k % 2 ? 70 : -70;
  const MapErrors found = detect();
  ASSERT_THAT(found.errors, SizeIs(1)) << describe_map_errors(found.errors);
  EXPECT_EQ(found.errors[0].kind, MapErrorKind::moved);
  EXPECT_THAT(found.errors[0].lamps, ElementsAre(4));
  place(3) = room.map.lamps[3].position_m;
  const MapErrors unmoved = detect();
  ASSERT_THAT(unmoved.errors, SizeIs(1)) << describe_map_errors(unmoved.errors);
  EXPECT_EQ(unmoved.errors[0].kind, MapErrorKind::inconsistent);
  EXPECT_THAT(unmoved.errors[0].lamps, ElementsAre(4));
  place(6).x() += 0.05;
  const MapErrors two = detect();
  ASSERT_THAT(two.errors, SizeIs(2)) << describe_map_errors(two.errors);
  EXPECT_EQ(two.errors[0].kind, MapErrorKind::moved);
  EXPECT_THAT(two.errors[0].lamps, ElementsAre(7));
  EXPECT_EQ(two.errors[1].kind, MapErrorKind::inconsistent);
  EXPECT_THAT(two.errors[1].lamps, ElementsAre(4));
}

/// Returns the number of captures of each lamp that contribute to its offset.
std::vector<int> count_captures(const MapErrors& found) {
  std::vector<int> captures;
  for (const LampOffset& offset : found.offsets) captures.push_back(offset.captures);
  return captures;
}

/// Pixels without a ray, three detections at one pixel, and detections whose distances require a
/// camera above one of the lamps.
TEST_F(ChooseMapError, CapturesThatNoPoseExplainsAreIgnored) {
  room.map.lamps[4].position_m = {-0.3, 0.3, 1.6};
  room.map.lamps[6].position_m = {-0.2, 0, 1.6};
  room.map.lamps[7].position_m.z() = 0.9;
  map = room.map;
  take_captures(12);
  std::vector<Detection>& first = frames[0].detections;
  ASSERT_THAT(first, SizeIs(8));
  first[2].pixel.x() = std::numeric_limits<double>::quiet_NaN();
  std::vector<Detection>& second = frames[2].detections;
  ASSERT_THAT(second, SizeIs(8));
  second = {second[0], second[1], second[2]};
  for (Detection& detection : second) detection.pixel = {300, 200};
  for (const std::size_t k : {4U, 6U, 8U}) {
    std::vector<Detection>& third = frames[k].detections;
    ASSERT_THAT(third, SizeIs(8));
    third = {third[4], third[6], third[7]};
    third[0].pixel = {100, 100};
    third[1].pixel = {700, 100};
    third[2].pixel = {400, 550};
  }
  const MapErrors found = detect();
  EXPECT_THAT(found.errors, IsEmpty());
  EXPECT_THAT(count_captures(found), ElementsAre(8, 8, 7, 8, 8, 8, 8, 8));
  for (const LampOffset& offset : found.offsets) {
    EXPECT_THAT(offset.offset_m, IsNear(Eigen::Vector2d(0, 0), 1e-6)) << offset.lamp;
  }
}

/// Fisheye that is tilted by 40 degrees: a detection far off its axis lies below the horizon.
TEST_F(ChooseMapError, DetectionsBelowHorizonAreIgnored) {
  room.calibration.camera = fisheye_camera();
  room.calibration.rotation_center = tilted_by(room.calibration.camera, 0.7, 0.4);
  take_captures(6);
  const Eigen::Matrix3d camera_from_level =
      compute_level_from_camera_matrix(room.calibration, Correction::all).transpose();
  const Lens lens(room.calibration.camera.lens_model, room.calibration.camera.intrinsics);
  ASSERT_THAT(frames[2].detections, SizeIs(8));
  const Eigen::Vector3d zenith_in_camera = camera_from_level.col(2);
  const Eigen::Vector3d away =
      (Eigen::Vector3d::UnitZ() - zenith_in_camera.z() * zenith_in_camera).normalized();
  const auto pixel = lens.project_point(away - 0.1 * zenith_in_camera);
  ASSERT_TRUE(pixel);
  frames[2].detections[5].pixel = *pixel;
  const MapErrors found = detect();
  EXPECT_THAT(found.errors, IsEmpty());
  EXPECT_THAT(count_captures(found), ElementsAre(6, 6, 6, 6, 6, 5, 6, 6));
  for (const LampOffset& offset : found.offsets) {
    EXPECT_THAT(offset.offset_m, IsNear(Eigen::Vector2d(0, 0), 1e-6)) << offset.lamp;
  }
}

}  // namespace
}  // namespace vlp
