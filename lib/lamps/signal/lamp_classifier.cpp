// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/lamp_classifier.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>

#include <Eigen/Cholesky>

#include "geometry/symmetric.h"
#include "lamps/signal/frequency_identification.h"
#include "rig/file.h"
#include "rig/yaml_reader.h"
#include "rig/yaml_writer.h"

namespace vlp {

namespace {

double compute_distance_squared(const Eigen::Matrix4d& covariance, const LampFeatures& difference) {
  return difference.dot(covariance.llt().solve(difference));
}

LampFeatures standardize_features(const LampClassifier& classifier, const LampFeatures& features) {
  return (features - classifier.mean).cwiseQuotient(classifier.scale);
}

void standardize_classes(std::span<const LabeledLight> lights, LampClassifier& classifier) {
  classifier.mean.setZero();
  classifier.scale.setZero();
  const auto n = static_cast<double>(lights.size());
  for (const LabeledLight& light : lights) classifier.mean += make_lamp_features(light.stripes) / n;
  for (const LabeledLight& light : lights) {
    classifier.scale += (make_lamp_features(light.stripes) - classifier.mean).cwiseAbs2() / n;
  }
  constexpr double minimum = 1e-6;  // for a constant feature
  classifier.scale = classifier.scale.cwiseSqrt().cwiseMax(minimum);
}

/// Fits centers and covariance to the lights that are `used`.
void fit(std::span<const LabeledLight> lights, const std::vector<bool>& used,
         LampClassifier& classifier) {
  std::map<int, LampClassifier::Class> lamps;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const LampClassifier::Class none{lights[i].lamp, 0, LampFeatures::Zero()};
    auto& lamp = lamps.try_emplace(lights[i].lamp, none).first->second;
    if (!used[i]) continue;
    ++lamp.examples;
    lamp.center += standardize_features(classifier, make_lamp_features(lights[i].stripes));
  }
  for (auto& [id, lamp] : lamps) lamp.center /= std::max(1, lamp.examples);
  classifier.covariance.setZero();
  double count = 0;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!used[i]) continue;
    const LampFeatures off =
        standardize_features(classifier, make_lamp_features(lights[i].stripes)) -
        lamps.at(lights[i].lamp).center;
    classifier.covariance += off * off.transpose();
    ++count;
  }
  const double freedom = std::max(1.0, count - static_cast<double>(lamps.size()));
  classifier.covariance /= freedom;
  constexpr double shrinkage = 10;  // equivalent number of lights
  const Eigen::Vector4d diagonal = classifier.covariance.diagonal();
  classifier.covariance *= freedom / (freedom + shrinkage);
  const LampFeatures minimum(kLampDrift / 3, kDutyMargin / 2, 0.01, kDutyMargin / 2);
  classifier.covariance.diagonal() = diagonal + minimum.cwiseQuotient(classifier.scale).cwiseAbs2();
  classifier.lamps.clear();
  for (const auto& [id, lamp] : lamps) classifier.lamps.push_back(lamp);
}

}  // namespace

LampFeatures make_lamp_features(const Stripes& stripes) {
  assert(stripes.period_lines > 0);
  return {std::log(stripes.period_lines), stripes.duty, stripes.count_per_line, stripes.lit_area};
}

LampClassifier fit_classifier(std::span<const LabeledLight> lights) {
  LampClassifier classifier;
  standardize_classes(lights, classifier);
  std::vector<bool> used(lights.size(), true);
  constexpr int passes = 8;
  for (int pass = 0; pass < passes; ++pass) {
    fit(lights, used, classifier);
    std::map<int, LampFeatures> centers;
    for (const auto& lamp : classifier.lamps) centers[lamp.lamp] = lamp.center;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const LampFeatures off =
          standardize_features(classifier, make_lamp_features(lights[i].stripes)) -
          centers.at(lights[i].lamp);
      constexpr double trimmed = 9;  // stricter than in use: outliers widen the covariance
      used[i] = compute_distance_squared(classifier.covariance, off) < trimmed;
    }
  }
  return classifier;
}

std::optional<int> identify_by_classifier(const LampClassifier& classifier,
                                          const Stripes& stripes) {
  constexpr double min_probability = 0.99, farthest = 6, farthest_unclear = 3;
  const LampFeatures z = standardize_features(classifier, make_lamp_features(stripes));
  const Eigen::LLT<Eigen::Matrix4d> factor(classifier.covariance);
  if (!are_stripes_readable(stripes)) return std::nullopt;
  double nearest = std::pow(are_stripes_reliable(stripes) ? farthest : farthest_unclear, 2);
  const LampClassifier::Class* lamp = nullptr;
  std::vector<double> distances;
  distances.reserve(classifier.lamps.size());
  for (const auto& candidate : classifier.lamps) {
    const LampFeatures off = z - candidate.center;
    distances.push_back(off.dot(factor.solve(off)));
    if (distances.back() < nearest) nearest = distances.back(), lamp = &candidate;
  }
  // Scores differ by half the difference of the squared distances.
  double sum = 0;
  for (const double distance : distances) sum += std::exp((nearest - distance) / 2);
  if (lamp == nullptr || 1 / sum < min_probability) return std::nullopt;
  return lamp->lamp;
}

std::vector<LampDistance> list_inseparable_lamps(const LampClassifier& classifier) {
  constexpr double minimum = 6;
  std::vector<LampDistance> pairs;
  for (std::size_t i = 0; i < classifier.lamps.size(); ++i) {
    for (std::size_t j = i + 1; j < classifier.lamps.size(); ++j) {
      const auto &a = classifier.lamps[i], &b = classifier.lamps[j];
      const double distance =
          std::sqrt(compute_distance_squared(classifier.covariance, a.center - b.center));
      if (distance < minimum) pairs.push_back({a.lamp, b.lamp, distance});
    }
  }
  return pairs;
}

ConfusionMatrix cross_validate(std::span<const LabeledLight> lights, const TrainClassifier& train) {
  std::set<int> lamps;
  for (const LabeledLight& light : lights) lamps.insert(light.lamp);
  const auto unknown = static_cast<Eigen::Index>(lamps.size());
  ConfusionMatrix confusion{{lamps.begin(), lamps.end()},
                            Eigen::MatrixXi::Zero(unknown, unknown + 1)};
  const auto index_of = [&](int lamp) -> Eigen::Index {
    const auto place = std::ranges::find(confusion.lamps, lamp);
    return place - confusion.lamps.begin();
  };
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<LabeledLight> others, held_out;
    for (const LabeledLight& light : lights) {
      (light.image % kFolds == std::size_t(fold) ? held_out : others).push_back(light);
    }
    const LampClassifier classifier = train(others);
    for (const LabeledLight& light : held_out) {
      const auto answer = identify_by_classifier(classifier, light.stripes);
      ++confusion.counts(index_of(light.lamp), answer ? index_of(*answer) : unknown);
    }
  }
  return confusion;
}

namespace {

constexpr const char* kFormat = "vlp-classifier/1";

}  // namespace

static void read_value(const YamlValue& value, Eigen::Matrix4d& covariance) {
  std::vector<LampFeatures> rows;
  read_value(value, rows);
  if (rows.size() != kLampFeatures.size())
    throw value.make_error("should be four rows of four numbers");
  for (Eigen::Index row = 0; row < 4; ++row)
    covariance.row(row) = rows[static_cast<std::size_t>(row)].transpose();
  if (covariance != covariance.transpose() || !invert_positive_definite(covariance))
    throw value.make_error("is not a covariance: it should be symmetric and positive");
}

static void write_value(YamlWriter& out, const Eigen::Matrix4d& covariance) {
  out << YAML::BeginSeq;
  for (int row = 0; row < 4; ++row) write_list(out, LampFeatures(covariance.row(row).transpose()));
  out << YAML::EndSeq;
}

template <typename Io>
static void describe(Io& io, Described<Io, LampClassifier::Class> lamp) {
  io.required("id", lamp.lamp);
  io.required("examples", lamp.examples, Range{1, std::numeric_limits<int>::max()});
  io.required("center", lamp.center);
}

template <typename Io>
static void describe(Io& io, Described<Io, LampClassifier> classifier) {
  io.optional("row_time_s", classifier.row_time_s, Range{1e-8, 1e-3, "s"});
  std::vector<std::string> names(kLampFeatures.begin(), kLampFeatures.end());
  std::string known;
  for (const std::string& name : names) known.append(known.empty() ? "" : ", ").append(name);
  io.required("features", names, PlainText())
      .check(std::ranges::equal(names, kLampFeatures),
             "should be [" + known + "]: train the classifier again");
  io.required("mean", classifier.mean);
  io.required("scale", classifier.scale)
      .check(classifier.scale.minCoeff() > 0, "should be positive");
  const auto lamps = io.required("lamps", classifier.lamps);
  // Written last, so that a truncated file lacks it.
  io.required("covariance", classifier.covariance);
  lamps.check(!classifier.lamps.empty(), "contains no lamp");
  std::set<int> ids;
  for (std::size_t i = 0; Io::is_reader && i < classifier.lamps.size(); ++i) {
    const int id = classifier.lamps[i].lamp;
    if (!ids.insert(id).second)
      lamps.item(i).check(false, "id " + std::to_string(id) + " occurs twice");
  }
}

LampClassifier read_lamp_classifier(const std::filesystem::path& file) {
  return read_yaml_document<LampClassifier>(file, kFormat);
}

void write_classifier(const std::filesystem::path& file, const LampClassifier& classifier) {
  write_file(file, format_document(kFormat, classifier));
}

}  // namespace vlp
