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
#include "session/row_time_check.h"
#include "session/step_history.h"
#include "station/records/run_record.h"
#include "station/unit/station_step.h"
#include "station/unit/unit_step.h"

namespace vlp {

/// A unit on its way through the station. Images are looked at as they come; a step is solved as
/// soon as it has enough, and again when its images change, and with it those that rest on it. The
/// result depends on the images and their names only, not on threads, nor on when they came, unless
/// more came than enough, or two that show the same: the first of them is taken.
class Unit {
 public:
  /// `config` outlives it.
  Unit(const StationConfig& config, std::string camera_id, ProgramVersion program, int threads);
  Unit(const Unit&) = delete;
  Unit& operator=(const Unit&) = delete;

  /// Images of a step that came, or changed. One that comes when the step is done is not used.
  /// Nobody knows in which order those were taken that came together: of them, refusals count as in
  /// a row when none is used. `more_to_come`: others came with them, which the next call has.
  void add(StationStep step, const std::vector<std::filesystem::path>& files,
           bool more_to_come = false);
  /// An image that is there no more. What was refused because of it is taken.
  void remove(StationStep step, const std::string& name);
  /// The file of a refused image is there no more, but it was of the unit: the refusal stays, not
  /// counted as one in a row, because a camera that moves blurs. Without a fault it is forgotten.
  void discard(StationStep step, const std::string& name);
  /// The step's captures.csv or truth.csv changed.
  void reread(StationStep step);
  /// Solves what has enough; with `all_in`, nothing more comes, and what there is has to do: then,
  /// a captures.csv that cannot be read throws InputError, and is the step's problem before.
  void advance(bool all_in);
  /// Refuses images that another camera's run used, by their SHA-256.
  void refuse_images_of_others(std::function<ImageOwner(const std::string& sha256)> owner) {
    owner_ = std::move(owner);
  }
  /// Nothing more comes although a step has not enough; `why` for people, as "the operator ended
  /// the run".
  void end_early(std::string why) { ended_ = std::move(why); }
  /// The reason given to end_early(); empty if the unit was not ended early.
  const std::string& ended() const { return ended_; }

  /// No verdict of this unit counts, because of the station: `why`, for people, comes first of its
  /// causes. Empty: it does.
  void distrust(std::string why) { distrusted_ = std::move(why); }
  const std::string& distrusted() const { return distrusted_; }

  const UnitStep& step(StationStep step) const { return steps_[index(step)]; }
  /// Returns the row time of the camera's type compared with that of the lamps of all steps, as of
  /// the last advance().
  const RowTimeCheck& row_time() const { return row_time_; }
  /// The first step that is not done; nothing when all are.
  std::optional<StationStep> current() const;
  /// It is of no use to go on: a step has so many refused images in a row, or enough images that
  /// lead to nothing because of the lamps.
  bool hopeless() const;

  /// As far as it came; nothing before the lens is known.
  std::optional<Calibration> calibration() const;
  /// All figures, gates among them.
  std::vector<CheckedMetric> figures() const;
  /// For the report: of lens, rotation centre and dispersion, as far as it came. Waits for them.
  std::vector<ReportPicture> pictures() const;
  const StationConfig& config() const { return config_; }
  const std::string& camera_id() const { return camera_id_; }

 private:
  static std::size_t index(StationStep step) { return static_cast<std::size_t>(step); }
  UnitStep& at(StationStep step) { return steps_[index(step)]; }
  void solve_steps(bool all_in);
  void look(StationStep step, const std::vector<std::filesystem::path>& files);
  LevelRotations levels_of(StationStep step) const;
  void look_again(StationStep step);
  void take(StationStep step, UnitImage image);
  void count_refusals(StationStep step);
  void reject_redundant(StationStep step, UnitImage& image) const;
  void drop(StationStep step, const std::string& name);
  void forget_after(StationStep step);
  bool has_enough(StationStep step) const;
  StepResult solve(StationStep step, bool all_in) const;
  std::optional<Calibration> calibration_before(StationStep step) const;
  HistoryEntry history_of(StationStep step) const;

  const StationConfig& config_;
  std::string camera_id_;
  ProgramVersion program_;
  int threads_;
  std::string ended_ = {}, distrusted_ = {};
  std::function<ImageOwner(const std::string&)> owner_ = {};
  BoardIntake boards_;
  std::array<UnitStep, 4> steps_;
  RowTimeCheck row_time_ = {};
};

/// Returns the observations of the images with lamps, rejected ones too.
std::vector<Observation> lamp_observations(const Unit& unit);

/// Returns the row time of the station's type of camera.
StatedRowTime stated_row_time(const StationConfig& config);

}  // namespace vlp
