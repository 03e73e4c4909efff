// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "history.h"

#include <fmt/core.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "detection/image_file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    check(context_ ? EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) : 0);
  }
  void add(std::string_view bytes) {
    check(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
  }
  std::string digits() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int size = 0;
    check(EVP_DigestFinal_ex(context_.get(), digest.data(), &size));
    std::string text;
    for (unsigned int i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  static void check(int done) {
    if (done != 1) throw std::runtime_error("SHA-256 cannot be computed");
  }
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

/// Without the folders, which are another on each machine; "." has a name, too.
std::string last_name(const std::string& path) {
  const std::filesystem::path whole = std::filesystem::weakly_canonical(path);
  return whole.filename().string();
}

bool changes_the_result(const CLI::Option& option) {
  constexpr std::array<std::string_view, 13> others = {
      "--output", "--plot",   "--annotate", "--threads", "--quiet", "--verbose", "--cache",
      "--ros",    "--kalibr", "--opencv",   "--report",  "--json",  "--junit"};
  return std::find(others.begin(), others.end(), option.get_name()) == others.end();
}

/// Its value is the name of a file that is written.
bool names_output(const CLI::Option& option) { return option.get_name() == "--refine-map"; }

std::string options_of(const CLI::App& app, const std::vector<std::string>& inputs) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->count() == 0 || option->get_positional() || !changes_the_result(*option)) continue;
    text += (text.empty() ? "" : " ") + option->get_name();
    if (option->get_items_expected_max() == 0) continue;  // a flag
    for (const std::string& value : option->results()) {
      const bool file =
          names_output(*option) || std::find(inputs.begin(), inputs.end(), value) != inputs.end();
      text += " " + (file ? last_name(value) : value);
    }
  }
  return text;
}

}  // namespace

std::string sha256_of_text(std::string_view text) {
  Sha256 sha;
  sha.add(text);
  return sha.digits();
}

std::string sha256_of_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) throw InputError(file, "cannot be read");
  Sha256 sha;
  std::array<char, 1 << 16> block;
  while (stream) {
    stream.read(block.data(), block.size());
    sha.add({block.data(), static_cast<std::size_t>(stream.gcount())});
  }
  if (stream.bad()) throw InputError(file, "cannot be read");
  return sha.digits();
}

std::string sha256_of_images(const std::filesystem::path& folder) {
  Sha256 sha;
  for (const auto& image : images_in(folder)) {
    sha.add(fmt::format("{}  {}\n", sha256_of_file(image), image.filename().string()));
  }
  return sha.digits();
}

HistoryEntry history_entry(const CLI::App& app, const std::vector<std::string>& inputs) {
  HistoryEntry entry{"", app.get_name(), VLP_VERSION, options_of(app, inputs), {}};
  for (const std::string& input : inputs) {
    if (input.empty()) continue;
    entry.inputs.push_back({last_name(input), std::filesystem::is_directory(input)
                                                  ? sha256_of_images(input)
                                                  : sha256_of_file(input)});
  }
  return entry;
}

}  // namespace vlp
