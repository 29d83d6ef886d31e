#include "check/emitted_lines.h"

#include <gtest/gtest.h>

#include "check/emitted_packed.h"
#include "check/emitted_text.h"
#include "helpers/temp_folder.h"

namespace curvesup::emitted {
namespace {

// Lines as long as many a block, and as short as none.
std::string lines_of_all_lengths() {
  std::string text;
  for (int i = 0; i < 3000; ++i) text += std::string(static_cast<std::size_t>(i * 37 % 500), static_cast<char>('a' + i % 26)) + "\n";
  text += std::string(700000, 'x') + "\n\n";
  return text + "no line feed behind this";
}

TEST(FileLines, AreThoseOfTheTextWhateverTheBlocks) {
  const TempFolder folder;
  const std::string text = lines_of_all_lengths();
  FileLines lines(folder.write("text", text));
  Lines expected(text);
  std::string_view line, right;
  while (expected.next(right)) {
    ASSERT_TRUE(lines.next(line));
    ASSERT_EQ(line, right);
    ASSERT_EQ(lines.offset(), static_cast<std::size_t>(right.data() - text.data()));
    ASSERT_EQ(lines.number(), expected.number());
    ASSERT_EQ(lines.ended(), expected.ended());
  }
  EXPECT_FALSE(lines.next(line));
  EXPECT_FALSE(lines.ended());
  EXPECT_EQ(lines.bytes(), text.size());
  EXPECT_EQ(lines.sha256(), sha256_hex(text));
}

TEST(FileLines, AnEmptyFileHasNone) {
  const TempFolder folder;
  FileLines lines(folder.write("empty", ""));
  std::string_view line;
  EXPECT_FALSE(lines.next(line));
  EXPECT_EQ(lines.bytes(), 0u);
  EXPECT_EQ(lines.sha256(), sha256_hex(""));
}

TEST(Packed, GivesBackWhatTheTextSays) {
  const Vec3 tip(-123.4567, 0.0001, 299.9999), position(0.5123456, -0.0000001, -1.2999999), rotation(3.141593, -0.000001, 6.283185);
  EXPECT_LT((PackedVec<4>(tip).vec() - tip).cwiseAbs().maxCoeff(), 1e-13);
  const Pose pose = PackedPose(Pose{position, rotation});
  EXPECT_LT((pose.position_m - position).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((pose.rotation_vector - rotation).cwiseAbs().maxCoeff(), 1e-15);
  // What no arm reaches stays far away.
  EXPECT_GT(PackedVec<7>(Vec3(1e6, 0.0, 0.0)).vec().x(), 100.0);
}

TEST(Printable, FindsAnyOtherByteAtAnyPlace) {
  for (std::size_t length = 1; length < 20; ++length) {
    for (std::size_t at = 0; at < length; ++at) {
      for (int byte = 0; byte < 256; ++byte) {
        std::string line(length, '~');
        line[at] = static_cast<char>(byte);
        ASSERT_EQ(is_printable(line), byte >= 0x20 && byte <= 0x7e) << byte << " at " << at << " of " << length;
      }
    }
  }
  EXPECT_TRUE(is_printable(""));
}

TEST(ReadNumber, TakesWhatAProgramMayHold) {
  struct Case {
    const char* text;
    double value;
    int decimals;
    bool plain;
    std::size_t behind;
  };
  for (const Case& c : {Case{"12", 12.0, 0, true, 2}, Case{"-0.058,", -0.058, 3, true, 6}, Case{"0.1234567]", 0.1234567, 7, true, 9},
                        Case{"-0.000", 0.0, 3, false, 6}, Case{"1e-5 ", 1.0, 0, false, 4}, Case{"3.", 3.0, 0, false, 1},
                        Case{"1.2.3", 1.2, 1, false, 3}, Case{"1234567890123456789", 123456789012345678.0, 0, false, 19}}) {
    Number number;
    std::size_t at = 0;
    ASSERT_TRUE(read_number(c.text, at, number)) << c.text;
    EXPECT_EQ(number.value, c.value) << c.text;
    EXPECT_EQ(number.decimals, c.decimals) << c.text;
    EXPECT_EQ(number.plain, c.plain) << c.text;
    EXPECT_EQ(at, c.behind) << c.text;
  }
  Number number;
  for (const char* none : {"", "-", "x", ".5"}) {
    std::size_t at = 0;
    EXPECT_FALSE(read_number(none, at, number)) << none;
    EXPECT_EQ(at, 0u);
  }
}

}  // namespace
}  // namespace curvesup::emitted
