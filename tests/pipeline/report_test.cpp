// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/report.h"

#include <gmock/gmock.h>

#include "report/plots/calibration_plots.h"
#include "report/plots/evaluation_plots.h"
#include "support/datasets.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kCheck = VLP_SOURCE_DIR "/tests/support/browser_check.py";
constexpr int kNoBrowser = 77;

/// vlp-evaluate on the example, with all there can be in a report.
class VlpEvaluateReport : public testing::Test {
 protected:
  TemporaryFolder folder;

  std::string in(const char* name) const { return " " + (folder / name).string(); }
  std::string rig(const std::string& calibration) const {
    return " --lamps " + kExample + "lamps.yaml --calibration " + calibration;
  }
  void must(const std::string& command) {
    const auto [code, output, errors] = run_program(command);
    ASSERT_EQ(code, 0) << command << "\n" << errors;
  }
  void SetUp() override {
    const std::string leveled = (folder / "rotated.yaml").string();
    must("vlp-rotation " + kExample + "turning.csv" + rig(kExample + "calibration.yaml") + " -o " +
         leveled + " --plot" + in("rotation.svg"));
    must("vlp-dispersion " + kExample + "station.csv" + rig(leveled) +
         " --reference-point 0.1 0 -o" + in("calibration.yaml") + " --plot" + in("dispersion.svg"));
    must("vlp-locate " + kExample + "detections.csv" + rig(kExample + "calibration.yaml") + " -o" +
         in("fixes.csv"));
    write_plot(folder / "camera.svg",
               draw_intrinsics(
                   IntrinsicsPlot{"unit 7",
                                  {800, 600},
                                  {{{10, 20}, {0.1, 0.2}, false}, {{700, 500}, {-0.1, 0.1}, false}},
                                  2,
                                  {0.1, 0.2, 0.3, 0.4}}));
    folder.file("track.csv",
                "image,status,x_m,y_m,z_m,yaw_rad,x_sd_m,y_sd_m,z_sd_m,yaw_sd_rad,"
                "lamps,residual_px\n0,ok,0,0.001,0,0,,,,,3,0.1\n"
                "1,ok,0.5,0.0015,0,0,,,,,3,0.1\n2,ok,1,0.001,0,0,,,,,3,0.1\n");
  }

  ProgramResult evaluate(const std::string& more) {
    return run_program("vlp-evaluate" + in("fixes.csv") + " --truth " + kExample + "truth.csv" +
                       rig(folder / "calibration.yaml") + " --gate mean_mm=1 --report" +
                       in("report.html") + more);
  }
  std::string all() const {
    return " --picture" + in("camera.svg") + " --picture" + in("rotation.svg") + " --picture" +
           in("dispersion.svg") + " --track" + in("track.csv") + " 0 0 1 0";
  }
};

TEST_F(VlpEvaluateReport, HtmlPassesBrowserCheckAndPdfHasAllSections) {
  const auto [code, output, errors] = evaluate(all());
  ASSERT_EQ(code, 0) << errors;
  const auto check = run_program("python3 " + kCheck + in("report.html"));
  if (check.exit_code == kNoBrowser) GTEST_SKIP() << check.output;
  EXPECT_EQ(check.exit_code, 0) << check.output << check.errors;
  EXPECT_THAT(run_program("pdfinfo" + in("report.pdf")).output, HasSubstr("(A4)"));
  const std::string paper = run_program("pdftotext -layout" + in("report.pdf") + " -").output;
  for (const char* part : {"PASS", "mean_mm", "Figures", "Camera", "Rotation center", "Dispersion",
                           "Fixes on the floor", "Distribution of the errors", "Moving tracks",
                           "track.csv", "History", "vlp-evaluate", "SHA-256"}) {
    EXPECT_THAT(paper, HasSubstr(part));
  }
}

TEST_F(VlpEvaluateReport, IsByteIdenticalOnRepeatAndWrittenWhenGateFails) {
  ASSERT_EQ(evaluate(all()).exit_code, 0);
  const std::string first = TemporaryFolder::read_content(folder / "report.html");
  EXPECT_THAT(first, Not(HasSubstr((folder / "").string()))) << "paths of a machine";
  ASSERT_EQ(evaluate(all() + " --threads 1").exit_code, 0);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "report.html"), first);
  EXPECT_EQ(evaluate(" --gate p90_mm=0.001").exit_code, 1);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "report.html"),
              HasSubstr("FAIL</strong>1 of 2"));
}

/// A page that passes, small enough to be broken in many ways.
std::string good_page() {
  Report report{"unit 7", {{"mean_mm", "mm", 0.5, 1, Direction::at_most}}, {}, {}, {}, {}, {}};
  report.plots = {render_report_plot(
      draw_error_cdf(CdfPlot{"errors", {{"fixes", {0.001, 0.002}, 0.001, 0.002}}}))};
  return render_report_html(report);
}

TEST(BrowserCheckScript, ReportsEachFaultInsertedIntoHtml) {
  const struct {
    const char *name, *from, *to, *complaint;
  } faults[] = {
      {"good", "", "", ""},
      {"language", " lang=\"en\"", "", "no language"},
      {"title", "<title>unit 7</title>", "", "no title"},
      {"heading", "<h2>", "<h4>", "heading leaves out a level"},
      {"two", "<main>", "<main><h1>again</h1>", "2 headings of level 1"},
      {"scope", " scope=\"row\"", "", "a header without scope"},
      {"alt", "<img alt=\"", "<img alt=\"\" title=\"", "a picture without a text"},
      {"empty", "svg+xml;base64,", "svg+xml;base64,AAAA", "an empty picture"},
      {"blank", "src=\"data",
       "src=\"data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' "
       "width='9' height='9'/>\" title=\"",
       "a picture of nothing"},
      {"pale", "color: #1b1b1b", "color: #999", "contrast 2.8"},
      {"tiny", "font-size: .95rem", "font-size: .5rem", "text of 8px"},
      {"keyboard", "<img",
       "<div style='overflow-x:auto;width:9em'>"
       "<p style='width:99em'>long</p></div><img",
       "scrolls, but not by keyboard"},
      {"wide", "<main>", "<main><p style='width:900px'>wide</p>", "px wide on a screen of 360 px"},
      {"elsewhere", "<main>", "<main><img alt='a' src='http://127.0.0.1:9/a.png'>",
       "asks for http://127.0.0.1:9/a.png"},
      {"script", "</main>", "</main><script>throw new Error('b')</script>", "a script fails"},
  };
  const TemporaryFolder folder;
  const std::string page = good_page();
  std::string files;
  for (const auto& [name, from, to, complaint] : faults) {
    std::string broken = page;
    const auto at = page.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    broken.replace(at, std::string(from).size(), to);
    files += " " + folder.file(std::string(name) + ".html", broken).string();
  }
  const auto check = run_program("python3 " + kCheck + files);
  if (check.exit_code == kNoBrowser) GTEST_SKIP() << check.output;
  EXPECT_EQ(check.exit_code, 1) << check.errors;
  EXPECT_THAT(check.output, Not(HasSubstr("good.html")));
  for (const auto& [name, from, to, complaint] : faults) {
    if (*complaint == '\0') continue;
    EXPECT_THAT(check.output,
                testing::ContainsRegex(std::string(name) + "\\.html: [^\n]*" + complaint));
  }
}

}  // namespace
}  // namespace vlp
