#include "tools/pictures/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/freetype.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "tools/sinks/output_file.h"

namespace lodestone {

namespace {

constexpr double kScale = 2.0;  // real pixels to a logical one
constexpr int kShift = 4;       // sub-pixel bits of OpenCV's drawing

constexpr std::array<const char*, 3> kFonts{"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                            "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
                                            "/usr/share/fonts/TTF/DejaVuSans.ttf"};

cv::Scalar scalar(Color color) { return cv::Scalar(color.blue, color.green, color.red); }

int real(double logical) { return static_cast<int>(std::lround(logical * kScale)); }

cv::Rect pixels(const CanvasBox& box, const cv::Mat& image) {
  return cv::Rect(cv::Point(real(box.left), real(box.top)), cv::Point(real(box.right), real(box.bottom))) &
         cv::Rect(0, 0, image.cols, image.rows);
}

/// The stroke font knows ASCII only.
std::string ascii(std::string text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kSpellings{
      {{"µ", "u"}, {"°", "deg"}, {"–", "-"}, {"−", "-"}, {"²", "2"}, {"σ", "sigma"}, {"∞", "inf"}}};
  for (const auto& [letter, spelling] : kSpellings) {
    for (std::size_t at = text.find(letter); at != std::string::npos; at = text.find(letter)) {
      text.replace(at, letter.size(), spelling);
    }
  }
  return text;
}

}  // namespace

struct Canvas::Sheet {
  cv::Mat image;
  cv::Rect clip;
  cv::Ptr<cv::freetype::FreeType2> font;

  cv::Mat view() { return image(clip); }

  /// In the coordinates of `view`. OpenCV keeps them in 32 bits with kShift behind the point: far ones are brought near.
  cv::Point fixed_point(CanvasPoint point) const {
    constexpr double kLimit = 1e5;
    const double x = std::clamp(point.x * kScale - clip.x, -kLimit, kLimit);
    const double y = std::clamp(point.y * kScale - clip.y, -kLimit, kLimit);
    return {static_cast<int>(std::lround(x * (1 << kShift))), static_cast<int>(std::lround(y * (1 << kShift)))};
  }

  int width(const std::string& text, double size) const {
    int baseline = 0;
    if (font) return font->getTextSize(text, real(size), -1, &baseline).width;
    return cv::getTextSize(ascii(text), cv::FONT_HERSHEY_SIMPLEX, real(size) / 30.0, 2, &baseline).width;
  }

  /// `at`: where the text's base line begins, in pixels of `target`.
  void put(cv::Mat& target, const std::string& text, cv::Point at, double size, Color color) const {
    if (font) {
      font->putText(target, text, at, real(size), scalar(color), -1, cv::LINE_AA, true);
    } else {
      cv::putText(target, ascii(text), at, cv::FONT_HERSHEY_SIMPLEX, real(size) / 30.0, scalar(color), 2, cv::LINE_AA);
    }
  }
};

Canvas::Canvas(double width, double height) : sheet_(std::make_unique<Sheet>()) {
  sheet_->image = cv::Mat(real(height), real(width), CV_8UC3, cv::Scalar::all(255));
  unclip();
  for (const char* path : kFonts) {
    if (!std::filesystem::exists(path)) continue;
    try {
      sheet_->font = cv::freetype::createFreeType2();
      sheet_->font->loadFontData(path, 0);
      break;
    } catch (const cv::Exception&) {
      sheet_->font.reset();  // an unreadable font: the stroke font serves
    }
  }
}

Canvas::~Canvas() = default;

void Canvas::clip(const CanvasBox& box) { sheet_->clip = pixels(box, sheet_->image); }

void Canvas::unclip() { sheet_->clip = cv::Rect(0, 0, sheet_->image.cols, sheet_->image.rows); }

void Canvas::fill(const CanvasBox& box, Color color, double opacity) {
  cv::Mat part = sheet_->image(pixels(box, sheet_->image) & sheet_->clip);
  if (part.empty()) return;
  const cv::Mat paint(part.size(), part.type(), scalar(color));
  cv::addWeighted(paint, opacity, part, 1.0 - opacity, 0.0, part);
}

void Canvas::frame(const CanvasBox& box, Color color, double width) {
  cv::rectangle(sheet_->image, pixels(box, sheet_->image), scalar(color), std::max(1, real(width)), cv::LINE_8);
}

void Canvas::line(CanvasPoint from, CanvasPoint to, Color color, double width) { polyline({from, to}, color, width); }

void Canvas::polyline(const std::vector<CanvasPoint>& points, Color color, double width) {
  std::vector<cv::Point> fixed;
  fixed.reserve(points.size());
  for (const CanvasPoint& point : points) {
    const cv::Point p = sheet_->fixed_point(point);
    if (fixed.empty() || fixed.back() != p) fixed.push_back(p);
  }
  cv::Mat view = sheet_->view();
  if (fixed.size() < 2 || view.empty()) return;
  cv::polylines(view, fixed, false, scalar(color), std::max(1, real(width)), cv::LINE_AA, kShift);
}

void Canvas::disk(CanvasPoint center, double radius, Color color) {
  cv::Mat view = sheet_->view();
  cv::circle(view, sheet_->fixed_point(center), real(radius) * (1 << kShift), scalar(color), cv::FILLED, cv::LINE_AA,
             kShift);
}

void Canvas::shade(const CanvasBox& box, const std::function<bool(CanvasPoint, Color&)>& color) {
  const cv::Rect area = pixels(box, sheet_->image) & sheet_->clip;
  for (int row = area.y; row < area.y + area.height; ++row) {
    for (int column = area.x; column < area.x + area.width; ++column) {
      Color pixel;
      if (!color({(column + 0.5) / kScale, (row + 0.5) / kScale}, pixel)) continue;
      sheet_->image.at<cv::Vec3b>(row, column) =
          cv::Vec3b(static_cast<uchar>(pixel.blue), static_cast<uchar>(pixel.green), static_cast<uchar>(pixel.red));
    }
  }
}

double Canvas::text_width(const std::string& text, double size) const { return sheet_->width(text, size) / kScale; }

void Canvas::text(CanvasPoint at, const std::string& text, double size, Color color, Anchor horizontal, Anchor vertical) {
  if (text.empty()) return;
  const int width = sheet_->width(text, size);
  // The height of a capital, whatever the letters are: so neighbours stand on one line.
  const int capital = static_cast<int>(0.73 * real(size));
  cv::Point corner(real(at.x), real(at.y));
  if (horizontal == Anchor::middle) corner.x -= width / 2;
  if (horizontal == Anchor::end) corner.x -= width;
  if (vertical == Anchor::begin) corner.y += capital;
  if (vertical == Anchor::middle) corner.y += capital / 2;
  sheet_->put(sheet_->image, text, corner, size, color);
}

void Canvas::vertical_text(CanvasPoint center, const std::string& text, double size, Color color) {
  const int height = 2 * real(size);
  cv::Mat lying(height, sheet_->width(text, size) + 8, CV_8UC3, cv::Scalar::all(255));
  sheet_->put(lying, text, {4, height / 2 + static_cast<int>(0.37 * real(size))}, size, color);
  cv::Mat standing;
  cv::rotate(lying, standing, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect wanted(real(center.x) - standing.cols / 2, real(center.y) - standing.rows / 2, standing.cols,
                        standing.rows);
  const cv::Rect seen = wanted & cv::Rect(0, 0, sheet_->image.cols, sheet_->image.rows);
  if (seen.empty()) return;
  standing(cv::Rect(seen.x - wanted.x, seen.y - wanted.y, seen.width, seen.height)).copyTo(sheet_->image(seen));
}

void Canvas::save(const std::filesystem::path& path) const {
  std::vector<uchar> encoded;
  cv::imencode(".png", sheet_->image, encoded);
  OutputFile file(path);
  file.write({reinterpret_cast<const char*>(encoded.data()), encoded.size()});
  file.commit();
}

}  // namespace lodestone
