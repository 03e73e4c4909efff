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

/// The trail of the records: an entry for each run that was kept and for each of its events, from 1
/// on, never changed nor taken away. Who, when, what and why are in the run or the event; the entry
/// has the SHA-256 of all of it, `content`, and one over its own number, run, event and content and
/// over the `digest` of the entry before: what is changed later, or taken out of the middle, no
/// longer fits. Only who takes entries from the end, with what they are of, or writes all of them
/// anew, changes no digest that is there: an earlier last digest, noted elsewhere, tells of that.

/// What an entry is to be of: a run that is kept, or an event of it, and the digest of all of it.
struct TrailContent {
  std::string run, event, content;
};
TrailContent content_of_run(soci::session& sql, const std::string& run);
TrailContent content_of_event(const std::string& run, const RunEvent& event);

/// From here to the end of its transaction this program alone goes on with the trail. What is
/// slow is done before.
void lock_trail(soci::session& sql);
/// Adds entries, behind those of all other programs: locks the trail.
void append_to_trail(soci::session& sql, const std::vector<TrailContent>& contents);
/// Adds entries of all runs there are, of an earlier version that had no trail.
void append_all(soci::session& sql);

/// Whether the records are what was kept.
struct TrailCheck {
  std::size_t runs = 0, entries = 0;
  /// Of the last entry; empty without one.
  std::string last_digest;
  /// What was changed, removed or added by hand, a line each, by name.
  std::vector<std::string> problems;
};

/// Of all records, in the transaction that there is. `noted`: a last digest of before, or empty.
/// `heard` is called now and then.
TrailCheck check_trail(soci::session& sql, const std::string& noted,
                       const std::function<void()>& heard);

}  // namespace vlp
