#pragma once
/// The k best ways to give corners to tracks, at most one to one; a track may go without, which is worth 0.
///
/// Method   Murty 1968: the best assignment splits all others into parts, one a track: those before it fixed as they are, its own choice
///          forbidden; the best of each part is a candidate for the next. Each part costs one shortest augmenting path from
///          the duals of the assignment it came from (Miller, Stone & Cox 1997). For that the problem is made square: every track
///          has a column "missed" of its own, every corner a row "clutter" of its own; these meet at no cost.
/// Bounds   k * tracks paths at most, each of them at most (tracks + corners) steps; parts that cannot be among the k best are not
///          followed to their end. Equal totals come in a fixed order.
/// Threads  one object a thread. Memory: all of it in the constructor.
/// Source   K. G. Murty, An algorithm for ranking all the assignments in order of increasing cost, Operations Research 16, 1968;
///          M. L. Miller, H. S. Stone, I. J. Cox, Optimizing Murty's ranked assignment method, IEEE T-AES 33, 1997.
#include <cstdint>
#include <span>
#include <vector>

namespace cyclops {

/// One corner that a track may have.
struct Claim {
  std::int32_t corner{0};
  double gain{0};
};

class KBest {
 public:
  struct Room {
    std::size_t tracks{64};
    std::size_t corners{256};      ///< different ones in the claims of one problem
    std::size_t solutions{16};
    std::size_t corner_numbers{0}; ///< corners are numbered below this
  };
  explicit KBest(const Room& room);

  /// Track i may have claims[first[i]] .. claims[first[i + 1] - 1], no corner twice. Returns how many solutions there are, up to `k`;
  /// 0 when the problem does not fit the room.
  std::size_t run(std::span<const std::uint32_t> first, std::span<const Claim> claims, std::size_t k);

  /// Solution `i` of the last run, best first: sum of gains, and the corner of each track or -1.
  [[nodiscard]] double total(std::size_t i) const { return solutions_[i].total; }
  [[nodiscard]] std::span<const std::int32_t> corners(std::size_t i) const { return {solutions_[i].corner.data(), tracks_}; }

 private:
  struct Node {                            // an assignment and the part of all assignments that it is the best of
    double cost{0};
    std::size_t fixed{0};                  // tracks before this one are fixed as they are
    std::vector<std::int32_t> forbidden;   // columns of track `fixed`
    std::vector<std::int32_t> column;      // by row: tracks, then the clutter of each corner
    std::vector<std::int32_t> row;         // by column: corners, then the "missed" of each track
    std::vector<double> u, v;              // duals of rows and columns
  };
  struct Solution {
    double total{0};
    std::vector<std::int32_t> corner;
  };
  bool number_corners(std::span<const Claim> claims);
  void solve(Node& node);
  bool augment(Node& node, std::size_t row, double limit);
  std::int32_t shortest_path(const Node& node, std::size_t row, double limit);
  void relax(const Node& node, std::int32_t row, double before);
  void reach(const Node& node, std::int32_t row, std::size_t column, double distance);
  [[nodiscard]] std::int32_t nearest() const;
  void split(const Node& parent);
  void make_part(const Node& parent, std::size_t track, Node& out) const;
  void keep(std::size_t slot);
  void emit(const Node& node);

  Room room_;
  std::size_t most_{0};                    // solutions wanted
  std::size_t tracks_{0};
  std::span<const std::uint32_t> first_;
  std::span<const Claim> claims_;
  std::vector<std::int32_t> column_of_;    // by corner number, or -1
  std::vector<std::int32_t> corner_;       // by column
  std::vector<Node> pool_;
  std::vector<std::size_t> free_;          // slots of the pool
  std::vector<std::size_t> open_;          // candidates, cheapest last
  std::vector<Solution> solutions_;
  std::size_t found_{0};
  std::vector<double> distance_;           // of one path, by column
  std::vector<std::int32_t> from_;         // row from which the column was reached
  std::vector<char> done_;
  std::vector<char> closed_;               // columns of fixed tracks, and forbidden ones for the first row
};

}  // namespace cyclops
