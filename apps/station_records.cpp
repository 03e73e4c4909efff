// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station_records.h"

#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>

#include "app.h"
#include "captures/printable.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "station/bias_study.h"
#include "station/capability.h"
#include "station/certificate.h"
#include "station/control_chart.h"
#include "station/database_name.h"
#include "station/export_runs.h"
#include "station/golden_due.h"
#include "station/measurement_study.h"
#include "station/publish_run.h"
#include "station/retention.h"
#include "station/spool.h"
#include "station/station_config.h"
#include "station/station_screen.h"

namespace vlp {
namespace {

constexpr const char* kAny = "any";

/// To stdout; what records hold of names is not for the terminal to obey.
void say(const std::string& text) { fmt::print("{}", printable(text)); }

/// What is known of runs: the records, and of a station those that wait for them, which are brought
/// there first.
struct Known {
  std::optional<Spool> spool;
  std::optional<Records> records;
  /// Empty for all.
  std::string station = {};
  /// Why the records cannot be asked.
  std::string away = {};

  explicit Known(const StationRecordsOptions& options) {
    if (options.station.empty() == options.records.empty()) {
      throw std::invalid_argument("which records? Give --station or --records");
    }
    std::string where = options.records;
    if (where.empty()) {
      const StationConfig config = read_station(options.station);
      where = config.records;
      station = config.station;
      spool.emplace(config.spool, where);
      spool->deliver();
    }
    // Not waited for twice.
    if (spool) away = spool->away();
    if (away.empty()) open(where);
    if (!away.empty() && waiting().empty()) throw std::runtime_error(away);
    const std::string state = spool ? spool->state() : "";
    if (!state.empty()) spdlog::warn("{}", printable(state));
  }

  void open(const std::string& where) {
    try {
      if (!is_server(where) && !std::filesystem::exists(where)) {
        throw InputError(name_of_database(where), "there are no records");
      }
      records.emplace(where);
    } catch (const InputError& error) {
      away = error.what();
    }
  }
  std::vector<RunRecord> waiting() { return spool ? spool->waiting() : std::vector<RunRecord>(); }
  /// Of the station: 'vlp-station hook' runs no others.
  std::vector<std::string> with_open_hook() {
    if (spool) return spool->with_open_hook(station);
    return records ? records->with_open_hook(station) : std::vector<std::string>();
  }
  /// For what cannot do without them.
  Records& all() {
    if (!records) throw std::runtime_error(away);
    return *records;
  }
};

/// A filter in which "any" is not asked for.
RunFilter asked(RunFilter filter) {
  for (std::string* text : {&filter.station, &filter.verdict, &filter.kind}) {
    if (*text == kAny) text->clear();
  }
  return filter;
}

bool passes(const RunRecord& run, const RunFilter& filter) {
  const auto is = [](const std::string& text, const std::string& wanted) {
    return wanted.empty() || text == wanted;
  };
  return is(run.camera, filter.camera) && is(run.station, filter.station) &&
         is(run.verdict, filter.verdict) && is(run.kind, filter.kind) &&
         run.ended_utc >= filter.since && (filter.until.empty() || run.ended_utc < filter.until);
}

/// Of the records, if they answer, and of those that wait; from the first to the last.
std::vector<RunSummary> runs_of(Known& known, const RunFilter& filter) {
  std::vector<RunSummary> runs;
  // First, so that a run that another program brings there meanwhile is in one of the two.
  const std::vector<RunRecord> waiting = known.waiting();
  if (known.records) runs = known.records->list(filter);
  for (const RunRecord& run : waiting) {
    const RunEvent* event = voided(run);
    const auto there = std::find_if(runs.begin(), runs.end(),
                                    [&](const RunSummary& other) { return other.run == run.run; });
    if (there != runs.end() && event != nullptr) there->voided = event->text;
    if (there != runs.end() || !passes(run, filter)) continue;
    runs.push_back({run.run, run.kind, run.station, run.camera, run.ended_utc, run.verdict,
                    "(waits here) " + run.causes, event == nullptr ? "" : event->text});
  }
  std::stable_sort(runs.begin(), runs.end(), [](const RunSummary& a, const RunSummary& b) {
    return std::tie(a.ended_utc, a.run) < std::tie(b.ended_utc, b.run);
  });
  return last_of(std::move(runs), filter.last);
}

/// The run that is named, or the last that the filter lets through.
RunRecord run_of(Known& known, const StationRecordsOptions& options) {
  std::string run = options.run;
  if (run.empty()) {
    const auto runs = runs_of(known, asked(options.filter));
    if (runs.empty()) throw std::invalid_argument("there is no such run");
    run = runs.back().run;
  }
  for (const RunRecord& waiting : known.waiting()) {
    if (waiting.run == run) return waiting;
  }
  auto record = known.all().find(run);
  if (!record) throw std::invalid_argument("there is no run " + run);
  return *record;
}

/// What is compared unless it is asked for otherwise: units of the station.
RunFilter comparable(const StationRecordsOptions& options) {
  RunFilter filter = options.filter;
  if (filter.kind.empty()) filter.kind = "unit";
  if (filter.station.empty() && !options.station.empty()) {
    filter.station = read_station(options.station).station;
  }
  return asked(filter);
}

/// The values of runs that were judged, unless one verdict is asked for.
std::vector<TrendPoint> judged(Records& records, const std::string& figure, RunFilter filter) {
  if (!filter.verdict.empty()) return records.trend(figure, filter);
  const int last = std::exchange(filter.last, 0);
  auto points = records.trend(figure, filter);
  std::erase_if(points,
                [](const TrendPoint& point) { return point.verdict == name_of(Verdict::invalid); });
  return last_of(std::move(points), last);
}

/// The folder into which files of a run go.
std::filesystem::path results_of(const StationRecordsOptions& options) {
  if (!options.output.empty()) return options.output;
  if (!options.station.empty()) return read_station(options.station).results;
  throw std::invalid_argument("where to? Give --station, whose results it goes to, or --output");
}

MetricKind figure_of(const StationRecordsOptions& options) {
  const auto kinds = unit_metrics();
  const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const MetricKind& any) { return any.name == options.figure; });
  if (kind != kinds.end()) return *kind;
  std::string names;
  for (const MetricKind& any : kinds) names.append(names.empty() ? "" : ", ").append(any.name);
  throw std::invalid_argument("there is no figure " + options.figure + "; there are: " + names);
}

/// The gate of a figure: the station's, or that of the last of the runs.
std::optional<double> gate_of(const std::string& figure, const StationRecordsOptions& options,
                              Records& records, const std::vector<TrendPoint>& points) {
  if (!options.station.empty()) {
    for (const Gate& gate : read_station(options.station).gates) {
      if (gate.metric == figure) return gate.limit;
    }
    return std::nullopt;
  }
  const auto last = points.empty() ? std::nullopt : records.find(points.back().run);
  if (!last) return std::nullopt;
  for (const CheckedMetric& any : last->figures) {
    if (any.name == figure) return any.limit;
  }
  return std::nullopt;
}

ToleranceLimits limits_of(const MetricKind& kind, std::optional<double> gate) {
  if (kind.asked == Direction::at_least) return {gate, std::nullopt};
  return {std::nullopt, gate};
}

/// Records that several stations share, when nothing says of which.
void check_one_station(const std::vector<TrendPoint>& points,
                       const StationRecordsOptions& options) {
  if (!options.station.empty() || !options.filter.station.empty()) return;
  for (const TrendPoint& point : points) {
    if (point.station == points.front().station) continue;
    throw std::invalid_argument(
        fmt::format("there are runs of {} and of {}: say of which with "
                    "--of-station, or of all with --of-station any",
                    points.front().station, point.station));
  }
}

/// The values of a study's units: of those that are named, or of those with two runs or more.
/// Throws std::invalid_argument for units of which there is none.
std::vector<StudyValue> study_values(const std::vector<TrendPoint>& points,
                                     const std::vector<std::string>& units) {
  std::map<std::string, std::size_t> runs;
  for (const TrendPoint& point : points) ++runs[point.camera];
  std::string unknown;
  for (const std::string& unit : units) {
    if (!runs.contains(unit)) unknown.append(unknown.empty() ? "" : ", ").append(unit);
  }
  if (!unknown.empty()) {
    throw std::invalid_argument("no judged run that has the figure is of: " + unknown);
  }
  std::vector<StudyValue> values;
  for (const TrendPoint& point : points) {
    const bool named = std::count(units.begin(), units.end(), point.camera) > 0;
    if (named || (units.empty() && runs[point.camera] > 1)) {
      values.push_back({point.camera, point.station, point.value});
    }
  }
  return values;
}

/// What a study gives, or why these values are none, as Undetermined.
template <typename Study>
auto determined(const Study& study) {
  try {
    return study();
  } catch (const std::invalid_argument& error) {
    throw Undetermined(error.what());
  }
}

/// UNIT=VALUE, by unit.
std::map<std::string, double> references_of(const std::vector<std::string>& texts) {
  std::map<std::string, double> references;
  for (const std::string& text : texts) {
    const auto at = text.rfind('=');
    std::istringstream number(at == std::string::npos ? "" : text.substr(at + 1));
    double value = 0;
    if (at == 0 || !(number >> value) || !number.eof() || !std::isfinite(value)) {
      throw std::invalid_argument("--reference: should be UNIT=VALUE, not " + text);
    }
    if (!references.emplace(text.substr(0, at), value).second) {
      throw std::invalid_argument("--reference: " + text.substr(0, at) + " stands twice");
    }
  }
  return references;
}

std::string words_of(const TestedEstimate& estimate) {
  return fmt::format("{:>12.4g}{:>12.3g}{:>9.2f}{:>9.4f}   {:.4g} to {:.4g}", estimate.value,
                     estimate.standard_error, estimate.t, estimate.p, estimate.low, estimate.high);
}

/// Bias and linearity of a station against reference units.
void show_bias(const MetricKind& kind, const StationRecordsOptions& options) {
  const auto references = references_of(options.references);
  Known known(options);
  const auto points = judged(known.all(), options.figure, comparable(options));
  check_one_station(points, options);
  std::vector<std::string> units;
  for (const auto& [unit, reference] : references) units.push_back(unit);
  std::vector<ReferenceValue> values;
  for (const auto& [unit, station, value] : study_values(points, units)) {
    values.push_back({unit, references.at(unit), value});
  }
  const BiasStudy study = determined([&] { return bias_study(values); });
  constexpr const char* head = "{:<20}{:>10}{:>6}{:>12}{:>12}{:>9}{:>9}   {}\n";
  say(fmt::format("{}: bias against {} reference units, {}\n\n", options.figure, study.units.size(),
                  std::string_view(kind.unit).empty() ? "a share" : kind.unit));
  say(fmt::format(head, "unit", "reference", "runs", "bias", "se", "t", "p", "95 % interval"));
  for (const UnitBias& unit : study.units) {
    say(fmt::format("{:<20}{:>10.4g}{:>6}{}{}\n", unit.unit, unit.reference, unit.count,
                    words_of(unit.bias), unit.bias.shows() ? "   shows" : ""));
  }
  const auto line = [](const char* name, const TestedEstimate& estimate) {
    fmt::print("{:<36}{}{}\n", name, words_of(estimate), estimate.shows() ? "   shows" : "");
  };
  line("all", study.all);
  if (study.linearity) {
    const Linearity& linearity = *study.linearity;
    fmt::print("\nbias = intercept + slope x reference\n");
    line("slope", linearity.slope);
    line("intercept", linearity.intercept);
    fmt::print("residual sd {:.4g}, R^2 {:.1f} %\n\n{:<20}{:>10}{:>18}   95 % band\n",
               linearity.residual_sd, 100 * linearity.r_squared, "", "reference", "line");
    for (const UnitBias& unit : study.units) {
      const double at = linearity.bias_at(unit.reference), half = linearity.band_at(unit.reference);
      say(fmt::format("{:<20}{:>10.4g}{:>18.4g}   {:.4g} to {:.4g}{}\n", unit.unit, unit.reference,
                      at, at - half, at + half, std::abs(at) > half ? "   without 0" : ""));
    }
  }
  if (!options.output.empty()) draw_bias(options.output, options.figure, values, study);
}

/// Deletes the folder of a run; its record tells of it as soon as nothing is in it. Throws
/// InputError.
void clear_away(const ExpiredFolder& expired, double mb, Spool& spool) {
  delete_content(expired);
  const auto& events = expired.run.events;
  const bool told = std::any_of(events.begin(), events.end(),
                                [&](const RunEvent& event) { return event.what == expired.what; });
  if (!told) {
    RunRecord run = expired.run;
    run.events.push_back(
        new_event(expired.what, fmt::format("kept {} days, {:.1f} MB", expired.days, mb)));
    spool.keep(run);
  }
  delete_folder(expired);
}

}  // namespace

void list_runs(const StationRecordsOptions& options) {
  Known known(options);
  const auto runs = runs_of(known, asked(options.filter));
  constexpr const char* line = "{:<34} {:<20} {:<8} {:<7} {:<12} {:<16} {}\n";
  say(fmt::format(line, "run", "ended (UTC)", "verdict", "kind", "station", "camera", "cause"));
  for (const RunSummary& run : runs) {
    const bool counts = run.voided.empty();
    say(fmt::format(line, run.run, run.ended_utc, counts ? run.verdict : "VOID", run.kind,
                    run.station, run.camera,
                    counts ? run.causes.substr(0, run.causes.find('\n'))
                           : "was " + run.verdict + ": " + run.voided));
  }
  const auto count = [&](Verdict verdict, const std::string& kind) {
    return std::count_if(runs.begin(), runs.end(), [&](const RunSummary& run) {
      return run.voided.empty() && run.verdict == name_of(verdict) &&
             (kind == kAny || run.kind == kind);
    });
  };
  fmt::print("\n{} runs, {} passed, {} failed, {} invalid", runs.size(), count(Verdict::pass, kAny),
             count(Verdict::fail, kAny), count(Verdict::invalid, kAny));
  const auto void_runs = std::count_if(runs.begin(), runs.end(),
                                       [](const RunSummary& run) { return !run.voided.empty(); });
  if (void_runs > 0) fmt::print(", {} voided", void_runs);
  // Of the units that were judged.
  const auto passed = count(Verdict::pass, "unit"), judged = passed + count(Verdict::fail, "unit");
  constexpr double percent = 100;
  if (judged > 0) {
    fmt::print(": yield {:.1f} % of {}", percent * double(passed) / double(judged), judged);
  }
  fmt::print("\n");
  const auto open = known.with_open_hook();
  const auto without = std::count_if(runs.begin(), runs.end(), [&](const RunSummary& run) {
    return std::binary_search(open.begin(), open.end(), run.run);
  });
  if (without > 0) {
    fmt::print("{} of them with a hook that has not ended well: 'vlp-station hook' runs it again\n",
               without);
  }
  known.all();  // these are not all there are when the records are away
}

void show_run(const StationRecordsOptions& options) {
  Known known(options);
  const RunRecord record = run_of(known, options);
  for (const ScreenLine& line : verdict_screen(record)) say(fmt::format("{}\n", line.text));
  fmt::print("\nfigures without a gate\n");
  for (const CheckedMetric& figure : record.figures) {
    if (figure.limit || !figure.value) continue;
    say(fmt::format("{:<24}{:>12.4g} {}\n", figure.name, *figure.value, figure.unit));
  }
  const auto used = std::count_if(record.images.begin(), record.images.end(),
                                  [](const auto& image) { return image.refused.empty(); });
  fmt::print("\n");
  for (const RunField& field : run_fields()) {
    if (field.label == nullptr || (record.*field.text).empty()) continue;
    say(fmt::format("{:<11}{}\n", field.label, record.*field.text));
  }
  fmt::print("images     {}, {} used\n", record.images.size(), used);
  for (const RunEvent& event : record.events) {
    const std::string who = event.who.empty() ? "" : event.who + ": ";
    say(fmt::format("{:<11} {} {}{}\n", event.what, event.utc(), who, event.text));
  }
}

void restore_run(const StationRecordsOptions& options) {
  const std::filesystem::path results = results_of(options);
  Known known(options);
  const RunRecord record = run_of(known, options);
  const std::string no_verdict = why_no_verdict(record);
  if (!no_verdict.empty()) throw InputError(record.run, no_verdict);
  say(fmt::format("{}\n", publish_run(record, {}, results).string()));
}

void write_certificate(const StationRecordsOptions& options) {
  const std::filesystem::path results = results_of(options);
  Known known(options);
  const RunRecord record = run_of(known, options);
  check_certifiable(record);
  const std::filesystem::path folder = publish_run(record, {}, results);
  const std::filesystem::path file = folder / "certificate.html";
  write_file(file, certificate(record, read_calibration(folder / calibration_name(record))));
  say(fmt::format("{}\n", file.string()));
}

void clean_up(const StationRecordsOptions& options) {
  const StationConfig config = read_station(options.station);
  if (!config.keep.images_days && !config.keep.results_days) {
    throw InputError(options.station, "keeps all for ever: add the key 'keep'");
  }
  Known known(options);
  const Retained found = look_for_expired(config, known.all());
  constexpr double megabyte = 1e6;
  double all_mb = 0;
  std::size_t done = 0;
  for (const ExpiredFolder& expired : found.expired) {
    const double mb = double(expired.bytes) / megabyte;
    try {
      if (options.remove) clear_away(expired, mb, *known.spool);
    } catch (const InputError& error) {
      spdlog::warn("{}", printable(error.what()));
      continue;
    }
    ++done;
    all_mb += mb;
    say(fmt::format("{:>10.1f} MB  {} of {}, {} {}\n", mb, expired.folder.string(),
                    expired.run.ended_utc, expired.run.verdict, options.remove ? "(deleted)" : ""));
  }
  for (const auto& folder : found.without_record) {
    spdlog::warn("{}: is of no run of the records: left", folder.string());
  }
  fmt::print("{} folders, {:.1f} MB{}\n", done, all_mb,
             options.remove ? " deleted" : ": --delete deletes them");
  known.spool->deliver();
  if (done == found.expired.size()) return;
  throw std::runtime_error(fmt::format("{} of {} folders could not be deleted",
                                       found.expired.size() - done, found.expired.size()));
}

void void_run(const StationRecordsOptions& options) {
  Known known(options);
  RunRecord record = run_of(known, options);
  if (const RunEvent* event = voided(record)) {
    throw std::invalid_argument(
        fmt::format("run {} was voided before, by {}: {}", record.run, event->who, event->text));
  }
  record.events.push_back(
      new_event(kVoided, printable(options.reason), printable(options.operator_name)));
  if (known.spool) {
    known.spool->keep(record);
    const StationConfig config = read_station(options.station);
    if (record.kind == "golden" && record.station == config.station) {
      forget_golden(config, record.run);
    }
    known.spool->deliver();
  } else {
    known.all().keep(record);
  }
  say(fmt::format("{} {} {}: voided\n", record.run, record.camera, record.verdict));
}

void verify_records(const StationRecordsOptions& options) {
  Known known(options);
  const TrailCheck found = known.all().check(options.noted);
  for (const std::string& problem : found.problems) say(fmt::format("{}\n", problem));
  fmt::print("{} runs, {} entries in the trail\n", found.runs, found.entries);
  if (!found.last_digest.empty()) fmt::print("last digest {}\n", found.last_digest);
  if (found.problems.empty()) return;
  throw GateNotMet(fmt::format(
      "the records are not as they were kept: {}{}", found.problems.front(),
      found.problems.size() == 1 ? "" : fmt::format(", and {} more", found.problems.size() - 1)));
}

void export_runs(const StationRecordsOptions& options) {
  Known known(options);
  Records& records = known.all();
  std::vector<RunRecord> runs;
  for (const RunSummary& run : records.list(asked(options.filter))) {
    if (auto record = records.find(run.run)) runs.push_back(std::move(*record));
  }
  write_runs(options.output, runs);
  fmt::print("{} runs\n", runs.size());
}

void show_trend(const StationRecordsOptions& options) {
  const MetricKind kind = figure_of(options);
  Known known(options);
  Records& records = known.all();
  RunFilter filter = comparable(options);
  if (options.filter.verdict.empty()) filter.verdict = name_of(Verdict::pass);
  const auto points = records.trend(options.figure, filter);
  check_one_station(points, options);
  constexpr std::size_t least = 2;
  if (points.size() < least) {
    throw Undetermined(
        fmt::format("{} of the runs have {}: a trend needs two", points.size(), options.figure));
  }
  const std::vector<double> values = values_of(points);
  const auto alarms = chart_alarms(values, options.rules);
  const ControlChart chart = control_chart(values);
  const auto gate = gate_of(options.figure, options, records, points);
  if (!options.output.empty()) draw_trend(options.output, options.figure, points, alarms, gate);
  say(fmt::format("{} of {} runs, {} to {}\nmean      {:.4g} {}\nlimits    {:.4g} to {:.4g}\n",
                  options.figure, points.size(), points.front().ended_utc, points.back().ended_utc,
                  chart.mean, kind.unit, chart.lower, chart.upper));
  if (gate) fmt::print("gate      {} {:.4g}\n", words_of(kind.asked), *gate);
  for (const ChartAlarm& alarm : alarms) {
    const TrendPoint& point = points[alarm.index];
    say(fmt::format("{} {} {} {:.4g}  {}: {}\n", point.ended_utc, point.run, point.camera,
                    point.value, alarm.rule, alarm.meaning));
  }
  if (alarms.empty()) return;
  throw GateNotMet(fmt::format("{}: {} alarms, the last {} at {}", options.figure, alarms.size(),
                               alarms.back().rule, points[alarms.back().index].run));
}

void show_capability(const StationRecordsOptions& options) {
  std::vector<MetricKind> kinds = unit_metrics();
  if (!options.figure.empty()) kinds = {figure_of(options)};
  Known known(options);
  Records& records = known.all();
  const RunFilter filter = comparable(options);
  constexpr const char* head = "{:<22}{:>5}{:>10}{:>10}{:>10}{:>10}   {:<22}{}\n";
  std::string rows;
  for (const MetricKind& kind : kinds) {
    const auto points = judged(records, kind.name, filter);
    check_one_station(points, options);
    const auto gate = gate_of(kind.name, options, records, points);
    const auto found = capability(values_of(points), limits_of(kind, gate));
    if (!found) continue;
    const auto index = [](const CapabilityIndex& of) {
      return fmt::format("{:.2f} ({:.2f} to {:.2f})", of.value, of.low, of.high);
    };
    rows += fmt::format(
        head, kind.name, found->count, fmt::format("{:.4g}", found->mean),
        fmt::format("{:.3g}", found->within_sd), fmt::format("{:.3g}", found->overall_sd),
        fmt::format("{} {:.4g}", kind.asked == Direction::at_least ? ">=" : "<=", gate.value_or(0)),
        index(found->cpk), index(found->ppk));
  }
  if (rows.empty()) {
    throw Undetermined(
        "no figure with a gate has two values that differ, of runs that were judged");
  }
  say(fmt::format(head, "figure", "runs", "mean", "sd within", "overall", "gate", "Cpk (95 %)",
                  "Ppk (95 %)") +
      rows);
}

void show_study(const StationRecordsOptions& options) {
  const MetricKind kind = figure_of(options);
  if (!options.references.empty()) return show_bias(kind, options);
  Known known(options);
  Records& records = known.all();
  RunFilter filter = options.filter;
  if (filter.kind.empty()) filter.kind = "unit";
  const auto points = judged(records, options.figure, asked(filter));
  const auto values = study_values(points, options.units);
  const MeasurementStudy study = determined([&] { return measurement_study(values); });
  const auto gate = gate_of(options.figure, options, records, points);
  say(fmt::format("{}: {} units, {} stations, {} runs each, mean {:.4g} {}\n\n", options.figure,
                  study.units, study.stations, study.repeats, study.mean, kind.unit));
  fmt::print("{:<18}{:>5}{:>14}{:>14}\n", "", "dof", "squares", "mean square");
  for (const auto& [name, line] :
       {std::pair("units", study.unit), std::pair("stations", study.station),
        std::pair("units x stations", study.both), std::pair("error", study.error)}) {
    fmt::print("{:<18}{:>5}{:>14.5g}{:>14.5g}\n", name, line.dof, line.sum_of_squares,
               line.mean_square());
  }
  if (study.interaction_p) {
    fmt::print("units x stations by chance with p = {:.3f}: {}\n", *study.interaction_p,
               study.pooled ? "taken as error" : "of its own");
  }
  fmt::print("\n{:<34}{:>12}{:>14}\n", "", "sd", "% of total");
  const auto part = [&](const char* name, double sd) {
    constexpr double percent = 100;
    fmt::print("{:<34}{:>12.5g}{:>14.1f}\n", name, sd,
               study.total > 0 ? percent * sd / study.total : 0);
  };
  part("repeatability (EV)", study.repeatability);
  if (study.stations > 1) {
    part("stations (AV)", study.of_station);
    part("units x stations (INT)", study.of_both);
  }
  part("measuring, all of it (GRR)", study.measuring);
  part("units (PV)", study.of_unit);
  part("total (TV)", study.total);
  if (const auto categories = study.distinct_categories()) {
    fmt::print("distinct categories (ndc){:>21}\n", *categories);
  }
  if (const auto share = study.percent_of_tolerance(limits_of(kind, gate))) {
    fmt::print("measuring / tolerance (P/T){:>19.1f} %\n", *share);
  } else if (gate) {
    fmt::print("no P/T: the mean is not within the gate, {} {:.4g}\n", words_of(kind.asked), *gate);
  }
  if (study.stations == 1) {
    fmt::print("\nOne station: nothing is known of what stations differ by.\n");
  }
}

}  // namespace vlp
