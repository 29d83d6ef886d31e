#include "chart.h"

#include <cairo/cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"

namespace curvesup {

namespace {

constexpr double kWidth = 900, kPanelHeight = 250, kTop = 54, kBottom = 52, kLeft = 78, kRight = 20, kGap = 30;

struct Range {
  double low = 1e300, high = -1e300;
  void include(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  // Never empty, never of length 0.
  void make_proper() {
    if (low > high) low = 0.0, high = 1.0;
    if (high - low < 1e-12 * std::max(1.0, std::abs(high))) high = low + std::max(1.0, std::abs(low)) * 0.1;
  }
};

Range x_range(const Chart& chart) {
  Range range;
  for (const ChartPanel& panel : chart.panels) {
    for (const ChartSeries& series : panel.series) {
      const double half = series.form == ChartSeries::Form::bars ? 0.5 * series.bar_width : 0.0;
      for (const double x : series.x) {
        range.include(x - half);
        range.include(x + half);
      }
    }
  }
  range.make_proper();
  return range;
}

Range y_range(const ChartPanel& panel) {
  Range range;
  for (const ChartSeries& series : panel.series) {
    for (const double y : series.y) range.include(std::min(y, panel.y_most));
  }
  if (panel.y_from_zero && range.low <= range.high) range.include(0.0);
  range.make_proper();
  const double margin = 0.05 * (range.high - range.low);
  if (!panel.y_from_zero || range.low < 0.0) range.low -= margin;
  range.high += margin;
  return range;
}

std::string tick_text(double value) {
  const std::string text = format("%.6g", std::abs(value) < 1e-12 ? 0.0 : value);
  return text;
}

class Drawing {
 public:
  explicit Drawing(double height)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kWidth), static_cast<int>(height)),
                 cairo_surface_destroy),
        pen_(cairo_create(surface_.get()), cairo_destroy) {
    cairo_set_source_rgb(pen_.get(), 1, 1, 1);
    cairo_paint(pen_.get());
    cairo_select_font_face(pen_.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    // Settings of the desktop must not change the picture.
    const std::unique_ptr<cairo_font_options_t, decltype(&cairo_font_options_destroy)> options(cairo_font_options_create(),
                                                                                              cairo_font_options_destroy);
    cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(pen_.get(), options.get());
  }

  void colour(const ChartColour& c, double opacity = 1.0) { cairo_set_source_rgba(pen_.get(), c.r, c.g, c.b, opacity); }
  void grey(double level) { cairo_set_source_rgb(pen_.get(), level, level, level); }

  void line(double x0, double y0, double x1, double y1) {
    cairo_set_line_width(pen_.get(), 1.0);
    cairo_move_to(pen_.get(), x0, y0);
    cairo_line_to(pen_.get(), x1, y1);
    cairo_stroke(pen_.get());
  }
  void box(double x, double y, double width, double height) {
    cairo_rectangle(pen_.get(), x, y, width, height);
    cairo_fill(pen_.get());
  }
  void polyline(const std::vector<std::array<double, 2>>& points) {
    cairo_set_line_width(pen_.get(), 1.4);
    cairo_set_line_join(pen_.get(), CAIRO_LINE_JOIN_ROUND);
    for (const auto& [x, y] : points) cairo_line_to(pen_.get(), x, y);
    cairo_stroke(pen_.get());
  }
  // `across`: 0 left, 0.5 centred, 1 right at x.
  void text(double x, double y, const std::string& words, double size, double across = 0.0) {
    cairo_set_font_size(pen_.get(), size);
    cairo_move_to(pen_.get(), x - across * width_of(words, size), y);
    cairo_show_text(pen_.get(), words.c_str());
  }
  double width_of(const std::string& words, double size) {
    cairo_set_font_size(pen_.get(), size);
    cairo_text_extents_t extents;
    cairo_text_extents(pen_.get(), words.c_str(), &extents);
    return extents.x_advance;
  }
  void upward_text(double x, double y, const std::string& words, double size) {
    cairo_save(pen_.get());
    cairo_translate(pen_.get(), x, y);
    cairo_rotate(pen_.get(), -1.5707963267948966);
    text(0, 0, words, size, 0.5);
    cairo_restore(pen_.get());
  }
  void clip(double x, double y, double width, double height) {
    cairo_save(pen_.get());
    cairo_rectangle(pen_.get(), x, y, width, height);
    cairo_clip(pen_.get());
  }
  void unclip() { cairo_restore(pen_.get()); }

  std::string png() {
    std::string bytes;
    const auto append = [](void* closure, const unsigned char* data, unsigned length) {
      static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
      return CAIRO_STATUS_SUCCESS;
    };
    const cairo_status_t status = cairo_surface_write_to_png_stream(surface_.get(), append, &bytes);
    if (status != CAIRO_STATUS_SUCCESS) throw Error(ErrorKind::internal, "plots", cairo_status_to_string(status));
    return bytes;
  }

 private:
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_;
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> pen_;
};

// Where a panel's numbers are on the picture.
struct Frame {
  double x, y, width, height;
  Range across, up;
  [[nodiscard]] double at_x(double v) const { return x + width * (v - across.low) / (across.high - across.low); }
  [[nodiscard]] double at_y(double v) const { return y + height * (1.0 - (v - up.low) / (up.high - up.low)); }
};

void draw_axes(Drawing& drawing, const Chart& chart, const ChartPanel& panel, const Frame& f, bool last) {
  for (const double tick : round_ticks(f.up.low, f.up.high, 5)) {
    const double y = std::floor(f.at_y(tick)) + 0.5;
    drawing.grey(0.9);
    drawing.line(f.x, y, f.x + f.width, y);
    drawing.grey(0.25);
    drawing.text(f.x - 7, y + 4, tick_text(tick), 12, 1.0);
  }
  if (chart.x_names.empty()) {
    for (const double tick : round_ticks(f.across.low, f.across.high, 9)) {
      const double x = std::floor(f.at_x(tick)) + 0.5;
      drawing.grey(0.9);
      drawing.line(x, f.y, x, f.y + f.height);
      drawing.grey(0.25);
      if (last) drawing.text(x, f.y + f.height + 17, tick_text(tick), 12, 0.5);
    }
  } else if (last) {
    drawing.grey(0.25);
    for (std::size_t i = 0; i < chart.x_names.size(); ++i) {
      drawing.text(f.at_x(static_cast<double>(i)), f.y + f.height + 17, chart.x_names[i], 12, 0.5);
    }
  }
  drawing.grey(0.25);
  drawing.upward_text(18, f.y + 0.5 * f.height, panel.y_label, 13);
}

void draw_series(Drawing& drawing, const ChartSeries& s, const Frame& f) {
  drawing.colour(s.colour, s.form == ChartSeries::Form::points ? 0.5 : 1.0);
  std::vector<std::array<double, 2>> points;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const double x = f.at_x(s.x[i]), y = f.at_y(s.y[i]);
    if (s.form == ChartSeries::Form::bars) {
      const double half = 0.5 * s.bar_width, left = f.at_x(s.x[i] - half), right = f.at_x(s.x[i] + half);
      const double bottom = f.at_y(s.base.empty() ? 0.0 : s.base[i]);
      const double gap = right - left > 4.0 ? 0.5 : 0.0;
      drawing.box(left + gap, y, std::max(right - left - 2.0 * gap, 0.5), bottom - y);
    } else if (s.form == ChartSeries::Form::points) {
      drawing.box(x - 1.0, y - 1.0, 2.0, 2.0);
    } else {
      points.push_back({x, y});
    }
  }
  if (!points.empty()) drawing.polyline(points);
}

// Above the panel, where no series is.
void draw_legend(Drawing& drawing, const ChartPanel& panel, const Frame& f) {
  double x = f.x + f.width + 10.0;
  for (auto series = panel.series.rbegin(); series != panel.series.rend(); ++series) {
    if (series->name.empty()) continue;
    x -= drawing.width_of(series->name, 12) + 26.0;
    drawing.colour(series->colour);
    drawing.box(x, f.y - 17.0, 11.0, 10.0);
    drawing.grey(0.15);
    drawing.text(x + 15.0, f.y - 8.0, series->name, 12);
  }
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(wanted, 1);
  double step = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
    if (factor * step >= raw * (1.0 - 1e-9)) {
      step *= factor;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  for (double i = first; i <= last; i += 1.0) ticks.push_back(i * step);
  return ticks;
}

std::string draw_chart(const Chart& chart) {
  const double count = static_cast<double>(chart.panels.size());
  const double panel_height = chart.panels.size() > 2 ? 130.0 : kPanelHeight;
  Drawing drawing(kTop + count * panel_height + (count - 1.0) * kGap + kBottom);
  drawing.grey(0.1);
  drawing.text(kLeft, 27, chart.title, 16);
  const Range across = x_range(chart);
  double y = kTop;
  for (std::size_t p = 0; p < chart.panels.size(); ++p) {
    const ChartPanel& panel = chart.panels[p];
    const Frame frame{kLeft, y, kWidth - kLeft - kRight, panel_height, across, y_range(panel)};
    draw_axes(drawing, chart, panel, frame, p + 1 == chart.panels.size());
    drawing.clip(frame.x, frame.y, frame.width, frame.height);
    for (const ChartSeries& series : panel.series) draw_series(drawing, series, frame);
    drawing.unclip();
    drawing.grey(0.45);
    drawing.line(frame.x + 0.5, frame.y, frame.x + 0.5, frame.y + frame.height);
    drawing.line(frame.x, frame.y + frame.height - 0.5, frame.x + frame.width, frame.y + frame.height - 0.5);
    draw_legend(drawing, panel, frame);
    y += panel_height + kGap;
  }
  drawing.grey(0.25);
  drawing.text(kLeft + 0.5 * (kWidth - kLeft - kRight), y - kGap + 40, chart.x_label, 13, 0.5);
  return drawing.png();
}

}  // namespace curvesup
