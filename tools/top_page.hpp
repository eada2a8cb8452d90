#pragma once
/// The page of cyclops-top as text with styles, for any terminal of 80x24 or more. Knows no terminal.
///
/// Colours  an alarm's, where the value shown is the one its limit is on; dim where HEALTH is stale.
/// Threads  any.
#include <string>
#include <vector>

#include "tools/board.hpp"

namespace cyclops::tools {

enum class Style : std::uint8_t { kPlain, kDim, kTitle, kGood, kWarning, kFault };

struct Span {
  int row{0};
  int column{0};
  Style style{Style::kPlain};
  std::string text;                ///< ASCII
};

struct Page {
  int columns{80};
  int rows{24};
  std::vector<Span> spans;         ///< none beyond the page
  [[nodiscard]] std::string text() const;   ///< rows with line ends, trailing blanks removed
};

[[nodiscard]] Page top_page(const Board& board, int columns, int rows, std::int64_t now_ns);

}  // namespace cyclops::tools
