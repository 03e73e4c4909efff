// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lamp_causes.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "calibration/map/map_errors.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

constexpr std::size_t kMinFrames = 3;
constexpr int kPoseStates = 4;
constexpr double kMillimeters = 1e3;
/// Errors of the lens, and those of centers found at another tilt, are no noise.
constexpr double kMinNoiseFactor = 3;

/// Columns of the Jacobian that belong to one group of unknowns.
struct Columns {
  Eigen::Index first = 0, size = 0;
};

/// Unknowns that captures of one step have in common, without those of other steps.
struct StepColumns {
  Columns tilt, displacement, shift, lens;
};

/// Order of the columns of all unknowns that are common to captures.
struct Layout {
  /// Roll and pitch of the camera, its displacement in the level camera, and fx, fy, cx, cy, of all
  /// steps. `lamp_lens` is the lens of all steps without the knowledge from the boards.
  Columns tilt, displacement, lens, lamp_lens;
  /// Displacement of each lamp, and error of its survey if it has an sd_m.
  std::map<int, Columns> lamps, survey;
  std::vector<StepColumns> steps;
  Eigen::Index size = 0;

  Layout(std::span<const StepCaptures> captures, const LampMap& map) {
    tilt = add(2), displacement = add(2), lens = add(4), lamp_lens = add(4);
    for (const Lamp& lamp : map.lamps) {
      lamps[lamp.id] = add(3);
      if (lamp.sd_m > 0) survey[lamp.id] = add(3);
    }
    for (std::size_t i = 0; i < captures.size(); ++i)
      steps.push_back({add(2), add(2), add(3), add(4)});
  }

 private:
  Columns add(Eigen::Index count) { return {std::exchange(size, size + count), count}; }
};

/// Normal equations of all unknowns that are common to captures: the poses are eliminated.
struct CommonEquations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
  double squares = 0, degrees_of_freedom = 0;
  std::size_t captures = 0;

  explicit CommonEquations(Eigen::Index size)
      : normal(Eigen::MatrixXd::Zero(size, size)), gradient(Eigen::VectorXd::Zero(size)) {}

  void add_prior(const Columns& columns, const Eigen::MatrixXd& information) {
    normal.block(columns.first, columns.first, columns.size, columns.size) += information;
  }

  /// Adds the weighted rows of one capture; eliminates its pose.
  void add_capture(Eigen::MatrixXd common, const Eigen::MatrixXd& pose, Eigen::VectorXd residual) {
    const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(pose).householderQ() *
                              Eigen::MatrixXd::Identity(pose.rows(), kPoseStates);
    common -= q * (q.transpose() * common);
    residual -= q * (q.transpose() * residual);
    normal.noalias() += common.transpose() * common;
    gradient.noalias() += common.transpose() * residual;
    squares += residual.squaredNorm();
    degrees_of_freedom += static_cast<double>(pose.rows() - kPoseStates);
    ++captures;
  }
};

/// Weighted rows of one capture.
class CaptureRows {
 public:
  CaptureRows(Eigen::Index rows, Eigen::Index columns)
      : common_(Eigen::MatrixXd::Zero(rows, columns)),
        pose_(Eigen::MatrixXd::Zero(rows, kPoseStates)),
        residual_(Eigen::VectorXd::Zero(rows)) {}

  /// Adds residuals of standard deviation `sd` with their derivatives by the pose.
  void append(const Eigen::VectorXd& residual, const Eigen::MatrixXd& pose, double sd) {
    row_ += size_;
    size_ = residual.size();
    sd_ = sd;
    residual_.segment(row_, size_) = residual / sd;
    pose_.block(row_, 0, size_, pose.cols()) = pose / sd;
  }
  /// Sets the derivatives of the appended rows by unknowns common to captures.
  void set(const Columns& columns, const Eigen::MatrixXd& jacobian) {
    common_.block(row_, columns.first, size_, columns.size) = jacobian / sd_;
  }
  void add_to(CommonEquations& equations) const {
    const Eigen::Index rows = row_ + size_;
    equations.add_capture(common_.topRows(rows), pose_.topRows(rows), residual_.head(rows));
  }

 private:
  Eigen::MatrixXd common_, pose_;
  Eigen::VectorXd residual_;
  Eigen::Index row_ = 0, size_ = 0;
  double sd_ = 1;
};

/// Linear equations of all captures at the fixes of their frames.
class LampEquations {
 public:
  LampEquations(std::span<const StepCaptures> steps, const LampMap& map,
                const Calibration& calibration, const CauseOptions& options)
      : layout_(steps, map),
        equations_(layout_.size),
        map_(map),
        camera_(calibration.camera),
        positioner_(map, calibration),
        options_(options) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      for (const Frame& frame : steps[i].frames) add_frame(frame, steps[i], layout_.steps[i]);
    }
    add_priors(calibration);
  }
  const Layout& layout() const { return layout_; }
  const CommonEquations& equations() const { return equations_; }
  /// Returns the displacement of a lamp at the mean height that appears as one pixel.
  double lamp_offset_per_px() const {
    double lamps_z_m = 0;
    for (const Lamp& lamp : map_.lamps) lamps_z_m += lamp.position_m.z();
    const double height_m = lamps_z_m / static_cast<double>(map_.lamps.size()) -
                            cameras_z_m_ / static_cast<double>(equations_.captures);
    return height_m / camera_.focal_px().mean();
  }

 private:
  void add_frame(const Frame& frame, const StepCaptures& step, const StepColumns& columns) {
    const auto entry = step.positions.find(frame.image);
    const Capture capture = entry == step.positions.end() ? Capture{} : entry->second;
    Sensors sensors;
    sensors.inclination = capture.inclination;
    const Fix fix = positioner_.compute_position_fix(frame.detections, sensors);
    constexpr int min_lamps = 3;
    if (!fix.has_succeeded() || fix.lamps < min_lamps) return;
    CaptureRows rows(2 * std::ssize(frame.detections) + 3, layout_.size);
    for (const Detection& detection : frame.detections)
      add_detection(detection, fix, columns, rows);
    if (capture.x_m && capture.y_m) add_position(capture, fix.state.pose, columns, rows);
    rows.add_to(equations_);
    cameras_z_m_ += fix.state.pose.position_m.z();
  }

  void add_detection(const Detection& detection, const Fix& fix, const StepColumns& columns,
                     CaptureRows& rows) {
    const DetectionResidual residual = positioner_.compute_detection_residual(detection, fix);
    if (!residual.residual_px.allFinite()) return;
    const auto& jacobian = residual.predicted.jacobian;
    constexpr double unstated_sd_px = 0.1;
    rows.append(residual.residual_px, jacobian.leftCols<kPoseStates>(),
                detection.sigma_px.value_or(unstated_sd_px));
    for (const Columns& tilt : {layout_.tilt, columns.tilt})
      rows.set(tilt, jacobian.middleCols<2>(kBodyRoll));
    Eigen::Matrix<double, 2, 4> lens;
    const Eigen::Vector2d ray =
        (residual.predicted.pixel - camera_.principal_point_px()).cwiseQuotient(camera_.focal_px());
    lens << ray.x(), 0, 1, 0, 0, ray.y(), 0, 1;
    for (const Columns& each : {layout_.lens, layout_.lamp_lens, columns.lens})
      rows.set(each, lens);
    // Moving a lamp is moving the camera in the opposite direction.
    for (const auto* lamps : {&layout_.lamps, &layout_.survey}) {
      if (const auto lamp = lamps->find(detection.lamp); lamp != lamps->end())
        rows.set(lamp->second, -jacobian.leftCols<3>());
    }
  }

  void add_position(const Capture& capture, const Pose& pose, const StepColumns& columns,
                    CaptureRows& rows) {
    const Eigen::Index size = capture.z_m ? 3 : 2;
    const Eigen::Vector3d known_m(*capture.x_m, *capture.y_m, capture.z_m.value_or(0));
    const Eigen::MatrixXd identity = Eigen::Matrix3d::Identity().topRows(size);
    rows.append((known_m - pose.position_m).head(size), identity,
                std::max(options_.position_sd_m, capture.position_sd_m.value_or(0)));
    rows.set(columns.shift, identity);
    Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(size, 2);
    turn.topRows<2>() = Eigen::Rotation2Dd(pose.yaw_rad).toRotationMatrix();
    for (const Columns& each : {layout_.displacement, columns.displacement}) rows.set(each, turn);
  }

  void add_priors(const Calibration& calibration) {
    // Nothing exceeds these bounds; they make each system of equations regular.
    constexpr double max_m_or_rad = 1, max_px = 1e3;
    equations_.normal.diagonal().array() += 1 / (max_m_or_rad * max_m_or_rad);
    const auto& report = calibration.intrinsics_report;
    Eigen::Matrix4d covariance = 1e-6 * Eigen::Matrix4d::Identity();
    if (report && report->covariance) covariance += report->covariance->topLeftCorner<4, 4>();
    equations_.add_prior(layout_.lens, covariance.inverse());
    for (const Lamp& lamp : map_.lamps) {
      if (const auto survey = layout_.survey.find(lamp.id); survey != layout_.survey.end())
        equations_.add_prior(survey->second,
                             Eigen::Matrix3d::Identity() / (*lamp.sd_m * *lamp.sd_m));
    }
    std::vector<Columns> free_lenses{layout_.lamp_lens};
    for (const StepColumns& step : layout_.steps) free_lenses.push_back(step.lens);
    for (const Columns& lens : free_lenses) {
      equations_.normal.diagonal().segment(lens.first, lens.size).array() +=
          1 / (max_px * max_px) - 1 / (max_m_or_rad * max_m_or_rad);
    }
  }

  Layout layout_;
  CommonEquations equations_;
  const LampMap& map_;
  const Camera& camera_;
  Positioner positioner_;
  CauseOptions options_;
  double cameras_z_m_ = 0;
};

/// Cause with its unknowns, and its description for their values in the order of `columns`.
struct Hypothesis {
  std::vector<Columns> columns;
  std::function<LampCause(const Eigen::VectorXd& sizes)> describe;
  /// Smaller sizes are no cause.
  double min_size = 0;
};

/// Least-squares solution with some of the unknowns; the others are zero.
struct Solution {
  double squares = 0;
  Eigen::VectorXd values;
};

Solution solve_for(const CommonEquations& equations, const std::vector<Columns>& columns) {
  std::vector<Eigen::Index> indices;
  for (const Columns& each : columns) {
    for (Eigen::Index i = 0; i < each.size; ++i) indices.push_back(each.first + i);
  }
  const Eigen::VectorXd gradient = equations.gradient(indices);
  Solution solution;
  solution.values = equations.normal(indices, indices).ldlt().solve(gradient);
  solution.squares = std::max(0.0, equations.squares - gradient.dot(solution.values));
  return solution;
}

/// Returns twice the negative logarithm of the likelihood, for noise of an unknown factor of at
/// least kMinNoiseFactor.
double profile_squares(double squares, double degrees_of_freedom) {
  squares /= kMinNoiseFactor * kMinNoiseFactor;
  if (squares <= degrees_of_freedom) return squares;
  return degrees_of_freedom * (1 + std::log(squares / degrees_of_freedom));
}

std::string describe_lens(const Camera& camera, const Eigen::VectorXd& change_px) {
  const Eigen::Vector2d focal_px = camera.focal_px() + change_px.head<2>();
  const Eigen::Vector2d center_px = camera.principal_point_px() + change_px.segment<2>(2);
  return fmt::format("a focal length of {:.1f} px and the center ({:.1f}, {:.1f})",
                     std::sqrt(focal_px.prod()), center_px.x(), center_px.y());
}

LampCause describe_moved_camera(const std::string& where, const Eigen::VectorXd& sizes) {
  constexpr double degrees = 180 / std::numbers::pi;
  // [STATION-18] `loose in its housing`
  return {LampCauseKind::moved_camera,
          fmt::format("{} is displaced by {:.1f} mm and tilted by {:.2f} degrees: it is loose in "
                      "its housing or on its mount",
                      where, kMillimeters * sizes.segment<2>(2).norm(),
                      degrees * sizes.head<2>().norm())};
}

/// Appends the causes of one step: wrong positions, another camera.
void append_step_hypotheses(const StepCaptures& step, const StepColumns& columns,
                            const Camera& camera, std::vector<Hypothesis>& hypotheses) {
  if (!step.positions.empty()) {
    hypotheses.push_back(
        {{columns.shift}, [&step](const Eigen::VectorXd& sizes) {
           const Eigen::Vector3d offset_mm = -kMillimeters * sizes;
           // [STATION-19] `points have moved`
           return LampCause{
               LampCauseKind::wrong_positions,
               fmt::format("the positions of the {} are off by {:.1f} mm in one direction of "
                           "the room (x {:+.1f} mm, y {:+.1f} mm): its known points have moved, "
                           "or their table is wrong",
                           step.step, offset_mm.head<2>().norm(), offset_mm.x(), offset_mm.y())};
         }});
  }
  hypotheses.push_back(
      {{columns.lens, columns.tilt, columns.displacement}, [&](const Eigen::VectorXd& sizes) {
         return LampCause{
             LampCauseKind::other_camera,
             fmt::format("the images of {} are of another camera: they fit {}, the others "
                         "{}; take them with this unit",
                         step.step, describe_lens(camera, sizes),
                         describe_lens(camera, Eigen::Vector4d::Zero()))};
       }});
}

std::vector<Hypothesis> list_hypotheses(std::span<const StepCaptures> steps, const LampMap& map,
                                        const Camera& camera, const Layout& layout,
                                        double min_lamp_offset_m, bool camera_is_known) {
  std::vector<Hypothesis> hypotheses;
  for (const Lamp& lamp : map.lamps) {
    hypotheses.push_back({{layout.lamps.at(lamp.id)},
                          [&lamp](const Eigen::VectorXd& sizes) {
                            return LampCause{
                                LampCauseKind::moved_lamp,
                                describe_map_error({MapErrorKind::moved, {lamp.id}, sizes})};
                          },
                          min_lamp_offset_m});
  }
  if (camera_is_known) {
    hypotheses.push_back({{layout.tilt, layout.displacement}, [](const Eigen::VectorXd& sizes) {
                            return describe_moved_camera(
                                "the camera moved since it was calibrated: it", sizes);
                          }});
  }
  for (std::size_t i = 0; i < steps.size() && steps.size() > 1; ++i) {
    const StepColumns& columns = layout.steps[i];
    append_step_hypotheses(steps[i], columns, camera, hypotheses);
    // It moved before the last step, or, with a third one to compare, after the first step.
    if (i + 1 < steps.size() && (i > 0 || steps.size() == 2)) continue;
    hypotheses.push_back({{columns.tilt, columns.displacement},
                          [&name = steps[i].step](const Eigen::VectorXd& sizes) {
                            return describe_moved_camera(
                                fmt::format("the camera moved on its mount: in the {}, it", name),
                                sizes);
                          }});
  }
  // [STATION-17] `by different lenses` | two units mixed, or lens moved between boards and lamps |
  //   take all again; if repeated: loose lens
  hypotheses.push_back({{layout.lamp_lens}, [&](const Eigen::VectorXd& sizes) {
                          return LampCause{
                              LampCauseKind::other_lens,
                              fmt::format("lamps and boards are imaged by different lenses: the "
                                          "lamps fit {}, the boards {}; are all "
                                          "images of this unit, or has its lens moved?",
                                          describe_lens(camera, sizes),
                                          describe_lens(camera, Eigen::Vector4d::Zero()))};
                        }});
  return hypotheses;
}

/// Hypothesis with its increase of the logarithm of the likelihood.
struct RankedHypothesis {
  const Hypothesis* hypothesis;
  double increase;
  Solution solution;
};

/// Ranks the hypotheses, the most likely one first, if the unknowns `known` are free already.
std::vector<RankedHypothesis> rank_hypotheses(const CommonEquations& equations,
                                              const std::vector<Hypothesis>& hypotheses,
                                              const std::vector<Columns>& known, double squares) {
  const double f = equations.degrees_of_freedom;
  std::vector<RankedHypothesis> ranked;
  for (const Hypothesis& hypothesis : hypotheses) {
    std::vector<Columns> columns = hypothesis.columns;
    Eigen::Index sizes = 0;
    for (const Columns& each : columns) sizes += each.size;
    columns.insert(columns.end(), known.begin(), known.end());
    Solution solution = solve_for(equations, columns);
    solution.values.conservativeResize(sizes);
    if (solution.values.norm() < hypothesis.min_size) continue;
    const double increase = (profile_squares(squares, f) - profile_squares(solution.squares, f) -
                             static_cast<double>(sizes) * std::log(f)) /
                            2;
    ranked.push_back({&hypothesis, increase, std::move(solution)});
  }
  std::ranges::stable_sort(ranked, std::greater(), &RankedHypothesis::increase);
  return ranked;
}

}  // namespace

std::vector<LampCause> rank_lamp_causes(std::span<const StepCaptures> steps, const LampMap& map,
                                        const Calibration& calibration,
                                        const CauseOptions& options) {
  const LampEquations lamp_equations(steps, map, calibration, options);
  const CommonEquations& equations = lamp_equations.equations();
  const Layout& layout = lamp_equations.layout();
  std::vector<LampCause> causes;
  if (equations.captures < kMinFrames) return causes;
  const std::vector<Hypothesis> hypotheses = list_hypotheses(
      steps, map, calibration.camera, layout,
      options.min_lamp_offset_px * lamp_equations.lamp_offset_per_px(), options.camera_is_known);
  std::vector<Columns> known{layout.lens};
  if (!options.camera_is_known) known.insert(known.end(), {layout.tilt, layout.displacement});
  for (const auto& [id, survey] : layout.survey) known.push_back(survey);
  constexpr int max_causes = 3;
  const double f = equations.degrees_of_freedom;
  const double all_squares = solve_for(equations, known).squares;
  for (int i = 0; i < max_causes; ++i) {
    constexpr double min_increase = 10, min_removed = 0.25, min_lead = 3;
    const double squares = solve_for(equations, known).squares;
    const auto ranked = rank_hypotheses(equations, hypotheses, known, squares);
    if (ranked.empty()) break;
    const RankedHypothesis& best = ranked.front();
    if (best.increase < min_increase ||
        squares - best.solution.squares < min_removed * (squares - f))
      break;
    const auto append_cause = [&](const RankedHypothesis& each) {
      causes.push_back(each.hypothesis->describe(each.solution.values));
      causes.back().explained = (all_squares - each.solution.squares) / (all_squares - f);
    };
    append_cause(best);
    if (ranked.size() > 1 && best.increase - ranked[1].increase < min_lead) append_cause(ranked[1]);
    known.insert(known.end(), best.hypothesis->columns.begin(), best.hypothesis->columns.end());
  }
  return causes;
}

bool is_contradiction_explained(const std::vector<LampCause>& ranked) {
  constexpr double min_explained = 0.9;
  return !ranked.empty() && ranked.back().explained >= min_explained;
}

std::vector<std::string> list_map_contradictions(std::span<const Frame> frames, const LampMap& map,
                                                 const Calibration& calibration) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  for (const MapError& error : detect_map_errors(frames, map, calibration).errors) {
    if (error.kind != MapErrorKind::moved) faults.push_back(describe_map_error(error));
  }
  return faults;
}

std::vector<std::string> list_missing_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  for (const MapError& error : list_undetected_lamps(frames, map))
    faults.push_back(describe_map_error(error));
  return faults;
}

}  // namespace vlp
