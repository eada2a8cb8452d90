#include "tools/csv.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "test/support.hpp"

namespace cyclops::tools {
namespace {

class CsvTest : public ::testing::Test {
 protected:
  Result<Csv> load(const std::string& text) {
    std::ofstream(path_) << text;
    return Csv::load(path_);
  }
  test::TempDir dir_;
  std::string path_{dir_.file("t.csv")};
};

TEST_F(CsvTest, GivesNumbersByColumnName) {
  const auto csv = load("# words\nframe, x_m ,b\r\n\n1, -2.5e1 ,z\n");
  ASSERT_TRUE(csv.ok()) << csv.error().message();
  ASSERT_EQ(csv->rows(), 1U);
  EXPECT_EQ(csv->whole(0, "frame").value(), 1);
  EXPECT_EQ(csv->number(0, "x_m").value(), -25);
  EXPECT_EQ(csv->number(0, "b").error().message(), path_ + ":4: b is \"z\", expected a finite number");
  EXPECT_EQ(csv->whole(0, "x_m").value(), -25);
  EXPECT_EQ(csv->one_of({"y", "x_m"}).value(), "x_m");
  EXPECT_EQ(csv->one_of({"y", "q"}).error().message(), path_ + ":1: header has no column y or q");
}

TEST_F(CsvTest, RefusesAColumnThatStandsTwice) {
  EXPECT_EQ(load("frame,x,x\n1,2,3\n").error().message(), path_ + ":1: column x stands twice");
}

TEST_F(CsvTest, ColumnsWithoutANameDoNotShiftTheOthers) {
  // GIVEN two columns without a name before one that has one
  const auto csv = load(",,a\n1,2,3\n");
  ASSERT_TRUE(csv.ok()) << csv.error().message();
  EXPECT_EQ(csv->number(0, "a").value(), 3);
  EXPECT_EQ(load(",,a\n1,2\n").error().message(), path_ + ":2: has 2 cells, expected 3");
}

TEST_F(CsvTest, SaysThatThereIsNoHeaderOrNoFile) {
  EXPECT_EQ(load("# only words\n").error().message(), path_ + ": holds no header line");
  EXPECT_EQ(Csv::load("/nowhere.csv").error().message(), "/nowhere.csv: cannot be opened");
}

}  // namespace
}  // namespace cyclops::tools
