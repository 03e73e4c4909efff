// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Unit and run_session(): both calibrate the same images alike and name the same causes.
#include <gmock/gmock.h>

#include "frontend/image_file.h"
#include "rig/yaml_documents.h"
#include "session/session.h"
#include "simulation/simulate.h"
#include "station/unit/unit.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

const fs::path kData = VLP_SOURCE_DIR "/datasets/station";

/// Images of a unit of datasets/station with fewer captures; content of a session, too.
class UnitAndSession : public testing::Test {
 protected:
  UnitAndSession() {
    render("session", {"520, 520.6, 402.3, 297.4", "520, 520.6, 402.3, 297.4"}, {});
    for (const char* file : {"board.yaml", "lamps.yaml"})
      fs::copy_file(kData / file, session / file, fs::copy_options::overwrite_existing);
  }

  /// Renders folders of the scene, all if empty, with another text in place of `change.first`.
  void render(const char* output, const std::pair<std::string, std::string>& change,
              const std::vector<std::string>& folders) const {
    std::string scene = TemporaryFolder::read_content(kData / "scene.yaml");
    for (const auto& [from, to] : {change,
                                   std::pair<std::string, std::string>{"count: 36", "count: 12"},
                                   {"count: 12, jitter", "count: 6, jitter"},
                                   {"count: 40", "count: 12"},
                                   {"columns: 3, rows: 3", "columns: 2, rows: 2"}}) {
      const auto at = scene.find(from);
      ASSERT_NE(at, std::string::npos) << from;
      scene.replace(at, from.size(), to);
    }
    SimulationOptions options;
    options.folders = folders;
    render_scene(read_scene_file(folder.file("scene.yaml", scene)), folder / output, options, {});
  }

  Unit& process_unit() {
    unit.emplace(config, "0001", ProgramVersion{"test", "1"}, 1);
    for (const StationStep step : kStationSteps)
      unit->add_step_images(step, list_images(session / station_step_name(step)));
    unit->solve_completed(true);
    return *unit;
  }
  SessionResult process_session() const {
    SessionOptions options;
    options.program = {"test", "1"};
    options.camera_id = "0001";
    options.lens_model = config.nominal_camera.lens_model;
    options.frontend.row_time_s = config.nominal_camera.row_time_s;
    options.frontend.readout = config.nominal_camera.readout;
    options.report = false;
    return run_session(session, folder / "results", options);
  }

  TemporaryFolder folder;
  fs::path session = folder / "session";
  StationConfig config = read_station_config(kData / "station.yaml");
  std::optional<Unit> unit;
};

/// Omits the joint covariance, too: a session reads that of the step before from a file, and the
/// results differ by rounding.
std::string format_without_history(Calibration calibration) {
  calibration.history.clear();
  calibration.covariance.reset();
  calibration.camera.pixel_pitch_m.reset();
  return format_calibration(calibration);
}

TEST_F(UnitAndSession, GiveSameCalibration) {
  const auto of_unit = process_unit().latest_calibration(),
             of_session = process_session().calibration;
  ASSERT_TRUE(of_unit && of_unit->dispersion);
  ASSERT_TRUE(of_session && of_session->dispersion);
  EXPECT_EQ(format_without_history(*of_unit), format_without_history(*of_session));
}

TEST_F(UnitAndSession, NameSameCapturesOfOtherCamera) {
  render("other", {"520, 520.6, 402.3, 297.4", "512, 512.6, 392.3, 305.4"}, {"dispersion"});
  for (const char* image : {"dispersion/0003.png", "dispersion/0004.png"}) {
    fs::copy_file(folder / (std::string("other/") + image), session / image,
                  fs::copy_options::overwrite_existing);
  }
  const auto& of_unit = process_unit().step_state(StationStep::dispersion).result;
  ASSERT_TRUE(of_unit);
  EXPECT_EQ(of_unit->failure, StepFailure::undetermined);
  EXPECT_THAT(of_unit->message, HasSubstr("captures 0003.png, 0004.png do not fit"));
  const SessionResult of_session = process_session();
  const auto step = std::ranges::find(of_session.steps, "dispersion", &SessionStep::name);
  ASSERT_NE(step, of_session.steps.end());
  EXPECT_THAT(step->result.warnings, Contains(of_unit->message));
}

TEST_F(UnitAndSession, NameSameCauseOfMissingPositions) {
  fs::remove(session / "dispersion/truth.csv");
  fs::remove(session / "dispersion/captures.csv");
  const auto& of_unit = process_unit().step_state(StationStep::dispersion).result;
  ASSERT_TRUE(of_unit);
  EXPECT_EQ(of_unit->failure, StepFailure::wrong_place);
  const SessionResult of_session = process_session();
  EXPECT_EQ(of_session.failure, StepFailure::wrong_place);
  EXPECT_EQ(of_session.reason, "dispersion: " + of_unit->message);
}

}  // namespace
}  // namespace vlp
