// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/step_outcome.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>

#include "captures/digest.h"
#include "session/step_history.h"
#include "support/program.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

/// A program with options of each kind, as called with `arguments`.
HistoryEntry make_entry(const std::string& arguments, const std::vector<std::string>& inputs) {
  CLI::App app("Something", "vlp-something");
  std::string images, lamps, output, method;
  std::vector<double> numbers;
  int threads = 0;
  bool flag = false, quiet = false;
  app.add_option("images", images)->required();
  app.add_option("--lamps", lamps);
  app.add_option("-o,--output", output);
  app.add_option("--method", method);
  app.add_option("--numbers", numbers)->expected(2);
  app.add_option("--threads", threads);
  app.add_flag("--refine-map", flag);
  app.add_flag("-q,--quiet", quiet);
  app.parse(arguments);
  return make_command_entry(app, inputs);
}

TEST(HashFile, MatchesFips180Examples) {  // FIPS 180-2, appendix B
  const TemporaryFolder folder;
  EXPECT_EQ(hash_file(folder.file("abc", "abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_file(folder.file("million", std::string(1000000, 'a'))),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(InputDigests, ImageFolderDigestMatchesSha256sumOfItsImages) {
  const TemporaryFolder folder;
  folder.file("b.png", "second");
  folder.file("a.png", "first");
  folder.file("notes.txt", "no image");
  const auto oracle =
      run_program("cd '" + (folder / "").string() + "' && sha256sum *.png | sha256sum");
  EXPECT_EQ(InputDigests().digest_images(folder / ""), oracle.output.substr(0, 64));
}

TEST(MakeCommandEntry, OmitsFoldersAndOptionsThatDoNotAffectResult) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "spot");
  folder.file("spot/0.png", "an image");
  const std::string images = (folder / "spot").string() + "/";
  const std::string lamps = folder.file("lamps.yaml", "abc").string();
  const HistoryEntry entry = make_entry(
      "--refine-map --threads 3 -q --numbers 1.5 -2 --method axis -o /else/where.yaml '" + images +
          "' --lamps '" + lamps + "'",
      {images, lamps, ""});
  EXPECT_EQ(entry.program, "vlp-something");
  EXPECT_EQ(entry.version, VLP_VERSION);
  EXPECT_EQ(entry.options, "--lamps lamps.yaml --method axis --numbers 1.5 -2 --refine-map");
  ASSERT_EQ(entry.inputs.size(), 2U);
  EXPECT_EQ(entry.inputs[0].file, "spot");
  EXPECT_EQ(entry.inputs[0].sha256, InputDigests().digest_images(images));
  EXPECT_EQ(entry.inputs[1].file, "lamps.yaml");
  EXPECT_EQ(entry.inputs[1].sha256, hash_file(lamps));
}

TEST(MakeCommandEntry, HasEmptyOptionsWithoutOptionsAndThrowsForUnreadableInput) {
  const TemporaryFolder folder;
  EXPECT_EQ(make_entry("images", {}).options, "");
  const std::string missing = (folder / "missing").string();
  EXPECT_EQ(rejection_message([&] { make_entry("images", {missing}); }),
            missing + ": cannot be opened: No such file or directory");
}

}  // namespace
}  // namespace vlp
