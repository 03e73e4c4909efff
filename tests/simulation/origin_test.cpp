// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Provenance that vlp-simulate writes into its output.
#include <gmock/gmock.h>

#include "simulation/board_pdf.h"
#include "simulation/simulate.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(MakeProvenance, BeginsWithProgramVersionAndHoldsGivenSeed) {
  const TemporaryFolder folder;
  const auto scene = folder.file("scene.yaml", "format: vlp-scene/1\nseed: 1  # any\nlamps: []\n");
  const std::string same = make_provenance(scene, {}, "vlp-simulate", "0.1.0");
  EXPECT_EQ(same, "# vlp-simulate 0.1.0\nformat: vlp-scene/1\nseed: 1  # any\nlamps: []\n");
  // The provenance of an output is that of its scene.
  const auto output = folder.file("output.yaml", same);
  EXPECT_EQ(make_provenance(output, 7, "vlp-simulate", "0.2.0"),
            "# vlp-simulate 0.2.0\nformat: vlp-scene/1\nseed: 7\nlamps: []\n");
}

TEST(MakeProvenance, RejectsSeedWhenSceneSeedSharesItsLine) {
  const TemporaryFolder folder;
  const auto scene = folder.file("scene.yaml", "{format: vlp-scene/1, seed: 1}\n");
  EXPECT_THAT(rejection_message([&] { make_provenance(scene, 7, "vlp-simulate", "0.1.0"); }),
              testing::HasSubstr("--seed needs the scene's seed on a line of its own"));
}

TEST(RequirePageSize, ReturnsPaperSizeOrThrowsForUnknownName) {
  EXPECT_EQ(require_page_size("A3").size_m.x(), 0.297);
  EXPECT_EQ(rejection_message<std::invalid_argument>([] { require_page_size("B5"); }),
            "there is no paper 'B5', only A4, A3, A2, A1, A0, Letter");
}

}  // namespace
}  // namespace vlp
