// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/run_storage.h"

namespace vlp {
namespace {

void read_figures(soci::session& sql, RunRecord& record) {
  CheckedMetric metric;
  double value = 0, gate = 0;
  GuardBand guard{};
  int at_least = 0;
  soci::indicator has_value = soci::i_null, has_gate = soci::i_null, has_u = soci::i_null,
                  has_k = soci::i_null;
  soci::statement metrics =
      (sql.prepare << "SELECT name, value, gate, at_least, unit, uncertainty, guard_k FROM figures "
                      "WHERE run = :run ORDER BY place",
       soci::into(metric.name), soci::into(value, has_value), soci::into(gate, has_gate),
       soci::into(at_least), soci::into(metric.unit), soci::into(guard.standard_uncertainty, has_u),
       soci::into(guard.k, has_k), soci::use(record.run));
  metrics.execute();
  while (metrics.fetch()) {
    metric.value = has_value == soci::i_ok ? std::optional(value) : std::nullopt;
    metric.limit = has_gate == soci::i_ok ? std::optional(gate) : std::nullopt;
    metric.direction = at_least != 0 ? Direction::at_least : Direction::at_most;
    const bool guarded = has_u == soci::i_ok && has_k == soci::i_ok;
    metric.guard = guarded ? std::optional(guard) : std::nullopt;
    record.metrics.push_back(metric);
  }
}

}  // namespace

std::optional<RunRecord> load_run_header(soci::session& sql, const std::string& run) {
  RunRecord record;
  soci::statement select(sql);
  std::string columns;
  for (const auto& [name, text, label, in_csv] : run_fields()) {
    columns.append(columns.empty() ? "" : ", ").append(name);
    select.exchange(soci::into(record.*text));
  }
  select.exchange(soci::use(run, "key"));
  select.alloc();
  select.prepare("SELECT " + columns + " FROM runs WHERE run = :key");
  select.define_and_bind();
  if (!select.execute(true)) return std::nullopt;
  return record;
}

std::optional<RunRecord> load_run(soci::session& sql, const std::string& run) {
  std::optional<RunRecord> found = load_run_header(sql, run);
  if (!found) return found;
  read_figures(sql, *found);
  RunRecord::Image image;
  soci::statement images =
      (sql.prepare << "SELECT step, image, sha256, refused FROM images WHERE run = :run ORDER "
                      "BY step, image",
       soci::into(image.step), soci::into(image.name), soci::into(image.sha256),
       soci::into(image.refused), soci::use(run));
  images.execute();
  while (images.fetch()) found->images.push_back(image);
  RunEvent event;
  soci::statement events =
      (sql.prepare << "SELECT event, what, who, text FROM events WHERE run = :run ORDER BY event",
       soci::into(event.event), soci::into(event.what), soci::into(event.who),
       soci::into(event.text), soci::use(run));
  events.execute();
  while (events.fetch()) found->events.push_back(event);
  return found;
}

}  // namespace vlp
