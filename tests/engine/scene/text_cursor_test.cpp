#include "engine/scene/formats/text_cursor.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

namespace limber::scene::formats {
namespace {

/// What a call on a cursor is refused with; "accepted" where it is not.
template <class Call>
std::string cursor_complaint(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(error.field(), "file");
    return error.what();
  }
  return "accepted";
}

std::string complaint_of_real(std::string_view text) {
  TextCursor cursor("file", text);
  return cursor_complaint([&] { (void)cursor.real("a length"); });
}

std::string complaint_of_integer(std::string_view text) {
  TextCursor cursor("file", text);
  return cursor_complaint([&] { (void)cursor.integer("an id"); });
}

TEST(TextCursor, CountsLinesOverBlanksCommentsAndBothLineEnds) {
  TextCursor cursor("file", "one # two\r\n\n\t three\r\n#\nfour");
  cursor.set_comment('#');
  EXPECT_EQ(cursor.word(), "one");
  EXPECT_EQ(cursor.line(), 1);
  EXPECT_EQ(cursor.word(), "three");
  EXPECT_EQ(cursor.line(), 3);
  EXPECT_EQ(cursor.word(), "four");
  EXPECT_EQ(cursor.line(), 5);
  EXPECT_EQ(cursor.word(), "");
  EXPECT_EQ(cursor.remaining(), 0u);
  EXPECT_EQ(cursor.peek(), '\0');
}

TEST(TextCursor, AByteOrderMarkIsNoText) {
  TextCursor words("file", "\xEF\xBB\xBFsolid");
  EXPECT_EQ(words.word(), "solid");
  TextCursor lines("file", "\xEF\xBB\xBFsolid box\n");
  std::string_view line;
  ASSERT_TRUE(lines.next_line(line));
  EXPECT_EQ(line, "solid box");
  TextCursor mark("file", "\xEF\xBB\xBF");
  EXPECT_FALSE(mark.skip_blanks());
}

TEST(TextCursor, CommasSeparateOnlyWhereTheyShould) {
  TextCursor with("file", "1,2.5,,3");
  with.set_comma_separates(true);
  EXPECT_EQ(with.integer("an id"), 1);
  EXPECT_EQ(with.real("a length"), 2.5);
  EXPECT_EQ(with.integer("an id"), 3);
  EXPECT_EQ(complaint_of_integer("1,2"), "file:1: expected an id, found '1,2'");
}

TEST(TextCursor, NumbersMayHaveASignAndEndAtAComment) {
  TextCursor cursor("file", "+1.5e2 -3 +7#8");
  cursor.set_comment('#');
  EXPECT_EQ(cursor.real("a length"), 150);
  EXPECT_EQ(cursor.integer("an id"), -3);
  EXPECT_EQ(cursor.integer("an id"), 7);
  EXPECT_FALSE(cursor.skip_blanks());
}

TEST(TextCursor, NumbersThatAreNoneAreNamed) {
  EXPECT_EQ(complaint_of_real("1.5mm"), "file:1: expected a length, found '1.5mm'");
  EXPECT_EQ(complaint_of_real("\n\n+-1"), "file:3: expected a length, found '+-1'");
  EXPECT_EQ(complaint_of_real("+"), "file:1: expected a length, found '+'");
  EXPECT_EQ(complaint_of_real(" \n"), "file:2: expected a length, found the end of the file");
  EXPECT_EQ(complaint_of_integer("2.5"), "file:1: expected an id, found '2.5'");
  EXPECT_EQ(complaint_of_integer("9223372036854775808"),
            "file:1: expected an id, found '9223372036854775808'");
  for (const char* text : {"nan", "inf", "-inf", "1e400", "-1e999"})
    EXPECT_NE(complaint_of_real(text).find("not finite"), std::string::npos) << text;
}

TEST(TextCursor, UnderflowIsNoFault) {
  TextCursor cursor("file", "1e-400 5e-324");
  EXPECT_EQ(cursor.real("a length"), 0);
  EXPECT_EQ(cursor.real("a length"), std::numeric_limits<double>::denorm_min());
}

TEST(TextCursor, AShortLineIsNotFilledUpFromTheNext) {
  TextCursor cursor("file", "1 2\n3");
  EXPECT_EQ(cursor.real_in_line("a coordinate"), 1);
  EXPECT_EQ(cursor.integer_in_line("a coordinate"), 2);
  EXPECT_EQ(cursor_complaint([&] { (void)cursor.real_in_line("a coordinate"); }),
            "file:1: expected a coordinate, found the end of the line");
  EXPECT_EQ(cursor_complaint([&] { (void)cursor.integer_in_line("a coordinate"); }),
            "file:1: expected a coordinate, found the end of the line");
  EXPECT_EQ(cursor.real("a coordinate"), 3);
  EXPECT_EQ(cursor.line(), 2);
}

TEST(TextCursor, LinesComeWithoutTheirEnds) {
  TextCursor cursor("file", "a b\r\n\nlast");
  std::string_view line;
  ASSERT_TRUE(cursor.next_line(line));
  EXPECT_EQ(line, "a b");
  ASSERT_TRUE(cursor.next_line(line));
  EXPECT_EQ(line, "");
  EXPECT_EQ(cursor.line(), 3);
  ASSERT_TRUE(cursor.next_line(line));
  EXPECT_EQ(line, "last");
  EXPECT_FALSE(cursor.next_line(line));
  cursor.skip_line();  // of the end: nothing
  EXPECT_EQ(cursor.position(), 10u);
}

TEST(TextCursor, CountsThatTheFileCannotHoldAreRefused) {
  // Four words of two bytes; the last one of a file need not end in a blank.
  const std::string rest = " 1 1 1 1";
  const auto complaint = [&](const std::string& count) {
    const std::string text = count + rest;
    TextCursor cursor("file", text);
    return cursor_complaint([&] { (void)cursor.count("the number of nodes", 2); });
  };
  EXPECT_EQ(complaint("4"), "accepted");
  EXPECT_EQ(complaint("0"), "accepted");
  EXPECT_EQ(complaint("5"),
            "file:1: the number of nodes is 5, more than the rest of the file holds");
  EXPECT_EQ(complaint("-1"), "file:1: the number of nodes is negative: -1");
  EXPECT_NE(complaint("9223372036854775807"), "accepted");
}

TEST(TextCursor, BytesEndWhereTheFileDoes) {
  TextCursor cursor("file", "\n12345");
  EXPECT_EQ(cursor.bytes(3, "the header"), std::string_view("\n12"));
  EXPECT_EQ(cursor_complaint([&] { (void)cursor.bytes(4, "the header"); }),
            "file:1: the file ends inside the header");
  EXPECT_EQ(cursor_complaint(
                [&] { (void)cursor.bytes(std::numeric_limits<std::size_t>::max(), "the header"); }),
            "file:1: the file ends inside the header");
  EXPECT_EQ(cursor.bytes(3, "the header"), "345");
  EXPECT_EQ(cursor.bytes(0, "the header"), "");
}

TEST(TextCursor, ExpectsWordsExactly) {
  TextCursor cursor("file", "ply\nPLY");
  cursor.expect("ply");
  EXPECT_EQ(cursor_complaint([&] { cursor.expect("ply"); }), "file:2: expected 'ply', found 'PLY'");
  EXPECT_EQ(cursor_complaint([&] { cursor.expect("ply"); }),
            "file:2: expected 'ply', found the end of the file");
}

TEST(TextCursor, WordsForPeople) {
  EXPECT_TRUE(same_word("*Node", "*NODE"));
  EXPECT_FALSE(same_word("node", "nodes"));
  EXPECT_FALSE(same_word("[", "{"));  // 32 apart, as letters of two cases are
  EXPECT_EQ(to_lower("C3D4_Z"), "c3d4_z");
  EXPECT_EQ(trim(" \t\r\n a b \n"), "a b");
  EXPECT_EQ(trim(" \n "), "");
  EXPECT_EQ(in_quotes("a\x01\xC3"), "'a?\?'");
  EXPECT_EQ(in_quotes(std::string(40, 'x')), "'" + std::string(40, 'x') + "'");
  EXPECT_EQ(in_quotes(std::string(41, 'x')), "'" + std::string(40, 'x') + "...'");
}

}  // namespace
}  // namespace limber::scene::formats
