// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/numpy_archive.h"

#include <gtest/gtest.h>

#include <array>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(EncodeBase85, MatchesOutputOfPython) {
  EXPECT_EQ(encode_base85(""), "");
  EXPECT_EQ(encode_base85("hello"), "Xk~0{Zv");
  EXPECT_EQ(encode_base85(std::string("\0\0\0\0", 4)), "00000");
  EXPECT_EQ(encode_base85("abcd"), "VPa!s");
}

// Checked by the program unzip, which fails for a wrong CRC.
TEST(NumpyArchive, SerializeReturnsValidZipWithNpyHeader) {
  if (run_program("command -v unzip").exit_code != 0) GTEST_SKIP() << "no unzip here";
  const TemporaryFolder folder;
  NumpyArchive archive;
  const std::array values{1.0, 2.0, 3.0, 4.0, 5.0, 6.0};
  archive.add_npz_array("matrix", {2, 3}, values);
  archive.add_npz_array("text", "LENSMODEL_OPENCV8");
  archive.add_npz_array("flag", true);
  const auto file = folder.file("a.npz", archive.serialize_npz_archive());
  const auto checked = run_program("unzip -t '" + file.string() + "'");
  EXPECT_EQ(checked.exit_code, 0) << checked.output << checked.errors;
  const auto matrix = run_program("unzip -p '" + file.string() + "' matrix.npy | head -c 80");
  EXPECT_NE(matrix.output.find("{'descr': '<f8', 'fortran_order': False, 'shape': (2,3,), }"),
            std::string::npos);
  const auto text = run_program("unzip -p '" + file.string() + "' text.npy | tr -d '\\0'");
  EXPECT_TRUE(text.output.ends_with("\nLENSMODEL_OPENCV8")) << text.output;
}

}  // namespace
}  // namespace vlp
