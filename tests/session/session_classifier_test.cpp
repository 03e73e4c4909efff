// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// run_session(): sessions whose lamps are identified by a classifier.
#include <gmock/gmock.h>

#include <stdexcept>

#include "captures/detections_table.h"
#include "lamps/signal/lamp_classifier.h"
#include "rendered_session.h"
#include "session/session.h"
#include "session/train_step.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Session with classifier.yaml, without row time, and without frequencies in lamps.yaml.
class RunSessionWithClassifier : public RenderedSession {
 protected:
  void SetUp() override {
    write_camera(std::nullopt);
    const LampMap lamps = read_lamp_map(session_file("lamps.yaml"));
    FrontendOptions frontend;
    frontend.readout = Readout::rows;
    const fs::path rotation = session_file("rotation");
    const DetectedLights seen = detect_in_folders({rotation}, lamps, {}, false, frontend);
    const auto labels = read_detections(rotation / "true_detections.csv");
    const TrainStepResult trained = run_train_step(seen, {labels}, lamps, rotation);
    ASSERT_TRUE(trained.has_succeeded()) << trained.message;
    write_classifier(session_file("classifier.yaml"), trained.classifier);
    std::string map = TemporaryFolder::read_content(session_file("lamps.yaml"));
    for (auto at = map.find(", frequency_hz"); at != std::string::npos;
         at = map.find(", frequency_hz")) {
      map.erase(at, map.find(", duty", at) - at);
    }
    write_session_file("lamps.yaml", map);
  }
};

TEST_F(RunSessionWithClassifier, RequiresNeitherRowTimeNorFrequencies) {
  options.report = true;
  const SessionResult result = run();
  EXPECT_EQ(result.verdict, Verdict::pass) << result.reason;
  EXPECT_THAT(list_steps(result),
              ElementsAre("lens", "rotation", "dispersion", "check", "line-x", "evaluate"));
  EXPECT_FALSE(find_metric_value(find_step(result, "rotation").result.metrics, "row_time_us"));
  ASSERT_TRUE(result.calibration && result.calibration->dispersion);
  EXPECT_FALSE(result.calibration->camera.row_time_s);
  std::vector<std::string> inputs;
  for (const auto& input : result.calibration->history.front().inputs) inputs.push_back(input.file);
  EXPECT_THAT(inputs, ElementsAre("rotation", "lamps.yaml", "camera.yaml", "classifier.yaml"));
  const auto mean_mm = find_metric_value(find_step(result, "evaluate").result.metrics, "mean_mm");
  ASSERT_TRUE(mean_mm);
  EXPECT_LT(*mean_mm, 0.2);
}

TEST_F(RunSessionWithClassifier, RunsStepsWithLampsAgainIfClassifierChanges) {
  run();
  write_session_file("classifier.yaml",
                     TemporaryFolder::read_content(session_file("classifier.yaml")) + "# again\n");
  EXPECT_THAT(list_executed_steps(run()),
              ElementsAre("rotation", "dispersion", "check", "evaluate"));
}

}  // namespace
}  // namespace vlp
