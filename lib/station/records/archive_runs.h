// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "station/records/run_record.h"

namespace vlp {

/// A session of an archive as a run, so that trends, capability and studies read archives, too.
struct ReprocessedSession {
  /// All but its figures and its calibration.
  RunRecord run;
  /// With what vlp-calibrate wrote.
  std::filesystem::path folder;
};

struct ReprocessedArchive {
  /// In the order of their dates.
  std::vector<ReprocessedSession> sessions;
  /// Those that are none of these, because nobody says when they were taken, or because their
  /// program crashed, which says nothing of the session.
  std::size_t undated = 0, crashed = 0;
  /// Reasons of the rows that are left out because their names are no ids.
  std::vector<std::string> refused;
};

/// Of summary.csv in RESULTS of scripts/reprocess.sh. The station is the archive, by the name of
/// the folder of its results; kind "unit"; "pass" and "look" are PASS, "gate" is FAIL, no result is
/// INVALID; config_sha256 is the session's key: of its inputs, the toolbox and the options. A
/// session has the same name of a run each time: its date, and a digest of station, camera and
/// session. Throws InputError for what reprocessing has not written.
ReprocessedArchive sessions_of_archive(const std::filesystem::path& results);

/// The run of a session, whole, with the figures and gates of its session.json. Throws InputError
/// for what vlp-calibrate has not written.
RunRecord run_of(const ReprocessedSession& session);

}  // namespace vlp
