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

/// A light with the id of its lamp.
struct LabelledLight {
  int lamp;
  Stripes stripes;
  /// Number of its image.
  std::size_t image;
};

/// Identifies lamps by a linear classifier over the features (Chen and Guan, section 2.1): linear
/// discriminant analysis. With z = (features - mean) / scale and one covariance C within
/// all lamps, the score of lamp k is linear in z,
///
///     score_k = w_k . z - w_k . c_k / 2,   w_k = C^-1 c_k,   probability_k ~ exp(score_k),
///
/// for lamps that are seen equally often.
struct LampClassifier {
  /// Mean and standard deviation of the features of all training lights, to standardize features.
  LampFeatures mean, scale;
  /// C, for standardized features.
  Eigen::Matrix4d covariance;
  struct Class {
    int lamp;
    /// Number of training lights.
    int examples;
    /// c_k, their mean, standardized.
    LampFeatures center;
  };
  /// Sorted by id.
  std::vector<Class> lamps;
  /// Row time of the camera that took the training images, if known: periods in lines depend on it.
  std::optional<double> row_time_s;
};

/// Minimum number of training lights of a lamp.
inline constexpr int kMinExamples = 6;

/// Trains a classifier on lights of two lamps or more, with kMinExamples or more of each. Lights
/// that are far from the others of their lamp, such as partly hidden ones, are left out. C is
/// shrunk towards its diagonal by the weight of ten lights, and lamps may drift by kLampDrift.
LampClassifier train_classifier(std::span<const LabelledLight> lights);

/// Returns the lamp with these stripes; std::nullopt if another may be it (probability below 99 %),
/// if (z - c_k)^T C^-1 (z - c_k) exceeds 36 (3e-7 of normal lights) or, where the stripes are not
/// trustworthy(), 9, or if they are not readable(). @pre The stripes have a period.
std::optional<int> lamp_of(const LampClassifier& classifier, const Stripes& stripes);

/// Two lamps and their distance: root of (c_j - c_k)^T C^-1 (c_j - c_k).
struct LampDistance {
  int first, second;
  double distance;
};

/// Returns the pairs that lamp_of() cannot separate: at distance 6 one light in forty is unknown.
std::vector<LampDistance> inseparable(const LampClassifier& classifier);

/// Reads `vlp-classifier/1`; keys are the names of the fields above, and `features`, which have to
/// be kLampFeatures. Throws InputError: unknown or missing keys, a lamp twice, a covariance that is
/// none.
LampClassifier read_lamp_classifier(const std::filesystem::path& file);

/// Writes what read_lamp_classifier() reads, whole or not at all. Throws InputError.
void write_lamp_classifier(const std::filesystem::path& file, const LampClassifier& classifier);

}  // namespace vlp
