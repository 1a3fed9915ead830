// A drawing as SVG. Not written by cairo, because cairo converts text to outlines.
#include <fmt/format.h>

#include <string_view>

#include "tools/markup.h"
#include "tools/plotting/drawing_files.h"
#include "tools/plotting/png.h"

namespace lodestone {

namespace {

/// At most two decimals (a fiftieth of a real pixel), without trailing zeros.
std::string short_number(double value) {
  std::string text = fmt::format("{:.2f}", value);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string hex(Color color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color.red, color.green, color.blue);
}

std::string path_of(const std::vector<CanvasPoint>& points, bool closed) {
  std::string path;
  for (const CanvasPoint& point : points) {
    path += fmt::format("{}{} {}", path.empty() ? 'M' : 'L', short_number(point.x), short_number(point.y));
  }
  return closed ? path + "Z" : path;
}

struct SvgElement {
  std::string operator()(const AreaMark& area) const {
    std::string element = fmt::format("<path d=\"{}\" fill=\"{}\"", path_of(area.corners, true), hex(area.color));
    if (area.opacity < 1.0) element += fmt::format(" fill-opacity=\"{:.3g}\"", area.opacity);
    return element + "/>";
  }

  std::string operator()(const LineMark& line) const {
    std::string element = fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"",
                                      path_of(line.points, line.closed), hex(line.color), short_number(line.width));
    if (!line.closed) element += " stroke-linejoin=\"round\"";
    if (line.stroke != Stroke::solid) {
      const auto& pattern = line.stroke == Stroke::dashed ? kDashes : kDots;
      element += fmt::format(" stroke-dasharray=\"{} {}\"", short_number(pattern[0] * line.width),
                             short_number(pattern[1] * line.width));
    }
    return element + "/>";
  }

  std::string operator()(const DiskMark& disk) const {
    return fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" fill=\"{}\"/>", short_number(disk.center.x),
                       short_number(disk.center.y), short_number(disk.radius), hex(disk.color));
  }

  std::string operator()(const ImageMark& image) const {
    return fmt::format(
        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
        "xlink:href=\"{}\"/>",
        short_number(image.box.left), short_number(image.box.top), short_number(image.box.width()),
        short_number(image.box.height()), data_uri("image/png", encode_png(image.pixels)));
  }

  std::string operator()(const TextMark& text) const {
    static constexpr std::string_view kAnchors[] = {"start", "middle", "end"};
    const std::string x = short_number(text.at.x);
    const std::string y = short_number(text.at.y);
    std::string element = fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{}\"", x, y,
                                      short_number(text.size), hex(text.color));
    if (text.anchor != Anchor::begin) {
      element += fmt::format(" text-anchor=\"{}\"", kAnchors[static_cast<std::size_t>(text.anchor)]);
    }
    if (text.upward) element += fmt::format(" transform=\"rotate(-90 {} {})\"", x, y);
    return element + ">" + escape_html(text.text) + "</text>";
  }
};

/// A name made of the box: equal boxes of pictures on the same page share a definition.
std::string clip_name(const CanvasBox& box) {
  std::string name = "clip";
  for (const double value : {box.left, box.top, box.width(), box.height()})
    name.append("_").append(short_number(value));
  return name;
}

bool same(const std::optional<CanvasBox>& a, const std::optional<CanvasBox>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return a->left == b->left && a->top == b->top && a->right == b->right && a->bottom == b->bottom;
}

}  // namespace

std::string svg_of(const Drawing& drawing) {
  std::string svg = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"{0}pt\" height=\"{1}pt\" viewBox=\"0 0 {2} {3}\" "
      "font-family=\"DejaVu Sans, Verdana, sans-serif\">\n<rect width=\"{2}\" height=\"{3}\" fill=\"#ffffff\"/>\n",
      short_number(drawing.width * kPointsPerLogical), short_number(drawing.height * kPointsPerLogical),
      short_number(drawing.width), short_number(drawing.height));
  std::optional<CanvasBox> clip;
  for (const Mark& mark : drawing.marks) {
    if (!same(clip, mark.clip)) {
      if (clip) svg += "</g>\n";
      clip = mark.clip;
      if (clip) {
        svg += fmt::format(
            "<clipPath id=\"{0}\"><rect x=\"{1}\" y=\"{2}\" width=\"{3}\" height=\"{4}\"/></clipPath>\n"
            "<g clip-path=\"url(#{0})\">\n",
            clip_name(*clip), short_number(clip->left), short_number(clip->top), short_number(clip->width()),
            short_number(clip->height()));
      }
    }
    svg += std::visit(SvgElement{}, mark.shape) + "\n";
  }
  if (clip) svg += "</g>\n";
  return svg + "</svg>\n";
}

}  // namespace lodestone
