// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/report.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(RenderReportHtml, ShowsVerdictAfterTitleAndMarksFailedGates) {
  Report report{"unit 7", {{"mean_mm", "mm", 0.5, 1, Direction::at_most}}, {}, {}, {}, {}, {}};
  EXPECT_THAT(render_report_html(report), HasSubstr("<strong>PASS</strong>"));
  report.gates.push_back({"p90_mm", "mm", 2.5, 2, Direction::at_most});
  const std::string html = render_report_html(report);
  EXPECT_THAT(html, HasSubstr("<strong>FAIL</strong>1 of 2 gates is not met."));
  EXPECT_THAT(html, HasSubstr("<tr class=\"marked\"><th scope=\"row\">p90_mm</th>"
                              "<td>2.5\u00a0mm</td><td>at most\u00a02\u00a0mm</td>"));
  EXPECT_LT(html.find("<h1>unit 7</h1>"), html.find("FAIL</strong>"));
  EXPECT_LT(html.find("FAIL</strong>"), html.find("<table>"));
  EXPECT_LT(html.find("<table>"), html.find("mean_mm</th>"));
}

TEST(RenderReportHtml, ShowsPropertiesAndFloorPlanBeforeGates) {
  Report report{"unit 7", {{"mean_mm", "mm", 0.5, 1, Direction::at_most}}, {}, {}, {}, {}, {}};
  report.properties = {{"operator", "<Ann>"}};
  report.plots = {{ReportPart::floor, "<svg>", "the floor", "a plan", {{"image"}, {"0007.png"}}}};
  const std::string html = render_report_html(report);
  const auto verdict = html.find("<strong>PASS"), fact = html.find("&lt;Ann&gt;"),
             floor = html.find("the floor"), worst = html.find("0007.png"),
             gate = html.find("mean_mm");
  ASSERT_NE(gate, std::string::npos);
  EXPECT_LT(verdict, fact);
  EXPECT_LT(fact, floor);
  EXPECT_LT(floor, worst);
  EXPECT_LT(worst, gate);
}

TEST(RenderReportHtml, FailsGateWithoutValue) {
  const std::string html = render_report_html(
      {"unit 7", {{"split_half_px", "px", {}, 1, Direction::at_most}}, {}, {}, {}, {}, {}});
  EXPECT_THAT(html, HasSubstr("<strong>FAIL</strong>1 of 1 gate is not met."));
  EXPECT_THAT(html, HasSubstr("<th scope=\"row\">split_half_px</th><td>none</td>"
                              "<td>at most\u00a01\u00a0px</td><td>NOT\u00a0MET</td>"));
}

TEST(RenderReportHtml, ShowsCautionInVerdictBox) {
  Report report{"unit 7", {{"mean_mm", "mm", 0.5, 1, Direction::at_most}}, {}, {}, {}, {}, {}};
  report.caution = "9 of 10 <captures>";
  EXPECT_THAT(render_report_html(report),
              HasSubstr("(1 gate).<p>9 of 10 &lt;captures&gt;</p>\n</div>"));
}

TEST(RenderReportHtml, ShowsNoVerdictWithoutGates) {
  const std::string html = render_report_html({"unit 7", {}, {}, {}, {}, {}, {}});
  EXPECT_THAT(html, HasSubstr("NO VERDICT"));
  EXPECT_THAT(html, Not(HasSubstr("PASS</strong>")));
}

TEST(RenderReportHtml, OmitsEmptySections) {
  const std::string html = render_report_html({"unit 7", {}, {}, {}, {}, {}, {}});
  EXPECT_THAT(html, Not(HasSubstr("<h2>")));
  EXPECT_THAT(html, Not(HasSubstr("<table>")));
  EXPECT_THAT(html, Not(HasSubstr("<img")));
}

TEST(RenderReportHtml, EscapesMarkupInAllTexts) {
  const std::string evil = "</title><script>alert('1')</script>&\"";
  Report report{
      evil, {{evil, evil, 1, 2, Direction::at_most}}, {{evil, evil, evil, evil}}, {evil}, {}, {},
      {}};
  report.plots = {{ReportPart::other, "<svg>", evil, evil}};
  report.evaluation = HistoryEntry{evil, evil, evil, evil, {{evil, evil}}};
  Calibration calibration;
  calibration.camera = {evil, {800, 600}, LensModel::pinhole, {1, 1, 1, 1}, {}, {}, {}};
  report.calibration = calibration;
  const std::string html = render_report_html(report);
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("alert('")));
  EXPECT_THAT(html, HasSubstr("&lt;/title&gt;&lt;script&gt;alert(&#39;1&#39;)"));
}

TEST(RenderReportHtml, ShowsValuesOfEachCalibrationPartAndHistory) {
  Calibration calibration;
  calibration.camera = {
      "cam-9", {800, 600}, LensModel::opencv4, {500, 501, 400, 300, 0.125, 0, 0, 0}, {}, 3e-5, {}};
  calibration.intrinsics_report = IntrinsicsReport{36, 3416, 28, 0.0459, {}, 0.158, {}};
  calibration.rotation_center =
      RotationCenter{RotationModel::tilt, {404, 301}, {std::sin(0.01), 0, std::cos(0.01)}};
  calibration.covariance = {{},
                            {"zenith_x", "zenith_y"},
                            Eigen::Vector2d(1, 1)
                                .cwiseQuotient(calibration.camera.focal_px())
                                .cwiseAbs2()
                                .asDiagonal()
                                .toDenseMatrix()};
  calibration.dispersion = Dispersion{{0.01, 0.02}, 0.003, {0.001, 0}, 40};
  calibration.history = {
      {"camera", "vlp-intrinsics", "9.9", "--board b.yaml", {{"b.yaml", "abc"}}}};
  Report report{"cam-9", {}, {}, {}, calibration, {}, {}};
  report.evaluation = HistoryEntry{"evaluation", "vlp-evaluate", "9.9", "", {}};
  const std::string html = render_report_html(report);
  // 0.01 rad are 0.573 degrees.
  for (const char* part :
       {"cam-9", "LENSMODEL_OPENCV4", "500, 501 px", "0.125", "3416", "0.0459 px", "0.158 px",
        "404, 301 px; standard deviation 1, 1 px", "0.573 degrees", "3 mm", "<h2>Dispersion</h2>",
        "vlp-intrinsics 9.9, 1 input<", "<code>--board b.yaml</code>", "<td>abc</td>",
        "vlp-evaluate 9.9, 0 inputs"}) {
    EXPECT_THAT(html, HasSubstr(part));
  }
}

TEST(RenderReportHtml, ShowsValidRegionButNoViewsForImportedLens) {
  Calibration calibration;
  calibration.camera = {"cam-9", {800, 600}, LensModel::pinhole, {500, 501, 400, 300}, {}, {}, {}};
  calibration.intrinsics_report.emplace();
  calibration.intrinsics_report->region_px = {{0, 0}, {500, 0}, {500, 599}};
  const Report report{"cam-9", {}, {}, {}, calibration, {}, {}};
  const std::string html = render_report_html(report);
  EXPECT_THAT(html, HasSubstr("in the valid region (valid_region_px)"));
  EXPECT_THAT(html, Not(HasSubstr("views of the board")));
}

TEST(RenderReportHtml, OrdersPlotsByReportPart) {
  Report report{"a", {}, {}, {}, {}, {}, {}};
  report.plots = {{ReportPart::distribution, "<svg>", "second", "b"},
                  {ReportPart::camera, "\x89PNG", "first", "a"}};
  const std::string html = render_report_html(report);
  ASSERT_NE(html.find("second"), std::string::npos);
  EXPECT_LT(html.find("first"), html.find("second"));
  EXPECT_THAT(html, HasSubstr("src=\"data:image/svg+xml;base64,PHN2Zz4=\""));
  EXPECT_THAT(html, HasSubstr("src=\"data:image/png;base64,iVBORw==\""));
  EXPECT_EQ(render_report_html(report), html);
}

}  // namespace
}  // namespace vlp
