// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "lamps/signal/lamp_features.h"

namespace vlp {

/// The light of a lamp that somebody named.
struct LabelledLight {
  int lamp;
  Stripes stripes;
  /// Number of the image that it is from.
  std::size_t image;
};

/// Tells lamps apart by a linear classifier over the features (Chen and Guan, section 2.1): linear
/// discriminant analysis. With z = (features - mean) / scale and one covariance C within
/// all lamps, the score of lamp k is linear in z,
///
///     score_k = w_k . z - w_k . c_k / 2,   w_k = C^-1 c_k,   probability_k ~ exp(score_k),
///
/// for lamps that are seen equally often.
struct LampClassifier {
  /// Of all lights that it was trained on, to standardize features.
  LampFeatures mean, scale;
  /// C, of standardized features.
  Eigen::Matrix4d covariance;
  struct Class {
    int lamp;
    /// Lights that it was trained on.
    int examples;
    /// c_k, their mean, standardized.
    LampFeatures center;
  };
  /// By id.
  std::vector<Class> lamps;
  /// Of the camera that took the lights, when it was known: periods in lines depend on it.
  std::optional<double> row_time_s;
};

/// Examples of a lamp below which nothing can be said of it.
inline constexpr int kLeastExamples = 6;

/// Trained on lights of two lamps or more, with kLeastExamples or more of each. Lights that
/// are far from their lamp's others, being partly hidden for instance, are left out. C is shrunk
/// towards its diagonal by the weight of ten lights, and lamps may drift by kLampDrift.
LampClassifier train_classifier(std::span<const LabelledLight> lights);

/// The lamp with these stripes; nothing when another may be it (probability below 99 %), or when
/// they are like no lamp's: (z - c_k)^T C^-1 (z - c_k) above 36, a share of 3e-7 of normal
/// lights, above 9 where the stripes are not trustworthy(), or when they are not readable(). The
/// stripes have a period.
std::optional<int> lamp_of(const LampClassifier& classifier, const Stripes& stripes);

/// Two lamps, and how far apart they are: root of (c_j - c_k)^T C^-1 (c_j - c_k).
struct LampDistance {
  int first, second;
  double distance;
};

/// Pairs too near for lamp_of() to tell apart: at distance 6 one light in forty is unknown.
std::vector<LampDistance> inseparable(const LampClassifier& classifier);

/// Reads `vlp-classifier/1`; keys are the names of the fields above, and `features`, which have to
/// be kLampFeatures. Throws InputError: unknown or missing keys, a lamp twice, a covariance that is
/// none.
LampClassifier read_lamp_classifier(const std::filesystem::path& file);

/// Writes what read_lamp_classifier() reads, whole or not at all. Throws InputError.
void write_lamp_classifier(const std::filesystem::path& file, const LampClassifier& classifier);

}  // namespace vlp
