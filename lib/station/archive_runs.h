// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "station/run_record.h"

namespace vlp {

/// The sessions of an archive as runs, so that trends, capability and studies read archives, too.
struct ArchiveRuns {
  /// In the order of their dates.
  std::vector<RunRecord> runs;
  /// Sessions that are none of these, because nobody says when they were taken.
  std::size_t undated = 0;
};

/// Of RESULTS of scripts/reprocess.sh: summary.csv, and each session's session.json and
/// calibration.yaml. The station is the archive, by the name of the folder of its results; kind
/// "unit"; figures and gates are the session's; "pass" and "look" are PASS, "gate" is FAIL, no
/// result is INVALID. A session has the same name of a run each time: its date, and a digest of its
/// camera and name. Throws InputError for what reprocessing has not written.
ArchiveRuns runs_of_archive(const std::filesystem::path& results);

}  // namespace vlp
