// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/metric.h"

#include <gmock/gmock.h>

#include <limits>
#include <set>

namespace vlp {
namespace {

TEST(ListMetricKinds, ReturnsUniqueNamesAndNonEmptyDescriptions) {
  std::set<std::string> names;
  const auto kinds =
      list_metric_kinds({MetricSource::station, MetricSource::lens, MetricSource::rotation,
                         MetricSource::dispersion, MetricSource::evaluation});
  ASSERT_FALSE(kinds.empty());
  for (const MetricKind& kind : kinds) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_STRNE(kind.cause, "");
    EXPECT_STRNE(kind.description, "");
    EXPECT_EQ(find_metric_kind(kind.name).value().name, kind.name);
    const std::string unit = kind.unit;
    if (unit == "mm" || unit == "px" || unit == "deg") {
      EXPECT_TRUE(std::string(kind.name).ends_with("_" + unit)) << kind.name;
    }
  }
  EXPECT_FALSE(find_metric_kind("mean_cm"));
}

TEST(FindMetricValue, ReturnsNulloptForMissingOrNonFiniteMetric) {
  const std::vector<Metric> metrics{{"a", 1}, {"b", std::numeric_limits<double>::quiet_NaN()}};
  EXPECT_EQ(find_metric_value(metrics, "a"), 1);
  EXPECT_FALSE(find_metric_value(metrics, "b"));
  EXPECT_FALSE(find_metric_value(metrics, "c"));
}

}  // namespace
}  // namespace vlp
