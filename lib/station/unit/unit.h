// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/gate.h"
#include "frontend/board_intake.h"
#include "frontend/lamp_intake.h"
#include "session/lamp_causes.h"
#include "session/row_time_step.h"
#include "session/step_history.h"
#include "station/records/run_record.h"
#include "station/unit/unit_step.h"

namespace vlp {

/// Processing of a unit on the station.
///
/// Images are processed as they arrive. A step is solved as soon as it is complete, and again when
/// its images change, together with the later steps. The result depends only on the images and
/// their names, not on threads or times of arrival. There are two exceptions, in which the first
/// images are used: more images than required, and two redundant images.
class Unit {
 public:
  /// Starts the processing of a unit without images.
  /// @param config   configuration of the station; must outlive the unit
  /// @param program  program and version for the history of the calibration
  /// @param threads  maximum number of threads
  /// @param known_calibration  calibration of the golden unit: each step with images is solved with
  ///     it, whatever the results of other steps; std::nullopt: a unit that is calibrated
  Unit(const StationConfig& config, std::string camera_id, ProgramVersion program, int threads,
       std::optional<Calibration> known_calibration = {});
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;

  /// Adds new or changed images of a step. Images of a completed step are not used. The order of
  /// images that arrive together is unknown, so their rejections count as consecutive only if none
  /// of them is used. `more_to_come` is true if the next call has more images that arrived with
  /// these.
  void add_step_images(StationStep step, const std::vector<std::filesystem::path>& files,
                       bool more_to_come = false);
  /// Removes an image whose file was deleted. Images that are redundant only because of it are used
  /// instead.
  void remove_deleted(StationStep step, const std::string& name);
  /// Marks the file of a rejected image as deleted. The rejection remains, but does not count as
  /// consecutive, because a moving camera blurs images. A redundant image is removed.
  void mark_image_discarded(StationStep step, const std::string& name);
  /// Handles a change of the step's captures.csv or truth.csv.
  void reprocess_step(StationStep step);
  /// Solves the steps that are complete. If `all_in`, no more images arrive, and incomplete steps
  /// are solved, too. An unreadable captures.csv then throws InputError; otherwise it is the step's
  /// problem.
  void solve_completed(bool all_in);
  /// Sets the function that finds another camera's run by the SHA-256 of an image. Such images are
  /// rejected.
  void set_image_lookup(std::function<std::optional<ImageUser>(const std::string& sha256)> owner) {
    owner_ = std::move(owner);
  }
  /// Ends an incomplete unit: no more images arrive. `reason` is human-readable, as "the operator
  /// ended the run".
  void end_early(std::string reason) { ended_ = std::move(reason); }
  /// The reason given to end_early(); empty if the unit was not ended early.
  const std::string& early_end_reason() const { return ended_; }

  /// Makes the verdict of this unit not count, because of the station. `reason`, human-readable,
  /// becomes the first of its causes; empty if the verdict counts.
  void invalidate_verdict(std::string reason) { invalid_reason_ = std::move(reason); }
  const std::string& invalid_reason() const { return invalid_reason_; }

  const UnitStep& step_state(StationStep step) const { return steps_[step_index(step)]; }
  /// Returns the comparison of the type's row time with that of the lamps of all steps, as of the
  /// last solve_completed().
  const RowTimeCheck& row_time_check() const { return row_time_; }
  /// Returns the first step that is not completed; std::nullopt if all are.
  std::optional<StationStep> first_incomplete() const;
  /// Returns true if continuing is useless. A step then has too many consecutive rejected images,
  /// or it is complete but fails because of the lamps.
  bool can_no_longer_pass() const;

  /// Returns the calibration of the last completed step; std::nullopt before the lens is known.
  std::optional<Calibration> latest_calibration() const;
  /// Returns all metrics, including those with gates.
  std::vector<CheckedMetric> collect_metrics() const;
  /// Returns the plots of lens, rotation center and dispersion for the report, of the solved steps.
  /// Waits for their rendering.
  std::vector<ReportPlot> collect_plots() const;
  const StationConfig& station_config() const { return config_; }
  const std::string& camera_id() const { return camera_id_; }

 private:
  static std::size_t step_index(StationStep step) { return static_cast<std::size_t>(step); }
  UnitStep& mutable_step_state(StationStep step) { return steps_[step_index(step)]; }
  void solve_in_order(bool all_in);
  void process_files(StationStep step, const std::vector<std::filesystem::path>& files);
  LevelRotations list_level_rotations(StationStep step) const;
  void reprocess_inclined(StationStep step);
  void add_image_to_step(StationStep step, UnitImage image);
  void count_rejections(StationStep step);
  void reject_if_redundant(StationStep step, UnitImage& image) const;
  void remove_image(StationStep step, const std::string& name);
  void reset_steps_after(StationStep step);
  bool has_sufficient_images(StationStep step) const;
  StepResult run_step(StationStep step, const Calibration& before) const;
  StepResult compute_step_result(StationStep step, bool all_in) const;
  std::optional<Calibration> calibration_before(StationStep step) const;
  HistoryEntry make_step_entry(StationStep step) const;

  const StationConfig& config_;
  std::string camera_id_;
  ProgramVersion program_;
  int threads_;
  std::optional<Calibration> known_calibration_;
  std::string ended_ = {}, invalid_reason_ = {};
  std::function<std::optional<ImageUser>(const std::string&)> owner_ = {};
  BoardIntake boards_;
  std::array<UnitStep, 4> steps_;
  RowTimeCheck row_time_ = {};
};

/// Returns the observations of the images with lamps, rejected ones too.
std::vector<Observation> list_lamp_observations(const Unit& unit);

/// Returns the used captures of lamps of each step that has some, with their known positions if the
/// step succeeded.
std::vector<StepCaptures> list_lamp_captures(const Unit& unit);

/// Returns the row time of the station's type of camera.
GivenRowTime make_given_row_time(const StationConfig& config);

}  // namespace vlp
