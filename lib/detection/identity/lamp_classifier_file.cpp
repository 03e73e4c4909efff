// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <string>

#include "detection/identity/lamp_classifier.h"
#include "geometry/symmetric.h"
#include "rig/file.h"
#include "rig/yaml_reader.h"
#include "rig/yaml_writer.h"

namespace vlp {
namespace {

constexpr const char* kFormat = "vlp-classifier/1";

LampFeatures read_features(const YamlValue& value) {
  return LampFeatures(value.numbers(kLampFeatures.size()).data());
}

void check_features(const YamlValue& value) {
  const auto names = value.list();
  std::string known;
  for (const std::string_view name : kLampFeatures) {
    known.append(known.empty() ? "" : ", ").append(name);
  }
  bool same = names.size() == kLampFeatures.size();
  for (std::size_t i = 0; same && i < names.size(); ++i) same = names[i].text() == kLampFeatures[i];
  if (!same) throw value.error("should be [" + known + "]: train the classifier again");
}

Eigen::Matrix4d read_covariance(const YamlValue& value) {
  const auto rows = value.list();
  if (rows.size() != kLampFeatures.size()) throw value.error("should be four rows of four numbers");
  Eigen::Matrix4d covariance;
  for (int row = 0; row < 4; ++row) {
    covariance.row(row) = read_features(rows[static_cast<std::size_t>(row)]).transpose();
  }
  if (covariance != covariance.transpose() || !inverse_of_positive(covariance)) {
    throw value.error("is not a covariance: it should be symmetric and positive");
  }
  return covariance;
}

LampClassifier::Class read_class(YamlMap map) {
  constexpr int largest = std::numeric_limits<int>::max();
  LampClassifier::Class lamp;
  lamp.lamp = map.required("id").integer_within(0, largest);
  lamp.examples = map.required("examples").integer_within(1, largest);
  lamp.center = read_features(map.required("center"));
  map.finish();
  return lamp;
}

}  // namespace

LampClassifier read_lamp_classifier(const std::filesystem::path& file) {
  YamlMap document = read_yaml(file, kFormat);
  LampClassifier classifier;
  if (const auto value = document.optional("row_time_s")) {
    classifier.row_time_s = value->number_within(1e-8, 1e-3, "s");
  }
  check_features(document.required("features"));
  classifier.mean = read_features(document.required("mean"));
  const YamlValue scale = document.required("scale");
  classifier.scale = read_features(scale);
  if (!(classifier.scale.minCoeff() > 0)) throw scale.error("should be positive");
  const auto lamps = document.required("lamps");
  classifier.covariance = read_covariance(document.required("covariance"));
  document.finish();
  for (const YamlValue& item : lamps.list()) {
    const auto lamp = read_class(item.map());
    for (const auto& other : classifier.lamps) {
      if (other.lamp == lamp.lamp) {
        throw item.error("id " + std::to_string(lamp.lamp) + " stands twice");
      }
    }
    classifier.lamps.push_back(lamp);
  }
  if (classifier.lamps.empty()) throw lamps.error("holds no lamp");
  return classifier;
}

void write_lamp_classifier(const std::filesystem::path& file, const LampClassifier& classifier) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  emit_word(out, "format", kFormat);
  if (classifier.row_time_s) emit_number(out, "row_time_s", *classifier.row_time_s);
  out << YAML::Key << "features" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string_view name : kLampFeatures) out << std::string(name);
  out << YAML::EndSeq;
  emit_numbers(out, "mean", classifier.mean);
  emit_numbers(out, "scale", classifier.scale);
  out << YAML::Key << "lamps" << YAML::Value << YAML::BeginSeq;
  for (const auto& lamp : classifier.lamps) {
    out << YAML::Flow << YAML::BeginMap;
    emit_integer(out, "id", lamp.lamp);
    emit_integer(out, "examples", lamp.examples);
    emit_numbers(out, "center", lamp.center);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
  // Last: a file cut short lacks it.
  out << YAML::Key << "covariance" << YAML::Value << YAML::BeginSeq;
  for (int row = 0; row < 4; ++row) {
    const LampFeatures values = classifier.covariance.row(row).transpose();
    emit_row(out, {values.data(), 4});
  }
  out << YAML::EndSeq << YAML::EndMap << YAML::Newline;
  write_file(file, out.c_str());
}

}  // namespace vlp
