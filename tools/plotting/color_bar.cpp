#include "tools/plotting/color_bar.h"

#include <algorithm>

namespace lodestone {

void draw_color_bar(Canvas& canvas, const CanvasBox& box, const Scale& scale, ColorRamp ramp, const std::string& title) {
  canvas.shade(box, [&](CanvasPoint point, Color& color) {
    color = ramp((box.bottom - point.y) / box.height());
    return true;
  });
  canvas.frame(box, ink::frame, 1.0);
  for (const double tick : scale.ticks(std::max(2, static_cast<int>(box.height() / 42.0)))) {
    const double y = box.bottom - scale.share(tick) * box.height();
    canvas.line({box.right, y}, {box.right + 5.0, y}, ink::frame, 1.0);
    canvas.text({box.right + 9.0, y}, tick_text(tick), ink::letter, ink::text, Anchor::begin, Anchor::middle);
  }
  canvas.text({0.5 * (box.left + box.right), box.top - 10.0}, title, ink::letter, ink::text, Anchor::middle,
              Anchor::end);
}

}  // namespace lodestone
