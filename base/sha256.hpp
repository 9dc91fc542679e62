// SPDX-License-Identifier: Apache-2.0
// SHA-256 (FIPS 180-4) over a file that comes in pieces.
#pragma once

#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // OpenSSL's EVP_MD_CTX

namespace meltstage {

class Sha256 {
 public:
  Sha256();
  void update(std::string_view bytes);
  /// 64 lower-case hexadecimal digits. An update() or finish() after it throws std::logic_error.
  std::string finish();

 private:
  void require_open() const;

  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

/// Of a whole text.
std::string sha256(std::string_view bytes);

}  // namespace meltstage
