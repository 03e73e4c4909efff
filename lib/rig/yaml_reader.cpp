// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include <yaml-cpp/eventhandler.h>

#include "rig/file.h"
#include "rig/yaml_text.h"

namespace vlp {

namespace {

/// Builds the tree of a file. Rejects aliases, because a few lines of them can expand to gigabytes,
/// and deep nesting, because yaml-cpp recurses.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::filesystem::path& file) : file_(file) {}

  bool has_found_document() const { return found_document_; }
  YamlNode take_root_node() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (found_document_)
      throw_not_supported(mark, "a second YAML document begins; the file should contain one");
    found_document_ = true;
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    throw_not_supported(mark, "an alias (*) is not supported: write out the value");
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    open(YamlNode::Kind::list, mark);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    open(YamlNode::Kind::map, mark);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    add({YamlNode::Kind::null, line_of_mark(mark), {}, {}});
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string& text) override {
    add({YamlNode::Kind::scalar, line_of_mark(mark), text, {}});
  }

 private:
  void open(YamlNode::Kind kind, const YAML::Mark& mark) {
    constexpr std::size_t max_depth = 20;
    open_.push_back({kind, line_of_mark(mark), {}, {}});
    if (open_.size() > max_depth)
      throw_not_supported(mark, "is nested too deep: is it the right file?");
  }
  void close() {
    YamlNode node = std::move(open_.back());
    open_.pop_back();
    add(std::move(node));
  }
  void add(YamlNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
    } else {
      open_.back().children.push_back(std::move(node));
    }
  }
  [[noreturn]] void throw_not_supported(const YAML::Mark& mark, const std::string& problem) const {
    throw InputError(file_, line_of_mark(mark), "", problem);
  }
  const std::filesystem::path& file_;
  bool found_document_ = false;
  YamlNode root_;
  std::vector<YamlNode> open_;
};

YamlNode build_tree(const std::filesystem::path& file, const std::string& text) {
  const std::size_t valid = count_utf8_prefix(text);
  if (valid < text.size()) {
    const auto line = std::count(text.begin(), text.begin() + std::ptrdiff_t(valid), '\n') + 1;
    throw InputError(file, std::size_t(line), "", "is not UTF-8 text: save it in that encoding");
  }
  try {
    TreeBuilder tree(file);
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(tree)) {
    }
    if (!tree.has_found_document()) throw InputError(file, "contains no YAML document");
    return tree.take_root_node();
  } catch (const YAML::Exception& failure) {
    const bool tabs = text.find('\t') != std::string::npos;
    throw InputError(file, line_of_mark(failure.mark), "",
                     "is not valid YAML: " + failure.msg +
                         (tabs ? " (there are tabs: YAML is indented with spaces)" : ""));
  }
}

/// Describes a value for a message: 'text', a list, a mapping, nothing.
std::string describe_value(const YamlNode& node) {
  switch (node.kind) {
    case YamlNode::Kind::scalar:
      return quote_for_message(node.text);
    case YamlNode::Kind::list:
      return "a list";
    case YamlNode::Kind::map:
      return "a mapping";
    case YamlNode::Kind::null:
      break;
  }
  return "nothing";
}

}  // namespace

YAML::Node parse_yaml_text(const std::filesystem::path& file, const std::string& text) {
  build_tree(file, text);  // refuses what yaml-cpp must not build
  return YAML::Load(text);
}

YamlMap::YamlMap(const YamlPart& node, const std::filesystem::path* file, std::string key)
    : file_(file), prefix_(std::move(key)), line_(node->line) {
  std::set<std::string_view> seen;
  entries_.reserve(node->children.size() / 2);
  for (std::size_t i = 0; i + 1 < node->children.size(); i += 2) {
    const YamlNode &name = node->children[i], &value = node->children[i + 1];
    if (name.kind != YamlNode::Kind::scalar) throw make_error(name.line, "a key should be a word");
    if (!seen.insert(name.text).second) {
      throw make_error(name.line, "key " + quote_for_message(name.text) + " occurs twice");
    }
    entries_.push_back({name.text, name.line, YamlPart(node, &value)});
  }
}

std::optional<YamlValue> YamlMap::find(const std::string& key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.push_back(key);
  for (const Entry& entry : entries_) {
    if (entry.key != key) continue;
    // yaml-cpp gives an empty value the position of the next node.
    const bool is_null = entry.value->kind == YamlNode::Kind::null;
    const std::size_t line = is_null ? entry.line : entry.value->line;
    return YamlValue(entry.value, file_, prefix_.empty() ? key : prefix_ + "." + key, line);
  }
  return std::nullopt;
}

bool YamlMap::has(const std::string& key) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.key == key; });
}

YamlValue YamlMap::require(const std::string& key) {
  if (auto value = find(key)) return *value;
  std::string names;
  for (const Entry& entry : entries_) names += (names.empty() ? "" : ", ") + entry.key;
  throw make_error(line_,
                   "key '" + key + "' is missing; the keys are: " + truncate_text(names, 150));
}

void YamlMap::check_all_keys_read() const {
  for (const Entry& entry : entries_) {
    if (std::find(known_.begin(), known_.end(), entry.key) != known_.end()) continue;
    std::string names;
    for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
    throw make_error(entry.line,
                     "key " + quote_for_message(entry.key) + " is unknown; the keys are: " + names);
  }
}

void YamlMap::check(bool is_valid, std::string_view problem) const {
  if (!is_valid) throw make_error(std::string(problem));
}

InputError YamlMap::make_error(const std::string& problem) const {
  return make_error(line_, problem);
}

InputError YamlMap::make_error(std::size_t line, const std::string& problem) const {
  return {*file_, line, prefix_, problem};
}

YamlMap read_yaml_file(const std::filesystem::path& file) {
  const auto node =
      std::make_shared<YamlNode>(build_tree(file, read_text_file(file, kMaxYamlBytes)));
  return YamlValue(node, &file, "", node->line).read_mapping();
}

YamlMap read_yaml_file(const std::filesystem::path& file, const std::string& format) {
  YamlMap map = read_yaml_file(file);
  check_yaml_format(map, format);
  return map;
}

void check_yaml_format(YamlMap& map, const std::string& format) {
  const auto found = map.find("format");
  if (!found) {
    throw map.make_error("key 'format' is missing: the file should begin with 'format: " + format +
                         "'");
  }
  if (found->read_text() != format) {
    throw found->make_error("should be '" + format + "', not " +
                            quote_for_message(found->read_text()) + ": is it the right file?");
  }
}

namespace {

template <typename Number>
std::optional<Number> parse_number(const YamlNode& node) {
  if (node.kind != YamlNode::Kind::scalar) return std::nullopt;
  const std::string& text = node.text;
  const char* begin = text.data() + (text.starts_with('+') && !text.starts_with("+-") ? 1 : 0);
  Number value{};
  const auto [end, failure] = std::from_chars(begin, text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

YamlValue::YamlValue(YamlPart node, const std::filesystem::path* file, std::string key,
                     std::size_t line)
    : node_(std::move(node)), file_(file), key_(std::move(key)), line_(line) {}

double YamlValue::read_number() const {
  const auto value = parse_number<double>(*node_);
  if (!value || !std::isfinite(*value)) {
    throw make_error("should be a finite number, not " + describe_value(*node_));
  }
  return *value;
}

double YamlValue::read_number(const Range& range) const {
  const double value = read_number();
  if (value < range.min || value > range.max) {
    const std::string unit(range.unit);
    // [FILE-3] `is it in the right unit?` | mm, us or degrees in place of m, s or rad; national
    //   coordinates | convert
    throw make_error(format_exact_number(value) + " " + unit + " is not within " +
                     format_exact_number(range.min) + " and " + format_exact_number(range.max) +
                     " " + unit + ": is it in the right unit?");
  }
  return value;
}

int YamlValue::read_integer(const Range& range) const {
  const auto value = parse_number<int>(*node_);
  if (!value || *value < range.min || *value > range.max) {
    throw make_error(
        "should be a whole number within " + std::to_string(static_cast<int>(range.min)) + " and " +
        std::to_string(static_cast<int>(range.max)) + ", not " + describe_value(*node_));
  }
  return *value;
}

bool YamlValue::read_boolean() const {
  if (node_->kind == YamlNode::Kind::scalar && node_->text == "true") return true;
  if (node_->kind == YamlNode::Kind::scalar && node_->text == "false") return false;
  throw make_error("should be true or false, not " + describe_value(*node_));
}

std::string YamlValue::read_text() const {
  if (node_->kind != YamlNode::Kind::scalar)
    throw make_error("should be text, not " + describe_value(*node_));
  return node_->text;
}

std::size_t YamlValue::read_word(const Words& words) const {
  const std::string text = read_text();
  std::string known(words.introduction);
  for (std::size_t i = 0; i < words.names.size(); ++i) {
    if (text == words.names[i]) return i;
    known.append(i == 0 ? "" : words.separator).append(words.names[i]);
  }
  throw make_word_error(known);
}

std::vector<double> YamlValue::read_numbers(std::size_t count) const {
  std::vector<double> values;
  for (const YamlValue& item : read_list()) values.push_back(item.read_number());
  if (values.size() != count) {
    throw make_error("should be " + std::to_string(count) + " numbers, not " +
                     std::to_string(values.size()));
  }
  return values;
}

std::vector<YamlValue> YamlValue::read_list() const {
  if (node_->kind != YamlNode::Kind::list)
    throw make_error("should be a list, not " + describe_value(*node_));
  std::vector<YamlValue> items;
  items.reserve(node_->children.size());
  for (const YamlNode& item : node_->children) {
    items.emplace_back(YamlPart(node_, &item), file_,
                       key_ + "[" + std::to_string(items.size()) + "]", item.line);
  }
  return items;
}

YamlMap YamlValue::read_mapping() const {
  if (node_->kind != YamlNode::Kind::map) {
    throw make_error("should be a mapping of keys to values, not " + describe_value(*node_));
  }
  return {node_, file_, key_};
}

InputError YamlValue::make_error(const std::string& problem) const {
  return {*file_, line_, key_, problem};
}

InputError YamlValue::make_word_error(const std::string& known) const {
  return make_error(describe_value(*node_) + " is unknown; " + known);
}

void YamlField::check(bool is_valid, std::string_view problem) const {
  if (value_ && !is_valid) throw value_->make_error(std::string(problem));
}

void YamlField::check_range(const Range& range) const {
  if (value_) value_->read_number(range);
}

YamlField YamlField::item(std::size_t index) const {
  return value_ ? YamlField(value_->read_list().at(index)) : *this;
}

}  // namespace vlp
