// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/station_config.h"

#include <algorithm>
#include <iterator>
#include <regex>
#include <stdexcept>

#include "captures/digest.h"
#include "captures/id.h"
#include "geometry/angles.h"
#include "rig/input_error.h"
#include "rig/yaml_reader.h"
#include "station/database_name.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr int kMany = 10'000;

/// Returns the path in a value.
fs::path resolve_path(const YamlValue& value, const fs::path& file) {
  const fs::path path = value.text();
  if (path.empty()) throw value.error("names nothing");
  return path.is_absolute() ? path : file.parent_path() / path;
}

void read_into(YamlMap& map, const char* key, int& metric) {
  if (const auto value = map.optional(key)) metric = value->integer_within(1, kMany);
}
void read_into(YamlMap& map, const char* key, double& metric, double max, const char* unit) {
  if (const auto value = map.optional(key)) metric = value->number_within(0, max, unit);
}

CompletionCriteria read_enough(YamlMap map) {
  CompletionCriteria sufficient;
  read_into(map, "board_views", sufficient.board_views);
  read_into(map, "board_coverage", sufficient.board_coverage, 1, "(share)");
  read_into(map, "turn_captures", sufficient.turn_captures);
  read_into(map, "turn_heights", sufficient.turn_heights);
  double arc_deg = deg_from_rad(sufficient.turn_arc_rad);
  read_into(map, "turn_arc_deg", arc_deg, 360, "degrees");
  sufficient.turn_arc_rad = rad_from_deg(arc_deg);
  read_into(map, "dispersion_captures", sufficient.dispersion_captures);
  read_into(map, "check_captures", sufficient.check_captures);
  map.finish();
  return sufficient;
}

void read_refusal(YamlMap map, StationConfig& config) {
  constexpr double max_px = 100;
  FrontendOptions& limits = config.frontend;
  read_into(map, "blur_px", limits.max_blur_px, max_px, "px");
  read_into(map, "dark_fraction", limits.min_bright_fraction, 1, "(share)");
  read_into(map, "white_fraction", limits.max_white_fraction, 1, "(share)");
  read_into(map, "same_pose_fraction", limits.same_view_fraction, 1, "(share)");
  read_into(map, "max_consecutive_rejections", config.max_consecutive_rejections);
  map.finish();
}

/// Reads the files that a station names, and stores their digests.
class Files {
 public:
  explicit Files(const fs::path& station) : station_(station) { add(station); }

  fs::path operator()(const YamlValue& value) {
    fs::path file = resolve_path(value, station_);
    add(file);
    return file;
  }
  std::string sha256() const { return sha256_of_text(digests_); }
  const std::vector<fs::path>& names() const { return names_; }

 private:
  void add(const fs::path& file) {
    digests_ += sha256_of_file(file) + "\n";
    names_.push_back(file);
  }

  const fs::path& station_;
  std::string digests_;
  std::vector<fs::path> names_;
};

/// Reads a calibration whose camera has row time and readout.
Calibration read_shutter(const YamlValue& value, Files& files) {
  Calibration calibration = read_calibration(files(value));
  if (!calibration.camera.row_time_s || !calibration.camera.readout) {
    throw value.error(
        "its camera should have row_time_s and readout, which are needed to identify lamps");
  }
  return calibration;
}

/// Adds guard bands to gates: {k: 1.645, standard_uncertainties: {METRIC: U}}.
void read_guard_bands(YamlMap map, std::vector<Gate>& gates) {
  constexpr double max_k = 10, max_u = 1e6;
  const YamlValue factor = map.required("k");
  const double k = factor.number_within(0, max_k, "(factor)");
  const YamlValue stated = map.required("standard_uncertainties");
  YamlMap uncertainties = stated.map();
  int found = 0;
  for (Gate& gate : gates) {
    const auto value = uncertainties.optional(gate.metric.c_str());
    if (!value) continue;
    ++found;
    const double u = value->number_within(0, max_u, "(in the gate's unit)");
    if (!(u > 0)) throw value->error("should be above 0");
    gate.guard = GuardBand{u, k};
    const MetricKind kind = metric_kind(gate.metric).value();
    const double accepted =
        CheckedMetric{gate.metric, "", {}, gate.limit, kind.direction, gate.guard}
            .acceptance_limit();
    if (accepted >= 0 && accepted <= kind.largest) continue;
    throw value->error(
        "leaves no value within the gate: k times this uncertainty exceeds the limit; lower k");
  }
  uncertainties.finish();  // uncertainties of metrics without a gate
  if (found == 0) throw stated.error("names no gate");
  map.finish();
}

GoldenUnit read_golden(YamlMap map, Files& files) {
  const YamlValue camera = map.required("camera_id");
  if (!Id::accepts(camera.text())) throw camera.error("is no id of a camera: it names a folder");
  GoldenUnit golden{camera.text(), {}, {}};
  const YamlValue calibration = map.required("calibration");
  golden.calibration = read_shutter(calibration, files);
  if (!golden.calibration.rotation_center) {
    throw calibration.error("should be a complete calibration: it has no rotation_center");
  }
  golden.gates = read_gates(map.required("gates"), unit_metrics());
  map.finish();
  return golden;
}

VerificationInterval read_verify_due(YamlMap map) {
  VerificationInterval due;
  constexpr double max_h = 10'000;
  if (const auto hours = map.optional("hours")) due.hours = hours->number_within(0, max_h, "h");
  if (const auto units = map.optional("units")) due.units = units->integer_within(1, 1'000'000);
  if (!due.hours && !due.units) throw map.error("should have hours or units");
  if (due.hours == 0) throw map.error("hours should be above 0");
  map.finish();
  return due;
}

Retention read_retention(YamlMap map) {
  Retention keep;
  constexpr int max_days = 36'525;
  const auto days = [&](const char* key, std::optional<int>& metric) {
    if (const auto value = map.optional(key)) metric = value->integer_within(1, max_days);
  };
  days("images_days", keep.images_days);
  days("results_days", keep.results_days);
  map.finish();
  return keep;
}

/// Iterator over a text that counts its steps, shared by its copies, and throws std::length_error
/// beyond a limit. std::regex has no limit of its own, and tries nested repetitions in
/// exponentially many combinations.
class CountedIterator {
 public:
  using iterator_category = std::bidirectional_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountedIterator() = default;
  CountedIterator(const char* at, long* steps) : at_(at), steps_(steps) {}

  reference operator*() const {
    constexpr long max_steps = 1'000'000;  // a serial of 64 characters requires hundreds
    if (++*steps_ > max_steps) throw std::length_error("steps");
    return *at_;
  }
  CountedIterator& operator++() {
    ++at_;
    return *this;
  }
  CountedIterator operator++(int) { return {at_++, steps_}; }
  CountedIterator& operator--() {
    --at_;
    return *this;
  }
  CountedIterator operator--(int) { return {at_--, steps_}; }
  friend bool operator==(const CountedIterator& a, const CountedIterator& b) {
    return a.at_ == b.at_;
  }

 private:
  const char* at_ = nullptr;
  long* steps_ = nullptr;
};

/// Returns the reason why a serial does not match a pattern; empty if it does.
std::string pattern_problem(const std::string& serial, const std::string& pattern) {
  long steps = 0;
  const CountedIterator begin(serial.data(), &steps), end(serial.data() + serial.size(), &steps);
  try {
    if (std::regex_match(begin, end, std::regex(pattern))) return "";
  } catch (const std::length_error&) {
    return "serial_pattern: the comparison is too slow for '" + serial +
           "': write it without a repetition in a repetition, such as (a+)+";
  }
  return "'" + serial + "' is not of the form " + pattern;
}

std::string read_pattern(const YamlValue& value) {
  std::string pattern = value.text();
  try {
    const std::regex compiled(pattern);
  } catch (const std::regex_error& error) {
    throw value.error(std::string("is no regular expression: ") + error.what());
  }
  return pattern;
}

/// Reads the command of a hook. A program with a folder in its name is relative to the station;
/// others are found by PATH.
Hook read_hook(YamlMap map, const fs::path& file) {
  Hook hook;
  const YamlValue command = map.required("command");
  for (const YamlValue& word : command.list()) hook.command.push_back(word.text());
  if (hook.command.empty() || hook.command.front().empty()) {
    throw command.error("should be a program and its arguments: [PROGRAM, ...]");
  }
  hook.folder = fs::absolute(file).parent_path();
  std::string& program = hook.command.front();
  if (program.find('/') != std::string::npos) program = (hook.folder / program).string();
  constexpr double max_s = 3600;
  if (const auto limit = map.optional("time_limit_s")) {
    hook.time_limit_s = limit->number_within(0, max_s, "seconds");
    if (!(hook.time_limit_s > 0)) throw limit->error("should be above 0");
  }
  map.finish();
  return hook;
}

/// Returns a database: a file relative to the station, or a server.
std::string read_records(const YamlValue& value, const fs::path& file) {
  const std::string where = value.text();
  if (where.starts_with("postgresql://") || where.starts_with("postgres://")) return where;
  if (is_server_address(where)) throw value.error("should name a file, or be postgresql://...");
  describe_database(where);  // checks the name of a file
  return resolve_path(value, file).string();
}

}  // namespace

std::string camera_id_problem(const std::string& camera_id) {
  if (std::regex_match(camera_id, std::regex("[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"))) return "";
  return "a camera's id has letters, digits, '-', '_' and '.', up to 64, no '.' first";
}

std::string serial_problem(const StationConfig& config, const std::string& serial) {
  std::string problem = camera_id_problem(serial);
  if (!problem.empty() || config.serial_pattern.empty()) return problem;
  return pattern_problem(serial, config.serial_pattern);
}

std::vector<MetricKind> unit_metrics() {
  return metric_kinds({MetricSource::station, MetricSource::lens, MetricSource::rotation,
                       MetricSource::dispersion});
}

StationConfig read_station(const fs::path& file) {
  YamlMap document = read_yaml(file, "vlp-station/1");
  Files files(file);
  StationConfig config;
  config.file = file;
  config.station = document.required("station").text();
  const YamlValue type = document.required("camera_type");
  config.type = read_shutter(type, files).camera;
  config.type_file = fs::path(type.text()).filename().string();
  const YamlValue board = document.required("board");
  config.board = read_board(files(board));
  if (config.board.has_squares()) {
    throw board.error("is a board of squares: the station looks for one of AprilTags");
  }
  const auto room = document.optional("room");
  config.lamps =
      read_lamps_of_room(files(document.required("lamps")), room ? room->text() : std::string());
  if (const auto place = document.optional("dispersion_station_m")) {
    config.dispersion_station_m = Eigen::Vector2d(place->numbers(2).data());
  }
  if (const auto sufficient = document.optional("completion"))
    config.sufficient = read_enough(sufficient->map());
  if (const auto refuse = document.optional("rejection")) read_refusal(refuse->map(), config);
  config.gates = read_gates(document.required("gates"), unit_metrics());
  if (const auto guard = document.optional("guard_bands")) {
    read_guard_bands(guard->map(), config.gates);
  }
  if (const auto golden = document.optional("golden")) {
    config.golden = read_golden(golden->map(), files);
  }
  if (const auto due = document.optional("verify_due")) {
    if (!config.golden) throw due->error("needs a golden unit: add the key 'golden'");
    config.verify_due = read_verify_due(due->map());
  }
  if (const auto pattern = document.optional("serial_pattern")) {
    config.serial_pattern = read_pattern(*pattern);
  }
  if (const auto operators = document.optional("void_operators")) {
    const std::vector<YamlValue> names = operators->list();
    if (names.empty()) throw operators->error("names nobody; leave it out if all may void runs");
    std::ranges::transform(names, std::back_inserter(config.void_operators),
                           [](const YamlValue& name) { return name.text(); });
  }
  config.captures = resolve_path(document.required("captures"), file);
  config.results = resolve_path(document.required("results"), file);
  config.records = read_records(document.required("records"), file);
  const auto spool = document.optional("spool");
  config.spool = spool ? resolve_path(*spool, file) : file.parent_path() / "spool";
  if (const auto keep = document.optional("retention")) config.keep = read_retention(keep->map());
  if (const auto hook = document.optional("hook")) config.hook = read_hook(hook->map(), file);
  document.finish();
  const auto& lamps = config.lamps.lamps;
  if (std::none_of(lamps.begin(), lamps.end(), [](const Lamp& l) { return l.frequency_hz; })) {
    throw InputError(
        file, "no lamp of the map has a frequency_hz, which is needed to identify lamps; add it");
  }
  config.inputs = files.names();
  config.sha256 = files.sha256();
  return config;
}

}  // namespace vlp
