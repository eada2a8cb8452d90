#include "base/config_text.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>

namespace cyclops {
namespace {

Error refused(const std::string& text, std::size_t at, const std::string& name, const std::string& why) {
  return make_error(ErrorCode::kCorrupt, name + ":" + std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')), why);
}

struct Character {
  std::uint32_t code{0};
  std::size_t bytes{0};   // 0: no UTF-8
};

/// Of two to four bytes, the shortest form only, no surrogate.
Character utf8(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0}; };
  const std::uint8_t first = byte(at);
  const std::size_t bytes = first >= 0xF0 && first < 0xF8 ? 4 : first >= 0xE0 && first < 0xF0 ? 3 : first >= 0xC0 && first < 0xE0 ? 2 : 0;
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  if (bytes == 0) return {};
  std::uint32_t code = first & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(at + i) & 0xC0U) != 0x80) return {};
    code = code << 6 | (byte(at + i) & 0x3FU);
  }
  const bool valid = code >= kLeast[bytes] && code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
  return valid ? Character{code, bytes} : Character{};
}

std::string escaped(std::uint32_t code) {
  char text[16];
  std::snprintf(text, sizeof text, "\\U%08X", static_cast<unsigned>(code));
  return text;
}

bool is_control(unsigned char c) { return (c < 0x20 && c != '\t' && c != '\n' && c != '\r') || c == 0x7F; }

}  // namespace

Result<std::string> ascii_text(const std::string& text, const std::string& name) {
  std::string out;
  out.reserve(text.size());
  char quote = 0;
  bool comment = false, backslash = false;   // one that escapes what follows it
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_control(static_cast<unsigned char>(c))) return refused(text, i, name, "holds a control character, code " + std::to_string(static_cast<int>(c)));
    if (static_cast<unsigned char>(c) >= 0x80) {
      if (comment) { out += '?'; continue; }
      if (quote != '"') return refused(text, i, name, "holds a character that is not ASCII outside \"quotes\" and comments");
      const Character u = utf8(text, i);
      if (u.bytes == 0 || backslash) return refused(text, i, name, "holds bytes that are no UTF-8, or a backslash before them");
      out += escaped(u.code);
      i += u.bytes - 1;
      continue;
    }
    out += c;
    backslash = false;
    if (c == '\n') {
      quote = 0;
      comment = false;
    } else if (quote == '"' && c == '\\') {
      backslash = i + 1 == text.size() || (text[i + 1] != '"' && text[i + 1] != '\\');
      if (!backslash) out += text[++i];
    } else if (!comment && quote != 0) {
      if (c == quote) quote = 0;
    } else if (!comment) {
      if (c == '"' || c == '\'') quote = c;
      comment = c == '#';
    }
  }
  return out;
}

}  // namespace cyclops
