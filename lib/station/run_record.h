// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/station_figures.h"
#include "station/unit.h"

namespace vlp {

/// All that is kept of a run.
struct RunRecord {
  /// Unique over all stations, see new_run().
  std::string run;
  /// "unit", or "golden" for the station's reference camera.
  std::string kind;
  std::string station, camera;
  /// Of the end, as 2026-11-21T13:45:01Z; the run's name tells when it began.
  std::string ended_utc;
  /// "PASS" or "FAIL", and why, one cause to a line.
  std::string verdict, causes;
  /// Program with version, and the libraries that the result rests on with theirs.
  std::string program, libraries;
  std::string config_sha256;
  /// calibration.yaml as far as it came; may be empty.
  std::string calibration;
  std::vector<StationFigure> figures;
  struct Image {
    std::string step, name, sha256;
    /// Why it was not used; empty when it was.
    std::string refused;
  };
  std::vector<Image> images;

  bool passed() const { return verdict == "PASS"; }
};

/// A name for a run that begins now: the time and 16 random hexadecimal digits,
/// 20261121T134501Z-0123456789abcdef.
std::string new_run();
/// When it began, as 2026-11-21T13:45:01Z; empty for what is no name of a run.
std::string begun_utc(const std::string& run);
std::string now_utc();

/// The record of a unit at its end.
RunRecord record_of(const Unit& unit, const std::string& run, const ProgramVersion& program);

/// OpenCV, Ceres, mrcal and so on, each with its version.
std::string library_versions();

/// The text of a calibration as write_calibration() writes it.
std::string calibration_text(const Calibration& calibration);

}  // namespace vlp
