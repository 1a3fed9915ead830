// One drawing in three file formats: each is complete for its viewers, and the same calls give the same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <regex>

#include "core/error.h"
#include "tests/tools/program_runner.h"
#include "tools/plotting/axes.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

void draw_everything(Canvas& canvas) {
  const CanvasBox box{40.0, 20.0, 240.0, 120.0};
  canvas.fill(box, {240, 240, 240});
  canvas.shade(
      box, [](CanvasPoint point) { return point.y > 60.0 ? point.x / 240.0 : NAN; }, ColorRamp::heat);
  canvas.clip(box);
  canvas.polygon({{50.0, 100.0}, {150.0, 30.0}, {400.0, 100.0}}, {0, 114, 178}, 0.3);
  canvas.polyline({{0.0, 0.0}, {100.0, 80.0}, {1e9, -1e9}}, {213, 94, 0}, 2.0, Stroke::dashed);
  canvas.unclip();
  canvas.disk({100.0, 80.0}, 4.0, {0, 0, 0});
  canvas.frame(box, ink::frame, 1.0);
  canvas.text({140.0, 130.0}, "|ΔB|, µT <√σ² & 90°>", 15.0, ink::text, Anchor::middle, Anchor::begin);
  canvas.vertical_text({16.0, 70.0}, "error, m", 15.0, ink::text);
}

/// Every element is closed in order, and no text contains a bare '&' or '<'.
void expect_well_formed(const std::string& xml) {
  std::vector<std::string> open;
  const std::regex tag(R"re(<(/?)([A-Za-z]+)((?:\s+[A-Za-z:-]+="[^"<]*")*)\s*(/?)>|<\?xml[^?]*\?>)re");
  std::size_t last = 0;
  for (std::sregex_iterator i(xml.begin(), xml.end(), tag), end; i != end; ++i) {
    const std::string between = xml.substr(last, static_cast<std::size_t>(i->position()) - last);
    EXPECT_EQ(between.find('<'), std::string::npos) << between;
    EXPECT_FALSE(std::regex_search(between, std::regex("&(?!amp;|lt;|gt;)"))) << between;
    last = static_cast<std::size_t>(i->position() + i->length());
    if (!(*i)[2].matched) continue;
    if ((*i)[1].length() > 0) {
      ASSERT_FALSE(open.empty()) << (*i)[2];
      EXPECT_EQ(open.back(), (*i)[2].str());
      open.pop_back();
    } else if ((*i)[4].length() == 0) {
      open.push_back((*i)[2].str());
    }
  }
  EXPECT_TRUE(open.empty());
  EXPECT_EQ(xml.find_first_not_of('\n', last), std::string::npos);
}

class CanvasFiles : public testing::Test {
 protected:
  std::string saved(const std::string& name, void (*draw)(Canvas&) = draw_everything) {
    Canvas canvas(300.0, 160.0);
    draw(canvas);
    canvas.save(folder_ / name);
    return content_of(folder_ / name);
  }
  TemporaryFolder folder_;
};

TEST_F(CanvasFiles, PngHasTwoPixelsToALogicalOne) {
  const std::string png = saved("a.png");
  ASSERT_GT(png.size(), 1000U);
  EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
  const auto number_at = [&](std::size_t at) {
    int value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = 256 * value + static_cast<unsigned char>(png[i]);
    return value;
  };
  EXPECT_EQ(number_at(16), 600);
  EXPECT_EQ(number_at(20), 320);
  EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
}

TEST_F(CanvasFiles, PdfIsWholeOfTheRightSizeAndKeepsItsFont) {
  const std::string pdf = saved("a.pdf");
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  EXPECT_THAT(pdf.substr(pdf.size() - 8), HasSubstr("%%EOF"));
  EXPECT_TRUE(std::regex_search(pdf, std::regex(R"(/MediaBox\s*\[\s*0 0 150 80\s*\])"))) << "half a point a pixel";
  EXPECT_THAT(pdf, HasSubstr("/ToUnicode"));
  EXPECT_THAT(pdf, HasSubstr("/Subtype /Image"));
}

TEST_F(CanvasFiles, SvgIsWellFormedAndKeepsLettersAsLetters) {
  const std::string svg = saved("a.svg");
  expect_well_formed(svg);
  EXPECT_THAT(svg, HasSubstr("width=\"150pt\" height=\"80pt\" viewBox=\"0 0 300 160\""));
  EXPECT_THAT(svg, HasSubstr(">|ΔB|, µT &lt;√σ² &amp; 90°&gt;</text>"));
  EXPECT_THAT(svg, HasSubstr("rotate(-90"));
  EXPECT_THAT(svg, HasSubstr("data:image/png;base64,iVBORw0KGgo"));
  EXPECT_THAT(svg, HasSubstr("stroke-dasharray=\"10 5\""));
}

TEST_F(CanvasFiles, TheSameCallsGiveTheSameBytes) {
  for (const char* ending : {"png", "pdf", "svg"}) {
    EXPECT_EQ(saved(std::string("a.") + ending), saved(std::string("b.") + ending)) << ending;
  }
}

TEST_F(CanvasFiles, WithoutAnExtensionAllThreeAreWritten) {
  saved("field_0.2");
  for (const std::string ending : {".png", ".pdf", ".svg"}) {
    EXPECT_EQ(content_of(folder_ / ("field_0.2" + ending)), saved("other" + ending));
  }
}

TEST_F(CanvasFiles, WhatIsNoLetterOrNoNumberSpoilsNothing) {
  const std::string svg = saved("a.svg", [](Canvas& canvas) {
    canvas.text({10.0, 10.0}, "run \xff\xc3\x01 µ", 15.0, ink::text, Anchor::begin, Anchor::begin);
    canvas.polyline({{0.0, 0.0}, {NAN, 3.0}, {std::numeric_limits<double>::infinity(), 3.0}, {5.0, 5.0}}, ink::text,
                    1.0);
  });
  expect_well_formed(svg);
  EXPECT_THAT(svg, HasSubstr(">run ??? µ</text>"));
  EXPECT_THAT(svg, HasSubstr("M0 0L5 5\""));
  EXPECT_EQ(saved("b.pdf",
                  [](Canvas& canvas) {
                    canvas.text({10.0, 10.0}, "run \xff\xc3\x01 µ", 15.0, ink::text, Anchor::begin, Anchor::begin);
                  })
                .substr(0, 5),
            "%PDF-");
}

TEST_F(CanvasFiles, AFolderThatIsNotThereIsNamed) {
  Canvas canvas(30.0, 30.0);
  EXPECT_THROW(canvas.save(folder_ / "missing/a.png"), InputError);
}

TEST(Canvas, MeasuresItsLetters) {
  const Canvas canvas(100.0, 100.0);
  const double once = canvas.text_width("error, m", 15.0);
  EXPECT_GT(once, 45.0);
  EXPECT_LT(once, 90.0);
  EXPECT_NEAR(canvas.text_width("error, m", 30.0), 2.0 * once, 1e-2);
  EXPECT_NEAR(canvas.text_width("error, merror, m", 15.0), 2.0 * once, 1e-2);
}

}  // namespace
}  // namespace lodestone
