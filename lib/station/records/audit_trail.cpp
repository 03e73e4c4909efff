// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/audit_trail.h"

#include <fmt/format.h>
#include <soci/soci.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "captures/digest.h"
#include "station/records/record_tables.h"

namespace vlp {
namespace {

/// Computes the digest of texts with their lengths, which make it unambiguous.
std::string compute_digest(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += fmt::format("{} {}\n", text.size(), text);
  return hash_text(all);
}

/// Returns the SHA-256 of the document of a run; empty if its rows are not those of its document.
std::string hash_rows(const RunRows& rows) {
  try {
    return rows == make_run_rows(rows.document) ? hash_text(rows.document) : "";
  } catch (const std::runtime_error&) {  // a document that was edited
    return "";
  }
}

std::string compute_digest(const std::string& run, const RunEvent& event) {
  return compute_digest({run, event.event, event.kind, event.author, event.text});
}

struct Entry {
  long long number = 0;
  /// `event` is empty for the entry of a run.
  std::string run, event, content, digest;
};

std::string compute_digest(const Entry& entry, const std::string& before) {
  return compute_digest(
      {std::to_string(entry.number), entry.run, entry.event, entry.content, before});
}

std::vector<Entry> load_entries(soci::session& sql) {
  Entry entry;
  std::vector<Entry> entries;
  soci::statement all =
      (sql.prepare << "SELECT number, run, event, content, digest FROM trail ORDER BY number",
       soci::into(entry.number), soci::into(entry.run), soci::into(entry.event),
       soci::into(entry.content), soci::into(entry.digest));
  all.execute();
  while (all.fetch()) entries.push_back(entry);
  return entries;
}

std::vector<std::string> load_run_ids(soci::session& sql) {
  const soci::rowset<std::string> runs =
      (sql.prepare << "SELECT run FROM runs ORDER BY ended_utc, run");
  return {runs.begin(), runs.end()};
}

std::string describe_item(const std::string& run, const std::string& event) {
  return event.empty() ? "run " + run : fmt::format("event {} of run {}", event, run);
}

/// Checks the digests and numbers of the entries.
void check_chain(const std::vector<Entry>& entries, std::vector<std::string>& problems) {
  long long next = 1;
  // Stored and recomputed digest of the previous entry: a single change is then reported once.
  std::string before, should_be;
  for (const Entry& entry : entries) {
    const bool gap = entry.number != next;
    if (gap) {
      problems.push_back(
          entry.number - next == 1
              ? fmt::format("entry {} of the trail was removed", next)
              : fmt::format("entries {} to {} of the trail were removed", next, entry.number - 1));
    }
    const std::string digest = compute_digest(entry, before);
    if (!gap && digest != entry.digest && compute_digest(entry, should_be) != entry.digest) {
      problems.push_back(fmt::format("entry {} of the trail, of {}, was changed", entry.number,
                                     describe_item(entry.run, entry.event)));
    }
    before = entry.digest;
    should_be = digest;
    next = entry.number + 1;
  }
}

}  // namespace

void lock_audit_trail(soci::session& sql) { sql << "UPDATE vlp_schema SET version = version"; }

void append_to_trail(soci::session& sql, const std::string& run, const std::string& document,
                     const std::vector<RunEvent>& new_events) {
  std::vector<Entry> added;
  if (!document.empty()) added.push_back({0, run, "", hash_text(document), ""});
  for (const RunEvent& event : new_events) {
    added.push_back({0, run, event.event, compute_digest(run, event), ""});
  }
  if (added.empty()) return;
  lock_audit_trail(sql);
  Entry last;
  sql << "SELECT number, digest FROM trail ORDER BY number DESC LIMIT 1", soci::into(last.number),
      soci::into(last.digest);
  for (Entry& entry : added) {
    entry.number = last.number + 1;
    entry.digest = compute_digest(entry, last.digest);
    sql << "INSERT INTO trail (number, run, event, content, digest) VALUES (:number, :run, :event, "
           ":content, :digest)",
        soci::use(entry.number), soci::use(entry.run), soci::use(entry.event),
        soci::use(entry.content), soci::use(entry.digest);
    last = entry;
  }
}

TrailCheck check_audit_trail(soci::session& sql, const std::string& expected_digest,
                             const std::function<void()>& on_progress) {
  TrailCheck check;
  const auto entries = load_entries(sql);
  check.entries = entries.size();
  if (!entries.empty()) check.last_digest = entries.back().digest;
  check_chain(entries, check.problems);
  on_progress();
  // Contents of the entries by run and event; without those that are found in the records.
  std::map<std::pair<std::string, std::string>, std::string> contents;
  for (const Entry& entry : entries) {
    if (contents.emplace(std::pair(entry.run, entry.event), entry.content).second) continue;
    check.problems.push_back(fmt::format("entry {} of the trail was added: {} has one already",
                                         entry.number, describe_item(entry.run, entry.event)));
  }
  const auto check_item = [&](const std::string& run, const std::string& event,
                              const std::string& content) {
    const auto entry = contents.extract({run, event});
    if (entry.empty()) {
      // [STATION-8] `no entry in the trail`
      check.problems.push_back(describe_item(run, event) +
                               " has no entry in the trail: it was added by hand");
    } else if (entry.mapped() != content) {
      check.problems.push_back(describe_item(run, event) + " was changed");
    }
  };
  for (const std::string& name : load_run_ids(sql)) {
    ++check.runs;
    check_item(name, "", hash_rows(load_run_rows(sql, name)));
    for (const RunEvent& event : load_run_events(sql, name)) {
      check_item(name, event.event, compute_digest(name, event));
    }
    on_progress();
  }
  for (const auto& [item, content] : contents) {
    check.problems.push_back(describe_item(item.first, item.second) + " was removed");
  }
  if (!expected_digest.empty() &&
      std::ranges::find(entries, expected_digest, &Entry::digest) == entries.end()) {
    // [STATION-8] `that was noted`
    check.problems.push_back("the entry that was noted, " + expected_digest +
                             ", is not in the trail: its end was removed, or all of it is another");
  }
  return check;
}

}  // namespace vlp
