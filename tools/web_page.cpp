// The page is a plain file beside this one; it becomes part of the program.
#include <sodium.h>

#include "tools/web_server.hpp"

__asm__(
    ".section .rodata\n"
    "cyclops_web_page_begin:\n"
    ".incbin \"tools/web_page.html\"\n"
    "cyclops_web_page_end:\n"
    ".previous\n");
extern "C" {
extern const char cyclops_web_page_begin[];
extern const char cyclops_web_page_end[];
}

namespace cyclops::tools {
namespace {

/// 'sha256-...' of what stands between <tag> and </tag>.
std::string hash_of(std::string_view page, const std::string& tag) {
  const std::string open = "<" + tag + ">", close = "</" + tag + ">";
  const std::size_t from = page.find(open) + open.size(), to = page.find(close);
  CYCLOPS_ASSERT(from < to && to != std::string_view::npos);
  unsigned char digest[crypto_hash_sha256_BYTES];
  crypto_hash_sha256(digest, reinterpret_cast<const unsigned char*>(page.data()) + from, to - from);
  char text[sodium_base64_ENCODED_LEN(sizeof digest, sodium_base64_VARIANT_ORIGINAL)];
  sodium_bin2base64(text, sizeof text, digest, sizeof digest, sodium_base64_VARIANT_ORIGINAL);
  return std::string("'sha256-") + text + "'";
}

}  // namespace

std::string_view web_page() { return {cyclops_web_page_begin, static_cast<std::size_t>(cyclops_web_page_end - cyclops_web_page_begin)}; }

std::string web_policy(std::string_view page) {
  return "default-src 'none'; connect-src 'self'; img-src data:; script-src " + hash_of(page, "script") + "; style-src " + hash_of(page, "style") +
         "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
}

}  // namespace cyclops::tools
