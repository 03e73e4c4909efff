// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include <yaml-cpp/eventhandler.h>

#include "rig/file.h"
#include "rig/yaml_text.h"

namespace vlp {

namespace {

/// Looks through a file before anything is built of it. Aliases are refused because a few lines
/// of them can stand for gigabytes, depth because yaml-cpp recurses.
class Inspection : public YAML::EventHandler {
 public:
  explicit Inspection(const std::filesystem::path& file) : file_(file) {}

  bool found_document() const { return found_document_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (found_document_) refuse(mark, "a second YAML document begins; the file should hold one");
    found_document_ = true;
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "an alias (*) is not read here: write out what it stands for");
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    go_deeper(mark);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    go_deeper(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapEnd() override { --depth_; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}

 private:
  void go_deeper(const YAML::Mark& mark) {
    constexpr int deepest = 20;
    if (++depth_ > deepest) refuse(mark, "is nested too deep: is it the right file?");
  }
  [[noreturn]] void refuse(const YAML::Mark& mark, const std::string& problem) const {
    throw InputError(file_, line_of(mark), "", problem);
  }
  const std::filesystem::path& file_;
  bool found_document_ = false;
  int depth_ = 0;
};

}  // namespace

YAML::Node parse_yaml(const std::filesystem::path& file, const std::string& text) {
  const std::size_t valid = utf8_length(text);
  if (valid < text.size()) {
    const auto line = std::count(text.begin(), text.begin() + std::ptrdiff_t(valid), '\n') + 1;
    throw InputError(file, std::size_t(line), "", "is not UTF-8 text: save it in that encoding");
  }
  try {
    Inspection inspection(file);
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(inspection)) {
    }
    if (!inspection.found_document()) throw InputError(file, "holds no YAML document");
    return YAML::Load(text);
  } catch (const YAML::Exception& failure) {
    const bool tabs = text.find('\t') != std::string::npos;
    throw InputError(file, line_of(failure.mark), "",
                     "is not valid YAML: " + failure.msg +
                         (tabs ? " (there are tabs: YAML is indented with spaces)" : ""));
  }
}

YamlMap::YamlMap(const YAML::Node& node, const std::filesystem::path* file, std::string key)
    : file_(file), prefix_(std::move(key)), line_(line_of(node.Mark())) {
  std::set<std::string> seen;
  for (const auto& pair : node) {
    const std::size_t line = line_of(pair.first.Mark());
    if (!pair.first.IsScalar()) throw error(line, "a key should be a word");
    const std::string& name = pair.first.Scalar();
    if (!seen.insert(name).second) throw error(line, "key " + in_quotes(name) + " stands twice");
    entries_.push_back({name, line, pair.second});
  }
}

std::optional<YamlValue> YamlMap::optional(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  for (const Entry& entry : entries_) {
    if (entry.key != key) continue;
    // yaml-cpp takes the place of what comes next for the place of nothing.
    const std::size_t line = entry.value.IsNull() ? entry.line : line_of(entry.value.Mark());
    return YamlValue(entry.value, file_, prefix_.empty() ? key : prefix_ + "." + key, line);
  }
  return std::nullopt;
}

bool YamlMap::has(const std::string& key) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.key == key; });
}

YamlValue YamlMap::required(const std::string& key) {
  if (auto value = optional(key)) return *value;
  std::string names;
  for (const Entry& entry : entries_) names += (names.empty() ? "" : ", ") + entry.key;
  throw error(line_, "key '" + key + "' is missing; there are: " + shortened(names, 150));
}

void YamlMap::finish() const {
  for (const Entry& entry : entries_) {
    if (std::find(known_.begin(), known_.end(), entry.key) != known_.end()) continue;
    std::string names;
    for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
    throw error(entry.line,
                "key " + in_quotes(entry.key) + " is unknown here; the keys are: " + names);
  }
}

InputError YamlMap::error(const std::string& problem) const { return error(line_, problem); }

InputError YamlMap::error(std::size_t line, const std::string& problem) const {
  return {*file_, line, prefix_, problem};
}

YamlMap read_yaml(const std::filesystem::path& file) {
  const YAML::Node node = parse_yaml(file, read_text_file(file, kMaxYamlBytes));
  return YamlValue(node, &file, "", line_of(node.Mark())).map();
}

YamlMap read_yaml(const std::filesystem::path& file, const std::string& format) {
  YamlMap map = read_yaml(file);
  require_format(map, format);
  return map;
}

void require_format(YamlMap& map, const std::string& format) {
  const auto found = map.optional("format");
  if (!found) {
    throw map.error("key 'format' is missing: the file should begin with 'format: " + format + "'");
  }
  if (found->text() != format) {
    throw found->error("should be '" + format + "', not " + in_quotes(found->text()) +
                       ": is it the right file?");
  }
}

namespace {

template <typename Number>
std::optional<Number> parsed(const YAML::Node& node) {
  if (!node.IsScalar()) return std::nullopt;
  const std::string& text = node.Scalar();
  const char* begin = text.data() + (text.starts_with('+') && !text.starts_with("+-") ? 1 : 0);
  Number value{};
  const auto [end, failure] = std::from_chars(begin, text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

YamlValue::YamlValue(const YAML::Node& node, const std::filesystem::path* file, std::string key,
                     std::size_t line)
    : node_(node), file_(file), key_(std::move(key)), line_(line) {}

double YamlValue::number() const {
  const auto value = parsed<double>(node_);
  if (!value || !std::isfinite(*value)) {
    throw error("should be a finite number, not " + quote(node_));
  }
  return *value;
}

double YamlValue::number_within(double min, double max, std::string_view unit) const {
  const double value = number();
  if (value < min || value > max) {
    throw error(shortest(value) + " " + std::string(unit) + " is not within " + shortest(min) +
                " and " + shortest(max) + " " + std::string(unit) + ": is it in the right unit?");
  }
  return value;
}

int YamlValue::integer_within(int min, int max) const {
  const auto value = parsed<int>(node_);
  if (!value || *value < min || *value > max) {
    throw error("should be a whole number within " + std::to_string(min) + " and " +
                std::to_string(max) + ", not " + quote(node_));
  }
  return *value;
}

bool YamlValue::boolean() const {
  if (node_.IsScalar() && node_.Scalar() == "true") return true;
  if (node_.IsScalar() && node_.Scalar() == "false") return false;
  throw error("should be true or false, not " + quote(node_));
}

std::string YamlValue::text() const {
  if (!node_.IsScalar()) throw error("should be text, not " + quote(node_));
  return node_.Scalar();
}

std::vector<double> YamlValue::numbers(std::size_t count) const {
  std::vector<double> values;
  for (const YamlValue& item : list()) values.push_back(item.number());
  if (values.size() != count) {
    throw error("should be " + std::to_string(count) + " numbers, not " +
                std::to_string(values.size()));
  }
  return values;
}

std::vector<YamlValue> YamlValue::list() const {
  if (!node_.IsSequence()) throw error("should be a list, not " + quote(node_));
  std::vector<YamlValue> items;
  for (const auto& item : node_) {
    items.emplace_back(item, file_, key_ + "[" + std::to_string(items.size()) + "]",
                       line_of(item.Mark()));
  }
  return items;
}

YamlMap YamlValue::map() const {
  if (!node_.IsMap()) throw error("should be a mapping of keys to values, not " + quote(node_));
  return {node_, file_, key_};
}

InputError YamlValue::error(const std::string& problem) const {
  return {*file_, line_, key_, problem};
}

InputError YamlValue::unknown(const std::string& known) const {
  return error(quote(node_) + " is unknown; " + known);
}

}  // namespace vlp
