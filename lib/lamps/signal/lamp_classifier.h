// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "lamps/signal/stripes.h"

namespace vlp {

/// Features of a lamp's light (Chen and Guan, section 2.1), in the order of kLampFeatures. No
/// feature depends on the distance of the lamp: at twice the distance it has half the scanlines and
/// stripes.
///
/// - log_period_lines: logarithm of the stripe period in scanlines, 1 / (frequency row_time), so
///   that its errors are relative
/// - duty: lit fraction of a period, 0 to 1
/// - count_per_line: number of stripes per scanline; stripes are counted in steps of a half, so
///   that it is coarser than 1 / period
/// - lit_area: fraction of the disc's area that is lit, 0 to 1
using LampFeatures = Eigen::Vector4d;

/// Names of the features in classifier files, in the order of LampFeatures.
inline constexpr std::array<std::string_view, 4> kLampFeatures{"log_period_lines", "duty",
                                                               "count_per_line", "lit_area"};

/// Returns the features of a light's stripes. @pre The stripes have a period.
LampFeatures make_lamp_features(const Stripes& stripes);

/// Training example: stripes of a light and the id of its lamp.
struct LabeledLight {
  int lamp;
  Stripes stripes;
  /// Index of the light's image.
  std::size_t image;
};

/// Linear classifier that identifies lamps by their features (Chen and Guan, section 2.1): linear
/// discriminant analysis. With z = (features - mean) / scale and a common covariance C within all
/// lamps, the score of lamp k is linear in z,
///
///     score_k = w_k . z - w_k . c_k / 2,   w_k = C^-1 c_k,   probability_k ~ exp(score_k),
///
/// for lamps with equal prior probabilities.
struct LampClassifier {
  /// Mean and standard deviation of the features of all training lights, which standardize
  /// features.
  LampFeatures mean, scale;
  /// Covariance C of the standardized features within a lamp, common to all lamps.
  Eigen::Matrix4d covariance;
  struct Class {
    int lamp;
    /// Number of training lights of this lamp.
    int examples;
    /// Mean c_k of the standardized features of the training lights.
    LampFeatures center;
  };
  /// Lamps, sorted by id.
  std::vector<Class> lamps;
  /// Row time of the camera that took the training images, if known. Periods in scanlines depend on
  /// it.
  std::optional<double> row_time_s;
};

/// Minimum number of training lights of a lamp.
inline constexpr int kMinExamples = 6;

/// Trains a classifier on the lights of at least two lamps, with at least kMinExamples of each.
/// Excludes lights that are far from the others of their lamp, such as partly hidden ones. Shrinks
/// C towards its diagonal with the weight of ten lights, and allows for a drift of the lamps by
/// kLampDrift.
LampClassifier fit_classifier(std::span<const LabeledLight> lights);

/// Returns the id of the lamp with these stripes. @pre The stripes have a period.
///
/// Returns std::nullopt in these cases:
/// - Another lamp is possible: the probability is below 99 %.
/// - (z - c_k)^T C^-1 (z - c_k) exceeds 36 (3e-7 of normal lights), or 9 if the stripes are not
///   are_stripes_reliable().
/// - The stripes are not are_stripes_readable().
std::optional<int> identify_by_classifier(const LampClassifier& classifier, const Stripes& stripes);

/// Two lamps and their Mahalanobis distance, the square root of (c_j - c_k)^T C^-1 (c_j - c_k).
struct LampDistance {
  int first, second;
  double distance;
};

/// Returns the pairs of lamps that identify_by_classifier() cannot separate, with a distance
/// below 6. At distance 6 one light in forty is unknown.
std::vector<LampDistance> list_inseparable_lamps(const LampClassifier& classifier);

/// Confusion matrix of a classifier for lights of known lamps.
struct ConfusionMatrix {
  /// Ids of the lamps, sorted.
  std::vector<int> lamps;
  /// Number of lights by lamp (row) and by result (column); the last column is "unknown".
  Eigen::MatrixXi counts;

  int count_correct() const { return counts.diagonal().sum(); }
  /// Returns the number of lights that are identified as another lamp.
  int count_wrong() const { return counts.sum() - count_correct() - count_unidentified(); }
  int count_unidentified() const { return counts.rightCols<1>().sum(); }
};

/// Number of folds of the cross-validation.
inline constexpr int kFolds = 5;

using TrainClassifier = std::function<LampClassifier(std::span<const LabeledLight>)>;

/// Computes the confusion matrix by cross-validation. `train` makes a classifier of all images but
/// every fifth one; this classifier is applied to the lights of the held-out images. The folds are
/// deterministic. `lights` as for fit_classifier().
ConfusionMatrix cross_validate(std::span<const LabeledLight> lights, const TrainClassifier& train);

/// Reads a file of format `vlp-classifier/1`. Its keys are the names of the fields above, and
/// `features`, which has to be kLampFeatures.
///
/// @throws InputError if a key is unknown or missing, a lamp occurs twice, or the covariance is not
///        positive definite
LampClassifier read_lamp_classifier(const std::filesystem::path& file);

/// Writes a file for read_lamp_classifier() atomically. @throws InputError if the file cannot be
/// written
void write_classifier(const std::filesystem::path& file, const LampClassifier& classifier);

}  // namespace vlp
