// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/station/known_runs.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <stdexcept>
#include <utility>
#include <vector>

#include "captures/printable.h"
#include "program/app.h"

namespace vlp {

void print_line(const std::string& text) { fmt::print("{}\n", escape_for_line(text)); }

KnownRuns open_runs(const StationRecordsOptions& options) {
  if (options.station.empty() == options.records.empty()) {
    throw std::invalid_argument("the records are not specified; give --station or --records");
  }
  std::optional<StationConfig> station;
  if (!options.station.empty()) station = read_station_config(options.station);
  KnownRuns known{station,
                  station ? Spool(station->spool, station->records) : Spool({}, options.records)};
  known.runs.deliver_waiting();
  try {
    if (known.runs.list_waiting_runs().empty()) known.runs.records_or_throw();
  } catch (const RecordsUnavailable& error) {
    if (error.details != error.what()) spdlog::debug("{}", escape_for_terminal(error.details));
    throw;
  }
  const std::string state = known.runs.describe_state();
  if (!state.empty()) {
    const bool is_online = known.runs.offline_reason().empty();
    spdlog::log(is_online ? spdlog::level::warn : spdlog::level::debug, "{}",
                escape_for_terminal(state));
  }
  return known;
}

void warn_if_offline(KnownRuns& known) {
  if (known.runs.offline_reason().empty()) return;
  spdlog::warn("{}", escape_for_terminal(known.runs.make_operator_notice()));
}

RunFilter remove_any_conditions(RunFilter filter) {
  constexpr const char* any = "any";
  for (std::string* text : {&filter.station, &filter.verdict, &filter.kind}) {
    if (*text == any) text->clear();
  }
  return filter;
}

RunFilter filter_by_options(const StationRecordsOptions& options, const KnownRuns& known) {
  RunFilter filter = options.filter;
  if (filter.station.empty() && known.station_config() != nullptr) {
    filter.station = known.station_config()->station;
  }
  return remove_any_conditions(std::move(filter));
}

void check_output_option(const StationRecordsOptions& options, const KnownRuns& known) {
  if (options.output.empty()) return;
  std::vector<std::string> inputs{options.station, options.records};
  if (const StationConfig* station = known.station_config()) {
    inputs.push_back(station->records);
    for (const auto& file : station->inputs) inputs.push_back(file.string());
  }
  check_output_is_no_input(options.output, inputs);
}

}  // namespace vlp
