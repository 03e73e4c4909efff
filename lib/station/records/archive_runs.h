// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// Session of an archive as a run, so that trends, capability and studies can use archives.
struct ReprocessedSession {
  /// Record of the session as a run: ids, dates, program, verdict and causes. It has no metrics and
  /// no calibration; load_archive_run() adds these.
  RunRecord run;
  /// Folder of the files that vlp-calibrate wrote.
  std::filesystem::path folder;
};

struct ReprocessedArchive {
  /// Sessions, in chronological order.
  std::vector<ReprocessedSession> sessions;
  /// Number of sessions without a date, and of sessions whose program crashed. A crash is no result
  /// of the session.
  std::size_t undated = 0, crashed = 0;
  /// Messages about rows that are skipped because their names are no valid ids.
  std::vector<std::string> rejected_sessions;
};

/// Reads the sessions of an archive from RESULTS/summary.csv of scripts/reprocess.sh. Throws
/// InputError if reprocessing did not write `results`.
///
///   station        name of the folder of the results
///   kind           "unit"
///   verdict        PASS for "pass" and "review", FAIL for "gate", INVALID without a result
///   config_sha256  key of the session: digest of its inputs, the toolbox and the options
///   run            date, and a digest of station, camera and session: the same each time
ReprocessedArchive read_reprocessed(const std::filesystem::path& results);

/// Loads the complete run of a session, with metrics and gates of its session.json. Throws
/// InputError if vlp-calibrate did not write the file.
RunRecord load_archive_run(const ReprocessedSession& session);

}  // namespace vlp
