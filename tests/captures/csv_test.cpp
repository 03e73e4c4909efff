// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

class CsvTableTest : public testing::Test {
 protected:
  TemporaryFolder folder;
  CsvTable read(const std::string& content) { return CsvTable(folder.file("a.csv", content)); }
  std::string refusal(const std::string& content) {
    return rejection_message([&] { read(content); });
  }
};

TEST_F(CsvTableTest, FindsColumnsByNameInAnyOrder) {
  const CsvTable table = read("b,extra,a\n1,x,2\n3,,4\n");
  ASSERT_EQ(table.num_rows(), 2);
  EXPECT_EQ(table.get_cell_number(0, table.require_column("a")), 2);
  EXPECT_EQ(table.get_cell_number(1, table.require_column("b")), 3);
  EXPECT_EQ(table.get_cell_text(1, table.require_column("extra")), "");
  EXPECT_FALSE(table.find_column("c"));
}

TEST_F(CsvTableTest, ReadsQuotedFields) {
  const CsvTable table =
      read("image,a\n\"one, two.png\",1\n\"say \"\"hi\"\"\",2\n\"two\nlines\",3\n\"\",4\n");
  ASSERT_EQ(table.num_rows(), 4);
  const auto image = table.require_column("image");
  EXPECT_EQ(table.get_cell_text(0, image), "one, two.png");
  EXPECT_EQ(table.get_cell_text(1, image), "say \"hi\"");
  EXPECT_EQ(table.get_cell_text(2, image), "two\nlines");
  EXPECT_EQ(table.get_cell_text(3, image), "");
}

TEST_F(CsvTableTest, IgnoresCarriageReturnsByteOrderMarkAndEmptyLines) {
  const CsvTable table = read("\xEF\xBB\xBFimage,a\r\n\r\nx.png,1\r\ny.png,2\r\n\r\n");
  ASSERT_EQ(table.num_rows(), 2);
  EXPECT_EQ(table.get_cell_text(1, table.require_column("image")), "y.png");
  EXPECT_EQ(table.get_cell_integer(1, table.require_column("a")), 2);
}

TEST_F(CsvTableTest, HasNoRowsForHeaderAlone) { EXPECT_EQ(read("a,b\n").num_rows(), 0); }

TEST_F(CsvTableTest, RequireColumnThrowsForMissingColumn) {
  const CsvTable table = read("image,lamp\nx,1\n");
  EXPECT_THAT(rejection_message([&] { (void)table.require_column("u_px"); }),
              HasSubstr("a.csv:1: u_px: this column is missing; the columns are: image, lamp"));
}

TEST_F(CsvTableTest, ReportsLineOfRowWithWrongNumberOfFields) {
  EXPECT_THAT(refusal("a,b,c\n1,2,3\n1,2\n"), HasSubstr("a.csv:3: has 2 fields, the header has 3"));
  EXPECT_THAT(refusal("a,b,c\n1,2,3,4\n"), HasSubstr("a.csv:2: has 4 fields, the header has 3"));
  EXPECT_THAT(refusal("a,b,c\n1,2,3"), HasSubstr("a.csv:2: the last line has no end"));
}

TEST_F(CsvTableTest, ReportedLineCountsLineBreaksInQuotedFields) {
  EXPECT_THAT(refusal("a,b\n\"x\ny\",1\n\n\nz\n"), HasSubstr("a.csv:6: has 1 fields"));
}

TEST_F(CsvTableTest, RejectsInvalidQuotesDuplicateColumnsAndEmptyFile) {
  EXPECT_THAT(refusal("a,b\n1,\"2\n3,4\n"), HasSubstr("a.csv:2: a quote is not closed"));
  EXPECT_THAT(refusal("a,b\n1,x\"y\"\n"), HasSubstr("a.csv:2: a quote is not allowed here"));
  EXPECT_THAT(refusal("a,a\n1,2\n"), HasSubstr("a.csv:1: a: this column occurs twice"));
  EXPECT_THAT(refusal(std::string("a,b\n1,\0\n", 8)), HasSubstr("a.csv:2: is not a text file"));
  EXPECT_THAT(refusal(""), HasSubstr("a.csv: is empty"));
}

TEST_F(CsvTableTest, GetCellNumberReportsLineAndColumnOfInvalidNumber) {
  for (const std::string bad : {"", "x", "1.5 m", "nan", "inf", "-inf", "1e999", "0x10", "1,5"}) {
    const CsvTable table = read("image,u_px\nok,1\nbad,\"" + bad + "\"\n");
    EXPECT_THAT(
        rejection_message([&] { (void)table.get_cell_number(1, table.require_column("u_px")); }),
        HasSubstr("a.csv:3: u_px: should be a finite number, not '" + bad + "'"));
  }
  const CsvTable table = read("lamp\n1.5\n");
  EXPECT_THAT(
      rejection_message([&] { (void)table.get_cell_integer(0, table.require_column("lamp")); }),
      HasSubstr("a.csv:2: lamp: should be a whole number, not '1.5'"));
}

TEST_F(CsvTableTest, MessagesQuoteAtMost300BytesOfFile) {
  const std::string text(100'000, 'x');
  const CsvTable table = read("image,u_px\n" + text + "," + text + "\n" + text + ",1\n");
  EXPECT_LT(rejection_message([&] {
              (void)table.get_cell_number(0, table.require_column("u_px"));
            }).size(),
            600U);
  EXPECT_LT(std::string(InputError("a.csv", text).what()).size(), 320U);
}

TEST_F(CsvTableTest, ReturnsFieldsWrittenByCsvWriter) {
  const std::vector<std::string> fields{"plain", "a,b", "say \"hi\"", "two\nlines", " spaces ", ""};
  CsvWriter writer(folder / "b.csv", {"one", "two"});
  for (const std::string& field : fields) writer.write_csv_row({field, "x"});
  writer.save_file();
  const CsvTable table(folder / "b.csv");
  ASSERT_EQ(table.num_rows(), fields.size());
  for (std::size_t row = 0; row < fields.size(); ++row) {
    EXPECT_EQ(table.get_cell_text(row, table.require_column("one")), fields[row]);
  }
}

TEST_F(CsvTableTest, ReturnsFormulasThatCsvWriterEscapes) {
  const std::vector<std::string> formulas{"=1+1", "+A1", "-A1",    "@sum(a)", "\tx",  "\rx",
                                          "'=1",  "''=", "=\"a\"", "=a,b",    "-1-1", "+1 m"};
  CsvWriter writer(folder / "b.csv", {"one", "=two"});
  for (const std::string& formula : formulas) writer.write_csv_row({formula, "x"});
  writer.save_file();
  const std::string content = folder.read_content(folder / "b.csv");
  EXPECT_THAT(content, HasSubstr("\n\"'=1+1\",x\n"));
  const CsvTable table(folder / "b.csv");
  ASSERT_EQ(table.num_rows(), formulas.size());
  EXPECT_TRUE(table.find_column("=two"));
  for (std::size_t row = 0; row < formulas.size(); ++row) {
    EXPECT_EQ(table.get_cell_text(row, table.require_column("one")), formulas[row]);
  }
}

TEST_F(CsvTableTest, ReadsNumbersThatCsvWriterWritesWithoutEscape) {
  const std::vector<std::string> columns{"a", "b", "c", "d", "e", "f"};
  const std::vector<std::string> fields{"-0.5", "+1.5e-3", "-", "'quoted'", "a=b", "-inf"};
  CsvWriter writer(folder / "b.csv", columns);
  writer.write_csv_row(fields);
  writer.save_file();
  EXPECT_EQ(folder.read_content(folder / "b.csv"),
            "a,b,c,d,e,f\n-0.5,+1.5e-3,-,'quoted',a=b,-inf\n");
  const CsvTable table(folder / "b.csv");
  ASSERT_EQ(table.num_rows(), 1U);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    EXPECT_EQ(table.get_cell_text(0, table.require_column(columns[i])), fields[i]);
  }
  EXPECT_EQ(table.get_cell_number(0, table.require_column("a")), -0.5);
}

TEST_F(CsvTableTest, RejectsDuplicateColumnAmong200000Columns) {
  std::string header = "twice", row = "0";
  for (int i = 0; i < 200'000; ++i) {
    header += ",c" + std::to_string(i);
    row += ",0";
  }
  EXPECT_EQ(read(header + "\n" + row + "\n").num_rows(), 1);
  EXPECT_THAT(refusal(header + ",twice\n" + row + ",0\n"),
              HasSubstr("a.csv:1: twice: this column occurs twice"));
  const CsvTable table = read(header + "\n" + row + "\n");
  EXPECT_LT(rejection_message([&] { (void)table.require_column("u_px"); }).size(), 1000);
}

}  // namespace
}  // namespace vlp
