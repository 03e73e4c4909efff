// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/digest.h"

#include <fmt/core.h>
#include <openssl/evp.h>

#include <array>
#include <limits>
#include <memory>
#include <stdexcept>

#include "rig/file.h"

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
  std::string to_hex_digits() {
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

}  // namespace

std::string hash_text(std::string_view text) {
  Sha256 sha;
  sha.add(text);
  return sha.to_hex_digits();
}

std::string hash_file(const std::filesystem::path& file) {
  InputFile input(file, std::numeric_limits<std::size_t>::max());
  Sha256 sha;
  std::array<char, 1 << 16> block;
  while (const std::size_t count = input.read(block.data(), block.size())) {
    sha.add({block.data(), count});
  }
  return sha.to_hex_digits();
}

}  // namespace vlp
