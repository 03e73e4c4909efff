// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/run_record.h"

#include <ceres/version.h>
#include <fmt/core.h>
#include <pwd.h>
#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <random>
#include <regex>
#include <set>
#include <stdexcept>
#include <utility>

#include "calibration/intrinsics/mrcal_files.h"
#include "captures/csv_writer.h"
#include "captures/number_text.h"
#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "station/database_name.h"

namespace vlp {
namespace {

std::string format_utc(std::time_t time, const char* format) {
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, format, &parts)};
}

/// Returns the time of the clock of this file: std::time() lags behind it by a tick of the kernel.
std::time_t current_time_s() {
  return std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
}

constexpr const char* kUtcFormat = "%Y-%m-%dT%H:%M:%SZ";

/// Parses a UTC as 2026-11-21T13:45:01Z; std::nullopt for another text.
std::optional<std::time_t> parse_utc(const std::string& text) {
  std::tm parts{};
  const char* end = ::strptime(text.c_str(), kUtcFormat, &parts);
  return end != nullptr && *end == '\0' ? std::optional(::timegm(&parts)) : std::nullopt;
}

/// Returns the account that runs this program, and its machine.
std::string describe_account() {
  const passwd* user = ::getpwuid(::geteuid());
  return fmt::format("{}@{}", user != nullptr ? user->pw_name : std::to_string(::geteuid()),
                     get_host_name());
}

}  // namespace

void RunRecord::set_causes(std::vector<Cause> new_causes) {
  if (std::string problem = describe_clock_problem(*this); !problem.empty()) {
    new_causes.insert(new_causes.begin(), {std::move(problem), false});
  }
  verdict = verdict_name(decide_verdict(new_causes));
  causes.clear();
  for (const Cause& cause : new_causes) causes.append(cause.text).append("\n");
}

void RunRecord::invalidate_verdict(const std::string& reason) {
  verdict = verdict_name(Verdict::invalid);
  causes = reason + "\n" + causes;
}

const CheckedMetric* RunRecord::find_metric(std::string_view name) const {
  const auto metric = std::ranges::find(metrics, name, &CheckedMetric::name);
  return metric == metrics.end() ? nullptr : &*metric;
}

std::ptrdiff_t RunRecord::count_used_images() const {
  return std::ranges::count_if(images, &Image::is_image_used);
}

const RunEvent* find_voiding_event(const RunRecord& record) {
  const auto event = std::ranges::find(record.events, kVoided, &RunEvent::kind);
  return event == record.events.end() ? nullptr : &*event;
}

std::ptrdiff_t get_last_event_index(const RunRecord& record, const char* kind) {
  const auto event = std::find_if(record.events.rbegin(), record.events.rend(),
                                  [&](const RunEvent& each) { return each.kind == kind; });
  return record.events.rend() - event - 1;
}

std::string format_void_command(const std::string& run, const std::filesystem::path& station_file) {
  return fmt::format("vlp-station void {} --station {} --operator NAME --reason WHY", run,
                     station_file.string());
}

std::string describe_image_user(const ImageUser& owner, const std::filesystem::path& station_file) {
  // [STATION-6] `if its serial was`
  return fmt::format("camera {}, run {}: if its serial was wrong, '{}' frees its images",
                     owner.camera, owner.run, format_void_command(owner.run, station_file));
}

bool has_images_of(const RunRecord& run, const RunRecord& earlier) {
  if (run.camera != earlier.camera || run.run == earlier.run) return false;
  std::set<std::string> earlier_digests;
  for (const RunRecord::Image& image : earlier.images) {
    if (image.is_image_used()) earlier_digests.insert(image.sha256);
  }
  return run.count_used_images() > 0 &&
         std::ranges::none_of(run.images, [&](const RunRecord::Image& image) {
           return image.is_image_used() && !earlier_digests.contains(image.sha256);
         });
}

std::string explain_void_verdict(const RunRecord& record) {
  if (const RunEvent* event = find_voiding_event(record)) {
    return fmt::format("was voided by {}: {}", event->author, event->text);
  }
  if (!record.has_run_passed()) return "";
  // [STATION-15] `changed by hand`
  constexpr const char* words = "the record has PASS, but {}: it was changed by hand";
  if (!record.causes.empty()) return fmt::format(words, "names a cause");
  for (const CheckedMetric& metric : record.metrics) {
    if (metric.limit && !metric.has_passed_gate()) return fmt::format(words, describe_gate(metric));
  }
  return "";
}

std::string make_run_id() {
  using namespace std::chrono;
  const auto now = system_clock::now();
  const auto second = floor<seconds>(now);
  std::random_device random;
  std::uniform_int_distribution<std::uint64_t> eleven_digits(0, 0xfff'ffff'ffff);
  return format_utc(system_clock::to_time_t(second), "%Y%m%dT%H%M%SZ-") +
         fmt::format("{:05x}{:011x}", duration_cast<microseconds>(now - second).count(),
                     eleven_digits(random));
}

bool is_run_id(const std::string& text) {
  return std::regex_match(text, std::regex("[0-9]{8}T[0-9]{6}Z-[0-9a-f]{16}"));
}

std::string start_utc_of_run_id(const std::string& run) {
  constexpr std::size_t length = 16;  // 20261121T134501Z
  if (run.size() < length || run[8] != 'T' || run[15] != 'Z') return "";
  return run.substr(0, 4) + "-" + run.substr(4, 2) + "-" + run.substr(6, 5) + ":" +
         run.substr(11, 2) + ":" + run.substr(13, 3);
}

RunEvent make_run_event_now(const std::string& kind, const std::string& text,
                            const std::string& operator_name) {
  return {make_run_id(), kind, text,
          operator_name.empty() ? describe_account()
                                : fmt::format("{} ({})", operator_name, describe_account())};
}

double compute_utc_age_s(const std::string& utc) {
  const auto time = parse_utc(utc);
  return time ? std::difftime(current_time_s(), *time) : std::numeric_limits<double>::quiet_NaN();
}

std::string get_current_utc() { return format_utc(current_time_s(), kUtcFormat); }

std::string describe_utc_problem(const std::string& text) {
  constexpr std::array<std::size_t, 4> lengths{10, 16, 19, 20};
  if (std::ranges::find(lengths, text.size()) != lengths.end()) {
    const std::string whole = text + std::string("2026-11-21T00:00:00Z").substr(text.size());
    // Formatting changes an invalid date, such as 30 February, and an incomplete number.
    const auto time = parse_utc(whole);
    if (time && format_utc(*time, kUtcFormat) == whole) return "";
  }
  return "should be a UTC as 2026-11-21 or 2026-11-21T13:45, not " + text;
}

std::string list_library_versions() {
  return fmt::format("OpenCV {}, AprilTag {}, mrcal {}, Ceres {}, Eigen {}.{}.{}",
                     cv::getVersionString(), VLP_APRILTAG_VERSION, get_mrcal_version(),
                     CERES_VERSION_STRING, EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
                     EIGEN_MINOR_VERSION);
}

std::span<const RunField> list_run_fields() {
  static constexpr std::array fields{
      RunField{"run", &RunRecord::run, "run"},
      RunField{"kind", &RunRecord::kind},
      RunField{"station", &RunRecord::station, "station"},
      RunField{"camera", &RunRecord::camera},
      RunField{"operator_name", &RunRecord::operator_name, "operator"},
      RunField{"shift", &RunRecord::shift, "shift"},
      RunField{"begun_utc", &RunRecord::begun_utc, "begun"},
      RunField{"ended_utc", &RunRecord::ended_utc, "ended"},
      RunField{"verdict", &RunRecord::verdict},
      RunField{"causes", &RunRecord::causes},
      RunField{"program", &RunRecord::program, "program"},
      RunField{"libraries", &RunRecord::libraries, "libraries", false},
      RunField{"config_sha256", &RunRecord::config_sha256, "config"},
      RunField{"calibration", &RunRecord::calibration, nullptr, false}};
  return fields;
}

RunRecord escape_run(RunRecord run) {
  for (const RunField& field : list_run_fields()) {
    const bool has_lines =
        field.text == &RunRecord::causes || field.text == &RunRecord::calibration;
    std::string& text = run.*field.text;
    text = has_lines ? escape_for_terminal(text) : escape_for_line(text);
  }
  for (RunRecord::Image& image : run.images) {
    image.name = escape_for_line(image.name);
    image.rejection = escape_for_line(image.rejection);
  }
  for (RunEvent& event : run.events) {
    event.text = escape_for_line(event.text);
    event.author = escape_for_line(event.author);
  }
  return run;
}

std::string describe_clock_problem(const RunRecord& run) {
  if (run.begun_utc <= run.ended_utc) return "";
  return fmt::format(
      "the clock went back: the run ended {}, before it began {}: set the clock, and measure again",
      run.ended_utc, run.begun_utc);
}

RunRecord make_run_record(const char* kind, const StationConfig& config, const std::string& camera,
                          const std::string& run, const ProgramVersion& program) {
  RunRecord record;
  record.run = run;
  record.kind = kind;
  record.station = config.station;
  record.camera = camera;
  record.begun_utc = start_utc_of_run_id(run);
  record.ended_utc = get_current_utc();
  record.program = program.program + " " + program.version;
  record.libraries = list_library_versions();
  record.config_sha256 = config.sha256;
  return record;
}

namespace {

using Json = nlohmann::ordered_json;

constexpr int kDigits = 9;
constexpr const char* kRunFormat = "vlp-run/3";
constexpr std::size_t kMaxDocumentBytes = 16 << 20;

std::string join_lines(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  std::string joined;
  for (const char c : text) joined += c == '\n' ? std::string("; ") : std::string(1, c);
  return joined;
}

/// Returns list_unit_metrics() and the other metrics of these runs.
std::vector<MetricKind> list_columns(const std::vector<RunRecord>& runs) {
  auto kinds = list_unit_metrics();
  for (const MetricKind& kind : list_metric_kinds({MetricSource::evaluation})) {
    const auto has_kind = [&](const RunRecord& run) {
      return run.find_metric(kind.name) != nullptr;
    };
    if (std::ranges::any_of(runs, has_kind)) kinds.push_back(kind);
  }
  return kinds;
}

void write_csv(const std::filesystem::path& file, const std::vector<RunRecord>& runs) {
  const auto kinds = list_columns(runs);
  std::vector<std::string> header;
  for (const RunField& field : list_run_fields()) {
    if (field.is_column) header.emplace_back(field.name);
  }
  for (const MetricKind& kind : kinds) header.emplace_back(kind.name);
  CsvWriter csv(file, header);
  for (const RunRecord& run : runs) {
    std::vector<std::string> row;
    for (const RunField& field : list_run_fields()) {
      if (field.is_column) row.push_back(join_lines(run.*field.text));
    }
    for (const MetricKind& kind : kinds) {
      const CheckedMetric* metric = run.find_metric(kind.name);
      const bool has_value = metric != nullptr && metric->value;
      row.push_back(has_value ? format_digits(*metric->value, kDigits) : "");
    }
    csv.write_csv_row(row);
  }
  csv.save_file();
}

Json json_number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

std::optional<double> read_optional_number(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

Json make_run_json(const RunRecord& run) {
  Json json;
  json["format"] = kRunFormat;
  for (const RunField& field : list_run_fields()) json[field.name] = run.*field.text;
  json["metrics"] = Json::object();
  for (const CheckedMetric& metric : run.metrics) {
    Json& entry = json["metrics"][metric.name];
    entry = {{"value", json_number_or_null(metric.value)},
             {"unit", metric.unit},
             {"gate", json_number_or_null(metric.limit)},
             {"at_least", metric.direction == Direction::at_least},
             {"passed", metric.has_passed_gate()}};
    if (!metric.guard_band) continue;
    entry["uncertainty"] = metric.guard_band->standard_uncertainty;
    entry["guard_k"] = metric.guard_band->k;
    entry["conformance_probability"] = json_number_or_null(metric.conformance_probability());
  }
  json["images"] = Json::array();
  for (const auto& [step, name, sha256, refused] : run.images) {
    json["images"].push_back(
        {{"step", step}, {"image", name}, {"sha256", sha256}, {"rejection", refused}});
  }
  return json;
}

/// Returns the document of a run, with its events.
Json make_run_json_with_events(const RunRecord& run) {
  Json json = make_run_json(run);
  json["events"] = Json::array();
  for (const RunEvent& event : run.events) {
    json["events"].push_back({{"event", event.event},
                              {"what", event.kind},
                              {"text", event.text},
                              {"who", event.author}});
  }
  return json;
}

RunRecord parse_run(const Json& json) {
  if (json.at("format") != kRunFormat) throw std::runtime_error("another format");
  RunRecord run;
  for (const RunField& field : list_run_fields()) json.at(field.name).get_to(run.*field.text);
  // [STATION-12] `no verdict`
  if (run.run.empty() || run.verdict.empty()) throw std::runtime_error("no run, or no verdict");
  for (const auto& [name, metric] : json.at("metrics").items()) {
    run.metrics.push_back(
        {name,
         metric.at("unit"),
         read_optional_number(metric.at("value")),
         read_optional_number(metric.at("gate")),
         metric.at("at_least").get<bool>() ? Direction::at_least : Direction::at_most,
         {}});
    if (!metric.contains("guard_k")) continue;
    run.metrics.back().guard_band =
        GuardBand{metric.at("uncertainty").get<double>(), metric.at("guard_k").get<double>()};
  }
  for (const Json& image : json.at("images")) {
    run.images.push_back(
        {image.at("step"), image.at("image"), image.at("sha256"), image.at("rejection")});
  }
  return run;
}

/// Serializes JSON; replaces bytes that are no UTF-8.
std::string serialize(const Json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) +
         (indent < 0 ? "" : "\n");
}

}  // namespace

std::string serialize_run(const RunRecord& run) {
  return serialize(make_run_json(escape_run(run)), -1);
}

RunRecord parse_run_document(const std::string& document) {
  try {
    if (document.size() > kMaxDocumentBytes) throw std::runtime_error("it has more than 16 MiB");
    check_json_limits(document);
    return parse_run(Json::parse(document));
  } catch (const std::exception& error) {
    // [STATION-12] `no run of a station` | run edited by hand | compare with a backup
    throw std::runtime_error(std::string("is no run of a station: ") + error.what());
  }
}

std::string format_hook_json(const RunRecord& run) {
  Json json;
  json["event"] = find_voiding_event(run) != nullptr ? "voided" : "verdict";
  json.update(make_run_json_with_events(escape_run(run)));
  return serialize(json, 1);
}

void write_runs(const std::filesystem::path& file, const std::vector<RunRecord>& runs) {
  if (file.extension() == ".csv") return write_csv(file, runs);
  if (file.extension() != ".json") throw InputError(file, "should end in .csv or .json");
  Json all = Json::array();
  for (const RunRecord& run : runs) all.push_back(make_run_json_with_events(escape_run(run)));
  write_file(file, serialize(all, 1));
}

}  // namespace vlp
