// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "station/records/run_record.h"

namespace soci {
class session;
}

namespace vlp {

/// The trail is an audit log (hash chain) of the records. It has an entry for each stored run and
/// for each of its events, numbered from 1. Entries are never changed or removed.
///
/// User, time, action and reason are in the run or the event. An entry has `content`, the SHA-256
/// of the run's document (serialize_run()) or of the event, and `digest`. The latter is the SHA-256
/// of number, run, event and content of the entry and of the `digest` of the previous entry. That
/// of several texts is the SHA-256 of the texts, each after its length. A run counts as changed,
/// too, if the rows that queries use are not those of its document (make_run_rows()).
///
/// Later changes, and removals from the middle, are therefore detected. Two manipulations change no
/// existing digest: removing the last entries with their runs, and rewriting all entries. They are
/// detected by a last digest that was stored elsewhere.

/// Locks the audit trail against writing by other programs, until the current transaction of `sql`
/// ends. Waits for a lock of another program. Do slow work before the call.
void lock_audit_trail(soci::session& sql);
/// Locks the trail and appends the entries of new events of a run, after that of the run itself if
/// it is new: `document` is then its document, otherwise empty.
void append_to_trail(soci::session& sql, const std::string& run, const std::string& document,
                     const std::vector<RunEvent>& new_events);

/// Result of check_audit_trail(): numbers of runs and entries, and differences.
struct TrailCheck {
  std::size_t runs = 0, entries = 0;
  /// Digest of the last entry; empty if there is none.
  std::string last_digest;
  /// Manual changes, removals and additions, one line each, by id.
  std::vector<std::string> problems;
};

/// Checks all records in the current transaction. `expected_digest` is the last digest of an
/// earlier check, or empty. `on_progress` is called repeatedly during the check.
TrailCheck check_audit_trail(soci::session& sql, const std::string& expected_digest,
                             const std::function<void()>& on_progress);

}  // namespace vlp
