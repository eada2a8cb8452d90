#include "align/nav_watch.hpp"

#include <gtest/gtest.h>

namespace cyclops {
namespace {

Time frame(int n) { return Time{n * 33'333'333LL}; }
Alignment that_far(double disagreement) {
  Alignment a;
  a.consensus = true;
  a.nav_disagreement = disagreement;
  return a;
}

TEST(NavWatch, AStepIsToldWithinASecondAndItsEndToo) {
  NavWatch watch;
  int told = -1, over = -1;
  for (int n = 0; n < 150; ++n) {
    const bool suspect = watch.update(frame(n), true, that_far(n < 30 || n >= 90 ? 6 : 60));
    if (suspect && told < 0) told = n;
    if (!suspect && told >= 0 && over < 0) over = n;
  }
  EXPECT_GE(told, 30);
  EXPECT_LE(told, 60);
  EXPECT_GE(over, 90);
  EXPECT_LE(over, 120);
}

TEST(NavWatch, SingleFramesAndFramesWithoutConsensusSayNothing) {
  NavWatch watch;
  for (int n = 0; n < 200; ++n) EXPECT_FALSE(watch.update(frame(n), true, that_far(n % 3 == 0 ? 1000 : 3)));
  Alignment none;
  none.nav_disagreement = 1000;
  for (int n = 200; n < 300; ++n) EXPECT_FALSE(watch.update(frame(n), true, none));
  for (int n = 300; n < 400; ++n) EXPECT_FALSE(watch.update(frame(n), false, that_far(1000)));
}

TEST(NavWatch, ALongSilenceForgets) {
  NavWatch watch;
  for (int n = 0; n < 60; ++n) watch.update(frame(n), true, that_far(100));
  EXPECT_TRUE(watch.suspect());
  EXPECT_FALSE(watch.update(frame(200), false, {}));
}

}  // namespace
}  // namespace cyclops
