// A drawing as PNG and PDF.
#include <cairo/cairo-pdf.h>
#include <cairo/cairo.h>
#include <fmt/format.h>

#include <memory>
#include <opencv2/imgproc.hpp>

#include "core/error.h"
#include "tools/plotting/drawing_files.h"
#include "tools/plotting/png.h"

namespace lodestone {

namespace {

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

void require(cairo_status_t status, const char* what) {
  if (status == CAIRO_STATUS_SUCCESS) return;
  throw InputError(fmt::format("the picture cannot be drawn as {}: {}", what, cairo_status_to_string(status)));
}

cairo_status_t append(void* target, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

void set_color(cairo_t* pen, Color color, double opacity = 1.0) {
  cairo_set_source_rgba(pen, color.red / 255.0, color.green / 255.0, color.blue / 255.0, opacity);
}

/// Disables hinting, so that letters have the same shape at every resolution.
void set_letters(cairo_t* pen, double size) {
  cairo_select_font_face(pen, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(pen, options);
  cairo_font_options_destroy(options);
  cairo_set_font_size(pen, size);
}

double width_of(cairo_t* pen, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(pen, text.c_str(), &extents);
  return extents.x_advance;
}

void trace(cairo_t* pen, const std::vector<CanvasPoint>& points) {
  cairo_new_path(pen);
  for (const CanvasPoint& point : points) cairo_line_to(pen, point.x, point.y);
}

/// The pixels of a surface, shared: blue, green, red, opacity, cairo's order on little-endian machines.
cv::Mat4b pixels_of(cairo_surface_t* surface) {
  cairo_surface_flush(surface);
  return {cairo_image_surface_get_height(surface), cairo_image_surface_get_width(surface),
          reinterpret_cast<cv::Vec4b*>(cairo_image_surface_get_data(surface)),
          static_cast<std::size_t>(cairo_image_surface_get_stride(surface))};
}

Surface image_surface(const cv::Mat4b& image) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, image.cols, image.rows), &cairo_surface_destroy);
  require(cairo_surface_status(surface.get()), "an image");
  image.copyTo(pixels_of(surface.get()));
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

struct Painter {
  cairo_t* pen;

  void operator()(const AreaMark& area) const {
    trace(pen, area.corners);
    set_color(pen, area.color, area.opacity);
    cairo_fill(pen);
  }

  void operator()(const LineMark& line) const {
    trace(pen, line.points);
    if (line.closed) cairo_close_path(pen);
    set_color(pen, line.color);
    cairo_set_line_width(pen, line.width);
    cairo_set_line_join(pen, line.closed ? CAIRO_LINE_JOIN_MITER : CAIRO_LINE_JOIN_ROUND);
    if (line.stroke != Stroke::solid) {
      const auto& pattern = line.stroke == Stroke::dashed ? kDashes : kDots;
      const double lengths[2] = {pattern[0] * line.width, pattern[1] * line.width};
      cairo_set_dash(pen, lengths, 2, 0.0);
    }
    cairo_stroke(pen);
  }

  void operator()(const DiskMark& disk) const {
    cairo_new_path(pen);
    cairo_arc(pen, disk.center.x, disk.center.y, disk.radius, 0.0, 2.0 * 3.14159265358979323846);
    set_color(pen, disk.color);
    cairo_fill(pen);
  }

  void operator()(const ImageMark& image) const {
    const Surface surface = image_surface(image.pixels);
    cairo_translate(pen, image.box.left, image.box.top);
    cairo_scale(pen, image.box.width() / image.pixels.cols, image.box.height() / image.pixels.rows);
    cairo_set_source_surface(pen, surface.get(), 0.0, 0.0);
    cairo_pattern_set_filter(cairo_get_source(pen), CAIRO_FILTER_NEAREST);
    cairo_paint(pen);
  }

  void operator()(const TextMark& text) const {
    set_letters(pen, text.size);
    const double share = text.anchor == Anchor::begin ? 0.0 : text.anchor == Anchor::middle ? 0.5 : 1.0;
    cairo_translate(pen, text.at.x, text.at.y);
    if (text.upward) cairo_rotate(pen, -0.5 * 3.14159265358979323846);
    cairo_move_to(pen, -share * width_of(pen, text.text), 0.0);
    set_color(pen, text.color);
    cairo_show_text(pen, text.text.c_str());
  }
};

void paint(const Drawing& drawing, cairo_t* pen, double scale, const char* what) {
  cairo_scale(pen, scale, scale);
  cairo_set_source_rgb(pen, 1.0, 1.0, 1.0);
  cairo_paint(pen);
  for (const Mark& mark : drawing.marks) {
    cairo_save(pen);
    if (mark.clip) {
      cairo_rectangle(pen, mark.clip->left, mark.clip->top, mark.clip->width(), mark.clip->height());
      cairo_clip(pen);
    }
    std::visit(Painter{pen}, mark.shape);
    cairo_restore(pen);
  }
  require(cairo_status(pen), what);
}

}  // namespace

double advance_of(const std::string& text, double size) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1), &cairo_surface_destroy);
  const Context pen(cairo_create(surface.get()), &cairo_destroy);
  set_letters(pen.get(), size);
  return width_of(pen.get(), text);
}

std::string png_of(const Drawing& drawing) {
  const Surface surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(drawing.width * kPixelsPerLogical + 0.5),
                                 static_cast<int>(drawing.height * kPixelsPerLogical + 0.5)),
      &cairo_surface_destroy);
  require(cairo_surface_status(surface.get()), "PNG");
  const Context pen(cairo_create(surface.get()), &cairo_destroy);
  paint(drawing, pen.get(), kPixelsPerLogical, "PNG");
  cv::Mat3b image;
  cv::cvtColor(pixels_of(surface.get()), image, cv::COLOR_BGRA2BGR);
  return encode_png(image);
}

std::string pdf_of(const Drawing& drawing) {
  std::string bytes;
  {
    const Surface surface(cairo_pdf_surface_create_for_stream(append, &bytes, drawing.width * kPointsPerLogical,
                                                              drawing.height * kPointsPerLogical),
                          &cairo_surface_destroy);
    require(cairo_surface_status(surface.get()), "PDF");
    // A fixed date, so that the same drawing gives the same bytes.
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "2000-01-01T00:00:00Z");
    {
      const Context pen(cairo_create(surface.get()), &cairo_destroy);
      paint(drawing, pen.get(), kPointsPerLogical, "PDF");
    }
    cairo_surface_finish(surface.get());
    require(cairo_surface_status(surface.get()), "PDF");
  }
  return bytes;
}

}  // namespace lodestone
