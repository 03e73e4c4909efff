// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A damaged scene is read or rejected with an InputError; any other exception fails the test.
#include <gmock/gmock.h>

#include "simulation/scene_sample.h"

namespace vlp {
namespace {

/// Returns how often a scene is read if it is truncated after each `step` bytes and after each
/// line.
int times_read_when_cut(const std::string& whole, std::size_t step) {
  const TemporaryFolder folder;
  const auto file = folder.file("scene.yaml", whole);
  int times_read = 0;
  for (std::size_t bytes = whole.size(); bytes-- > 0;) {
    if (bytes % step != 0 && (bytes == 0 || whole[bytes - 1] != '\n')) continue;
    SCOPED_TRACE(bytes);
    std::filesystem::resize_file(file, bytes);
    const std::string message = rejection_message([&] { read_scene_file(file); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    times_read += message.empty() ? 1 : 0;
  }
  return times_read;
}

// The format does not declare the number of captures or the presence of a picture.
TEST(ReadSceneFile, AcceptsTruncatedSampleSceneAtFourLengthsOnly) {
  EXPECT_EQ(times_read_when_cut(kSceneYaml, 1), 4);
}

TEST(ReadSceneFile, AcceptsOrRejectsTruncatedScenesOfDatasetsWithoutCrash) {
  for (const std::string name :
       {"paper-rig", "paper-rig-faulty", "wide", "clutter", "downlights", "recessed", "foreign"}) {
    const std::string whole =
        TemporaryFolder::read_content(VLP_SOURCE_DIR "/datasets/" + name + "/scene.yaml");
    EXPECT_GE(times_read_when_cut(whole, 47), 3) << name;
  }
}

TEST(ReadSceneFile, AcceptsOrRejectsAnyReplacedNumberWithoutCrash) {
  const TemporaryFolder folder;
  const std::string figure = "0123456789.-+e";
  const auto is_figure = [&](std::size_t at) {
    return figure.find(kSceneYaml[at]) != std::string::npos;
  };
  int read = 0, refused = 0;
  for (std::size_t begin = kSceneYaml.find("seed"); begin < kSceneYaml.size(); ++begin) {
    const char before = kSceneYaml[begin - 1];
    if ((before != ' ' && before != '[') || !is_figure(begin)) continue;
    std::size_t end = begin;
    while (is_figure(end)) ++end;
    for (const std::string other : {"0", "-1", "1.0e+300", "-1.0e-300", "2147483647", "[]", "''"}) {
      const std::string yaml = std::string(kSceneYaml).replace(begin, end - begin, other);
      SCOPED_TRACE(yaml);
      const auto file = folder.file("scene.yaml", yaml);
      ++(rejection_message([&] { read_scene_file(file); }).empty() ? read : refused);
      std::filesystem::remove(file);  // or the file system is slow to write it anew
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 300);
}

}  // namespace
}  // namespace vlp
