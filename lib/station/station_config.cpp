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
#include "rig/yaml_documents.h"
#include "rig/yaml_reader.h"
#include "rig/yaml_writer.h"
#include "station/database_name.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr Range kCount{1, 10'000}, kDays{1, 36'525}, kShare{0, 1, "(share)"};

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
std::string describe_pattern_mismatch(const std::string& serial, const std::string& pattern) {
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

/// Reader of the files that a station names. It collects the files and their digests.
struct Files {
  const fs::path& station;
  std::vector<fs::path>& names;
  std::string& digests;

  void add(const fs::path& file) const {
    digests += hash_file(file) + "\n";
    names.push_back(file);
  }
  fs::path operator()(const YamlValue& value) const {
    fs::path file;
    (*this)(value, file);
    add(file);
    return file;
  }
  /// Reads a path, relative to the station.
  void operator()(const YamlValue& value, fs::path& path) const {
    path = value.read_text();
    if (path.empty()) throw value.make_error("names nothing");
    if (path.is_relative()) path = station.parent_path() / path;
  }
  /// Reads a calibration whose camera has row time and readout.
  void operator()(const YamlValue& value, Calibration& calibration) const {
    calibration = read_calibration((*this)(value));
    if (!calibration.camera.row_time_s || !calibration.camera.readout) {
      throw value.make_error(
          "its camera should have row_time_s and readout, which are needed to identify lamps");
    }
  }
  void operator()(const YamlValue& value, Board& board) const {
    board = read_board((*this)(value));
    if (board.has_squares())
      throw value.make_error("is a board of squares: the station looks for one of AprilTags");
  }
};

/// Reads a database: a file relative to the station, or a server.
std::string read_address(const YamlValue& value, const Files& files) {
  const std::string where = value.read_text();
  if (where.starts_with("postgresql://") || where.starts_with("postgres://")) return where;
  if (is_server_address(where))
    throw value.make_error("should name a file, or be postgresql://...");
  describe_database(where);  // checks the name of a file
  fs::path file;
  files(value, file);
  return file.string();
}

/// Reads the standard uncertainties of metrics, and adds guard bands with the factor k to gates.
void read_guard_bands(YamlMap& io, std::vector<Gate>& gates, double k) {
  bool has_found = false;
  for (Gate& gate : gates) {
    double u = 0;
    const YamlField field = io.optional(gate.metric, u, Range{0, 1e6, "(in the gate's unit)"});
    if (!field) continue;
    has_found = true;
    field.check(u > 0, "should be above 0");
    gate.guard_band = GuardBand{u, k};
    const MetricKind kind = find_metric_kind(gate.metric).value();
    const double accepted =
        CheckedMetric{gate.metric, "", {}, gate.limit, kind.direction, gate.guard_band}
            .acceptance_limit();
    field.check(
        accepted >= 0 && accepted <= kind.max_limit,
        "leaves no value within the gate: k times this uncertainty exceeds the limit; lower k");
  }
  io.check_all_keys_read();  // uncertainties of metrics without a gate
  io.check(has_found, "names no gate");
}

/// Checks that a pattern is a regular expression.
void check_pattern(const std::string& pattern, const YamlField& field) {
  try {
    const std::regex compiled(pattern);
  } catch (const std::regex_error& error) {
    field.check(false, std::string("is no regular expression: ") + error.what());
  }
}

}  // namespace

template <typename Io>
static void describe(Io& io, Described<Io, CompletionCriteria> sufficient) {
  io.optional("board_views", sufficient.board_views, kCount);
  io.optional("board_coverage", sufficient.board_coverage, kShare);
  io.optional("turn_captures", sufficient.rotation_captures, kCount);
  io.optional("turn_heights", sufficient.rotation_heights, kCount);
  io.optional("turn_arc_deg", sufficient.rotation_arc_rad, DegreeRange{0, 360});
  io.optional("dispersion_captures", sufficient.dispersion_captures, kCount);
  io.optional("check_captures", sufficient.check_captures, kCount);
}

template <typename Io>
static void describe_rejection(Io& io, Described<Io, StationConfig> config) {
  auto& limits = config.frontend;
  io.optional("blur_fraction", limits.max_blur_fraction, Range{0, 0.1, "(share)"});
  io.optional("dark_fraction", limits.min_bright_fraction, kShare);
  io.optional("white_fraction", limits.max_white_fraction, kShare);
  io.optional("same_pose_fraction", limits.same_view_fraction, kShare);
  io.optional("max_consecutive_rejections", config.max_consecutive_rejections, kCount);
}

/// Describes guard bands of gates: {k: 1.645, standard_uncertainties: {METRIC: U}}. The default of
/// k is that of ISO 14253-1: at most 5 % of the units exactly at the limit are accepted.
static void describe_bands(YamlMap& io, StationConfig& config) {
  double k = 1.645;
  io.optional("k", k, Range{0, 10, "(factor)"});
  YamlMap uncertainties = io.require("standard_uncertainties").read_mapping();
  read_guard_bands(uncertainties, config.gates, k);
}

static void describe(YamlMap& io, GoldenUnit& golden, const Files& files) {
  io.required("camera_id", golden.camera_id)
      .check(Id::is_valid(golden.camera_id), "is no id of a camera: it names a folder");
  io.required("calibration", golden.calibration, files)
      .check(golden.calibration.rotation_center.has_value(),
             "should be a complete calibration: it has no rotation_center");
  golden.gates = read_gates(io.require("gates"), list_unit_metrics());
}

static void describe(YamlMap& io, VerificationInterval& due) {
  io.optional("hours", due.hours, Range{0, 10'000, "h"});
  io.optional("units", due.units, Range{1, 1'000'000});
  io.check(due.hours || due.units, "should have hours or units");
  io.check(due.hours != 0, "hours should be above 0");
}

static void describe(YamlMap& io, Retention& retention) {
  io.optional("images_days", retention.images_days, kDays);
  io.optional("results_days", retention.results_days, kDays);
}

/// Describes the command of a hook. A program with a folder in its name is relative to the station;
/// others are found by PATH.
static void describe(YamlMap& io, Hook& hook, const Files& files) {
  io.required("command", hook.command)
      .check(!hook.command.empty() && !hook.command.front().empty(),
             "should be a program and its arguments: [PROGRAM, ...]");
  hook.folder = fs::absolute(files.station).parent_path();
  std::string& program = hook.command.front();
  if (program.find('/') != std::string::npos) program = (hook.folder / program).string();
  io.optional("time_limit_s", hook.time_limit_s, Range{0, 3600, "seconds"})
      .check(hook.time_limit_s > 0, "should be above 0");
}

/// Describes the camera type and the targets that it observes: board, lamps and known position.
static void describe_targets(YamlMap& io, StationConfig& config, const Files& files) {
  Calibration type;
  io.required("camera_type", type, files);
  config.nominal_camera = type.camera;
  config.type_file = config.inputs.back().filename().string();
  io.required("board", config.board, files);
  std::string room;
  io.optional("room", room);
  config.lamps = read_overhead_lamps(files(io.require("lamps")), room);
  io.optional("dispersion_position_m", config.dispersion_position_m);
}

/// Describes the conditions of a verdict: completion, rejection of images, gates and golden unit.
static void describe_verdict(YamlMap& io, StationConfig& config, const Files& files) {
  io.optional("completion", config.completion);
  io.optional("rejection", config, describe_rejection<YamlMap>);
  config.gates = read_gates(io.require("gates"), list_unit_metrics());
  io.optional("guard_bands", config, describe_bands);
  io.optional("golden", config.golden_unit, files);
  io.optional("verify_due", config.verification_interval)
      .check(config.golden_unit.has_value(), "needs a golden unit: add the key 'golden'");
}

static void describe(YamlMap& io, StationConfig& config, const Files& files) {
  io.required("station", config.station);
  describe_targets(io, config, files);
  describe_verdict(io, config, files);
  const YamlField pattern = io.optional("serial_pattern", config.serial_pattern);
  check_pattern(config.serial_pattern, pattern);
  io.optional("void_operators", config.void_operators)
      .check(!config.void_operators.empty(), "names nobody; leave it out if all may void runs");
  io.required("captures", config.captures, files);
  io.required("results", config.results, files);
  config.records = read_address(io.require("records"), files);
  config.spool = config.file.parent_path() / "spool";
  io.optional("spool", config.spool, files);
  io.optional("retention", config.retention);
  io.optional("hook", config.hook, files);
}

static void describe(YamlWriter& io, const Gate& gate) {
  io.required("metric", gate.metric);
  io.required("limit", gate.limit);
  if (!gate.guard_band) return;
  io.required("standard_uncertainty", gate.guard_band->standard_uncertainty);
  io.required("k", gate.guard_band->k);
}

static void describe(YamlWriter& io, const GoldenUnit& golden) {
  io.required("camera_id", golden.camera_id);
  io.required("calibration", format_calibration(golden.calibration));
  io.required("gates", golden.gates);
}

std::string hash_settings(const StationConfig& config) {
  Calibration type;
  type.camera = config.nominal_camera;
  LampMap lamps = config.lamps;
  std::ranges::sort(lamps.lamps, {}, &Lamp::id);
  YAML::Emitter text;
  YamlWriter io(text);
  io.begin_map();
  io.optional("dispersion_position_m", config.dispersion_position_m);
  io.required("completion", config.completion);
  describe_rejection(io, config);
  io.required("gates", config.gates);
  io.optional("golden", config.golden_unit);
  io.end_map();
  return hash_text(format_calibration(type) + format_board(config.board) + format_lamp_map(lamps) +
                   text.c_str());
}

std::string describe_camera_id_problem(const std::string& camera_id) {
  if (std::regex_match(camera_id, std::regex("[A-Za-z0-9_-][A-Za-z0-9_.-]{0,63}"))) return "";
  return "a camera's id has letters, digits, '-', '_' and '.', up to 64, no '.' first";
}

std::string describe_serial_problem(const StationConfig& config, const std::string& serial) {
  std::string problem = describe_camera_id_problem(serial);
  if (!problem.empty() || config.serial_pattern.empty()) return problem;
  return describe_pattern_mismatch(serial, config.serial_pattern);
}

std::vector<MetricKind> list_unit_metrics() {
  return list_metric_kinds({MetricSource::station, MetricSource::lens, MetricSource::rotation,
                            MetricSource::dispersion});
}

StationConfig read_station_config(const fs::path& file) {
  YamlMap document = read_yaml_file(file, "vlp-station/1");
  StationConfig config;
  config.file = file;
  std::string digests;
  const Files files{file, config.inputs, digests};
  files.add(file);
  describe(document, config, files);
  document.check_all_keys_read();
  const auto& lamps = config.lamps.lamps;
  if (std::none_of(lamps.begin(), lamps.end(), [](const Lamp& l) { return l.frequency_hz; })) {
    throw InputError(
        file, "no lamp of the map has a frequency_hz, which is needed to identify lamps; add it");
  }
  config.sha256 = hash_text(digests);
  return config;
}

}  // namespace vlp
