// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <set>
#include <string>

#include "station/records/records.h"
#include "station/station_config.h"

namespace vlp {

inline constexpr std::size_t kImagesOfARun = 30;

/// Returns a run with its own digests.
inline RunRecord numbered_run(int number) {
  RunRecord run;
  run.run = "20261121T134501Z-" + std::to_string(100000 + number);
  run.kind = "unit";
  run.station = "station-1";
  run.camera = "camera-" + std::to_string(number);
  run.begun_utc = start_utc_of_run_id(run.run);
  run.ended_utc = "2026-11-21T13:50:01Z";
  run.set_causes({{"the lens is \"blurred\"", true}, {"second", false}});
  run.program = "vlp-station 0";
  run.libraries = "none";
  run.config_sha256 = std::string(64, 'a');
  run.calibration = "format: vlp-calibration/1\n";
  run.metrics =
      check_against_gates({{"rms_px", 1, GuardBand{0.01, 1.645}}, {"tilt_deg", 2}},
                          {{"rms_px", 0.1 + 0.2}, {"coverage", 1.0 / 3}}, list_unit_metrics());
  for (std::size_t i = 0; i < kImagesOfARun; ++i) {
    run.images.push_back({"boards", std::to_string(1000 + i) + ".png",
                          "digest-" + std::to_string(number) + "-" + std::to_string(i), ""});
  }
  return run;
}

/// Returns the ids of all runs in the records, and expects that each is complete.
inline std::set<std::string> whole_runs(const std::string& where) {
  Records records(where);
  std::set<std::string> names;
  for (const RunSummary& run : records.list_run_summaries({})) {
    const auto kept = records.find_run_by_id(run.run);
    EXPECT_THAT(kept->images, testing::SizeIs(kImagesOfARun));
    EXPECT_THAT(kept->metrics, testing::SizeIs(3));
    EXPECT_TRUE(names.insert(run.run).second);
  }
  return names;
}

inline double measure_seconds(const std::function<void()>& action) {
  const auto begun = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace vlp
