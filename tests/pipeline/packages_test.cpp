// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// scripts/packages.sh leaves what was chosen for a build as it is. The packages themselves are for
/// tests/packages.sh.
#include <gmock/gmock.h>

#include <filesystem>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// The script in a folder of its own, among tools that only write down how they were called.
class Packages : public testing::Test {
 protected:
  TemporaryFolder folder;

  void SetUp() override {
    namespace fs = std::filesystem;
    for (const char* name : {"scripts", "bin", "build"}) fs::create_directory(folder / name);
    fs::copy(VLP_SOURCE_DIR "/scripts/packages.sh", folder / "scripts/packages.sh");
    const std::string log = (folder / "calls").string();
    folder.file("bin/cmake", "#!/bin/sh\necho cmake \"$@\" >>'" + log + "'\n");
    folder.file("bin/cpack", "#!/bin/sh\ntouch \"$2/vlp.deb\"\n");
    folder.file("bin/dpkg-architecture", "#!/bin/sh\necho some-linux\n");
    for (const char* name : {"bin/cmake", "bin/cpack", "bin/dpkg-architecture"}) {
      fs::permissions(folder / name, fs::perms::owner_all);
    }
  }
  /// Returns the calls of cmake, in their order.
  std::string calls() const {
    const auto result =
        run_program("cd '" + (folder / "").string() +
                    "' && PATH=$PWD/bin:$PATH bash scripts/packages.sh -o out tools");
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    EXPECT_THAT(result.output, HasSubstr("out/vlp.deb"));
    return TemporaryFolder::read_content(folder / "calls");
  }
};

TEST_F(Packages, ReconfiguresExistingBuildForUsrAndRestoresPrefix) {
  folder.file("build/CMakeCache.txt",
              "CMAKE_INSTALL_PREFIX:PATH=/opt/vlp\nCMAKE_UNITY_BUILD:BOOL=OFF\n");
  EXPECT_THAT(calls(),
              AllOf(Not(HasSubstr("--preset")),
                    HasSubstr("cmake -DCMAKE_INSTALL_PREFIX=/usr "
                              "-DCMAKE_INSTALL_LIBDIR=lib/some-linux build\n"),
                    HasSubstr("--target vlp_package_tools\n"),
                    HasSubstr("cmake -DCMAKE_INSTALL_PREFIX=/opt/vlp -UCMAKE_INSTALL_LIBDIR ")));
}

TEST_F(Packages, ConfiguresReleasePresetWhenNoBuildExists) {
  const std::string called = calls();
  EXPECT_THAT(called, testing::StartsWith("cmake --preset release -DCMAKE_INSTALL_PREFIX=/usr "));
  EXPECT_THAT(called.substr(0, called.find('\n')), HasSubstr(" -DBUILD_TESTING=OFF"));
}

}  // namespace
}  // namespace vlp
