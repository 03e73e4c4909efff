// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records_database.h"

namespace vlp {
namespace {

std::string condition(const RunFilter& filter) {
  std::string text = "WHERE 1 = 1";
  if (!filter.camera.empty()) text += " AND runs.camera = :camera";
  if (!filter.station.empty()) text += " AND runs.station = :station";
  if (!filter.verdict.empty()) text += " AND runs.verdict = :verdict";
  if (!filter.kind.empty()) text += " AND runs.kind = :kind";
  return text;
}

void bind(soci::statement& statement, const RunFilter& filter) {
  for (const std::string* value :
       {&filter.camera, &filter.station, &filter.verdict, &filter.kind}) {
    if (!value->empty()) statement.exchange(soci::use(*value));
  }
}

template <typename Row>
std::vector<Row> last_of(std::vector<Row> rows, int last) {
  const auto kept = static_cast<std::size_t>(last);
  if (last > 0 && rows.size() > kept) {
    rows.erase(rows.begin(), rows.end() - static_cast<std::ptrdiff_t>(kept));
  }
  return rows;
}

}  // namespace

std::vector<RunSummary> Records::list(const RunFilter& filter) {
  return database_->run([&] {
    RunSummary row;
    std::vector<RunSummary> rows;
    soci::statement statement(database_->sql);
    statement.exchange(soci::into(row.run));
    statement.exchange(soci::into(row.kind));
    statement.exchange(soci::into(row.station));
    statement.exchange(soci::into(row.camera));
    statement.exchange(soci::into(row.ended_utc));
    statement.exchange(soci::into(row.verdict));
    statement.exchange(soci::into(row.causes));
    bind(statement, filter);
    statement.alloc();
    statement.prepare("SELECT run, kind, station, camera, ended_utc, verdict, causes FROM runs " +
                      condition(filter) + " ORDER BY ended_utc, run");
    statement.define_and_bind();
    statement.execute();
    while (statement.fetch()) rows.push_back(row);
    return last_of(std::move(rows), filter.last);
  });
}

std::vector<TrendPoint> Records::trend(const std::string& figure, const RunFilter& filter) {
  return database_->run([&] {
    TrendPoint row;
    std::vector<TrendPoint> rows;
    soci::statement statement(database_->sql);
    statement.exchange(soci::into(row.run));
    statement.exchange(soci::into(row.camera));
    statement.exchange(soci::into(row.verdict));
    statement.exchange(soci::into(row.value));
    bind(statement, filter);
    statement.exchange(soci::use(figure));
    statement.alloc();
    statement.prepare(
        "SELECT runs.run, runs.camera, runs.verdict, figures.value FROM runs JOIN figures ON "
        "figures.run = runs.run " +
        condition(filter) +
        " AND figures.name = :figure AND figures.value IS NOT NULL ORDER BY runs.ended_utc, "
        "runs.run");
    statement.define_and_bind();
    statement.execute();
    while (statement.fetch()) rows.push_back(row);
    return last_of(std::move(rows), filter.last);
  });
}

std::optional<RunRecord> Records::find(const std::string& run) {
  return database_->run([&]() -> std::optional<RunRecord> {
    soci::session& sql = database_->sql;
    RunRecord record;
    record.run = run;
    sql << "SELECT kind, station, camera, ended_utc, verdict, causes, program, libraries, "
           "config_sha256, calibration FROM runs WHERE run = :run",
        soci::into(record.kind), soci::into(record.station), soci::into(record.camera),
        soci::into(record.ended_utc), soci::into(record.verdict), soci::into(record.causes),
        soci::into(record.program), soci::into(record.libraries), soci::into(record.config_sha256),
        soci::into(record.calibration), soci::use(run);
    if (!sql.got_data()) return std::nullopt;
    StationFigure figure;
    double value = 0, gate = 0;
    int at_least = 0;
    soci::indicator has_value = soci::i_null, has_gate = soci::i_null;
    soci::statement figures =
        (sql.prepare << "SELECT name, value, gate, at_least FROM figures WHERE run = :run ORDER "
                        "BY place",
         soci::into(figure.name), soci::into(value, has_value), soci::into(gate, has_gate),
         soci::into(at_least), soci::use(run));
    figures.execute();
    while (figures.fetch()) {
      figure.value = has_value == soci::i_ok ? std::optional(value) : std::nullopt;
      figure.limit = has_gate == soci::i_ok ? std::optional(gate) : std::nullopt;
      figure.at_least = at_least != 0;
      record.figures.push_back(figure);
    }
    RunRecord::Image image;
    soci::statement images =
        (sql.prepare << "SELECT step, image, sha256, refused FROM images WHERE run = :run ORDER "
                        "BY step, image",
         soci::into(image.step), soci::into(image.name), soci::into(image.sha256),
         soci::into(image.refused), soci::use(run));
    images.execute();
    while (images.fetch()) record.images.push_back(image);
    return record;
  });
}

}  // namespace vlp
