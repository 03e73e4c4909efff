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
#include "rig/lamp_map_file.h"
#include "rig/yaml_reader.h"
#include "station/database_name.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr int kMany = 10'000;

/// Returns the path in a value.
fs::path resolve_path(const YamlValue& value, const fs::path& file) {
  const fs::path path = value.read_text();
  if (path.empty()) throw value.make_error("names nothing");
  return path.is_absolute() ? path : file.parent_path() / path;
}

void read_optional_into(YamlMap& map, const char* key, int& target) {
  if (const auto value = map.find(key)) target = value->read_integer({1, kMany});
}
void read_optional_into(YamlMap& map, const char* key, double& target, double max,
                        const char* unit) {
  if (const auto value = map.find(key)) target = value->read_number({0, max, unit});
}

CompletionCriteria read_completion_criteria(YamlMap map) {
  CompletionCriteria sufficient;
  read_optional_into(map, "board_views", sufficient.board_views);
  read_optional_into(map, "board_coverage", sufficient.board_coverage, 1, "(share)");
  read_optional_into(map, "turn_captures", sufficient.rotation_captures);
  read_optional_into(map, "turn_heights", sufficient.rotation_heights);
  double arc_deg = deg_from_rad(sufficient.rotation_arc_rad);
  read_optional_into(map, "turn_arc_deg", arc_deg, 360, "degrees");
  sufficient.rotation_arc_rad = rad_from_deg(arc_deg);
  read_optional_into(map, "dispersion_captures", sufficient.dispersion_captures);
  read_optional_into(map, "check_captures", sufficient.check_captures);
  map.check_all_keys_read();
  return sufficient;
}

void read_rejection_limits(YamlMap map, StationConfig& config) {
  FrontendOptions& limits = config.frontend;
  read_optional_into(map, "blur_fraction", limits.max_blur_fraction, 0.1, "(share)");
  read_optional_into(map, "dark_fraction", limits.min_bright_fraction, 1, "(share)");
  read_optional_into(map, "white_fraction", limits.max_white_fraction, 1, "(share)");
  read_optional_into(map, "same_pose_fraction", limits.same_view_fraction, 1, "(share)");
  read_optional_into(map, "max_consecutive_rejections", config.max_consecutive_rejections);
  map.check_all_keys_read();
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
  std::string compute_sha256() const { return compute_text_sha256(digests_); }
  const std::vector<fs::path>& file_names() const { return names_; }

 private:
  void add(const fs::path& file) {
    digests_ += compute_file_sha256(file) + "\n";
    names_.push_back(file);
  }

  const fs::path& station_;
  std::string digests_;
  std::vector<fs::path> names_;
};

/// Reads a calibration whose camera has row time and readout.
Calibration read_row_time_and_readout(const YamlValue& value, Files& files) {
  Calibration calibration = read_calibration(files(value));
  if (!calibration.camera.row_time_s || !calibration.camera.readout) {
    throw value.make_error(
        "its camera should have row_time_s and readout, which are needed to identify lamps");
  }
  return calibration;
}

/// Adds guard bands to gates: {k: 1.645, standard_uncertainties: {METRIC: U}}.
void read_guard_bands(YamlMap map, std::vector<Gate>& gates) {
  constexpr double max_k = 10, max_u = 1e6;
  const YamlValue factor = map.require("k");
  const double k = factor.read_number({0, max_k, "(factor)"});
  const YamlValue stated = map.require("standard_uncertainties");
  YamlMap uncertainties = stated.read_mapping();
  int found = 0;
  for (Gate& gate : gates) {
    const auto value = uncertainties.find(gate.metric.c_str());
    if (!value) continue;
    ++found;
    const double u = value->read_number({0, max_u, "(in the gate's unit)"});
    if (!(u > 0)) throw value->make_error("should be above 0");
    gate.guard_band = GuardBand{u, k};
    const MetricKind kind = find_metric_kind(gate.metric).value();
    const double accepted =
        CheckedMetric{gate.metric, "", {}, gate.limit, kind.direction, gate.guard_band}
            .acceptance_limit();
    if (accepted >= 0 && accepted <= kind.max_limit) continue;
    throw value->make_error(
        "leaves no value within the gate: k times this uncertainty exceeds the limit; lower k");
  }
  uncertainties.check_all_keys_read();  // uncertainties of metrics without a gate
  if (found == 0) throw stated.make_error("names no gate");
  map.check_all_keys_read();
}

GoldenUnit read_golden(YamlMap map, Files& files) {
  const YamlValue camera = map.require("camera_id");
  if (!Id::is_valid_name_of_camera_or_run(camera.read_text()))
    throw camera.make_error("is no id of a camera: it names a folder");
  GoldenUnit golden{camera.read_text(), {}, {}};
  const YamlValue calibration = map.require("calibration");
  golden.calibration = read_row_time_and_readout(calibration, files);
  if (!golden.calibration.rotation_center) {
    throw calibration.make_error("should be a complete calibration: it has no rotation_center");
  }
  golden.gates = read_gates(map.require("gates"), list_unit_metric_kinds());
  map.check_all_keys_read();
  return golden;
}

VerificationInterval read_verification_interval(YamlMap map) {
  VerificationInterval due;
  constexpr double max_h = 10'000;
  if (const auto hours = map.find("hours")) due.hours = hours->read_number({0, max_h, "h"});
  if (const auto units = map.find("units")) due.units = units->read_integer({1, 1'000'000});
  if (!due.hours && !due.units) throw map.make_error("should have hours or units");
  if (due.hours == 0) throw map.make_error("hours should be above 0");
  map.check_all_keys_read();
  return due;
}

Retention read_retention(YamlMap map) {
  Retention keep;
  constexpr int max_days = 36'525;
  const auto days = [&](const char* key, std::optional<int>& metric) {
    if (const auto value = map.find(key)) metric = value->read_integer({1, max_days});
  };
  days("images_days", keep.images_days);
  days("results_days", keep.results_days);
  map.check_all_keys_read();
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
std::string describe_serial_pattern_mismatch(const std::string& serial,
                                             const std::string& pattern) {
  long steps = 0;
  const CountedIterator begin(serial.data(), &steps), end(serial.data() + serial.size(), &steps);
  try {
    if (std::regex_match(begin, end, std::regex(pattern))) return "";
  } catch (const std::length_error&) {
    return "serial_pattern: the comparison is too slow for '" + serial +
           "': write it without a repetition in a repetition, such as (a+)+";
  }
  // [STATION-5] `not of the form` | serial outside `serial_pattern`: other code scanned? | scan
  //   again
  return "'" + serial + "' is not of the form " + pattern;
}

std::string read_pattern(const YamlValue& value) {
  std::string pattern = value.read_text();
  try {
    const std::regex compiled(pattern);
  } catch (const std::regex_error& error) {
    throw value.make_error(std::string("is no regular expression: ") + error.what());
  }
  return pattern;
}

/// Reads the command of a hook. A program with a folder in its name is relative to the station;
/// others are found by PATH.
Hook read_hook(YamlMap map, const fs::path& file) {
  Hook hook;
  const YamlValue command = map.require("command");
  for (const YamlValue& word : command.read_list()) hook.command.push_back(word.read_text());
  if (hook.command.empty() || hook.command.front().empty()) {
    throw command.make_error("should be a program and its arguments: [PROGRAM, ...]");
  }
  hook.folder = fs::absolute(file).parent_path();
  std::string& program = hook.command.front();
  if (program.find('/') != std::string::npos) program = (hook.folder / program).string();
  constexpr double max_s = 3600;
  if (const auto limit = map.find("time_limit_s")) {
    hook.time_limit_s = limit->read_number({0, max_s, "seconds"});
    if (!(hook.time_limit_s > 0)) throw limit->make_error("should be above 0");
  }
  map.check_all_keys_read();
  return hook;
}

/// Returns a database: a file relative to the station, or a server.
std::string read_records_address(const YamlValue& value, const fs::path& file) {
  const std::string where = value.read_text();
  if (where.starts_with("postgresql://") || where.starts_with("postgres://")) return where;
  if (is_database_server_address(where))
    throw value.make_error("should name a file, or be postgresql://...");
  describe_database(where);  // checks the name of a file
  return resolve_path(value, file).string();
}

/// Reads the camera type and the targets that it observes: board, lamps and known position.
void read_camera_and_targets(YamlMap& document, Files& files, StationConfig& config) {
  const YamlValue type = document.require("camera_type");
  config.nominal_camera = read_row_time_and_readout(type, files).camera;
  config.type_file = fs::path(type.read_text()).filename().string();
  const YamlValue board = document.require("board");
  config.board = read_board(files(board));
  if (config.board.has_chessboard_squares()) {
    throw board.make_error("is a board of squares: the station looks for one of AprilTags");
  }
  const auto room = document.find("room");
  config.lamps = read_overhead_lamps_of_room(files(document.require("lamps")),
                                             room ? room->read_text() : std::string());
  if (const auto place = document.find("dispersion_position_m")) {
    config.dispersion_position_m = Eigen::Vector2d(place->read_numbers(2).data());
  }
}

/// Reads the conditions of a verdict: completion, rejection of images, gates and golden unit.
void read_verdict_conditions(YamlMap& document, Files& files, StationConfig& config) {
  if (const auto sufficient = document.find("completion"))
    config.completion = read_completion_criteria(sufficient->read_mapping());
  if (const auto refuse = document.find("rejection"))
    read_rejection_limits(refuse->read_mapping(), config);
  config.gates = read_gates(document.require("gates"), list_unit_metric_kinds());
  if (const auto guard = document.find("guard_bands")) {
    read_guard_bands(guard->read_mapping(), config.gates);
  }
  if (const auto golden = document.find("golden")) {
    config.golden_unit = read_golden(golden->read_mapping(), files);
  }
  if (const auto due = document.find("verify_due")) {
    if (!config.golden_unit) throw due->make_error("needs a golden unit: add the key 'golden'");
    config.verification_interval = read_verification_interval(due->read_mapping());
  }
}

/// Reads the valid serials, and the operators who may void runs.
void read_serials_and_operators(YamlMap& document, StationConfig& config) {
  if (const auto pattern = document.find("serial_pattern")) {
    config.serial_pattern = read_pattern(*pattern);
  }
  if (const auto operators = document.find("void_operators")) {
    const std::vector<YamlValue> names = operators->read_list();
    if (names.empty())
      throw operators->make_error("names nobody; leave it out if all may void runs");
    std::ranges::transform(names, std::back_inserter(config.void_operators),
                           [](const YamlValue& name) { return name.read_text(); });
  }
}

/// Reads the folders of images and results, and where and how long runs are kept.
void read_storage(YamlMap& document, StationConfig& config) {
  const fs::path& file = config.file;
  config.captures = resolve_path(document.require("captures"), file);
  config.results = resolve_path(document.require("results"), file);
  config.records = read_records_address(document.require("records"), file);
  const auto spool = document.find("spool");
  config.spool = spool ? resolve_path(*spool, file) : file.parent_path() / "spool";
  if (const auto keep = document.find("retention"))
    config.retention = read_retention(keep->read_mapping());
}

}  // namespace

std::string describe_camera_id_problem(const std::string& camera_id) {
  if (std::regex_match(camera_id, std::regex("[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"))) return "";
  return "a camera's id has letters, digits, '-', '_' and '.', up to 64, no '.' first";
}

std::string describe_serial_number_problem(const StationConfig& config, const std::string& serial) {
  std::string problem = describe_camera_id_problem(serial);
  if (!problem.empty() || config.serial_pattern.empty()) return problem;
  return describe_serial_pattern_mismatch(serial, config.serial_pattern);
}

std::vector<MetricKind> list_unit_metric_kinds() {
  return list_metric_kinds({MetricSource::station, MetricSource::lens, MetricSource::rotation,
                            MetricSource::dispersion});
}

StationConfig read_station_config(const fs::path& file) {
  YamlMap document = read_yaml_file(file, "vlp-station/1");
  Files files(file);
  StationConfig config;
  config.file = file;
  config.station = document.require("station").read_text();
  read_camera_and_targets(document, files, config);
  read_verdict_conditions(document, files, config);
  read_serials_and_operators(document, config);
  read_storage(document, config);
  if (const auto hook = document.find("hook")) config.hook = read_hook(hook->read_mapping(), file);
  document.check_all_keys_read();
  const auto& lamps = config.lamps.lamps;
  if (std::none_of(lamps.begin(), lamps.end(), [](const Lamp& l) { return l.frequency_hz; })) {
    throw InputError(
        file, "no lamp of the map has a frequency_hz, which is needed to identify lamps; add it");
  }
  config.inputs = files.file_names();
  config.sha256 = files.compute_sha256();
  return config;
}

}  // namespace vlp
